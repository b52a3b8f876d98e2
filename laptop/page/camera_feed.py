"""One camera as the page sees it: cached frames, their markers, the trail of the tip."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Protocol

import cv2
import numpy as np

from laptop.page.snapshots import HISTORY_DURATION, SAMPLE_PERIOD, MarkerSnapshot
from laptop.see.camera.frames import Frame
from laptop.see.camera.stills import Stills
from laptop.see.markers.finders.other_codes import PRINT
from laptop.see.markers.markers import Marker, hsv_mask
from laptop.see.markers.view import AnnotatedFrame
from laptop.see.serve.pipeline import CameraPipeline, Point
from shared.arm_description import ArmError
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

HEARTBEAT_PERIOD = 0.05
"""Time between two heartbeats of the page's controller, s."""
RECENT_FRAMES = 64
"""Number of frames of each camera that stay at hand after they were given out, so that one can pick
in them: those of some seconds, for a browser that is late."""
PINNED_FRAMES = 4
"""Number of frames of each camera that stay at hand because somebody has paused there."""
CACHED_STILLS = 8
"""Number of frames of a recording that stay at hand; others are read again."""
TRAIL_SPACING = 2.0
"""Least distance between two points of the tip's trail, px."""
RATE_WINDOW = 2.0
"""Time over which the frame rate is measured, s."""
JPEG_QUALITY = 80
"""Quality of the pictures that browsers get, of 100."""
LOST_ADVICE = {
    "several alike": "cover the others, or pick this one's colour anew",
    "nothing of this colour is a disc": "turn it to the camera, uncover it, or pick it anew",
    "nothing of this colour is a ball": "uncover it, or pick it anew",
    "only a much larger one": "take that away, or pick this one anew if it has come nearer",
    "only a much smaller one": "take that away, or pick this one anew if it has gone farther",
    "no colours in the picture": "bring it into the picture; if the camera is grey, track aruco:ID",
    "too dark": "give more light, or a longer exposure",
    "nothing of this colour": "bring it into the picture, or pick it anew: the light may differ",
}
"""Advice for people about a marker that is lost, by the tracker's reason."""


class MarkerTracker(Protocol):
    """Part of a tracker that the page uses: the markers, which can be replaced."""

    markers: tuple[Marker, ...]


class FrameGone(ArmError):
    """A frame that is no longer cached."""


