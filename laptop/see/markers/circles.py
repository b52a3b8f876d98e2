"""Circles in masks, found although fingers, stripes or highlights hide half of the rim.  Pure."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np


class Circle(NamedTuple):
    """A circle and how well a mask supports it.

    u, v    centre, px
    radius  px
    arc     part of the rim, as far as it lies in the picture, on which the mask ends: 0 to 1
    fill    part of the area, as far as it lies in the picture, that the mask covers: 0 to 1
    stray   connected mask outside, as a part of the area
    visible part of the area that lies in the picture
    """

    u: float
    v: float
    radius: float
    arc: float
    fill: float
    stray: float
    visible: float


class Ellipse(NamedTuple):
    """An ellipse, as a disc looks in perspective.

    u, v        centre, px
    radius      half of its longer axis, px
    short       half of its shorter axis, px
    covariance  second moments: across, down, skew, px^2
    quality     how well an outline follows it: 1 for a disc, below 0.5 for a square
    """

    u: float
    v: float
    radius: float
    short: float
    covariance: tuple[float, float, float]
    quality: float


MIN_AXIS_RATIO = 0.2
"""Axis ratio below which an ellipse is a stick rather than a tilted disc."""
MIN_HALF_AXIS = 2.0
"""Shorter half axis below which an ellipse cannot be told from a stick, px."""


def ellipse_of(outline: np.ndarray, finer: int = 1) -> Ellipse | None:
    """Return the ellipse with the same second moments as a blob.

    Args:
        outline: of the blob, as OpenCV finds it, shape (n, 1, 2).
        finer: steps of the outline in a px.

    Returns:
        None for a blob of less than 10 px, and for one too slender or too thin.
    """
    step = 1 / finer
    outline = (outline.astype(np.float32) + 0.5) * step - 0.5
    m = cv2.moments(outline)
    area = m["m00"]
    if area < 10:
        return None
    u, v = m["m10"] / area, m["m01"] / area
    matrix = np.array([[m["mu20"], m["mu11"]], [m["mu11"], m["mu02"]]]) / area
    variances, axes = np.linalg.eigh(matrix)
    short, long = 2 * np.sqrt(np.maximum(variances, 1e-9))
    # An outline runs through pixel centres: half a step inside the rim.
    if short + step / 2 < max(MIN_HALF_AXIS, MIN_AXIS_RATIO * (long + step / 2)):
        return None
    # How far outside of the ellipse, px, to first order.
    parts = (outline[:, 0] - (u, v)) @ axes / (short, long)
    ratio = np.hypot(*parts.T)
    off = (ratio - 1) * ratio / np.maximum(np.hypot(*(parts / (short, long)).T), 1e-9)
    # Steps from pixel to pixel make an outline rough, by as much whatever its size; noise, too.  In
    # parts of the shorter axis, rendered discs, blurred by lens and motion, come out below 0.014,
    # bricks above 0.028.
    rough = float((off.std() - 0.18 * step - 0.07) / short)
    quality = min(1.0, max(0.0, (0.032 - rough) / 0.016))
    covariance = m["mu20"] / area, m["mu02"] / area, m["mu11"] / area
    return Ellipse(u, v, float(long), float(short), covariance, quality)


_POINTS = 48
# Triples of a contour's points through which circles are drawn: wide ones, and narrow ones for rims
# of which most is hidden.
_TRIPLES = np.array(
    [
        (i, (i + step) % _POINTS, (i + 2 * step) % _POINTS)
        for step, starts in ((16, 16), (11, _POINTS), (7, _POINTS))
        for i in range(starts)
    ]
).T
_REACH = 1.6
"""Greatest distance of a marker's parts from the middle of its largest part, in its radii."""
_MIN_PART = 0.04
"""Least area of a part that may belong to a marker, relative to the largest part."""
_SQUARE = np.ones((3, 3), np.uint8)
_RIM = np.array([(math.cos(k * math.pi / 18), math.sin(k * math.pi / 18)) for k in range(36)])
_COS_SUPPORT = math.cos(0.2)
"""Cosine of the greatest angle, seen from the centre, at which a contour's point supports a rim."""


