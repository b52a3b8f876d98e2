"""Homing from near the home pose, where a person has put the arm: by stops or touch sensors.

A stop may be missing, and a cable round the joint.  So each joint goes slowly, and no farther
beyond a limit than SEEK_BEYOND, counted from where it was put.  Stops at other angles than in the
arm's file show what is wrong: a swapped cable, a direction, a placing error.
"""

import math

from robot.motion.control_loop import Stalled
from robot.motion.online_trajectory import STOP
from robot.motion.stops import (
    MAX_STOP_ERROR,
    Blocked,
    Found,
    declare_angle,
    set_zero,
    stop_angle,
    swapped,
    touch_stop,
)
from robot.motion.trajectory import JointMove
from shared.arm_keys import SEEK_BEYOND, STOPS_TOUCHED

MYPY = False
if MYPY:
    from typing import Any, Callable, Dict, List, Optional  # noqa: F401

    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.control_loop import OnTick  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

    Seen = Dict[str, float]  # angles of stops, rad, by side

SEEK_SPEED, TOUCH_SPEED = math.radians(60), math.radians(6)
"""Maximum speeds of a joint, rad/s: towards a stop, and towards a sensor that it has met before."""

BOUND_MARGIN = math.radians(1)
"""Distance from the bound at which a search ends, rad: a joint needs some time to stop."""

MAX_PLACING_ERROR = SEEK_BEYOND + MAX_STOP_ERROR
"""Maximum distance of a stop from its angle in the arm's file, rad: beyond it, it is another."""

MEETING_TOLERANCE = math.radians(2)
"""Tolerance of the angle at which a stop is met, rad: for counts and bent links."""

SIGNS = {"lower": -1, "upper": 1}
"""Signs of the directions to the stops, by side."""

SENSOR_TOUCHES, BACK_OFF, MAX_SENSOR_SPREAD = 3, math.radians(5), math.radians(1)
"""Number of touches of a sensor, distance of the retreat in between, rad, and maximum spread of the
angles at which it closes, rad."""


def find_zero(arm, report):
    # type: (RobotArm, ReportLine) -> List[Found]
    """Set the motors' zeros, of each joint as its `find_home` says; all must stand near home.

    Args:
        arm: robot.motion.arm.RobotArm.
        report: called with one line of progress at a time.

    Returns:
        One Found per joint.

    Raises:
        Blocked: with the measured and the expected stops, and the line of the arm's file.
    """
    out = []
    for k in reversed(range(len(arm.joints))):
        joint = arm.description.joints[k]
        if joint.find_home == "touch":
            out.append(_by_sensor(arm, k, report))
        elif joint.find_home == "here":
            out.append(Found(joint.name, arm.joints[k].zero, None, 0))
        else:
            out.append(_by_stops(arm, k, report))
    return out[::-1]


def _bound(joint, sign):
    # type: (Joint, int) -> float
    """Return the angle at which a search ends on the side of `sign`, rad."""
    return (joint.upper if sign > 0 else joint.lower) + sign * (SEEK_BEYOND - BOUND_MARGIN)


def _go(arm, k, end, speed, on_tick=None):
    # type: (RobotArm, int, float, float, Optional[OnTick]) -> bool
    """Turn joint `k` to the angle `end` (rad); return whether it was blocked."""
    motor = arm.joints[k]
    try:
        arm.move_motor(motor, JointMove([motor.angle()], [end], [speed]), on_tick=on_tick)
    except Stalled:
        return True
    return False


# ---- stops


