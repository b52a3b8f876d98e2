"""Samples of the board and the arm's marker, in the pictures of one camera."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from laptop.see.camera.frames import Frame
from laptop.see.markers.finders.board import BoardView, find_board
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracker import Tracker
from laptop.see.table.camera_fit import BadCalibration, Calibration, calibrate
from shared.messages import LEAST_CONFIDENCE

MEDIAN_PICTURES = 5
"""Number of a live camera's pictures with the marker; the median place counts."""
MAX_REST_DISTANCE = 1.0
"""Greatest distance of a place from that median for a marker at rest, px."""
SURE_AFTER = 3
"""Number of times that the tracker gets the first picture until it confirms a marker."""
MAX_PICTURES = 30
"""Greatest number of pictures in which the board is sought, and that may fail."""
GOOD_SHARE = 0.75
"""Share of the board's markers with which a picture is taken at once."""


class PictureSource(Protocol):
    """As much of a camera as is used."""

    def read(self, timeout: float) -> Frame | None:
        """Return the next picture, or None if there is none within `timeout` s."""


class CrossSample(NamedTuple):
    """Marker and board as seen at one moment.

    pixel  of the marker's centre, (u, v), px; None: it is not seen, or moves
    why    it is not, for people; "" if it is
    view   of the board; None: no marker of it is seen
    """

    pixel: tuple[float, float] | None
    why: str
    view: BoardView | None


class CrossSampler:
    """Sampler of the marker and the board through one camera.

    Args:
        camera: gives the pictures.
        marker: that rides on the arm.
        live: whether the camera goes on by itself; else each look takes one picture.
    """

    def __init__(self, camera: PictureSource, marker: Marker, live: bool) -> None:
        self._camera, self._live = camera, live
        self._marker = marker

    def board(self, bar: float | None) -> Calibration:
        """Calibrate the camera by the board, in the best of some pictures.

        Raises:
            BadCalibration: it is not seen, or too little of it.
        """
        best: BoardView | None = None
        for _ in range(MAX_PICTURES if self._live else 1):
            frame = self._read()
            view = find_board(frame.image)
            if view and (best is None or len(view.numbers) > len(best.numbers)):
                best = view
            if best and len(best.numbers) >= GOOD_SHARE * len(best.board.numbers):
                break
        if best is None:
            raise BadCalibration(
                "the printed board is not seen: lay it flat under the camera, with light on it "
                "(print it by markers --board)"
            )
        return calibrate([best], bar)

    def sample(self) -> CrossSample:
        """Sample the present places of the marker and the board."""
        places, why = [], ""
        tracker, name = Tracker([self._marker]), self._marker.name  # it was elsewhere before
        for k in range(MEDIAN_PICTURES if self._live else 1):
            frame = self._read()
            for _ in range(SURE_AFTER if k == 0 else 1):
                seen = tracker.find(frame.image, frame.t)[name]
            if seen and seen.confidence >= LEAST_CONFIDENCE:
                places.append((seen.u, seen.v))
            else:
                why = tracker.why[name] or "too unsure"
        view = find_board(frame.image)
        if 2 * len(places) <= (MEDIAN_PICTURES if self._live else 1):
            return CrossSample(None, f"the arm's marker is not seen ({why})", view)
        middle = np.median(places, axis=0)
        if np.linalg.norm(places - middle, axis=1).max() > MAX_REST_DISTANCE:
            return CrossSample(None, "the arm's marker moves in the picture", view)
        return CrossSample((float(middle[0]), float(middle[1])), "", view)

    def _read(self) -> Frame:
        for _ in range(MAX_PICTURES):
            frame = self._camera.read(0.5)
            if frame is not None:
                return frame
            if getattr(self._camera, "ended", False):
                break
        raise BadCalibration(
            "there are no more pictures: plug the camera in anew"
            if self._live
            else "there are fewer pictures than touches: the first shows the board, then one each"
        )