def find_circle(
    mask: np.ndarray,
    picture: tuple[float, float, float, float],
    near: tuple[float, float] | None = None,
    expected: float | None = None,
) -> Circle | None:
    """Return the circle that most of the mask's contour supports.

    Args:
        mask: uint8, shape (h, w), changed by this.
        picture: left, top, right, bottom of the whole picture, px of the mask.
        near: where the marker is expected, px of the mask; if None, the largest blob is it.
        expected: radius seen before, px.

    Returns:
        in px of the mask; None if there is no blob of 12 px.
    """
    # A thread of pixels to a neighbour of the same colour would make one blob of two.
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _SQUARE, borderValue=0)
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    areas = np.array([cv2.contourArea(blob) for blob in blobs])
    if not len(areas) or areas.max() < 12:
        return None
    if near is not None:
        away = [cv2.pointPolygonTest(blob, near, True) for blob in blobs]
        areas = areas * np.exp(np.minimum(away, 0) / (expected or math.sqrt(areas.max())))
    main = int(np.argmax(areas))
    (u, v), reach = cv2.minEnclosingCircle(blobs[main])
    reach = _REACH * min(reach, 1.5 * expected if expected else reach)
    points = [blobs[main][:, 0]]
    for k, blob in enumerate(blobs):
        # A stripe or a wire across the marker cuts it in two.
        if k == main or areas[k] < _MIN_PART * areas[main]:
            continue
        if np.hypot(*(blob[:, 0] - (u, v)).T).max() < reach:
            points.append(blob[:, 0])
    outlines = [(points, points)]
    if len(points) > 1:
        # The edges of what is across it lie within their common hull.
        outlines.append(([cv2.convexHull(np.vstack(points))[:, 0]], points))
    found = []
    for outline, own in outlines:
        rim = _resampled(outline)
        inside = _within(rim, picture)
        fitted = _fit(rim, inside, expected)
        if fitted is not None:
            found.append(_judge(mask, rim[inside], *fitted, picture, own))
    return max(found, key=lambda one: one.arc * one.fill / (1 + one.stray), default=None)