def _by_stops(arm, k, report):
    # type: (RobotArm, int, ReportLine) -> Found
    """Set the zero of joint `k` by its stops; return a Found."""
    motor, joint = arm.joints[k], arm.description.joints[k]
    put = motor.zero
    ends, seen, spread = {}, {}, 0  # type: Dict[str, float], Seen, float
    for side in _sought(joint):
        sign = SIGNS[side]
        # The bound counts from where it was put; a first stop has shown where that was.
        bound = _bound(joint, sign)
        moved = (put - motor.zero) / motor.in_counts(1)
        end = sign * min(sign * bound, sign * (bound + moved))
        if not _go(arm, k, end, min(SEEK_SPEED, joint.max_speed)):
            continue
        ends[side], distance = touch_stop(arm, k, side, report, end + sign * BOUND_MARGIN)
        spread = max(spread, distance)
        seen[side] = _seen(motor, joint, ends[side], sign, put)
        off = seen[side] - stop_angle(joint, side)
        if len(ends) == 1 and abs(off) <= MAX_PLACING_ERROR:
            declare_angle(motor, motor.angle() - off)
    problem = _problem(arm.description, k, seen)
    if problem:
        raise Blocked(problem)
    found = set_zero(arm, k, ends, spread)
    if len(ends) < len(STOPS_TOUCHED[joint.find_home]):
        report(
            "{}: the other stop is out of reach from where it was put; its zero is by the {} one "
            "alone, and by the play of its file".format(joint.name, *ends)
        )
    return found


def _seen(motor, joint, counts, sign, zero):
    # type: (Motor, Joint, float, int, float) -> float
    """Return the angle (rad) of a stop at `counts` if the zero is at `zero` counts."""
    return (counts - zero) / motor.in_counts(1) - sign * joint.backlash / 2


def _problem(arm, k, seen):
    # type: (Arm, int, Seen) -> Optional[str]
    """Return the message on stops at other angles than in the file; None if there is none.

    Args:
        arm: shared.arm_description.Arm.
        k: number of the joint.
        seen: angles of the stops that were met, rad, by side, from where the joint was put.
    """
    joint = arm.joints[k]
    if _is_right(joint, seen):
        return None
    where = " and ".join(
        "{} at {:.0f} deg".format(side, math.degrees(seen[side])) for side in sorted(seen)
    )
    fact = "the {}, counted from where it was put, has its {} stop{}".format(
        joint.name, where, "s" if len(seen) > 1 else ""
    )
    if seen:
        if _fits(joint, seen, _stops(joint, joint, -1)):
            return (
                "{}, as if it turned the other way round: write direction = {} in [{}] of {}, or "
                "let driver.py check do it".format(fact, -joint.direction, joint.name, arm.file)
            )
        for other in arm.joints:
            ratio = other.gear * other.direction / (joint.gear * joint.direction)
            for signed in (ratio, -ratio):
                if other is not joint and _fits(joint, seen, _stops(joint, other, signed)):
                    return "{}: {}".format(fact, swapped(arm, joint, other))
    missing = [side for side in _sought(joint) if side not in seen]
    if not missing:
        span = seen["upper"] - seen["lower"] if len(seen) == 2 else 0
        described = stop_angle(joint, "upper") - stop_angle(joint, "lower") if span else 0.0
        if span and abs(span - described) > MAX_STOP_ERROR:
            return None  # set_zero's message says more
        return "{}: put it nearer to home, or clear its way, and home again".format(fact)
    return (
        "the {0} met no {1} stop up to {2:.0f} deg beyond its limit{3}: put it nearer to "
        "home; if there is none, write stop_{4} = none and find_home = here, if its play is far "
        "greater, backlash, in [{0}] of {5}".format(
            joint.name,
            " and no ".join(missing),
            math.degrees(SEEK_BEYOND),
            "s" if len(missing) > 1 else "",
            missing[0],
            arm.file,
        )
    )


def _sought(joint):
    # type: (Joint) -> List[str]
    """Return the sides whose stops are sought: "lower", "upper"."""
    return [stop[len("stop_") :] for stop in STOPS_TOUCHED[joint.find_home]]


def _is_right(joint, seen):
    # type: (Joint, Seen) -> bool
    """Return whether each stop is where it should be, or out of reach from where it was put."""
    offs = {side: at - stop_angle(joint, side) for side, at in seen.items()}
    if not offs or max(abs(off) for off in offs.values()) > MAX_PLACING_ERROR:
        return False
    for side in _sought(joint):
        if side not in seen:
            at = stop_angle(joint, side) + max(offs.values())
            pushed = SIGNS[side] * at + joint.backlash / 2  # the motor's angle at that stop
            if pushed < SIGNS[side] * _bound(joint, SIGNS[side]) - MEETING_TOLERANCE:
                return False
    return True


