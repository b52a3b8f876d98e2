"""Cameras: each gives its newest frame, with the time it was taken.

A webcam and a network stream are live: a thread takes every frame and keeps only the newest.  A
video file and a folder of pictures give every frame in order; played live they keep their own pace
and leave out what is late.
"""

from __future__ import annotations

import math
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol

# What OpenCV and FFmpeg say on stderr helps nobody; the second is read when a video is opened, the
# third when cv2 is imported.
os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")

import cv2
import numpy as np

from shared.arm_description import ArmError

if os.environ["OPENCV_LOG_LEVEL"] == "SILENT":
    # (Imported before, it has not read the variable. Where this lives depends on its version.)
    (cv2.setLogLevel if hasattr(cv2, "setLogLevel") else cv2.utils.logging.setLogLevel)(0)

LINUX = sys.platform.startswith("linux")
DEV, SYSFS = "/dev", "/sys/class/video4linux"

SIZE, FPS = (640, 480), 60.0
"""What a webcam is asked for if nothing is said; it answers with what it can."""
PICTURE_FPS = 30.0
"""Of a folder of pictures."""
SETTLE = 30
"""Frames that a webcam gets to find its exposure before that is locked."""
CREDIBLE = 0.5
"""Age, s, below which a driver's time stamp is believed, and all that come after it."""
PATIENCE = (0.25, 2.0, 60.0)
"""A live camera that fails is tried again after the first, up to every second, given up after the
third, s."""
ARRIVES_WITHIN = 5.0
"""A stream that is not there by then, s, is not reachable."""
NEAR = 12
"""A frame so few after the last one is read on to, rather than sought."""
UNREAD_IN_A_ROW = 1000
"""Frames in a row that cannot be read, after which a file is at its end whatever it promises."""

PICTURES = (".png", ".jpg", ".jpeg")
WEBCAM = re.compile(r"(?:/dev/video)?(\d{1,3})")


class NoCamera(ArmError):
    """A camera, file, folder or stream that gives no pictures."""


class Frame(NamedTuple):
    """One picture.

    index  counts the camera's frames from 0; a frame that nobody took in time leaves a gap
    t      capture time, s
    image  BGR, uint8, shape (height, width, 3)
    """

    index: int  # type: ignore[assignment]  # hides tuple.index, which no frame needs
    t: float
    image: np.ndarray


class Capture(Protocol):
    """What is used of cv2.VideoCapture."""

    def isOpened(self) -> bool: ...  # noqa: N802, D102
    def grab(self) -> bool: ...  # noqa: D102
    def retrieve(self) -> tuple[bool, Any]: ...  # noqa: D102
    def get(self, propId: int) -> float: ...  # noqa: N803, D102
    def set(self, propId: int, value: float) -> bool: ...  # noqa: N803, D102
    def release(self) -> None: ...  # noqa: D102


MakeCapture = Callable[..., Capture]


def _size_of(capture: Capture) -> tuple[int, int]:
    """Width and height, px."""
    return (
        int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
    )


@contextmanager
def quiet_decoders() -> Iterator[None]:
    """Keep libjpeg and libpng from writing on the terminal: they know no log level.

    They write to file descriptor 2, whatever Python's stderr is; that goes on as before.
    """
    before = sys.stderr
    if before is None:  # nobody listens anyway
        yield
        return
    before.flush()
    kept = os.dup(2)
    try:
        if _descriptor(before) == 2:
            sys.stderr = open(  # noqa: SIM115 - closed below
                kept,
                "w",
                buffering=1,
                encoding=before.encoding,
                errors="backslashreplace",
                closefd=False,
            )
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        if sys.stderr is not before:
            sys.stderr.close()
            sys.stderr = before
        os.dup2(kept, 2)
        os.close(kept)


def _descriptor(file: Any) -> int | None:
    try:
        return int(file.fileno())
    except (AttributeError, OSError, ValueError):
        return None


