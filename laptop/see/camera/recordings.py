"""Frames that lie on a disk: a video file, a picture, a folder of pictures.

Every one is given in order; played live they keep their own pace, and those that are late are left
out.
"""

from __future__ import annotations

import math
import os
import re
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.see.camera.containers import why_undecoded, why_unreadable
from laptop.see.camera.frames import Capture, Frame, MakeCapture, NoCamera, bgr, size_of
from laptop.system.picture_heads import MAX_PICTURE_BYTES, InvalidPicture, picture_size
from shared.config_files import InvalidFile, open_file
from shared.message_fields import printable

PICTURE_FPS = 30.0
"""Frames per second of a folder of pictures."""
MAX_UNREAD_IN_A_ROW = 1000
"""Number of consecutive unreadable frames after which a file ends, whatever it promises."""
MAX_UNREAD_OF_A_GUESS = 100
"""The same where a file does not state its number of frames: it may well be at its end."""
MIN_SHARE = 0.97
"""Least share of the frames that fit into its time for a recording of constant frame rate."""
MAX_TRIED = 300
"""Number of frames, from the first, of which one has to be readable: more than lie between key
frames."""
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg")
HALF_COLORS = {int.from_bytes(name, "little") for name in (b"I420", b"NV12", b"Y3\x0b\n")}
"""OpenCV's numbers of pixel formats with colours of half the height: 8 bits in two ways, and 10
bits."""
MAX_NAMED = 3
"""Number of unreadable pictures that are named; the others are counted."""


class FileFacts(NamedTuple):
    """Facts about a recording's file, read from its container.

    numbers  of the frames that a damaged file still holds; None: not known, or all of them
    stamped  False: a frame that is lost leaves no gap in the recording's own time stamps
    guessed  the number of frames is its length times its pace, for the file states none
    cut      how the file is cut off, after "the file is"; "" if it is whole
    """

    numbers: Sequence[int] | None = None
    stamped: bool = True
    guessed: bool = False
    cut: str = ""


_SOUND_FILE = FileFacts()


