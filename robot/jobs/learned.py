"""What a camera has taught of a stroke, merged into its plan while the pen is up.  Pure.

Of each piece a few offsets of the joints along its way are known, see shared.job.Stroke.  Between
them they go as cubics do whose slope is that of the parabola through three neighbours.  Here they
become part of the cubics that the plan is made of: a control tick does not know of them.
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
"""Offsets of a piece and joint, at the most."""

MAX_ACCELERATION = math.radians(1000)
"""Greatest acceleration that offsets may add to a joint's, rad/s^2: as much as a backlash of 3
degrees takes to be crossed, for where it is described wrongly they do that."""

SAME_WAY = 0.05
"""Offsets are of a piece if the lengths of both ways differ by no more, cm."""


def merged(job, k, stroke, joints, between=go_on):
    # type: (str, int, Stroke, Sequence[Joint], Between) -> Sequence[Piece]
    """The pieces of a stroke with its offsets merged into them.

    Args:
        job: name of its file, for people.
        k: number of the stroke, for people.
        stroke: shared.job.Stroke.
        joints: the arm's.
        between: called now and then: 10 cm take the brick some 0.15 s.

    Raises:
        BadJob: the offsets are none of this stroke, too large or too rough, or ask of a joint what
            it may not do.
    """
    if not stroke.offsets:
        return stroke.pieces
    if len(stroke.offsets) != len(stroke.pieces):
        raise _bad(job, k, "it has {} for {} pieces".format(
            len(stroke.offsets), len(stroke.pieces)
        ))  # fmt: skip
    out = []  # type: List[Piece]
    for piece, (ways, offsets) in zip(stroke.pieces, stroke.offsets):
        between()
        _check(job, k, piece, ways, offsets)
        piece = _with(job, k, piece, ways, offsets)
        check_way(job, k, out, [piece], MAX_JUMP)
        out.append(piece)
    check_joints(job, k, out, joints, between, MAX_ACCELERATION)
    return out


def check_way(job, k, pieces, after, jump=JOIN_TOLERANCE + MAX_JUMP):
    # type: (str, int, Sequence[Piece], Sequence[Piece], float) -> None
    """Refuse, by BadJob, pieces that do not begin where those before end.

    Args:
        job, k: as for `merged`.
        pieces: of the way so far.
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


def _check(job, k, piece, ways, offsets):
    # type: (str, int, Piece, Sequence[float], Sequence[Sequence[float]]) -> None
    if not 2 <= len(ways) <= MAX_KNOTS:
        raise _bad(job, k, "{} offsets of a piece, and it takes 2 to {}".format(
            len(ways), MAX_KNOTS
        ))  # fmt: skip
    if ways[0] != 0 or any(b - a < MIN_LENGTH for a, b in zip(ways, ways[1:])):
        raise _bad(job, k, "their places do not go on")
    length = sum(_lengths(piece))
    if not abs(ways[-1] - length) <= SAME_WAY:
        raise _bad(job, k, "they are of {:.2f} cm, and a piece has {:.2f}".format(
            ways[-1], length
        ))  # fmt: skip
    greatest = max([max(map(abs, own)) for own in offsets])
    if greatest > MAX_OFFSET:
        raise _bad(job, k, "a joint is moved by {:.1f} deg, and {:g} are the most".format(
            math.degrees(greatest), math.degrees(MAX_OFFSET)
        ))  # fmt: skip


def _lengths(piece):
    # type: (Piece) -> List[float]
    """Of each segment's way, cm."""
    times, segments, _ = piece
    return [
        (t_end - t) * (v + 0.5 * a * (t_end - t))
        for t, t_end, (v, a, _, _) in zip(times, times[1:], segments)
    ]


def _with(job, k, piece, ways, offsets):
    # type: (str, int, Piece, Sequence[float], Sequence[Sequence[float]]) -> Piece
    """A piece with offsets."""
    times, segments, end = piece
    slopes = [_slopes(ways, own) for own in offsets]
    places = [0.0]
    for length in _lengths(piece):
        places.append(places[-1] + length)
    at = [_values(ways, own, slope, places) for own, slope in zip(offsets, slopes)]
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


def _slopes(ways, values):
    # type: (Sequence[float], Sequence[float]) -> List[float]
    """Of the offsets at their places, rad/cm."""
    means = [(b - a) / (w - v) for a, b, v, w in zip(values, values[1:], ways, ways[1:])]
    out = [means[0]]
    for m, n, u, v, w in zip(means, means[1:], ways, ways[1:], ways[2:]):
        out.append((m * (w - v) + n * (v - u)) / (w - u))
    out.append(means[-1])
    return out


def _values(
    ways,  # type: Sequence[float]
    values,  # type: Sequence[float]
    slopes,  # type: Sequence[float]
    places,  # type: Sequence[float]
):
    # type: (...) -> List[Tuple[float, float]]
    """[(offset, its slope)] at places, which go on, rad and rad/cm."""
    out, k = [], 0
    for s in places:
        while k < len(ways) - 2 and s > ways[k + 1]:
            k += 1
        length = ways[k + 1] - ways[k]
        x = min(max(0.0, (s - ways[k]) / length), 1.0)
        step, m, n = values[k + 1] - values[k], slopes[k] * length, slopes[k + 1] * length
        b, c = 3.0 * step - m - m - n, m + n - step - step
        out.append((values[k] + x * (m + x * (b + x * c)), (m + x * (b + b + 3 * c * x)) / length))
    return out