def _stops(joint, other, ratio):
    # type: (Joint, Joint, float) -> Dict[str, Optional[float]]
    """Return the stops of `joint` as counted while `other` turns by 1 / `ratio` of it, rad."""
    ends = [
        None if stop is None else joint.home + (stop - other.home) * ratio
        for stop in (other.stop_lower, other.stop_upper)
    ]
    return dict(zip(("lower", "upper"), ends if ratio > 0 else ends[::-1]))


def _fits(joint, seen, expected):
    # type: (Joint, Seen, Dict[str, Optional[float]]) -> bool
    """Return whether the stops were met where expected, and the others are out of reach."""
    for side in _sought(joint):
        at, sign = expected[side], SIGNS[side]
        if side in seen:
            if at is None or abs(seen[side] - at) > MAX_PLACING_ERROR:
                return False
        elif at is not None and sign * (at - _bound(joint, sign)) < -MAX_PLACING_ERROR:
            return False
    return True


# ---- touch sensors


def _by_sensor(arm, k, report):
    # type: (RobotArm, int, ReportLine) -> Found
    """Set the zero of joint `k` by its touch sensor; return a Found."""
    motor, joint = arm.joints[k], arm.description.joints[k]
    is_pressed, touch_at = _sensor(joint), joint.touch_at
    assert touch_at is not None  # or the arm's file would not have it touched
    sign = 1 if touch_at >= joint.upper else -1
    bound = _bound(joint, sign)
    closed = []

    def stop_if_pressed(t, now, angles):
        # type: (float, float, Pose) -> object
        if is_pressed():
            closed.append(angles[0])
            return STOP
        return None

    report("homing: {}, touch sensor at {}".format(joint.name, joint.touch_port))
    off = BACK_OFF + joint.backlash
    for speed in (min(SEEK_SPEED, joint.max_speed),) + (TOUCH_SPEED,) * SENSOR_TOUCHES:
        if is_pressed():
            raise Blocked(
                "the touch sensor at {} is pressed though the {} is away from it; put the arm at "
                "home, look at the sensor, and home again".format(joint.touch_port, joint.name)
            )
        number = len(closed)
        blocked = _go(arm, k, bound, speed, stop_if_pressed)
        if len(closed) == number:
            raise Blocked(
                "the {} {} and did not meet its touch sensor; put it nearer to home, clear its "
                "way, or correct find_home = touch {} and touch_at = {:g} in [{}] of {}".format(
                    joint.name,
                    "was blocked"
                    if blocked
                    else "went {:.0f} deg beyond its limit".format(math.degrees(SEEK_BEYOND)),
                    joint.touch_port,
                    math.degrees(touch_at),
                    joint.name,
                    arm.description.file,
                )
            )
        _go(arm, k, closed[-1] - sign * off, SEEK_SPEED / 2)
    slow = closed[1:]
    spread = max(slow) - min(slow)
    if spread > max(MAX_SENSOR_SPREAD, 3 * motor.resolution):
        raise Blocked(
            "the touch sensor at {} closed at places {:.1f} deg apart; fasten it, and home "
            "again".format(joint.touch_port, math.degrees(spread))
        )
    at = sum(slow) / len(slow)
    declare_angle(motor, motor.angle() - at + touch_at + sign * joint.backlash / 2)
    return Found(joint.name, motor.zero, None, abs(motor.in_counts(spread)))


def _sensor(joint):
    # type: (Joint) -> Callable[[], bool]
    """Return a function that returns whether the touch sensor of a joint is pressed.

    Raises:
        Blocked: there is no sensor, also from that function.
    """
    from robot.ev3.touch_sensor import NoTouchSensor, touch_sensor  # not above: few have one

    def call(ask, *args):
        # type: (Callable[..., Any], *Any) -> Any
        try:
            return ask(*args)
        except NoTouchSensor:
            raise Blocked(
                "there is no touch sensor at {} for the {}; check its cable, or find_home in the "
                "arm file".format(joint.touch_port, joint.name)
            ) from None

    is_pressed = call(touch_sensor, joint.touch_port)
    return lambda: call(is_pressed)
