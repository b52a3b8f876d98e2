"""Knots along a piece: the joint angles and slopes by which the tip draws it straight.  Pure.

`q` joint angles rad, `p` a tip position cm, `s` the path length cm, `t` the unit tangent dp/ds.
Where the tip goes straight the joints swing, at rates that the Jacobian gives:

    J(q) dq/ds = t,  so  dq/ds = J^-1 t

Integrating this (resolved motion rate, Whitney, 1969) drifts off the path.  So the angles of every
knot come from inverse kinematics, and J^-1 t only the slopes there.  Between two knots lies the
cubic of Hermite of angles and slopes.  Its error is at most h^4 max |q''''| / 384 for a spacing h
(Stoer and Bulirsch, section 2.1.5): with h at 0.15 of the length over which q bends it stays small.
Near a singular pose J^-1 grows beyond bounds: the slope is damped there, and the knots are closer.

An error dq of the joints lies J dq off at the tip, of which t^T J dq is along the path.  `across`
is J^T t, which gives that part by one inner product in a control tick.
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
    Knot = Tuple[float, FixedPose, List[float], Optional[List[float]]]  # s, q, dq/ds, J^T t

KNOT_SPACING, MIN_KNOT_SPACING = 0.5, 0.02
"""Maximum and minimum spacing of knots, cm."""

KNOT_SCALE_SHARE = 0.15
"""Maximum spacing of knots as a share of the length over which q bends (kinematics.scale)."""

MAX_KNOT_BEND = math.radians(20)
"""Maximum bend of a piece from knot to knot, rad."""

MIN_SINGULARITY = 0.1
"""Minimum kinematics.singularity at which errors along the path are separated, without unit."""

MAX_JOINT_JUMP = math.radians(45)
"""Maximum turn of a joint between two neighbouring points, rad."""


def next_pose(arm, p, q):
    # type: (Arm, Point, Pose) -> FixedPose
    """Return the pose at `p` (cm) nearest to `q` (rad); raise Unreachable if a joint jumps."""
    pose = kinematics.nearest(arm, p, q)
    jump = max([abs(a - b) for a, b in zip(pose, q)])
    if jump > MAX_JOINT_JUMP:
        raise kinematics.Unreachable(
            "at ({}) cm the arm would have to swing a joint by {:.0f} deg to stay within its "
            "limits; draw the line in two, or choose the other elbow".format(
                ", ".join("{:.2f}".format(value) for value in p), math.degrees(jump)
            )
        )
    return pose


def stations_of(piece):
    # type: (Piece) -> List[Station]
    """Select points of a piece, no farther apart than knots may be, with its tangents there.

    Returns:
        [(s, p, t)]: path length and position, cm, and unit tangent.
    """
    lengths = [kinematics.distance(a, b) for a, b in zip(piece, piece[1:])]
    chords = [
        [(v - u) / length for u, v in zip(a, b)] for a, b, length in zip(piece, piece[1:], lengths)
    ]
    if len(chords) == 1:
        return [(0.0, piece[0], chords[0]), (lengths[0], piece[1], chords[0])]
    # The tangent of the parabola through a point and its neighbours; at the ends, of the next one.
    tangents = [chords[0]]
    for a, b, x, y in zip(chords, chords[1:], lengths, lengths[1:]):
        tangents.append([(u * y + v * x) / (x + y) for u, v in zip(a, b)])
    tangents[0] = [2 * u - v for u, v in zip(chords[0], tangents[1])]
    tangents.append([2 * u - v for u, v in zip(chords[-1], tangents[-1])])
    out, s, turned = [], 0.0, 0.0  # type: List[Station], float, float
    for k, (p, tangent) in enumerate(zip(piece, tangents)):
        if (
            k in (0, len(chords))
            or s + lengths[k] - out[-1][0] > KNOT_SPACING
            or turned > MAX_KNOT_BEND / 2
        ):
            size = kinematics.distance(tangent, [0.0] * len(tangent))
            out.append((s, p, [u / size for u in tangent]))
            turned = 0.0
        if k < len(chords):
            s += lengths[k]
            turned += kinematics.distance(tangent, tangents[k + 1])
    return out


def knots_through(arm, stations, q):
    # type: (Arm, Sequence[Station], FixedPose) -> List[Knot]
    """Return the knots [(s, q, dq/ds, J^T t or None)] through `stations`, the first near `q`.

    A step that ends where q bends more is shortened and tried again.
    """
    knots = []  # type: List[Knot]
    for (s, p, t), (s_end, p_end, t_end) in zip(stations, stations[1:]):
        if not knots:
            q = next_pose(arm, p, q)
            knots.append((s, q) + _slopes(arm, q, t))
        length = s_end - s
        # The cubic of Hermite, by x from 0 to 1: p + x (a + x (b + x c)).
        a = [length * u for u in t]
        b = [3 * (v - u) - length * (2 * m + n) for u, v, m, n in zip(p, p_end, t, t_end)]
        c = [2 * (u - v) + length * (m + n) for u, v, m, n in zip(p, p_end, t, t_end)]
        done = 0.0
        span = min(KNOT_SPACING, KNOT_SCALE_SHARE * kinematics.scale(arm, q))
        if len(stations) == 2:
            span = min(span, length / 2)  # it must speed up and slow down
        while done < length:
            left = length - done
            pieces = math.ceil(left / max(span, min(MIN_KNOT_SPACING, length / 2)) - 1e-6)
            step = left / max(pieces, 1)
            x = (done + step) / length
            if pieces <= 1:
                p_knot, tangent = p_end, t_end  # type: Point, Vector
            else:
                p_knot = [u + x * (k + x * (m + x * n)) for u, k, m, n in zip(p, a, b, c)]
                tangent = [(k + x * (2 * m + 3 * x * n)) / length for k, m, n in zip(a, b, c)]
            q_knot = next_pose(arm, p_knot, q)
            span = min(KNOT_SPACING, KNOT_SCALE_SHARE * kinematics.scale(arm, q_knot))
            if step > 2 * span and step > MIN_KNOT_SPACING:
                continue  # q bends more there than here
            q, done = q_knot, s_end - s if pieces <= 1 else done + step
            knots.append((s + done, q) + _slopes(arm, q, tangent))
    return knots


def _slopes(arm, q, tangent):
    # type: (Arm, Pose, Vector) -> Tuple[List[float], Optional[List[float]]]
    """Return (dq/ds, J^T t or None) at `q` for a tip that moves along the unit tangent t."""
    J = kinematics.jacobian(arm, q)
    if kinematics.singularity(arm, q) < MIN_SINGULARITY:
        return linear_systems.damped_solve(J, tangent, 1e-3), None
    across = [0.0] * len(q)
    for row, towards in zip(J, tangent):
        across = [a + b * towards for a, b in zip(across, row)]
    return linear_systems.solve(J, tangent), across
