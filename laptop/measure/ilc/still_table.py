"""Looks after every job whether the camera still sees the board where it was."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from laptop.measure.run_data import BadMeasurement, MeasuringRig, RunData
from laptop.see.markers.finders.board import find_board
from laptop.see.table.camera_fit import Calibration
from laptop.see.table.camera_report import shift_since

MIN_BOARD_MARKERS = 2
"""Fewest of the board's markers from which a move of the board is judged."""


class StillTable:
    """A rig before a camera and a board that have to stay where they are.

    Args:
        rig: that does the jobs.
        calibration: of its camera; a board that is seen has to lie as it says.
        image: gives the camera's newest picture, BGR.
        since: what the calibration is of, for people.
    """

    def __init__(
        self,
        rig: MeasuringRig,
        calibration: Calibration,
        image: Callable[[], np.ndarray],
        since: str,
    ) -> None:
        self.arm = rig.arm
        self._rig, self._calibration = rig, calibration
        self._image, self._since = image, since

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Do a job as MeasuringRig.measure does.

        Raises:
            BadMeasurement: the board or the camera has moved meanwhile.
        """
        run = self._rig.measure(job, dry)
        self.check()
        return run

    def check(self) -> None:
        """Look where the board is now; where it is covered nobody knows.

        Raises:
            BadMeasurement: it is elsewhere in the picture.
        """
        view = find_board(self._image())
        if view is None or len(view.numbers) < MIN_BOARD_MARKERS:
            return
        shift = shift_since(self._calibration, view)
        if shift.moved:
            raise BadMeasurement(
                f"the board or the camera has moved by {shift.mm:.1f} mm since {self._since}: lay "
                "the board where it stays, fix the camera, and begin anew"
            )
