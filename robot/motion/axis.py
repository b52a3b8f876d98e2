"""One motor of a motion: its tolerances and its state in the control loop.  Pure."""

import math

from robot.motion.settling import SettlingDetector

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.backlash import Bounds  # noqa: F401
    from robot.motion.joint_controller import JointController  # noqa: F401

MAX_ERROR, MAX_ERROR_COUNTS = math.radians(3), 5
"""Largest error of a joint that moves freely, rad, and counts: beyond both it is blocked, or its
encoder is dead."""

SETTLING_TIME, LONG_SETTLING = 0.2, 0.8
"""Maximum time of the correction at the end, s: of a path with the pen down, of a move."""

FINE_COUNTS, COARSE_COUNTS = 0.4, 6.0
"""Tolerances at the end, counts: of a path, and of a move whose end need not be exact."""

STOP_STEPS = 2
"""Number of steps by which a motor is stopped: brake, then clamp."""


class Tolerances(object):
    """The tolerances of motors that follow a plan.

    Args:
        settle: maximum time of the correction after its end, s.
        counts: distance from the end within which a motor has settled, counts.
        error: maximum error on the way, rad.
    """

    def __init__(self, settle=SETTLING_TIME, counts=FINE_COUNTS, error=MAX_ERROR):
        # type: (float, float, float) -> None
        self.settle, self.counts, self.error = settle, counts, error


TOLERANCES, EXACT, NEAR = Tolerances(), Tolerances(LONG_SETTLING), Tolerances(LONG_SETTLING, 2.0)
"""Tolerances of a path with the pen down, of a move, and of a move to where another begins."""

CORNER = Tolerances(counts=1.0)
"""Tolerances of a piece of a path that another one follows."""


class Axis(object):
    """One motor of a motion, and its state.

    Args:
        motor: JointMotor.
        controller: its JointController.
        tolerances: Tolerances.
        settle: maximum time of the correction at the end, s, allowing for a slow brick.
        bounds: (lower, upper, fastest) of its set-points: rad, rad, rad/s.

    Attributes:
        seen, stands_since: the encoder's lower bound of the angle, rad, and since when, s.
        slack_at: when it was last driven with less than the full feedback, s.
        held: number of stopping steps done at rest while others move, 0 .. STOP_STEPS.
        lower, upper, fastest: as in `bounds`.
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
        """Brake it, or clamp it once it is braked; a tick has time for no more than two writes."""
        if self.held == 0:
            self.motor.brake()
        else:
            self.motor.clamp()
        self.held += 1
