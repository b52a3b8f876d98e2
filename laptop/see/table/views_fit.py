"""Least-squares fit of a lens, and of the camera's pose in each view, to known points.

All views at once, by Levenberg and Marquardt's method.  What they do not tell, what cameras and
sheets of paper are like tells: the priors below.  So nothing is ever divided by nothing, and the
covariance says what is still open.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from scipy.optimize import least_squares

from laptop.see.table.camera_model import projected

MIN_SIGMA = 0.02
"""Least error of a corner, px: no marker is placed better."""
FIRST_SIGMA, SIGMA_PASSES = 0.2, 3
"""Error of a corner in the first fit, px; and number of fits, each with the error that the last
one's residuals show."""
OUTLIER_DEVIATIONS = 3.0
"""Number of median absolute deviations from which a corner counts less (P. J. Huber, 1964)."""
MAX_STEPS = 60
IMPOSSIBLE_PX = 1e6
"""Residual of a corner by a lens that there cannot be, px."""

USUAL_FIELD, FIELD_SPREAD = 1.2, 0.5
"""Prior of cameras' fields of view: the picture's longer side in focal lengths, and its standard
deviation. That is 62 degrees: within one of them 39 to 81, within two 11 to 95. What is spread so
is the inverse of the focal length, for the parallax goes by it: then what is above the table is as
unsure as is said even where a picture tells nothing of the lens, and the prior alone does."""
LENS_SPREADS = (0.03, 0.03, 0.3, 0.3, 0.003, 0.003, 0.1)
"""Prior standard deviations of cx, cy (as shares of the longer side), k1, k2, p1, p2, k3 about 0.
"""
ZOOM_SPREAD = 0.5
"""Prior standard deviation of the logarithm of a camera's focal lengths between views."""
PRINT_SPREAD = 0.002
"""Prior standard deviations of a print: by what share it is longer up the page than across, and by
what angle, rad, it is skewed. Of a picture from above either looks like a camera that is tilted a
little, and so like a lens that it is not."""
BEND_SPREAD, BENT_AT = 0.04, 15.0
"""Prior standard deviation of each way in which a lying sheet is bent off its plane, cm, at this
distance from its middle, cm. Each view has its own."""
BENDS = [(power - up, up) for power in (2, 3, 4) for up in range(power + 1)]
"""Powers of x and y of these ways."""


@dataclass(frozen=True)
class Unknowns:
    """Layout of the fitted state: lens, poses, sheet, zooms.

    views  number of views
    sheet  the points are on a sheet of paper: how it is printed, and in each view how it is bent
    zooms  each view has a focal length of its own
    """

    views: int
    sheet: bool = False
    zooms: bool = False

    def pose(self, view: int) -> slice:
        """Return the slice of a view's rotation and shift, 6."""
        start = 8 + 6 * (view % self.views)
        return slice(start, start + 6)

    @property
    def print(self) -> slice:
        """Slice of the print's stretch up the page and its skew, 2 or none."""
        start = 8 + 6 * self.views
        return slice(start, start + 2 * self.sheet)

    def bend(self, view: int) -> slice:
        """Return the slice of a view's sheet bend, one number for each of BENDS or none."""
        start = self.print.stop + len(BENDS) * view * self.sheet
        return slice(start, start + len(BENDS) * self.sheet)

    @property
    def zoom(self) -> slice:
        """Slice of the views' focal lengths, as logarithms relative to the last, n - 1 or none."""
        start = self.bend(self.views).start
        return slice(start, start + (self.views - 1) * self.zooms)

    @property
    def count(self) -> int:
        """Length of the state."""
        return self.zoom.stop


class PointsView(Protocol):
    """Pixels of known points in one picture.

    pixels  (n, 2)
    size    of the picture, (width, height), px
    """

    @property
    def pixels(self) -> np.ndarray: ...  # noqa: D102
    @property
    def size(self) -> tuple[int, int]: ...  # noqa: D102


