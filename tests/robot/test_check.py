"""`driver.py check`: what is mounted otherwise is named and corrected before anything goes far.

Who answers looks at the true angles of the emulated arm, which is built otherwise than the file.
"""

import io
import json
import math
import os
import shutil
import signal

import pytest
from refusals import in_one_line
from rig import Shell, degrees

from laptop.emulator.device.buttons import read_press
from laptop.emulator.onlooker import Onlooker
from robot.motion.checked import Checked
from shared.arm_description import find_arm, read_arm

MOST = 10.0  # deg


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    """Build a Shell whose arm is `built` otherwise than the file that its programs read."""

    def build(arm="planar", built=None, **options):
        options = {"checked": False, "homed": False, **options}
        sh = Shell(tmp_path / "state", monkeypatch, capsys, arm=arm, built=built, **options)
        monkeypatch.setenv("BRICKSERVO_ARM", arm)
        monkeypatch.setattr("sys.stdin", Onlooker(sh.brick))
        return sh

    (tmp_path / "state").mkdir()
    return build


def otherwise(arm, ports=None, reverse=()):
    """The arm with its joints at other ports, and some motors the other way round."""
    return arm._replace(
        joints=tuple(
            joint._replace(
                port=port, direction=-joint.direction if k in reverse else joint.direction
            )
            for k, (joint, port) in enumerate(zip(arm.joints, ports or "ABC"))
        )
    )


def described():
    """The text of the planar arm's file."""
    with open(find_arm("planar")) as file:
        return file.read()


def turned(sh):
    """Greatest true angle, deg, by which a joint ever was from where it stood."""
    first = sh.brick.record[0].q
    return max(
        abs(math.degrees(a - b)) for sample in sh.brick.record for a, b in zip(sample.q, first)
    )


WRONG = [
    ("planar", None, (0,), ["the shoulder turns the other way round", "[shoulder] direction = -1"]),
    ("planar", None, (1,), ["the elbow turns the other way round", "[elbow] direction = -1"]),
    ("planar", None, (0, 1), ["the shoulder turns", "the elbow turns"]),
    ("planar", "BA", (), ["shoulder and elbow are swapped", "[elbow] port = A, [shoulder] port"]),
    ("planar", "BA", (1,), ["shoulder and elbow are swapped", "the elbow turns the other way"]),
    ("geared", "BA", (0,), ["shoulder and elbow are swapped", "the shoulder turns the other way"]),
    ("spatial", "ACB", (), ["shoulder and elbow are swapped"]),
    ("spatial", "BCA", (2,), ["each at another's port", "the elbow turns the other way round"]),
]


@pytest.mark.short(every=2)
@pytest.mark.parametrize(("name", "ports", "reverse", "says"), WRONG)
def test_what_is_mounted_otherwise_is_named_and_corrected(shell, name, ports, reverse, says):
    built = otherwise(read_arm(find_arm(name)), ports, reverse)
    sh = shell(name, built)
    shown = sh.run("check")
    assert (shown.status, shown.err) == (0, "")
    assert all(expected in shown.out for expected in says), shown.out
    assert turned(sh) < MOST
    found = read_arm(find_arm(name))
    assert found.file == os.path.join(sh.state_folder, "arms", name + ".ini")
    assert [(j.port, j.direction) for j in found.joints] == [
        (j.port, j.direction) for j in built.joints
    ]
    shown = sh.run("home", "--here")
    assert (shown.status, shown.err) == (0, "")


@pytest.mark.short("planar")
@pytest.mark.parametrize("name", ["planar", "geared", "spatial"])
def test_an_arm_that_is_as_described_passes_and_no_file_is_written(shell, name):
    sh = shell(name)
    shown = sh.run("check")
    assert (shown.status, shown.err) == (0, "")
    assert "checked: " in shown.out
    assert "written" not in shown.out
    assert 3 < turned(sh) < MOST
    assert find_arm(name) == sh.arm.file
    assert sh.run("home", "--here").status == 0
    assert not sh.brick.driven()


