"""A program's signals, handlers, alarms and timers: `signal` on the world's clock.

Rule: no signal handler of the host is changed, and no signal is sent to it.
"""

import os
import re
import signal as real_signal
import sys
from types import ModuleType
from typing import Callable, Tuple

from laptop.emulator.host.clocks import copy_module
from laptop.emulator.host.linux import TIMERS, Signals
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.wait_queue import WaitQueue

MYPY = False
if MYPY:
    from types import FrameType
    from typing import Dict, Optional, Set, Union  # noqa: F401

    from laptop.emulator.host.clocks import ProgramClock
    from laptop.emulator.host.world import Event, World  # noqa: F401

    Handler = Union[Callable[[int, Optional[FrameType]], object], int, None]  # or SIG_DFL, SIG_IGN


class ProgramSignals(object):
    """The program's signal handlers; signals arrive by `post`, never by the host's kernel.

    `pending` holds the numbers of those the program has not handled yet.
    """

    _HARMLESS = (Signals.SIGCHLD, Signals.SIGCONT, Signals.SIGURG, Signals.SIGWINCH)

    def __init__(self, world: "World", clock: "ProgramClock") -> None:
        self._world = world
        self._clock = clock
        self._pausing = WaitQueue(world)
        self._timers = ProgramTimers(world, clock, self.post)
        self.pending = set()  # type: Set[int]
        self._handlers = {  # type: Dict[int, Handler]
            Signals.SIGINT: real_signal.default_int_handler,
            Signals.SIGPIPE: real_signal.SIG_IGN,
        }

    def post(self, number: int) -> None:
        """Deliver a signal to the program, now: its own handler runs, or the default action."""
        world = self._world
        if world.exit is not None:
            return
        name = Signals(number).name
        handler = self._handlers.get(number, real_signal.SIG_DFL)
        if number == Signals.SIGSTOP:
            world.halt(ProcessExit(ENDLESS, "frozen"))
        elif number == Signals.SIGKILL or handler == real_signal.SIG_DFL:
            if number not in self._HARMLESS:
                world.halt(ProcessExit(128 + number, name))
        elif handler != real_signal.SIG_IGN:
            self.pending.add(number)
            world.interrupt(lambda: self._call(number))

    def _call(self, number: int) -> None:
        self.pending.discard(number)
        self._pausing.wake()
        handler = self._handlers.get(number)
        if callable(handler):
            handler(number, sys._getframe(1))

    def module(self) -> ModuleType:
        """Make a `signal` module."""
        shim = copy_module(real_signal)
        for name in [name for name in vars(shim) if re.match("SIG[A-Z0-9]+$", name)]:
            delattr(shim, name)
        timers = self._timers
        vars(shim).update(Signals.__members__, Signals=Signals, **TIMERS)
        vars(shim).update(
            signal=self.signal,
            getsignal=self.getsignal,
            pause=self.pause,
            setitimer=timers.setitimer,
            getitimer=timers.getitimer,
            alarm=timers.alarm,
            raise_signal=self.raise_signal,
            pthread_kill=lambda thread_id, signalnum: self.raise_signal(signalnum),
            siginterrupt=lambda signalnum, flag: None,
            set_wakeup_fd=lambda fd, warn_on_full_buffer=True: -1,
            pthread_sigmask=lambda how, mask: set(),
        )
        return shim

    # Functions of the module

    def signal(self, signalnum: int, handler: "Handler") -> "Handler":
        """Set the program's handler; return the previous one."""
        if not self._world.is_main():
            raise ValueError("signal only works in main thread")
        if signalnum in (Signals.SIGKILL, Signals.SIGSTOP):
            raise OSError(22, os.strerror(22))
        if not callable(handler) and handler not in (real_signal.SIG_DFL, real_signal.SIG_IGN):
            raise TypeError(
                "signal handler must be signal.SIG_IGN, signal.SIG_DFL, or a callable object"
            )
        before = self.getsignal(signalnum)
        self._handlers[Signals(signalnum)] = handler
        return before

    def getsignal(self, signalnum: int) -> "Handler":
        """Return the program's handler."""
        return self._handlers.get(Signals(signalnum), real_signal.SIG_DFL)

    def pause(self) -> None:
        """Wait for a signal."""
        self._pausing.wait()

    def raise_signal(self, signalnum: int) -> None:
        """Signal the program itself."""
        self.post(signalnum)
        self._clock.step()


class ProgramTimers(object):
    """The program's interval timers.

    Args:
        post: called with the number of a signal when a timer rings.
    """

    def __init__(
        self, world: "World", clock: "ProgramClock", post: Callable[[int], object]
    ) -> None:
        self._world = world
        self._clock = clock
        self._post = post
        self._running = {}  # type: Dict[int, Tuple[Event, float]]

    def setitimer(self, which: int, seconds: float, interval: float = 0.0) -> Tuple[float, float]:
        """Send the timer's signal after `seconds` and then every `interval` s, virtual."""
        before = self.getitimer(which)
        if which in self._running:
            self._world.cancel(self._running.pop(which)[0])
        if seconds > 0:
            self._start(which, seconds, interval)
        return before

    def getitimer(self, which: int) -> Tuple[float, float]:
        """Return (time left, interval), s."""
        self._clock.step()
        if which not in self._running:
            return (0.0, 0.0)
        event, interval = self._running[which]
        return (max(0.0, event.t - self._world.now()), interval)

    def alarm(self, seconds: float) -> int:
        """Send SIGALRM after `seconds`; return the time left of the previous alarm."""
        return int(round(self.setitimer(TIMERS["ITIMER_REAL"], seconds)[0]))

    def _start(self, which: int, seconds: float, interval: float) -> None:
        number = {
            TIMERS["ITIMER_VIRTUAL"]: Signals.SIGVTALRM,
            TIMERS["ITIMER_PROF"]: Signals.SIGPROF,
        }.get(which, Signals.SIGALRM)

        def ring() -> None:
            del self._running[which]
            if interval > 0:
                self._start(which, interval, interval)
            self._post(number)

        self._running[which] = (self._world.at(self._world.now() + seconds, ring), interval)
