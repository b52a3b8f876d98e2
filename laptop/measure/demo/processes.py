"""Child processes of a demo: started together, listened to, ended together."""

from __future__ import annotations

import http.client
import json
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
from typing import Any

from laptop.emulator.bundled_scripts import REPO_ROOT
from laptop.emulator.host.process_exit import BUSY as TOO_BUSY
from laptop.emulator.pace import PacedClock
from laptop.see.serve import announcements
from laptop.see.serve.process_signals import killed_by, signals_ignored
from laptop.system import platforms
from shared.arm_description import ArmError

LAPTOP = (sys.executable, os.path.join(REPO_ROOT, "laptop"))
READY_TIMEOUT, DRAWING_TIMEOUT, SERVO_TIMEOUT, REPORT_TIMEOUT, END_TIMEOUT = (
    300.0,
    600.0,
    600.0,
    600.0,
    60.0,
)
"""Deadlines that only a hang reaches, s: for the tracker and its page; on the emulated clock, for
the lines and for one goal; for the comparison, and for what is asked to end."""
MAX_SLOWDOWN = 10.0
"""Greatest slowdown of the emulated clock, a factor; beyond it the clock itself counts as
stopped."""


class DemoFailed(ArmError):
    """A program of the demo that fails or hangs."""


class TooBusy(DemoFailed):
    """This computer has no time left for the demo."""


class _Pipe:
    """Output of a process, up to its end.

    What it has started (a page, a browser) may keep the pipe open for as long as it likes: no end
    of file comes then.  So the end is written into it, behind all that the process wrote.

    Attributes:
        writing: the descriptor for the process.
    """

    def __init__(self) -> None:
        self._reading, self.writing = os.pipe()
        self._end = os.urandom(16).hex()
        self._ended = False

    def end(self) -> None:
        """Let `lines` end here; nothing if it has been asked before."""
        if not self._ended:
            self._ended = True
            with suppress(BrokenPipeError):  # nobody reads any more
                os.write(self.writing, f"{self._end}\n".encode())
            os.close(self.writing)

    def lines(self) -> Iterator[str]:
        """Iterate over the lines that are written until `end`."""
        with open(self._reading, errors="replace") as stream:
            for line in stream:
                text, end, _ = line.partition(self._end)
                if text:
                    yield text
                if end:
                    return


