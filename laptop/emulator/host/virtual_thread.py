"""Threads of a program, and their computing time between two reads of the clock."""

import sys
import threading
import time as wall
from typing import Optional, Tuple

MYPY = False
if MYPY:
    from typing import List

    from laptop.emulator.host.event_queue import QueuedEvent  # noqa: F401
    from laptop.emulator.host.wait_queue import Waiter  # noqa: F401
    from laptop.emulator.host.world_run import WorldRun

    Call = Tuple[str, int, str]  # file, line, function

_open = open  # of the host


class VirtualThread(object):
    """One thread of the program.

    Attributes:
        name: for people.
        run: WorldRun that it belongs to.
        ident, native: its numbers in Python and on the host; None before the host has begun it.
        gate: lock at which it waits for the baton.
        entry: its event among the sleepers; None if no time wakes it.
        waiter: its Waiter in a WaitQueue; None if it is in none.
        waiting: it waits at its gate.
        detached: it has lost the baton and runs beside the others.
    """

    __slots__ = ("name", "run", "ident", "native", "gate", "entry", "waiter", "waiting", "detached")

    def __init__(self, name: str, run: "WorldRun") -> None:
        self.name = name
        self.run = run
        self.ident = None  # type: Optional[int]
        self.native = None  # type: Optional[int]
        self.gate = threading.Lock()
        self.gate.acquire()
        self.entry = None  # type: Optional[QueuedEvent[VirtualThread]]
        self.waiter = None  # type: Optional[Waiter]
        self.waiting = True
        self.detached = False

    def stack(self) -> "List[Call]":
        """Return its call stack: (file, line, function), the innermost first."""
        found = []  # type: List[Call]
        if self.ident is None:
            return found
        frame = sys._current_frames().get(self.ident)
        while frame is not None:
            found.append((frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name))
            frame = frame.f_back
        return found


class ThreadEffort(object):
    """Time that a thread spends between two visits to the clock.

    Waiting for the host's processor does not count, so a busy computer changes nothing.
    (Where the host has no such figures, each second counts as one of waiting.)

    Args:
        thread: VirtualThread; None spends nothing.
    """

    def __init__(self, thread: Optional[VirtualThread]) -> None:
        self.thread = thread
        self._spent = 0.0, 0.0
        self._before = None  # type: Optional[Tuple[float, float, bool]]

    def sample(self) -> Tuple[float, float]:
        """Return (computing, waiting) time since the first sample, s; waiting for the host.

        It waits if it sleeps now and at the last sample, and has not computed in between; computing
        resets that.  (A wait for the interpreter is a sleep, too, so only a long one counts.)
        """
        if self.thread is None or self.thread.ident is None:  # the host has not begun it yet
            return 0.0, 0.0
        now = wall.monotonic(), _computed(self.thread.ident), _sleeps(self.thread.native)
        if self._before is not None:
            passed, computed = now[0] - self._before[0], now[1] - self._before[1]
            waits = now[2] and self._before[2] and computed < passed / 100
            waited = self._spent[1] + passed if waits else 0.0
            self._spent = self._spent[0] + (0.0 if waits else computed), waited
        self._before = now
        return self._spent


def _computed(ident: int) -> float:
    """Return the CPU time of a thread, s; 0 where it is unknown."""
    try:
        own = getattr(wall, "pthread_getcpuclockid")(ident)  # noqa: B009 Python 3.7
        return wall.clock_gettime(own)
    except (AttributeError, OSError):
        return 0.0


def _sleeps(native: Optional[int]) -> bool:
    """Return True if a thread sleeps, or if that is unknown."""
    try:
        with _open("/proc/self/task/{}/stat".format(native), "rb") as file:
            return file.read().rpartition(b")")[2].split()[0] == b"S"
    except OSError:
        return True
