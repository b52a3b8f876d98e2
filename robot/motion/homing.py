"""Finding the zero: as somebody has put the arm, or by its stops.

From home, where somebody has put it, a joint seeks within bounds, see homing_from_home; from
anywhere only where that is asked for by name.
"""

import contextlib

from robot.motion.stops import Found, set_zero, take_as_it_stands, touch_stop

MYPY = False
if MYPY:
    from typing import Dict, List  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.gravity import Gravity  # noqa: F401
    from robot.motion.pace import Say  # noqa: F401


def home(arm, gravity, here, seek, say):
    # type: (RobotArm, Gravity, bool, bool, Say) -> List[Found]
    """Set the motors' zeros, see RobotArm.home.

    Args:
        gravity: robot.motion.gravity.Gravity, what pulls on the joints.
    """
    joints = arm.description.joints
    if arm.pen and arm.description.pen:
        take_as_it_stands(arm.pen, arm.description.pen.up)
    if seek:
        with arm.lend_motors(zero_needed=False):
            return find_zero(arm, say)
    here = here or all(joint.find_home == "here" for joint in joints)
    with contextlib.ExitStack() as lent:
        if gravity.loaded or not here:  # else nothing is touched
            lent.enter_context(arm.lend_motors(zero_needed=False))
        sides = gravity.preload_sides([joint.home for joint in joints])
        for motor, joint, side in zip(arm.joints, joints, sides):
            take_as_it_stands(motor, joint.home + side * joint.backlash / 2)
        if here:
            return []
        from robot.motion import homing_from_home  # not above: few arms ask for it

        return homing_from_home.find_zero(arm, say)


def find_zero(arm, say):
    # type: (RobotArm, Say) -> List[Found]
    """Touch the stops of every joint as its `seek` says, wherever it is; set the motors' zeros.

    One without stops is taken to stand at home.

    Args:
        arm: robot.motion.arm.RobotArm.
        say: called with one line of progress at a time.

    Returns:
        One Found per joint.

    Raises:
        Blocked: with what was found and what was expected.
    """
    out = []
    for k in reversed(range(len(arm.joints))):
        motor, joint = arm.joints[k], arm.description.joints[k]
        if joint.seek is None:
            take_as_it_stands(motor, joint.home)
            out.append(Found(joint.name, motor.zero, None, 0))
            continue
        ends, spread = {}, 0  # type: Dict[str, float], float
        for side in ("lower", "upper"):
            if joint.seek in (side, "both"):
                ends[side], apart = touch_stop(arm, k, side, say)
                spread = max(spread, apart)
        out.append(set_zero(arm, k, ends, spread))
    return out[::-1]
