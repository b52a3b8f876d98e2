"""Single frames of a recording, whichever is asked for."""

from __future__ import annotations

from functools import partial

import cv2
import numpy as np

from laptop.see.camera.frames import Capture, MakeCapture, bgr
from laptop.see.camera.recordings import PICTURE_FPS, PictureFolder, open_files

MAX_READ_AHEAD = 12
"""Greatest distance of a frame ahead of the last one, frames, to be reached by reading rather than
seeking."""


class Stills:
    """Single frames of a recording, each the very one to which `Recording` gives this index.

    To seek in a video by OpenCV may end frames away, as where its pace changes.  So the time stamps
    of all its pictures are read beforehand, which takes no decoding, and after a seek tell which
    picture this is.  Where they tell nothing it is read on in order, if need be from the start.

    Args:
        source: a video file, a picture, or a folder of pictures.
        make: cv2.VideoCapture, or what stands for it.

    Raises:
        NoCamera: it gives no pictures.
    """

    def __init__(self, source: str, make: MakeCapture = cv2.VideoCapture) -> None:
        self._open = partial(open_files, source, make)
        self._capture = self._open()
        self._stamps = _stamps(self._capture, source, make)
        self._index = {stamp: index for index, stamp in enumerate(self._stamps)}
        if len(self._index) != self._capture.get(cv2.CAP_PROP_FRAME_COUNT):
            self._stamps, self._index = [], {}  # they stand still, or pictures are missing
        self._at, self._here = -1, False  # which frame was grabbed last, and whether that worked

    def read(self, index: int) -> np.ndarray | None:
        """Return one frame: BGR, uint8, shape (h, w, 3); None if it cannot be read."""
        if not self._at <= index <= self._at + MAX_READ_AHEAD:
            self._seek(index)
        while self._at < index:
            self._here = self._capture.grab()  # if not: others may come still, as in `Recording`
            self._at += 1
        done, image = self._capture.retrieve() if self._here else (False, None)
        return bgr(image) if done and image is not None else None

    def _seek(self, index: int) -> None:
        """Go to this frame, or to one before it."""
        aim = index if index < len(self._stamps) else -1
        while aim >= 0:
            self._capture.set(cv2.CAP_PROP_POS_MSEC, self._stamps[aim] / 1000)
            at = self._index.get(_stamp(self._capture)) if self._capture.grab() else None
            if at is not None and at <= index:
                self._at, self._here = at, True
                return
            aim -= MAX_READ_AHEAD if at is None else 1 + 2 * (at - index)
        if self._index or index < self._at:
            self._rewind()

    def _rewind(self) -> None:
        self._capture.release()
        self._capture = self._open()
        self._at = -1


def _stamps(capture: Capture, source: str, make: MakeCapture) -> list[int]:
    """Return the time stamps of all pictures of a recording, in order, microseconds."""
    if isinstance(capture, PictureFolder):
        count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        return [round(1e6 * index / PICTURE_FPS) for index in range(count)]
    packets = make(source, cv2.CAP_FFMPEG, [cv2.CAP_PROP_FORMAT, -1])  # as they are, not decoded
    stamps = []
    while packets.isOpened() and packets.grab():
        stamps.append(_stamp(packets))
    packets.release()
    return sorted(stamps)


def _stamp(capture: Capture) -> int:
    """Return the time stamp of the picture grabbed last, microseconds."""
    return round(1000 * capture.get(cv2.CAP_PROP_POS_MSEC))
