"""The way to where an upright arm rests: slow, and clear of the table."""

from robot.motion import kinematics

MYPY = False
if MYPY:
    from typing import Sequence, Tuple  # noqa: F401

    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import FixedPose, Pose  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

TABLE_CLEARANCE = 1.0
"""Elbow and tip go no lower than this above the table on the way, cm; or than where they begin."""

HEIGHT_SLACK = 0.1
"""An arm knows no better how high it stands, cm: by so much its way may go lower."""

PARKING_SPEED, SAMPLES_PER_MOVE = 0.3, 40
"""Share of full speed on the way down, and places looked at on each of its moves."""


def go_low(robot):
    # type: (RobotArm) -> bool
    """Go there, see RobotArm.go_low; whether there is such a place.

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
    """Poses to go through to where the arm rests; joints without such a place stay.

    Straight there, or by way of the home pose: whichever keeps off the table.

    Args:
        arm: shared.arm_description.Arm.
        q: joint angles now, rad.

    Returns:
        Tuple of poses, rad.

    Raises:
        kinematics.Unreachable: neither way is free.
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
    for way in ((rest,), (home, rest)):
        if _is_free(arm, (q,) + way):
            return way
    raise kinematics.Unreachable(
        "no way down to where the arm rests keeps off the table: it is held where it is; "
        "support it before the brick is switched off"
    )


def _is_free(arm, way):
    # type: (Arm, Sequence[Pose]) -> bool
    """Return True if elbow and tip keep off the table on the straight joint moves of a way."""
    lowest = min(TABLE_CLEARANCE, _clearance(arm, way[0])) - HEIGHT_SLACK
    return all(
        _clearance(arm, [x + (y - x) * k / float(SAMPLES_PER_MOVE) for x, y in zip(a, b)]) > lowest
        for a, b in zip(way, way[1:])
        for k in range(SAMPLES_PER_MOVE + 1)
    )


def _clearance(arm, q):
    # type: (Arm, Pose) -> float
    """Height of what is lowest of the arm, the base aside, cm."""
    return min(p[-1] for p in kinematics.joint_positions(arm, q)[1:])
