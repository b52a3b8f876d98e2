"""Waits for the board in the pictures of a camera that tracks; then pixels are places on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from laptop.calibration.camera_fit import BadCalibration, Calibration, calibrate
from laptop.calibration.camera_report import describe
from laptop.vision.finders.board import BoardView, find_board

LOOK_PERIOD = 10
"""Pictures from one look to the next: a look takes as long as ten pictures' tracking."""
ENOUGH = 0.5
"""Share of the board's markers with which a picture is taken at once."""
PATIENCE = 5
"""Looks after which the best picture so far is taken."""


class BoardWatch:
    """Places markers on the board of one camera, once that was seen; see `pipeline.TablePlacer`.

    Args:
        bar: length of the printed bar as measured, mm, or None.
        heights: of markers over the table, cm, by name; others lie on it.
        name: of the camera.
        say: tells people a line.

    Attributes:
        calibration: of the camera, or None as long as the board was not seen.
    """

    def __init__(
        self,
        bar: float | None,
        heights: Mapping[str, float],
        name: str,
        say: Callable[[str], None],
    ) -> None:
        self.calibration: Calibration | None = None
        self._bar, self._heights, self._name, self._say = bar, heights, name, say
        self._pictures = 0
        self._looks = 0
        self._best: BoardView | None = None
        self._told: set[str] = set()

    def look(self, image: np.ndarray) -> None:
        """Look for the board in a picture (BGR, uint8), now and then, until it is seen."""
        if self.calibration:
            return
        self._pictures += 1
        if (self._pictures - 1) % LOOK_PERIOD:
            return
        view = find_board(image)
        if view and (self._best is None or len(view.numbers) > len(self._best.numbers)):
            self._best = view
        if self._best is None:
            return
        self._looks += 1
        if len(self._best.numbers) < ENOUGH * len(self._best.board.numbers):
            if self._looks < PATIENCE:
                return
            self._looks = 0
        try:
            self.calibration = calibrate([self._best], self._bar)
        except BadCalibration as problem:
            self._best = None
            self._tell(f"no place on the board yet: {problem}")
            return
        for line in describe(self.calibration):
            self._tell(line)

    def place(self, marker: str, pixel: tuple[float, float]) -> tuple[float, float] | None:
        """Return where on the board a marker is, (x, y), cm; None if that is not known.

        Args:
            marker: its name.
            pixel: of its centre, (u, v).
        """
        if self.calibration is None:
            return None
        height = self._heights.get(marker, 0.0)
        x, y = self.calibration.camera.to_table(np.array([pixel]), height)[0]
        return (float(x), float(y)) if np.isfinite(x) else None

    def _tell(self, line: str) -> None:
        if line not in self._told:
            self._told.add(line)
            self._say(f"camera {self._name}: {line}")
