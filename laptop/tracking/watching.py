"""Watching: camera -> tracker -> server and CSV, once per frame, until the end or a signal.

Every camera has a tracker of its own.  Live cameras are watched side by side, each in a thread, so
that none waits for another; when one ends, the others go on.  Recordings that are not played live
are gone through in turn, frame by frame, so that the same files give the same CSV.
"""

from __future__ import annotations

import csv
import errno
import math
import signal
import statistics
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from laptop.vision.frames import Frame
from laptop.vision.tracker import Sighting, Window
from laptop.vision.view import AnnotatedFrame
from shared import messages
from shared.arm_description import ArmError
from shared.messages import GOAL, LEAST_CONFIDENCE

TICK = 0.2
"""Between two updates of a status line on a terminal, s."""
PIPE_EVERY = 2.0
"""Between two status lines for anybody else, s."""
QUIET = 1.0
"""Without a frame for so long, s, or three frames, a live camera is said to be silent."""
HANG_UP = 2.0
"""A watcher that is busy for longer than this at the end, s, is left to itself."""

STATUS_OF = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
"""Exit status after a signal, as in a shell."""

Point = tuple[float, float]


class Interrupted(ArmError):
    """Cameras that were given up, a disk that is full: what ends tracking before its time."""


class Camera(Protocol):
    """What is used of any camera; see `laptop.vision.cameras`."""

    name: str

    @property
    def fps(self) -> float | None: ...  # noqa: D102
    @property
    def notes(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def ended(self) -> bool: ...  # noqa: D102
    def read(self, timeout: float) -> Frame | None: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class Finder(Protocol):
    """What is used of a tracker."""

    why: dict[str, str]
    windows: dict[str, Window | None]

    def find(self, image: np.ndarray, t: float) -> Mapping[str, Sighting | None]: ...  # noqa: D102


class Publisher(Protocol):
    """What is used of the server while tracking."""

    def publish(self, observation: messages.Observation) -> None: ...  # noqa: D102


class Sheet:
    """The CSV: one row per frame and marker.

    Args:
        file: where it goes; an old one is replaced.
        several: more than one camera, so that a row says which.

    Raises:
        Interrupted: from every method, if the file cannot be written.
    """

    def __init__(self, file: Path, several: bool) -> None:
        self.file = file
        self._several = several
        self._lock = threading.Lock()  # one row after the other, whoever writes it
        with self._complaining():
            self._out = file.open("w", newline="", encoding="utf-8")
            self._writer = csv.writer(self._out, lineterminator="\n")
            heading = ["frame", "t", "marker", "u", "v", "confidence"]
            try:
                self._writer.writerow(heading + ["camera"] * several)
                self._out.flush()
            except OSError:
                with suppress(OSError):  # there is still no room
                    self._out.close()
                raise

    def add(self, camera: str, frame: Frame, markers: Mapping[str, Any]) -> None:
        """One frame's rows; `markers` as in an Observation."""
        t = f"{frame.t:.6f}"
        last = [camera] * self._several
        rows = [
            [frame.index, t, name, *(_figures(seen) if seen else ("", "", "0.000")), *last]
            for name, seen in markers.items()
        ]
        with self._complaining(), self._lock:
            self._writer.writerows(rows)

    def flush(self) -> None:
        """What has been tracked is on the disk from here on."""
        with self._complaining(), self._lock:
            self._out.flush()

    def close(self) -> None:
        """End it."""
        with self._complaining(), self._lock:
            self._out.close()

    @contextmanager
    def _complaining(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            advice = "make room or " if error.errno == errno.ENOSPC else ""
            raise Interrupted(
                f"cannot write {self.file}: {error.strerror}; {advice}choose another with --csv"
            ) from None


def _figures(seen: Sequence[float]) -> tuple[str, str, str]:
    u, v, confidence = seen
    return f"{u:.3f}", f"{v:.3f}", f"{confidence:.3f}"


class Tally:
    """How often a marker was seen, how surely, and what hid it."""

    def __init__(self) -> None:
        self.seen = 0
        self.lost: Counter[str] = Counter()
        self._confidences = [0] * 101  # a histogram, for there may be millions

    def add(self, confidence: float | None, why: str) -> None:
        """One frame; confidence None: not seen."""
        if confidence is None:
            self.lost[why or "not seen"] += 1
        else:
            self.seen += 1
            self._confidences[min(100, max(0, round(100 * confidence)))] += 1

    @property
    def frames(self) -> int:
        """How many were looked at."""
        return self.seen + self.lost.total()

    @property
    def reliable(self) -> int:
        """In how many it may be relied upon."""
        return sum(self._confidences[round(100 * LEAST_CONFIDENCE) :])

    @property
    def confidence(self) -> float:
        """The median, where it was seen."""
        counted = 0
        for percent, count in enumerate(self._confidences):
            counted += count
            if counted and 2 * counted >= self.seen:
                return percent / 100
        return math.nan


class Watcher:
    """One camera with its tracker, and what became of its frames.

    Args:
        name: short name of the camera in observations, "A", "B", ...
        camera: where the frames come from.
        tracker: finds the markers in them.
        goal: a fixed goal (u, v), px, or None.
        server: hears of every frame, or None.
        sheet: gets every frame's rows, or None.
        live: the camera goes on whether or not anybody looks.
        keep: index of the frame to keep as a picture; None: the last one.
        now: the clock of live capture times, s.

    Attributes:
        ended: the camera gives no more frames.
    """

    def __init__(
        self,
        name: str,
        camera: Camera,
        tracker: Finder,
        goal: Point | None = None,
        server: Publisher | None = None,
        sheet: Sheet | None = None,
        live: bool = True,
        keep: int | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = name
        self.camera = camera
        self.live = live
        self.ended = False
        self.frames = 0
        self.dropped = 0
        self.tallies: dict[str, Tally] = {}
        self.view: AnnotatedFrame | None = None
        self._looked = threading.Condition()  # at a frame
        self._tracker = tracker
        self._fixed = {GOAL: (*goal, 1.0)} if goal else {}
        self._server = server
        self._sheet = sheet
        self._keep = keep
        self._kept: AnnotatedFrame | None = None
        self._now = now
        self._ages: deque[float] = deque(maxlen=30)
        self._moments: deque[tuple[float, int]] = deque(maxlen=60)
        self._index: int | None = None
        self._heard = now()

    def begin(self) -> None:
        """From here on there is one step after the other."""
        getattr(self.camera, "keep_pace", lambda: None)()

    def step(self, timeout: float) -> bool:
        """One frame, if one comes within the timeout (s); False once there are no more."""
        frame = self.camera.read(timeout)
        if frame is None:
            self.ended = self.camera.ended
            return not self.ended
        self._heard = self._now()
        found = dict(self._tracker.find(frame.image, frame.t))
        markers: dict[str, tuple[float, float, float] | None] = {
            name: seen and (seen.u, seen.v, seen.confidence) for name, seen in found.items()
        }
        markers.update(self._fixed)
        if self._server:
            self._server.publish(messages.Observation(frame.index, self.name, frame.t, markers))
        if self.live:
            self._ages.append(self._now() - frame.t)
        if self._sheet:
            self._sheet.add(self.name, frame, markers)
        self._count(frame, found)
        return True

    def _count(self, frame: Frame, found: dict[str, Sighting | None]) -> None:
        why = dict(self._tracker.why)
        for name, seen in found.items():
            tally = self.tallies.setdefault(name, Tally())
            tally.add(seen and seen.confidence, why.get(name, ""))
        if self.live and self._index is not None:
            self.dropped += max(0, frame.index - self._index - 1)
        self._index = frame.index
        self.frames += 1
        with self._looked:
            self.view = AnnotatedFrame(frame, found, why, self._fixed, self._tracker.windows)
            self._looked.notify_all()
        if self._keep is not None and self._kept is None and frame.index >= self._keep:
            self._kept = self.view

    def wait(self, timeout: float) -> None:
        """Until the next frame has been looked at, or for so long (s)."""
        with self._looked:
            self._looked.wait(timeout)

    @property
    def picture(self) -> AnnotatedFrame | None:
        """The view that was asked for, or the last one; None: there is none."""
        return self.view if self._keep is None else self._kept

    @property
    def trouble(self) -> str:
        """What is wrong with the camera, or ""."""
        return getattr(self.camera, "why", "")

    @property
    def silence(self) -> str:
        """For how long a live camera has given nothing, in words, or ""."""
        silent = self._now() - self._heard
        usual = max(QUIET, 3 / self.camera.fps if self.camera.fps else QUIET)
        return f"no frame for {silent:.0f} s" if self.live and silent > usual else ""

    @property
    def slowness(self) -> str:
        """That this computer does not keep pace with a synthetic camera, in words, or ""."""
        return getattr(self.camera, "slowness", "")

    @property
    def age(self) -> float | None:
        """Of the last frames of a live camera when they had been looked at, s; None without any."""
        ages = list(self._ages)
        return statistics.median(ages) if ages else None

    def rate(self) -> float:
        """Frames per second over the last second or two, up to now."""
        now = self._now()
        while len(self._moments) > 1 and now - self._moments[1][0] >= 1.0:
            self._moments.popleft()
        before, frames = self._moments[0] if self._moments else (now, self.frames)
        self._moments.append((now, self.frames))
        return (self.frames - frames) / (now - before) if now > before else 0.0

    def status(self) -> str:
        """What it sees, in one line."""
        if self.ended:
            return f"{self.trouble or 'ended'}, {self.frames} frames"
        parts = [f"{self.rate():.0f} fps"]
        if missing := self.trouble or self.silence:  # what was seen last is seen no more
            return ", ".join([*parts, missing])
        if self.view:
            for name, seen in self.view.found.items():
                if seen:
                    parts.append(f"{name} {seen.u:.1f},{seen.v:.1f} ({seen.confidence:.2f})")
                else:
                    parts.append(f"{name} lost: {self.view.why.get(name) or 'not seen'}")
        parts += [f"{name} {u:g},{v:g} (fixed)" for name, (u, v, _) in self._fixed.items()]
        if self.age is not None:
            parts.append(f"age {1000 * self.age:.0f} ms")
        if self.dropped:
            parts.append(f"{self.dropped} dropped")
        return ", ".join([*parts, *filter(None, [self.slowness])])


class Run:
    """Watches until every camera has ended and nobody looks any more, or a signal comes.

    Args:
        watchers: one for each camera.
        sheet: is kept on the disk meanwhile, or None.
        link: says in a few words who is connected, or None.
        console: where the status goes.
        watched: whether somebody still looks at what there was, as long as all went well.
    """

    def __init__(
        self,
        watchers: Sequence[Watcher],
        sheet: Sheet | None,
        link: Callable[[], str] | None,
        console: Console,
        watched: Callable[[], bool] = lambda: False,
    ) -> None:
        self._watchers = watchers
        self._sheet = sheet
        self._link = link
        self._console = console
        self._watched = watched
        self._staying = False  # though every camera has ended
        self._stop = threading.Event()
        self._over = threading.Event()
        self._signal: int | None = None
        self._error: BaseException | None = None
        self._printed = -math.inf
        self._told: list[Watcher] = []  # that they have ended
        self.threads: list[threading.Thread] = []

    def run(self) -> int:
        """Exit status: 0 at the end, or that of the signal that came before.

        Raises:
            Interrupted: no camera is left and some were given up, or the sheet cannot be written.
        """
        with self._signals():
            groups = [[watcher] for watcher in self._watchers if watcher.live]
            in_turn = [watcher for watcher in self._watchers if not watcher.live]
            groups += [in_turn] if in_turn else []
            left = threading.Semaphore(0)
            self.threads = [
                threading.Thread(target=self._work, args=(group, left), daemon=True)
                for group in groups
            ]
            for thread in self.threads:
                thread.start()
            try:
                self._wait(len(groups), left)
            finally:
                self._stop.set()
                deadline = time.monotonic() + HANG_UP
                for thread in self.threads:
                    thread.join(max(0.0, deadline - time.monotonic()))
        if self._error:
            raise self._error
        if self._signal and not self._staying:
            return STATUS_OF[signal.Signals(self._signal)]
        if given_up := [watcher.trouble for watcher in self._watchers if watcher.trouble]:
            raise Interrupted("; ".join(given_up))
        return 0

    @property
    def ended_by(self) -> str:
        """The name of the signal that ended it before its time, or ""."""
        if not self._signal or self._staying:
            return ""
        name = signal.Signals(self._signal).name
        return "Ctrl-C" if name == "SIGINT" else name

    def _work(self, group: list[Watcher], left: threading.Semaphore) -> None:
        try:
            for watcher in group:
                watcher.begin()
            while group and not self._stop.is_set():
                for watcher in list(group):
                    if not watcher.step(TICK):
                        group.remove(watcher)
        except BaseException as error:  # it is the main thread's to tell
            self._error = self._error or error
            self._stop.set()
        finally:
            left.release()
            self._over.set()

    def _wait(self, running: int, left: threading.Semaphore) -> None:
        with self._display() as show:
            while (running or self._stays()) and not (self._stop.is_set() or self._signal):
                self._over.wait(TICK)
                self._over.clear()
                while left.acquire(blocking=False):
                    running -= 1
                self._tell_ends()
                show()
                if self._sheet:
                    self._sheet.flush()

    def _stays(self) -> bool:
        """Whether somebody looks at what has ended."""
        if self._error or any(watcher.trouble for watcher in self._watchers):
            return False
        stays = self._watched()
        if stays and not self._staying:
            self._staying = True
            speaker(self._console)(
                "all is tracked; the page shows it as long as it is open: close it, or Ctrl-C"
            )
        return stays

    def _tell_ends(self) -> None:
        """Which live cameras have ended since, and who goes on."""
        going = [watcher.name for watcher in self._watchers if not watcher.ended]
        for watcher in self._watchers:
            if watcher.ended and watcher.live and going and watcher not in self._told:
                self._told.append(watcher)
                others = f"{' and '.join(going)} {'goes' if len(going) == 1 else 'go'} on"
                speaker(self._console)(f"camera {watcher.name}: {watcher.status()}; {others}")

    @contextmanager
    def _signals(self) -> Iterator[None]:
        """Signals end the run; everything is closed as at its end."""

        def obey(number: int, _frame: object) -> None:
            # No Event is set here: it may just be waited for, with its lock held, for ever then.
            self._signal = number

        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, obey) for number in STATUS_OF}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def lines(self) -> list[str]:
        """The status: a line for each camera, and one for the link."""
        lines = [watcher.status() for watcher in self._watchers]
        if len(lines) > 1:
            lines = [f"{w.name}: {line}" for w, line in zip(self._watchers, lines, strict=True)]
        return [*lines, self._link()] if self._link else lines

    @contextmanager
    def _display(self) -> Iterator[Callable[[], None]]:
        live = any(watcher.live for watcher in self._watchers)
        for watcher in self._watchers:
            watcher.rate()  # counts from here on
        self._printed = time.monotonic() - PIPE_EVERY + 1.0  # there is little to say before
        if not self._console.is_terminal:
            yield self._print_lines if live else (lambda: None)
            return
        bar = None if live else self._bar()
        with Live(console=self._console, auto_refresh=False, transient=True) as shown:

            def show() -> None:
                text = Text("\n".join(self.lines()), no_wrap=True, overflow="ellipsis")
                if bar:
                    bar.update(bar.task_ids[0], completed=sum(w.frames for w in self._watchers))
                shown.update(Group(bar, text) if bar else text, refresh=True)

            show()
            yield show

    def _bar(self) -> Progress:
        counts = [getattr(watcher.camera, "count", None) or 0 for watcher in self._watchers]
        total = sum(counts) if all(counts) else None
        columns = ("tracking", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        bar = Progress(*columns, console=self._console)
        bar.add_task("tracking", total=total)
        return bar

    def _print_lines(self) -> None:
        now = time.monotonic()
        if now - self._printed >= PIPE_EVERY:
            self._printed = now
            lines = self.lines()
            for line in lines if len(self._watchers) > 1 else ["; ".join(lines)]:
                speaker(self._console)(line)


@contextmanager
def undisturbed() -> Iterator[None]:
    """While the block runs signals are ignored: what ends in order does so in any case."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    while len(before) < len(STATUS_OF):
        # One may just have come in, and wait to be noticed.
        with suppress(KeyboardInterrupt, SystemExit):
            for number in STATUS_OF.keys() - before.keys():
                before[number] = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def speaker(console: Console) -> Callable[[str], None]:
    """Prints a line as it is: not folded, not coloured."""
    return lambda line: console.print(line, soft_wrap=True, highlight=False, markup=False)


def summary(watchers: Sequence[Watcher]) -> Table:
    """How often each marker was seen."""
    several = len(watchers) > 1
    table = Table(
        *(["camera"] * several),
        "marker",
        "seen",
        "%",
        f"{LEAST_CONFIDENCE:g} or\nmore, %",
        "median\nconfidence",
        "else mostly",
    )
    for watcher in watchers:
        for name, tally in watcher.tallies.items():
            most = tally.lost.most_common(1)
            table.add_row(
                *([watcher.name] * several),
                name,
                f"{tally.seen} of {tally.frames}",
                f"{100 * tally.seen / tally.frames:.1f}",
                f"{100 * tally.reliable / tally.frames:.1f}",
                f"{tally.confidence:.2f}" if tally.seen else "",
                most[0][0] if most else "",
            )
    return table
