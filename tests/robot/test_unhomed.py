"""Nothing moves before its zero is known, by whatever door, and it is said why.

The oracle is the trace that `simulate` leaves: the true angles of an arm that was never homed.
"""

import csv
import json
import math

import pytest
from click.testing import CliRunner
from offered_jobs import planned_job
from places import ROBOT
from refusals import in_one_line

from laptop.cli.main import laptop
from shared.arm_description import find_arm, read_arm

NEVER = "the arm planar has not been homed, so its zero is unknown"
NEXT = "driver.py home (or home --here)"

OWN = """
import math
from robot.api import Clock, Driver, NotHomed, RobotArm, Turtle, find_arm, read_arm
from robot.motion import paths, trajectory
from robot.motion.trajectory import JointMove

clock = Clock()
arm = RobotArm(read_arm(find_arm("planar")), clock)
driver = Driver(arm)
line = trajectory.plan(arm.description, paths.polyline([(10, 0), (5, 10)])[0:1])
try:
    {moves}
except NotHomed as problem:
    print("NotHomed:", problem)
finally:
    arm.park(low=True)
"""

BY_THE_ARM = [
    "arm.go_to([0.5, 0.5])",
    "arm.reach([0.5, 0.5])",
    "arm.chase(lambda t, q: [0.5, 0.5])",
    "arm.follow(line)",
    "arm.follow_fed(line, None, print)",
    "arm.pre_approach(line[0])",
    "arm.step_to([0.1, 0.1])",
    "arm.move_pen(0.5)",
    "arm.move_motor(arm.joints[0], JointMove([0], [0.5], [1]))",
    "with arm.lend_motors(): arm.joints[0].go(0.5, 1)",
    "driver.pen_down()",
    "driver.move_to((10, 5))",
    "driver.draw_line((10, 0), (5, 10))",
    "driver.draw_line((10, 0), (5, 10), 'steps')",
    "turtle = Turtle(driver); turtle.forward(40); turtle.done()",
]


