"""Knots along a piece: joint angles and their slopes, close together where the joints bend.

Pure.  `q` joint angles rad, `p` a tip position cm, `s` the length of the way, cm.
"""

import math

from robot.motion import kinematics, linear_systems

MYPY = False
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.chains import FixedPose, Point, Pose  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from robot.motion.paths import Piece  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Station = Tuple[float, Point, Vector]  # s, p, t
    Knot = Tuple[float, FixedPose, List[float], Optional[List[float]]]  # s, q, dq/ds, J' t

KNOT_SPACING, MIN_KNOT_SPACING = 0.5, 0.02
"""Greatest and least distance of knots, cm."""

KNOT_SCALE_SHARE = 0.15
"""Of the length over which joint angles bend (kinematics.scale), knots are no more apart."""

MAX_KNOT_BEND = math.radians(20)
"""From knot to knot a piece bends by no more, rad."""

MIN_SINGULARITY = 0.1
"""Below this singularity measure, across the path means nothing."""

MAX_JOINT_JUMP = math.radians(45)
"""Between two points so near to one another no joint turns farther, rad."""


def next_pose(arm, p, q):
    # type: (Arm, Point, Pose) -> FixedPose
    """The pose at `p` that is nearest to `q`, rad, without a leap."""
    there = kinematics.nearest(arm, p, q)
    leap = max([abs(a - b) for a, b in zip(there, q)])
    if leap > MAX_JOINT_JUMP:
        raise kinematics.Unreachable(
            "at ({}) cm the arm would have to swing a joint by {:.0f} deg to stay within its "
            "limits; draw the line in two, or choose the other elbow".format(
                ", ".join("{:.2f}".format(value) for value in p), math.degrees(leap)
            )
        )
    return there


def stations_of(piece):
    # type: (Piece) -> List[Station]
    """Those of a piece's points that will do, and the directions in which it passes them.

    Returns:
        [(s, p, t)]: length of the way and place, cm, and unit vector.
    """
    lengths = [kinematics.distance(a, b) for a, b in zip(piece, piece[1:])]
    ways = [
        [(v - u) / length for u, v in zip(a, b)] for a, b, length in zip(piece, piece[1:], lengths)
    ]
    if len(ways) == 1:
        return [(0.0, piece[0], ways[0]), (lengths[0], piece[1], ways[0])]
    # The tangent of the parabola through a point and its neighbours; at the ends, of the next one.
    tangents = [ways[0]]
    for a, b, x, y in zip(ways, ways[1:], lengths, lengths[1:]):
        tangents.append([(u * y + v * x) / (x + y) for u, v in zip(a, b)])
    tangents[0] = [2 * u - v for u, v in zip(ways[0], tangents[1])]
    tangents.append([2 * u - v for u, v in zip(ways[-1], tangents[-1])])
    out, s, turned = [], 0.0, 0.0  # type: List[Station], float, float
    for k, (p, tangent) in enumerate(zip(piece, tangents)):
        if (
            k in (0, len(ways))
            or s + lengths[k] - out[-1][0] > KNOT_SPACING
            or turned > MAX_KNOT_BEND / 2
        ):
            size = kinematics.distance(tangent, [0.0] * len(tangent))
            out.append((s, p, [u / size for u in tangent]))
            turned = 0.0
        if k < len(ways):
            s += lengths[k]
            turned += kinematics.distance(tangent, tangents[k + 1])
    return out


def knots_through(arm, stations, q):
    # type: (Arm, Sequence[Station], FixedPose) -> List[Knot]
    """[(s, q, dq/ds, J' t or None)] on the way through stations, the first of them at `q`."""
    knots = []  # type: List[Knot]
    for (s, p, t), (s_end, p_end, t_end) in zip(stations, stations[1:]):
        if not knots:
            q = next_pose(arm, p, q)
            knots.append((s, q) + _slopes(arm, q, t))
        whole = s_end - s
        # The cubic of Hermite, by x from 0 to 1: p + x (a + x (b + x c)).
        a = [whole * u for u in t]
        b = [3 * (v - u) - whole * (2 * m + n) for u, v, m, n in zip(p, p_end, t, t_end)]
        c = [2 * (u - v) + whole * (m + n) for u, v, m, n in zip(p, p_end, t, t_end)]
        done = 0.0
        span = min(KNOT_SPACING, KNOT_SCALE_SHARE * kinematics.scale(arm, q))
        if len(stations) == 2:
            span = min(span, whole / 2)  # it must speed up and slow down
        while done < whole:
            left = whole - done
            pieces = math.ceil(left / max(span, min(MIN_KNOT_SPACING, whole / 2)) - 1e-6)
            step = left / max(pieces, 1)
            x = (done + step) / whole
            if pieces <= 1:
                there, way = p_end, t_end  # type: Point, Vector
            else:
                there = [u + x * (k + x * (m + x * n)) for u, k, m, n in zip(p, a, b, c)]
                way = [(k + x * (2 * m + 3 * x * n)) / whole for k, m, n in zip(a, b, c)]
            q_there = next_pose(arm, there, q)
            span = min(KNOT_SPACING, KNOT_SCALE_SHARE * kinematics.scale(arm, q_there))
            if step > 2 * span and step > MIN_KNOT_SPACING:
                continue  # there it bends more than here
            q, done = q_there, s_end - s if pieces <= 1 else done + step
            knots.append((s + done, q) + _slopes(arm, q, way))
    return knots


def _slopes(arm, q, way):
    # type: (Arm, Pose, Vector) -> Tuple[List[float], Optional[List[float]]]
    """(dq/ds, J' t or None) at `q` for a tip that moves in the direction t, a unit vector."""
    J = kinematics.jacobian(arm, q)
    if kinematics.singularity(arm, q) < MIN_SINGULARITY:
        return linear_systems.damped_solve(J, way, 1e-3), None
    across = [0.0] * len(q)
    for row, towards in zip(J, way):
        across = [a + b * towards for a, b in zip(across, row)]
    return linear_systems.solve(J, way), across
