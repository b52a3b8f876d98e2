"""The contour of a ball in the picture itself: a mask loses shaded and shining parts.

Pure.  Along rays from about the centre, the strongest step of colour is looked for.  The circle
through most of these steps is the contour; how well they fit it, and on how much of it there are
any, tells how far off its centre may be.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.markers.circles import solve_normal
from laptop.see.markers.markers import Color, hsv_mask


class BallContour(NamedTuple):
    """A circle fitted to steps of colour, and how far to trust it.

    u, v, radius  px
    misfit        expected error of the centre, as a share of the radius
    contrast      part of the contour that has the colour within and another without: 0 to 1
    gap           part of the contour, as far as it lies in the picture, on which there is no step
    """

    u: float
    v: float
    radius: float
    misfit: float
    contrast: float
    gap: float


_RAYS = 48
_SAMPLES = 40
_NEAREST, _FARTHEST = 0.6, 1.4
"""Beginning and end of a ray, in radii."""
_STEP = (_FARTHEST - _NEAREST) / (_SAMPLES - 1)
_RHO = np.linspace(_NEAREST, _FARTHEST, _SAMPLES, dtype=np.float32)
# One more ray on either side, for the change from ray to ray.
_ANGLES = np.arange(-1, _RAYS + 1) * (2 * math.pi / _RAYS)
_GRID_U = (np.cos(_ANGLES)[:, None] * _RHO).astype(np.float32)
_GRID_V = (np.sin(_ANGLES)[:, None] * _RHO).astype(np.float32)
_DESIGN = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.ones(_RAYS + 2)])[1:-1]
_PRODUCTS = (_DESIGN[:, :, None] * _DESIGN[:, None, :]).reshape(_RAYS, 9)
_EVERY = np.arange(_RAYS)
_RIDGE = 1e-6 * np.eye(3)
_STABLE = 1e-3 * np.eye(3)
_SQUARES = np.arange(256, dtype=np.float32) ** 2
_SUM = np.ones((1, 3), np.float32)

_WITHIN, _WITHOUT = slice(7, 15), slice(25, 33)
"""Samples that tell the colours on either side of the rim."""

_FIRST_REACH, _SECOND_REACH = 0.2, 0.12
"""Sigmas of a step's distance from the expected rim in both passes, in radii."""
_MIN_MOVE = 0.04
"""Least move of the circle that is worth a second pass, in radii."""
_MIN_STEP_HEIGHT = 8.0
"""Least change of colour along a ray that is no noise, DN."""
_FULL_STEP_HEIGHT = 40.0
"""Change of colour along a ray above which its weight does not grow, DN."""
_ROUGHNESS = 0.06
"""Greatest distance of a step on the rim, in radii (at least 1 px)."""
_CLEAR_DISTANCE = 2.5
"""Distance from a rim at which a camera shows the colours on either side as they are, px."""
_MIN_BRIGHTNESS = 0.5
"""Brightness, relative to the marker's, below which what is beside it has no usable colour."""
_RIM_REACH = 0.6, 1.5
"""Range in which the rim of a circle from a mask is sought, in radii."""
_BESIDE_RIM = 0.5, 0.7
"""Range in which the colour within is sampled, in radii."""
_MIN_RIM_SLOPE, _NO_RIM_SLOPE = 0.4, 0.2
"""Least slope of a rim, relative to the greatest one; and slope, relative to that, of no rim."""
_BLUR_COST, _GAP_COST = 0.2, 0.025
"""Increases of the residual by a blurred rim (width squared) and by a missing one, in radii."""
_MAX_SHARP_WIDTH = 4.0
"""Greatest width of a sharp rim, px: nothing has moved."""
_SHADED_BRIGHTNESS = 0.6
"""Share of a ball's brightness that is left at its contour."""
_OUTER_SHARE, _INNER_SHARE = 0.2, 0.8
"""Shares of the inner colour between which a rim passes into what is around."""
_SMEAR_COST, _LEAN_COST = 0.3, 0.4
"""Increases of the misfit by a smear: by its rim's greater width along than across, and by how far
the middles of its two ends lie to one side, both in radii."""
_SECTOR = (np.arange(24)[:, None] + np.arange(-2, 3)) % 24
"""Indices of every second ray, with two of these on either side."""
_ACROSS = (np.arange(12) + 6) % 12
"""Indices of the perpendicular directions, for half of these rays."""