def bgr(image: np.ndarray) -> np.ndarray:
    """Any decoded picture as BGR, uint8, shape (h, w, 3): grey, with alpha, or of 16 bits."""
    if image.dtype == np.uint16:
        image = (image >> 8).astype(np.uint8)
    if image.ndim == 2:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if image.shape[2] == 1:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    if image.shape[2] == 4:
        return cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    return image


# Files and folders


class Recording:
    """Frames that lie on a disk: every one in order, or played live.

    Args:
        name: as people call it.
        capture: gives the pictures.
        fps: frames per second; None takes the recording's own, with its own time stamps.
        live: frame n is due at (time of the first `read`) + n / fps on the clock `now`, and this is
            its capture time; those that are late are left out.  Otherwise t is seconds into the
            recording.
        now, sleep: the clock to play by, s.

    Attributes:
        count: frames that the recording says it has, or None.
        size: (width, height) of the first picture, px.
        unread: frames that could not be read so far.
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
    ) -> None:
        own = capture.get(cv2.CAP_PROP_FPS)
        own = own if math.isfinite(own) and 0.01 <= own <= 1000 else PICTURE_FPS
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.name = name
        self.fps: float = fps or own
        self.count = int(count) if 0 < count < 1e9 else None
        self.size = _size_of(capture)
        self.unread = 0
        self.ended = False
        self._capture = capture
        self._stamped = fps is None and not live
        self._live = live
        self._now, self._sleep = now, sleep
        self._start: float | None = None  # of playing it live
        self._next = 0
        self._failed = 0  # in a row
        self._t = -math.inf
        self._lock = threading.Lock()  # to release a capture that is being read would end it all

    @property
    def notes(self) -> list[str]:
        """What people should know about it."""
        if not self.unread:
            return []
        return [f"{self.unread} of {self._promised()}frames could not be read"]

    def _promised(self) -> str:
        return f"{self.count} " if self.count else "its "

    def read(self, timeout: float) -> Frame | None:
        """The next frame, or None: it is not due within the timeout (s), or there is none."""
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
            if self._live:
                return None  # the next one is not due yet
        return None

    def _wait(self, timeout: float) -> bool:
        """Until the next frame is due; late ones are passed over."""
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
            self._next += 1
            return True
        if self.count is not None and self._next < self.count:
            self._next += 1
            self._miss()
            if self._failed >= UNREAD_IN_A_ROW:
                self.unread += self.count - self._next
                self.ended = True
        else:
            self.ended = True
        return False

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
            # Containers exist that know no time: their stamps stand still.
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


class _Folder:
    """Pictures in files, taken in turn as if they were a video."""

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = files
        self._at = -1
        first = next((image for image in map(_read_picture, files) if image is not None), None)
        if first is None:
            raise NoCamera(
                f"none of the {len(files)} pictures in {files[0].parent} can be read; "
                "give --camera a folder of png or jpg files"
            )
        height, width = first.shape[:2]
        self._facts = {
            cv2.CAP_PROP_FPS: PICTURE_FPS,
            cv2.CAP_PROP_FRAME_COUNT: float(len(files)),
            cv2.CAP_PROP_FRAME_WIDTH: float(width),
            cv2.CAP_PROP_FRAME_HEIGHT: float(height),
        }

    def isOpened(self) -> bool:  # noqa: N802
        return True

    def grab(self) -> bool:
        self._at += 1
        return self._at < len(self._files)

    def retrieve(self) -> tuple[bool, Any]:
        image = _read_picture(self._files[self._at])
        return image is not None, image

    def get(self, propId: int) -> float:  # noqa: N803
        if propId == cv2.CAP_PROP_POS_MSEC:
            return 1000 * self._at / PICTURE_FPS
        return self._facts[propId]

    def set(self, propId: int, value: float) -> bool:  # noqa: N803
        if propId != cv2.CAP_PROP_POS_MSEC:
            return False
        self._at = round(value * PICTURE_FPS / 1000) - 1
        return True

    def release(self) -> None:
        self._files = ()


def _read_picture(file: Path) -> np.ndarray | None:
    """Grey becomes colour, alpha is left out; None if the file cannot be read."""
    try:
        data = np.fromfile(file, np.uint8)
        return cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    except (OSError, cv2.error):
        return None


def _natural(file: Path) -> list[tuple[int, str]]:
    """Sorts frame2 before frame10."""
    parts = re.findall(r"\d+|\D+", file.name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


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
        self._open = partial(_open_files, source, make)
        self._capture = self._open()
        self._stamps = _stamps(self._capture, source, make)
        self._index = {stamp: index for index, stamp in enumerate(self._stamps)}
        if len(self._index) != self._capture.get(cv2.CAP_PROP_FRAME_COUNT):
            self._stamps, self._index = [], {}  # they stand still, or pictures are missing
        self._at, self._here = -1, False  # which frame was grabbed last, and whether that worked

    def read(self, index: int) -> np.ndarray | None:
        """One frame: BGR, uint8, shape (h, w, 3); None if it cannot be read."""
        if not self._at <= index <= self._at + NEAR:
            self._seek(index)
        while self._at < index:
            self._here = self._capture.grab()  # if not: others may come still, as in `Recording`
            self._at += 1
        done, image = self._capture.retrieve() if self._here else (False, None)
        return bgr(image) if done and image is not None else None

    def _seek(self, index: int) -> None:
        """To this frame, or to one before it."""
        aim = index if index < len(self._stamps) else -1
        while aim >= 0:
            self._capture.set(cv2.CAP_PROP_POS_MSEC, self._stamps[aim] / 1000)
            at = self._index.get(_stamp(self._capture)) if self._capture.grab() else None
            if at is not None and at <= index:
                self._at, self._here = at, True
                return
            aim -= NEAR if at is None else 1 + 2 * (at - index)
        if self._index or index < self._at:
            self._rewind()

    def _rewind(self) -> None:
        self._capture.release()
        self._capture = self._open()
        self._at = -1


def _stamps(capture: Capture, source: str, make: MakeCapture) -> list[int]:
    """When each picture of a recording is to be shown, in order, microseconds."""
    if isinstance(capture, _Folder):
        count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        return [round(1e6 * index / PICTURE_FPS) for index in range(count)]
    packets = make(source, cv2.CAP_FFMPEG, [cv2.CAP_PROP_FORMAT, -1])  # as they are, not decoded
    stamps = []
    while packets.isOpened() and packets.grab():
        stamps.append(_stamp(packets))
    packets.release()
    return sorted(stamps)


def _stamp(capture: Capture) -> int:
    """When the picture grabbed last is to be shown, microseconds."""
    return round(1000 * capture.get(cv2.CAP_PROP_POS_MSEC))


# Live cameras


class LiveCamera:
    """A camera that goes on whether or not anybody looks: its newest frame wins.

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
        source: _Webcam | _Stream,
        now: Callable[[], float] = time.monotonic,
        capture: Capture | None = None,
    ) -> None:
        self.name = name
        self.unread = 0
        self._source = source
        self._now = now
        self._stamped: bool | None = None
        capture = capture or source.open()
        fps = capture.get(cv2.CAP_PROP_FPS) if source.tells_fps else 0.0
        self.fps = fps if math.isfinite(fps) and 0 < fps <= 1000 else None
        self.size = _size_of(capture)
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
        """What the camera answered to the settings, and where its times come from."""
        stamps = {
            None: [],
            True: ["time stamps from the driver"],
            False: ["no time stamps from the driver: a frame's time is when it arrived"],
        }[self._stamped]
        unread = [f"{self.unread} frames could not be read"] if self.unread else []
        return [*self._source.notes, *stamps, *unread]

    @property
    def why(self) -> str:
        """What is wrong with it, or ""."""
        return self._trouble

    @property
    def ended(self) -> bool:
        """Whether it was closed or given up, and nothing is left to read."""
        return self._ended and self._newest is None

    def read(self, timeout: float) -> Frame | None:
        """The newest frame not yet given, or None if none comes within the timeout (s)."""
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
                if not self._take(capture):
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

    def _take(self, capture: Capture) -> bool:
        """One frame; whether the camera is still alive."""
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
            return arrived - self._last < PATIENCE[1]
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
            self._stamped = 0 <= arrived - stamp < CREDIBLE
        # From then on an old one is true: the picture lay in the driver while nobody took it.
        return stamp if self._stamped and stamp <= arrived else arrived

    def _reopen(self) -> Capture | None:
        """Wait and open again, until it works; None if that is given up."""
        delay, longest, enough = PATIENCE
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


