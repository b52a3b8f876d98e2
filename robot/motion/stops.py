"""The hard stops of a joint: touched gently, several times, and its zero set by them.

A motor pushed against a stop stands on the far side of the play; from both sides, the play cancels
and is measured on the way.
"""

import math

from robot.ev3.motors import DEAD_MAN
from robot.motion.control_loop import Stalled, TooSlow
from robot.motion.motor_model import STIFFNESS
from robot.motion.online_trajectory import STOP
from robot.motion.trajectory import JointMove
from shared.arm_description import ArmError
from shared.record import record

MYPY = False
if MYPY:
    from typing import Dict, List, NamedTuple, Optional, Tuple  # noqa: F401

    from robot.clock import Timepiece  # noqa: F401
    from robot.ev3.motor import Motor  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.pace import Say  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

TOUCHES_PER_PUSH = 3
SEARCH_PUSH, TOUCH_PUSHES = 20.0, (14.0, 17.0, 20.0)
"""Greatest force on the stop, % of duty: to find it, and to measure it, the harder the stiffer the
joint turns out to be: one that is pushed too softly comes to a stand on the way."""

PUSH_STIFFNESS = 0.02
"""Stiffness (% per deg/s) at which the stop is approached: the softer, the faster."""

BACK_OFF, BACK_OFF_SPEED, MIN_BACK_OFF = (math.radians(x) for x in (6, 60, 4))
"""How far a joint is to leave its stop between two touches, rad, how fast, rad/s, and how far will
do: one that is stiff need not get there to the degree."""

STOP_TIMEOUT = 60.0
"""No joint takes longer to its stop, s."""

STANDSTILL_TIME = 0.16
"""A pushed joint that has not moved for this time stands at its stop, s."""

MIN_STANDSTILL_TIME, STANDSTILL_COUNTS = 0.06, 5
"""One that turned fast does so sooner: after the time of so many counts, no less than this, s."""

ROTOR_PUSH, LINK_PUSH, KICK_TIME = 20.0, 30.0, 0.03
"""Force by which a joint is to set out, % of duty: for its motor, and for so long (s) also for its
link, of which a gear takes its share."""

KICK_TIMEOUT, KICK_PERIOD = 0.06, 0.005
"""By then its encoder has counted, and the time between two looks at it, s."""

MAX_TOUCH_SPREAD = 3
"""Counts within which the touches of one stop must lie."""

MAX_TOUCH_SHORTFALL = math.radians(2)
"""A touch this far from the farthest one was none, rad."""

MAX_STOP_ERROR = math.radians(5)
"""Stops that are farther than this from where they should be are others, rad."""

MAX_BACKLASH = math.radians(20)
"""No joint has more, whatever its file says, rad."""

if MYPY:
    Found = NamedTuple(
        "Found",
        [("joint", str), ("zero", float), ("backlash", Optional[float]), ("spread", float)],
    )
else:
    Found = record("Found", "joint zero backlash spread")
"""What was found of one joint.

joint   its name
zero    counts at angle zero
play    as measured, rad; None from one side
spread  of the touches of one stop, counts
"""


class Blocked(ArmError):
    """Homing found no stop, not the same one twice, or stops that are not those of the arm file."""


def touch_stop(arm, k, side, say, farthest=None):
    # type: (RobotArm, int, str, Say, Optional[float]) -> Tuple[float, float]
    """Touch one stop of joint `k` several times.

    Args:
        side: "lower" | "upper".
        farthest: no farther than this angle, rad; as far as the joint may have to if None.

    Returns:
        (counts there, how far apart the touches are, counts).

    Raises:
        Blocked: there is none, or not always the same.
    """
    joint = arm.description.joints[k]
    say("homing: {}, {} stop".format(joint.name, side))
    touches = _touches(arm, k, 1 if side == "upper" else -1, farthest)
    spread = max(touches) - min(touches)
    if spread > MAX_TOUCH_SPREAD:
        raise Blocked(
            "the {}'s stop was found at places {:.0f} counts apart, at most {} will do; "
            "clear its way, ease it if it runs stiffly, and home again".format(
                joint.name, spread, MAX_TOUCH_SPREAD
            )
        )
    return sum(touches) / float(len(touches)), spread


