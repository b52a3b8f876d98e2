"""The classic lab's own program as a reference of the drawing bench."""

import math
import re

import numpy as np
import pytest
from rig import REPORT_LINES, described, switched_on

from laptop.bench import draw, timed_steps
from laptop.emulator.host.program import Program
from robot.ev3.motors import JointMotor
from shared.arm_description import ArmError

LAWS = timed_steps.LAWS
LINKS = (11.3, 9.5)


def tip(q):
    (first, second), (a, b) = LINKS, q
    return np.array(
        [
            first * math.cos(a) + second * math.cos(a + b),
            first * math.sin(a) + second * math.sin(a + b),
        ]
    )


def step(q, line, size, along_all):
    """A step by differences of where the tip is, rad; `size` in deg."""
    h = 1e-6
    columns = [(tip(q + d) - tip(q - d)) / (2 * h) for d in h * np.eye(2)]
    dq = np.linalg.inv(np.array(columns).T) @ (np.array(line[1]) - line[0])
    return math.radians(size) * dq / (math.hypot(*dq) if along_all else max(abs(dq)))


def drawn(name, line, cpu=0.0, elbow="down"):
    case = draw.DrawCase("planar", name, "", "backlash=2", 2.0, line, "", cpu=cpu, elbow=elbow)
    return draw.draw(case)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", list(LAWS))
def test_every_command_is_the_law_of_what_was_read(tmp_path, monkeypatch, name, direction):
    line, read, angle = REPORT_LINES[2], [], JointMotor.angle

    def noted(motor):
        read.append(angle(motor))
        return read[-1]

    with switched_on(tmp_path, described("planar", 2.0, direction=direction), "cpu=0") as rig:
        driver = rig.driver(elbow="down")
        started = []
        driver.pen_down, put_down = lambda: (put_down(), started.append(True)), driver.pen_down
        monkeypatch.setattr(
            JointMotor, "angle", lambda motor: noted(motor) if started else angle(motor)
        )
        timed_steps.draw_line(Program(rig.world, None), driver, *line, LAWS[name])
    commands, told = [], {}
    for t, port, attribute, text in rig.writes:
        told[port, attribute] = text
        if text == "run-to-rel-pos":
            at = (told[port, what] for what in ("speed_sp", "stop_action", "position_sp"))
            commands.append((t, port, *at))
    readings = np.array(read[: len(commands) + 2]).reshape(-1, 2)
    left = [math.dist(tip(q), line[1]) for q in readings]
    assert left[-1] <= 2 < min(left[:-1])
    halved = name == "timed steps, halved"
    size = 5.0
    for k, q in enumerate(readings[:-1]):
        if halved and left[k] < 10 and size > 1:
            size /= 2
        counts = direction * np.degrees(step(q, line, size, not halved))
        wanted = [round(c) if halved else math.trunc(c) for c in counts]
        pair = commands[2 * k : 2 * k + 2]
        action = "hold" if halved else "coast"
        assert [c[1:] for c in pair] == [
            (port, "52", action, str(n)) for port, n in zip("AB", wanted, strict=True)
        ]
    times = [t for t, port, *_ in commands if port == "A"]
    assert all(0.2 <= b - a < 0.22 for a, b in zip(times, times[1:], strict=False))


@pytest.mark.parametrize(
    ("name", "lefts", "sizes"),
    [
        ("timed steps", (20, 10, 9.9, 2.1), (5, 5, 5, 5)),
        (
            "timed steps, halved",
            (20, 10, 9.9, 9, 10.5, 8, 7, 2.1),
            (5, 5, 2.5, 1.25, 1.25, 0.625, 0.625, 0.625),
        ),
    ],
)
def test_steps_are_halved_near_the_end_down_to_a_degree_or_less(name, lefts, sizes):
    size, seen = timed_steps.STEP, []
    for left in lefts:
        size = timed_steps.step_size(LAWS[name], size, left)
        seen.append(math.degrees(size))
    assert seen == pytest.approx(sizes)


OF_THE_PROGRAM = pytest.mark.parametrize(
    ("line", "off", "short", "seconds"),
    [
        (REPORT_LINES[0], 4.1, 18.0, 3.0),
        (REPORT_LINES[1], 5.8, 16.7, 5.4),
        (REPORT_LINES[2], 5.4, 11.3, 3.7),
    ],
)
"""As measured of the program itself, run unmodified on the emulated brick."""


@OF_THE_PROGRAM
def test_it_draws_as_the_program_itself_did(line, off, short, seconds):
    result = drawn("timed steps", line)
    assert result.error == ""
    # One line is one sample, and the time at which the pen comes down makes another.
    assert result.greatest == pytest.approx(off, abs=2.5)
    # Where the last step still falls within 2 cm of the goal is luck: a millisecond shifts it by 7.
    assert result.short == pytest.approx(short, abs=8)
    assert result.seconds == pytest.approx(seconds, abs=0.3)


@OF_THE_PROGRAM
def test_halved_steps_take_longer_than_the_program_did(line, off, short, seconds):
    """Which is why they are not the law that stands for it."""
    assert drawn("timed steps, halved", line).seconds > 2 * seconds


@pytest.mark.parametrize("cpu", [0.0, 1.0])
def test_twice_the_same(cpu):
    first, second = (drawn("timed steps", REPORT_LINES[0], cpu=cpu) for _ in range(2))
    assert first == second
    assert first.error == ""


def test_a_start_out_of_reach_is_refused(tmp_path):
    with switched_on(tmp_path, plant="cpu=0") as rig:
        driver, line = rig.driver(), ((30, 0), (5, 10))
        with pytest.raises(ArmError, match="out of reach"):
            timed_steps.draw_line(Program(rig.world, None), driver, *line, LAWS["timed steps"])
    assert len({sample.q for sample in rig.brick.record}) == 1


def test_a_joint_does_not_go_past_its_limit(tmp_path):
    arm = described("planar", 2.0)
    shoulder = arm.joints[0]._replace(upper=math.radians(60))
    with switched_on(tmp_path, arm._replace(joints=(shoulder, arm.joints[1])), "cpu=0") as rig:
        driver = rig.driver(elbow="down")
        with pytest.raises(ArmError, match="shoulder cannot go to"):
            timed_steps.draw_line(
                Program(rig.world, None), driver, *REPORT_LINES[1], LAWS["timed steps"]
            )
    assert max(sample.q[0] for sample in rig.brick.record) < math.radians(63)


@pytest.mark.long
def test_one_that_gets_stuck_says_so(monkeypatch):
    monkeypatch.setattr(timed_steps, "TIME_LIMIT", 2.0)  # it is not there by then
    result = drawn("timed steps, halved", REPORT_LINES[0], elbow="up")
    said = r"ArmError: still \d\.\d cm from the end after 2 s; it got stuck"
    assert re.fullmatch(said, result.error)
