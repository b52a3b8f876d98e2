"""One motor of a motion, and what the control loop does with some of them in a tick."""

import math
from types import SimpleNamespace

import pytest

from robot.motion.axis import MAX_ERROR_COUNTS, STOP_STEPS, Axis, Tolerances
from robot.motion.control_loop import UNBOUNDED, ControlLoop, OutOfBounds, Stalled
from robot.motion.joint_controller import GAINS, JointController
from robot.motion.trajectory import JointMove


class Noted:
    """A motor that notes what it is told."""

    name, port, resolution = "elbow", "B", math.radians(1)

    def __init__(self):
        self.reported, self.at = [], 0.0

    def bounds(self):
        """What its encoder allows, rad."""
        return self.at - self.resolution / 2, self.at + self.resolution / 2

    def drive(self, speed):
        """To this speed, rad/s."""
        self.reported.append(speed)

    def brake(self):
        """Stop."""
        self.reported.append("brake")

    def clamp(self):
        """Hold."""
        self.reported.append("clamp")


def axis(bounds=UNBOUNDED, **tolerances):
    motor = Noted()
    controller = JointController(1.0, GAINS["large"])
    return Axis(motor, controller, Tolerances(**tolerances), 0.2, bounds)


def loop():
    clock = SimpleNamespace(now=lambda: 0.0, sleep=lambda seconds: None)
    return ControlLoop(clock, {}, lambda: None, lambda line: None)


MOVE = JointMove([0.0], [1.0], [1.0])


def test_no_error_is_too_great_within_some_counts():
    assert axis(error=0.5).max_error == 0.5
    assert axis(error=0.0).max_error == MAX_ERROR_COUNTS * math.radians(1)


def test_a_motor_is_stopped_by_a_step_each_tick_and_stays_so():
    one, control = axis(), loop()
    one.settling.over = True
    for _ in range(STOP_STEPS + 3):
        control._drive([one], MOVE, 0.5, [0.5], [0.0], [1.0], [1.0], 0.02)
    assert one.motor.reported == ["brake", "clamp"]
    one.settling.over = False
    control._drive([one], MOVE, 0.5, [0.5], [0.0], [1.0], [1.0], 0.02)
    assert len(one.motor.reported) == 3
    assert one.held == 0


def test_what_is_read_is_what_the_controllers_observe():
    axes, control, times = [axis(), axis()], loop(), iter([1.0, 1.1])
    axes[1].motor.at = 0.5
    assert control._read(axes, lambda: next(times)) == ([0.0, 0.5], 1.1)
    assert [one.stands_since for one in axes] == [1.0, 1.1]


def test_what_is_missing_is_told_and_whether_all_has_settled():
    one, control = axis(), loop()
    one.seen = 0.0
    assert control._watch([one], MOVE, 0.5, 0.5, [0.51], [0.5]) == ([pytest.approx(0.01)], False)
    end = MOVE.duration + 1.0
    for t in (end, end + 0.05):
        errors, settled = control._watch([one], MOVE, t, t, [1.0], [1.0])
    assert (errors, settled) == ([0.0], True)


def test_a_joint_that_stands_far_from_where_it_should_be_is_blocked():
    with pytest.raises(Stalled, match="28.6 deg are missing"):
        loop()._watch([axis()], MOVE, 0.5, 0.5, [0.5], [0.0])


@pytest.mark.parametrize(("wanted", "speed"), [(0.5, 1.1), (0.5, -1.1), (1.1, 0.0), (0.98, 1.0)])
def test_nothing_is_driven_beyond_its_bounds(wanted, speed):
    one = axis(bounds=(0.0, 1.0, 1.05))
    with pytest.raises(OutOfBounds):
        loop()._drive([one], MOVE, 0.5, [wanted], [0.0], [speed], [speed], 0.02)
    assert one.motor.reported == []
