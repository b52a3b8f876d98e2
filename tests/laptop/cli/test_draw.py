"""`draw`: what is typed becomes pictures, a job, a run on the emulated brick; or is refused."""

import io
import re
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from run_json import run_in

from laptop.brick.jobs import BrickJobStatus
from laptop.cli.draw_simulated import PenChanger
from laptop.cli.job_display import JobDisplay, line_of
from laptop.cli.main import laptop
from laptop.drawing.sources import GALLERY
from laptop.drawing.test_patterns import reach_pattern
from laptop.record.figures import drawing_plot
from laptop.record.figures.line_accuracy import distances
from robot.motion.kinematics import forward
from shared.arm_description import find_arm, read_arm
from shared.job import Job

SQUARE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4">'
    '<rect x="0" y="0" width="3" height="3" fill="none" stroke="black"/></svg>'
)


TWO_PENS = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="4cm" height="4cm" viewBox="0 0 4 4" '
    'fill="none"><path d="M0,2H4" stroke="red"/><path d="M2,0V4" stroke="blue"/></svg>'
)


@pytest.fixture
def draw(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def run(*args, status=0, **options):
        done = CliRunner().invoke(laptop, ["draw", *args], **options)
        assert status in (None, done.exit_code), done.output
        return done

    return run


def test_the_help_has_five_examples(draw):
    done = draw("--help")
    assert len(re.findall(r"(?m)^    \S.* draw ", done.output.split("Examples:")[1])) == 5


def test_a_drawing_is_shown_before_and_nothing_moves(draw, tmp_path):
    done = draw("house", "--to", "rose.svg", "--to", "rose.png")
    assert "about " in done.output
    assert "rose.svg is written" in done.output
    assert "<svg" in (tmp_path / "rose.svg").read_text()
    assert cv2.imread(str(tmp_path / "rose.png")) is not None


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("args", "pauses"), [((), 1), (("--touch-up",), 2), (("--repeat", "2"), 3)]
)
def test_an_emulated_hand_puts_in_the_next_pen(draw, tmp_path, args, pauses):
    (tmp_path / "two.svg").write_text(TWO_PENS)
    done = draw(
        *("two.svg", "--size", "4", "--at", "13,0", "--pens", "colours", "--simulate"),
        *("--out", "try", *args),
    )
    assert len(re.findall("paused at .* (?:put in the pen|nudge the tip)", done.output)) == pauses
    (summary,) = run_in(tmp_path / "try")["drawings"]
    assert summary["time s"] < summary["estimated s"] + 8 * pauses
    assert summary["greatest mm"] < 3, "one pen's line is where the other's is not"


@pytest.mark.parametrize(
    ("line", "presses"),
    [
        ("paused at 61 %, stroke 4 of 5: put in the pen for 'red', then resume", 1),
        ("paused at 61 %, stroke 4 of 5: nudge the tip until it meets what is drawn", 1),
        ("paused at 61 %, stroke 4 of 5", 0),
        ("paused at 61 %, stroke 4 of 5: the link is lost", 0),
    ],
)
def test_the_hand_does_what_it_is_asked_for_and_nothing_else(line, presses):
    pressed = []
    hand = PenChanger()
    brick = SimpleNamespace(world=SimpleNamespace(now=lambda: 20.0))
    hand(brick, SimpleNamespace(press=pressed.append))
    hand.handle(line)
    assert [(press.button, press.t) for press in pressed] == [("enter", 25.0)] * presses


def test_what_cannot_be_reached_is_refused_but_shown(draw, tmp_path):
    args = ("--at", "20,0", "--size", "10", "--to", "rose.svg", "--to", "a.job")
    done = draw("rose", *args, status=1)
    assert "cannot be reached (red)" in done.output
    assert (tmp_path / "rose.svg").exists()
    assert not (tmp_path / "a.job").exists()


def test_a_job_is_written_for_the_arm(draw, tmp_path):
    (tmp_path / "square.svg").write_text(SQUARE)
    draw("square.svg", "--size", "4", "--to", "square.job")
    header = Job(str(tmp_path / "square.job"), read_arm(find_arm("planar"))).header
    assert header.cm == pytest.approx(16.0, abs=0.01)
    assert header.strokes == 1