class _Stream:
    """A network stream, through FFmpeg."""

    stamps = False
    tells_fps = False  # FFmpeg makes one up
    notes: Sequence[str] = ("no capture time in a stream: a frame's time is when it arrived",)

    def __init__(self, url: str, make: MakeCapture) -> None:
        self.url = url
        self._make = make

    def open(self) -> Capture:
        within = int(1000 * ARRIVES_WITHIN)
        capture = self._make(
            self.url,
            cv2.CAP_FFMPEG,
            [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, within, cv2.CAP_PROP_READ_TIMEOUT_MSEC, within],
        )
        if capture.isOpened():
            return capture
        capture.release()
        raise NoCamera(
            f"stream {self.url} cannot be opened within {ARRIVES_WITHIN:g} s; check the address "
            "in a browser or with ffplay"
        )


class _Webcam:
    """A webcam: MJPG, one buffer, everything that adapts by itself locked once it has settled."""

    stamps = LINUX  # elsewhere the position is none on the clock
    tells_fps = True

    def __init__(
        self,
        index: int,
        size: tuple[int, int] | None,
        fps: float | None,
        make: MakeCapture,
        now: Callable[[], float],
    ) -> None:
        self.index = index
        self.notes: list[str] = []
        self._size, self._fps = size or SIZE, fps or FPS
        self._make = make
        self._now = now
        self._locked: dict[str, float] = {}

    def open(self) -> Capture:
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
        """Let the camera adapt, then keep what it found; what it answered."""
        auto, manual = (3.0, 1.0) if LINUX else (0.75, 0.25)
        before: float | None = None
        if not self._locked:
            capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, auto)
            capture.set(cv2.CAP_PROP_AUTO_WB, 1)
            before = self._brightness(capture, SETTLE)
            self._locked = {name: capture.get(key) for name, key, *_ in _ADAPTS}
        notes = []
        for name, key, switch in _ADAPTS:
            value = self._locked[name]
            if value < 0 and name in ("gain", "focus"):
                continue  # it has none
            off = manual if name == "exposure" else 0.0
            switched = switch is None or capture.set(switch, off)
            kept = capture.set(key, value)
            answer = capture.get(key)
            if switched and kept and math.isclose(answer, value, rel_tol=0.02, abs_tol=0.51):
                notes.append(f"{name} locked at {answer:g}")
            else:
                notes.append(f"{name} cannot be locked (answers {answer:g})")
        after = None if before is None else self._brightness(capture, 5)
        if before and after and not 0.7 < after / before < 1.4:
            # Some drivers tell no exposure while it is automatic; then an old one was locked.
            notes.append(
                f"the lock changed the brightness from {before:.0f} to {after:.0f} of 255: "
                f"set the exposure by hand, e.g. v4l2-ctl -d {DEV}/video{self.index} -l"
            )
        return notes

    def _brightness(self, capture: Capture, frames: int) -> float | None:
        """Mean of the last of some frames, 0 to 255."""
        deadline = self._now() + 2.0
        try:
            for _ in range(frames):
                if not capture.grab() or self._now() > deadline:
                    break
            done, image = capture.retrieve()
        except cv2.error:  # a picture that came in pieces
            return None
        return float(image[::8, ::8].mean()) if done and image is not None else None