class Recording:
    """Frames that lie on a disk: every one in order, or played live.

    Args:
        name: as people call it.
        capture: gives the pictures.
        fps: frames per second; None takes the recording's own, with its own time stamps.
        live: frame n is due at (time of the first `read`) + n / fps on the clock `now`, and this is
            its capture time; those that are late are left out.  Otherwise t is seconds into the
            recording.
        now: the clock to play by, s.
        sleep: waits on that clock, s.
        facts: about the file.

    Attributes:
        count: frames that the recording says it has, or None.  Of one that is guessed, about; what
            it was once it has ended.
        guessed: that is not certain yet.
        size: (width, height) of the first picture, px.
        unread: frames that could not be read so far.
        remarks: on the file, for people.
        ended: nothing more will come.
    """

    why = ""

    def __init__(
        self,
        name: str,
        capture: Capture,
        fps: float | None = None,
        live: bool = False,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        facts: FileFacts = _SOUND_FILE,
    ) -> None:
        own = capture.get(cv2.CAP_PROP_FPS)
        own = own if math.isfinite(own) and 0.01 <= own <= 1000 else PICTURE_FPS
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.name = name
        self.fps: float = fps or own
        self.count = int(count) if 0 < count < 1e9 else None
        self.size = size_of(capture)
        numbers = facts.numbers
        if self.count is None or (numbers and numbers[-1] >= self.count):
            numbers = None
        self._numbers = numbers
        self._stepped = 0  # frames that were stepped to
        self.unread = self.count - len(numbers) if numbers and self.count else 0
        self.ended = False
        self._capture = capture
        self._stamped = fps is None and not live and facts.stamped
        self._gapless = not facts.stamped
        self.guessed = self._guess = facts.guessed and self.count is not None
        self._cut = facts.cut
        odd = "" if isinstance(capture, PictureFolder) else _odd_height(capture)
        self.remarks = [odd] if odd else []
        self._live = live
        self._now, self._sleep = now, sleep
        self._start: float | None = None  # of playing it live
        self._next = numbers[0] if numbers else 0
        self._failed = 0  # in a row
        self._failed_reads = 0  # of these, steps to a frame that may not be there
        self._t = -math.inf
        self._lock = threading.Lock()  # to release a capture that is being read would end it all

    @property
    def notes(self) -> list[str]:
        """Remarks for people, and which frames could not be read."""
        return [*self.remarks, *self._losses()]

    def _losses(self) -> list[str]:
        short = self._short()
        if not self.unread:
            return [short] if short else []
        note = f"{self.unread} of {self._promised()}frames could not be read"
        if short:
            return [note, short]
        if isinstance(self._capture, PictureFolder) and self._capture.spoilt:
            return [f"{note}: {_named(self._capture.spoilt)}"]
        if self._gapless and self._failed and self.ended and self._numbers is None:
            note += (
                f"; the file does not tell which, so numbers and times may be too small, by up to "
                f"{self._failed} frames or {self._failed / self.fps:.2f} s"
            )
        elif self._cut:
            note += f": the file is {self._cut}; copy it again"
        return [note]

    def _promised(self) -> str:
        return f"{'about ' * self.guessed}{self.count} " if self.count else "its "

    def _short(self) -> str:
        """Return what is odd about the number of frames of a recording; "" if nothing."""
        if not self._guess or not self.ended or not self.count:
            return ""
        if self._cut:
            return (
                f"the file is {self._cut}: what comes after {self.count} frames could not be "
                "read; copy it again"
            )
        fitting = round(self._t * self.fps) + 1 if self._stamped else self.count
        if self.count > MIN_SHARE * fitting:
            return ""
        return (
            f"{self.count} frames in {self._t:.1f} s, where {self.fps:g} a second would be "
            f"{fitting}: its pace changes, or some could not be read"
        )

    def read(self, timeout: float) -> Frame | None:
        """Return the next frame; None if it is not due within the timeout (s), or there is none."""
        with self._lock:
            return self._read(timeout)

    def _read(self, timeout: float) -> Frame | None:
        if self._live and not self._wait(timeout):
            return None
        while not self.ended:
            index = self._next
            if self._grab() and (image := self._retrieve()) is not None:
                self._failed = 0
                return Frame(index, self._time_of(index), image)
            if self._live and not (self.guessed and self._failed_reads):
                return None  # the next one is not due yet
        return None

    def _wait(self, timeout: float) -> bool:
        """Wait until the next frame is due, and pass over late ones; return True if it is."""
        now = self._now()
        if self._start is None:
            self._start = now
        early = self._start + self._next / self.fps - now
        if early > 0:
            self._sleep(min(early, timeout))
            if early > timeout:
                return False
        newest = int((self._now() - self._start) * self.fps + 1e-6)
        if self.count:
            newest = min(newest, self.count - 1)
        while self._next < newest and not self.ended:
            self._grab()
        return True

    def _grab(self) -> bool:
        """Step to the next frame without making a picture of it."""
        if self._capture.grab():
            self._failed_reads = 0
            self._step()
            return True
        if self.count is None or self._next >= self.count:
            self._end()
            return False
        self._step()
        self._miss()
        self._failed_reads += 1
        if self._failed_reads >= (MAX_UNREAD_OF_A_GUESS if self.guessed else MAX_UNREAD_IN_A_ROW):
            self._end()
        return False

    def _end(self) -> None:
        self.ended = True
        if self.guessed:  # frames that do not exist are not unread
            self.unread -= self._failed_reads
            self.count, self.guessed = self._next - self._failed_reads, False
        elif self.count is not None:
            self.unread += max(0, self.count - self._next)

    def _step(self) -> None:
        """Advance to the next frame, or to the next one that the file still holds."""
        self._stepped += 1
        if self._numbers is None:
            self._next += 1
        elif self._stepped < len(self._numbers):
            self._next = self._numbers[self._stepped]
        else:
            self._next = max(self._next + 1, self.count or 0)
        if self.guessed and self.count is not None:
            self.count = max(self.count, self._next)

    def _retrieve(self) -> np.ndarray | None:
        done, image = self._capture.retrieve()
        if done and image is not None:
            return bgr(image)
        self._miss()
        return None

    def _miss(self) -> None:
        self.unread += 1
        self._failed += 1

    def _time_of(self, index: int) -> float:
        if self._start is not None:
            return self._start + index / self.fps
        t = index / self.fps
        if self._stamped:
            stamp = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            # Some containers have no time: their stamps do not change.
            t = stamp if stamp > self._t else max(t, self._t + 1 / self.fps)
        self._t = t
        return t

    def close(self) -> None:
        """End it; a disk that hangs is left to itself."""
        self.ended = True
        if self._lock.acquire(timeout=1.0):
            self._capture.release()
            self._lock.release()

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _odd_height(capture: Capture) -> str:
    """Return a note that a video's colours are shifted, if they are; else "".

    Colours of half the height are stretched to all of it, though of an odd one their last line
    reaches beyond the picture.
    """
    width, height = size_of(capture)
    if not height % 2 or int(capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)) not in HALF_COLORS:
        return ""
    return (
        f"its height of {height} px is odd: colours lie up to half a pixel too high, the more the "
        f"lower; cut a line off, for example: ffmpeg -i FILE -vf crop={width - width % 2}:"
        f"{height - 1}:0:0 NEW.mp4"
    )


