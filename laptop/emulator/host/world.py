"""Virtual time of the emulated world: a clock that advances by waits and computing alone.

This is discrete-event simulation (Law, Simulation Modeling and Analysis, ch. 1): the clock jumps to
the next event or thread's wake-up. Between two of them the bodies integrate their physics. Host
time plays no part, so a run is reproducible, and a minute of waiting takes no time. With a
`pacer` the same clock waits for the paced clock of laptop.emulator.pace before each step.

Rules:
1. Physics is integrated up to the present before any read of it, and events happen exactly at
   their time, before any program code that runs later.
2. A program's threads are real threads that pass one baton: exactly one runs.  It changes hands
   only when its holder waits, ends, or spends time past another's wake-up; runs are reproducible.
3. When the program is over, none of its threads ever leaves the world again: a killed
   program runs no `finally`, prints nothing and writes no file.

The one exception to rule 2: a thread that computes for `Watchdog.YIELD_TIMEOUT` of wall time
without touching the clock, while others could run, loses the baton and runs beside them until it
touches the clock again (`while not flag: pass`, where another thread sets the flag).  Where
computing takes time, each `while` touches it by itself, see counting.LOOK.
"""

import gc
import math
import threading
import time as wall
from typing import Callable, Optional

from laptop.emulator.host.event_queue import EventQueue, QueuedEvent
from laptop.emulator.host.pacer import Pacer
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.virtual_thread import VirtualThread
from laptop.emulator.host.watchdog import Over, Watchdog
from laptop.emulator.host.world_run import WorldRun

MYPY = False
if MYPY:
    from typing import Any, Dict, List, NoReturn, Sequence, Tuple  # noqa: F401

    from laptop.emulator.host.processor import Processor  # noqa: F401
    from laptop.emulator.host.virtual_thread import Call
    from laptop.emulator.host.wait_queue import Waiter
    from laptop.emulator.pace import PacedClock, PaceMeter

    Action = Callable[[], object]
    Event = QueuedEvent[Action]
    Address = Tuple[str, int]  # host, port
    Files = Sequence[Any]  # descriptors, or what has a fileno()
    Ready = Tuple[List[Any], List[Any], List[Any]]  # to be read, to be written, with an exception
    Select = Callable[[Files, Files, Files, Optional[float]], Ready]


class _Local(threading.local):
    thread = None  # type: Optional[VirtualThread]


