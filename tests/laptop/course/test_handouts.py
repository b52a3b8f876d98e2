"""A class's handouts: what students get fails its check and says why, what is right passes."""

import difflib
import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

from laptop.cli.main import laptop
from laptop.course import basins, criteria, examination
from laptop.course.examination import CannotExamine, ask
from laptop.course.handouts import HANDOUTS, NoHandout, handout_of, write_handouts
from laptop.emulator.host import processor
from robot.motion.inverse_iteration import newton_inverse
from shared.arm_description import find_arm, read_arm

GAINS = "KP, KI, KD = 3.0, 6.0, 0.15"
"""Of the solution."""
SLOW = {"servoing"}
"""Their pictures are rendered, one by one."""


def cases():
    return [
        pytest.param(handout, id=handout.name, marks=[pytest.mark.long] * (handout.name in SLOW))
        for handout in HANDOUTS
    ]


def check(*files):
    """Status and output of `class check`."""
    result = CliRunner().invoke(laptop, ["class", "check", *map(str, files)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def changed(handout, folder, *changes):
    """A solution with something wrong in it."""
    text = handout.solution
    for right, wrong in changes:
        assert text.count(right) == 1, right
        text = text.replace(right, wrong)
    file = folder / handout.script
    file.write_text(text, encoding="utf-8")
    return file


def named(name):
    return next(handout for handout in HANDOUTS if handout.name == name)


@pytest.mark.parametrize("handout", cases())
def test_a_solution_passes(handout, tmp_path):
    status, output = check(changed(handout, tmp_path))
    assert status == 0, output
    assert "WRONG" not in output
    assert output.splitlines()[-1] == "all is right"


@pytest.mark.parametrize("handout", cases())
def test_a_skeleton_fails_and_is_told_why_in_figures(handout, tmp_path):
    (tmp_path / handout.script).write_text(handout.skeleton, "utf-8")
    status, output = check(tmp_path / handout.script)
    assert status == 1
    assert "Traceback" not in output
    wrong = [line for line in output.splitlines() if line.startswith("  WRONG")]
    assert output.splitlines()[-1] == f"{len(wrong)} wrong"
    assert all(len(line) < 250 for line in wrong)
    expected = {
        "kinematics": r"forward\(\[.*\]\) gives \[0\., 0\.\], but it is \[.*\] cm",
        "pid": r"the elbow does not move; does control\(\) return a duty\?",
        "line": r"the ink is up to 3\d\.\d mm off the straight line, 8 are allowed",
        "servoing": r"at the end the tip truly is \d+\.\d px off the goal, 8 are allowed",
    }[handout.name]
    assert any(re.search(expected, line) for line in wrong), output


@pytest.mark.parametrize(
    ("name", "right", "wrong", "told"),
    [
        # Each is something that a student would write.
        ("kinematics", "[-y, -L2", "[y, -L2", r"WRONG  jacobian"),
        ("kinematics", "c * e[0]) / det", "c * e[0]) * det", r"WRONG  newton_step"),
        ("kinematics", "* x / square for", "* x / 2 for", r"WRONG  broyden_update: the new J"),
        ("kinematics", "(d - row[0]", "(d + 1 - row[0]", r"WRONG  broyden_update: the new J"),
        ("kinematics", "* x / square for", "/ sum(dq) for", r"changes J in a direction that the"),
        ("kinematics", "return poses", "return None", r"WRONG  Newton: search fails"),
        ("kinematics", "arm.go_to(newton[-1])", "pass", r"right  Newton(.|\n)*WRONG  goal \(14"),
        ("pid", GAINS, "KP, KI, KD = 3.0, 0, 0", r"WRONG  free, to 40 deg"),
        ("pid", GAINS, "KP, KI, KD = 3.0, 0, 0.15", r"right  free(.|\n)*WRONG  pushed, to -20"),
        ("pid", GAINS, "KP, KI, KD = 0.3, 0.1, 0", r"WRONG.*near after (1|2|inf)"),
        ("pid", "(40, -20, 10)", "(40, -20)", r"WRONG  free, to 10 deg"),
        ("line", "pen.on_for_degrees(30, 60)", "pass", r"WRONG  there is no ink"),
        ("line", "(d * x - b * y) / det", "(d * x + b * y) / det", r"WRONG  "),
        (
            "line",
            "pen.on_for_degrees(30, 60)",
            "input()",
            r"WRONG  the script failed: line \d+: EOF",
        ),
        ("line", "import math", "import maths", r"WRONG  the script failed: line \d+: .*maths"),
        pytest.param(
            *("servoing", "u2 / TEST_MOVE], [v1 /", "v1 / TEST_MOVE], [u2 /"),
            r"WRONG  first_jacobian",
            marks=pytest.mark.claims,
        ),
        pytest.param(
            *("servoing", "return [-(d", "return [(d"),
            r"WRONG  step\((.|\n)*WRONG  camera 1: .* px off the goal",
            marks=pytest.mark.claims,
        ),
    ],
)
def test_what_is_wrong_is_named(name, right, wrong, told, tmp_path):
    status, output = check(changed(named(name), tmp_path, (right, wrong)))
    assert status == 1
    assert re.search(told, output), output


def test_a_function_that_raises_is_told_with_its_line(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("def f(x):\n    return 1 / x\n")
    right, wrong = ask(file, [("f", [2]), ("f", [0])])
    assert (right.value, right.error) == (0.5, "")
    assert wrong.error == "line 2: ZeroDivisionError: division by zero"
    (missing,) = ask(file, [("h", [])])
    assert "AttributeError" in missing.error
    file.write_text("def f(x)\n")
    with pytest.raises(CannotExamine, match=r"mine\.py cannot be imported: line 1: SyntaxError"):
        ask(file, [("f", [2])])


@pytest.mark.parametrize(
    ("loop", "when"),
    [
        ("while True: time.sleep(0.1)", "after 15 s of the brick's time"),
        pytest.param(
            *("while True: pass", "after 15 s of the brick's time"), marks=pytest.mark.long
        ),
        pytest.param("for _ in itertools.count(): pass", "at last", marks=pytest.mark.long),
    ],
)
def test_a_function_that_never_ends_is_told_and_the_others_answer(
    loop, when, tmp_path, monkeypatch
):
    monkeypatch.setattr(examination, "PATIENCE", 0.5)  # for what never looks at the clock
    file = tmp_path / "mine.py"
    file.write_text(
        f"import itertools, time\n\ndef f():\n    return 1\n\ndef g():\n    {loop}\n\n"
        "def h():\n    return g()\n"
    )
    answers = ask(file, [("f", []), ("g", []), ("f", []), ("h", []), ("g", []), ("f", [])])
    assert [answer.value for answer in answers] == [1, None, 1, None, None, 1]
    assert [answer.endless for answer in answers] == [False, True, False, True, True, False]
    told = f"it does not end; {when} it was at line 7 (g)"
    assert answers[1].error == f"{told}: `{loop}`. Does the loop there ever end?"
    assert answers[3].error.startswith(f"{told}, called at line 10 (h): ")


def test_a_script_that_never_ends_when_it_is_imported_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(processor, "MAX_START", 0.5)
    file = tmp_path / "mine.py"
    file.write_text("k = 0\nwhile True:\n    k += 1\n")
    with pytest.raises(CannotExamine, match=r"imported: it does not end; .* line 2: `while True:`"):
        ask(file, [("f", [])])


@pytest.mark.parametrize(
    ("name", "right", "wrong", "told"),
    [
        (
            "kinematics",
            "square = dq",
            "while dq: pass\n    square = dq",
            r"broyden_update fails: it does not end; .*line 48 (.|\n)*the arm is not tried while",
        ),
        ("pid", "time.monotonic() - begin < STAY", "True", r"after 45 s .* at line 42 \(main\)"),
        pytest.param(
            *("line", "t = time.monotonic() - begin", "t = 0.0"),
            r"after 45 s .* at line \d+ \(\w+\)",
            marks=pytest.mark.long,
        ),
    ],
)
def test_of_a_script_that_never_ends_no_more_is_told_than_that(name, right, wrong, told, tmp_path):
    status, output = check(changed(named(name), tmp_path, (right, wrong)))
    assert status == 1
    assert re.search(told, output), output
    assert "truly" not in output
    assert output.count("WRONG") <= 3


@pytest.mark.claims
def test_a_script_that_never_ends_is_not_tried_before_another_camera(tmp_path):
    change = ("math.hypot(*e) < NEAR_ENOUGH", "False"), ("range(1, MOST_STEPS + 1)", "iter(int, 1)")
    status, output = check(changed(named("servoing"), tmp_path, *change))
    assert (status, output.count("WRONG")) == (1, 1), output
    assert "it does not end; after 45 s" in output


def test_an_answer_that_is_no_number_is_shown(tmp_path):
    file = changed(named("kinematics"), tmp_path, ("det = a * d - b * c", "return 'up'"))
    output = check(file)[1]
    assert re.search(r"WRONG  newton_step\(.*\) gives 'up', not 2 numbers", output), output


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("homework.py", "begin the file's name with that of its handout: kinematics.py, pid.py"),
        ("pid_nobody.py", "there is no such file; give the path of your script"),
    ],
)
def test_a_wrong_file_is_refused_in_a_line(name, told, tmp_path):
    result = CliRunner().invoke(laptop, ["class", "check", str(tmp_path / name)])
    assert result.exit_code == 1
    assert told in result.output


def test_a_whole_class_is_checked_at_once(tmp_path):
    line = named("line")
    files = [tmp_path / name for name in ("kinematics_cy.py", "line_anna.py", "line-Björn.py")]
    files[0].write_text("def forward(q)\n")  # it stops nobody else's check
    files[1].write_text(line.solution, "utf-8")
    files[2].write_text(line.skeleton, "utf-8")
    status, output = check(*files)
    assert status == 1
    told = "kinematics_cy.py: 1. F", "line_anna.py: 3. A", "line-Björn.py: 3. A"
    assert [word in output for word in told] == [True] * 3
    assert "WRONG  kinematics_cy.py cannot be imported: line 1: SyntaxError" in output
    assert output.count("WRONG") == 3


@pytest.mark.long
def test_the_handouts_go_into_a_class_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(basins, "draw_basins", lambda arm, goal: png())
    files = write_handouts(tmp_path / "7b")
    assert sorted(file.name for file in files) == sorted(
        [f"{handout.name}{ending}" for handout in HANDOUTS for ending in (".py", ".html")]
    )
    for handout in HANDOUTS:
        page = (tmp_path / "7b" / f"{handout.name}.html").read_text("utf-8")
        assert handout.title.replace("'", "&#39;") in page
        assert f"class check {handout.script}" in page
        assert re.findall(r"(?:src|href)=\"(?!data:)", page) == []  # it needs nothing else
        assert (tmp_path / "7b" / handout.script).read_bytes() == handout.skeleton.encode()
    with pytest.raises(NoHandout, match="is there already"):
        write_handouts(tmp_path / "7b")
    write_handouts(tmp_path / "staff", solutions=True)
    assert sorted(file.name for file in (tmp_path / "staff" / "solutions").iterdir()) == sorted(
        handout.script for handout in HANDOUTS
    )


def test_skeleton_and_solution_are_one_script_but_for_the_answers():
    for handout in HANDOUTS:
        skeleton, solution = handout.skeleton.splitlines(), handout.solution.splitlines()
        for mark in ("# ->", "# <-"):
            assert mark in handout.source.read_text("utf-8")
            assert mark not in handout.skeleton + handout.solution
        assert "TODO" not in handout.solution
        own = [line for line in difflib.ndiff(skeleton, solution) if line[0] in "-+"]
        assert sum("TODO" in line for line in own) == 1 + handout.skeleton.count(" # TODO")
        answers = [line[2:] for line in own if line[0] == "+" and len(line.split()) > 2]
        assert not set(answers) & set(skeleton), "no skeleton holds its answers"
        assert handout_of(handout.source) is handout


def test_a_basin_is_the_pose_that_lies_near():
    """By starts at the poses themselves, as plain trigonometry gives them."""
    arm, goal = read_arm(find_arm("planar")), (9.0, 8.0)
    first, second = (joint.link for joint in arm.joints)
    x, y = goal
    elbow = math.acos((x * x + y * y - first**2 - second**2) / (2 * first * second))
    for sign in (1, -1):
        bent = sign * elbow
        shoulder = math.atan2(y, x) - math.atan2(
            second * math.sin(bent), first + second * math.cos(bent)
        )
        around = np.array([-0.2, 0.0, 0.2])
        found, steps = basins.basin(newton_inverse, arm, goal, shoulder + around, bent + around)
        assert (found == sign).all()
        assert steps[1, 1] == 0
        assert (np.delete(steps.ravel(), 4) >= 2).all()


def test_resting_places_are_where_the_tip_stays():
    t = np.arange(0, 3, 0.005)
    x = np.where(t < 1, 0.0, np.where(t < 2, 5 * (t - 1), 5.0))
    zero = np.zeros_like(t)
    run = criteria.TrialRun(
        "", False, t, np.zeros((len(t), 2)), np.column_stack([x, zero]), zero > 0
    )
    places = sorted({round(place[0], 1) for place in criteria.resting_places(run)})
    assert places == [0.0, 5.0]


def png():
    import cv2

    return cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1].tobytes()