def declare_angle(motor, angle):
    # type: (Motor, float) -> None
    """Declare that the motor stands at `angle` (rad) now."""
    motor.zero += motor.in_counts(motor.angle() - angle)


def stop_angle(joint, side):
    # type: (Joint, str) -> float
    """The angle of a stop that there is, rad; `side` is "lower" or "upper"."""
    angle = joint.stop_lower if side == "lower" else joint.stop_upper
    assert angle is not None  # or the arm's file would not have it touched
    return angle


def set_zero(arm, k, ends, spread):
    # type: (RobotArm, int, Dict[str, float], float) -> Found
    """Set the zero of joint `k` by its stops; Found.

    Args:
        ends: counts by "lower", "upper".

    Raises:
        Blocked: they are not as far apart as the arm's file says.
    """
    motor, joint = arm.joints[k], arm.description.joints[k]
    zeros = []
    for side, counts in ends.items():
        push = -joint.backlash / 2 if side == "lower" else joint.backlash / 2
        zeros.append(counts - motor.in_counts(stop_angle(joint, side) + push))
    motor.zero = sum(zeros) / len(zeros)
    play = None
    if len(ends) == 2:
        span = abs(ends["upper"] - ends["lower"]) * motor.resolution
        play = span - (stop_angle(joint, "upper") - stop_angle(joint, "lower"))
        if abs(play - joint.backlash) > MAX_STOP_ERROR:
            raise Blocked(_not_as_described(arm.description, k, span, play))
    return Found(joint.name, motor.zero, play, spread)


def _not_as_described(arm, k, span, play):
    # type: (Arm, int, float, float) -> str
    """What is wrong with stops that are `span` apart, which would mean so much `play`; rad."""
    joint = arm.joints[k]
    told = (
        "the {}'s stops are {:.1f} deg apart, by the arm file {:.1f} and {:.1f} of play; ".format(
            joint.name,
            math.degrees(span),
            math.degrees(stop_angle(joint, "upper") - stop_angle(joint, "lower")),
            math.degrees(joint.backlash),
        )
    )
    for other in arm.joints:
        if other is joint or other.stop_lower is None or other.stop_upper is None:
            continue
        seen = (other.stop_upper - other.stop_lower + other.backlash) * other.gear / joint.gear
        if abs(span - seen) < MAX_STOP_ERROR:
            return told + swapped(arm, joint, other)
    if play < joint.backlash:  # what gets too far meets nothing on its way
        return told + "clear its way, ease it if it runs stiffly, or measure them"
    return told + (
        "measure them, and its play, which by that is {:.1f} deg: stop_lower, stop_upper, backlash "
        "in [{}] of {}".format(math.degrees(play), joint.name, arm.file)
    )


def swapped(arm, joint, other):
    # type: (Arm, Joint, Joint) -> str
    """What to say of a joint whose stops are those of another one."""
    return (
        "they are those of the {0}, so the cables of ports {1} and {2} are swapped: exchange them, "
        "or port = {1} and port = {2} in [{3}] and [{0}] of {4}".format(
            other.name, joint.port, other.port, joint.name, arm.file
        )
    )


def _touches(arm, k, sign, farthest):
    # type: (RobotArm, int, int, Optional[float]) -> List[float]
    """Counts at which the joint stands against a stop, TOUCHES_PER_PUSH times."""
    motor, joint = arm.joints[k], arm.description.joints[k]

    def touch(force):
        # type: (float) -> float
        at = push(arm, motor, joint, sign, force, farthest)
        _kick(arm.clock, motor, joint, -sign)
        back_off(arm, motor, at, sign)
        return at

    all_touches = [touch(SEARCH_PUSH)]
    for force in TOUCH_PUSHES:
        out = []
        for _ in range(TOUCHES_PER_PUSH):
            _kick(arm.clock, motor, joint, sign)
            out.append(touch(force))
        all_touches += out
        farthest = (max if motor.in_counts(sign) > 0 else min)(all_touches)
        short = max(abs(at - farthest) for at in out) * motor.resolution
        if max(out) - min(out) <= MAX_TOUCH_SPREAD and short < MAX_TOUCH_SHORTFALL:
            break
    return out


