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
"""The turn a point that curves are divided by, rad: neighbours are not quite alike."""

SAMPLES = 96
"""At so many places the bend of a curve is looked at first."""

SHORTEST = 0.25
"""A chord this short, in tolerances, is not halved any more: a bend so tight is a corner."""

MAX_CURVE_POINTS = 720
"""Most points of one curve; an ellipse has some 70."""


@dataclass(frozen=True)
class Straight:
    """A line of straight pieces through points (n, 2)."""

    points: np.ndarray

    def mapped(self, affine: np.ndarray) -> Straight:
        """What an affine map (2, 3) makes of it."""
        return Straight(_apply(affine, self.points))

    def hull(self) -> np.ndarray:
        """Points (n, 2) around all of it."""
        return self.points


@dataclass(frozen=True)
class Bezier:
    """A quadratic or cubic Bezier curve with control points (3, 2) or (4, 2)."""

    control: np.ndarray

    def mapped(self, affine: np.ndarray) -> Bezier:
        """What an affine map (2, 3) makes of it."""
        return Bezier(_apply(affine, self.control))

    def hull(self) -> np.ndarray:
        """Points (n, 2) around all of it."""
        return self.control

    def at(self, t: np.ndarray) -> np.ndarray:
        """Points (n, 2) at parameters t (n,) from 0 to 1, by de Casteljau."""
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
        """What an affine map (2, 3) makes of it."""
        turned = affine[:, :2]
        return Elliptic(
            *(_apply(affine, self.centre), turned @ self.u, turned @ self.v),
            *(self.begin, self.sweep),
        )

    def hull(self) -> np.ndarray:
        """Points (n, 2) around all of it."""
        corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        return self.centre + corners @ np.array([self.u, self.v])

    def at(self, t: np.ndarray) -> np.ndarray:
        """Points (n, 2) at parameters t (n,) from 0 to 1."""
        angle = self.begin + self.sweep * t
        return self.centre + np.outer(np.cos(angle), self.u) + np.outer(np.sin(angle), self.v)


Piece = Straight | Bezier | Elliptic


def _apply(affine: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ affine[:, :2].T + affine[:, 2]


def flatten(pieces: Sequence[Piece], tolerance: float) -> np.ndarray:
    """One stroke, points (n, 2), of pieces that follow each other.

    Args:
        tolerance: how far a curve may be from its chords, in the unit of the pieces.

    Returns:
        Points no two of which in a row are the same; a single one where nothing has a length.
    """
    parts = [
        piece.points if isinstance(piece, Straight) else curve_points(piece, tolerance)
        for piece in pieces
    ]
    return without_repeats(np.concatenate(parts))


def without_repeats(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) without those that are where the one before is."""
    moved = np.any(points[1:] != points[:-1], axis=1)
    return points[np.concatenate([[True], moved])]


def curve_points(curve: Bezier | Elliptic, tolerance: float) -> np.ndarray:
    """Points (n, 2) along a curve, ends included: each turns by at most SMOOTH_TURN degrees.

    A cusp stays a corner, and so does a bend too tight for the tolerance. Where a curve bends
    slowly, what counts is that a chord of length c over a turn of a is off it by c a / 8.
    """
    t = np.linspace(0.0, 1.0, SAMPLES + 1)
    chord, turn = _shape(curve.at(t))
    # Each sample's turn and way, half of it to either side
    turned = np.concatenate([[turn[0]], turn[:-1] + turn[1:], [turn[-1]]]) / 2
    density = np.maximum(turned / AIMED_TURN, np.sqrt(chord * turned / (8 * tolerance)))
    passed = np.concatenate([[0.0], np.cumsum(density)])
    count = min(max(1, math.ceil(passed[-1])), MAX_CURVE_POINTS)
    if passed[-1] > 0:
        # A little of the parameter, so that it rises where nothing bends
        passed += 1e-9 * passed[-1] * t
        t = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, t)
    else:
        t = t[[0, -1]]
    return curve.at(_refined(curve, t, tolerance))


def _shape(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Chords' lengths (n - 1,) and the unsigned turns between them (n - 2,), rad."""
    steps = np.diff(points, axis=0)
    cross = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    dot = (steps[:-1] * steps[1:]).sum(axis=1)
    return np.hypot(*steps.T), np.abs(np.arctan2(cross, dot))


def _refined(curve: Bezier | Elliptic, t: np.ndarray, tolerance: float) -> np.ndarray:
    """Halve what still turns too much, as near a cusp, unless it is too short to be seen."""
    while 3 <= len(t) <= MAX_CURVE_POINTS:
        chord, turn = _shape(curve.at(t))
        sharp = turn > math.radians(SMOOTH_TURN)
        halved = np.zeros(len(chord), bool)
        halved[:-1] |= sharp
        halved[1:] |= sharp
        halved &= chord > SHORTEST * tolerance
        if not halved.any():
            break
        t = np.sort(np.concatenate([t, (t[:-1][halved] + t[1:][halved]) / 2]))
    return t


LONG_SIDE = 2.2
"""Where a line meets one so many times as long, that one is straight: the curve begins there."""


def rounded(points: np.ndarray, corner: float, tolerance: float) -> np.ndarray:
    """A smooth curve through points (n, 2) that were set sparsely; corners stay.

    Cubic pieces meet with one direction at each point: across from neighbour to neighbour, as a
    circle through the three has it.

    Args:
        corner: what turns by more, rad, is a corner.
        tolerance: of the points that are returned, see `curve_points`.
    """
    points = without_repeats(points)
    if len(points) < 3:
        return points
    is_closed = bool(np.array_equal(points[0], points[-1]))
    steps = np.diff(points, axis=0)
    far = np.hypot(*steps.T)
    unit = steps / far[:, None]
    arriving, leaving = unit.copy(), unit.copy()  # directions at each step's end and begin
    inner = list(zip(range(len(unit) - 1), range(1, len(unit)), strict=True))
    for before, after in [*inner, *([(len(unit) - 1, 0)] if is_closed else [])]:
        if unit[before] @ unit[after] < math.cos(corner):
            continue
        if far[before] > LONG_SIDE * far[after]:
            shared = unit[before]
        elif far[after] > LONG_SIDE * far[before]:
            shared = unit[after]
        else:  # the tangent of the circle: each weighed by the other's length
            shared = unit[before] * far[after] + unit[after] * far[before]
            shared = shared / math.hypot(*shared)
        arriving[before] = leaving[after] = shared
    pieces: list[Piece] = []
    for k, (begin, end) in enumerate(zip(points[:-1], points[1:], strict=True)):
        turned = float(np.clip(leaving[k] @ arriving[k], -1.0, 1.0))
        # The handle of an arc of that angle: 4/3 tan(a/4) radii, its chord being 2 sin(a/2)
        quarter = math.acos(turned) / 4
        handle = far[k] / 3 * (1 + math.tan(quarter) ** 2) ** 2 / (1 - math.tan(quarter) ** 2)
        handle = handle if quarter < math.pi / 8 else far[k] / 3
        control = [begin, begin + handle * leaving[k], end - handle * arriving[k], end]
        pieces.append(Bezier(np.array(control)))
    return flatten(pieces, tolerance)
