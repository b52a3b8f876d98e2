"""The emulated world's time: a clock that only moves when somebody waits or works.

Rules:
1. Physics is brought up to the present before anything may look at it, and timed events happen
   exactly at their time, before any program code that runs later.
2. A program's threads are real threads that pass one baton: exactly one runs.  It changes hands
   only when its holder waits, ends, or spends time past another's wake-up; so a run repeats.
3. When the program is over, no thread of the program ever gets out of the world again: a killed
   program runs no `finally`, prints nothing and writes no file.

The one exception to rule 2: a thread that computes for `Watchdog.YIELD_TIMEOUT` of wall time
without touching the clock, while others could run, loses the baton and runs beside them until it
touches the clock again (`while not flag: pass`, where another thread sets the flag).  Where
computing takes time, whoever goes round in a `while` touches it by itself, see counting.LOOK.
"""

import collections
import gc
import heapq
import math
import threading
import time as wall
from typing import Callable, Optional

from laptop.emulator.host.pacer import Pacer
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.virtual_thread import VirtualThread
from laptop.emulator.host.watchdog import Over, Watchdog

MYPY = False
if MYPY:
    from typing import Any, Deque, Dict, List, NoReturn, Sequence, Tuple  # noqa: F401

    from laptop.emulator.host.processor import Processor  # noqa: F401
    from laptop.emulator.host.virtual_thread import Call, Wake  # noqa: F401
    from laptop.emulator.host.waiting_line import Ticket
    from laptop.emulator.pace import PacedClock, PaceMeter

    Action = Callable[[], object]
    Event = List[Any]  # when it is due (s), a number of its own, Action (None: taken back)
    Address = Tuple[str, int]  # host, port
    Files = Sequence[Any]  # descriptors, or what has a fileno()
    Ready = Tuple[List[Any], List[Any], List[Any]]  # to be read, to be written, with an exception
    Select = Callable[[Files, Files, Files, Optional[float]], Ready]


class _Local(threading.local):
    thread = None  # type: Optional[VirtualThread]