def test_standard_input_is_read(draw, tmp_path):
    draw("-", "--size", "4", "--to", "a.job", input=SQUARE)
    assert (tmp_path / "a.job").exists()


@pytest.mark.parametrize("args", [("--text", "Hi\\nyou"), ("star",)])
def test_texts_and_cards_are_drawn(draw, args):
    draw(*args, "--size", "4", "--to", "a.job")


@pytest.mark.long
def test_it_is_tried_on_the_emulated_brick_with_its_truth_in_mm(draw, tmp_path):
    (tmp_path / "square.svg").write_text(SQUARE)
    done = draw("square.svg", "--size", "4", "--simulate", "--out", "try", "--to", "square.gif")
    assert (tmp_path / "square.gif").read_bytes().startswith(b"GIF8")
    assert "square.gif is written" in done.output
    assert sorted(path.name for path in (tmp_path / "try").iterdir()) == [
        *("picture.png", "run.json", "trace.csv")
    ]
    reported = run_in(tmp_path / "try")
    assert (reported["kind"], reported["what"]) == ("drawing", "drawing square.svg")
    assert reported["files"] == ["trace.csv", "picture.png"]
    (drawn,) = reported["drawings"]
    assert (drawn["arm"], drawn["drawing"], drawn["strokes drawn"]) == (
        *("planar", "square.svg", "1 of 1"),
    )
    assert drawn["estimated s"] == pytest.approx(drawn["time s"], abs=0.5)
    assert drawn["greatest mm"] < 4
    assert 0 < drawn["rms mm"] < drawn["greatest mm"]
    assert reported["pen_up_cm"] == 0
    assert "off by" in done.output


@pytest.mark.long
def test_a_trial_that_ends_before_the_first_stroke_says_so(draw, monkeypatch):
    monkeypatch.setattr(drawing_plot, "pen_down_runs", lambda rows: [])
    done = draw("star", "--size", "3", "--simulate", "--out", "try")
    assert "nothing was drawn" in done.output
    assert "nan" not in done.output


@pytest.mark.long
def test_it_is_begun_at_a_share_and_repeated_there(draw):
    draw("house", "--size", "6", "--simulate", "--out", "try", "--from", "90%", "--repeat", "2")


def test_the_boundary_of_the_reach_is_drawn_where_it_is(draw, tmp_path):
    draw("reach", "--to", "reach.job")
    arm = read_arm(find_arm("planar"))
    wished = reach_pattern(arm).strokes
    job = Job(str(tmp_path / "reach.job"), arm)
    pieces = [piece for k in range(1, job.header.strokes + 1) for piece in job.stroke(k).pieces]
    ends = np.array([forward(arm, piece[2]) for piece in pieces])
    assert np.min([distances(ends, stroke) for stroke in wished], axis=0).max() < 0.02
    done = draw("reach", "--rotate", "5", "--to", "reach.job", "--replace", status=2)
    assert "the card reach lies where it is: leave --rotate out" in done.output


def test_what_is_drawn_is_never_written_over(draw, tmp_path):
    mine = (GALLERY / "house.svg").read_bytes()
    (tmp_path / "mine.svg").write_bytes(mine)
    (tmp_path / "folder").mkdir()
    done = draw("mine.svg", "--to", "folder/../mine.svg", status=2)
    assert "mine.svg is what is drawn, too: write to another file" in done.output
    assert (tmp_path / "mine.svg").read_bytes() == mine
    (tmp_path / "other.svg").write_bytes(mine)
    assert "is there already" in draw("rose", "--to", "other.svg", status=1).output
    assert (tmp_path / "other.svg").read_bytes() == mine
    draw("rose", "--to", "other.svg", "--replace")
    assert (tmp_path / "other.svg").read_bytes() != mine


