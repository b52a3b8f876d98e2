"""Opening of any camera by what people call it."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

import cv2

from laptop.see.camera.containers import frame_numbers, how_cut_off, is_bare, states_count
from laptop.see.camera.frames import MakeCapture, NoCamera
from laptop.see.camera.live_cameras import LiveCamera, NetworkStream
from laptop.see.camera.recordings import FileFacts, PictureFolder, Recording, open_files
from laptop.see.camera.webcams import Webcam

WEBCAM = re.compile(r"(?:/dev/video)?(\d{1,3})")


def open_camera(
    source: str,
    live: bool = False,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    now: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    make: MakeCapture = cv2.VideoCapture,
) -> LiveCamera | Recording:
    """Open the camera, file or stream that a text means.

    Args:
        source: a webcam's index or /dev/video..., a video file, a picture, a folder of pictures
            (png, jpg; in the order of their names), or the URL of a stream.
        live: play files at their own pace.
        fps: what a webcam is asked for; how fast files are played.
        size: (width, height) a webcam is asked for, px.
        now: the clock, s.
        sleep: waits on that clock, s.
        make: cv2.VideoCapture, or what stands for it.

    Raises:
        NoCamera: it gives no pictures.
    """
    if webcam := WEBCAM.fullmatch(source):
        return LiveCamera(name_of(source), Webcam(int(webcam[1]), size, fps, make, now), now)
    if size:
        raise NoCamera(f"size {size[0]}x{size[1]}: only a webcam has a choice; {source} has none")
    if "://" in source:
        stream = NetworkStream(source, make)
        capture = stream.open()
        if capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0:  # a file that lies on a server
            return Recording(source, capture, fps, live, now, sleep)
        return LiveCamera(source, stream, now, capture)
    capture = open_files(source, make)
    gapless = Path(source).suffix.lower() == ".avi"  # it has no times but those of its frames
    numbers = frame_numbers(Path(source)) if gapless else None
    if isinstance(capture, PictureFolder):
        return Recording(source, capture, fps, live, now, sleep)
    counted, cut = states_count(Path(source)), how_cut_off(Path(source))
    facts = FileFacts(numbers, not gapless, not counted, cut)
    film = Recording(source, capture, fps, live, now, sleep, facts)
    if fps is None and is_bare(Path(source)):
        film.remarks.append(f"it tells no pace: {film.fps:g} a second is a guess; give it as --fps")
    return film


def name_of(source: str) -> str:
    """Return a source's common name: /dev/video0 is camera 0."""
    webcam = WEBCAM.fullmatch(source)
    return f"camera {int(webcam[1])}" if webcam else source


def is_live(source: str) -> bool:
    """Return True if a source is live: its frames do not wait for the reader."""
    return "://" in source or bool(WEBCAM.fullmatch(source))
