"""Offsets that a camera has taught of a stroke, merged into its plan while the pen is up.  Pure.

Of each piece a few offsets of the joints along its path are known, see shared.job.Stroke: d_i at
the knots s_i, cm.  Between them they are piecewise cubic Bessel interpolation (C. de Boor, A
Practical Guide to Splines, 1978, ch. IV).  The slope at a knot is that of the parabola through it
and its two neighbours, with u, v the lengths before and after it, and m, n the mean slopes there:

    d'_i = (m v + n u) / (u + v)

A cubic spline would be smoother, but takes a linear system, and one wrong offset rings along all of
it; straight lines would make a joint's speed jump at each knot.

The plan's segments have knots of their own.  On each the merged offset is the cubic with the value
and slope of the interpolation at both its ends (Hermite); its coefficients are added to the plan's.
So a control tick does not know of offsets.
"""

import math

from shared.job import JOIN_TOLERANCE
from shared.job_pieces import MAX_JUMP, MAX_NUMBER, MIN_LENGTH, BadJob, check_joints, go_on

MYPY = False
if MYPY:
    from typing import List, Sequence, Tuple  # noqa: F401

    from shared.arm_description import Joint  # noqa: F401
    from shared.job import Stroke  # noqa: F401
    from shared.job_pieces import Between, Piece, Segment  # noqa: F401

MAX_OFFSET = math.radians(20)
"""Greatest offset of a joint, rad: a link that is 5 % too long makes 3 degrees of it, and near the
arm's full reach five times as much."""

MAX_KNOTS = 200
"""Greatest number of offsets of a piece and joint."""

MAX_ACCELERATION = math.radians(1000)
"""Greatest acceleration that offsets may add to a joint's, rad/s^2: as much as a backlash of 3
degrees takes to be crossed, for where it is described wrongly they do that."""

LENGTH_TOLERANCE = 0.05
"""Tolerance of the length that offsets are for against the length of their piece, cm."""


def merged(job, k, stroke, joints, between=go_on):
    # type: (str, int, Stroke, Sequence[Joint], Between) -> Sequence[Piece]
    """Return the pieces of a stroke with its offsets merged into them.

    Args:
        job: name of its file, for people.
        k: number of the stroke, for people.
        stroke: shared.job.Stroke.
        joints: the arm's shared.arm_description.Joints.
        between: called now and then: 10 cm take the brick some 0.15 s.

    Raises:
        BadJob: the offsets do not belong to this stroke, are too large or too rough, or ask of a
            joint what it may not do.
    """
    if not stroke.offsets:
        return stroke.pieces
    if len(stroke.offsets) != len(stroke.pieces):
        raise _bad(job, k, "it has {} for {} pieces".format(
            len(stroke.offsets), len(stroke.pieces)
        ))  # fmt: skip
    out = []  # type: List[Piece]
    for piece, (knots, offsets) in zip(stroke.pieces, stroke.offsets):
        between()
        _check(job, k, piece, knots, offsets)
        piece = _with(job, k, piece, knots, offsets)
        check_continuity(job, k, out, [piece], MAX_JUMP)
        out.append(piece)
    check_joints(job, k, out, joints, between, MAX_ACCELERATION)
    return out


def check_continuity(job, k, pieces, after, jump=JOIN_TOLERANCE + MAX_JUMP):
    # type: (str, int, Sequence[Piece], Sequence[Piece], float) -> None
    """Refuse, by BadJob, pieces that do not begin where those before end.

    Args:
        job: name of its file, for people.
        k: number of the stroke, for people.
        pieces: those of the path so far; may be none.
        after: those of the stroke.
        jump: greatest difference of a joint, rad.
    """
    if pieces:
        start = [cubic[0] for cubic in after[0][1][0][2]]
        if max([abs(a - b) for a, b in zip(pieces[-1][2], start)]) > jump:
            raise _bad(job, k, "a joint would jump where it begins")


def _bad(job, k, what):
    # type: (str, int, str) -> BadJob
    return BadJob(
        "{}: what was learned of stroke {} does not fit: {}; draw it without, or learn it "
        "anew".format(job, k, what)
    )