@pytest.mark.parametrize(
    ("args", "reported"),
    [
        ((), "give one thing to draw"),
        (("rose", "--text", "a"), "give one thing to draw"),
        (("nothing.svg",), "nothing.svg"),
        (("rose", "--size", "5x"), "write it as 5x10"),
        (("rose", "--at", "5"), "write it as 5,10"),
        (("rose", "--speed", "nan"), "0.5 to 50 cm/s"),
        (("rose", "--tolerance", "9"), "0 to 2 mm"),
        (("rose", "--paper", "a9"), "paper 'a9' is no sheet"),
        (("rose", "--elbow", "left"), "elbow 'left': give one of"),
        (
            ("rose", "--lettering", "height=1"),
            "--lettering is for",
        ),
        (
            ("--text", "H", "--tracing", "detail=9"),
            "--tracing is for",
        ),
        (("--text", "H", "--layer", "a"), "--layer is for a drawing made of an SVG, and H is none"),
        (("--line", "9,0 9,5", "--fill", "hatch"), "--fill is for"),
        (
            ("--text", "H", "--lettering", "height=1", "--size", "9"),
            "leave --size out",
        ),
        (("rose", "--layer", "ink"), "layer 'ink': rose has no layers"),
        (("rose", "--from", "140%"), "--from 140%"),
        (("rose", "--from", "\u0664\u0660%"), "as 40%"),
        (("rose", "--from", "4", "--resume"), "leave --from out"),
        (("rose", "--to", "rose.jpg"), ".job or .gif or .svg or .png"),
        (("rose", "--to", "rose.gif"), "give --simulate, too"),
        (
            ("rose", "--to", "no/rose.svg"),
            "no folder no",
        ),
        (("",), "a drawing: house"),
        (("rose", "--to", "a.svg", "--to", "./a.svg"), "a.svg is a file that is written"),
        (("--text", "a", "--lettering", "height=0"), "letters = 0 cm"),
        (("rose", "--arm", "nobody"), "nobody"),
        (("rose", "--to", "rose.svg", "--repeat", "3"), "leave --repeat out"),
        (("rose", "--to", "rose.job", "--from", "4"), "leave --from out"),
        (("rose", "--to", "rose.job", "--detach"), "leave --detach out"),
        (("rose", "--simulate", "--resume"), "leave --resume out"),
        (("rose", "--simulate", "--detach"), "leave --detach out"),
        (
            ("rose", "--to", "rose.job", "--out", "a"),
            "--out is for",
        ),
        (("rose", "--to", "-"), "- would be a file of this name"),
        (("https://a.org/b.svg",), "nothing is fetched from addresses; save it"),
    ],
)
def test_bad_input_is_told_in_a_line(draw, args, reported):
    done = draw(*args, status=None)
    assert done.exit_code in (1, 2)
    assert reported in done.output
    assert "Traceback" not in done.output


@pytest.mark.long
def test_the_time_that_is_told_is_that_of_what_is_drawn(draw, tmp_path):
    for args in ((), ("--repeat", "2"), ("--from", "50%")):
        draw("grid", "--size", "3", "--simulate", "--out", "out", *args)
        (drawn,) = run_in(tmp_path / "out")["drawings"]
        assert drawn["estimated s"] == pytest.approx(drawn["time s"], rel=0.06), args


def test_a_job_on_its_way_is_told_in_a_line():
    status = BrickJobStatus(
        "drawing", "rose", "", 3, 9, 12.5, 50.0, 75, 2, 3, (10.06, 4.2), 7.62, 60, -5.0
    )
    assert line_of(status) == (
        "rose: drawing, 25 %, stroke 3 of 9, time 2 of 3, 1 min 15 s left, tip 10.1, 4.2 cm, "
        "7.6 V, speed 60 %, pen -5 deg"
    )


@pytest.mark.parametrize("terminal", [False, True])
def test_every_state_is_shown(terminal):
    from rich.console import Console

    out = io.StringIO()
    display = JobDisplay(Console(file=out, force_terminal=terminal, width=200))
    with display.shown():
        for state in ("drawing", "paused", "drawing", "done"):
            display.show(BrickJobStatus(state, "rose", cm=5, cm_all=10))
    assert ("space pauses" in out.getvalue()) == terminal
    if not terminal:
        assert [line.split(",")[0] for line in out.getvalue().splitlines()] == [
            *("rose: drawing", "rose: paused", "rose: drawing", "rose: done")
        ]