def fit_ball_contour(
    image: np.ndarray,
    u: float,
    v: float,
    radius: float,
    picture: tuple[float, float, float, float],
    color: Color,
) -> BallContour | None:
    """Fit a circle to the steps of colour around one that is about right.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        u: of the middle of the circle to begin with, px.
        v: of the middle of the circle to begin with, px.
        radius: of the circle to begin with, px.
        picture: left, top, right, bottom of the whole picture, px of the image.
        color: of the marker.

    Returns:
        None if there are hardly any steps.
    """
    rough = radius
    moved = True
    for reach in (_FIRST_REACH, _SECOND_REACH):
        if not moved:
            break
        rays, half = _rays(image, u, v, radius)
        steps, slopes, along = _steps(rays, half, reach)
        rho = _RHO[half:-half][along] + _between(steps, along) * _STEP
        height = steps[_EVERY, along]
        rim_u, rim_v = u + radius * rho * _DESIGN[:, 0], v + radius * rho * _DESIGN[:, 1]
        left, top, right, bottom = picture
        visible = (
            (rim_u > left + 1) & (rim_u < right - 1) & (rim_v > top + 1) & (rim_v < bottom - 1)
        )
        weight = np.minimum(height, _FULL_STEP_HEIGHT) * visible
        (du, dv, dr), off = _fit_circle(rho, weight, radius)
        if math.hypot(du, dv) > 0.5 or abs(dr) > 0.5:
            return None
        u, v, radius = u + radius * du, v + radius * dv, radius * (1 + dr)
        moved = max(math.hypot(du, dv), abs(dr)) > _MIN_MOVE
    if not 0.5 < radius / rough < 2:
        return None
    on_rim = visible & (off < max(1 / radius, _ROUGHNESS)) & (height > _MIN_STEP_HEIGHT)
    count = int(np.count_nonzero(on_rim))
    if count < 6:
        return None
    residual = math.sqrt(float((off[on_rim] ** 2).mean()))
    blur = _blur(rays, half, slopes[_EVERY, along], on_rim)
    gap = 1 - count / max(1, int(np.count_nonzero(visible)))
    misfit = _dilution(on_rim) * (residual + _BLUR_COST * blur * blur + _GAP_COST * gap)
    if blur * radius > _MAX_SHARP_WIDTH:
        smear, lean = _smear(rays)
        misfit += _SMEAR_COST * smear + _LEAN_COST * min(lean, smear)
    return BallContour(
        u, v, radius, misfit, _contrast(rays[1:-1], along + half, on_rim, color, radius), gap
    )


