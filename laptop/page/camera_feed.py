"""One camera as a page sees it: its pictures at hand, its markers, its tip's trail."""

from __future__ import annotations

import math
import threading
from collections import deque
from typing import Protocol

import cv2
import numpy as np

from laptop.page.snapshots import HISTORY, SAMPLE, Mark
from laptop.tracking.pipeline import CameraPipeline, Point
from laptop.vision.frames import Frame
from laptop.vision.markers import Marker, hsv_mask
from laptop.vision.stills import Stills
from laptop.vision.view import AnnotatedFrame
from shared.arm_description import ArmError
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

BEAT = 0.05
"""Between two looks at what goes on, s."""
KEPT = 64
"""Pictures of each camera that stay at hand after they were given out, so that one can pick: those
of some seconds, for a browser that is late."""
PINNED = 4
"""Of each camera, pictures that are paused at."""
STILLS = 8
"""Frames of a recording that stay at hand; others are read again."""
FINEST = 2.0
"""The tip's trail goes on where it has moved so far, px."""
QUALITY = 80
"""Of a JPEG."""
ADVICE = {
    "several alike": "cover the others, or pick this one's colour anew",
    "nothing of this colour is a disc": "turn it to the camera, uncover it, or pick it anew",
    "nothing of this colour is a ball": "uncover it, or pick it anew",
    "too dark": "give more light, or a longer exposure",
    "nothing of this colour": "bring it into the picture, or pick it anew: the light may differ",
}
"""What to do about a marker that is lost, by the tracker's reason."""


class Finder(Protocol):
    """What is used of a tracker."""

    markers: tuple[Marker, ...]


class PictureGone(ArmError):
    """A picture that is no longer at hand."""


class CameraFeed:
    """A watcher, its tracker, and what the desk keeps of them."""

    def __init__(self, watcher: CameraPipeline, tracker: Finder, source: str) -> None:
        self.watcher = watcher
        self.tracker = tracker
        self.source = source
        self.given: deque[AnnotatedFrame] = deque(maxlen=KEPT)
        self.pinned: deque[AnnotatedFrame] = deque(maxlen=PINNED)
        self.encoded: tuple[int, bytes] | None = None
        self.trail: deque[tuple[float, Point]] = deque(maxlen=round(HISTORY / BEAT))
        self.counts: deque[tuple[float, int]] = deque(maxlen=round(2.0 / SAMPLE))
        self.rate = 0.0
        # (What lies on a server would all have to be fetched again.)
        count = getattr(watcher.camera, "count", None)
        self.frames: int = 0 if "://" in source else count or 0
        self._reel: Stills | None = None
        self._stills: deque[Frame] = deque(maxlen=STILLS)
        self._lock = threading.Lock()  # of these two

    def note(self) -> None:
        """Where the tip is now."""
        view = self.watcher.view
        seen = view and view.found.get(EFFECTOR)
        if view and seen and seen.confidence >= LEAST_CONFIDENCE:
            where = seen.u, seen.v
            if not self.trail or math.dist(self.trail[-1][1], where) >= FINEST:
                self.trail.append((view.frame.t, where))

    def count(self, now: float) -> None:
        """How many frames there were until now (s)."""
        self.counts.append((now, self.watcher.frames))
        before, frames = self.counts[0]
        self.rate = (self.watcher.frames - frames) / (now - before) if now > before else 0.0

    def find(self, index: int) -> AnnotatedFrame:
        """The picture of a frame that was given out.

        Raises:
            PictureGone: it was too long ago.
        """
        for view in (*self.pinned, *self.given):
            if view.frame.index == index:
                return view
        raise PictureGone("this picture is too old; click into a newer one, or pause first")

    def frame(self, index: int) -> Frame:
        """A frame that was given out, or any of a recording.

        Raises:
            ArmError: it is not to be had.
        """
        try:
            return self.find(index).frame
        except PictureGone:
            if not self.frames:
                raise
        with self._lock:
            for still in self._stills:
                if still.index == index:
                    return still
            return self._read(index)

    def _read(self, index: int) -> Frame:
        """From the source, which is opened a second time."""
        if not 0 <= index < self.frames:
            raise PictureGone(f"frame {index}: {self.source} has frames 0 to {self.frames - 1}")
        camera = self.watcher.camera
        self._reel = self._reel or Stills(self.source)
        image = self._reel.read(index)
        if image is None:
            raise PictureGone(f"frame {index} of {self.source} cannot be read; take another one")
        # Its time on the clock of those that were tracked.
        t = 0.0
        if (view := self.watcher.view) and camera.fps:
            t = view.frame.t + (index - view.frame.index) / camera.fps
        self._stills.append(Frame(index, t, image))
        return self._stills[-1]

    def jpeg(self, view: AnnotatedFrame) -> bytes:
        """Of one picture; encoded once, however many look."""
        encoded = self.encoded
        if encoded is None or encoded[0] != view.frame.index:
            _, data = cv2.imencode(".jpg", view.frame.image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
            self.encoded = encoded = view.frame.index, data.tobytes()
        return encoded[1]


def marks(view: AnnotatedFrame) -> list[Mark]:
    """What was found in a picture, and where the fixed goal is."""
    marks = []
    for name, seen in view.found.items():
        window = view.windows.get(name)
        if seen is None:
            why = view.why.get(name) or "not seen"
            marks.append(Mark(name, None, None, None, 0.0, why, _advice(why), window))
        else:
            why = view.why.get(name) or ("doubtful" if seen.confidence < LEAST_CONFIDENCE else "")
            u, v, confidence, radius = seen
            marks.append(Mark(name, u, v, radius, confidence, why, _advice(why), window))
    for name, (u, v, _) in view.fixed.items():
        marks.append(Mark(name, u, v, None, None, "", "", None))
    return marks


def _advice(why: str) -> str:
    if why.startswith("no ArUco"):
        return "bring it into the picture, all of its white border, too"
    if why == "doubtful":
        return "something else may look like it; pick its colour anew"
    return ADVICE.get(why, "")


def mask(image: np.ndarray, marker: Marker) -> bytes:
    """A PNG, magenta where the picture has the marker's colour, and transparent elsewhere."""
    assert marker.color is not None
    inside = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), marker.color)
    layer = np.full((*inside.shape, 4), (255, 60, 255, 0), np.uint8)
    layer[..., 3] = inside
    _, data = cv2.imencode(".png", layer, (cv2.IMWRITE_PNG_COMPRESSION, 1))
    return data.tobytes()
