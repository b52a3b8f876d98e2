"""One run of a program in a world: its threads, the holder of the baton, and its end."""

import collections
import threading
from typing import Optional

from laptop.emulator.host.event_queue import EventQueue
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit

MYPY = False
if MYPY:
    from typing import Callable, Deque, List, Sequence  # noqa: F401

    from laptop.emulator.host.virtual_thread import Call, VirtualThread  # noqa: F401


class WorldRun(object):
    """A run of a program; callers hold the world's mutex.

    Args:
        limit: the run is cut off at this virtual time, s.
        begun: False for the placeholder before the first run.

    Attributes:
        limit, begun: as above.
        exit: ProcessExit; None while it runs.
        cut_at: call stack of its main thread if it was cut off, see VirtualThread.stack.
        failure: exception of the emulator itself; None without one.
        over: whether it has ended, a threading.Event.
        main: its main thread; None before it starts.
        holder: the thread that has the baton; None while time passes.
        alive: its threads that have not ended.
        detached: number of threads that have lost the baton and run beside the others.
        sleepers: EventQueue of the threads that are to be woken.
        interrupts: functions that its main thread is to call next.
        visits: number of visits of threads to the clock.
    """

    def __init__(self, limit: Optional[float] = None, begun: bool = True) -> None:
        self.limit = limit
        self.begun = begun
        self.exit = None  # type: Optional[ProcessExit]
        self.cut_at = ()  # type: Sequence[Call]
        self.failure = None  # type: Optional[Exception]
        self.over = threading.Event()
        self.main = None  # type: Optional[VirtualThread]
        self.holder = None  # type: Optional[VirtualThread]
        self.alive = []  # type: List[VirtualThread]
        self.detached = 0
        self.sleepers = EventQueue()  # type: EventQueue[VirtualThread]
        self.interrupts = collections.deque()  # type: Deque[Callable[[], object]]
        self.visits = 0

    def end(self, process_exit: ProcessExit) -> None:
        """End it, for whatever reason; the first exit stands."""
        if self.exit is None:
            self.exit = process_exit
            if process_exit.status == ENDLESS and self.main is not None:
                self.cut_at = self.main.stack()
            self.over.set()

    def wake_at(self, thread: "VirtualThread", t: Optional[float]) -> None:
        """Schedule the wake-up of a thread at `t` (s; None: never), in place of an earlier one."""
        if thread.entry is not None:
            thread.entry.what = None
        thread.entry = None if t is None else self.sleepers.add(t, thread)

    def pop_due(self, t: float) -> "Optional[VirtualThread]":
        """Remove and return the next thread that is to be woken by `t`, s; None without one."""
        self.sleepers.drop_cancelled()
        if self.sleepers.first_t > t:
            return None
        thread = self.sleepers.pop().what
        if thread is not None:
            thread.entry = None
        return thread

    def detach(self, thread: "VirtualThread") -> None:
        """Detach a thread: it runs beside the others, without the baton."""
        thread.detached = True
        self.detached += 1

    def reattach(self, thread: "VirtualThread") -> None:
        """End the detachment of a thread."""
        thread.detached = False
        self.detached -= 1

    def is_awaited(
        self, events: "EventQueue[Callable[[], object]]", holder: "Optional[VirtualThread]" = None
    ) -> bool:
        """Return True if time must go on for a sleeper, or for a waiter that an event may wake.

        Args:
            events: of the world.
            holder: a thread that does not count as one who waits.
        """
        if self.sleepers.has_pending():
            return True
        waiting = any(not thread.detached and thread is not holder for thread in self.alive)
        return waiting and events.has_pending()
