"""The smear that a disc leaves when it moves while the shutter is open.

Pure.  A disc of radius r that goes evenly over a way w is seen in a pixel for a part of the
exposure: for the chord that it lays over the pixel along w, divided by w, less what is before or
after the exposure.  So the smear is a stadium with soft ends, paler than the disc where w is longer
than the chord.  That is the convolution of disc and way, hence its area, in shares of disc, is that
of the disc, and its second moments are r^2 / 4 and, along the way, w^2 / 12 more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.markers.circles import solve_normal

_BLUR_SIGMA = 0.8
"""Sigma of the blur of lens and pixel together, px."""
_MAX_STEPS = 8
_CONVERGED_STEP = 0.02
"""Change of the parameters below which a fit has converged, px."""
_MAX_STEP = 0.4
"""Greatest change of a parameter in an iteration, in radii."""
_HALF_WEIGHT_DEVIATION = 0.12
"""Deviation of a share at which its weight is half: other objects must not bias the fit."""
_DAMPING = 1e-3 * np.eye(5)


class Smear(NamedTuple):
    """A disc that moves during the exposure; px.

    u, v    centre of the disc in the middle of the exposure, and of the smear
    du, dv  way of the centre during the exposure, there or back
    radius  of the disc
    """

    u: float
    v: float
    du: float
    dv: float
    radius: float

    @property
    def length(self) -> float:
        """Length of the motion, px."""
        return math.hypot(self.du, self.dv)

    def moved(self, u: float, v: float) -> Smear:
        """Return the smear moved by px to the right and down."""
        return self._replace(u=self.u + u, v=self.v + v)


def smear_of_moments(m: cv2.typing.Moments) -> Smear:
    """Return the smear with the same second moments as some shares of disc."""
    area = m["m00"]
    matrix = np.array([[m["mu20"], m["mu11"]], [m["mu11"], m["mu02"]]]) / area
    (short, long), axes = np.linalg.eigh(matrix)
    du, dv = (math.sqrt(12 * max(long - short, 0.1)) * axes[:, 1]).tolist()
    return Smear(m["m10"] / area, m["m01"] / area, du, dv, 2 * math.sqrt(max(short, 1.0)))


def smear_share(smear: Smear, shape: tuple[int, ...]) -> np.ndarray:
    """Return the share of disc in each pixel of a window: float32, shape (h, w), 0 to 1.

    Args:
        smear: px of the window.
        shape: height and width of the window, px.
    """
    return _soft(_Shares(smear, shape).share)


class _Shares:
    """The shares of disc in the pixels of a window, without the blur of the lens, and their slopes.

    Args:
        smear: px of the window.
        shape: height and width of the window, px.
    """

    def __init__(self, smear: Smear, shape: tuple[int, ...]) -> None:
        self._radius = np.float32(smear.radius)
        self._length = length = np.float32(max(smear.length, 1e-3))
        self._cos, self._sin = np.float32(smear.du) / length, np.float32(smear.dv) / length
        us = np.arange(shape[1], dtype=np.float32) - np.float32(smear.u)
        vs = np.arange(shape[0], dtype=np.float32)[:, None] - np.float32(smear.v)
        self._along = us * self._cos + vs * self._sin
        self._across = vs * self._cos - us * self._sin
        # Half of the chord that the disc lays over a pixel along its motion.
        self._half = np.sqrt(np.maximum(self._radius**2 - self._across * self._across, 0))
        # The part of the motion in which the pixel is in the disc.  In the disc's frame the pixel
        # goes from `along` minus half of the length to `along` plus half of it.
        self._first, self._last = self._along - length / 2, self._along + length / 2
        seen = np.minimum(self._last, self._half) - np.maximum(self._first, -self._half)
        self.share = np.maximum(seen, 0) / length

    def slopes(self) -> np.ndarray:
        """Return the derivatives by the parameters of a Smear: float32, shape (h, w, 5), 1/px."""
        any_seen = (self.share > 0) / self._length
        late, early = (self._last < self._half) * any_seen, (self._first > -self._half) * any_seen
        by_along = late - early
        by_half = 2 * any_seen - late - early
        by_length = (late + early) / 2 - self.share / self._length
        by_half /= np.maximum(self._half, 0.5)
        by_across = -by_half * self._across
        by_turn = (by_along * self._across - by_across * self._along) / self._length
        cos, sin = self._cos, self._sin
        return np.dstack(
            [
                sin * by_across - cos * by_along,
                -cos * by_across - sin * by_along,
                cos * by_length - sin * by_turn,
                sin * by_length + cos * by_turn,
                by_half * self._radius,
            ]
        )


def _soft(shares: np.ndarray) -> np.ndarray:
    """Blur as lens and pixels do; any number of channels."""
    return cv2.GaussianBlur(shares, (5, 5), _BLUR_SIGMA)


def fit_smear(share: np.ndarray, start: Smear) -> Smear | None:
    """Fit a smear to shares of disc.

    Least squares by Gauss and Newton, with the weights of A. L. Cauchy's distribution.

    Args:
        share: float32, shape (h, w); 0: no disc, 1: nothing else.
        start: about right, px of the window.

    Returns:
        None if there is none that is similar.
    """
    at = np.array(start)
    for _ in range(_MAX_STEPS):
        shares = _Shares(Smear(*at), share.shape)
        off = (share - _soft(shares.share)).reshape(-1, 1)
        slopes = _soft(shares.slopes()).reshape(-1, 5)
        weighted = slopes / (1 + (off / _HALF_WEIGHT_DEVIATION) ** 2)
        normal, right = (weighted.T @ slopes).astype(float), (weighted.T @ off)[:, 0].astype(float)
        most = _MAX_STEP * start.radius
        step = np.clip(solve_normal(normal + _DAMPING, right), -most, most)
        at += step
        if not 0.5 * start.radius < at[4] < 2 * start.radius:
            return None
        if np.abs(step).max() < _CONVERGED_STEP:
            break
    return Smear(*at.tolist())


def smear_misfit(share: np.ndarray, smear: Smear) -> float:
    """Return the root of the squared residuals around a smear, relative to its own."""
    model = smear_share(smear, share.shape)
    off = (share - model)[smear_mask(smear, share.shape, 3) > 0]
    return math.sqrt(float((off**2).sum() / max((model**2).sum(), 1.0)))


def smear_mask(smear: Smear, shape: tuple[int, ...], margin: float) -> np.ndarray:
    """Return a mask of a smear and a margin, px; uint8, shape (h, w), 255 inside."""
    mask = np.zeros(shape[:2], np.uint8)
    half = np.array([smear.du, smear.dv]) / 2
    ends = [np.round(np.array([smear.u, smear.v]) + side * half).astype(int) for side in (-1, 1)]
    thick = round(2 * (smear.radius + margin)) + 1
    cv2.line(mask, ends[0].tolist(), ends[1].tolist(), 255, thick)
    return mask
