"""The programs of a demo: started together, listened to, ended together."""

from __future__ import annotations

import http.client
import os
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.parse
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

from laptop.simulator.host.pace import PacedClock
from laptop.simulator.host.process_exit import BUSY as TOO_BUSY
from laptop.tracking.watching import undisturbed
from shared.arm_description import ArmError

Told = TypeVar("Told")
LAPTOP = (sys.executable, "-m", "laptop")
ROOT = Path(__file__).resolve().parents[2]
DRIVER = ROOT / "robot" / "driver.py"
SERVO = ROOT / "robot" / "visual_servoing.py"
READY, DRAWN, SERVOED, COMPARED, ENDED = 300.0, 600.0, 600.0, 600.0, 60.0
"""Deadlines that only a hang reaches, s: for the tracker and its page; on the emulated clock, for
the lines and for one goal; for the comparison, and for what is told to end."""
SLOWEST = 10.0
"""After as many times longer the emulated clock itself has stopped."""


class DemoFailed(ArmError):
    """A program of the demo that fails or hangs."""


class TooBusy(DemoFailed):
    """This computer has no time left for the demo."""


class Program:
    """A command of ours in a process of its own; its lines are read while it runs.

    Args:
        name: for people.
        words: after `python -m laptop`.
        log: where its lines go.
        surroundings: what it is told by environment variables.
        told: called with every line, in another thread.
    """

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        log: Path,
        surroundings: dict[str, str],
        told: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.name = name
        self.log = log
        self.lines: deque[str] = deque(maxlen=50)
        self._told = told
        self._process = subprocess.Popen(
            [*LAPTOP, *words],
            cwd=ROOT,
            env={**os.environ, **surroundings, "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            # Ctrl-C comes to the demo alone: it knows in which order to end what it has started.
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def wait(self, limit: float) -> int:
        """Its exit status.

        Args:
            limit: s.

        Raises:
            DemoFailed: it takes longer.
        """
        try:
            status = self._process.wait(limit)
        except subprocess.TimeoutExpired:
            raise self.hangs(limit) from None
        self._reader.join(ENDED)
        return status

    def hangs(self, limit: float) -> DemoFailed:
        """What to say when it was not done after `limit` s."""
        return DemoFailed(f"{self.name} hangs: not done after {limit:g} s; see {self.log}")

    def complain(self) -> DemoFailed:
        """What to say when it has failed."""
        said = [line for line in self.lines if re.match(r"(laptop|simulate|\w+\.py): ", line)]
        last = (said or list(self.lines) or ["it said nothing"])[-1]
        kind = TooBusy if self._process.poll() == TOO_BUSY else DemoFailed
        return kind(f"{self.name} failed: {last.removeprefix('laptop: ')}; see {self.log}")

    def interrupt(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        if self.running:
            self._process.send_signal(signal.SIGINT)

    def end(self, deadline: float) -> None:
        """See to it that it has ended by a time on time.monotonic (s), whatever it does."""
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            with suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
            self._process.wait()
        self._reader.join(ENDED)
        if self._process.stdout:
            self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout
        with self.log.open("a", encoding="utf-8") as log, suppress(ValueError):
            for line in self._process.stdout:
                log.write(line)
                log.flush()
                if line.strip():
                    self.lines.append(line.strip())
                    self._told(line.strip())


class Crew:
    """The programs of one demo; none outlives it.

    Args:
        folder: for what they say.
        surroundings: of all.
    """

    def __init__(self, folder: Path, surroundings: dict[str, str]) -> None:
        self._folder = folder
        self._surroundings = surroundings
        self._programs: list[Program] = []
        # A signal interrupts the main thread alone: what has been started is always on the list.
        # (The executor knows only threads that were not interrupted as they began: this one.)
        self._starter = ThreadPoolExecutor(1)
        self._starter.submit(int).result()

    def start(
        self, name: str, words: Sequence[str], told: Callable[[str], None] = lambda line: None
    ) -> Program:
        """Start one."""
        log = self._folder / f"{re.sub('[^a-z0-9]+', '-', name)}.txt"

        def make() -> Program:
            self._programs.append(Program(name, words, log, self._surroundings, told))
            return self._programs[-1]

        return self._starter.submit(make).result()

    def close(self) -> None:
        """End all of them; nothing disturbs that."""
        with undisturbed():
            self._starter.shutdown()
            for program in self._programs:
                program.interrupt()
            deadline = time.monotonic() + ENDED
            for program in self._programs:
                program.end(deadline)


_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def ending_on_signals() -> Iterator[None]:
    """SIGTERM and SIGHUP end the demo as Ctrl-C does, in order."""

    def obey(number: int, frame: object) -> None:
        print(f"laptop: stopped by {signal.Signals(number).name}", file=sys.stderr)
        raise SystemExit(128 + number)

    others = [number for number in _SIGNALS if number != signal.SIGINT]
    before = {number: signal.signal(number, obey) for number in others}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class Deadline:
    """A time that only a hang reaches.

    Args:
        clock: the emulated one; that it goes slower is no hang.
        limit: s on it; SLOWEST times as much by this computer's clock says that it has stopped.
    """

    def __init__(self, clock: PacedClock, limit: float) -> None:
        self.limit = limit
        self._clock = clock
        self._ends = clock.now() + limit, time.monotonic() + SLOWEST * limit

    @property
    def passed(self) -> bool:
        """Whether it is over."""
        now = self._clock.now(), time.monotonic()
        return any(t > end for t, end in zip(now, self._ends, strict=True))


def read_invitation(line: str) -> tuple[str, str] | None:
    """HOST:PORT and the pairing code from what the tracker prints; None of another line."""
    found = re.search(r"robot/\w+\.py (\d+(?:\.\d+){3}:\d+) --code (\S+)", line)
    return (found.group(1), found.group(2)) if found else None


def read_page(line: str) -> str | None:
    """The page's address from what the tracker prints; None of another line."""
    found = re.match(r"page: (http://\S+)", line)
    return found.group(1) if found else None


def answers(address: str) -> bool:
    """Whether a page answers, and be it that nobody is let in."""
    host = urllib.parse.urlsplit(address).netloc
    connection = http.client.HTTPConnection(host, timeout=READY)
    try:
        connection.request("HEAD", "/")
        connection.getresponse()
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()
    return True


def said(tracker: Program, read: Callable[[str], Told | None]) -> Told:
    """What is read from the first line of the tracker that has it."""
    deadline = time.monotonic() + READY
    while time.monotonic() < deadline:
        ended = not tracker.running
        if ended:
            tracker.wait(ENDED)  # until all that it has said is here
        for line in list(tracker.lines):
            told = read(line)
            if told is not None:
                return told
        if ended:
            raise tracker.complain()
        time.sleep(LOOK)
    raise tracker.hangs(READY)


LOOK = 0.05
"""Between two looks at whether a program has ended, s."""
