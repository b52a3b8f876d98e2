"""Which motor turns which joint, and which way: each is turned a little, and somebody looks.

An encoder sits on its motor and tells nothing of what that turns.
"""

import math

from robot.motion.control_loop import Stalled
from robot.motion.trajectory import JointMove
from shared.arm_description import ArmError
from shared.record import record

MYPY = False
if MYPY:
    from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.control_loop import OnTick  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

    Mounted = Dict[str, Tuple[str, int]]  # by joint: port and direction

JOG_ANGLE, JOG_SPEED = math.radians(8), math.radians(15)
"""How far a joint is turned and back, rad, and how fast, rad/s."""

MAX_JOG_ANGLE = math.radians(13)
"""And no farther if it is another joint behind another gear, rad."""

JOG_PAUSE = 0.7
"""Between the way there and the way back, s: what moved first is to be seen."""

NOTHING = "nothing"
"""The part that was seen to move where none was."""

PEN = "pen"
"""The part whose motor may be at a joint's port."""

if MYPY:
    Observed = NamedTuple("Observed", [("part", str), ("positive", bool)])
else:
    Observed = record("Observed", "part positive")
Observed.__doc__ = """What a person has seen when a motor turned as its joint's angle was to grow.

part      name of the part that moved, or NOTHING
positive  whether its angle grew
"""


class NotMounted(ArmError):
    """What was seen is no arm of this file, in whatever way it is put together."""


def jog_angles(arm, k):
    # type: (Arm, int) -> Tuple[float, float]
    """How far to turn the motor that should be joint `k`'s, gently and, if that is not seen, far.

    Whichever joint it turns, that goes no farther than JOG_ANGLE first, than MAX_JOG_ANGLE then.

    Args:
        arm: shared.arm_description.Arm.

    Returns:
        Two angles, rad, as joint `k` would turn.
    """
    gear = arm.joints[k].gear
    least = min(joint.gear for joint in arm.joints)
    return JOG_ANGLE * least / gear, min(JOG_ANGLE, MAX_JOG_ANGLE * least / gear)


def jog(robot, k, angle, pause=None, on_tick=None):
    # type: (RobotArm, int, float, Optional[Callable[[], object]], Optional[OnTick]) -> None
    """Turn the motor of joint `k` so far that its angle grows by `angle` (rad), and back again.

    Args:
        pause: called at the end of either way; waits for JOG_PAUSE if None.
        on_tick: as for RobotArm.follow; what it ends is for `pause` to notice.

    Raises:
        NotMounted: it does not turn, or not freely; all motors are stopped.
        TooSlow, MotorNotFound: after stopping.
    """
    motor = robot.joints[k]
    try:
        with robot.lend_motors(zero_needed=False):
            begin = motor.angle()
            for start, end in ((begin, begin + angle), (begin + angle, begin)):
                move = JointMove([start], [end], [JOG_SPEED])
                robot.move_motor(motor, move, on_tick=on_tick)
                if pause:
                    pause()
                else:
                    robot.clock.sleep(JOG_PAUSE)
    except Stalled as problem:
        raise NotMounted(
            problem.fact + ": if its link stands at a stop, move it away by hand; else free it, or "
            "look at its cable; then check again"
        ) from None


def nothing_moved(arm, joint):
    # type: (Arm, Joint) -> NotMounted
    """The NotMounted of a motor that turned, `joint`'s by the arm's file, and moved nothing."""
    return NotMounted(
        "the motor at port {0} turned, and nothing moved: its play is far beyond "
        "backlash = {1:g} of [{2}] in {3}, or what it should turn has come loose; fasten "
        "that, measure the play, then check again".format(
            joint.port, math.degrees(joint.backlash), joint.name, arm.file
        )
    )


def as_mounted(arm, seen):
    # type: (Arm, Sequence[Observed]) -> Mounted
    """What the arm's file has to say for what was seen.

    Args:
        arm: shared.arm_description.Arm by which the motors were turned.
        seen: an Observed per joint, what the motor did that should be its.

    Returns:
        {joint's name: (port, direction)}.

    Raises:
        NotMounted: no joint but nothing or the pen, or one by two motors.
    """
    found = {}  # type: Mounted
    for joint, (part, positive) in zip(arm.joints, seen):
        if part == NOTHING:
            raise nothing_moved(arm, joint)
        if part == PEN and arm.pen:
            raise NotMounted(
                "the motor at port {} moves the pen, and the one at port {} should: exchange their "
                "cables, or the lines port of [{}] and [pen] in {}; then check again".format(
                    joint.port, arm.pen.port, joint.name, arm.file
                )
            )
        if part in found:
            raise NotMounted(
                "the motors at ports {} and {} both moved the {}, it was said: one of two answers "
                "is wrong; check again".format(found[part][0], joint.port, part)
            )
        found[part] = (joint.port, joint.direction if positive else -joint.direction)
    return found


def differences(arm, found):
    # type: (Arm, Mounted) -> Tuple[List[str], Dict[Tuple[str, str], str]]
    """What is otherwise than the arm's file says.

    Args:
        found: see `as_mounted`.

    Returns:
        (sentences for people, {(section, key): text for the file}); both empty where all is right.
    """
    said, values = [], {}  # type: List[str], Dict[Tuple[str, str], str]
    moved = [joint for joint in arm.joints if found[joint.name][0] != joint.port]
    if len(moved) == 2:
        said.append("{} and {} are swapped".format(*[joint.name for joint in moved]))
    elif moved:
        said.append("{} are each at another's port".format(", ".join(j.name for j in moved)))
    for joint in arm.joints:
        port, direction = found[joint.name]
        if port != joint.port:
            values[joint.name, "port"] = port
        if direction != joint.direction:
            values[joint.name, "direction"] = str(direction)
            said.append("the {} turns the other way round".format(joint.name))
    return said, values
