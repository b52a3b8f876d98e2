"""Strokes as pieces to follow: corners kept, no more points than the arm can show.  Pure.

A piece is passed as a smooth curve through its points, see robot.motion.paths, and ends at a
corner.  Corners are found before anything is left out, since a curve with few points has corners
everywhere.  A corner is only one if leaving it out would show: what jitters by less than the
tolerance has none.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from laptop.drawing.artwork import turns
from robot.motion.paths import MIN_CORNER_ANGLE

PEN_WIDTH = 0.03
"""Length below which a stroke is a dot, and to which that is drawn, cm."""

SAME_POINT = 0.002
"""Distance below which two points are one, cm."""

CURVE_TURN, CURVE_STEP = math.radians(6), 0.25
"""Greatest turn, rad, and greatest step, cm, of a curve from point to point, so that the tangents
computed from its points are its own."""

MAX_CURVE_TURN = math.radians(60)
"""Greatest turn of a curve from point to point, rad, before it is cut there."""

STRAIGHT_SHARE = 0.3
"""Share of the tolerance up to which a bent piece counts as straight."""

NOISE_SHARE = 0.2
"""Share of the tolerance up to which a deviation is noise."""

MAX_SMOOTHING_PASSES = 20
"""Greatest number of passes that remove corners that do not show, which may expose others."""


def pieces(points: np.ndarray, tolerance: float) -> list[np.ndarray]:
    """Return a stroke (n, 2), cm, as consecutive smooth pieces (m, 2), m >= 2.

    Args:
        points: from pen down to pen up.
        tolerance: greatest distance of what is left out from what is kept, cm.
    """
    points = _distinct(points)
    if len(points) < 2 or np.hypot(*np.diff(points, axis=0).T).sum() < PEN_WIDTH:
        return [_dot(points)]
    points = _without_jitter(points, tolerance)
    corners = np.flatnonzero(_sharp(points, tolerance))
    cuts = [0, *corners.tolist(), len(points) - 1]
    out = []
    for a, b in zip(cuts, cuts[1:], strict=False):
        thin = _thinned(points[a : b + 1], tolerance)
        # What goes back on itself is no curve, however small.
        again = [0, *(np.flatnonzero(turns(thin) > MAX_CURVE_TURN) + 1).tolist(), len(thin) - 1]
        out += [thin[i : j + 1] for i, j in zip(again, again[1:], strict=False)]
    # What is smaller than the tolerance may have come back to where it began.
    out = [piece[np.append(True, np.diff(piece, axis=0).any(axis=1))] for piece in out]
    return [piece for piece in out if len(piece) > 1] or [_dot(points)]


def _dot(points: np.ndarray) -> np.ndarray:
    middle, chord = (points[0] + points[-1]) / 2, points[-1] - points[0]
    length = math.hypot(*chord)
    half = chord / length if length > SAME_POINT else np.array([1.0, 0.0])
    half = half * PEN_WIDTH / 2
    return np.vstack([middle - half, middle + half])


def _distinct(points: np.ndarray) -> np.ndarray:
    """Return the points without those too near to the one before; first and last stay."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    if len(steps) and steps.min() >= SAME_POINT:
        return points
    indices = [0]
    last = points[0]
    for k in range(1, len(points)):
        if math.hypot(points[k, 0] - last[0], points[k, 1] - last[1]) >= SAME_POINT:
            indices.append(k)
            last = points[k]
    if indices[-1] != len(points) - 1:
        if len(indices) > 1:
            indices[-1] = len(points) - 1
        elif steps.sum() >= PEN_WIDTH:  # there and back
            indices.append(int(np.argmax(np.hypot(*(points - points[0]).T))))
    return points[indices]