def back_off(arm, motor, stop, sign):
    # type: (RobotArm, Motor, float, int) -> None
    """Leave the stop (counts) on the side of `sign` by BACK_OFF."""
    at = (stop - motor.zero) / motor.in_counts(1)

    def look(t, now, angles):
        # type: (float, float, Pose) -> object
        return STOP if sign * (at - angles[0]) > MIN_BACK_OFF else None

    move = JointMove([motor.angle()], [at - sign * BACK_OFF], [BACK_OFF_SPEED])
    arm.move_motor(motor, move, on_tick=look)


def push(arm, motor, joint, sign, force, farthest=None):
    # type: (RobotArm, Motor, Joint, int, float, Optional[float]) -> float
    """Push until the joint stands; the middle of what the encoder then allows, counts.

    Args:
        farthest: see `touch_stop`.

    Raises:
        Blocked: it does not come to a stand.
    """
    clock = arm.clock
    most = _longest_travel(joint) if farthest is None else sign * (farthest - motor.angle())
    # What a standing motor pushes with is the stiffness times the speed set-point.
    speed = sign * math.radians(force / PUSH_STIFFNESS) / joint.gear
    motor.engage(PUSH_STIFFNESS)
    last, since = motor.bounds(), clock.now()
    start, begun, standstill = last, since, STANDSTILL_TIME
    per_count = standstill / STANDSTILL_COUNTS
    while True:
        arm.motors.check()
        motor.drive(speed)
        clock.sleep(DEAD_MAN / 10)
        here, now = motor.bounds(), clock.now()
        if here != last:
            # A mean, for a reading may fall just behind or before a count.
            before, per_count = per_count, (now - since) * motor.resolution / abs(here[0] - last[0])
            standstill = STANDSTILL_COUNTS * 0.5 * (before + per_count)
            standstill = min(max(MIN_STANDSTILL_TIME, standstill), STANDSTILL_TIME)
            last, since = here, now
        elif now - since > standstill:
            motor.hold()
            motor.disengage()
            return motor.zero + motor.in_counts(sum(here) / 2)
        if abs(here[0] - start[0]) > most or now - begun > STOP_TIMEOUT:
            raise Blocked(
                "the {} found no stop in {:.0f} deg and {:.0f} s; check its stops and find_home in "
                "the arm file".format(
                    joint.name, math.degrees(abs(here[0] - start[0])), now - begun
                )
            )


def _kick(clock, motor, joint, sign):
    # type: (Timepiece, Motor, Joint, int) -> None
    """Push a joint that stands, and is free to go that way, until its encoder counts.

    One that is blind on the way looks as if it stood at its stop, until it is to leave that; then
    this brakes it.

    Raises:
        Stalled: it does not count soon.
        TooSlow: nor is there time to look.
    """

    def push(force):
        # type: (float) -> None
        motor.drive(sign * math.radians(force / STIFFNESS) / joint.gear)

    full = ROTOR_PUSH + LINK_PUSH / joint.gear
    motor.engage(STIFFNESS)
    stands = motor.bounds()
    push(full)
    since = looked = clock.now()  # only now: on a slow brick it takes its time to begin
    late = 0.0
    while True:
        clock.sleep(KICK_PERIOD)
        if motor.bounds() != stands:
            return
        now = clock.now()
        late, looked = max(late, now - looked), now
        if now - since > KICK_TIMEOUT:
            if late > KICK_TIMEOUT:
                raise TooSlow(late)
            raise Stalled(motor, "it does not set out")
        push(full if now - since < KICK_TIME else ROTOR_PUSH)


def _longest_travel(joint):
    # type: (Joint) -> float
    """How far a joint may have to turn to a stop that is there, rad."""
    if joint.stop_lower is None or joint.stop_upper is None:
        return 2 * math.pi
    return joint.stop_upper - joint.stop_lower + MAX_BACKLASH + MAX_STOP_ERROR