class World(object):
    """Virtual time (s), the bodies that live in it, its events and the threads of a program.

    Args:
        clock: pace.PacedClock that virtual time follows, shared with others; None: it runs as fast
            as it can.
        name: for the messages of those that wait for it.

    Attributes:
        t: virtual time, s.
        realtime: whether it follows the clock.
        pacer: Pacer of the clock; None without one.
        report: called with a line for people while the host is busy.
        typing: whether a thread waits for keyboard input, without a limit of time.
        on_timeout: called when the program's main thread does not handle an `interrupt`.
        processor: processor.Processor that the program computes on; None: it computes in no time.
        awaited: name of the member that the clock waited for when it gave up.
        select: substitute for the program's select.select where the peer of its sockets lives in
            this world, too; else None.
        addresses: address that a program connects to -> address on this computer, if another.
    """

    STEP_PAUSE = 0.001
    """Pause before each step beside a detached thread, wall s: it sees the work of others before
    time goes on."""
    REALTIME_STEP = 0.005
    """Longest step of the bodies in real time, s."""
    DRIFT = 0.05
    """Step of the time while a program waits for the host, s."""

    def __init__(self, clock: "Optional[PacedClock]" = None, name: str = "brick") -> None:
        self.name = name
        self.t = 0.0
        self.bodies = []  # type: List[Callable[[float], object]]
        self.realtime = clock is not None
        self.select = None  # type: Optional[Select]
        self.addresses = {}  # type: Dict[Address, Address]
        self.busy = 0.0
        self._events = EventQueue()  # type: EventQueue[Action]
        self.pacer = None if clock is None else Pacer(clock)
        self.report = lambda line: None  # type: Callable[[str], object]
        self.typing = False
        self.on_timeout = lambda: None  # type: Action
        self.processor = None  # type: Optional[Processor]
        self.awaited = ""
        self._zero = wall.monotonic()
        self._mutex = threading.RLock()
        self._news = threading.Condition(self._mutex)
        self._local = _Local()
        self._run = WorldRun(begun=False)
        self._dispatching = False
        self._hurry = False
        self._watchdog = Watchdog(self)

    # The clock

    def now(self) -> float:
        """Return the virtual time, s."""
        return self.t

    @property
    def zero(self) -> float:
        """Time of the paced clock, or of the wall's without one, at the virtual time 0, s."""
        return self._zero if self.pacer is None else self.pacer.zero

    @property
    def exit(self) -> Optional[ProcessExit]:
        """ProcessExit of the program; None while it runs."""
        return self._run.exit

    @property
    def cut_at(self) -> "Sequence[Call]":
        """Stack of its main thread if it was cut off, see VirtualThread.stack."""
        return self._run.cut_at

    @property
    def pace(self) -> "Optional[PaceMeter]":
        """PaceMeter of the clock over seconds; None without one."""
        return None if self.pacer is None else self.pacer.pace

    def sleep(self, seconds: float) -> None:
        """Wait `seconds` of virtual time."""
        with self._mutex:
            me = self._enter()
            self._end_drift()
            deadline = self.t + max(0.0, seconds)
            if me is None:
                self._advance(deadline)
                return
        self._wait(me, deadline)

    def touch(self, cost: float) -> None:
        """Spend `cost` seconds of virtual time on one access to the outside.

        The brick has one core: no other thread computes meanwhile.
        """
        run = self._run
        if run.detached:
            wall.sleep(self.STEP_PAUSE)
        with self._mutex:
            me = self._enter()
            self._end_drift()
            self.busy += cost
            self._advance(self.t + cost)
            if me is None:
                return
            if run.exit is not None:
                self._park(me)
            if run.sleepers.first_t <= self.t:
                self._switch(me, self.t)
        if run.interrupts:
            self._attend(me)

    def begin(self) -> None:
        """End the program's start: from now on its computing takes time.

        It accesses the world: it uses the brick, waits, begins a thread, or connects to a peer.
        """
        if self.processor and self.processor.start is None:
            self.processor.begin()

    def at(self, t: float, action: "Action") -> "Event":
        """Call `action()` when time passes `t` (s); it must not wait.

        Returns:
            a handle for `cancel`.
        """
        with self._mutex:
            return self._events.add(t, action)

    def cancel(self, event: "Event") -> None:
        """Cancel an event that `at` returned; a past one makes no difference."""
        event.what = None

    def advance(self, t: float) -> None:
        """Bring every body to time `t` (s), running the events on the way."""
        with self._mutex:
            self._advance(t)

    # The program

    def run(
        self, program: Callable[[], int], limit: Optional[float] = None, patience: float = 10.0
    ) -> ProcessExit:
        """Run `program() -> exit status` as the main thread of a new program until it is over.

        Args:
            program: takes nothing, returns the exit status.
            limit: virtual time at which the run is cut off, s.
            patience: greatest computing time without a visit to the clock, s of the host; a wait
                for the host may take Watchdog.WAIT_TIMEOUT, or what is left of the limit.

        Raises:
            whatever a body or an event raised.
        """
        collecting = gc.isenabled()  # a program that is killed does not put it back
        self._run = run = WorldRun(limit)

        def main() -> None:
            try:
                self.halt(ProcessExit(program(), "ended"))
            except Exception as error:
                self._fail(error)

        run.main = self.spawn(main, "MainThread")
        with self._mutex:
            self._dispatch(None)
        self._watchdog.watch(run, patience)
        if collecting:
            gc.enable()
        if self.pacer is not None:
            self.pacer.leave()
        if run.failure is not None:
            raise run.failure
        assert run.exit is not None  # else the watchdog would watch still
        return run.exit

    def spawn(self, function: "Action", name: str) -> VirtualThread:
        """Start `function()` as a further thread of the program."""
        with self._mutex:
            self._enter()
            thread = VirtualThread(name, self._run)
            self._run.alive.append(thread)
            self._run.wake_at(thread, self.t)
        real = threading.Thread(target=self._body, args=(thread, function), name=name)
        real.daemon = True
        real.start()
        return thread

    def current(self) -> Optional[VirtualThread]:
        """Return the calling `VirtualThread`, or None for a caller outside the program."""
        return self._local.thread

    def is_main(self) -> bool:
        """Return True in the program's main thread."""
        return self._local.thread is not None and self._local.thread is self._run.main

    def halt(self, process_exit: ProcessExit) -> None:
        """End the program now, for whatever reason; the first exit stands."""
        with self._mutex:
            self._run.end(process_exit)
            self._news.notify_all()

    def interrupt(self, action: "Action") -> None:
        """Have the program's main thread call `action()` at once; this ends its wait."""
        with self._mutex:
            run = self._run
            run.interrupts.append(action)
            main = run.main
            if main in run.alive and main is not run.holder and not main.detached:
                run.wake_at(main, self.t)
            self._hurry = True
            self._news.notify_all()
            if run.holder is None and not self._dispatching and run.exit is None:
                self._dispatch(None)

    # Time passing

    def _advance(self, t: float) -> None:
        """Advance towards `t`; stop at the program's end, the limit, or a change from outside."""
        run = self._run
        before = run.exit
        limit = run.limit if before is None and run.limit is not None else math.inf
        try:
            if self._events.first_t > t and t < limit and not self.realtime:  # mostly
                if t > self.t:
                    self._integrate(t)
                return
            while True:
                event = self._events.first if self._events.first_t <= t else None
                due = t if event is None else max(event.t, self.t)
                if not self._move(min(limit, due), before):
                    return
                if due >= limit and (event is None or due > limit):
                    self.halt(ProcessExit(ENDLESS, "timeout"))
                    return
                if event is None:
                    return
                if self._events.first is not event:
                    continue
                self._events.pop()
                if event.what is not None:
                    event.what()
                if run.exit is not before:
                    return
        except Exception as error:
            if not run.begun or before is not None:
                raise
            self._fail(error)

    def _move(self, t: float, before: Optional[ProcessExit]) -> bool:
        """Advance to `t`; return True there, False if the program ended since `before`."""
        if t <= self.t:
            return True
        pacer = self.pacer if self.realtime else None
        while pacer is not None:
            # In steps, so that an observer from outside sees it move.
            step = min(t, self.t + self.REALTIME_STEP)
            pacer.join(self.t, self.name)
            if pacer.reached(step):
                if step == t:
                    break
                self._integrate(step)
                continue
            if self._hurry or self.exit is not before:
                return False
            pacer.waiting = True
            self._news.wait(pacer.worth_waiting(step))
            pacer.waiting = False
            if t <= self.t:
                return True
        self._integrate(t)
        return True

    def _integrate(self, t: float) -> None:
        self.t = t
        for advance in self.bodies:
            advance(t)

    def _fail(self, error: Exception) -> None:
        self._run.failure = error
        self.halt(ProcessExit(70, "emulator failed"))

    # The baton.  All below expect the mutex to be held once, except _wait, _attend and _body.

    def _enter(self) -> Optional[VirtualThread]:
        """Bring the caller to the clock; a thread of the program waits for the baton."""
        me = self._local.thread
        if me is None:
            self._charge()
            return None
        run = self._run
        run.visits += 1
        self._hurry = False
        if run.exit is not None or me.run is not run:
            self._park(me)
        if run.holder is not me:
            run.reattach(me)
            if run.holder is None and not self._dispatching:
                run.holder = me
            else:
                run.wake_at(me, self.t)
                self._hurry = True
                self._news.notify_all()
                self._wait_for_baton(me)
        if self._charge() and self.exit is not None:
            self._park(me)
        return me

    def _charge(self) -> bool:
        """Advance by the time computed since the last visit; return True if there was any."""
        cost = self.processor.charge() if self.processor else 0.0
        if cost:
            self.busy += cost
            self._advance(self.t + cost)
        return cost > 0.0

    def _wait(
        self, me: VirtualThread, deadline: Optional[float], waiter: "Optional[Waiter]" = None
    ) -> bool:
        """Wait until `waiter` is woken (True) or the deadline has passed (False; None: never)."""
        self.begin()
        while True:
            run = self._run
            if run.detached:
                wall.sleep(self.STEP_PAUSE)
            with self._mutex:
                self._enter()
                if waiter is None or not waiter.woken:
                    if deadline is not None and self.t >= deadline:
                        return False
                    if not (run.interrupts and me is run.main):  # else it came before the wait
                        me.waiter = waiter
                        self._switch(me, deadline)
                        me.waiter = None
            if waiter is not None and waiter.woken:
                return True
            self._attend(me)

    def _attend(self, me: VirtualThread) -> None:
        run = self._run
        while run.interrupts and me is run.main:
            run.interrupts.popleft()()

    def _switch(self, me: VirtualThread, wake: Optional[float]) -> None:
        run = self._run
        run.wake_at(me, wake)
        self._dispatch(me)
        if run.holder is not me:
            self._wait_for_baton(me)

    def _wait_for_baton(self, me: VirtualThread) -> None:
        me.waiting = True
        self._mutex.release()
        me.gate.acquire()
        self._mutex.acquire()
        me.waiting = False
        if self._run.exit is not None or me.run is not self._run:
            self._park(me)

    def _park(self, me: VirtualThread) -> "NoReturn":
        me.waiting = True
        self._mutex.release()
        while True:
            me.gate.acquire()

    def _dispatch(self, caller: Optional[VirtualThread]) -> None:
        """Pass the baton to the next thread that is due; advance the time up to its wake-up."""
        run = self._run
        run.holder = None
        self._dispatching = True
        while run.exit is None:
            self._hurry = False
            run.holder = run.pop_due(self.t)
            if run.holder is not None:
                if run.holder is not caller:
                    run.holder.gate.release()
                break
            if not run.sleepers and run.detached and not run.is_awaited(self._events):
                break
            if not run.sleepers and not self._events:
                self.halt(ProcessExit(ENDLESS, "deadlock"))
                break
            due = min(run.sleepers.first_t, self._events.first_t)
            self._advance(max(due, self.t))
        self._dispatching = False

    def _body(self, me: VirtualThread, function: "Action") -> None:
        self._local.thread = me
        me.ident = threading.get_ident()
        me.native = getattr(threading, "get_native_id", lambda: None)()  # Python 3.8
        me.gate.acquire()
        me.waiting = False
        try:
            function()
        except Over:
            pass
        finally:
            with self._mutex:
                run = me.run
                run.alive.remove(me)
                if run is self._run and run.exit is None:
                    if me.detached:
                        run.reattach(me)
                    if run.holder is me or (run.holder is None and not self._dispatching):
                        self._dispatch(None)

    def _drift(self, pacer: Pacer) -> None:
        """Let time follow the clock while a program waits for the host."""
        pacer.drifting = True
        self._advance(max(self.t, pacer.now()))
        pacer.promise(self.t + self.DRIFT)

    def _end_drift(self) -> None:
        """Catch up with the clock, if the program has waited for the host."""
        if self.pacer is not None and self.pacer.drifting:
            self.pacer.drifting = False
            if self.pacer.joined:
                self._advance(max(self.t, self.pacer.now()))
