"""Mapping of the paper into a camera's picture, by a printed board that lies on the table.

The board tells where pixels are on the table, cm, at any height; but not where on it the arm
stands.  That the tip's own moves tell: a turn and a shift bring the places of its marker on the
board to where the joints say that the marker is (Kabsch 1976).  If nobody has told how high the
marker is, its height is found along with them: too high a one makes its ways too short.  Pure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from laptop.page.paper_below import HEIGHT_SIGMA
from laptop.page.table_mapping import CELL_SIZE, MAX_PLACES, TableView
from laptop.see.serve.pipeline import Point
from laptop.see.table.marker_offset import HEIGHT_SPREAD, USUAL_HEIGHT
from laptop.see.table.plane_motion import PlaneMotion, nearest_motion, rotation

MIN_PLACES = 4
"""Fewest places from which their misfit can be judged."""
MIN_PLACES_FOR_HEIGHT = 12
"""Fewest places from which the marker's height can be judged as well."""
MIN_SPREAD = 2.0
"""Least spread of these about their middle, RMS, cm."""
MAX_MISFIT = 0.8
"""Greatest misfit of places, cm (RMS): worse ones are of another arm, or of a marker at another
height."""
SCALE_SPREAD = 0.005
"""Standard deviation of how much longer links are than their file has them, as a share."""
MAX_HEIGHT_SIGMA = 0.6
"""Greatest standard deviation of a height that is believed, cm."""
MIN_MISFIT = 0.02
"""Least misfit that places can have, cm: none are better."""
SIGMA_PASSES = 3
"""Number of fits of a height, each with the misfit of places that the last one shows."""
GRID_SIZE = 6
"""Number of pixels in each direction that give the paper's homography."""
GRID_MARGIN = 60.0
"""Margin of that grid around the pixels of the marker, px."""

PlaceAt = Callable[[Point, float], Point | None]
"""Function from a pixel and a height over the table, cm, to the place on the board, cm; None:
unknown."""

_Grid = tuple[list[Point], list[Point]]
"""Pixels, and where on the board they are, cm."""


class _Pair(NamedTuple):
    """A place of the marker.

    speed  of it in the picture, px/s
    pixel  (2,)
    low    where on the board it would be if it lay on the table, (2,), cm
    slope  by how much that is elsewhere per cm of height, (2,)
    arm    where the joints say that it is, (2,), cm
    """

    speed: float
    pixel: np.ndarray
    low: np.ndarray
    slope: np.ndarray
    arm: np.ndarray


