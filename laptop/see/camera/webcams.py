"""Webcams: listing them, and opening one with its automatic settings locked."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2

from laptop.see.camera.frames import Capture, MakeCapture, NoCamera

LINUX = sys.platform.startswith("linux")
DEV, SYSFS = "/dev", "/sys/class/video4linux"
SIZE, FPS = (640, 480), 60.0
"""Default size, px, and frames per second asked of a webcam; it answers with what it can."""
SETTLING_FRAMES = 30
"""Number of frames that a webcam gets to find its exposure before that is locked."""


class Webcam:
    """A webcam: MJPG, one buffer, everything that adapts by itself locked once it has settled."""

    stamps = LINUX  # elsewhere the position is none on the clock
    reports_fps = True

    def __init__(
        self,
        index: int,
        size: tuple[int, int] | None,
        fps: float | None,
        make: MakeCapture,
        now: Callable[[], float],
    ) -> None:
        self.index = index
        self.notes: Sequence[str] = []
        self._size, self._fps = size or SIZE, fps or FPS
        self._make = make
        self._now = now
        self._locked: dict[str, float] = {}

    def open(self) -> Capture:
        """Open it, set it up and lock it; raises NoCamera."""
        capture = self._make(self.index, cv2.CAP_V4L2 if LINUX else cv2.CAP_ANY)
        if not capture.isOpened():
            capture.release()
            raise NoCamera(_no_webcam(self.index, self._make))
        # Uncompressed pictures at 60 a second are too much for USB 2, so the format comes first.
        width, height = self._size
        for key, value in (
            (cv2.CAP_PROP_FOURCC, float(cv2.VideoWriter.fourcc(*"MJPG"))),
            (cv2.CAP_PROP_FRAME_WIDTH, float(width)),
            (cv2.CAP_PROP_FRAME_HEIGHT, float(height)),
            (cv2.CAP_PROP_FPS, self._fps),
            (cv2.CAP_PROP_BUFFERSIZE, 1.0),
        ):
            capture.set(key, value)
        notes = [self._format(capture)]
        notes += self._lock(capture)
        if not self.stamps:
            notes.append("no time stamps from the driver: a frame's time is when it arrived")
        self.notes = notes
        return capture

    def _format(self, capture: Capture) -> str:
        code = int(capture.get(cv2.CAP_PROP_FOURCC))
        letters = "".join(chr(code >> shift & 0xFF) for shift in (0, 8, 16, 24))
        width, height = self._size
        got = [
            int(capture.get(key))
            for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS)
        ]
        answer = "{}x{} at {} fps".format(*got)
        asked = f"{width}x{height} at {self._fps:.0f} fps"
        form = f" {letters}" if letters.isprintable() and letters.strip() else ""
        return answer + form + ("" if answer == asked else f" (asked for {asked})")

    def _lock(self, capture: Capture) -> list[str]:
        """Let the camera adapt, then lock its settings; return its answers."""
        auto, manual = (3.0, 1.0) if LINUX else (0.75, 0.25)
        before: float | None = None
        if not self._locked:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, auto)
            capture.set(cv2.CAP_PROP_AUTO_WB, 1)
            before = self._brightness(capture, SETTLING_FRAMES)
            self._locked = {name: capture.get(key) for name, key, *_ in _AUTOMATIC_SETTINGS}
        notes = []
        for name, key, switch in _AUTOMATIC_SETTINGS:
            value = self._locked[name]
            if value < 0 and name in ("gain", "focus"):
                continue  # it has none
            off = manual if name == "exposure" else 0.0
            switched = switch is None or capture.set(switch, off)
            accepted = capture.set(key, value)
            answer = capture.get(key)
            if switched and accepted and math.isclose(answer, value, rel_tol=0.02, abs_tol=0.51):
                notes.append(f"{name} locked at {answer:g}")
            else:
                notes.append(f"{name} cannot be locked (answers {answer:g})")
        after = None if before is None else self._brightness(capture, 5)
        if before and after and not 0.7 < after / before < 1.4:
            # Some drivers report no exposure while it is automatic, and would lock an old one.
            notes.append(
                f"the lock changed the brightness from {before:.0f} to {after:.0f} of 255: "
                f"set the exposure by hand, e.g. v4l2-ctl -d {DEV}/video{self.index} -l"
            )
        return notes

    def _brightness(self, capture: Capture, frames: int) -> float | None:
        """Return the mean brightness of the last of some frames, 0 to 255."""
        deadline = self._now() + 2.0
        try:
            for _ in range(frames):
                if not capture.grab() or self._now() > deadline:
                    break
            done, image = capture.retrieve()
        except cv2.error:  # a picture that came in pieces
            return None
        return float(image[::8, ::8].mean()) if done and image is not None else None


_AUTOMATIC_SETTINGS: tuple[tuple[str, int, int | None], ...] = (
    ("exposure", cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_AUTO_EXPOSURE),
    ("gain", cv2.CAP_PROP_GAIN, None),
    ("white balance", cv2.CAP_PROP_WB_TEMPERATURE, cv2.CAP_PROP_AUTO_WB),
    ("focus", cv2.CAP_PROP_FOCUS, cv2.CAP_PROP_AUTOFOCUS),
)
"""Settings that a webcam changes by itself: name, value, and the switch that locks it."""


def webcams(make: MakeCapture = cv2.VideoCapture) -> dict[int, str]:
    """Return the webcams that exist: index and name ("" where the system tells none)."""
    if not LINUX:
        found = {}
        for index in range(5):
            capture = make(index)
            if capture.isOpened():
                found[index] = ""
            capture.release()
        return found
    found = {}
    for node in Path(DEV).glob("video*"):
        if not node.name[5:].isdecimal():
            continue
        about = Path(SYSFS) / node.name
        # One camera has several nodes; only the first gives pictures.
        if _line(about / "index") in ("", "0"):
            found[int(node.name[5:])] = _line(about / "name")
    return dict(sorted(found.items()))


def _line(file: Path) -> str:
    try:
        return file.read_text(errors="replace").strip()
    except OSError:
        return ""


def _no_webcam(index: int, make: MakeCapture) -> str:
    """Return the error of a webcam that does not open, with those that exist."""
    found = webcams(make)
    others = "a video file, a folder of pictures, a stream (http://, rtsp://) or synthetic"
    if not found:
        return f"no camera {index}: no webcam is plugged in; plug one in, or give --camera {others}"
    named = ", ".join(f"{k} ({name})" if name else str(k) for k, name in found.items())
    if index not in found:
        return f"no camera {index}: there are {named}; give --camera one of these, or {others}"
    node = f"{DEV}/video{index}"
    if LINUX and not os.access(node, os.R_OK | os.W_OK):
        return f"camera {index}: you may not use {node}; sudo usermod -aG video $USER, log in again"
    return (
        f"camera {index} gives no pictures; end the program that uses it, or choose among {named}"
    )
