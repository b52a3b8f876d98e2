"""Curves become points: dense where they bend, and never more of them than they need.  Pure.

A piece of a stroke is one of
    Straight   points (n, 2), joined by straight lines
    Bezier     control points (3, 2) or (4, 2): quadratic or cubic
    Elliptic   centre, two conjugate half axes and a range of the parameter: what an arc of an
               ellipse becomes under any affine map
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laptop.drawing.artwork import SMOOTH_TURN

AIMED_TURN = math.radians(0.85 * SMOOTH_TURN)
"""Turn per point at which curves are divided, rad: below SMOOTH_TURN, for neighbours differ."""

BEND_SAMPLES = 96
"""Number of places at which the bend of a curve is sampled first."""

SHORTEST_CHORD = 0.25
"""Chord length below which none is halved, in tolerances: a bend so tight is a corner."""

SAME_POINT = 1e-6
"""Distance, in tolerances, below which two points are one, but for rounding."""

MAX_CURVE_POINTS = 720
"""Most points of one curve; an ellipse has some 70."""


@dataclass(frozen=True)
class Straight:
    """A line of straight pieces through points (n, 2)."""

    points: np.ndarray

    def mapped(self, affine: np.ndarray) -> Straight:
        """Return the piece under an affine map (2, 3)."""
        return Straight(_apply(affine, self.points))

    def hull(self) -> np.ndarray:
        """Return points (n, 2) whose convex hull holds the piece."""
        return self.points


@dataclass(frozen=True)
class Bezier:
    """A quadratic or cubic Bezier curve with control points (3, 2) or (4, 2)."""

    control: np.ndarray

    def mapped(self, affine: np.ndarray) -> Bezier:
        """Return the curve under an affine map (2, 3)."""
        return Bezier(_apply(affine, self.control))

    def hull(self) -> np.ndarray:
        """Return points (n, 2) whose convex hull holds the curve."""
        return self.control

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return points (n, 2) at parameters t (n,) from 0 to 1, by de Casteljau's algorithm."""
        points = np.repeat(self.control[:, None, :], len(t), axis=1)
        while len(points) > 1:
            points = points[:-1] + (points[1:] - points[:-1]) * t[None, :, None]
        return points[0]


@dataclass(frozen=True)
class Elliptic:
    """centre + u cos(a) + v sin(a), for a from `begin` on by `sweep`, rad; vectors (2,)."""

    centre: np.ndarray
    u: np.ndarray
    v: np.ndarray
    begin: float
    sweep: float

    def mapped(self, affine: np.ndarray) -> Elliptic:
        """Return the arc under an affine map (2, 3)."""
        turned = affine[:, :2]
        return Elliptic(
            *(_apply(affine, self.centre), turned @ self.u, turned @ self.v),
            *(self.begin, self.sweep),
        )

    def hull(self) -> np.ndarray:
        """Return points (n, 2) whose convex hull holds the arc."""
        corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        return self.centre + corners @ np.array([self.u, self.v])

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return points (n, 2) at parameters t (n,) from 0 to 1."""
        angle = self.begin + self.sweep * t
        return self.centre + np.outer(np.cos(angle), self.u) + np.outer(np.sin(angle), self.v)


Piece = Straight | Bezier | Elliptic


def _apply(affine: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ affine[:, :2].T + affine[:, 2]


def flatten(pieces: Sequence[Piece], tolerance: float) -> np.ndarray:
    """Return one stroke, points (n, 2), of consecutive pieces.

    Args:
        pieces: consecutive pieces, each from where the last one ends.
        tolerance: greatest distance of a curve from its chords, in the unit of the pieces.

    Returns:
        Points no two of which in a row are the same; a single one where nothing has a length.
    """
    parts = [
        piece.points if isinstance(piece, Straight) else curve_points(piece, tolerance)
        for piece in pieces
    ]
    return without_repeats(np.concatenate(parts), SAME_POINT * tolerance)


def without_repeats(points: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Return points (n, 2) without those within `least` of the one before.

    The first and the last stay as they are, so that a ring stays closed.
    """
    moved = np.hypot(*np.diff(points, axis=0).T) > least
    distinct = points[np.concatenate([[True], moved])]
    if len(distinct) > 1:
        distinct[-1] = points[-1]
    return distinct


def curve_points(curve: Bezier | Elliptic, tolerance: float) -> np.ndarray:
    """Return points (n, 2) along a curve, ends included; each turns by SMOOTH_TURN at most.

    A cusp stays a corner, and so does a bend too tight for the tolerance. Where a curve bends
    slowly, what counts is that a chord of length c over a turn of a is off it by c a / 8.
    """
    t = np.linspace(0.0, 1.0, BEND_SAMPLES + 1)
    chord, turn = _shape(curve.at(t))
    # A chord turns by the mean of what its ends do
    turned = np.concatenate([turn[:1], (turn[:-1] + turn[1:]) / 2, turn[-1:]])
    density = np.maximum(turned / AIMED_TURN, np.sqrt(chord * turned / (8 * tolerance)))
    passed = np.concatenate([[0.0], np.cumsum(density)])
    count = min(max(1, math.ceil(passed[-1])), MAX_CURVE_POINTS)
    if passed[-1] > 0:
        # A little of the parameter, so that it rises where nothing bends
        passed += 1e-9 * passed[-1] * t
        t = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, t)
    else:
        t = t[[0, -1]]
    points = curve.at(_refined(curve, t, tolerance))
    if isinstance(curve, Bezier):  # to the last digit, so that what follows begins there
        points[0], points[-1] = curve.control[0], curve.control[-1]
    elif math.isclose(abs(curve.sweep), 2 * math.pi):
        points[-1] = points[0]
    return points


