"""The hard stops of a joint: touched gently, several times, and its zero set by them.

A motor that pushes its link against a stop stands half the backlash b beyond it.  With the stops'
angles s- and s+ and k counts per rad, the encoder reads there, with z at angle zero:

    c- = z + k (s- - b/2),    c+ = z + k (s+ + b/2)

The mean of the two gives z without b, and their difference b without z:

    z = (c- + c+) / 2 - k (s- + s+) / 2,    b = (c+ - c-) / k - (s+ - s-)

One stop alone gives z only with the b of the arm's file, whose error is an error of the zero.  A b
far from the file's shows that these are other stops: a swapped cable, or something in the path.

A stop is where a softly driven motor stands for a few counts' time.  Its force bends the joint; so
the touches are repeated, with more force where the joint is stiff, until they agree.  A touch
sensor would need a port of the brick, and shows one side only: its zero depends on b.
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
    from robot.motion.pace import ReportLine  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

TOUCHES_PER_PUSH = 3
"""Number of touches with the same force."""

SEARCH_PUSH, TOUCH_PUSHES = 20.0, (14.0, 17.0, 20.0)
"""Maximum force on the stop, % of duty: to find it, and to measure it.  It is raised while touches
disagree: a stiff joint that is pushed too softly stands before its stop."""

PUSH_STIFFNESS = 0.02
"""Gain of the motor's driver on the approach, % per deg/s: for one force, the softer the faster."""

BACK_OFF, BACK_OFF_SPEED, MIN_BACK_OFF = (math.radians(x) for x in (6, 60, 4))
"""Distance of the retreat from a stop between two touches, rad, its speed, rad/s, and the distance
that is enough for a stiff joint, rad."""

STOP_TIMEOUT = 60.0
"""Maximum time of a joint to its stop, s."""

STANDSTILL_TIME = 0.16
"""Time without a count after which a pushed joint stands at its stop, s."""

MIN_STANDSTILL_TIME, STANDSTILL_COUNTS = 0.06, 5
"""The same for a joint that turned fast: minimum time, s, and time as a number of its counts."""

ROTOR_PUSH, LINK_PUSH, KICK_TIME = 20.0, 30.0, 0.03
"""Force to set a joint going, % of duty: for its motor; for its link, over its gear, in addition;
and the time of the latter, s."""

KICK_TIMEOUT, KICK_PERIOD = 0.06, 0.005
"""Time limit for its first count, and period of its readings, s."""

MAX_TOUCH_SPREAD = 3
"""Maximum spread of the touches of one stop, counts."""

MAX_TOUCH_SHORTFALL = math.radians(2)
"""Maximum distance of a touch from the farthest one, rad; a shorter one met no stop."""

MAX_STOP_ERROR = math.radians(5)
"""Maximum error of a stop's angle and of the measured backlash, rad: beyond, it is another stop."""

MAX_BACKLASH = math.radians(20)
"""Maximum backlash of any joint, rad."""

if MYPY:
    Found = NamedTuple(
        "Found",
        [("joint", str), ("zero", float), ("backlash", Optional[float]), ("spread", float)],
    )
else:
    Found = record("Found", "joint zero backlash spread")
"""Result of homing of one joint.

joint     its name
zero      counts at angle zero
backlash  as measured, rad; None from one side
spread    of the touches of one stop, counts
"""


class Blocked(ArmError):
    """A homing that found no stop, no constant one, or others than in the arm's file."""


def touch_stop(arm, k, side, report, farthest=None):
    # type: (RobotArm, int, str, ReportLine, Optional[float]) -> Tuple[float, float]
    """Touch one stop of joint `k` several times.

    Args:
        arm: robot.motion.arm.RobotArm.
        k: number of the joint.
        side: "lower" | "upper".
        report: called with one line of progress.
        farthest: angle at which the search ends, rad; the joint's range if None.

    Returns:
        (mean counts there, spread of the touches, counts).

    Raises:
        Blocked: there is no stop, or the touches disagree.
    """
    joint = arm.description.joints[k]
    report("homing: {}, {} stop".format(joint.name, side))
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
    """Return the angle of an existing stop, rad; `side` is "lower" or "upper"."""
    angle = joint.stop_lower if side == "lower" else joint.stop_upper
    assert angle is not None  # or the arm's file would not have it touched
    return angle


