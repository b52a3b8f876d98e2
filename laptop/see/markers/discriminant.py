"""The share of a disc in each pixel: Fisher's linear discriminant between its colour and the rest.

Pure.  A pixel on the rim counts with the share of disc in it, by its place on the line from the
colours around to the disc's.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.markers.circles import ellipse_of

FULL_SHARE = 65535
"""Value of a pixel that is all disc."""
# Where two colours share a pixel, light adds up, and codes are about its square root; but a JPEG
# averages codes.  A power between 1 and 2.2 errs least beside light and dark at once.
_EXPONENT = 1.4
_LINEAR_LIGHT = np.round(65535 * (np.arange(256) / 255) ** _EXPONENT).astype(np.uint16)
_LIGHT_EXPONENT = 2.2
_EVEN_LIGHT = ((np.arange(256) / 255) ** _LIGHT_EXPONENT).astype(np.float32)
"""Light, 0 to 1: what is smeared over many px was averaged by the sensor, as light."""
_SHARE_MARGIN = 0.1
"""Margin below which a share counts as 0, and above 1 minus which as 1: only the rim tells where a
disc is."""
_MIN_NOISE = 0.01
"""Least noise of a pixel, relative to white."""
_CODING_NOISE = 0.0125
"""Least noise of each of the two chroma channels, relative to white: a JPEG has them at half the
resolution, so that they are wrong along every edge."""
_CHROMA = np.array([[1.772, -0.344, 0.0], [0.0, -0.714, 1.402]])
"""Changes of b, g, r by one of Cb and by one of Cr: ITU-R BT.601."""
_PIXEL_SCATTER = _MIN_NOISE**2 * np.eye(3)
_CODED_SCATTER = _PIXEL_SCATTER + _CODING_NOISE**2 * _CHROMA.T @ _CHROMA
_SMOOTH = 3
"""Side of the square over which the surroundings are averaged to tell how much they pull, px: pixel
noise hardly moves a centre, spots and edges do."""
_STRETCHES = 0.006, 0.01
"""Half difference of the two second moments, relative to their sum, from which a disc may be
smeared, and surely is; its soft ends, averaged, would count as surroundings."""
_REACH, _REACH_MORE = 1.25, 2.5
"""Greatest distance of a disc's light from its middle: in radii, plus px."""
_AROUND_FROM, _AROUND_TO = (1.12, 1.5), (_REACH, _REACH_MORE + 0.75)
"""Ring in which the surroundings are learned: all within the reach, without rim and ground beyond.
"""
_MIN_SEPARATION = 9.0
"""Least squared distance of the disc's colour from those around, in their deviations."""
_MAX_UPSCALED_RADIUS = 24
"""Radius below which a contour is taken between pixels, too, px."""


class DiscriminantModel(NamedTuple):
    """A linear map from a pixel's colour to the share of disc in it.

    weights     of b, g, r, 1 in linear light; shape (1, 4); see `disc_share`
    inside      b, g, r of the disc, 0 to 1, in the same light
    brightness  of the disc when this was fitted, b + g + r; None: not known yet
    age         frames since
    """

    weights: np.ndarray
    inside: np.ndarray
    brightness: float | None = None
    age: int = 0


class Crop(NamedTuple):
    """A square of the picture, as far as it lies in it.

    image      BGR, a view
    left, top  of it, px
    part       rows and columns of a mask of the whole square that lie over it
    """

    image: np.ndarray
    left: int
    top: int
    part: tuple[slice, slice]


def half_crop(radius: float) -> int:
    """Return half the side of the crop around a disc of this radius, px, the middle not counted."""
    return math.ceil(1.6 * max(2, round(radius))) + 4


def crop_around(image: np.ndarray, u: float, v: float, half: int) -> Crop | None:
    """Crop a square of 2 half + 1 px around (u, v); None if most of it is outside the picture."""
    height, width = image.shape[:2]
    left, top = round(u) - half, round(v) - half
    columns = slice(max(0, -left), min(2 * half + 1, width - left))
    rows = slice(max(0, -top), min(2 * half + 1, height - top))
    # With the middle there, most of what counts is.
    if not (columns.start < half < columns.stop and rows.start < half < rows.stop):
        return None
    left, top = left + columns.start, top + rows.start
    window = image[top : top + rows.stop - rows.start, left : left + columns.stop - columns.start]
    return Crop(window, left, top, (rows, columns))


