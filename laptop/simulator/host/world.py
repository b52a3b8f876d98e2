"""The emulated world's time: a clock that only moves when somebody waits or works.

Rules:
1. Physics is brought up to the present before anything may look at it, and timed events happen
   exactly at their time, before any program code that runs later.
2. A program's threads are real threads that pass one baton: exactly one runs.  It changes hands
   only when its holder waits, ends, or spends time past another's wake-up; so a run repeats.
3. When a verdict has fallen, no thread of the program ever gets out of the world again: a killed
   program runs no `finally`, prints nothing and writes no file.

The one exception to rule 2 is the valve: a thread that computes for `World.VALVE` s of wall time
without touching the clock, while others could run, loses the baton and runs beside them until it
touches the clock again (`while not flag: pass`, where another thread sets the flag).  Where
computing takes time, whoever goes round in a `while` touches it by itself, see counting.LOOK.
"""

import collections
import ctypes
import gc
import heapq
import io
import threading
import time as wall

from laptop.simulator.host import pace

#: How a run ended: the exit status a shell would see, and why.
Verdict = collections.namedtuple("Verdict", ["status", "reason"])

#: A program that never comes to an end, as `timeout` of GNU coreutils reports it.
ENDLESS = 124
#: A host that is too busy to emulate it, EX_TEMPFAIL of sysexits.h: try again later.
BUSY = 75

#: Below this pace over so many wall seconds it does not go on in real time.
CRAWL, CRAWL_WINDOW = 0.01, 60.0

#: So often people are told that the host is busy, wall seconds.
TOLD_EVERY = 10.0

#: A thread that computes after the verdict, or waits for the host, is waited for so long, s.
ASTRAY = 0.5


class Over(BaseException):
    """Thrown at a thread that still computes after the verdict; never at one in the world."""


class VirtualThread(object):
    """One thread of the program under test."""

    __slots__ = ("name", "run", "ident", "native", "gate", "entry", "ticket", "waiting", "loose")

    def __init__(self, name, run):
        self.name = name
        self.run = run
        self.ident = None
        self.native = None
        self.gate = threading.Lock()
        self.gate.acquire()
        self.entry = None
        self.ticket = None
        self.waiting = True
        self.loose = False


class Effort(object):
    """What a thread spends while it does not come to the clock.

    That it waits for the host's processor does not count: a computer that is busy changes nothing.
    (Where the host does not tell all that, each second counts as one of waiting.)

    Args:
        thread: VirtualThread; None spends nothing.
    """

    def __init__(self, thread):
        self.thread = thread
        self._spent = [0.0, 0.0]
        self._before = None

    def look(self):
        """Seconds that it has computed since the first look, and that it has waited for the host.

        It waits if it sleeps now, did so at the last look, and has not computed in between; who has
        waits no longer.  (Who waits for the interpreter sleeps, too, so only a long wait is one.)
        """
        if self.thread is None or self.thread.ident is None:  # the host has not begun it yet
            return 0.0, 0.0
        now = wall.monotonic(), self._computed(), self._sleeps()
        if self._before is not None:
            passed, computed = now[0] - self._before[0], now[1] - self._before[1]
            waits = now[2] and self._before[2] and computed < passed / 100
            waited = self._spent[1] + passed if waits else 0.0
            self._spent = [self._spent[0] + (0.0 if waits else computed), waited]
        self._before = now
        return tuple(self._spent)

    def _computed(self):
        try:
            own = getattr(wall, "pthread_getcpuclockid")(self.thread.ident)  # noqa: B009 Python 3.7
            return wall.clock_gettime(own)
        except (AttributeError, OSError):
            return 0.0

    def _sleeps(self):
        try:
            with io.open("/proc/self/task/{}/stat".format(self.thread.native), "rb") as file:
                return file.read().rpartition(b")")[2].split()[0] == b"S"
        except OSError:
            return True


class _Local(threading.local):
    thread = None


