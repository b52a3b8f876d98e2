"""Check of which motor turns which joint, and which way: each is jogged while a person watches.

An encoder sits on its motor and shows nothing of the joint that this turns.
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
"""Angle of a jog, there and back, rad, and its speed, rad/s."""

MAX_JOG_ANGLE = math.radians(13)
"""Maximum angle of a jog if the motor turns another joint, with another gear, rad."""

JOG_PAUSE = 0.7
"""Pause between the two moves of a jog, s: the first direction must be visible."""

NOTHING = "nothing"
"""Name for the part that moved where none did."""

PEN = "pen"
"""Name of the part whose motor may be at a joint's port."""

if MYPY:
    Observed = NamedTuple("Observed", [("part", str), ("positive", bool)])
else:
    Observed = record("Observed", "part positive")
Observed.__doc__ = """An observation of a motor that turned to increase its joint's angle.

part      name of the part that moved, or NOTHING
positive  whether its angle grew
"""


class NotMounted(ArmError):
    """An observation that fits no mounting of the arm's file."""


def jog_angles(arm, k):
    # type: (Arm, int) -> Tuple[float, float]
    """Return the angles of a first jog of joint `k`'s motor, and of a second, larger one.

    Whichever joint the motor turns, it goes at most by JOG_ANGLE first, by MAX_JOG_ANGLE then.

    Args:
        arm: shared.arm_description.Arm.
        k: number of the joint.

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
        robot: RobotArm.
        k: number of the joint.
        angle: of the jog, rad.
        pause: called at the end of either move; waits for JOG_PAUSE if None.
        on_tick: as for RobotArm.follow; if it ends a move, `pause` is called all the same.

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
    """Return the NotMounted for the motor of `joint` by the arm's file that moved no part."""
    return NotMounted(
        "the motor at port {0} turned, and nothing moved: its play is far beyond "
        "backlash = {1:g} of [{2}] in {3}, or what it should turn has come loose; fasten "
        "that, measure the play, then check again".format(
            joint.port, math.degrees(joint.backlash), joint.name, arm.file
        )
    )


def as_mounted(arm, seen):
    # type: (Arm, Sequence[Observed]) -> Mounted
    """Return the ports and directions of the arm's file that fit the observations.

    Args:
        arm: shared.arm_description.Arm by which the motors were turned.
        seen: an Observed per joint, of the motor that is the joint's by the file.

    Returns:
        {joint's name: (port, direction)}.

    Raises:
        NotMounted: a motor moved no joint, or two motors the same one.
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
    """Compare the mounting with the arm's file.

    Args:
        arm: shared.arm_description.Arm.
        found: {joint's name: (port, direction)}, see `as_mounted`.

    Returns:
        (sentences for people, {(section, key): text for the file}); both empty where all is right.
    """
    lines, values = [], {}  # type: List[str], Dict[Tuple[str, str], str]
    moved = [joint for joint in arm.joints if found[joint.name][0] != joint.port]
    if len(moved) == 2:
        lines.append("{} and {} are swapped".format(*[joint.name for joint in moved]))
    elif moved:
        lines.append("{} are each at another's port".format(", ".join(j.name for j in moved)))
    for joint in arm.joints:
        port, direction = found[joint.name]
        if port != joint.port:
            values[joint.name, "port"] = port
        if direction != joint.direction:
            values[joint.name, "direction"] = str(direction)
            lines.append("the {} turns the other way round".format(joint.name))
    return lines, values
