"""Watchdog over a running program: does it read the clock, is the host too busy?"""

import ctypes
import time as wall
from typing import Tuple

from laptop.emulator.host.process_exit import BUSY, ENDLESS, ProcessExit
from laptop.emulator.host.virtual_thread import ThreadEffort
from laptop.emulator.pace import BUSY_PACE, in_words

MYPY = False
if MYPY:
    from typing import Dict, Optional  # noqa: F401

    from laptop.emulator.host.pacer import Pacer
    from laptop.emulator.host.virtual_thread import VirtualThread  # noqa: F401
    from laptop.emulator.host.world import World
    from laptop.emulator.host.world_run import WorldRun

CRAWL_PACE = 0.01
"""Least pace in real time, emulated seconds per wall second; below it a run ends."""

BUSY_NOTICE_PERIOD = 10.0
"""Least time between two notices that the host is busy, wall s."""

STRAY_TIMEOUT = 0.5
"""Time to wait for a thread that computes after the end, or waits for the host, s."""


class Over(BaseException):
    """Raised in a thread that still computes after the end; never in one inside the world."""


class Watchdog(object):
    """Watchdog of a world's program, in a thread of the host.

    Args:
        world: World, whose mutex it takes and whose threads it knows.
    """

    YIELD_TIMEOUT = 0.25
    """Time that a thread may compute away from the clock while others could run, wall s."""
    YIELD_TIMEOUT_REALTIME = 0.02
    """The same in real time, wall s."""
    WAIT_TIMEOUT = 60.0
    """Time for which all may wait for a thread that waits for the host, if the program's patience
    is as long, wall s."""
    HEARING_TIMEOUT = 2.0
    """Time within which the main thread must handle an interrupt, computing or waiting, s."""

    def __init__(self, world: "World") -> None:
        self._world = world
        self._noticed = -BUSY_NOTICE_PERIOD
        # Of the main thread since an interrupt came.
        self._hearing = None  # type: Optional[ThreadEffort]

    def watch(self, run: "WorldRun", patience: float) -> None:
        """Watch a run of a program until it is over, and clean up after it.

        Args:
            run: WorldRun.
            patience: greatest computing time without a visit to the clock, s of the host.
        """
        world = self._world
        effort, seen = ThreadEffort(None), None  # type: ThreadEffort, Optional[int]
        pacer = world.pacer if world.realtime else None
        while not run.over.wait(0.05 if pacer is None else 0.01):
            with world._mutex:
                detached = (thread for thread in run.alive if thread.detached)
                working = run.holder or next(detached, None)
                paced = pacer is not None and pacer.waiting
                if run.visits != seen or paced or working is not effort.thread:
                    seen, effort = run.visits, ThreadEffort(working)
                else:
                    self._yield_to_others(run, working, effort.sample(), patience)
                self._check_interrupts(run)
            if pacer is not None:
                self._check_pace(pacer)
        self._stop_strays(run)

    def _yield_to_others(
        self,
        run: "WorldRun",
        thread: "Optional[VirtualThread]",
        effort: Tuple[float, float],
        patience: float,
    ) -> None:
        """Let other threads, or in real time the world, go on beside a thread that does not come.

        Args:
            run: WorldRun.
            thread: the one that does not come to the clock; None: no thread has the baton.
            effort: (computing, waiting) time since its last visit to the clock, s.
            patience: greatest computing time without a visit to the clock, s of the host.
        """
        world, pacer = self._world, self._world.pacer
        computed, waited = effort
        limit = self.YIELD_TIMEOUT_REALTIME if world.realtime else self.YIELD_TIMEOUT
        late = computed >= limit or waited >= self.YIELD_TIMEOUT
        left = self.WAIT_TIMEOUT if run.limit is None else run.limit - world.t
        if computed >= patience:
            world.halt(ProcessExit(ENDLESS, "stuck"))
        elif waited >= min(left, self.WAIT_TIMEOUT) and not world.typing:
            world.halt(ProcessExit(ENDLESS, "waiting"))
        elif thread is None or thread is not run.holder or not late:
            return
        elif run.is_awaited(world._events, thread):
            run.detach(thread)
            world._dispatch(None)
        elif pacer is not None and pacer.joined and waited >= self.YIELD_TIMEOUT:
            world._drift(pacer)

    def _check_interrupts(self, run: "WorldRun") -> None:
        """Report an interrupt that the program's main thread does not handle."""
        main = run.main
        if not run.interrupts or main is None or main.waiting:
            self._hearing = None
        elif self._hearing is None or self._hearing.thread is not main:
            self._hearing = ThreadEffort(main)
        elif sum(self._hearing.sample()) >= self.HEARING_TIMEOUT:
            self._world.on_timeout()

    def _check_pace(self, pacer: "Pacer") -> None:
        """Report that the host is busy; end the run where it is far too busy."""
        world = self._world
        if pacer.long_pace.sample() < CRAWL_PACE:
            world.awaited = pacer.latest
            world.halt(ProcessExit(BUSY, "too busy"))
        now = wall.monotonic()
        if pacer.pace.sample() < BUSY_PACE and now - self._noticed >= BUSY_NOTICE_PERIOD:
            self._noticed = now
            world.report(in_words(pacer.pace.latest))

    def _stop_strays(self, run: "WorldRun") -> None:
        """Stop threads that were computing when the program ended."""
        world = self._world
        throw = ctypes.pythonapi.PyThreadState_SetAsyncExc
        for attempt in range(2):
            efforts = {}  # type: Dict[VirtualThread, ThreadEffort]
            while True:
                with world._mutex:
                    astray = [thread for thread in run.alive if not thread.waiting]
                    spent = [
                        sum(efforts.setdefault(thread, ThreadEffort(thread)).sample())
                        for thread in astray
                    ]
                if not astray:
                    return
                if min(spent) >= STRAY_TIMEOUT:
                    break
                wall.sleep(0.0005)
            for thread in astray:
                if attempt == 0 and thread.ident is not None:
                    throw(ctypes.c_ulong(thread.ident), ctypes.py_object(Over))
