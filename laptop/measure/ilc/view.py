"""From the marker's pixels to the tip of the pen, in the arm's own frame.  Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from laptop.see.table.marker_offset import turned
from laptop.see.table.plane_motion import nearest_motion


class TableCamera(Protocol):
    """Camera that maps pixels to places over the table; a calibration's CameraModel does."""

    def to_table(self, pixels: np.ndarray, height: float | np.ndarray = 0.0) -> np.ndarray:
        """Places (n, 2), cm, of pixels (n, 2) at a height, cm; nan where there is none."""
        ...


@dataclass(frozen=True, eq=False)
class TipView:
    """A camera over the table on which the arm stands.

    camera  its places are of the board
    height  of the marker over the table, cm
    offset  of the marker from the pen, in the last link's frame, (x, y), cm
    turn    of the arm's x from the board's, rad
    base    the arm's origin on the board, (x, y), cm
    to_align  turn and base are not known: see `aligned`
    """

    camera: TableCamera
    height: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    base: tuple[float, float] = (0.0, 0.0)
    to_align: bool = False

    def tips(self, pixels: np.ndarray, headings: np.ndarray) -> np.ndarray:
        """Return where the pen is in the arm's frame, (n, 2), cm; nan where it was not seen.

        Args:
            pixels: of the marker, (n, 2).
            headings: of the last link in the arm's frame, (n,), rad.
        """
        c, s = np.cos(self.turn), np.sin(self.turn)
        board = self.camera.to_table(pixels, self.height) - np.array(self.base)
        markers = board @ np.array([[c, -s], [s, c]])
        return np.asarray(markers - turned(headings, self.offset))

    def aligned(self, pixels: np.ndarray, headings: np.ndarray, p: np.ndarray) -> TipView:
        """Return the view in which what was seen lies best on where the pen was to be.

        So shape and size of the error are measured, and not where all of it lies.

        Args:
            pixels: of the marker, (n, 2).
            headings: of the last link in the arm's frame, (n,), rad.
            p: where the pen was to be, in the arm's frame, (n, 2), cm.
        """
        desired = p + turned(headings, self.offset)
        board = self.camera.to_table(pixels, self.height)
        seen = np.isfinite(board).all(axis=1)
        turn, base = nearest_motion(desired[seen], board[seen])
        return replace(self, turn=turn, base=base, to_align=False)
