"""Where the paper is in a camera's picture, by a printed board that lies on the table.

The board tells where pixels are on the table, cm, at any height; but not where on it the arm
stands.  That the tip's own moves tell: a turn and a shift bring the places of its marker on the
board to where the joints say that the marker is (Kabsch 1976).  Pure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from laptop.page.table_mapping import CELL, MAX_PLACES, TableView
from laptop.see.serve.pipeline import Point

MIN_PLACES = 4
"""Fewer do not tell how well they fit."""
MIN_SPREAD = 2.0
"""Of these from their middle, RMS, cm."""
MAX_MISFIT = 0.8
"""Places that fit worse, cm (RMS), are of another arm, or of a marker at another height."""
GRID = 6
"""So many pixels in each direction give the paper's homography."""

Place = Callable[[str, Point], Point | None]
"""From a marker's name and pixel to its place on the board, cm; names that are not known lie on the
table.  None: it is not known."""


class BoardMapping:
    """Learns where the arm stands on the board.

    Args:
        place: of the camera.
        marker: name of the tip's.

    Attributes:
        view: of the paper, or None while it is not known.
    """

    def __init__(self, place: Place, marker: str) -> None:
        self._place, self._marker = place, marker
        self._pairs: dict[tuple[int, ...], tuple[float, np.ndarray, np.ndarray]] = {}
        self._stand: tuple[np.ndarray, np.ndarray] | None = None
        self.view: TableView | None = None

    def forget(self) -> None:
        """Begin anew: the board, or the arm on it, stands elsewhere now."""
        self._pairs.clear()
        self.view = self._stand = None

    def pen(self, pixels: np.ndarray, shifts: np.ndarray) -> np.ndarray | None:
        """Return where in the arm's frame the pen was, (n, 2), cm; None: that is not known.

        Args:
            pixels: of the marker, (n, 2).
            shifts: from the pen to the marker, cm, (n, 2).
        """
        if self.view is None or self._stand is None:
            return None
        turn, shift = self._stand
        places = [self._place(self._marker, (float(u), float(v))) for u, v in pixels]
        on_board = np.array([place or (math.nan, math.nan) for place in places])
        return np.asarray(on_board @ turn.T + shift - shifts[:, :2])

    def add(self, p: Sequence[float], pixel: Point, speed: float, size: tuple[int, int]) -> None:
        """Take in that the marker was at p (x, y), cm, and at a pixel (u, v) at once.

        Args:
            p: cm.
            pixel: px.
            speed: of the marker in the picture, px/s: of one place the slowest is believed.
            size: of the picture, px.
        """
        on_board = self._place(self._marker, pixel)
        if on_board is None or len(p) != 2:
            return
        key = tuple(math.floor(x / CELL) for x in p)
        known = self._pairs.get(key)
        if (known is None and len(self._pairs) < MAX_PLACES) or (known and speed <= known[0]):
            self._pairs[key] = speed, np.array(on_board), np.array(p, float)
            self._fit(size)

    def _fit(self, size: tuple[int, int]) -> None:
        board = np.array([one for _, one, _ in self._pairs.values()])
        arm = np.array([other for _, _, other in self._pairs.values()])
        self.view = self._stand = None
        if len(board) < MIN_PLACES or math.sqrt((np.var(board, axis=0)).sum()) < MIN_SPREAD:
            return
        turn, shift = rigid(board, arm)
        misfit = math.sqrt(np.mean(np.sum((board @ turn.T + shift - arm) ** 2, axis=1)))
        if misfit > MAX_MISFIT:
            return
        pixels, points = [], []
        for u in np.linspace(0, size[0] - 1, GRID):
            for v in np.linspace(0, size[1] - 1, GRID):
                if (paper := self._place("", (float(u), float(v)))) is not None:
                    pixels.append((u, v))
                    points.append(paper)
        if len(points) < 8:
            return
        matrix, _ = cv2.findHomography(np.array(points) @ turn.T + shift, np.array(pixels))
        if matrix is not None:
            source = "the board on the table"
            self._stand = turn, shift
            self.view = TableView(matrix / matrix[2, 2], len(board), 10 * misfit, source)


def rigid(points: np.ndarray, goals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return turn (2, 2) and shift (2,) that bring points (n, 2) nearest to goals (n, 2)."""
    middle, goal = points.mean(axis=0), goals.mean(axis=0)
    u, _, vt = np.linalg.svd((points - middle).T @ (goals - goal))
    flip = np.diag([1.0, np.linalg.det(vt.T @ u.T)])
    turn = vt.T @ flip @ u.T
    return turn, goal - turn @ middle
