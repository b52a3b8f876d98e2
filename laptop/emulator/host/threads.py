"""A program's threads and locks: `_thread` and `threading` on the world's baton.

Rule: one primitive, the world's waiting line, is under every lock; all that the standard library
builds on locks (Condition, Event, Semaphore, Barrier, queues, pools) is its own code.
"""

import _thread as real_thread
import sys
import traceback

from laptop.emulator.host import linux
from laptop.emulator.host.clocks import copy_module
from laptop.emulator.host.waiting_line import WaitingLine

#: What starting a thread costs, s.
START_COST = 0.2e-3


def thread_module(world, clock):
    """A `_thread` module."""
    shim = copy_module(real_thread)
    order = {}

    def number_of(thread, native=False):
        """What Python on the brick, or its Linux, would call a VirtualThread."""
        place = order.setdefault(thread, len(order))
        return linux.PID + place if native else linux.FIRST_THREAD - linux.STACK * place

    def get_ident():
        """Number of the calling thread."""
        me = world.current()
        return real_thread.get_ident() if me is None else number_of(me)

    def get_native_id():
        """Number of the calling thread in the brick's Linux."""
        me = world.current()
        return linux.PID if me is None else number_of(me, native=True)

    def start_new_thread(function, args, kwargs=None):
        """Run `function` in a new thread that nobody waits for; returns its identifier."""

        def body():
            try:
                function(*args, **(kwargs or {}))
            except SystemExit:
                pass
            except Exception:
                sys.stderr.write("Unhandled exception in thread started by {!r}\n".format(function))
                traceback.print_exception(*sys.exc_info())

        world.begin()
        thread = world.spawn(body, "Dummy")
        clock.step(START_COST)
        return number_of(thread)

    shim.number_of, shim.get_ident, shim.get_native_id = number_of, get_ident, get_native_id
    shim.start_new_thread = shim.start_new = start_new_thread
    kind = type("lock", (Lock,), {"_world": world, "_clock": clock})
    shim.allocate_lock = shim.allocate = shim.lock = shim.LockType = kind
    # Bound to the calling thread by the real ones, and of no use to ours.
    shim._set_sentinel = real_thread.allocate_lock
    shim.__dict__.pop("RLock", None)
    return shim


class Lock(object):
    """_thread.lock for the program's threads: first come, first served.

    A thread of the host that meets one (a module imported during a run may keep it) gets it when
    it is free.
    """

    _world = _clock = None

    def __init__(self):
        self._line = WaitingLine(self._world)
        self._taken = False

    def acquire(self, blocking=True, timeout=-1):
        """Take it, waiting `timeout` s at most (-1: for ever); False if that failed."""
        if not blocking and timeout != -1:
            raise ValueError("can't specify a timeout for a non-blocking call")
        if timeout < 0 and timeout != -1:
            raise ValueError("timeout value must be a non-negative number")
        self._clock.step()
        if not self._taken:
            self._taken = True
            return True
        if not blocking or timeout == 0 or self._world.current() is None:
            return False
        return self._line.wait(None if timeout == -1 else timeout)

    def release(self):
        """Hand it to the first in line."""
        try:
            self._clock.step(0.0)
        finally:  # a handler that raises there does so after the lock is let go
            if not self._taken:
                raise RuntimeError("release unlocked lock")
            if not self._line.wake():
                self._taken = False

    def locked(self):
        """True while somebody has it."""
        self._clock.step()
        return self._taken

    def __enter__(self):
        return self.acquire()

    def __exit__(self, *error):
        self.release()

    def _at_fork_reinit(self):
        self._taken = False

    acquire_lock, release_lock, locked_lock = acquire, release, locked


class Threads(object):
    """The `threading` module of one run.

    Its Condition, Event, Semaphore, Barrier and RLock are the standard library's own code on our
    Lock; its Thread is ours.

    Args:
        module: a fresh copy of `threading`, imported on our `_thread` and `time`.
        low: our `_thread`.
    """

    def __init__(self, world, clock, module, low):
        self.world = world
        self.clock = clock
        self.module = module
        self.known = {}
        self.count = 0
        self.number_of = low.number_of
        low.RLock = module._PyRLock
        module.Lock = low.allocate_lock
        module.Thread = type("Thread", (_Thread,), {"_threads": self})
        module.Timer = type("Timer", (_Timer, module.Thread), {})
        module.Event.is_set = _asking(clock, module.Event.is_set)
        if hasattr(module.Event, "isSet"):
            module.Event.isSet = module.Event.is_set
        self.main = module.Thread(name="MainThread")
        module.main_thread = lambda: self.main
        module.current_thread = module.currentThread = self.current
        module.enumerate = lambda: list(self.known.values())
        module.active_count = module.activeCount = lambda: len(self.known)

    def current(self):
        """The calling Thread."""
        return self.known.get(self.world.current(), self.main)

    def enter_main(self):
        """The caller becomes the main thread."""
        self.main._begin(self.world.current())

    def join_all(self):
        """Wait for all threads but daemons, as Python does when the main module has ended."""
        for call in reversed(getattr(self.module, "_threading_atexits", [])):
            call()
        while True:
            others = [t for t in self.known.values() if t is not self.main and not t.daemon]
            if not others:
                return
            others[0].join()

    def failed(self, thread):
        """Report the exception being handled in `thread`."""
        kind, value, trace = sys.exc_info()
        hook = getattr(self.module, "excepthook", None)
        if hook is not None and hook is not getattr(self.module, "__excepthook__", hook):
            hook(self.module.ExceptHookArgs((kind, value, trace, thread)))
            return
        sys.stderr.write("Exception in thread {}:\n".format(thread.name))
        traceback.print_exception(kind, value, trace)


