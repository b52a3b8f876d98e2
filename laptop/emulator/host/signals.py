"""A program's signals, handlers, alarms and timers: `signal` on the world's clock.

Rule: no signal handler of the host is changed, and no signal is sent to it.
"""

import os
import re
import signal as real_signal
import sys

from laptop.emulator.host.clocks import copy_module
from laptop.emulator.host.linux import TIMERS, Signals
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.waiting_line import WaitingLine


class ProgramSignals(object):
    """The program's signal handlers; signals arrive by `post`, never by the host's kernel.

    `pending` holds the numbers of those the program has not looked at yet.
    """

    _HARMLESS = (Signals.SIGCHLD, Signals.SIGCONT, Signals.SIGURG, Signals.SIGWINCH)

    def __init__(self, world, clock):
        self._world = world
        self._clock = clock
        self._pausing = WaitingLine(world)
        self._timers = {}
        self.pending = set()
        self._handlers = {
            Signals.SIGINT: real_signal.default_int_handler,
            Signals.SIGPIPE: real_signal.SIG_IGN,
        }

    def post(self, number):
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

    def _call(self, number):
        self.pending.discard(number)
        self._pausing.wake()
        handler = self._handlers.get(number)
        if callable(handler):
            handler(number, sys._getframe(1))

    def module(self):
        """A `signal` module."""
        shim = copy_module(real_signal)
        for name in [name for name in vars(shim) if re.match("SIG[A-Z0-9]+$", name)]:
            delattr(shim, name)
        vars(shim).update(Signals.__members__, Signals=Signals, **TIMERS)
        world, clock = self._world, self._clock

        def signal(signalnum, handler):
            """Set the program's handler; returns the one before."""
            if not world.is_main():
                raise ValueError("signal only works in main thread")
            if signalnum in (Signals.SIGKILL, Signals.SIGSTOP):
                raise OSError(22, os.strerror(22))
            if not callable(handler) and handler not in (real_signal.SIG_DFL, real_signal.SIG_IGN):
                raise TypeError(
                    "signal handler must be signal.SIG_IGN, signal.SIG_DFL, or a callable object"
                )
            before = shim.getsignal(signalnum)
            self._handlers[Signals(signalnum)] = handler
            return before

        def getsignal(signalnum):
            """The program's handler."""
            return self._handlers.get(Signals(signalnum), real_signal.SIG_DFL)

        def pause():
            """Wait for a signal."""
            self._pausing.wait()

        def setitimer(which, seconds, interval=0.0):
            """Send the timer's signal after `seconds` and then every `interval` s, virtual."""
            before = getitimer(which)
            if which in self._timers:
                world.cancel(self._timers.pop(which)[0])
            if seconds > 0:
                self._set_timer(which, seconds, interval)
            return before

        def getitimer(which):
            """(seconds left, interval)."""
            clock.step()
            if which not in self._timers:
                return (0.0, 0.0)
            event, interval = self._timers[which]
            return (max(0.0, event[0] - world.now()), interval)

        def alarm(seconds):
            """Send SIGALRM after `seconds`; returns what was left of the last alarm."""
            return int(round(setitimer(TIMERS["ITIMER_REAL"], seconds)[0]))

        def send(signalnum):
            """Signal the program itself."""
            self.post(signalnum)
            clock.step()

        shim.signal, shim.getsignal, shim.pause = signal, getsignal, pause
        shim.setitimer, shim.getitimer, shim.alarm = setitimer, getitimer, alarm
        shim.raise_signal = send
        shim.pthread_kill = lambda thread_id, signalnum: send(signalnum)
        shim.siginterrupt = lambda signalnum, flag: None
        shim.set_wakeup_fd = lambda fd, warn_on_full_buffer=True: -1
        shim.pthread_sigmask = lambda how, mask: set()
        return shim

    def _set_timer(self, which, seconds, interval):
        number = {
            TIMERS["ITIMER_VIRTUAL"]: Signals.SIGVTALRM,
            TIMERS["ITIMER_PROF"]: Signals.SIGPROF,
        }.get(which, Signals.SIGALRM)

        def ring():
            del self._timers[which]
            if interval > 0:
                self._set_timer(which, interval, interval)
            self.post(number)

        self._timers[which] = (self._world.at(self._world.now() + seconds, ring), interval)