class World(object):
    """Virtual time (s), the bodies that live in it, the events due and the threads of a program.

    Args:
        clock: pace.PacedClock that virtual time keeps pace with, shared with others; None: it goes
            as fast as it can.
        name: for people, of those who wait for it.

    Attributes:
        realtime: whether it keeps pace with the clock.
        pace: pace.PaceMeter of the clock, None without one.
        tell: called now and then with a line for people while the host is busy.
        processor: processor.Processor that the program computes on; None: it computes in no time.
        awaited: whom the clock waited for when it was given up, in words.
        select: stands for the program's select.select where the other end of its sockets lives in
            this world, too; None where it does not.
    """

    VALVE = 0.25
    VALVE_REALTIME = 0.02
    # How long, in wall seconds, the others stand still before each step beside a thread that lost
    # the baton, so that it sees what they did before time goes on.
    COURTESY = 0.001
    # In real time the bodies are brought up to the present at least so often, s.
    PACE = 0.005
    # Time goes on so far at a look beside a program that waits for something of the host, s.
    DRIFT = 0.05

    def __init__(self, clock=None, name="brick"):
        self.name = name
        self.t = 0.0
        self.bodies = []
        self.realtime = clock is not None
        self.select = None
        self.busy = 0.0
        self.verdict = None
        self.limit = None
        self._events = []
        self._order = 0
        self._clock = clock
        self._member = None
        self._drifting = False
        self._crawl = clock and pace.PaceMeter(clock, CRAWL_WINDOW)
        self.pace = clock and pace.PaceMeter(clock)
        self.tell = lambda line: None
        self.processor = None
        self.awaited = ""
        self._told = -TOLD_EVERY
        self._zero = 0.0 if self.realtime else wall.monotonic()
        self._mutex = threading.RLock()
        self._news = threading.Condition(self._mutex)
        self._local = _Local()
        self._run = None
        self._main = None
        self._holder = None
        self._dispatching = False
        self._pacing = False
        self._hurry = False
        self._loose = 0
        self._alive = []
        self._sleepers = []
        self._interrupts = collections.deque()
        self._progress = 0
        self._over = threading.Event()
        self._failure = None

    # The clock

    def now(self):
        """The virtual time, s."""
        return self.t

    @property
    def zero(self):
        """What the paced clock shows at the virtual time 0, s."""
        return self._zero

    def sleep(self, seconds):
        """Wait `seconds` of virtual time."""
        with self._mutex:
            me = self._enter()
            if self._drifting:
                self._end_drift()
            deadline = self.t + max(0.0, seconds)
            if me is None:
                self._advance(deadline)
                return
        self._wait(me, deadline)

    def touch(self, cost):
        """Spend `cost` seconds of virtual time on one access to the outside.

        The brick has one core: nobody else computes meanwhile.
        """
        if self._loose:
            wall.sleep(self.COURTESY)
        with self._mutex:
            me = self._enter()
            if self._drifting:
                self._end_drift()
            self.busy += cost
            self._advance(self.t + cost)
            if me is None:
                return
            if self.verdict is not None:
                self._park(me)
            if self._sleepers and self._sleepers[0][0] <= self.t:
                self._switch(me, self.t)
        if self._interrupts:
            self._attend(me)

    def begin(self):
        """The program has to do with the world: from now on what it computes takes its time.

        It uses the brick, waits, begins a thread, or calls somebody.
        """
        if self.processor and self.processor.start is None:
            self.processor.begin()

    def at(self, t, action):
        """Call `action()` when time passes `t` (s); it must not wait.

        Returns:
            a handle for `cancel`.
        """
        with self._mutex:
            self._order += 1
            event = [t, self._order, action]
            heapq.heappush(self._events, event)
        return event

    def cancel(self, event):
        """Take back what `at` returned; nothing happens when it is past."""
        event[2] = None

    def advance(self, t):
        """Bring every body to time `t` (s), running the events on the way."""
        with self._mutex:
            self._advance(t)

    # The program

    def run(self, program, limit=None, patience=60.0):
        """Run `program() -> exit status` as the main thread of a new program until its verdict.

        Args:
            limit: the run is cut off at this virtual time, s.
            patience: or after so many seconds of the host, computed or waited for, without a look
                at the clock.

        Raises:
            whatever a body or an event raised.
        """
        collecting = gc.isenabled()  # a program that is killed does not put it back
        self._run = object()
        self.verdict = None
        self.limit = limit
        self._holder = self._failure = None
        self._loose = 0
        self._alive = []
        self._sleepers = []
        self._interrupts.clear()
        self._over.clear()

        def main():
            try:
                self.halt(Verdict(program(), "ended"))
            except Exception as error:
                self._fail(error)

        self._main = self.spawn(main, "MainThread")
        with self._mutex:
            self._dispatch(None)
        effort, seen = Effort(None), None
        while not self._over.wait(0.01 if self.realtime else 0.05):
            with self._mutex:
                loose = (thread for thread in self._alive if thread.loose)
                working = self._holder or next(loose, None)
                if self._progress != seen or self._pacing or working is not effort.thread:
                    seen, effort = self._progress, Effort(working)
                else:
                    self._open_valve(working, effort.look(), patience)
            if self.realtime:
                self._look_at_pace()
        self._wind_up()
        if collecting:
            gc.enable()
        if self._member is not None:
            self._member.leave()
            self._member = None
        if self._failure is not None:
            raise self._failure
        return self.verdict

    def spawn(self, function, name):
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

    def current(self):
        """The calling `VirtualThread`, or None for a caller outside the program."""
        return self._local.thread

    def is_main(self):
        """True in the program's main thread."""
        return self._local.thread is not None and self._local.thread is self._main

    def halt(self, verdict):
        """The program is over now, for whatever reason; the first verdict stands."""
        with self._mutex:
            if self.verdict is None:
                self.verdict = verdict
                self._over.set()
                self._news.notify_all()

    def interrupt(self, action):
        """Have the program's main thread call `action()` at once, out of any wait it is in."""
        with self._mutex:
            self._interrupts.append(action)
            main = self._main
            if main in self._alive and main is not self._holder and not main.loose:
                self._queue(main, self.t)
            self._hurry = True
            self._news.notify_all()
            if self._holder is None and not self._dispatching and self.verdict is None:
                self._dispatch(None)

    # Time passing

    def _advance(self, t):
        """Towards `t`; stops early at a verdict, at the limit, or when the wall has news."""
        before = self.verdict
        try:
            while True:
                event = self._events[0] if self._events and self._events[0][0] <= t else None
                due = t if event is None else max(event[0], self.t)
                limited = before is None and self.limit is not None and due >= self.limit
                if not self._move(self.limit if limited and due > self.limit else due):
                    return
                if limited and (event is None or due > self.limit):
                    if self._run is not None:
                        self.halt(Verdict(ENDLESS, "timeout"))
                    return
                if event is None:
                    return
                if self._events[0] is not event:
                    continue
                heapq.heappop(self._events)
                if event[2] is not None:
                    event[2]()
                if self.verdict is not before:
                    return
        except Exception as error:
            if self._run is None or before is not None:
                raise
            self._fail(error)

    def _move(self, t):
        """True when `t` is reached."""
        if t <= self.t:
            return True
        while self.realtime:
            # In steps, so that whoever looks on from outside sees it move.
            step = min(t, self.t + self.PACE)
            if self._reached(step):
                if step == t:
                    break
                self._carry(step)
                continue
            if self._hurry:
                return False
            self._pacing = True
            self._news.wait(self._clock.worth_waiting(self._zero + step))
            self._pacing = False
            if t <= self.t:
                return True
        self._carry(t)
        return True

    def _reached(self, t):
        """Whether the clock lets us go on to `t`; nothing of ours happens before."""
        if self._member is None:
            self._zero = self._clock.now() - self.t
            self._member = self._clock.join(self.name)
        self._member.promise(self._zero + t)
        return self._clock.now() >= self._zero + t

    def _carry(self, t):
        self.t = t
        for advance in self.bodies:
            advance(t)

    def _fail(self, error):
        self._failure = error
        self.halt(Verdict(70, "emulator failed"))

    # The baton.  All below expect the mutex to be held once, except _wait, _attend and _body.

    def _enter(self):
        """Whoever calls is at the clock: a thread of the program only with the baton."""
        me = self._local.thread
        if me is None:
            self._charge()
            return None
        self._progress += 1
        self._hurry = False
        if self.verdict is not None or me.run is not self._run:
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
        if self._charge() and self.verdict is not None:
            self._park(me)
        return me

    def _charge(self):
        """Let what was computed since take its time; whether it took any."""
        cost = self.processor.take() if self.processor else 0.0
        if cost:
            self.busy += cost
            self._advance(self.t + cost)
        return cost > 0.0

    def _queue(self, thread, wake):
        """Have `thread` woken at `wake`, in place of any earlier arrangement."""
        if thread.entry is not None:
            thread.entry[2] = None
            thread.entry = None
        if wake is not None:
            self._order += 1
            thread.entry = [wake, self._order, thread]
            heapq.heappush(self._sleepers, thread.entry)

    def _wait(self, me, deadline, ticket=None):
        """Until `ticket` is called (True) or the deadline has passed (False; None: never)."""
        self.begin()
        while True:
            if self._loose:
                wall.sleep(self.COURTESY)
            with self._mutex:
                self._enter()
                if ticket is None or not ticket.called:
                    if deadline is not None and self.t >= deadline:
                        return False
                    me.ticket = ticket
                    self._switch(me, deadline)
                    me.ticket = None
            if ticket is not None and ticket.called:
                return True
            self._attend(me)

    def _attend(self, me):
        while self._interrupts and me is self._main:
            self._interrupts.popleft()()

    def _switch(self, me, wake):
        self._queue(me, wake)
        self._dispatch(me)
        if self._holder is not me:
            self._stand_by(me)

    def _stand_by(self, me):
        me.waiting = True
        self._mutex.release()
        me.gate.acquire()
        self._mutex.acquire()
        me.waiting = False
        if self.verdict is not None or me.run is not self._run:
            self._park(me)

    def _park(self, me):
        me.waiting = True
        self._mutex.release()
        while True:
            me.gate.acquire()

    def _dispatch(self, caller):
        """Give the baton to whoever is due next, letting time pass until somebody is."""
        self._holder = None
        self._dispatching = True
        sleepers = self._sleepers
        while self.verdict is None:
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
                self.halt(Verdict(ENDLESS, "deadlock"))
                break
            due = min(heap[0][0] for heap in (sleepers, self._events) if heap)
            self._advance(max(due, self.t))
        self._dispatching = False

    def _body(self, me, function):
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
                if me.run is self._run and self.verdict is None:
                    if me.loose:
                        self._loose -= 1
                    if self._holder is me or (self._holder is None and not self._dispatching):
                        self._dispatch(None)

    def _awaited(self, holder=None):
        """Whether time must go on for others: a sleeper, or a waiter whom an event may wake."""
        if any(entry[2] for entry in self._sleepers):
            return True
        waiting = any(not thread.loose and thread is not holder for thread in self._alive)
        return waiting and any(event[2] for event in self._events)

    def _open_valve(self, thread, effort, patience):
        """Let the others, or in real time the world, go on beside one who does not come.

        Args:
            effort: what it has spent since it was at the clock last, see Effort.look.
        """
        computed, waited = effort
        valve = self.VALVE_REALTIME if self.realtime else self.VALVE
        if computed + waited >= patience:
            self.halt(Verdict(ENDLESS, "stuck"))
        elif thread is not self._holder or (computed < valve and waited < self.VALVE):
            return
        elif self._awaited(thread):
            thread.loose = True
            self._loose += 1
            self._dispatch(None)
        elif self._member is not None and waited >= self.VALVE:
            self._drifting = True
            self._catch_up()
            self._member.promise(self._zero + self.t + self.DRIFT)

    def _end_drift(self):
        self._drifting = False
        if self._member is not None:
            self._catch_up()

    def _catch_up(self):
        """Have it be as late as the clock shows, behind a program that waited for the host."""
        self._advance(max(self.t, self._clock.now() - self._zero))

    def _look_at_pace(self):
        """Tell that the host is busy; end where that is too much."""
        if self._crawl.look() < CRAWL:
            self.awaited = self._clock.latest
            self.halt(Verdict(BUSY, "too busy"))
        now = wall.monotonic()
        if self.pace.look() < pace.BUSY and now - self._told >= TOLD_EVERY:
            self._told = now
            self.tell(pace.in_words(self.pace.latest))

    def _wind_up(self):
        """Get hold of threads that were computing when the verdict fell."""
        throw = ctypes.pythonapi.PyThreadState_SetAsyncExc
        for attempt in range(2):
            efforts = {}
            while True:
                with self._mutex:
                    astray = [thread for thread in self._alive if not thread.waiting]
                    spent = [
                        sum(efforts.setdefault(thread, Effort(thread)).look()) for thread in astray
                    ]
                if not astray:
                    return
                if min(spent) >= ASTRAY:
                    break
                wall.sleep(0.0005)
            for thread in astray if attempt == 0 else ():
                throw(ctypes.c_ulong(thread.ident), ctypes.py_object(Over))


class Ticket(object):
    """A place in a waiting line."""

    __slots__ = ("thread", "called")

    def __init__(self, thread):
        self.thread = thread
        self.called = False


class WaitingLine(object):
    """Threads of the program waiting their turn: the one primitive under every lock."""

    def __init__(self, world):
        self._world = world
        self._line = collections.deque()

    def wait(self, timeout=None):
        """Stand in line; True when woken, False after `timeout` s (None: no limit)."""
        world = self._world
        me = world.current()
        ticket = Ticket(me)
        self._line.append(ticket)
        try:
            return world._wait(me, None if timeout is None else world.t + timeout, ticket)
        finally:
            if not ticket.called:
                self._line.remove(ticket)

    def wake(self):
        """Wake the first in line; False when the line is empty."""
        if not self._line:
            return False
        with self._world._mutex:
            ticket = self._line.popleft()
            ticket.called = True
            if ticket.thread.ticket is ticket:
                self._world._queue(ticket.thread, self._world.t)
        return True