class World(object):
    """Virtual time (s), the bodies that live in it, the events due and the threads of a program.

    Args:
        clock: pace.PacedClock that virtual time keeps pace with, shared with others; None: it goes
            as fast as it can.
        name: for people, of those who wait for it.

    Attributes:
        t: virtual time, s.
        exit: ProcessExit of the program; None while it runs.
        cut_at: where its main thread was if it was cut off, see VirtualThread.stack.
        realtime: whether it keeps pace with the clock.
        pacer: Pacer of the clock; None without one.
        tell: called now and then with a line for people while the host is busy.
        typing: whether a thread waits for a person at the keyboard, who may take all the time.
        unheard: called when the program's main thread does not look at an `interrupt`.
        processor: processor.Processor that the program computes on; None: it computes in no time.
        awaited: whom the clock waited for when it was given up, in words.
        select: stands for the program's select.select where the other end of its sockets lives in
            this world, too; None where it does not.
        addresses: where a program calls -> where that is on this computer, if elsewhere.
    """

    STEP_PAUSE = 0.001
    """Pause before each step beside a thread that lost the baton, wall s: it sees what the others
    did before time goes on."""
    REALTIME_STEP = 0.005
    """Longest step of the bodies in real time, s."""
    DRIFT = 0.05
    """Time that goes on at a look beside a program that waits for something of the host, s."""

    def __init__(self, clock: "Optional[PacedClock]" = None, name: str = "brick") -> None:
        self.name = name
        self.t = 0.0
        self.bodies = []  # type: List[Callable[[float], object]]
        self.realtime = clock is not None
        self.select = None  # type: Optional[Select]
        self.addresses = {}  # type: Dict[Address, Address]
        self.busy = 0.0
        self.exit = None  # type: Optional[ProcessExit]
        self.cut_at = ()  # type: Sequence[Call]
        self.limit = None  # type: Optional[float]
        self._events = []  # type: List[Event]
        self._order = 0
        self.pacer = None if clock is None else Pacer(clock)
        self.tell = lambda line: None  # type: Callable[[str], object]
        self.typing = False
        self.unheard = lambda: None  # type: Action
        self.processor = None  # type: Optional[Processor]
        self.awaited = ""
        self._zero = wall.monotonic()
        self._mutex = threading.RLock()
        self._news = threading.Condition(self._mutex)
        self._local = _Local()
        self._run = None  # type: object
        self._main = None  # type: Optional[VirtualThread]
        self._holder = None  # type: Optional[VirtualThread]
        self._dispatching = False
        self._hurry = False
        self._loose = 0
        self._alive = []  # type: List[VirtualThread]
        self._sleepers = []  # type: List[Wake]
        self._interrupts = collections.deque()  # type: Deque[Action]
        self._progress = 0
        self._over = threading.Event()
        self._failure = None  # type: Optional[Exception]
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

        The brick has one core: nobody else computes meanwhile.
        """
        if self._loose:
            wall.sleep(self.STEP_PAUSE)
        with self._mutex:
            me = self._enter()
            self._end_drift()
            self.busy += cost
            self._advance(self.t + cost)
            if me is None:
                return
            if self.exit is not None:
                self._park(me)
            if self._sleepers and self._sleepers[0][0] <= self.t:
                self._switch(me, self.t)
        if self._interrupts:
            self._attend(me)

    def begin(self) -> None:
        """Let what the program computes take its time from now on.

        It has to do with the world: it uses the brick, waits, begins a thread, or calls somebody.
        """
        if self.processor and self.processor.start is None:
            self.processor.begin()

    def at(self, t: float, action: "Action") -> "Event":
        """Call `action()` when time passes `t` (s); it must not wait.

        Returns:
            a handle for `cancel`.
        """
        with self._mutex:
            self._order += 1
            event = [t, self._order, action]  # type: Event
            heapq.heappush(self._events, event)
        return event

    def cancel(self, event: "Event") -> None:
        """Take back what `at` returned; nothing happens when it is past."""
        event[2] = None

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
            limit: the run is cut off at this virtual time, s.
            patience: or after so many seconds of the host, computed without a look at the clock;
                or after Watchdog.WAIT_TIMEOUT, or what is left of the limit, waited for the host.

        Raises:
            whatever a body or an event raised.
        """
        collecting = gc.isenabled()  # a program that is killed does not put it back
        self._start_anew(limit)

        def main() -> None:
            try:
                self.halt(ProcessExit(program(), "ended"))
            except Exception as error:
                self._fail(error)

        self._main = self.spawn(main, "MainThread")
        with self._mutex:
            self._dispatch(None)
        self._watchdog.watch(self._over, patience)
        if collecting:
            gc.enable()
        if self.pacer is not None:
            self.pacer.leave()
        if self._failure is not None:
            raise self._failure
        assert self.exit is not None  # else the watchdog would watch still
        return self.exit

    def _start_anew(self, limit: Optional[float]) -> None:
        """Be without a program again, and know nothing of the last one."""
        self._run = object()
        self.exit = None
        self.cut_at = ()
        self.limit = limit
        self._holder = self._failure = None
        self._loose = 0
        self._alive = []
        self._sleepers = []
        self._interrupts.clear()
        self._over.clear()

    def spawn(self, function: "Action", name: str) -> VirtualThread:
        """Start `function()` as a further thread of the program; it runs when its turn comes."""
        with self._mutex:
            self._enter()
            thread = VirtualThread(name, self._run)
            self._alive.append(thread)
            self._queue(thread, self.t)
        real = threading.Thread(target=self._body, args=(thread, function), name=name)
        real.daemon = True
        real.start()
        return thread

    def current(self) -> Optional[VirtualThread]:
        """Return the calling `VirtualThread`, or None for a caller outside the program."""
        return self._local.thread

    def is_main(self) -> bool:
        """Return True in the program's main thread."""
        return self._local.thread is not None and self._local.thread is self._main

    def halt(self, process_exit: ProcessExit) -> None:
        """End the program now, for whatever reason; the first exit stands."""
        with self._mutex:
            if self.exit is None:
                self.exit = process_exit
                if process_exit.status == ENDLESS and self._main is not None:
                    self.cut_at = self._main.stack()
                self._over.set()
                self._news.notify_all()

    def interrupt(self, action: "Action") -> None:
        """Have the program's main thread call `action()` at once, out of any wait it is in."""
        with self._mutex:
            self._interrupts.append(action)
            main = self._main
            if main in self._alive and main is not self._holder and not main.loose:
                self._queue(main, self.t)
            self._hurry = True
            self._news.notify_all()
            if self._holder is None and not self._dispatching and self.exit is None:
                self._dispatch(None)

    # Time passing

    def _advance(self, t: float) -> None:
        """Go towards `t`; stop at the program's end, the limit, or when the wall has news."""
        before = self.exit
        try:
            while True:
                event = self._events[0] if self._events and self._events[0][0] <= t else None
                due = t if event is None else max(event[0], self.t)
                limit = self.limit if before is None and self.limit is not None else math.inf
                if not self._move(min(limit, due), before):
                    return
                if due >= limit and (event is None or due > limit):
                    if self._run is not None:
                        self.halt(ProcessExit(ENDLESS, "timeout"))
                    return
                if event is None:
                    return
                if self._events[0] is not event:
                    continue
                heapq.heappop(self._events)
                if event[2] is not None:
                    event[2]()
                if self.exit is not before:
                    return
        except Exception as error:
            if self._run is None or before is not None:
                raise
            self._fail(error)

    def _move(self, t: float, before: Optional[ProcessExit]) -> bool:
        """Go to `t`; True when it is reached, not when the program has ended since `before`."""
        if t <= self.t:
            return True
        pacer = self.pacer if self.realtime else None
        while pacer is not None:
            # In steps, so that whoever looks on from outside sees it move.
            step = min(t, self.t + self.REALTIME_STEP)
            pacer.join(self.t, self.name)
            if pacer.reached(step):
                if step == t:
                    break
                self._carry(step)
                continue
            if self._hurry or self.exit is not before:
                return False
            pacer.waiting = True
            self._news.wait(pacer.worth_waiting(step))
            pacer.waiting = False
            if t <= self.t:
                return True
        self._carry(t)
        return True

    def _carry(self, t: float) -> None:
        self.t = t
        for advance in self.bodies:
            advance(t)

    def _fail(self, error: Exception) -> None:
        self._failure = error
        self.halt(ProcessExit(70, "emulator failed"))

    # The baton.  All below expect the mutex to be held once, except _wait, _attend and _body.

    def _enter(self) -> Optional[VirtualThread]:
        """Have whoever calls be at the clock: a thread of the program only with the baton."""
        me = self._local.thread
        if me is None:
            self._charge()
            return None
        self._progress += 1
        self._hurry = False
        if self.exit is not None or me.run is not self._run:
            self._park(me)
        if self._holder is not me:
            me.loose = False
            self._loose -= 1
            if self._holder is None and not self._dispatching:
                self._holder = me
            else:
                self._queue(me, self.t)
                self._hurry = True
                self._news.notify_all()
                self._stand_by(me)
        if self._charge() and self.exit is not None:
            self._park(me)
        return me

    def _charge(self) -> bool:
        """Let what was computed since take its time; True if it took any."""
        cost = self.processor.take() if self.processor else 0.0
        if cost:
            self.busy += cost
            self._advance(self.t + cost)
        return cost > 0.0

    def _queue(self, thread: VirtualThread, wake: Optional[float]) -> None:
        """Have `thread` woken at `wake`, in place of any earlier arrangement."""
        if thread.entry is not None:
            thread.entry[2] = None
            thread.entry = None
        if wake is not None:
            self._order += 1
            thread.entry = [wake, self._order, thread]
            heapq.heappush(self._sleepers, thread.entry)

    def _wait(
        self, me: VirtualThread, deadline: Optional[float], ticket: "Optional[Ticket]" = None
    ) -> bool:
        """Wait until `ticket` is called (True) or the deadline has passed (False; None: never)."""
        self.begin()
        while True:
            if self._loose:
                wall.sleep(self.STEP_PAUSE)
            with self._mutex:
                self._enter()
                if ticket is None or not ticket.called:
                    if deadline is not None and self.t >= deadline:
                        return False
                    if not (self._interrupts and me is self._main):  # else it came before the wait
                        me.ticket = ticket
                        self._switch(me, deadline)
                        me.ticket = None
            if ticket is not None and ticket.called:
                return True
            self._attend(me)

    def _attend(self, me: VirtualThread) -> None:
        while self._interrupts and me is self._main:
            self._interrupts.popleft()()

    def _switch(self, me: VirtualThread, wake: Optional[float]) -> None:
        self._queue(me, wake)
        self._dispatch(me)
        if self._holder is not me:
            self._stand_by(me)

    def _stand_by(self, me: VirtualThread) -> None:
        me.waiting = True
        self._mutex.release()
        me.gate.acquire()
        self._mutex.acquire()
        me.waiting = False
        if self.exit is not None or me.run is not self._run:
            self._park(me)

    def _park(self, me: VirtualThread) -> "NoReturn":
        me.waiting = True
        self._mutex.release()
        while True:
            me.gate.acquire()

    def _dispatch(self, caller: Optional[VirtualThread]) -> None:
        """Give the baton to whoever is due next, letting time pass until somebody is."""
        self._holder = None
        self._dispatching = True
        sleepers = self._sleepers
        while self.exit is None:
            self._hurry = False
            while sleepers and sleepers[0][2] is None:
                heapq.heappop(sleepers)
            if sleepers and sleepers[0][0] <= self.t:
                thread = heapq.heappop(sleepers)[2]
                thread.entry = None
                self._holder = thread
                if thread is not caller:
                    thread.gate.release()
                break
            if not sleepers and self._loose and not self._awaited():
                break
            if not sleepers and not self._events:
                self.halt(ProcessExit(ENDLESS, "deadlock"))
                break
            due = min(heap[0][0] for heap in (sleepers, self._events) if heap)
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
                self._alive.remove(me)
                if me.run is self._run and self.exit is None:
                    if me.loose:
                        self._loose -= 1
                    if self._holder is me or (self._holder is None and not self._dispatching):
                        self._dispatch(None)

    def _awaited(self, holder: Optional[VirtualThread] = None) -> bool:
        """Return True if time must go on for a sleeper, or a waiter whom an event may wake."""
        if any(entry[2] for entry in self._sleepers):
            return True
        waiting = any(not thread.loose and thread is not holder for thread in self._alive)
        return waiting and any(event[2] for event in self._events)

    def _drift(self, pacer: Pacer) -> None:
        """Let time go on with the clock, beside a program that waits for something of the host."""
        pacer.drifting = True
        self._advance(max(self.t, pacer.now()))
        pacer.promise(self.t + self.DRIFT)

    def _end_drift(self) -> None:
        """Have it be as late as the clock shows, if the program has waited for the host."""
        if self.pacer is not None and self.pacer.drifting:
            self.pacer.drifting = False
            if self.pacer.joined:
                self._advance(max(self.t, self.pacer.now()))
