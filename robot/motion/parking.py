"""The path to the resting pose of an upright arm: slow, and clear of the table."""

from robot.motion import kinematics

MYPY = False
if MYPY:
    from typing import Sequence, Tuple  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import FixedPose, Pose  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

TABLE_CLEARANCE = 1.0
"""Minimum height of elbow and tip above the table on the path, cm, or that of their start."""

HEIGHT_SLACK = 0.1
"""Tolerance of that height, cm: the arm's own height is known no better."""

PARKING_SPEED, SAMPLES_PER_MOVE = 0.3, 40
"""Share of full speed on the path down, and number of poses checked on each of its moves."""


def go_low(robot):
    # type: (RobotArm) -> bool
    """Go to the resting pose, see RobotArm.go_low; return whether there is one.

    Args:
        robot: RobotArm whose zero is known.
    """
    description = robot.description
    if all(joint.park_angle is None for joint in description.joints):
        return False
    for place in way_down(description, robot.angles()):
        robot.go_to(place, PARKING_SPEED)
    return True


def way_down(arm, q):
    # type: (Arm, FixedPose) -> Tuple[FixedPose, ...]
    """Return the poses of the path to the resting pose; joints without a resting angle stay.

    The path is straight in joint angles, or through the home pose: whichever clears the table.

    Args:
        arm: shared.arm_description.Arm.
        q: joint angles now, rad.

    Returns:
        Tuple of poses, rad.

    Raises:
        kinematics.Unreachable: neither path is free.
    """
    rest, home = (
        tuple(
            min(max(a, joint.lower), joint.upper)
            if joint.park_angle is None
            else getattr(joint, where)
            for a, joint in zip(q, arm.joints)
        )
        for where in ("park_angle", "home")
    )
    for path in ((rest,), (home, rest)):
        if _is_free(arm, (q,) + path):
            return path
    raise kinematics.Unreachable(
        "no way down to where the arm rests keeps off the table: it is held where it is; "
        "support it before the brick is switched off"
    )


def _is_free(arm, path):
    # type: (Arm, Sequence[Pose]) -> bool
    """Return whether elbow and tip clear the table on the straight joint moves of a path."""
    lowest = min(TABLE_CLEARANCE, _clearance(arm, path[0])) - HEIGHT_SLACK
    return all(
        _clearance(arm, [x + (y - x) * k / float(SAMPLES_PER_MOVE) for x, y in zip(a, b)]) > lowest
        for a, b in zip(path, path[1:])
        for k in range(SAMPLES_PER_MOVE + 1)
    )


def _clearance(arm, q):
    # type: (Arm, Pose) -> float
    """Return the height of the lowest joint or tip at `q` (rad), the base aside, cm."""
    return min(p[-1] for p in kinematics.joint_positions(arm, q)[1:])