class CameraFeed:
    """Cache of one camera's frames.

    Args:
        watcher: of the camera.
        tracker: finds the markers in its frames.
        source: the camera's name for people.

    Attributes:
        given: frames that were given out lately.
        pinned: frames that somebody has paused at.
        trail: (s, (u, v) px) where the tip has been lately.
        rate: frames per second.
    """

    def __init__(self, watcher: CameraPipeline, tracker: MarkerTracker, source: str) -> None:
        self.watcher = watcher
        self.tracker = tracker
        self.source = source
        self.given: deque[AnnotatedFrame] = deque(maxlen=RECENT_FRAMES)
        self.pinned: deque[AnnotatedFrame] = deque(maxlen=PINNED_FRAMES)
        self._encoded: tuple[int, bytes] | None = None
        self.trail: deque[tuple[float, Point]] = deque(
            maxlen=round(HISTORY_DURATION / HEARTBEAT_PERIOD)
        )
        self._counts: deque[tuple[float, int]] = deque(maxlen=round(RATE_WINDOW / SAMPLE_PERIOD))
        self.rate = 0.0
        self._reel: Stills | None = None
        self._stills: deque[Frame] = deque(maxlen=CACHED_STILLS)
        self._lock = threading.Lock()  # of these two

    @property
    def frames(self) -> int:
        """Number of frames of a recording, each of which can be read again; 0: it is none.

        Until it has ended once this may be a guess.
        """
        # (What lies on a server would all have to be fetched again.)
        count = getattr(self.watcher.camera, "count", None)
        return 0 if "://" in self.source else count or 0

    def extend_trail(self) -> None:
        """Add the tip's position in the newest frame to the trail."""
        view = self.watcher.view
        seen = view and view.found.get(EFFECTOR)
        if view and seen and seen.confidence >= LEAST_CONFIDENCE:
            where = seen.u, seen.v
            if not self.trail or math.dist(self.trail[-1][1], where) >= TRAIL_SPACING:
                self.trail.append((view.frame.t, where))

    def update_rate(self, now: float) -> None:
        """Measure the frame rate up to now (s)."""
        self._counts.append((now, self.watcher.frames))
        before, frames = self._counts[0]
        self.rate = (self.watcher.frames - frames) / (now - before) if now > before else 0.0

    def find(self, index: int) -> AnnotatedFrame:
        """Return a frame that was given out, by its index.

        Raises:
            FrameGone: that was too long ago.
        """
        for view in (*self.pinned, *self.given):
            if view.frame.index == index:
                return view
        raise FrameGone("this picture is too old; click into a newer one, or pause first")

    def frame(self, index: int) -> Frame:
        """Return a frame that was given out, or any of a recording, by its index.

        Raises:
            ArmError: the frame cannot be had.
        """
        try:
            return self.find(index).frame
        except FrameGone:
            if not self.frames:
                raise
        with self._lock:
            for still in self._stills:
                if still.index == index:
                    return still
            return self._read(index)

    def _read(self, index: int) -> Frame:
        """Read a frame from the recording, which is opened a second time."""
        if not 0 <= index < self.frames:
            raise FrameGone(f"frame {index}: {self.source} has frames 0 to {self.frames - 1}")
        camera = self.watcher.camera
        self._reel = self._reel or Stills(self.source)
        image = self._reel.read(index)
        if image is None:
            raise FrameGone(f"frame {index} of {self.source} cannot be read; take another one")
        # Its time on the clock of those that were tracked.
        t = 0.0
        if (view := self.watcher.view) and camera.fps:
            t = view.frame.t + (index - view.frame.index) / camera.fps
        self._stills.append(Frame(index, t, image))
        return self._stills[-1]

    def jpeg(self, view: AnnotatedFrame) -> bytes:
        """Return a frame as JPEG; it is encoded once, however many ask."""
        encoded = self._encoded
        if encoded is None or encoded[0] != view.frame.index:
            _, data = cv2.imencode(
                ".jpg", view.frame.image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY)
            )
            self._encoded = encoded = view.frame.index, data.tobytes()
        return encoded[1]


def marks(view: AnnotatedFrame) -> list[MarkerSnapshot]:
    """Return the markers of a frame, and the fixed goal."""
    marks = []
    for name, seen in view.found.items():
        window = view.windows.get(name)
        if seen is None:
            why = view.why.get(name) or "not seen"
            marks.append(MarkerSnapshot(name, None, None, None, 0.0, why, _advice(why), window))
        else:
            why = view.why.get(name) or ("doubtful" if seen.confidence < LEAST_CONFIDENCE else "")
            u, v, confidence, radius = seen
            advice, place = _advice(why), view.places.get(name)
            marks.append(MarkerSnapshot(name, u, v, radius, confidence, why, advice, window, place))
    for name, (u, v, _) in view.fixed.items():
        place = view.places.get(name)
        marks.append(MarkerSnapshot(name, u, v, None, None, "", "", None, place))
    return marks


def _advice(why: str) -> str:
    if why.startswith("no ArUco"):
        if why.endswith(PRINT):
            return ""
        return "bring it into the picture, all of its white border, too"
    if why == "doubtful":
        return "something else may look like it; pick its colour anew"
    return LOST_ADVICE.get(why, "")


def mask(image: np.ndarray, marker: Marker) -> bytes:
    """Return a PNG, magenta where a frame has the marker's colour, transparent elsewhere.

    Args:
        image: BGR, height x width x 3.
        marker: one with a colour.
    """
    assert marker.color is not None
    inside = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), marker.color)
    layer = np.full((*inside.shape, 4), (255, 60, 255, 0), np.uint8)
    layer[..., 3] = inside
    _, data = cv2.imencode(".png", layer, (cv2.IMWRITE_PNG_COMPRESSION, 1))
    return data.tobytes()