def turned(out):
    """By how much (deg) a joint ever truly turned to and fro; infinite if only a count is off."""
    with open(out / "trace.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    with open(out / "run.json") as file:
        counts = [
            motor["position"] for motor in json.load(file)["ending"]["more"]["motors"].values()
        ]
    greatest = max(
        math.degrees(max(angles) - min(angles))
        for angles in ([float(row[name]) for row in rows] for name in ("q1", "q2"))
    )
    return greatest or (math.inf if any(counts) else 0)


@pytest.fixture
def simulate(tmp_path):
    """Run `simulate --start lost WORDS`: (exit status, stdout, stderr, degrees turned)."""

    def run(*args, start="lost"):
        out = tmp_path / "out"
        options = ["simulate", "--out", str(out), "--no-picture", "--start", start]
        result = CliRunner().invoke(laptop, [*options, *map(str, args)])
        assert result.exception is None or isinstance(result.exception, SystemExit)
        return result.exit_code, result.stdout, result.stderr, turned(out)

    return run


@pytest.fixture
def script(tmp_path):
    """A program of one's own that moves as told, by no zero."""

    def write(moves):
        path = tmp_path / "own.py"
        path.write_text(OWN.format(moves=moves))
        return path

    return write


@pytest.mark.short(every=5)
@pytest.mark.parametrize("moves", BY_THE_ARM)
def test_a_program_of_ones_own_does_not_move_an_arm_that_was_never_homed(simulate, script, moves):
    _, out, err, degrees = simulate(script(moves))
    lines = "".join(line for line in out.splitlines(True) if "NotHomed" in line)
    assert in_one_line(lines, "NotHomed: " + NEVER, NEXT), (out, err)
    assert degrees == 0


def test_a_turtle_of_ones_own_does_not_either(simulate, tmp_path):
    path = tmp_path / "own.py"
    path.write_text("from robot.api import Turtle\nTurtle().forward(40)\n")
    status, _, err, degrees = simulate(path)
    assert status == 1
    assert in_one_line(err, NEVER, NEXT)
    assert degrees == 0


SERVO = """
from robot.api import Clock, RobotArm, RunReporter, RunTerms, TrackingClient, VisualServoing
from robot.api import find_arm, find_tracker, make_servo, read_arm

description, clock = read_arm(find_arm("planar")), Clock()
arm = RobotArm(description, clock)
client = TrackingClient(*find_tracker(), clock=clock, say=str)
servo, stream = make_servo(description, "chain", {mode!r}, tolerance=5)
goals = {{"A": (400, 200)}}
terms, reporter = RunTerms(goals), RunReporter(say=str)
print(VisualServoing(arm, client, clock, servo, terms, stream, reporter).run().reason)
client.close()
"""


@pytest.mark.short("look")
@pytest.mark.parametrize("mode", ["look", "stream"])
def test_servoing_of_ones_own_does_not_either(simulate, tmp_path, mode):
    path = tmp_path / "own.py"
    path.write_text(SERVO.format(mode=mode))
    _, out, _, degrees = simulate("--scene", "", path)
    assert in_one_line(out.splitlines(True)[0], NEVER, NEXT)
    assert degrees == 0


@pytest.fixture
def job(tmp_path):
    path = tmp_path / "a.job"
    return planned_job(path, read_arm(find_arm("planar")), [[(14.0, -4.0), (16.0, 0.0)]])


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    "args",
    [
        ["driver.py", "line", "10,0", "5,10"],
        ["driver.py", "line", "10,0", "5,10", "--method", "steps"],
        ["driver.py", "move", "12,6"],
        ["driver.py", "touch"],
        ["driver.py", "touch", "--pen", "down"],
        ["driver.py", "where"],
        ["driver.py", "job", "JOB"],
        ["driver.py", "job", "JOB", "--paused"],
        ["bench_brick.py", "planar", "--move"],
        ["visual_servoing.py"],
        ["visual_servoing.py", "--goal", "A:400,200", "--method", "report"],
        ["visual_servoing.py", "--wait"],
    ],
    ids=" ".join,
)
def test_nor_does_a_command_on_the_brick(simulate, job, args):
    script, *args = [str(job) if word == "JOB" else word for word in args]
    scene = ["--scene", ""] if script == "visual_servoing.py" else []
    status, out, err, degrees = simulate(*scene, ROBOT / script, *args)
    assert status == 1, out
    assert in_one_line(err, script, NEVER, NEXT)
    assert degrees == 0


def test_only_who_finds_the_zero_moves_without_one(simulate, script):
    """A little, to see which motor is where; and as far as it takes, by its own name."""
    for moves, least, most in (
        ("from robot.motion import mounting; mounting.jog(arm, 0, math.radians(8))", 4, 10),
        ("arm.home(here=True)", 0, 0),
        ("arm.home(seek=True)", 90, 400),
    ):
        _, out, err, degrees = simulate(script(moves))
        assert (err.count("Traceback"), out.count("NotHomed")) == (0, 0), err
        assert least <= degrees <= most, moves


def test_in_what_they_borrow_nothing_else_moves_either(simulate, script):
    _, out, _, degrees = simulate(
        script("with arm.lend_motors(zero_needed=False): arm.go_to([0.5, 0.5])")
    )
    assert "NotHomed: " + NEVER in out
    assert degrees == 0


def test_the_zero_on_file_is_not_loaded_unasked(simulate, script):
    """Where a program of one's own has planned from would be counted from elsewhere."""
    _, out, _, degrees = simulate(script("arm.go_to([0.5, 0.5])"), start="20,30")
    lines = [line for line in out.splitlines(True) if "NotHomed" in line]
    assert in_one_line("".join(lines), "is on file", "has not loaded it", "call load_zero()")
    assert degrees == 0


def test_an_arm_that_nobody_checked_is_told_that_first(simulate, script):
    _, _, err, degrees = simulate(script("arm.go_to([0.5, 0.5])"), start="unchecked")
    assert "NotChecked" in err.splitlines()[-1]
    assert "was never checked; nothing moves until then: type driver.py check" in err
    assert degrees == 0