_ADAPTS: tuple[tuple[str, int, int | None], ...] = (
    ("exposure", cv2.CAP_PROP_EXPOSURE, cv2.CAP_PROP_AUTO_EXPOSURE),
    ("gain", cv2.CAP_PROP_GAIN, None),
    ("white balance", cv2.CAP_PROP_WB_TEMPERATURE, cv2.CAP_PROP_AUTO_WB),
    ("focus", cv2.CAP_PROP_FOCUS, cv2.CAP_PROP_AUTOFOCUS),
)
"""What a webcam changes by itself: name, value, and the switch that keeps it from doing so."""


def webcams(make: MakeCapture = cv2.VideoCapture) -> dict[int, str]:
    """The webcams that exist: index and name ("" where the system tells none)."""
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
    """Why a webcam does not open, with those that exist."""
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


# The door


def open_camera(
    source: str,
    live: bool = False,
    fps: float | None = None,
    size: tuple[int, int] | None = None,
    now: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
    make: MakeCapture = cv2.VideoCapture,
) -> LiveCamera | Recording:
    """Open whatever the text means.

    Args:
        source: a webcam's index or /dev/video..., a video file, a picture, a folder of pictures
            (png, jpg; in the order of their names), or the URL of a stream.
        live: play files at their own pace.
        fps: what a webcam is asked for; how fast files are played.
        size: (width, height) a webcam is asked for, px.
        now, sleep: the clock, s.
        make: cv2.VideoCapture, or what stands for it.

    Raises:
        NoCamera: it gives no pictures.
    """
    if webcam := WEBCAM.fullmatch(source):
        return LiveCamera(name_of(source), _Webcam(int(webcam[1]), size, fps, make, now), now)
    if size:
        raise NoCamera(f"size {size[0]}x{size[1]}: only a webcam has a choice; {source} has none")
    if "://" in source:
        stream = _Stream(source, make)
        capture = stream.open()
        if capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0:  # a file that lies on a server
            return Recording(source, capture, fps, live, now, sleep)
        return LiveCamera(source, stream, now, capture)
    return Recording(source, _open_files(source, make), fps, live, now, sleep)