class BoardMapping:
    """Learns where the arm stands on the board, and how high its marker is.

    Args:
        place_at: of the camera.

    Attributes:
        view: of the paper, or None while it is not known.
        height: of the marker over the paper, cm, told or found; None: it is not known.
        height_sigma: of one that was found, cm.
    """

    def __init__(self, place_at: PlaceAt) -> None:
        self._place_at = place_at
        self._pairs: dict[tuple[int, ...], _Pair] = {}
        self._given_height: float | None = None  # cm
        self._size = (0, 0)  # of the picture, px
        self._grids: dict[tuple[float, ...], _Grid] = {}  # by their corners
        self._from_board: PlaneMotion | None = None
        self.forget()

    def forget(self) -> None:
        """Reset: the board, or the arm on it, has moved."""
        self._pairs.clear()
        self._grids.clear()
        self.view: TableView | None = None
        self._from_board = None
        self.height: float | None = self._given_height
        self.height_sigma = 0.0

    def lay_paper(self, height: float | None) -> None:
        """Set the marker's height over the paper, cm; None: to be estimated."""
        self._given_height = height
        self._fit()

    def pen(self, pixels: np.ndarray, shifts: np.ndarray) -> np.ndarray | None:
        """Return where in the arm's frame the pen was, (n, 2), cm; None: that is not known.

        Args:
            pixels: of the marker, (n, 2).
            shifts: from the pen to the marker, cm, (n, 2).
        """
        if self.view is None or self._from_board is None or self.height is None:
            return None
        places = [self._place_at((float(u), float(v)), self.height) for u, v in pixels]
        on_board = np.array([place or (math.nan, math.nan) for place in places])
        return np.asarray(self._from_board.moved(on_board) - shifts[:, :2])

    def add(self, p: Sequence[float], pixel: Point, speed: float, size: tuple[int, int]) -> None:
        """Add a pair: the marker's place p (x, y), cm, and its pixel (u, v) at that time.

        Args:
            p: cm.
            pixel: px.
            speed: of the marker in the picture, px/s: of one place the slowest is believed.
            size: of the picture, px.
        """
        if len(p) != 2:
            return
        low, high = (self._place_at(pixel, height) for height in (0.0, 1.0))
        if low is None or high is None:
            return
        key = tuple(math.floor(x / CELL_SIZE) for x in p)
        known = self._pairs.get(key)
        if (known is None and len(self._pairs) < MAX_PLACES) or (known and speed <= known.speed):
            self._pairs[key] = _Pair(
                speed,
                np.array(pixel),
                np.array(low),
                np.array(high) - low,
                np.array(p, float),
            )
            self._size = size
            self._fit()

    def _fit(self) -> None:
        self.view = self._from_board = None
        self.height, self.height_sigma = self._given_height, 0.0
        if len(self._pairs) < MIN_PLACES:
            return
        low, slope, arm = (
            np.array([getattr(pair, name) for pair in self._pairs.values()])
            for name in ("low", "slope", "arm")
        )
        if math.sqrt((np.var(low, axis=0)).sum()) < MIN_SPREAD:
            return
        sigma = HEIGHT_SIGMA
        if self._given_height is None:
            if len(low) < MIN_PLACES_FOR_HEIGHT:
                return
            self.height, self.height_sigma = marker_height(low, slope, arm)
            sigma = self.height_sigma
            if sigma > MAX_HEIGHT_SIGMA:
                self.height = None
        if self.height is None:
            return
        board = low + self.height * slope
        motion = nearest_motion(board, arm)
        misfit = math.sqrt(np.mean(np.sum((motion.moved(board) - arm) ** 2, axis=1)))
        matrix = None if misfit > MAX_MISFIT else self._homography(motion)
        if matrix is not None:
            unsure = sigma * float(np.hypot(*slope.mean(axis=0)))
            source = "the board on the table"
            self._from_board = motion
            self.view = TableView(
                matrix, len(board), 10 * math.hypot(misfit, unsure), source, is_paper=True
            )

    def _homography(self, from_board: PlaneMotion) -> np.ndarray | None:
        """Return the matrix from the arm's places on the paper to pixels, about where it moves."""
        seen = np.array([pair.pixel for pair in self._pairs.values()])
        low = np.maximum(np.floor(seen.min(axis=0) / GRID_MARGIN - 1) * GRID_MARGIN, 0)
        high = np.ceil(seen.max(axis=0) / GRID_MARGIN + 1) * GRID_MARGIN
        corners = (*low, *np.minimum(high, np.array(self._size) - 1))
        if corners not in self._grids:  # to ask for each takes a while, and it stays the same
            self._grids = {corners: self._grid(*corners)}
        pixels, points = self._grids[corners]
        if len(points) < 8:
            return None
        matrix, _ = cv2.findHomography(from_board.moved(np.array(points)), np.array(pixels))
        return None if matrix is None else np.asarray(matrix / matrix[2, 2])

    def _grid(self, left: float, top: float, right: float, bottom: float) -> _Grid:
        """Return pixels (n, 2) between these, and where on the board they are (n, 2), cm."""
        asked = [(float(u), float(v)) for u in np.linspace(left, right, GRID_SIZE)
                 for v in np.linspace(top, bottom, GRID_SIZE)]  # fmt: skip
        found = [(pixel, place) for pixel in asked if (place := self._place_at(pixel, 0.0))]
        return [pixel for pixel, _ in found], [place for _, place in found]


def marker_height(low: np.ndarray, slope: np.ndarray, arm: np.ndarray) -> tuple[float, float]:
    """Return the height of a marker over the table, and its standard deviation, cm.

    Args:
        low: where on the board it would be if it lay there, (n, 2), cm.
        slope: by how much that is elsewhere per cm of height, (n, 2).
        arm: where the joints say that it is, (n, 2), cm.
    """
    first, shift = nearest_motion(low + USUAL_HEIGHT * slope, arm)
    state = np.array([first, *shift, USUAL_HEIGHT, 0.0])
    sigma = MIN_MISFIT
    for _ in range(SIGMA_PASSES):
        fit = least_squares(_height_residuals, state, method="lm", args=(low, slope, arm, sigma))
        state = fit.x
        # How far places are off is seen only when they are fitted.
        sigma = max(MIN_MISFIT, sigma * math.sqrt(float(np.mean(fit.fun[:-2] ** 2))))
    return float(state[3]), math.sqrt(float(np.linalg.inv(fit.jac.T @ fit.jac)[3, 3]))


def _height_residuals(
    state: np.ndarray, low: np.ndarray, slope: np.ndarray, arm: np.ndarray, sigma: float
) -> np.ndarray:
    """Return the residuals (2 n + 2,), in standard deviations; the last two are the priors'.

    Args:
        state: turn, rad, shift (2), cm, height, cm, and by what share links are longer.
        low: as in `marker_height`.
        slope: likewise.
        arm: likewise.
        sigma: of places, cm.
    """
    turn, shift, height, longer = state[0], state[1:3], state[3], state[4]
    off = (1 + longer) * (low + height * slope) @ rotation(turn).T + shift - arm
    priors = [(height - USUAL_HEIGHT) / HEIGHT_SPREAD, longer / SCALE_SPREAD]
    return np.concatenate([off.ravel() / sigma, priors])
