"""The kinematic chains: two links in the plane; two upright links on a turntable.  Pure.

The letters are those of kinematics, whose functions are the way in.
"""

import math

from shared.arm_description import ArmError
from shared.record import record

MYPY = False
if MYPY:
    from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.linear_systems import Matrix, Vector  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401

    Pose = Sequence[float]  # joint angles, rad
    FixedPose = Tuple[float, ...]
    Point = Sequence[float]  # cm
    FixedPoint = Tuple[float, ...]
    Solutions = Dict[str, List[FixedPose]]  # by branch

REACH_SLACK = 1e-9
"""Tolerance of the reach for rounding, cm."""


class Unreachable(ArmError, ValueError):
    """A point that the arm cannot reach, or an iteration that did not find it."""


def reach(arm):
    # type: (Arm) -> Tuple[float, float]
    """Return the least and greatest distance of the tip from the shoulder by the links, cm."""
    upper, fore = arm.joints[-2].link, arm.joints[-1].link
    return abs(upper - fore), upper + fore


def point_text(p):
    # type: (Point) -> str
    """Return a point (cm) as text for people."""
    return "({}) cm".format(", ".join("{:.6g}".format(round(c, 6) + 0.0) for c in p))


# ---- the planar chain: every axis upright, the angles add up along the chain


def _link_ends(joints, q, x, y):
    # type: (Sequence[Joint], Pose, float, float) -> List[Tuple[float, float]]
    """Return every joint and the end of links in one plane, the first at (x, y), cm."""
    heading, positions = 0.0, [(x, y)]
    for joint, angle in zip(joints, q):
        link = joint.link
        heading += angle
        x += link * math.cos(heading)
        y += link * math.sin(heading)
        positions.append((x, y))
    return positions


def _planar_positions(arm, q):
    # type: (Arm, Pose) -> List[Tuple[float, float]]
    """Return (x, y) of every joint and the tip, cm."""
    return _link_ends(arm.joints, q, 0.0, 0.0)


def _planar_jacobian(arm, q):
    # type: (Arm, Pose) -> Matrix
    """Return J, cm/rad: a turn moves the tip across its lever arm (geometric Jacobian)."""
    if len(q) == 2:
        upper, fore = arm.joints
        heading, (first, second) = q[0], q
        fore_x, fore_y = fore.link * math.cos(first + second), fore.link * math.sin(first + second)
        x, y = upper.link * math.cos(heading) + fore_x, upper.link * math.sin(heading) + fore_y
        return (-y, -fore_y), (x, fore_x)
    positions = _planar_positions(arm, q)
    x, y = positions.pop()
    return (
        tuple([joint_y - y for _, joint_y in positions]),
        tuple([x - joint_x for joint_x, _ in positions]),
    )


def _planar_pull(q, moments):
    # type: (Pose, Vector) -> List[float]
    """Return zeros: gravity does not turn upright axes."""
    return [0.0] * len(q)


def _planar_solutions(arm, p, near):
    # type: (Arm, Point, Optional[Pose]) -> Solutions
    """Return the pose of each branch, rad, with the tip at p (cm)."""
    return {branch: [pose] for branch, pose in _bend_to(arm, p, p).items()}


def _bend_to(arm, point, p):
    # type: (Arm, Point, Point) -> Dict[str, Tuple[float, float]]
    """Solve two links for a point of their plane, seen from the first one's axis.

    With the links a, b and the distance d of the point, the cosine rule gives the bend beta:

        cos beta = (d^2 - a^2 - b^2) / (2 a b),
        tan^2 (beta/2) = ((a + b)^2 - d^2) / (d^2 - (a - b)^2)

    The second form is the half-angle formula.  Its factors keep all digits at full reach and at the
    hole.  There acos has an infinite slope and loses half of them (Kahan, 2000, for triangles).

    Args:
        arm: shared.arm_description.Arm.
        point: (x, y) in that plane from the first link's axis, cm.
        p: the point in the base frame, for messages, cm.

    Returns:
        {"up": (heading of the first, bend > 0 of the second), "down": the same with bend < 0}, rad.
    """
    upper, fore = arm.joints[-2].link, arm.joints[-1].link
    hole, outer = reach(arm)
    far = math.hypot(*point)
    if not hole - REACH_SLACK <= far <= outer + REACH_SLACK:
        where, advice = (
            ("out of reach", "nearer")
            if far > outer
            else ("in the hole in the middle", "farther out")
        )
        raise Unreachable(
            "{} is {:.6g} cm from the shoulder, {}: the links reach from {:.6g} to"
            " {:.6g} cm; choose a point {}".format(point_text(p), far, where, hole, outer, advice)
        )
    bend = 2 * math.atan2(
        math.sqrt(max(0.0, (outer - far) * (outer + far))),
        math.sqrt(max(0.0, (far - hole) * (far + hole))),
    )
    heading = math.atan2(point[1], point[0])
    inside = math.atan2(fore * math.sin(bend), upper + fore * math.cos(bend))
    return {"up": (heading - inside, bend), "down": (heading + inside, -bend)}


def _planar_singularity(arm, q):
    # type: (Arm, Pose) -> float
    """Return |sin q2|, see kinematics.singularity."""
    return abs(math.sin(q[1]))