def refine(
    views: Sequence[PointsView],
    points: Sequence[np.ndarray],
    state: np.ndarray,
    unknowns: Unknowns,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit all unknowns from a first guess.

    Args:
        views: of one camera.
        points: of each view, (n, 3), cm; where they are on a sheet, as it was meant to be printed.
        state: the first guess, `unknowns.count` numbers.
        unknowns: what they are.

    Returns:
        The state, what is left over (n, 2), px, and the information matrix.
    """
    sigma = FIRST_SIGMA
    for _ in range(SIGMA_PASSES):
        state, off, information = _minimize(views, points, state, unknowns, sigma)
        # As many corners as there are unknowns tell nothing of the noise.
        free = max(off.size - len(state), off.size // 4)
        noise = math.sqrt(float((huber_weights(off) * off**2).sum()) / free)
        sigma = math.hypot(noise, MIN_SIGMA)
    return state, off, information


def with_prior_focal(covariance: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Return the covariance (m, m) of a state where its focal length is as unsure as the prior's.

    All that goes with the focal length becomes unsure with it.
    """
    field_sigma = FIELD_SPREAD / USUAL_FIELD
    along = covariance[:, 0] / covariance[0, 0]
    more = max(0.0, (field_sigma * state[0]) ** 2 - covariance[0, 0])
    return np.asarray(covariance + more * np.outer(along, along))


def huber_weights(off: np.ndarray) -> np.ndarray:
    """Return the weights (n, 1) of corners that are off by (n, 2)."""
    distances = np.linalg.norm(off, axis=1)
    limit = OUTLIER_DEVIATIONS * max(float(np.median(distances)), MIN_SIGMA)
    return np.minimum(1.0, limit / np.maximum(distances, 1e-12))[:, None]


# The camera is a pinhole with the lens of D. C. Brown (1966), as OpenCV has it: a point X of the
# board is at R X + t before the camera, at (a, b) = (x / z, y / z) in the plane of unit distance,
# there moved along the radius by k1, k2, k3 and by decentering by p1, p2, and then at f (a, b) + c.
# Sought is the state s with the least
#     sum w |pixel(s) - seen|^2 / sigma^2 + sum ((s - usual) / spread)^2,
# the most probable one if errors and priors are normal; the weights w are those of P. J. Huber
# (1964) and follow the residuals; the slopes given leave out that they do.  The method is that of
# K. Levenberg (1944) and D. W. Marquardt (1963), in MINPACK's version (J. J. More, 1978): it scales
# each number by its own slopes, as px, rad and cm stand in one state.
# OpenCV's calibrateCamera, after Z. Zhang (2000), takes no priors: a single picture from straight
# above, in which a longer lens looks like a camera farther up, leaves its equations singular.  Here
# the priors fill what is open, and the inverse of N = J' J says how open it is.
def _minimize(
    views: Sequence[PointsView],
    points: Sequence[np.ndarray],
    state: np.ndarray,
    unknowns: Unknowns,
    sigma: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit the state, as `refine` does, with corners that are off by sigma, px."""
    priors = _Priors(views[0].size, unknowns)

    @functools.lru_cache(maxsize=1)  # asked for residuals, and then for the slopes of the same
    def system(numbers: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        tried = np.frombuffer(numbers)
        off, slopes = _offs(views, points, tried, unknowns)
        if tried[0] <= 1 or not np.isfinite(off).all():
            off = np.full_like(off, IMPOSSIBLE_PX)
        weights = np.repeat(np.sqrt(huber_weights(off)), 2, axis=1).ravel() / sigma
        surprise, per = priors.at(tried)
        residuals = np.concatenate([weights * off.ravel(), surprise])
        return residuals, np.vstack([weights[:, None] * slopes, np.diag(per)]), off

    found = least_squares(
        lambda x: system(x.tobytes())[0],
        state,
        lambda x: system(x.tobytes())[1],
        method="lm",
        x_scale="jac",
        max_nfev=MAX_STEPS,
    )
    return found.x, system(found.x.tobytes())[2], found.jac.T @ found.jac


def _offs(
    views: Sequence[PointsView],
    points: Sequence[np.ndarray],
    state: np.ndarray,
    unknowns: Unknowns,
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much corners are off, (n, 2), px, and the slopes of that, (2 n, m)."""
    lens, zooms = state[:8], state[unknowns.zoom]
    offs, rows = [], []
    for k, (view, own) in enumerate(zip(views, points, strict=True)):
        zoom = math.exp(np.clip(zooms[k], -9, 9)) if k < len(zooms) else 1.0
        zoomed = np.append(zoom * lens[0], lens[1:])
        turn, shift = np.split(state[unknowns.pose(k)], 2)
        by_sheet = _sheet(own) if unknowns.sheet else np.zeros((len(own), 3, 0))
        sheet = np.r_[unknowns.print, unknowns.bend(k)]
        pixels, slopes = projected(own + by_sheet @ state[sheet], zoomed, turn, shift)
        row = np.zeros((len(own), 2, len(state)))
        row[..., :8] = slopes[..., :8]
        row[..., unknowns.pose(k)] = slopes[..., 8:]
        row[..., sheet] = slopes[..., 11:] @ cv2.Rodrigues(turn)[0] @ by_sheet
        if k < len(zooms):
            row[..., 0] *= zoom
            row[..., unknowns.zoom.start + k] = zoomed[0] * slopes[..., 0]
        offs.append(pixels - view.pixels)
        rows.append(row)
    return np.concatenate(offs), np.concatenate(rows).reshape(-1, len(state))


def _sheet(points: np.ndarray) -> np.ndarray:
    """Return the shift of points (n, 3), cm, by each number of print and bend: (n, 3, 2 + b)."""
    x, y = points[:, :2].T
    moved = np.zeros((len(points), 3, 2 + len(BENDS)))
    moved[:, 1, 0] = moved[:, 0, 1] = y
    moved[:, 2, 2:] = np.stack([(x / BENT_AT) ** a * (y / BENT_AT) ** b for a, b in BENDS], axis=1)
    return moved


class _Priors:
    """What cameras and sheets are like: normal distributions of the state's numbers.

    Of a place nothing is usual.

    Args:
        size: of the pictures, (width, height), px.
        unknowns: what the numbers are.
    """

    def __init__(self, size: tuple[int, int], unknowns: Unknowns) -> None:
        self._longer = max(size)
        self._usual = np.zeros(unknowns.count)
        self._usual[1:3] = (size[0] - 1) / 2, (size[1] - 1) / 2
        spreads = np.full(unknowns.count, math.inf)
        spreads[1:8] = LENS_SPREADS
        spreads[1:3] *= self._longer
        spreads[unknowns.print] = PRINT_SPREAD
        spreads[unknowns.print.stop : unknowns.zoom.start] = BEND_SPREAD
        spreads[unknowns.zoom] = ZOOM_SPREAD
        self._spreads = spreads

    def at(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the deviations of a state (m,), in sigmas, and their derivatives, (m,) each."""
        surprise, per = (state - self._usual) / self._spreads, 1 / self._spreads
        field = self._longer / state[0]
        surprise[0] = (field - USUAL_FIELD) / FIELD_SPREAD
        per[0] = -field / state[0] / FIELD_SPREAD
        return surprise, per