# A circle by robust linear least squares.  Seen from a point near its centre, a circle that is
# shifted by (du, dv) and larger by dr, all in radii, has its rim in the direction a at
#     rho(a) = 1 + du cos a + dv sin a + dr
# to first order, so that three numbers follow linearly from the distances measured along the rays.
# That is a geometric fit: it minimizes distances from the rim.  The algebraic one (I. Kasa, 1976),
# with which `circles` fits masks, minimizes d^2 - r^2, which draws a short arc's circle inwards.
# Steps that belong to a finger or a highlight are not noise about the rim but elsewhere: hence the
# biweight of J. W. Tukey, whose weight (1 - (r / c)^2)^2 is zero beyond c.  (P. J. Huber's is not:
# they would go on pulling.)  The scale comes from the median residual, as almost half of the rays
# may be wrong; a ridge keeps at its place what too few rays tell.
def _fit_circle(
    rho: np.ndarray, full: np.ndarray, radius: float
) -> tuple[tuple[float, float, float], np.ndarray]:
    """Fit a circle to distances along the rays.

    Args:
        rho: of the strongest steps from the centre, in radii, (rays,).
        full: weights of the steps, were none of them an outlier, (rays,).
        radius: px, for the least spread of the steps.

    Returns:
        Shift (du, dv) and growth dr, in radii; and by how much each step is off, in radii, (rays,).
    """
    weight = full
    for turn in range(3):
        normal = (weight @ _PRODUCTS).reshape(3, 3)
        shift = solve_normal(normal + _RIDGE, (weight * (rho - 1)) @ _DESIGN)
        off = np.abs(rho - 1 - _DESIGN @ shift)
        if turn == 2:
            break
        middle = float(np.partition(off, _RAYS // 2)[_RAYS // 2])
        spread = max(0.5 / radius, 0.02, 1.2 * middle)
        weight = full * np.maximum(0, 1 - (off / (2.5 * spread)) ** 2) ** 2
    du, dv, dr = shift.tolist()
    return (du, dv, dr), off


def _blur(rays: np.ndarray, half: int, slopes: np.ndarray, on_rim: np.ndarray) -> float:
    """Return the median width of a rim, in radii: from the colour within to that without.

    Args:
        rays: as of `_rays`.
        half: half the number of samples between the two of which a step is the difference.
        slopes: the step at each ray's rim, DN, (rays,).
        on_rim: which rays have a step on the rim, (rays,), bool.
    """
    within, without = (
        cv2.resize(rays[1:-1, part], (1, _RAYS), interpolation=cv2.INTER_AREA)
        for part in (_WITHIN, _WITHOUT)
    )
    contrast_step = _distance(within, without)[:, 0]
    width = contrast_step * (2 * half * _STEP) / np.maximum(1, slopes)
    return float(np.sort(width[on_rim])[int(np.count_nonzero(on_rim)) // 2])


def _dilution(on_rim: np.ndarray) -> float:
    """Return the centre's standard deviation in residuals', relative to a rim seen whole.

    As a satellite receiver's dilution of precision: the rays on the rim alone decide it.
    """
    normal = (on_rim.astype(float) @ _PRODUCTS).reshape(3, 3) + _STABLE
    inverse = cv2.invert(normal, flags=cv2.DECOMP_CHOLESKY)[1]
    return math.sqrt(inverse[0, 0] + inverse[1, 1]) * math.sqrt(_RAYS) / 2


def _smear(rays: np.ndarray) -> tuple[float, float]:
    """Return the width of a contour's motion smear, and its one-sidedness, in radii; 0, 0 if none.

    Its rim is wide at two opposite ends, and sharp across, as neither shade nor focus make it.  The
    colours on either side are smeared with it, hence the steepest step may be at any place in it.

    Args:
        rays: as of `_rays`.
    """
    pairs = cv2.blur(rays, (1, 3))[1:-1:2, 2:].astype(np.float32)
    around = pairs[:, -1:]
    pairs -= around
    contrast = pairs[:, :1]
    shares = (pairs @ contrast.transpose(0, 2, 1))[..., 0]
    full = np.maximum(shares[:, :1], _MIN_STEP_HEIGHT**2)
    first = (shares < _INNER_SHARE * full).argmax(axis=1)
    last = shares.shape[1] - 1 - (shares[:, ::-1] > _OUTER_SHARE * full).argmax(axis=1)
    both = np.sort(np.stack([last - first, last + first]).take(_SECTOR, axis=1))
    widths, middles = both[..., _SECTOR.shape[1] // 2]
    opposite = widths.reshape(2, 12)
    wider = opposite.min(axis=0) - opposite.max(axis=0)[_ACROSS]
    along = int(wider.argmax())
    smear = max(0, int(wider[along])) * _STEP
    return smear, abs(int(middles[along] - middles[along + 12])) / 4 * _STEP


def scaled_misfit(contour: BallContour) -> float:
    """Return a contour's misfit relative to a precise one's: a tenth of the radius and 1 px."""
    return contour.misfit / (1 + 10 / contour.radius)


def rim_width(image: np.ndarray, u: float, v: float, radius: float) -> float:
    """Return the rim's width around a circle, in radii: 0.1 if sharp, 0.6 if all blurred.

    The way from three quarters of the colour within to a quarter, in the middle of all directions.
    The colour within is that beside the rim: a ball is shaded, and in its middle it may shine.  The
    colour without is that far outside, or of the first level beyond the rim: what makes it
    narrower, for a disc's white rim has others beyond.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        u: of the circle's middle, px.
        v: of the circle's middle, px.
        radius: of the circle, px.
    """
    rho = np.linspace(0, 2.5, 61)
    angles = _ANGLES[1:-1, None]
    rays = cv2.remap(
        image, (u + radius * rho * np.cos(angles)).astype(np.float32),
        (v + radius * rho * np.sin(angles)).astype(np.float32), cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    ).astype(np.float32)  # fmt: skip
    profile = np.median(rays, axis=0)
    slopes = np.linalg.norm(profile[2:] - profile[:-2], axis=1)  # of one sample to the next but one
    first, last = np.searchsorted(rho[1:-1], _RIM_REACH)
    steep = first + int(np.argmax(slopes[first:last] > _MIN_RIM_SLOPE * slopes[first:last].max()))
    while steep + 1 < last and slopes[steep + 1] > slopes[steep]:
        steep += 1
    level = steep + np.flatnonzero(slopes[steep:] < _NO_RIM_SLOPE * slopes[steep])
    inner, outer = np.searchsorted(rho, _BESIDE_RIM)
    within = np.median(rays[:, inner : outer + 1].reshape(-1, 3), 0)
    without = [np.median(rays[:, -8:].reshape(-1, 3), 0), *profile[1 + level[:1]]]
    return min(_quarters(rays[:, inner:], within, around) for around in without) * float(rho[1])


def _quarters(rays: np.ndarray, within: np.ndarray, around: np.ndarray) -> int:
    """Return the samples between three quarters and one quarter of a colour, the rest another's."""
    contrast = within - around
    shares = np.median((rays - around) @ contrast / max(1.0, float(contrast @ contrast)), axis=0)
    inner, outer = (int(np.argmax(shares < share)) or len(shares) - 1 for share in (0.75, 0.25))
    return outer - inner


def _rays(image: np.ndarray, u: float, v: float, radius: float) -> tuple[np.ndarray, int]:
    """Return colours along rays, shape (rays + 2, samples, 3), and samples in a px, 2 to 8."""
    at_u, at_v = _GRID_U * np.float32(radius), _GRID_V * np.float32(radius)
    at_u += np.float32(u)
    at_v += np.float32(v)
    rays = cv2.remap(image, at_u, at_v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return rays, min(8, max(2, round(1 / (_STEP * radius))))


def _steps(rays: np.ndarray, half: int, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return colour steps along rays, less those across; all steps; the index of the best."""
    slopes = _distance(rays[1:-1, 2 * half :], rays[1:-1, : -2 * half])
    # What lies across rays, like the edge of something that hides a part, is no contour.
    beside_slopes = _distance(rays[2:, half:-half], rays[:-2, half:-half])
    rho = _RHO[half:-half]
    beside_slopes *= half * _STEP * _RAYS / (2 * math.pi) / rho
    steps = np.maximum(0, slopes - beside_slopes) * np.exp(-0.5 * ((rho - 1) / reach) ** 2)
    return steps, slopes, np.minimum(np.maximum(steps.argmax(axis=1), 1), steps.shape[1] - 2)


def _distance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the colour distance, DN, of two uint8 (h, w, 3): float32, shape (h, w)."""
    return cv2.sqrt(cv2.transform(cv2.LUT(cv2.absdiff(a, b), _SQUARES), _SUM))


def _between(steps: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the vertex of the parabola through a peak and its neighbours, -1 to 1 samples."""
    before, top, after = (steps[_EVERY, along + k] for k in (-1, 0, 1))
    bend = np.minimum(before - 2 * top + after, -1e-6)
    return np.minimum(np.maximum(0.5 * (before - after) / bend, -1), 1)


def _contrast(
    rays: np.ndarray, along: np.ndarray, on_rim: np.ndarray, color: Color, radius: float
) -> float:
    """Part of the rim that has the colour within and not without."""
    inner = rays[_EVERY, np.maximum(along - max(4, round(_CLEAR_DISTANCE / (_STEP * radius))), 0)]
    beyond = max(5, round(_CLEAR_DISTANCE / (_STEP * radius)))
    outer = rays[_EVERY, np.minimum(along + beyond, _SAMPLES - 1)]
    both = cv2.cvtColor(np.stack([inner, outer]), cv2.COLOR_BGR2HSV)
    within, without = hsv_mask(both, color.wider(value=_SHADED_BRIGHTNESS)) > 0
    without &= outer.max(axis=1) > _MIN_BRIGHTNESS * inner.max(
        axis=1
    )  # noise on black has colours, too
    both_sides = np.count_nonzero(within & on_rim) - np.count_nonzero(without & on_rim)
    return float(both_sides / np.count_nonzero(on_rim))