def fit_discriminant(
    image: np.ndarray, u: float, v: float, radius: float, covariance: tuple[float, float, float]
) -> DiscriminantModel | None:
    """Tell a disc's colour from those around it.

    Fisher's linear discriminant: what varies most around the disc (light and dark, mostly) counts
    least, so that an edge in the background does not pull.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        u: of the disc's middle, px.
        v: of the disc's middle, px.
        radius: of the disc, px.
        covariance: its second moments: across, down, skew, px^2.

    Returns:
        None where the surroundings hardly differ from the disc.
    """
    half = half_crop(radius)
    crop = crop_around(image, u, v, half)
    if crop is None:
        return None
    core, ring = (mask[crop.part] for mask in _core_and_ring(half, covariance))
    if not core.any() or not ring.any():
        return None
    light = cv2.LUT(crop.image, _LINEAR_LIGHT)
    inside = light[core].mean(axis=0) / 65535
    across, down, skew = covariance
    stretch = math.hypot((across - down) / 2, skew) / (across + down)
    smeared = float(np.interp(stretch, _STRETCHES, (0, 1)))
    smooth = cv2.blur(light, (_SMOOTH, _SMOOTH))[ring] / np.float32(65535)
    line = _part(inside, light[ring] / np.float32(65535), smooth, smeared)
    if line is None:
        return None
    weights, mean = line
    between = 1 - 2 * _SHARE_MARGIN
    weights /= between
    offset = -FULL_SHARE * (weights @ mean + _SHARE_MARGIN / between)
    return DiscriminantModel(np.append(weights, offset)[None], inside)


# The linear discriminant of R. A. Fisher (1936): of all lines w in the space of colours,
#     w = S^-1 (m1 - m0)
# has the greatest ratio (w . (m1 - m0))^2 / (w . S w) of the distance of two means to the scatter
# S along it.  Here m1 is the disc's colour, and m0 and S are those of what surrounds it alone: the
# disc is even, its surroundings are not.  Scaled so that w . (m1 - m0) = 1, the line gives a pixel
# that mixes both colours the share of disc in it, for mixing is linear where light is, nearly.
# A gate in hue gives a mask, not shares, and its edge jumps by whole pixels: on synthetic discs a
# centroid of shares is off by 0.01 to 0.03 px, of a mask by 0.04 to 0.06.  Noise of pixels averages
# out in a centroid and slow changes do not, thus S is that of averages over neighbours (`slow`).
def _part(
    inside: np.ndarray,
    around: np.ndarray,
    smooth: np.ndarray | None = None,
    smeared: float = 0.0,
    least: np.ndarray = _CODED_SCATTER,
) -> tuple[np.ndarray, np.ndarray] | None:
    """Part a colour from others; None if they hardly differ.

    Args:
        inside: light of the one, shape (3,).
        around: of the others, shape (n, 3); changed by this.
        smooth: of the others, each averaged over its neighbours; changed, too.  None: it counts
            how much they differ from pixel to pixel.
        smeared: how far this counts all the same, 0 to 1.
        least: scatter that is there anyway, shape (3, 3).

    Returns:
        weights on whose line the distance is 1, and the mean of the others.
    """
    mean = around.mean(axis=0)
    around -= mean
    contrast = inside - mean
    scatter = (around.T @ around / len(around)).astype(float) + least
    pull = scatter
    if smooth is not None:
        smooth -= mean
        # An average of n pixels is worth n of them: the density of the scatter's slow part.
        slow = (_SMOOTH**2 / len(smooth) * smooth.T @ smooth).astype(float) + least
        pull = slow + smeared * (scatter - slow)
    # R. A. Fisher (1936): the weights S^-1 (m1 - m0) part two classes best; S, their scatter.
    weights = np.linalg.solve(pull, contrast)
    distance = float(weights @ contrast)
    separation = distance**2 / float(weights @ scatter @ weights)
    return (weights / distance, mean) if separation >= _MIN_SEPARATION else None


