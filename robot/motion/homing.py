"""Homing: the zero as the arm was placed, or by its stops.

From the home pose, where a person has put it, a joint seeks within bounds, see homing_from_home.
From any pose it seeks only on explicit request.
"""

import contextlib

from robot.motion.stops import Found, declare_angle, set_zero, touch_stop

MYPY = False
if MYPY:
    from typing import Dict, List  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.gravity import Gravity  # noqa: F401
    from robot.motion.pace import ReportLine  # noqa: F401


def home(arm, gravity, here, seek, report):
    # type: (RobotArm, Gravity, bool, bool, ReportLine) -> List[Found]
    """Set the motors' zeros; the arguments are those of RobotArm.home, and the arm's Gravity.

    A joint that is placed by hand rests on the side of its backlash that gravity closes.
    """
    joints = arm.description.joints
    if arm.pen and arm.description.pen:
        declare_angle(arm.pen, arm.description.pen.up)
    if seek:
        with arm.lend_motors(zero_needed=False):
            return find_zero(arm, report)
    here = here or all(joint.find_home == "here" for joint in joints)
    with contextlib.ExitStack() as lent:
        if gravity.loaded or not here:  # else no motor is touched
            lent.enter_context(arm.lend_motors(zero_needed=False))
        sides = gravity.preload_sides([joint.home for joint in joints])
        for motor, joint, side in zip(arm.joints, joints, sides):
            declare_angle(motor, joint.home + side * joint.backlash / 2)
        if here:
            return []
        from robot.motion import homing_from_home  # not above: few arms ask for it

        return homing_from_home.find_zero(arm, report)


def find_zero(arm, report):
    # type: (RobotArm, ReportLine) -> List[Found]
    """Touch the stops of every joint as its `seek` says, from any pose; set the motors' zeros.

    A joint without stops is taken to stand at home.

    Args:
        arm: robot.motion.arm.RobotArm.
        report: called with one line of progress at a time.

    Returns:
        One Found per joint.

    Raises:
        Blocked: with the measured and the expected stops.
    """
    out = []
    for k in reversed(range(len(arm.joints))):
        motor, joint = arm.joints[k], arm.description.joints[k]
        if joint.seek is None:
            declare_angle(motor, joint.home)
            out.append(Found(joint.name, motor.zero, None, 0))
            continue
        ends, spread = {}, 0  # type: Dict[str, float], float
        for side in ("lower", "upper"):
            if joint.seek in (side, "both"):
                ends[side], distance = touch_stop(arm, k, side, report)
                spread = max(spread, distance)
        out.append(set_zero(arm, k, ends, spread))
    return out[::-1]