class PictureFolder:
    """Pictures in files, taken in turn as if they were a video: a Capture.

    Attributes:
        spoilt: those that could not be read so far, and why.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = files
        self._at = -1
        self.spoilt: dict[Path, str] = {}
        first = next((image for image in map(self._read, files) if image is not None), None)
        if first is None:
            raise NoCamera(
                f"none of the {len(files)} pictures in {files[0].parent} can be read: "
                f"{_named(self.spoilt)}; give --camera a folder of png or jpg files"
            )
        height, width = first.shape[:2]
        self._facts = {
            cv2.CAP_PROP_FPS: PICTURE_FPS,
            cv2.CAP_PROP_FRAME_COUNT: float(len(files)),
            cv2.CAP_PROP_FRAME_WIDTH: float(width),
            cv2.CAP_PROP_FRAME_HEIGHT: float(height),
        }

    def isOpened(self) -> bool:  # noqa: N802, D102
        return True

    def grab(self) -> bool:  # noqa: D102
        self._at += 1
        return self._at < len(self._files)

    def retrieve(self) -> tuple[bool, Any]:  # noqa: D102
        image = self._read(self._files[self._at])
        return image is not None, image

    def _read(self, file: Path) -> np.ndarray | None:
        try:
            return _read_picture(file)
        except InvalidPicture as error:
            self.spoilt[file] = str(error)
            return None

    def get(self, propId: int) -> float:  # noqa: N803, D102
        if propId == cv2.CAP_PROP_POS_MSEC:
            return 1000 * self._at / PICTURE_FPS
        return self._facts[propId]

    def set(self, propId: int, value: float) -> bool:  # noqa: N803, D102
        if propId != cv2.CAP_PROP_POS_MSEC:
            return False
        self._at = round(value * PICTURE_FPS / 1000) - 1
        return True

    def release(self) -> None:  # noqa: D102
        self._files = ()


def _read_picture(file: Path) -> np.ndarray:
    """Read a picture as BGR: grey becomes colour, alpha is dropped.

    Raises:
        SpoiltPicture: it cannot be read, or is larger than any camera's.
    """
    try:
        with open(open_file(str(file)), "rb") as opened:
            data = opened.read(MAX_PICTURE_BYTES + 1)
    except InvalidFile as error:
        raise InvalidPicture(f"{error}; give a png or jpg file") from None
    except OSError as error:
        raise InvalidPicture(f"cannot be read ({error.strerror}); check the file") from None
    picture_size(data, to_end=False)  # of a video in pictures each is decoded once, and soon
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error:
        image = None
    if image is None:
        raise InvalidPicture("is a damaged picture, and cannot be read; save it anew")
    return image


def _named(spoilt: Mapping[Path, str]) -> str:
    """Return which files could not be read and why, shortened."""
    named = [
        f"{printable(file.name)} ({why.partition(';')[0]})"
        for file, why in list(spoilt.items())[:MAX_NAMED]
    ]
    more = len(spoilt) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")


def _natural(file: Path) -> list[tuple[int, str]]:
    """Return a sort key that puts frame2 before frame10."""
    parts = re.findall(r"\d+|\D+", file.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def open_files(source: str, make: MakeCapture) -> Capture:
    """Open a video file, a picture, or a folder of pictures.

    Raises:
        NoCamera: it gives no pictures.
    """
    path = Path(source)
    if source and path.is_dir():  # (an empty one would be the folder we stand in)
        files = [file for file in path.iterdir() if file.suffix.lower() in PICTURE_SUFFIXES]
        if not files:
            raise NoCamera(f"folder {path} has no pictures; png and jpg files are read")
        return PictureFolder(sorted(files, key=_natural))
    if not source or not path.exists():
        raise NoCamera(
            f"no camera, file or folder '{source}'; give --camera a webcam's number, a video file, "
            "a folder of pictures, a stream (http://, rtsp://) or synthetic"
        )
    if path.suffix.lower() in PICTURE_SUFFIXES:
        try:
            _read_picture(path)
        except InvalidPicture as error:
            raise NoCamera(f"{path} {error}") from None
        return PictureFolder([path])
    try:
        os.close(open_file(str(path)))  # FFmpeg would wait for a pipe
    except InvalidFile as error:
        raise NoCamera(f"{path} {error}; give --camera a webcam by its number, or a file") from None
    except OSError as error:
        raise NoCamera(f"{path} cannot be read ({error.strerror}); check the file") from None
    video = make(str(path), cv2.CAP_FFMPEG)
    if not video.isOpened():
        video.release()
        raise NoCamera(f"{path} {why_unreadable(path)}")
    if any(video.grab() and video.retrieve()[0] for _ in range(MAX_TRIED)):
        video.release()
        return make(str(path), cv2.CAP_FFMPEG)  # from the first frame on: not all can go back
    codec = int(video.get(cv2.CAP_PROP_FOURCC))
    video.release()
    raise NoCamera(f"{path} {why_undecoded(codec)}")
