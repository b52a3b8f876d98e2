"""Live cameras: a thread grabs every frame, and the reader gets the newest."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import cv2

from laptop.see.camera.frames import Capture, Frame, MakeCapture, NoCamera, bgr, size_of
from laptop.see.camera.stream_faults import why_no_stream

MAX_STAMP_AGE = 0.5
"""Greatest age of a driver's first time stamp for its stamps to be believed, s."""
REOPEN_SCHEDULE = (0.25, 2.0, 60.0)
"""Schedule for a live camera that fails, s: first retry, longest pause between retries, end of the
retries."""
STREAM_TIMEOUT = 5.0
"""Longest wait for a stream before it counts as unreachable, s."""


class LiveSource(Protocol):
    """Opens a live camera, again and again if need be.

    stamps    whether its driver says when a picture was taken
    tells_fps whether what it says of its frame rate is true
    notes     what people should know about it
    """

    stamps: bool
    reports_fps: bool
    notes: Sequence[str]

    def open(self) -> Capture: ...  # noqa: D102


class LiveCamera:
    """A live camera, whose reader gets the newest frame.

    A thread of its own takes the frames.  When they stop coming, it opens the camera anew, less and
    less often, and gives up in the end.

    Args:
        name: as people call it.
        source: opens the camera, again and again if need be.
        now: the clock, s; the one of the driver's time stamps (Linux: CLOCK_MONOTONIC).
        capture: what `source` opened, if it has been opened already.

    Attributes:
        fps: as the camera answered, or None.
        size: (width, height), px.
        unread: frames that came but could not be read.
        count: None, there is no end.
    """

    count = None

    def __init__(
        self,
        name: str,
        source: LiveSource,
        now: Callable[[], float] = time.monotonic,
        capture: Capture | None = None,
    ) -> None:
        self.name = name
        self.unread = 0
        self._source = source
        self._now = now
        self._stamped: bool | None = None
        capture = capture or source.open()
        fps = capture.get(cv2.CAP_PROP_FPS) if source.reports_fps else 0.0
        self.fps = fps if math.isfinite(fps) and 0 < fps <= 1000 else None
        self.size = size_of(capture)
        self._changed = threading.Condition()
        self._newest: Frame | None = None
        self._index = 0
        self._last = now()
        self._trouble = ""
        self._ended = False
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._work, args=(capture,), daemon=True)
        self._thread.start()

    @property
    def notes(self) -> list[str]:
        """Remarks for people: its answers to the settings, and the source of its times."""
        stamps = {
            None: [],
            True: ["time stamps from the driver"],
            False: ["no time stamps from the driver: a frame's time is when it arrived"],
        }[self._stamped]
        unread = [f"{self.unread} frames could not be read"] if self.unread else []
        return [*self._source.notes, *stamps, *unread]

    @property
    def why(self) -> str:
        """The present trouble with it, or ""."""
        return self._trouble

    @property
    def ended(self) -> bool:
        """True if it was closed or given up, and nothing is left to read."""
        return self._ended and self._newest is None

    def read(self, timeout: float) -> Frame | None:
        """Return the newest frame not yet read; None if none comes within the timeout (s)."""
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._ended, timeout)
            frame, self._newest = self._newest, None
        return frame

    def close(self) -> None:
        """End it; a driver that hangs is left to itself."""
        self._closing.set()
        self._thread.join(1.0)
        with self._changed:
            self._ended, self._newest = True, None
            self._changed.notify_all()

    def __enter__(self) -> LiveCamera:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _work(self, capture: Capture | None) -> None:
        # Only this thread touches the capture: to release one that is just being read would end
        # the whole program.
        try:
            while not self._closing.is_set():
                if capture is None:
                    capture = self._reopen()
                    if capture is None:
                        break
                if not self._grab(capture):
                    self._trouble = "it stopped giving pictures; trying again"
                    capture.release()
                    capture = None
                    self._stamped = None  # what comes back may be another one
        finally:
            if capture is not None:
                capture.release()
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _grab(self, capture: Capture) -> bool:
        """Grab one frame; return whether the camera is still alive."""
        try:
            if not capture.grab():
                return False
            arrived = self._now()
            t = self._time_of(capture, arrived)
            done, image = capture.retrieve()
        except cv2.error:
            return False
        index, self._index = self._index, self._index + 1
        if not done or image is None:
            self.unread += 1
            return arrived - self._last < REOPEN_SCHEDULE[1]
        frame = Frame(index, t, bgr(image))
        with self._changed:
            self._newest = frame
            self._last = arrived
            self._trouble = ""
            self._changed.notify_all()
        return True

    def _time_of(self, capture: Capture, arrived: float) -> float:
        if not self._source.stamps:
            return arrived
        stamp = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
        if not self._stamped:
            self._stamped = 0 <= arrived - stamp < MAX_STAMP_AGE
        # From then on an old stamp is right: the driver has buffered the picture.
        return stamp if self._stamped and stamp <= arrived else arrived

    def _reopen(self) -> Capture | None:
        """Wait and open again, until it works; None if that is given up."""
        delay, longest, enough = REOPEN_SCHEDULE
        while not self._closing.wait(delay):
            try:
                return self._source.open()
            except NoCamera as error:
                self._trouble = str(error)
            if self._now() - self._last > enough:
                self._trouble = f"{self.name} stopped giving pictures and did not come back"
                return None
            delay = min(2 * delay, longest)
        return None


class NetworkStream:
    """A network stream, through FFmpeg."""

    stamps = False
    reports_fps = False  # FFmpeg makes one up
    notes: Sequence[str] = ("no capture time in a stream: a frame's time is when it arrived",)

    def __init__(self, url: str, make: MakeCapture) -> None:
        self.url = url
        self._make = make

    def open(self) -> Capture:
        """Connect anew; raises NoCamera."""
        within = int(1000 * STREAM_TIMEOUT)
        capture = self._make(
            self.url,
            cv2.CAP_FFMPEG,
            [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, within, cv2.CAP_PROP_READ_TIMEOUT_MSEC, within],
        )
        if capture.isOpened():
            return capture
        capture.release()
        why = why_no_stream(self.url) or (
            f"cannot be opened within {STREAM_TIMEOUT:g} s; check the address in a browser or with "
            "ffplay"
        )
        raise NoCamera(f"stream {self.url} {why}")