@pytest.mark.parametrize(
    "expected",
    [("home",), ("home", "--here"), ("line", "10,0", "5,10"), ("move", "12,6"), ()],
    ids=lambda expected: " ".join(expected) or "nothing",
)
@pytest.mark.parametrize("homed", [False, True])
def test_until_then_nothing_moves(shell, expected, homed):
    sh = shell(homed=homed)
    shown = sh.run(*expected)
    assert shown.status == 1
    assert in_one_line(shown.err, "was never checked", "type driver.py check")
    assert sh.writes == []


def test_where_the_arm_is_may_be_asked(shell):
    assert shell(homed=True).run("where").status == 0


@pytest.mark.parametrize(
    "moves",
    [
        "arm.go_to([0.5, 0.5])",
        "arm.home(here=True)",
        "arm.step_to([0.1, 0.1])",
        "arm.move_pen(0.5)",
    ],
)
def test_a_program_of_ones_own_is_refused_likewise(shell, tmp_path, moves):
    sh = shell(homed=True)
    script = tmp_path / "own.py"
    script.write_text(
        "from robot.api import Clock, NotChecked, RobotArm, find_arm, read_arm\n"
        "arm = RobotArm(read_arm(find_arm('planar')), Clock())\n"
        "arm.load_zero()\n"
        "try:\n    " + moves + "\nexcept NotChecked as error:\n    print(error)\n"
    )
    outcome, out, _ = sh.type(str(script))
    assert outcome.status == 0
    assert in_one_line(out, "was never checked", "driver.py check")
    assert sh.writes == []


# The arm's file


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_of_ones_own_is_changed_where_it_is_and_nothing_else_in_it(
    shell, tmp_path, monkeypatch, end
):
    text = described().replace("\n", end)
    mine = tmp_path / "mine.ini"
    mine.write_bytes(text.encode())
    sh = shell(str(mine), otherwise(read_arm(str(mine)), "BA", (1,)))
    assert sh.run("check").status == 0
    before, after = text.split(end), mine.read_bytes().decode().split(end)
    assert [(a, b) for a, b in zip(before, after) if a != b] == [
        ("port = A            ; of the brick: A, B, C or D",
         "port = B            ; of the brick: A, B, C or D"),
        ("port = B", "port = A"),
        ("direction = 1 ", "direction = -1 "),
    ]  # fmt: skip
    assert len(before) == len(after)


def test_a_file_that_cannot_be_written_is_told_with_what_to_write(shell, tmp_path):
    mine = tmp_path / "mine.ini"
    shutil.copy(find_arm("planar"), str(mine))
    (tmp_path / "mine.ini.new").mkdir()
    sh = shell(str(mine), otherwise(read_arm(str(mine)), reverse=(1,)))
    shown = sh.run("check")
    assert shown.status == 1
    assert in_one_line(shown.err, "is not changed", "write there: [elbow] direction = -1")
    assert sh.run("home", "--here").status == 1


def test_the_users_own_arm_of_that_name_is_not_overwritten(shell, monkeypatch):
    sh = shell(built=otherwise(read_arm(find_arm("planar")), reverse=(1,)))
    monkeypatch.setenv("BRICKSERVO_ARM", sh.arm.file)
    own = os.path.join(sh.state_folder, "arms", "planar.ini")
    with open(own, "w") as file:
        file.write("mine")
    shown = sh.run("check")
    assert shown.status == 1
    assert in_one_line(shown.err, "for it is yours")
    with open(own) as file:
        assert file.read() == "mine"


# How long the answer holds


def test_another_direction_in_the_file_makes_the_answer_void(shell, tmp_path):
    mine = tmp_path / "mine.ini"
    text = described()
    mine.write_text(text)
    sh = shell(str(mine))
    assert sh.run("check").status == 0
    mine.write_text(text.replace("direction = 1 ", "direction = -1", 1))
    assert in_one_line(sh.run("home", "--here").err, "shoulder.direction = 1, not -1", "check")
    mine.write_text(text.replace("speed = 12", "speed = 8"))
    assert sh.run("home", "--here").status == 0


