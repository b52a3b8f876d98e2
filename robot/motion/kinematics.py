"""Kinematics of the arm: forward, inverse in closed form, Jacobian, singularity, joint limits.

Pure: numbers in, numbers out; no motor, no file, no clock.

    q   joint angles, rad, from the base outwards, one for each joint of the arm
    p   position of the tip, cm, in the base frame: x forward, y left, and in space z up.  The
        origin: planar, the shoulder's axis; spatial, the base's axis at the height of the paper
    J   Jacobian dp/dq, cm/rad, a tuple of rows: len(p) x len(q)
    e   error of the tip, p_wanted - p, cm

The formulas of each chain of joints are in robot.motion.chains; all here works for any chain.
"""

import itertools
import math

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.chains import (  # noqa: F401
        CHAINS,
        FixedPoint,
        FixedPose,
        KinematicChain,
        Point,
        Pose,
        Solutions,
    )
    from robot.motion.chains import Unreachable as Unreachable
    from robot.motion.chains import point_text as point_text
    from robot.motion.chains import reach as reach
    from robot.motion.linear_systems import Matrix, Vector  # noqa: F401
    from shared.arm_description import Arm, Joint  # noqa: F401
else:
    from robot.motion.chains import CHAINS, Unreachable, point_text, reach  # noqa: F401

TURN = 2 * math.pi
"""Full turn, rad."""

LIMIT_SLACK = 1e-6
"""Tolerance of the joint limits for rounding, rad: near full reach the elbow's angle grows with the
root of the rounding.  An encoder count is 0.017 rad."""


# ---- for every chain


def forward(arm, q):
    # type: (Arm, Pose) -> FixedPoint
    """Return the position p of the tip, cm, at the joint angles q, rad."""
    return joint_positions(arm, q)[-1]


def joint_positions(arm, q):
    # type: (Arm, Pose) -> Sequence[FixedPoint]
    """Return the positions (cm) of the joints from the base outwards, and the tip: len(q) + 1."""
    return chain_of(arm).positions(arm, q)


def jacobian(arm, q):
    # type: (Arm, Pose) -> Matrix
    """Return J = dp/dq at q, cm/rad, as a tuple of rows."""
    return chain_of(arm).jacobian(arm, q)


def pull(arm, q, moments):
    # type: (Arm, Pose, Vector) -> List[float]
    """Return the torque of gravity on each joint at q: minus the gradient of potential energy.

    Args:
        arm: shared.arm_description.Arm.
        q: joint angles, rad.
        moments: per joint, in any unit of a torque: the link's weight times the distance of its
            centre of mass, plus the weight of all links beyond times this link's length.

    Returns:
        As many torques, in the unit of `moments`.
    """
    return chain_of(arm).pull(q, moments)


def singularity(arm, q):
    # type: (Arm, Pose) -> float
    """Return the distance of q from a singular pose, without unit: 0 at one, at most 1.

    It is the manipulability |det J| (Yoshikawa, 1985) over l1 l2: for two links in a plane
    |sin q2|.  In space a factor is added, the tip's distance from the base's axis as a share of
    the reach: on the axis the base does not move the tip.
    """
    return chain_of(arm).singularity(arm, q)


def scale(arm, q):
    # type: (Arm, Pose) -> float
    """Return the path length over which the joint angles bend at q, cm: 0 at a singular pose."""
    return chain_of(arm).scale(arm, q)


def coordinates(arm):
    # type: (Arm) -> int
    """Return the number of coordinates of the arm's points: 2 in the plane, 3 in space."""
    return chain_of(arm).coordinates


def branches(arm, p):
    # type: (Arm, Point) -> List[FixedPose]
    """Return every q (rad) within the limits with the tip at p (cm), the preferred elbow first.

    The list is empty where only the limits forbid p; raises Unreachable where the links do.  With
    the tip on the shoulder's axis, the shoulder's angle is arbitrary, and one is returned.
    """
    solutions = _solutions(arm, p)
    found = []  # type: List[FixedPose]
    for elbow in _elbows(arm):
        for solution in solutions[elbow]:
            found += (q for q in _within_limits(arm, solution) if q not in found)
    return found


def inverse(arm, p, elbow=None, near=None):
    # type: (Arm, Point, Optional[str], Optional[Pose]) -> FixedPose
    """Return the q (rad) within the joint limits that brings the tip to p.

    Args:
        arm: shared.arm_description.Arm.
        p: point, cm.
        elbow: "up" | "down": only that branch; None: any.
        near: pose, rad: the solution with the least maximum joint travel from it.  None: the
            arm's preferred elbow first, and of solutions a turn apart the one nearest to home.

    Raises:
        Unreachable: the links or the limits forbid p.
    """
    solutions = _solutions(arm, p)
    if near is not None:
        check_pose(arm, near)
    candidates = []
    for branch in [elbow] if elbow else _elbows(arm):
        if branch not in solutions:
            raise ArmError("elbow = {}: must be one of {}".format(elbow, ", ".join(_elbows(arm))))
        for solution in solutions[branch]:
            candidates += _within_limits(arm, solution)
        if candidates and near is None:
            break
    if not candidates:
        raise _forbidden(
            arm,
            p,
            [
                ("elbow " + branch, solution)
                for branch in ([elbow] if elbow else _elbows(arm))
                for solution in solutions[branch]
            ],
        )
    start = near if near is not None else [joint.home for joint in arm.joints]
    return min(candidates, key=lambda q: _travel(start, q))


