"""Alignment of a square code with the picture: a homography over all of its cells.

The detector's corners are where two edges of a few pixels cross, each some hundredths of a pixel
off.  The edges of all cells together tell ten times as much.  So the printed pattern is aligned
with the picture, by the inverse compositional algorithm (see `_iterate`), with gain, offset and a
slope of the light as linear unknowns beside it.  What does not depend on the picture is done once a
code.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

CELLS = 6
"""Number of cells along a side: four bits and the black border."""
RIM_CELLS = 0.5
"""Width of the white rim that belongs to the pattern, cells: half of what is printed."""
BLUR_SIGMA = 0.8
"""Sigma of lens, pixel and interpolation together, px."""
CELL_SIZES = (2, 12)
"""Least and greatest number of samples along a cell; about one a pixel."""
MAX_STEPS = 8
CONVERGED_SHIFT = 0.002
"""Greatest motion of a corner at which the iteration has converged, px."""
MAX_SHIFT = 0.1
"""Greatest distance of a corner from the detector's, in sides; beyond, the detector's counts."""
MIN_LIKENESS = 0.7
"""Correlation of pattern and picture below which the detector's corners count."""

LIGHT = np.array(
    [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.arange(256) / 255],
    np.float32,
)
"""Linear light (0 to 1) of a grey value, as IEC 61966-2-1 encodes it. Blur is linear in light. In
encoded values the black cells would look too small."""


class Pattern(NamedTuple):
    """The pattern of one code, ready to be aligned with a picture.

    sampling  (3, 3), from samples to the square -1 .. 1 (y down) of the code
    size      samples along a side, with the rim
    solver    (12, size^2): pixels -> gain, offset, slope of the light (2) and homography (8)
    values    (size^2,), the pattern without its mean, of length 1
    """

    sampling: np.ndarray
    size: int
    solver: np.ndarray
    values: np.ndarray


def align(
    grey: np.ndarray, corners: np.ndarray, code: int, dictionary: int = cv2.aruco.DICT_4X4_100
) -> tuple[np.ndarray, bool]:
    """Align a code's pattern with the picture, from the corners that the detector gives.

    Args:
        grey: uint8, (height, width).
        corners: px, (4, 2), in the detector's order, from the code's top left.
        code: its number.
        dictionary: of 4 x 4 bits, OpenCV's number.

    Returns:
        Homography (3, 3) from the code's square (-1 .. 1, y down) to px; and False if the pattern
        did not fit there: then it is that of the detector's corners alone.
    """
    first = _homography(corners)
    side = math.sqrt(abs(cv2.contourArea(corners.astype(np.float32))))
    # A sample covers a pixel; of a large code, one of a picture that is smaller by a whole factor.
    factor = max(1, math.ceil(side / CELLS / CELL_SIZES[1]))
    pixels = max(side / factor / CELLS, 1.0)
    cell = int(np.clip(round(pixels), *CELL_SIZES))
    pattern = _pattern(code, dictionary, cell, round(BLUR_SIGMA * cell / pixels, 1))
    window = _light_around(grey, corners, side, factor)
    if window is None:
        return first, False
    light, shrink = window
    fitted = _iterate(light, shrink @ first, pattern, side / factor)
    if fitted is None:
        return first, False
    now, seen = fitted
    deviation = seen - seen.mean()
    likeness = float(deviation @ pattern.values / max(np.linalg.norm(deviation), 1e-9))
    now = np.linalg.inv(shrink) @ now
    if likeness < MIN_LIKENESS or np.abs(_corners(now) - corners).max() > MAX_SHIFT * side + 1:
        return first, False
    return now, True