def _asking(clock, method):
    def asked(self):
        clock.step()
        return method(self)

    return asked


class _Thread(object):
    """threading.Thread on the world's baton."""

    _threads = None
    _own = None

    def __init__(self, group=None, target=None, name=None, args=(), kwargs=None, daemon=None):
        if group is not None:
            raise AssertionError("group argument must be None for now")
        threads = self._threads
        if name is None:
            threads.count += 1
            name = "Thread-{}".format(threads.count)
        self._target, self._args, self._kwargs = target, args, kwargs or {}
        self._own = _ThreadState(str(name), WaitingLine(threads.world))
        current = threads.current() if threads.known else None
        self._own.daemon = daemon if daemon is not None else bool(current and current.daemon)

    def start(self):
        """Begin; the new thread runs before this returns, up to its first wait."""
        own, threads = self._checked(), self._threads
        if own.started:
            raise RuntimeError("threads can only be started once")
        own.started = True
        threads.world.begin()
        own.thread = threads.world.spawn(self._bootstrap, own.name)
        threads.known[own.thread] = self
        threads.clock.step(START_COST)

    def run(self):
        """What the thread does; for subclasses to replace."""
        if self._target is not None:
            self._target(*self._args, **self._kwargs)

    def _begin(self, thread):
        self._own.started = True
        self._own.thread = thread
        self._threads.known[thread] = self

    def _bootstrap(self):
        own = self._own
        try:
            self.run()
        except SystemExit:
            pass
        except Exception:
            self._threads.failed(self)
        finally:
            if self._threads.world.exit is None:
                own.ended = True
                self._threads.known.pop(own.thread, None)
                while own.waiting.wake():
                    pass

    def join(self, timeout=None):
        """Wait until the thread has ended, `timeout` s at most."""
        own, world = self._checked(), self._threads.world
        if not own.started:
            raise RuntimeError("cannot join thread before it is started")
        if own.thread is world.current():
            raise RuntimeError("cannot join current thread")
        self._threads.clock.step()
        deadline = None if timeout is None else world.now() + max(0.0, timeout)
        while not own.ended and (deadline is None or world.now() < deadline):
            own.waiting.wait(None if deadline is None else deadline - world.now())

    def is_alive(self):
        """True between start and end."""
        own = self._checked()
        self._threads.clock.step()
        return own.started and not own.ended

    def _checked(self):
        if self._own is None:
            raise RuntimeError("thread.__init__() not called")
        return self._own

    @property
    def name(self):
        return self._checked().name

    @name.setter
    def name(self, name):
        self._checked().name = str(name)

    @property
    def daemon(self):
        return self._checked().daemon

    @daemon.setter
    def daemon(self, daemon):
        if self._checked().started:
            raise RuntimeError("cannot set daemon status of active thread")
        self._own.daemon = bool(daemon)

    @property
    def ident(self):
        thread = self._checked().thread
        return thread and self._threads.number_of(thread)

    @property
    def native_id(self):
        thread = self._checked().thread
        return thread and self._threads.number_of(thread, native=True)

    def __repr__(self):
        own = self._checked()
        state = "stopped" if own.ended else "started" if own.started else "initial"
        daemon = " daemon" if own.daemon else ""
        return "<{}({}, {}{})>".format(type(self).__name__, own.name, state, daemon)


# The names from before Python 2.6, as scripts still write them.
_Thread.isAlive = _Thread.is_alive  # type: ignore[attr-defined]
_Thread.getName = lambda self: self.name  # type: ignore[attr-defined]
_Thread.setName = lambda self, name: setattr(self, "name", name)  # type: ignore[attr-defined]
_Thread.isDaemon = lambda self: self.daemon  # type: ignore[attr-defined]
_Thread.setDaemon = lambda self, daemonic: setattr(self, "daemon", daemonic)  # type: ignore[attr-defined]


class _ThreadState(object):
    """The state of a Thread, out of the way of its subclasses' attributes."""

    def __init__(self, name, waiting):
        self.name = name
        self.waiting = waiting
        self.daemon = self.started = self.ended = False
        self.thread = None


class _Timer(object):
    """threading.Timer: calls a function after `interval` s unless cancelled."""

    def __init__(self, interval, function, args=None, kwargs=None):
        super(_Timer, self).__init__()
        self.interval, self.function = interval, function
        self.args, self.kwargs = args or [], kwargs or {}
        self.finished = self._threads.module.Event()

    def cancel(self):
        """Stop it if it has not called yet."""
        self.finished.set()

    def run(self):
        self.finished.wait(self.interval)
        if not self.finished.is_set():
            self.function(*self.args, **self.kwargs)
        self.finished.set()