def _shape(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the chords' lengths (n - 1,) and the unsigned turns between them (n - 2,), rad."""
    steps = np.diff(points, axis=0)
    return np.hypot(*steps.T), np.abs(_angle(steps[:-1], steps[1:]))


def _refined(curve: Bezier | Elliptic, t: np.ndarray, tolerance: float) -> np.ndarray:
    """Halve what still turns too much, as near a cusp, unless it is too short to be seen."""
    while 3 <= len(t) <= MAX_CURVE_POINTS:
        chord, turn = _shape(curve.at(t))
        sharp = turn > math.radians(SMOOTH_TURN)
        halved = np.zeros(len(chord), bool)
        halved[:-1] |= sharp
        halved[1:] |= sharp
        halved &= chord > SHORTEST_CHORD * tolerance
        if not halved.any():
            break
        t = np.sort(np.concatenate([t, (t[:-1][halved] + t[1:][halved]) / 2]))
    return t


LONG_SIDE = 2.2
"""Ratio of two neighbouring chords above which the longer one is straight: the curve begins there.
"""


def rounded(points: np.ndarray, corner: float, tolerance: float) -> np.ndarray:
    """Return a smooth curve through sparse points (n, 2); corners stay.

    Cubic pieces meet with one direction at each point: across from neighbour to neighbour, as a
    circle through the three has it.

    Args:
        points: (n, 2).
        corner: turning angle above which a point is a corner, rad.
        tolerance: of the points that are returned, see `curve_points`.
    """
    points = without_repeats(points)
    if len(points) < 3:
        return points
    far = np.hypot(*np.diff(points, axis=0).T)
    chord = np.diff(points, axis=0) / far[:, None]
    leaving, arriving = _directions(chord, far, corner, np.array_equal(points[0], points[-1]))
    # The handle of an arc that turns so: 4/3 tan(a/4) radii, its chord being 2 sin(a/2) of them
    tangent = np.tan(np.minimum(np.abs(_angle(leaving, arriving)), math.pi / 2) / 4) ** 2
    handle = (far / 3 * (1 + tangent) ** 2 / (1 - tangent))[:, None]
    begin, end = points[:-1], points[1:]
    control = np.stack([begin, begin + handle * leaving, end - handle * arriving, end], axis=1)
    counts = _counts(control, far, tolerance)
    places = np.concatenate([[0], np.cumsum(counts)])
    smooth = np.empty((places[-1] + 1, 2))
    smooth[-1] = points[-1]
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        curve = _cubics(control[chosen], np.arange(count) / count)
        smooth[places[chosen][:, None] + np.arange(count)] = curve
    return without_repeats(smooth, SAME_POINT * tolerance)


def _cubics(control: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Return points (m, n, 2) of cubic curves (m, 4, 2) at parameters t (n,)."""
    weights = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
    return np.einsum("kn,mkc->mnc", weights, control)


def _counts(control: np.ndarray, far: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the number of equal parameter steps that each short cubic (m, 4, 2) needs: (m,).

    As many as where it bends most: looked at in eight steps.
    """
    steps = np.diff(_cubics(control, np.linspace(0.0, 1.0, 9)), axis=1)
    turned = np.abs(_angle(steps[:, :-1], steps[:, 1:]))
    wanted = np.maximum(
        8 * turned.max(axis=1) / AIMED_TURN, np.sqrt(far * turned.sum(axis=1) / (8 * tolerance))
    )
    return np.clip(np.ceil(wanted), 1, MAX_CURVE_POINTS).astype(int)


def _directions(
    chord: np.ndarray, far: np.ndarray, corner: float, is_closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the curve's directions (n, 2) at both ends of each chord, given its length (n,)."""
    leaving, arriving = chord.copy(), chord.copy()
    before = np.arange(len(chord) - (not is_closed))
    after = (before + 1) % len(chord)
    smooth = np.abs(_angle(chord[before], chord[after])) <= corner
    before, after = before[smooth], after[smooth]
    # The tangent of the circle through three points: each chord weighed by the other's length
    weigh_before, weigh_after = far[after].copy(), far[before].copy()
    weigh_after[far[before] > LONG_SIDE * far[after]] = 0.0
    weigh_before[far[after] > LONG_SIDE * far[before]] = 0.0
    shared = chord[before] * weigh_before[:, None] + chord[after] * weigh_after[:, None]
    shared /= np.hypot(*shared.T)[:, None]
    arriving[before] = leaving[after] = shared
    return leaving, arriving


def _angle(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return signed angles (...) from directions (..., 2) to others, rad."""
    cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return np.arctan2(cross, (first * second).sum(axis=-1))