def nearest(arm, p, q):
    # type: (Arm, Point, Pose) -> FixedPose
    """Return `inverse` of p (cm) near q (rad), in less time where the solution is near indeed."""
    # Of solutions that face two ways the bases differ by half a turn: within a quarter is nearest.
    best, least = None, math.pi / 2
    for poses in _solutions(arm, p, q).values():
        for pose in poses:
            candidate, greatest = [], 0.0
            for angle, last in zip(pose, q):
                travel = angle - last
                if not -math.pi < travel < math.pi:
                    travel -= TURN * round(travel / TURN)
                candidate.append(last + travel)
                if travel > greatest or -travel > greatest:
                    greatest = abs(travel)
            if greatest < least:
                best, least = candidate, greatest
    for joint, angle in zip(arm.joints, best or ()):
        if not joint.lower <= angle <= joint.upper:
            best = None
    return inverse(arm, p, near=q) if best is None else tuple(best)


def chain_of(arm):
    # type: (Arm) -> KinematicChain
    """Return the arm's KinematicChain; raises ArmError for one that is not known."""
    try:
        return CHAINS[arm.chain]
    except KeyError:
        raise ArmError(
            "{}: no kinematics for chain = {}; use one of {}".format(
                arm.file, arm.chain, ", ".join(sorted(CHAINS))
            )
        ) from None


# ---- limits


def _solutions(arm, p, near=None):
    # type: (Arm, Point, Optional[Pose]) -> Solutions
    """Return {branch: [q]} without regard to limits; with `near` (rad) only those facing as it."""
    check_point(arm, p)
    return chain_of(arm).solutions(arm, p, near)


def check_point(arm, p):
    # type: (Arm, Point) -> None
    """Raise Unreachable unless p is a point (cm) of this arm's space."""
    size = coordinates(arm)
    # Squares must stay finite, too
    usable = len(p) == size
    for c in p:
        usable = usable and -1e100 < c < 1e100
    if not usable:
        raise Unreachable(
            "{}: a point is {} finite numbers, cm; give such a point".format(point_text(p), size)
        )


def check_pose(arm, q):
    # type: (Arm, Pose) -> None
    """Raise ArmError unless q has a finite angle (rad) for each joint."""
    if len(q) != len(arm.joints) or not all(map(math.isfinite, q)):
        raise ArmError(
            "{} deg: a pose is {} finite angles; give such a pose".format(
                pose_text(q), len(arm.joints)
            )
        )


def check_limits(joints, q):
    # type: (Sequence[Joint], Pose) -> None
    """Raise Unreachable for joint angles (rad) past the limits, naming the first one."""
    for joint, angle in zip(joints, q):
        if not joint.lower - 1e-9 <= angle <= joint.upper + 1e-9:
            raise Unreachable(
                "the {} cannot go to {:.1f} deg: its limits are {:.1f} and {:.1f} deg; "
                "choose another pose".format(
                    joint.name, *(math.degrees(a) for a in (angle, joint.lower, joint.upper))
                )
            )


def turned_into_limits(arm, p, q):
    # type: (Arm, Point, Pose) -> FixedPose
    """Return q (rad), moved by full turns into the limits, to the nearest pose within them.

    Raises Unreachable, which names the point p (cm), where there is none.
    """
    candidates = _within_limits(arm, q)
    if not candidates:
        raise _forbidden(arm, p, [("the pose found", q)])
    return min(candidates, key=lambda found: _travel(q, found))


def _elbows(arm):
    # type: (Arm) -> Tuple[str, str]
    """Return the branches, the arm's preferred one first."""
    return ("up", "down") if arm.elbow == "up" else ("down", "up")


def _within_limits(arm, q):
    # type: (Arm, Pose) -> List[FixedPose]
    """Return every q (rad) that differs from this one by full turns and is within the limits."""
    return list(itertools.product(*(_turned(joint, angle) for joint, angle in zip(arm.joints, q))))


def _turned(joint, angle):
    # type: (Joint, float) -> List[float]
    """Return the angles (rad) within the limits of a joint that differ by full turns."""
    first = math.ceil((joint.lower - LIMIT_SLACK - angle) / TURN)
    last = math.floor((joint.upper + LIMIT_SLACK - angle) / TURN)
    return [min(max(angle + k * TURN, joint.lower), joint.upper) for k in range(first, last + 1)]


def _forbidden(arm, p, poses):
    # type: (Arm, Point, Sequence[Tuple[str, Pose]]) -> Unreachable
    """Return an Unreachable that names, for each (name, q), the joint and limit it violates."""
    reasons = []
    for name, q in poses:
        joint, angle = next(
            (joint, angle) for joint, angle in zip(arm.joints, q) if not _turned(joint, angle)
        )
        # Of the turns, the one that comes nearest to what is allowed
        middle = (joint.lower + joint.upper) / 2
        angle -= TURN * round((angle - middle) / TURN)
        side, limit = ("lower", joint.lower) if angle < middle else ("upper", joint.upper)
        reasons.append(
            "{} needs {} at {:.2f} deg, limit {} = {:.2f} deg".format(
                name, joint.name, math.degrees(angle), side, math.degrees(limit)
            )
        )
    return Unreachable(
        "{} is within reach of the links but not of the joint limits ({}); choose"
        " another point".format(point_text(p), "; ".join(reasons))
    )


# ---- wording and distances


def distance(a, b):
    # type: (Vector, Vector) -> float
    """Return the distance of two points, in their unit, cm."""
    return math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)))


def _travel(q, to):
    # type: (Pose, Pose) -> float
    """Return the maximum travel of any joint (rad), which determines the time of a move."""
    return max(abs(a - b) for a, b in zip(q, to))


def pose_text(q):
    # type: (Pose) -> str
    """Return a pose (rad) as text for people, deg."""
    return "({})".format(", ".join("{:.1f}".format(math.degrees(angle)) for angle in q))