def _without_jitter(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the points without corners whose absence does not show."""
    shown: np.ndarray | None = None
    for _ in range(MAX_SMOOTHING_PASSES):
        sharp = _sharp(points, tolerance)
        if not sharp.any():
            break
        if shown is None:
            shown = _needed(points, tolerance)
        gone = sharp & ~shown
        if not gone.any():
            break
        points, shown = points[~gone], shown[~gone]
        near = np.append(np.hypot(*np.diff(points, axis=0).T) < SAME_POINT, False)
        near[0] = False
        points, shown = points[~near], shown[~near]  # there and back
    return points


def _sharp(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the corners, (n,) bool: of the line, and also of the line without its noise.

    Without the noise's points a narrow bend would have corners; with them any line.
    """
    sharp = np.zeros(len(points), bool)
    sharp[1:-1] = turns(points) > MIN_CORNER_ANGLE
    if sharp.any():
        indices = np.flatnonzero(_needed(points, NOISE_SHARE * tolerance))
        clean = np.zeros(len(points), bool)
        clean[indices[1:-1]] = turns(points[indices]) > MIN_CORNER_ANGLE
        sharp &= clean
    return sharp


# The algorithm of U. Ramer (1972), and D. H. Douglas and T. K. Peucker (1973): of a line's points
# the one farthest from the chord between its ends is kept if it is farther off than the tolerance,
# and both parts are treated alike; what is left out is within the tolerance of what is kept.
# Here it tells what is noise and where corners are, but it does not choose the points of a curve:
# its chords are near the line, whereas the brick goes through the points smoothly, with tangents by
# their neighbours, and from a polygon's few points these are not the curve's.  Points of curves
# are chosen by turn and length instead (`_thinned`).
def _needed(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the points that the Ramer-Douglas-Peucker algorithm keeps: (n,) bool."""
    low = points.min(axis=0)
    own = (points - low).astype(np.float32).reshape(-1, 1, 2)
    vertices = cv2.approxPolyDP(own, tolerance, False)[:, 0]
    # They come in order: each is found behind the one before.
    needed = np.zeros(len(points), bool)
    flat, k = own[:, 0], 0
    for p in vertices:
        while k < len(flat) and not (flat[k, 0] == p[0] and flat[k, 1] == p[1]):
            k += 1
        if k < len(flat):
            needed[k] = True
            k += 1
    needed[[0, -1]] = True
    return needed


def _thinned(piece: np.ndarray, tolerance: float) -> np.ndarray:
    """Return a smooth piece with as many points as its bends need; two if it is straight."""
    chord = piece[-1] - piece[0]
    length = math.hypot(*chord)
    if length > 0:
        offsets = piece - piece[0]
        aside = np.abs(offsets[:, 0] * chord[1] - offsets[:, 1] * chord[0]) / length
        along = offsets @ chord / length
        if aside.max() <= STRAIGHT_SHARE * tolerance and np.diff(along).min() > -tolerance:
            return piece[[0, -1]]
    # By how much it has turned, and how far it has gone, to each point: one in each step is kept.
    # (What noise turns there and back is no turning.)
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(piece, axis=0).T)))
    clean = np.flatnonzero(_needed(piece, NOISE_SHARE * tolerance))
    turned = np.append(0.0, np.cumsum(np.append(turns(piece[clean]), 0.0)))
    turned = np.interp(arc, arc[clean], turned)
    gone = np.floor(turned / CURVE_TURN + arc / CURVE_STEP + 1e-9)
    is_vertex = np.append(True, np.diff(gone) > 0)
    is_vertex[-1] = True
    thin = piece[is_vertex]
    # A straight part of it has points, too: far ones would bend it by their neighbours' tangents.
    steps = np.hypot(*np.diff(thin, axis=0).T)
    if steps.max() > 1.5 * CURVE_STEP:
        thin = _filled(thin, steps)
    return thin


def _filled(points: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the points with more between, so that no step is longer than 1.5 CURVE_STEP."""
    counts = np.maximum(1, np.ceil(steps / (1.5 * CURVE_STEP))).astype(int)
    first = np.cumsum(counts) - counts
    share = (np.arange(counts.sum()) - np.repeat(first, counts)) / np.repeat(counts, counts)
    k = np.repeat(np.arange(len(counts)), counts)
    return np.vstack([points[k] + share[:, None] * (points[k + 1] - points[k]), points[-1:]])