def _check(job, k, piece, knots, offsets):
    # type: (str, int, Piece, Sequence[float], Sequence[Sequence[float]]) -> None
    """Refuse, by BadJob, offsets (rad, per joint) at knots (cm) that do not fit a piece."""
    if not 2 <= len(knots) <= MAX_KNOTS:
        raise _bad(job, k, "{} offsets of a piece, and it takes 2 to {}".format(
            len(knots), MAX_KNOTS
        ))  # fmt: skip
    if knots[0] != 0 or any(b - a < MIN_LENGTH for a, b in zip(knots, knots[1:])):
        raise _bad(job, k, "their places do not go on")
    length = sum(_lengths(piece))
    if not abs(knots[-1] - length) <= LENGTH_TOLERANCE:
        raise _bad(job, k, "they are of {:.2f} cm, and a piece has {:.2f}".format(
            knots[-1], length
        ))  # fmt: skip
    greatest = max([max(map(abs, own)) for own in offsets])
    if greatest > MAX_OFFSET:
        raise _bad(job, k, "a joint is moved by {:.1f} deg, and {:g} are the most".format(
            math.degrees(greatest), math.degrees(MAX_OFFSET)
        ))  # fmt: skip


def _lengths(piece):
    # type: (Piece) -> List[float]
    """Return the length of each segment, cm."""
    times, segments, _ = piece
    return [
        (t_end - t) * (v + 0.5 * a * (t_end - t))
        for t, t_end, (v, a, _, _) in zip(times, times[1:], segments)
    ]


def _with(job, k, piece, knots, offsets):
    # type: (str, int, Piece, Sequence[float], Sequence[Sequence[float]]) -> Piece
    """Return a piece with offsets (rad, per joint) at knots (cm) added."""
    times, segments, end = piece
    slopes = [_slopes(knots, own) for own in offsets]
    places = [0.0]
    for length in _lengths(piece):
        places.append(places[-1] + length)
    at = [_values(knots, own, slope, places) for own, slope in zip(offsets, slopes)]
    out = []  # type: List[Segment]
    for n, (v, a, cubics, across) in enumerate(segments):
        length, moved = places[n + 1] - places[n], []
        v_end = v + a * (times[n + 1] - times[n])
        for (c0, c1, c2, c3), own in zip(cubics, at):
            (d0, m0), (d1, m1) = own[n], own[n + 1]
            mean = (d1 - d0) / length
            e2 = (3.0 * mean - m0 - m0 - m1) / length
            e3 = (m0 + m1 - mean - mean) / (length * length)
            bend = max(
                abs(e2 + e2) * v * v + abs(m0 * a),
                abs(e2 + e2 + 6.0 * e3 * length) * v_end * v_end + abs(m1 * a),
            )
            if not bend <= MAX_ACCELERATION:  # nor what is no number
                raise _bad(job, k, "{:.0f} deg/s^2 of a joint, and {:.0f} are the most".format(
                    math.degrees(min(bend, MAX_NUMBER)), math.degrees(MAX_ACCELERATION)
                ))  # fmt: skip
            moved.append((c0 + d0, c1 + m0, c2 + e2, c3 + e3))
        out.append((v, a, moved, across))
    return times, out, tuple([q + own[-1][0] for q, own in zip(end, at)])


def _slopes(knots, values):
    # type: (Sequence[float], Sequence[float]) -> List[float]
    """Return the Bessel slope at each knot, rad/cm, of values (rad) there."""
    means = [(b - a) / (w - v) for a, b, v, w in zip(values, values[1:], knots, knots[1:])]
    out = [means[0]]
    for m, n, u, v, w in zip(means, means[1:], knots, knots[1:], knots[2:]):
        out.append((m * (w - v) + n * (v - u)) / (w - u))
    out.append(means[-1])
    return out


def _values(
    knots,  # type: Sequence[float]
    values,  # type: Sequence[float]
    slopes,  # type: Sequence[float]
    places,  # type: Sequence[float]
):
    # type: (...) -> List[Tuple[float, float]]
    """Return [(offset, its slope)], rad and rad/cm, at ascending places, cm."""
    out, k = [], 0
    for s in places:
        while k < len(knots) - 2 and s > knots[k + 1]:
            k += 1
        length = knots[k + 1] - knots[k]
        x = min(max(0.0, (s - knots[k]) / length), 1.0)
        step, m, n = values[k + 1] - values[k], slopes[k] * length, slopes[k + 1] * length
        b, c = 3.0 * step - m - m - n, m + n - step - step
        out.append((values[k] + x * (m + x * (b + x * c)), (m + x * (b + b + 3 * c * x)) / length))
    return out
