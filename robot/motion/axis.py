"""One motor of a motion: how exactly it is to follow, and what is known of it.  Pure."""

import math

from robot.motion.settling import SettlingDetector

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.backlash import Bounds  # noqa: F401
    from robot.motion.joint_controller import JointController  # noqa: F401

MAX_ERROR, MAX_ERROR_COUNTS = math.radians(3), 5
"""A joint this far (rad, and counts) from where it should be is blocked or blind."""

SETTLING_TIME, LONG_SETTLING = 0.2, 0.8
"""Longest correction after the end of a path with the pen down, of a move with the pen up, s."""

FINE_COUNTS, COARSE_COUNTS = 0.4, 6.0
"""A motor has settled within so many counts, where they matter and where not."""

STOPPED = 2
"""Steps by which a motor is stopped: braked, and clamped."""


class Tolerances(object):
    """How exactly motors are to follow a plan.

    Args:
        settle: longest correction after its end, s.
        counts: within which a motor has settled.
        error: greatest on the way, rad.
    """

    def __init__(self, settle=SETTLING_TIME, counts=FINE_COUNTS, error=MAX_ERROR):
        # type: (float, float, float) -> None
        self.settle, self.counts, self.error = settle, counts, error


TOLERANCES = Tolerances()
"""Those of a path with the pen down."""


class Axis(object):
    """One motor of a motion, and what is known of it.

    Args:
        settle: longest correction, s, on a brick that computes as slowly as this one.
        bounds: (lower, upper, fastest).

    Attributes:
        seen, stands_since: what the encoder says, and since when, s.
        slack_at: when it was last driven with less than its full hand, s.
        held: by how many steps it was stopped, being at rest while others move on; STOPPED by all.
        lower, upper, fastest: bounds of its set-points, rad and rad/s.
    """

    def __init__(self, motor, controller, tolerances, settle, bounds):
        # type: (Motor, JointController, Tolerances, float, Bounds) -> None
        self.motor, self.controller = motor, controller
        # (What each tick calls, looked up once.)
        self.bounds, self.drive, self.command = motor.bounds, motor.drive, controller.command
        self.settling = SettlingDetector(settle, tolerances.counts * motor.resolution)
        self.max_error = max(tolerances.error, MAX_ERROR_COUNTS * motor.resolution)
        self.seen = None  # type: Optional[float]
        self.stands_since = self.slack_at = 0.0
        self.held = 0
        self.lower, self.upper, self.fastest = bounds

    def stop_by_a_step(self):
        # type: () -> None
        """Brake it, then clamp it, as `hold` does: in two ticks, each has time for two writes."""
        if self.held == 0:
            self.motor.brake()
        else:
            self.motor.clamp()
        self.held += 1