def name_of(source: str) -> str:
    """What people call a source, whichever way it is written: /dev/video0 is camera 0."""
    webcam = WEBCAM.fullmatch(source)
    return f"camera {int(webcam[1])}" if webcam else source


def is_live(source: str) -> bool:
    """Whether a source goes on whether or not anybody looks."""
    return "://" in source or bool(WEBCAM.fullmatch(source))


def _open_files(source: str, make: MakeCapture) -> Capture:
    path = Path(source)
    if source and path.is_dir():  # (an empty one would be the folder we stand in)
        files = [file for file in path.iterdir() if file.suffix.lower() in PICTURES]
        if not files:
            raise NoCamera(f"folder {path} has no pictures; png and jpg files are read")
        return _Folder(sorted(files, key=_natural))
    if not source or not path.exists():
        raise NoCamera(
            f"no camera, file or folder '{source}'; give --camera a webcam's number, a video file, "
            "a folder of pictures, a stream (http://, rtsp://) or synthetic"
        )
    if path.suffix.lower() in PICTURES:
        if _read_picture(path) is None:
            raise NoCamera(f"{path} cannot be read as a picture; check the file")
        return _Folder([path])
    video = make(str(path), cv2.CAP_FFMPEG)
    if video.isOpened():
        return video
    video.release()
    what = "is empty" if path.stat().st_size == 0 else "cannot be read as a video"
    raise NoCamera(f"{path} {what}; check that another player shows it, or convert it to mp4")
