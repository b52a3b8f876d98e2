"""Pixels that touch become chains.  Pure."""

from __future__ import annotations

import numpy as np

Pixel = tuple[int, int]
"""A pixel's column and row, (x, y)."""

AROUND = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1))
"""Steps to the neighbours of a pixel, in the order of preference."""


class Pixels:
    """The pixels of a mask (height, width) that are in no chain yet.

    Attributes:
        left: these.
    """

    def __init__(self, mask: np.ndarray) -> None:
        self.left = {(int(x), int(y)) for y, x in np.argwhere(mask)}

    def walk(self, pixel: Pixel) -> list[Pixel]:
        """Take away and return what follows a pixel, from neighbour to neighbour."""
        path: list[Pixel] = []
        while True:
            x, y = pixel
            ahead = next(
                ((x + dx, y + dy) for dx, dy in AROUND if (x + dx, y + dy) in self.left), None
            )
            if ahead is None:
                return path
            self.left.remove(ahead)
            path.append(ahead)
            pixel = ahead