def test_a_motor_that_was_plugged_in_anew_makes_the_answer_void(tmp_path):
    checked = Checked(read_arm(find_arm("planar")), str(tmp_path))
    checked.save({"A": "motor9", "B": "motor10"})
    checked.confirm(lambda: {"A": "motor9", "B": "motor10"})
    checked.needed = True
    with pytest.raises(Exception, match="port B was plugged in anew"):
        checked.confirm(lambda: {"A": "motor9", "B": "motor11"})
    with open(checked.file) as file:
        known = json.loads(file.read())
    known["boot"] = "an earlier start of the brick"
    with open(checked.file, "w") as file:
        file.write(json.dumps(known))
    checked.confirm(lambda: {"A": "motor0", "B": "motor1"})


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"arm": 1, "motors": 2}', "\0"])
def test_a_spoilt_answer_is_none(tmp_path, text):
    checked = Checked(read_arm(find_arm("planar")), str(tmp_path))
    with open(checked.file, "w") as file:
        file.write(text)
    with pytest.raises(Exception, match="cannot be understood; nothing moves"):
        checked.confirm(dict)


def test_a_zero_that_was_known_stays_known(shell):
    sh = shell(homed=True)
    assert sh.run("check").status == 0
    assert sh.run("line", "10,0", "5,10").status == 0


# Whatever goes wrong


@pytest.mark.parametrize("typed", ["", "\n", "\ns\nl\n", "\nx\n"])
def test_the_end_of_the_input_ends_it_with_all_stopped(shell, monkeypatch, typed):
    sh = shell()
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    shown = sh.run("check")
    assert shown.status == 1
    assert in_one_line(shown.err, "nobody answers")
    assert not sh.brick.driven()
    assert sh.run("home", "--here").status == 1
    assert ("none of the keys" in shown.out) == ("x" in typed)


@pytest.mark.parametrize("t", [0.6, 1.5, 3.0])
def test_a_signal_stops_it(shell, t):
    sh = shell()
    shown = sh.run("check", signals=[(t, signal.SIGINT)])
    assert shown.status == 130
    assert in_one_line(shown.err, "stopped by SIGINT")
    assert max(sh.busy.values()) < t + 0.1
    assert sh.run("home", "--here").status == 1


@pytest.mark.parametrize("fault", ["jam", "kill_encoder"])
def test_a_joint_that_does_not_turn_is_named(shell, fault):
    sh = shell()
    getattr(sh.brick, fault)("B")
    shown = sh.run("check")
    assert shown.status == 1
    assert in_one_line(shown.err, "the elbow (port B) does not turn", "check again")
    assert not sh.brick.driven()


def test_a_joint_at_its_stop_is_to_be_moved_away(shell):
    sh = shell(start=degrees(178, 0))
    assert in_one_line(sh.run("check").err, "the shoulder", "stands at a stop, move it away")


def test_a_motor_that_moves_nothing_has_more_play_than_described(shell):
    sh = shell(plant="backlash=18")
    shown = sh.run("check")
    assert shown.status == 1
    assert in_one_line(
        shown.err, "port A turned, and nothing moved", "backlash = 2 of [shoulder]", "planar.ini"
    )


def test_two_motors_cannot_move_the_same_part(shell, monkeypatch):
    sh = shell()
    monkeypatch.setattr("sys.stdin", io.StringIO("\ne\nl\ne\nl\n"))
    assert in_one_line(sh.run("check").err, "ports A and B both moved the elbow")


# At the brick


def test_from_the_bricks_menu_it_is_asked_by_buttons(shell):
    sh = shell()
    presses = ["enter@2", "down@10", "left@14", "right@17", "right@25", "left@28"]
    shown = sh.run(presses=[read_press(text) for text in presses])
    assert (shown.status, shown.err) == (0, "")
    assert "the shoulder turns the other way round" in shown.out
    assert "Start driver.py again" in shown.out
    lines = shown.out.splitlines()
    at = lines.index("Which part moved?")
    assert lines[at + 1 : at + 5] == [
        "LEFT   shoulder",
        "RIGHT  elbow",
        "UP     nothing",
        "DOWN   again",
    ]
    assert turned(sh) < MOST
