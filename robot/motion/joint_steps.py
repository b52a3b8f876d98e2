"""The lab report's move: every joint at once, by its motor's own driver, until it has settled."""

import math

from robot.motion.control_loop import Stalled

MYPY = False
if MYPY:
    from typing import Callable, List, Optional, Sequence  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401

STEP_SPEED, STEP_PERIOD = math.radians(100), 0.02
"""Speed of the report's joint steps, rad/s, and period of their supervision, s."""

STANDSTILL_TIME = 0.12
"""Longest time without a count short of the target, s: then it is blocked or its encoder dead."""

SETTLED_TIME, SETTLE_TIMEOUT = 0.06, 0.4
"""Time within a count of the target after which a step has settled, and time limit for that, s."""


def go_and_settle(motors, q, q_before, clock, check):
    # type: (Sequence[Motor], Pose, Pose, Timepiece, Callable[[], object]) -> None
    """Command all joints to `q`, and wait until each has been within a count of it for 60 ms.

    Args:
        motors: one JointMotor per joint.
        q: joint angles wanted, rad.
        q_before: joint angles now, rad.
        clock: has `now()` and `sleep(seconds)`.
        check: called once; raises if a motor is unplugged or the pen displaced.

    Raises:
        Stalled: a joint does not get there in time; the motors are driven still.
    """
    longest = max(abs(a - b) for a, b in zip(q, q_before)) / STEP_SPEED
    targets = [motor.go(angle, STEP_SPEED) for motor, angle in zip(motors, q)]
    deadline = clock.now() + longest + SETTLE_TIMEOUT
    settled, before = None, [None] * len(motors)  # type: Optional[float], List[Optional[int]]
    counted_at = [0.0] * len(motors)
    check()
    while settled is None or clock.now() - settled < SETTLED_TIME:
        off = [motor.counts() - target for motor, target in zip(motors, targets)]
        for k, counts in enumerate(off):
            if counts != before[k]:
                before[k], counted_at[k] = counts, clock.now()
            elif abs(counts) > 1 and clock.now() - counted_at[k] > STANDSTILL_TIME:
                raise _stalled(motors[k], counts)
        if all(abs(counts) <= 1 for counts in off):
            settled = clock.now() if settled is None else settled
        else:
            settled = None
            if clock.now() > deadline:
                worst = max(range(len(off)), key=lambda k: abs(off[k]))
                raise _stalled(motors[worst], off[worst])
        clock.sleep(STEP_PERIOD)


def _stalled(motor, counts):
    # type: (Motor, float) -> Stalled
    """Return the error for a motor that is `counts` short of its target."""
    return Stalled(motor, "{:.0f} counts are missing".format(abs(counts)))