def _planar_scale(arm, q):
    # type: (Arm, Pose) -> float
    """Return the path length over which the joint angles bend, cm."""
    return 0.5 * reach(arm)[1] * math.sin(q[1]) ** 2


# ---- the spatial chain: the base turns about an upright axis, shoulder and elbow pitch about level
# ones.  Pitch is counted upwards from level; the base's link is the height of the shoulder.


def _spatial_profile(arm, q):
    # type: (Arm, Pose) -> List[Tuple[float, float]]
    """Return the joints and the tip in the arm's upright plane: (distance, height), cm."""
    return [(0.0, 0.0)] + _link_ends(arm.joints[1:], q[1:], 0.0, arm.joints[0].link)


def _spatial_positions(arm, q):
    # type: (Arm, Pose) -> List[Tuple[float, float, float]]
    """Return (x, y, z) of every joint and the tip, cm."""
    cos, sin = math.cos(q[0]), math.sin(q[0])
    return [(out * cos, out * sin, height) for out, height in _spatial_profile(arm, q)]


def _spatial_jacobian(arm, q):
    # type: (Arm, Pose) -> Matrix
    """Return J, cm/rad: each joint moves the tip across its lever arm (geometric Jacobian)."""
    cos, sin = math.cos(q[0]), math.sin(q[0])
    profile = _spatial_profile(arm, q)
    out, height = profile.pop()
    columns = [(-out * sin, out * cos, 0.0)]
    for joint_out, joint_height in profile[1:]:
        outwards = joint_height - height
        columns.append((outwards * cos, outwards * sin, out - joint_out))
    return tuple(zip(*columns))


def _spatial_pull(q, moments):
    # type: (Pose, Vector) -> List[float]
    """Return the torque of gravity on each joint, in the unit of `moments`."""
    torques, heading = [0.0], 0.0
    for k in range(1, len(q)):
        heading += q[k]
        pulled = -moments[k] * math.cos(heading)
        for inner in range(1, k):
            torques[inner] += pulled
        torques.append(pulled)
    return torques


def _spatial_solutions(arm, p, near):
    # type: (Arm, Point, Optional[Pose]) -> Solutions
    """Return the poses that face the point, and those that reach it from behind, by branch."""
    x, y, z = p
    yaw, out = math.atan2(y, x), math.hypot(x, y)
    solutions = {"up": [], "down": []}  # type: Solutions
    # Facing the point, the elbow is above where it is bent down; from behind, where it is bent up.
    facings = [(0.0, out, "down"), (math.pi, -out, "up")]
    if near:
        facings = facings[:1] if _spatial_out(arm, near) > 0 else facings[1:]
    for turned, distance, above in facings:
        poses = _bend_to(arm, (distance, z - arm.joints[0].link), p)
        for bent, pitches in poses.items():
            solutions["up" if bent == above else "down"].append((yaw + turned,) + pitches)
    return solutions


def _spatial_out(arm, q):
    # type: (Arm, Pose) -> float
    """Return the distance of the tip from the base's axis, cm; negative: behind it."""
    _, upper, fore = arm.joints
    return upper.link * math.cos(q[1]) + fore.link * math.cos(q[1] + q[2])


def _spatial_singularity(arm, q):
    # type: (Arm, Pose) -> float
    """Return |sin q2| times the share of the reach, see kinematics.singularity."""
    return abs(math.sin(q[2]) * _spatial_out(arm, q)) / reach(arm)[1]


def _spatial_scale(arm, q):
    # type: (Arm, Pose) -> float
    """Return the path length over which the joint angles bend, cm."""
    return min(0.5 * reach(arm)[1] * math.sin(q[2]) ** 2, abs(_spatial_out(arm, q)))


if MYPY:
    KinematicChain = NamedTuple(
        "KinematicChain",
        [
            ("positions", Callable[[Arm, Pose], Sequence[FixedPoint]]),
            ("jacobian", Callable[[Arm, Pose], Matrix]),
            ("pull", Callable[[Pose, Vector], List[float]]),
            ("solutions", Callable[[Arm, Point, Optional[Pose]], Solutions]),
            ("singularity", Callable[[Arm, Pose], float]),
            ("scale", Callable[[Arm, Pose], float]),
            ("coordinates", int),
            ("below", int),
            ("up", int),
        ],
    )
else:
    KinematicChain = record(
        "KinematicChain", "positions jacobian pull solutions singularity scale coordinates below up"
    )
CHAINS = {
    "planar": KinematicChain(
        _planar_positions,
        _planar_jacobian,
        _planar_pull,
        _planar_solutions,
        _planar_singularity,
        _planar_scale,
        coordinates=2,
        below=0,
        up=1,
    ),
    "spatial": KinematicChain(
        _spatial_positions,
        _spatial_jacobian,
        _spatial_pull,
        _spatial_solutions,
        _spatial_singularity,
        _spatial_scale,
        coordinates=3,
        below=1,
        up=-1,
    ),
}
"""Formulas of each kinematic chain, by its name in the arm's file.

positions, jacobian  of the joints and the tip, cm, and dp/dq, cm/rad; both of (arm, q)
pull                 torques of gravity, of (q, moments), see kinematics.pull
solutions            poses with the tip at p, by branch, of (arm, p, near), limits aside
singularity, scale   see kinematics; both of (arm, q)
coordinates          number of coordinates of p
below                number of joints below the shoulder
up                   sign of the elbow's angle in the branch "up"
"""