def _light_around(
    grey: np.ndarray, corners: np.ndarray, side: float, factor: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the linear light around a code, and the map (3, 3) from the picture's px to its own.

    Args:
        grey: uint8, (height, width).
        corners: of the code, px, (4, 2).
        side: of the code, px.
        factor: by which the light is made smaller, a whole number.

    Returns:
        None where hardly anything of it is in the picture.
    """
    height, width = grey.shape
    low = np.floor(corners.min(axis=0) - 0.3 * side - 2).astype(int)
    left, top = (int(np.clip(x, 0, most)) for x, most in zip(low, (width, height), strict=True))
    right, bottom = np.ceil(corners.max(axis=0) + 0.3 * side + 2 + factor).astype(int)
    window = grey[top : max(bottom, 0), left : max(right, 0)]
    if min(window.shape) < 2 * factor:
        return None
    light = cv2.LUT(window, LIGHT)
    if factor > 1:
        rows, columns = (n // factor for n in window.shape)
        light = cv2.resize(
            light[: rows * factor, : columns * factor],
            (columns, rows),
            interpolation=cv2.INTER_AREA,
        )
    middle = (1 - factor) / 2  # of the smaller picture's first pixel, px of the large one
    shrink = np.array([[1, 0, -left + middle], [0, 1, -top + middle], [0, 0, factor]], float)
    return light, shrink


# Inverse compositional alignment (S. Baker and I. Matthews, "Lucas-Kanade 20 years on", IJCV 2004).
# Sought is the homography H for which the picture at H x looks like the pattern T at x, but for the
# light: I(H x) = g T(x) + o + s . x, with gain g, offset o and slope s.  Lucas and Kanade would add
# a step to H's numbers, and had to sample the picture's slopes anew in each iteration.  Here the
# step P moves the pattern instead: I(H x) = g T(P x) + o + s . x.  To first order in P's eight
# numbers p that is linear in (g, o, s, g p), and its matrix holds T and T's slopes alone: it is
# solved once a code (`_pattern`), so that an iteration is one resampling and one product with the
# (12, n) solver.  Then H <- H P^-1, as what moved the pattern forwards moves the picture backwards.
# Blur and brightness need no search of their own; refining the outline's corners alone would use
# the edges of four sides instead of those of all cells.
def _iterate(
    light: np.ndarray, start: np.ndarray, pattern: Pattern, max_move: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Move a pattern until it lies on the picture as it looks there.

    Args:
        light: linear, (height, width).
        start: homography (3, 3) from the code's square to px of `light`.
        pattern: the code's.
        max_move: greatest move of a corner in one iteration, px.

    Returns:
        The homography (3, 3) and the samples (size^2,) last seen; None if it gets lost.
    """
    now = start / start[2, 2]
    before = _corners(now)
    for _ in range(MAX_STEPS):
        seen = cv2.warpPerspective(
            light,
            now @ pattern.sampling,
            (pattern.size, pattern.size),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        ).ravel()
        fit = pattern.solver @ seen
        if fit[0] <= 0:
            return None
        step = np.append(fit[4:] / fit[0], 0.0).reshape(3, 3) + np.eye(3)
        now = now @ np.linalg.inv(step)
        now = now / now[2, 2]
        after = _corners(now)
        moved = float(np.abs(after - before).max())
        before = after
        if not moved < max_move:
            return None
        if moved < CONVERGED_SHIFT:
            break
    return now, seen


SQUARE = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
"""Corners of a code in the detector's order, (4, 2), y down."""


def _homography(corners: np.ndarray) -> np.ndarray:
    return np.asarray(
        cv2.getPerspectiveTransform(SQUARE.astype(np.float32), corners.astype(np.float32))
    )


def _corners(homography: np.ndarray) -> np.ndarray:
    return project(homography, SQUARE)


def project(homography: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Map points (n, 2) through a homography (3, 3): (n, 2)."""
    x = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(x[:, :2] / x[:, 2:])


def edge_blur(grey: np.ndarray, corners: np.ndarray) -> float:
    """Return the blur's sigma, px, from how steep a code's outline is.

    Args:
        grey: uint8, (height, width).
        corners: px, (4, 2).
    """
    cell = 2 / CELLS
    along, across = np.linspace(-0.8, 0.8, 33), 1 + cell * np.linspace(-0.7, 0.45, 24)
    a, b = (x.ravel() for x in np.meshgrid(along, across))
    edges = np.stack([(a, b), (a, -b), (b, a), (-b, a)])
    at = [project(_homography(corners), edge.T).astype(np.float32) for edge in edges]
    light = cv2.LUT(grey, LIGHT)
    profiles = [
        cv2.remap(
            light, place[:, 0], place[:, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        .reshape(len(across), len(along))
        .mean(axis=1)
        for place in at
    ]
    spacing = (
        (across[1] - across[0]) * np.sqrt(abs(cv2.contourArea(corners.astype(np.float32)))) / 2
    )
    steps = np.diff(np.array(profiles), axis=1)
    contrast = np.ptp(profiles, axis=1)
    steepest = np.maximum(steps.max(axis=1), 1e-9) / spacing
    return float(np.median(contrast / steepest) / math.sqrt(2 * math.pi))


SUPERSAMPLING = 8
"""Number of points of the drawn pattern along a sample."""


@lru_cache(maxsize=128)
def _pattern(code: int, dictionary: int, cell: int, blur: float) -> Pattern:
    """Draw a code and solve for it: `cell` samples a cell, with a blur of so many samples."""
    bits = cv2.aruco.generateImageMarker(
        cv2.aruco.getPredefinedDictionary(dictionary), code, CELLS, borderBits=1
    )
    bits = cv2.copyMakeBorder(bits, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(255.0,))
    fine = cell * SUPERSAMPLING
    sharp = np.kron(bits.astype(np.float32) / 255, np.ones((fine, fine), np.float32))
    drawn = cv2.GaussianBlur(sharp, (0, 0), blur * SUPERSAMPLING, borderType=cv2.BORDER_REPLICATE)
    size = round(cell * (CELLS + 2 * RIM_CELLS))
    # Between two fine points lies the middle of a sample: the mean of both sides.
    first = round((1 - RIM_CELLS) * fine) + SUPERSAMPLING // 2
    at = first + SUPERSAMPLING * np.arange(size)
    middle = (drawn[at - 1] + drawn[at]) / 2
    across = (drawn[:, at - 1] + drawn[:, at]) / 2
    values = (middle[:, at - 1] + middle[:, at]) / 2
    per_square = SUPERSAMPLING * cell * CELLS / 2  # fine points a unit of the square -1 .. 1
    slope_x = (middle[:, at] - middle[:, at - 1]) * per_square
    slope_y = (across[at] - across[at - 1]) * per_square
    # A sample's middle is its whole number, as a pixel's is.
    unit = 2 / (cell * CELLS)
    sampling = np.array([[unit, 0, 0], [0, unit, 0], [0, 0, 1]])
    sampling[:2, 2] = -1 - RIM_CELLS * 2 / CELLS + unit / 2
    x, y = np.meshgrid(*[unit * np.arange(size) + sampling[0, 2]] * 2)
    turned = x * slope_x + y * slope_y
    columns = [values, np.ones_like(values), x, y]
    columns += [x * slope_x, y * slope_x, slope_x, x * slope_y, y * slope_y, slope_y]
    columns += [-x * turned, -y * turned]
    matrix = np.stack([column.ravel() for column in columns], axis=1)
    matrix = matrix.astype(float)
    solver = np.linalg.solve(matrix.T @ matrix, matrix.T).astype(np.float32)
    deviation = values.ravel() - values.mean()
    return Pattern(sampling, size, solver, deviation / np.linalg.norm(deviation))
