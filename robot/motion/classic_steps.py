"""The lab report's way of drawing a line: joint steps by the inverse Jacobian.

Pure.  Letters: `q` joint angles rad, `dq` a step, `p` a tip position cm, `J` the Jacobian cm/rad.
"""

import math

from robot.motion import kinematics, linear_systems

MYPY = False
if MYPY:
    from robot.motion.chains import FixedPose, Point, Pose  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

STEP_SIZE = math.radians(5)
"""Length of a joint step in the report, rad."""

ARRIVAL_DISTANCE = 1.0
"""Distance from the goal at which the report's steps end, cm."""


def jacobian_step(arm, q, dy):
    # type: (Arm, Pose, Vector) -> FixedPose
    """Return the report's joint step dq = J^-1 dy, scaled to a length of STEP_SIZE.

    Args:
        arm: shared.arm_description.Arm.
        q: joint angles, rad.
        dy: the line's whole displacement, cm, as fixed at its start.

    Returns:
        dq, rad, as many as joints.

    Raises:
        kinematics.Unreachable: the arm is stretched or folded; no joint step leads that way.
    """
    J = kinematics.jacobian(arm, q)
    if kinematics.singularity(arm, q) < 1e-6:
        raise kinematics.Unreachable(
            "the Jacobian has no inverse at joint angles {} deg; start the line elsewhere".format(
                ", ".join("{:.1f}".format(math.degrees(angle)) for angle in q)
            )
        )
    dq = linear_systems.solve(J, dy)
    length = math.sqrt(sum(a * a for a in dq))
    return tuple(a * STEP_SIZE / length for a in dq)


def has_arrived(start, goal, p):
    # type: (Point, Point, Point) -> bool
    """Return whether the report's steps are over: near the goal, ARRIVAL_DISTANCE, or past it."""
    if kinematics.distance(goal, p) <= ARRIVAL_DISTANCE:
        return True
    return sum((x - g) * (g - s) for x, g, s in zip(p, goal, start)) >= 0