def solve_normal(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve a least-squares fit's normal equations, shapes (n, n) and (n,); zeros if singular."""
    return cv2.solve(normal, right[:, None], flags=cv2.DECOMP_CHOLESKY)[1][:, 0]


def _resampled(contours: list[np.ndarray]) -> np.ndarray:
    """Return points at equal steps along closed contours, shape (48, 2)."""
    path = np.vstack([np.vstack([contour, contour[:1]]) for contour in contours]).astype(float)
    steps = np.hypot(*np.diff(path, axis=0).T)
    ends = np.cumsum([len(contour) + 1 for contour in contours])[:-1] - 1
    steps[ends] = 0  # from one contour to the next there is nothing
    along = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.arange(_POINTS) * (along[-1] / _POINTS)
    return np.column_stack([np.interp(at, along, path[:, k]) for k in range(2)])


def _within(points: np.ndarray, picture: tuple[float, float, float, float]) -> np.ndarray:
    """Separate the points of a rim from those where the picture's edge cuts the marker."""
    left, top, right, bottom = picture
    u, v = points.T
    return (u > left + 1) & (u < right - 1) & (v > top + 1) & (v < bottom - 1)


# As RANSAC (M. A. Fischler and R. C. Bolles, 1981) does: a circle through three points needs no
# model of what is wrong with the others, and that of many candidates is right on which most points
# lie.  But the triples are not drawn at random: they are the same ones along every contour
# (`_TRIPLES`), wide ones for whole rims and narrow ones for arcs, so that one picture always gives
# one circle.  And a vote is not 0 or 1 but 1 - (off / width)^2; a point far outside costs some, one
# inside costs nothing, for fingers hide a part of a marker.  The best candidate is refined by the
# algebraic fit of I. Kasa (1976), weighted by the distance from the rim.  Least squares alone would
# be drawn by every finger; Hough's transform votes in cells of a grid of circles, and is as coarse:
# OpenCV's was off by 0.35 px on synthetic discs.
def _fit(
    points: np.ndarray, inside: np.ndarray, expected: float | None
) -> tuple[float, float, float] | None:
    """Return the circle (u, v, radius) on which most points lie."""
    xs, ys = np.ascontiguousarray(points.T)
    (ax, bx, cx), (ay, by, cy) = xs[_TRIPLES], ys[_TRIPLES]
    bx, by, cx, cy = bx - ax, by - ay, cx - ax, cy - ay
    double = 2 * (bx * cy - by * cx)
    plausible = (np.abs(double) > 1e-6) & inside[_TRIPLES].all(0)
    double[~plausible] = 1
    ab2, ac2 = bx * bx + by * by, cx * cx + cy * cy
    du, dv = (cy * ab2 - by * ac2) / double, (bx * ac2 - cx * ab2) / double
    us, vs, radii = ax + du, ay + dv, np.sqrt(du * du + dv * dv)
    span = max(xs.max() - xs.min(), ys.max() - ys.min())
    plausible &= (radii > 0.25 * span) & (radii < 1.2 * span)
    if expected:
        plausible &= (radii > 0.6 * expected) & (radii < 1.6 * expected)
    if not plausible.any():
        return None
    us, vs, radii = us[plausible], vs[plausible], radii[plausible]
    xs, ys = xs[inside], ys[inside]
    # Which of them most points lie on needs no more than this precision.
    x, y, around = (part.astype(np.float32) for part in (xs, ys, np.stack([us, vs, radii])))
    off = cv2.magnitude(x - around[0][:, None], y - around[1][:, None])
    off -= around[2][:, None]
    off /= np.maximum(1, np.float32(0.06) * around[2])[:, None]
    # What is missing may be hidden; what sticks out is somebody else's.
    _, sticking_out = cv2.threshold(off, 2, 0.3, cv2.THRESH_BINARY)
    _, near = cv2.threshold(1 - off * off, 0, 0, cv2.THRESH_TOZERO)
    votes = cv2.reduce(near - sticking_out, 1, cv2.REDUCE_SUM)
    best = int(np.argmax(votes))
    u, v, radius = us[best], vs[best], radii[best]
    # The algebraic fit of I. Kasa (1976): x^2 + y^2 = 2 x x0 + 2 y y0 + (r^2 - x0^2 - y0^2).
    x, y = xs - u, ys - v
    design = np.array([2 * x, 2 * y, np.ones(len(x))])
    squares = x * x + y * y
    du = dv = 0.0
    for _ in range(3):
        off = np.sqrt((x - du) ** 2 + (y - dv) ** 2) - radius
        weight = np.maximum(0, 1 - (off / max(1.5, 0.08 * radius)) ** 2)
        if np.count_nonzero(weight) < 6:
            break
        weighted = design * weight
        du, dv, rest = solve_normal(weighted @ design.T, weighted @ squares).tolist()
        radius = math.sqrt(max(rest + du * du + dv * dv, 1e-6))
    u, v = u + du, v + dv
    return float(u), float(v), float(radius)


def _judge(
    mask: np.ndarray,
    rim: np.ndarray,
    u: float,
    v: float,
    radius: float,
    picture: tuple[float, float, float, float],
    blobs: list[np.ndarray],
) -> Circle:
    x, y = rim.T - np.array([[u], [v]])
    away = np.sqrt(x * x + y * y)
    near = np.abs(away - radius) < max(1.0, 0.1 * radius)
    left, top, right, bottom = picture
    ru, rv = u + radius * _RIM[:, 0], v + radius * _RIM[:, 1]
    visible = (ru > left) & (ru < right) & (rv > top) & (rv < bottom)
    directions = np.array([x[near], y[near]]) / away[near]
    supported = (_RIM @ directions > _COS_SUPPORT).any(1) & visible
    own = np.zeros_like(mask)
    cv2.drawContours(own, [blob[:, None] for blob in blobs], -1, 255, -1)
    own &= mask
    disc = np.zeros_like(mask)
    cv2.circle(disc, (round(u * 16), round(v * 16)), round(radius * 16), 255, -1, shift=4)
    area = math.pi * radius * radius
    shown = cv2.countNonZero(disc)
    covered = cv2.countNonZero(disc & mask)
    outside = cv2.countNonZero(own) - cv2.countNonZero(disc & own)
    return Circle(
        u,
        v,
        radius,
        int(np.count_nonzero(supported)) / max(1, int(np.count_nonzero(visible))),
        covered / max(1, shown),
        outside / area,
        min(1.0, shown / area),
    )