class ChildProcess:
    """A command of ours in a process of its own; its output is read while it runs.

    Args:
        name: for people.
        args: after `python -m laptop`.  With --json its standard output is read as events.
        log: file for all of its output.
        environment: variables beside those of this process.
        on_line: called with every line for people, in another thread.

    Attributes:
        lines: the last lines for people.
        events: everything announced, see laptop.see.serve.announcements.
    """

    def __init__(
        self,
        name: str,
        args: Sequence[str],
        log: Path,
        environment: dict[str, str],
        on_line: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.name = name
        self.log = log
        self.lines: deque[str] = deque(maxlen=50)
        self.events: list[dict[str, Any]] = []
        self._last_error = ""
        self._on_line = on_line
        self._announces = "--json" in args
        self._lock = threading.Lock()  # one line after the other, whichever pipe has it
        self._output, self._errors = self._pipes = _Pipe(), _Pipe()
        self._process = subprocess.Popen(
            [*LAPTOP, *args],
            cwd=REPO_ROOT,
            env={**os.environ, **environment, "PYTHONUNBUFFERED": "1"},
            stdin=subprocess.DEVNULL,
            stdout=self._output.writing,
            stderr=self._errors.writing,
            # Ctrl-C comes to the demo alone: it knows in which order to end what it has started.
            **platforms.own_group(),
        )
        self._readers = [
            threading.Thread(target=self._read, args=(pipe,), daemon=True) for pipe in self._pipes
        ]
        for reader in self._readers:
            reader.start()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """True until it has ended."""
        return self._process.poll() is None

    def wait(self, limit: float) -> int:
        """Wait until it has ended and all its output is read; return its exit status.

        Args:
            limit: s.

        Raises:
            DemoFailed: it takes longer.
        """
        try:
            status = self._process.wait(limit)
        except subprocess.TimeoutExpired:
            raise self.hangs(limit) from None
        self._join()
        return status

    def hangs(self, limit: float) -> DemoFailed:
        """Return the error of a process that was not done after `limit` s."""
        return DemoFailed(f"{self.name} hangs: not done after {limit:g} s; see {self.log}")

    def failure(self) -> DemoFailed:
        """Return the error of a process that has failed, with its own last words."""
        signal_name = killed_by(self._process.poll())
        if signal_name:
            return DemoFailed(f"{self.name} was killed ({signal_name}); see {self.log}")
        last = self._last_error or (self.lines[-1] if self.lines else "it said nothing")
        kind = TooBusy if self._process.poll() == TOO_BUSY else DemoFailed
        return kind(f"{self.name} failed: {last.removeprefix('laptop: ')}; see {self.log}")

    def interrupt(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        if self.running:
            platforms.interrupt(self._process)

    def end(self, deadline: float) -> None:
        """See to it that it has ended by a time on time.monotonic (s), whatever it does."""
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            platforms.kill_group(self._process)
            self._process.wait()
        self._join()

    def _join(self) -> None:
        """Wait until all is read that it has written; it has ended."""
        for pipe, reader in zip(self._pipes, self._readers, strict=True):
            pipe.end()
            reader.join()

    def _read(self, pipe: _Pipe) -> None:
        with self.log.open("a", encoding="utf-8") as log:
            for line in pipe.lines():
                with self._lock:
                    log.write(line)
                    log.flush()
                    if line.strip():
                        self._handle(line.strip(), pipe)

    def _handle(self, line: str, pipe: _Pipe) -> None:
        if self._announces and pipe is self._output:
            with suppress(ValueError):  # a browser that it opened may write there, too
                self.events.append(json.loads(line))
                return
        if pipe is self._errors:
            self._last_error = line
        self.lines.append(line)
        self._on_line(line)


def log_name(name: str) -> str:
    """Return the file of what a program prints, by the program's name for people."""
    return f"{re.sub('[^a-z0-9]+', '-', name)}.txt"


class ProcessGroup:
    """Child processes that end together; none outlives the group.

    Args:
        folder: for their logs.
        environment: variables of all, beside those of this process.
    """

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self._folder = folder
        self._environment = environment
        self._processes: list[ChildProcess] = []
        # A signal interrupts the main thread alone: what has been started is always on the list.
        # (The executor knows only threads that were not interrupted as they began: this one.)
        self._starter = ThreadPoolExecutor(1)
        self._starter.submit(int).result()

    def start(
        self, name: str, args: Sequence[str], on_line: Callable[[str], None] = lambda line: None
    ) -> ChildProcess:
        """Start a process, see ChildProcess; its log bears its name."""
        log = self._folder / log_name(name)

        def make() -> ChildProcess:
            self._processes.append(ChildProcess(name, args, log, self._environment, on_line))
            return self._processes[-1]

        return self._starter.submit(make).result()

    def close(self) -> None:
        """End all of them; nothing disturbs that."""
        with signals_ignored():
            self._starter.shutdown()
            for process in self._processes:
                process.interrupt()
            deadline = time.monotonic() + END_TIMEOUT
            for process in self._processes:
                process.end(deadline)


@contextmanager
def ending_on_signals() -> Iterator[None]:
    """SIGTERM and its like end the demo as Ctrl-C does, in order."""

    def end(number: int, frame: object) -> None:
        print(f"laptop: stopped by {signal.Signals(number).name}", file=sys.stderr)
        raise SystemExit(128 + number)

    before = {number: signal.signal(number, end) for number in platforms.ENDING[1:]}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class Deadline:
    """A time that only a hang reaches.

    Args:
        clock: the emulated one; that it goes slower is no hang.
        limit: s on it; after MAX_SLOWDOWN times as much by this computer's clock it counts as
            stopped.
    """

    def __init__(self, clock: PacedClock, limit: float) -> None:
        self.limit = limit
        self._clock = clock
        self._ends = clock.now() + limit, time.monotonic() + MAX_SLOWDOWN * limit

    @property
    def passed(self) -> bool:
        """True once it is over."""
        now = self._clock.now(), time.monotonic()
        return any(t > end for t, end in zip(now, self._ends, strict=True))


def answers(address: str) -> bool:
    """Return True if a page answers, and be it that nobody is let in."""
    host = urllib.parse.urlsplit(address).netloc
    connection = http.client.HTTPConnection(host, timeout=READY_TIMEOUT)
    try:
        connection.request("HEAD", "/")
        connection.getresponse()
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()
    return True


def wait_for_event(process: ChildProcess, event: str) -> dict[str, Any]:
    """Wait until a process announces an event, and return it.

    Raises:
        DemoFailed: it has ended before, or takes too long.
    """
    deadline = time.monotonic() + READY_TIMEOUT
    while time.monotonic() < deadline:
        ended = not process.running
        if ended:
            process.wait(END_TIMEOUT)  # until all that it has announced is here
        for announced in list(process.events):
            if announced["event"] == event:
                return announced
        if ended:
            raise process.failure()
        time.sleep(POLL_PERIOD)
    raise process.hangs(READY_TIMEOUT)


def wait_for_link(tracker: ChildProcess) -> tuple[str, str]:
    """Wait until the tracker serves bricks; return HOST:PORT and the pairing code."""
    serving = wait_for_event(tracker, announcements.SERVING)
    return f"{serving['host']}:{serving['port']}", serving["code"]


def wait_for_page(tracker: ChildProcess) -> str:
    """Wait until the tracker has its page; return the address."""
    return wait_for_event(tracker, announcements.PAGE)["url"]


POLL_PERIOD = 0.05
"""Period of checks whether a program has ended, s."""
