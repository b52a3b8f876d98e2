"""The printed board: a sheet of paper with a frame of ArUco markers and nine crosses to touch.

Its own frame: cm, the origin in the middle of the paper (cross 5), x right, y up the page, z out of
the paper towards who reads it.  The markers are 50 to 99 of DICT_4X4_100, which stay two wrong bits
away from the 50 of DICT_4X4_50 that people stick on an arm.  Their numbers say the paper's size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

DICTIONARY = cv2.aruco.DICT_4X4_100
MARKER = 2.5
"""Side of a marker's black square, cm."""
MARGIN = 1.0
"""Distance of the markers from the paper's edge, cm: the printer's margin, and their white rim."""
BAR = 10.0
"""Length of the scale bar, cm."""
BAR_AT = -9.2
"""The scale bar's y, cm."""
CROSSES = np.array([(x, y) for y in (7.5, 0.0, -7.5) for x in (-5.0, 0.0, 5.0)])
"""Places of crosses 1 to 9, (9, 2), cm: read like a page."""
CROSS_ARM = 0.5
"""Length of a cross's arms, cm."""


@dataclass(frozen=True)
class Board:
    """One size of paper.

    paper    its name
    width, height  cm
    columns, rows  markers along its sides
    first    number of the first marker
    """

    paper: str
    width: float
    height: float
    columns: int
    rows: int
    first: int

    @cached_property
    def centres(self) -> np.ndarray:
        """Centres of the markers in order of their numbers, like a page: (n, 2), cm."""
        half = np.array([self.width, self.height]) / 2 - MARGIN - MARKER / 2
        x = np.linspace(-half[0], half[0], self.columns)
        y = np.linspace(half[1], -half[1], self.rows)
        rim = (0, self.rows - 1), (0, self.columns - 1)
        return np.array(
            [
                (x[column], y[row])
                for row in range(self.rows)
                for column in range(self.columns)
                if row in rim[0] or column in rim[1]
            ]
        )

    @property
    def numbers(self) -> range:
        """Numbers of its markers."""
        return range(self.first, self.first + len(self.centres))

    def square(self, number: int, share: float = 1.0) -> np.ndarray:
        """Return the corners of a marker, the detector's order from the top left: (4, 3), cm.

        Args:
            number: the marker's.
            share: of the way from its middle to its corners.
        """
        half = share * MARKER / 2
        around = half * np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)])
        return np.column_stack([self.centres[number - self.first] + around, np.zeros(4)])

    @property
    def middle(self) -> tuple[float, float]:
        """Width and height of what is free for drawing in the middle, cm."""
        frame = 2 * (MARGIN + MARKER + MARKER / 6)
        return self.width - frame, self.height - frame


BOARDS = {
    "a4": Board("a4", 21.0, 29.7, 6, 9, 50),
    "letter": Board("letter", 21.59, 27.94, 6, 8, 76),
}
"""Boards by the paper's name."""