def _core_and_ring(
    half: int, covariance: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return masks of an ellipse's core and the ring around it, in a square of 2 half + 1 px."""
    across, down, skew = covariance
    turn = math.atan2(2 * skew, across - down) / 2
    middle, half_gap = (across + down) / 2, math.hypot((across - down) / 2, skew)
    long, short = 2 * math.sqrt(middle + half_gap), 2 * math.sqrt(max(middle - half_gap, 0.25))
    v, u = np.ogrid[-half : half + 1, -half : half + 1]
    along2 = (u * math.cos(turn) + v * math.sin(turn)) ** 2
    beside2 = (v * math.cos(turn) - u * math.sin(turn)) ** 2

    def within(times: float, more: float) -> np.ndarray:
        a, b = times * long + more, times * short + more
        return along2 / (a * a) + beside2 / (b * b) < 1

    return within(0.6, 0), within(*_AROUND_TO) & ~within(*_AROUND_FROM)


def disc_share(image: np.ndarray, model: DiscriminantModel) -> np.ndarray:
    """Return the share of disc in each pixel: uint16, shape (h, w), 0 to FULL_SHARE."""
    return cv2.transform(cv2.LUT(image, _LINEAR_LIGHT), model.weights)


def smeared_share(
    image: np.ndarray, model: DiscriminantModel, around: np.ndarray
) -> np.ndarray | None:
    """Return the share of disc in each pixel that it may have moved over during the exposure.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        model: of the disc at rest; only its own colour counts.
        around: mask of what is not disc, uint8, shape (h, w).

    Returns:
        float32, shape (h, w), about 0 to 1; None where the surroundings hardly differ from it.
    """
    light = cv2.LUT(image, _EVEN_LIGHT)
    line = _part(
        model.inside ** (_LIGHT_EXPONENT / _EXPONENT),
        light[around > 0],
        least=_PIXEL_SCATTER,
    )
    if line is None:
        return None
    weights, mean = line
    return cv2.transform(light, np.append(weights, -weights @ mean)[None])


def outline_at(share: np.ndarray, u: float, v: float) -> np.ndarray | None:
    """Return the contour at half disc share around (u, v), or the nearest; None if there is none.

    What lies around that in turn, as the ground around a disc's rim may, is another.
    """
    half = cv2.inRange(share, 32768, 65535)
    outlines, levels = cv2.findContours(half, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    outer = [outline for k, outline in enumerate(outlines) if levels[0, k, 3] < 0]
    if not outer:
        return None
    away = [cv2.pointPolygonTest(outline, (u, v), True) for outline in outer]
    around = [outline for outline, off in zip(outer, away, strict=True) if off > 0]
    return min(around, key=len) if around else outer[int(np.argmax(away))]


@lru_cache(maxsize=64)
def reach_mask(radius: int) -> np.ndarray:
    """Return a mask of where a disc of this radius (px) may be, and hardly larger."""
    reach = _REACH * radius + _REACH_MORE
    half = math.ceil(reach)
    v, u = np.mgrid[-half : half + 1, -half : half + 1]
    return np.where(np.hypot(u, v) < reach, FULL_SHARE, 0).astype(np.uint16)


def outline_quality(
    image: np.ndarray, u: float, v: float, radius: float, model: DiscriminantModel
) -> float:
    """Return the likeness of the contour at half disc share to an ellipse, 0 to 1.

    Brightness has a part in it, which a JPEG keeps finer than the colours that an HSV mask sees.
    """
    # Not within its reach alone, a circle, in which anything larger would look like a disc.
    crop = crop_around(image, u, v, half_crop(radius))
    if crop is None:
        return 0.0
    share = disc_share(crop.image, model)
    # Between pixels, too: of a small one, and of one aslant, whole pixels do not show the shape.
    finer = 4 if radius < _MAX_UPSCALED_RADIUS else 1
    at = (u - crop.left + 0.5) * finer - 0.5, (v - crop.top + 0.5) * finer - 0.5
    outline = outline_at(cv2.resize(share, None, fx=finer, fy=finer), *at)
    ellipse = None if outline is None else ellipse_of(outline, finer)
    return ellipse.quality if ellipse else 0.0