def set_zero(arm, k, ends, spread):
    # type: (RobotArm, int, Dict[str, float], float) -> Found
    """Set the zero of joint `k` by its stops; return a Found.

    Args:
        arm: robot.motion.arm.RobotArm.
        k: number of the joint.
        ends: counts at one stop or two, by "lower", "upper".
        spread: of the touches, counts.

    Raises:
        Blocked: the distance of the stops is not that of the arm's file.
    """
    motor, joint = arm.joints[k], arm.description.joints[k]
    zeros = []
    for side, counts in ends.items():
        push = -joint.backlash / 2 if side == "lower" else joint.backlash / 2
        zeros.append(counts - motor.in_counts(stop_angle(joint, side) + push))
    motor.zero = sum(zeros) / len(zeros)
    backlash = None
    if len(ends) == 2:
        span = abs(ends["upper"] - ends["lower"]) * motor.resolution
        backlash = span - (stop_angle(joint, "upper") - stop_angle(joint, "lower"))
        if abs(backlash - joint.backlash) > MAX_STOP_ERROR:
            raise Blocked(_not_as_described(arm.description, k, span, backlash))
    return Found(joint.name, motor.zero, backlash, spread)


def _not_as_described(arm, k, span, backlash):
    # type: (Arm, int, float, float) -> str
    """Return the message on stops at a distance of `span`, hence with so much `backlash`; rad."""
    joint = arm.joints[k]
    fact = (
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
            return fact + swapped(arm, joint, other)
    if backlash < joint.backlash:  # something in its path stopped it too early
        return fact + "clear its way, ease it if it runs stiffly, or measure them"
    return fact + (
        "measure them, and its play, which by that is {:.1f} deg: stop_lower, stop_upper, backlash "
        "in [{}] of {}".format(math.degrees(backlash), joint.name, arm.file)
    )


def swapped(arm, joint, other):
    # type: (Arm, Joint, Joint) -> str
    """Return the advice on a joint whose stops are those of another one."""
    return (
        "they are those of the {0}, so the cables of ports {1} and {2} are swapped: exchange them, "
        "or port = {1} and port = {2} in [{3}] and [{0}] of {4}".format(
            other.name, joint.port, other.port, joint.name, arm.file
        )
    )


def _touches(arm, k, sign, farthest):
    # type: (RobotArm, int, int, Optional[float]) -> List[float]
    """Return the counts of TOUCHES_PER_PUSH touches of a stop with the same force."""
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
    """Leave the stop (counts) on the side of `sign` by BACK_OFF, or at least MIN_BACK_OFF."""
    at = (stop - motor.zero) / motor.in_counts(1)

    def stop_when_clear(t, now, angles):
        # type: (float, float, Pose) -> object
        return STOP if sign * (at - angles[0]) > MIN_BACK_OFF else None

    move = JointMove([motor.angle()], [at - sign * BACK_OFF], [BACK_OFF_SPEED])
    arm.move_motor(motor, move, on_tick=stop_when_clear)


def push(arm, motor, joint, sign, force, farthest=None):
    # type: (RobotArm, Motor, Joint, int, float, Optional[float]) -> float
    """Push until the joint stands; return the middle of the encoder's interval there, counts.

    Args:
        arm: robot.motion.arm.RobotArm.
        motor: its JointMotor.
        joint: the shared.arm_description.Joint that it turns.
        sign: direction, +1 or -1.
        force: maximum, % of duty.
        farthest: see `touch_stop`.

    Raises:
        Blocked: it does not come to a stand.
    """
    clock = arm.clock
    most = _longest_travel(joint) if farthest is None else sign * (farthest - motor.angle())
    # A standing motor's force is the stiffness times the speed set-point.
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
            # The mean of two, for a reading may fall just before or after a count.
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
    """Push a joint at rest that is free in this direction until its encoder counts.

    An encoder that dies on the approach looks like a stop.  Leaving that supposed stop, the joint
    gives no count, and is stopped here.

    Raises:
        Stalled: there is no count within KICK_TIMEOUT.
        TooSlow: the brick took no reading in that time.
    """

    def push(force):
        # type: (float) -> None
        motor.drive(sign * math.radians(force / STIFFNESS) / joint.gear)

    full = ROTOR_PUSH + LINK_PUSH / joint.gear
    motor.engage(STIFFNESS)
    stands = motor.bounds()
    push(full)
    since = sampled = clock.now()  # only now: a slow brick needs some time to begin
    late = 0.0
    while True:
        clock.sleep(KICK_PERIOD)
        if motor.bounds() != stands:
            return
        now = clock.now()
        late, sampled = max(late, now - sampled), now
        if now - since > KICK_TIMEOUT:
            if late > KICK_TIMEOUT:
                raise TooSlow(late)
            raise Stalled(motor, "it does not set out")
        push(full if now - since < KICK_TIME else ROTOR_PUSH)


def _longest_travel(joint):
    # type: (Joint) -> float
    """Return the maximum travel of a joint to its stop, rad."""
    if joint.stop_lower is None or joint.stop_upper is None:
        return 2 * math.pi
    return joint.stop_upper - joint.stop_lower + MAX_BACKLASH + MAX_STOP_ERROR
