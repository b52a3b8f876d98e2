"""A program's threads and locks: `_thread` and `threading` on the world's baton.

Rule: one primitive, the world's wait queue, is under every lock; all that the standard library
builds on locks (Condition, Event, Semaphore, Barrier, queues, pools) is its own code.
"""

import _thread as real_thread
import sys
import traceback
from types import ModuleType
from typing import Any, Callable, Iterable, Mapping, Optional

from laptop.emulator.host import linux
from laptop.emulator.host.clocks import copy_module
from laptop.emulator.host.wait_queue import WaitQueue

MYPY = False
if MYPY:
    from typing import Dict, Type  # noqa: F401

    from laptop.emulator.host.clocks import ProgramClock
    from laptop.emulator.host.virtual_thread import VirtualThread
    from laptop.emulator.host.world import World

#: Cost of starting a thread, s.
START_COST = 0.2e-3


def thread_module(world: "World", clock: "ProgramClock") -> ModuleType:
    """Make a `_thread` module."""
    order = {}  # type: Dict[VirtualThread, int]

    def number_of(thread: "VirtualThread", native: bool = False) -> int:
        """Return the number of a VirtualThread in Python on the brick, or in its Linux."""
        place = order.setdefault(thread, len(order))
        return linux.PID + place if native else linux.FIRST_THREAD - linux.STACK * place

    def get_ident() -> int:
        """Return the number of the calling thread."""
        me = world.current()
        return real_thread.get_ident() if me is None else number_of(me)

    def get_native_id() -> int:
        """Return the number of the calling thread in the brick's Linux."""
        me = world.current()
        return linux.PID if me is None else number_of(me, native=True)

    def start_new_thread(
        function: Callable[..., object],
        args: Iterable[Any],
        kwargs: Optional[Mapping[str, Any]] = None,
    ) -> int:
        """Run `function` in a new thread that is never joined; return its identifier."""

        def body() -> None:
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

    kind = type("lock", (Lock,), {"_world": world, "_clock": clock})
    shim = copy_module(
        real_thread,
        number_of=number_of,
        get_ident=get_ident,
        get_native_id=get_native_id,
        start_new_thread=start_new_thread,
        start_new=start_new_thread,
        allocate_lock=kind,
        allocate=kind,
        lock=kind,
        LockType=kind,
        # The real ones bind them to the calling thread; ours do not use them.
        _set_sentinel=real_thread.allocate_lock,
    )
    vars(shim).pop("RLock", None)
    return shim


class Lock(object):
    """_thread.lock for the program's threads: first come, first served.

    A thread of the host may hold one, too (a module imported during a run may store it), when it is
    free.
    """

    @property
    def _world(self) -> "World":
        raise NotImplementedError("of the classes that thread_module makes")

    @property
    def _clock(self) -> "ProgramClock":
        raise NotImplementedError("of the classes that thread_module makes")

    def __init__(self) -> None:
        self._line = WaitQueue(self._world)
        self._taken = False

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Acquire it, waiting `timeout` s at most (-1: for ever); False if that failed."""
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

    def release(self) -> None:
        """Pass it to the first that waits."""
        try:
            self._clock.step(0.0)
        finally:  # a handler that raises there does so after the release
            if not self._taken:
                raise RuntimeError("release unlocked lock")
            if not self._line.wake():
                self._taken = False

    def locked(self) -> bool:
        """Return True while it is held."""
        self._clock.step()
        return self._taken

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *error: object) -> None:
        self.release()

    def _at_fork_reinit(self) -> None:
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

    def __init__(
        self, world: "World", clock: "ProgramClock", module: ModuleType, low: ModuleType
    ) -> None:
        self.world = world
        self.clock = clock
        self.module = module
        self.known = {}  # type: Dict[Optional[VirtualThread], ProgramThread]
        self.count = 0
        self.number_of = low.number_of  # type: Callable[..., int]
        vars(low)["RLock"] = module._PyRLock
        kind = type("Thread", (ProgramThread,), {"_threads": self})  # type: Type[ProgramThread]
        timer = type("Timer", (_Timer, kind), {})
        vars(module).update(Lock=low.allocate_lock, Thread=kind, Timer=timer)
        module.Event.is_set = _asking(clock, module.Event.is_set)
        if hasattr(module.Event, "isSet"):
            module.Event.isSet = module.Event.is_set
        self.main = kind(name="MainThread")
        vars(module).update(
            main_thread=lambda: self.main,
            current_thread=self.current,
            currentThread=self.current,
            enumerate=lambda: list(self.known.values()),
            active_count=lambda: len(self.known),
            activeCount=lambda: len(self.known),
        )

    def current(self) -> "ProgramThread":
        """Return the calling Thread."""
        return self.known.get(self.world.current(), self.main)

    def enter_main(self) -> None:
        """Make the caller the main thread."""
        self.main._begin(self.world.current())

    def join_all(self) -> None:
        """Wait for all threads but daemons, as Python does when the main module has ended."""
        for call in reversed(getattr(self.module, "_threading_atexits", [])):
            call()
        while True:
            others = [t for t in self.known.values() if t is not self.main and not t.daemon]
            if not others:
                return
            others[0].join()

    def failed(self, thread: "ProgramThread") -> None:
        """Report the exception being handled in `thread`."""
        kind, value, trace = sys.exc_info()
        hook = getattr(self.module, "excepthook", None)
        if hook is not None and hook is not getattr(self.module, "__excepthook__", hook):
            hook(self.module.ExceptHookArgs((kind, value, trace, thread)))
            return
        sys.stderr.write("Exception in thread {}:\n".format(thread.name))
        traceback.print_exception(kind, value, trace)


def _asking(clock: "ProgramClock", method: Callable[[Any], bool]) -> Callable[[Any], bool]:
    def asked(self: Any) -> bool:
        clock.step()
        return method(self)

    return asked


class ProgramThread(object):
    """threading.Thread on the world's baton."""

    _own = None  # type: Optional[_ThreadState]

    @property
    def _threads(self) -> Threads:
        raise NotImplementedError("of the class that Threads makes")

    def __init__(
        self,
        group: None = None,
        target: Optional[Callable[..., object]] = None,
        name: Optional[str] = None,
        args: Iterable[Any] = (),
        kwargs: Optional[Mapping[str, Any]] = None,
        daemon: Optional[bool] = None,
    ) -> None:
        if group is not None:
            raise AssertionError("group argument must be None for now")
        threads = self._threads
        if name is None:
            threads.count += 1
            name = "Thread-{}".format(threads.count)
        self._target, self._args, self._kwargs = target, args, kwargs or {}
        self._own = _ThreadState(str(name), WaitQueue(threads.world))
        current = threads.current() if threads.known else None
        self._own.daemon = daemon if daemon is not None else bool(current and current.daemon)

    def start(self) -> None:
        """Begin; the new thread runs before this returns, up to its first wait."""
        own, threads = self._checked(), self._threads
        if own.started:
            raise RuntimeError("threads can only be started once")
        own.started = True
        threads.world.begin()
        own.thread = threads.world.spawn(self._bootstrap, own.name)
        threads.known[own.thread] = self
        threads.clock.step(START_COST)

    def run(self) -> None:
        """Do the thread's work; subclasses override it."""
        if self._target is not None:
            self._target(*self._args, **self._kwargs)

    def _begin(self, thread: "Optional[VirtualThread]") -> None:
        own = self._checked()
        own.started = True
        own.thread = thread
        self._threads.known[thread] = self

    def _bootstrap(self) -> None:
        own = self._checked()
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

    def join(self, timeout: Optional[float] = None) -> None:
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

    def is_alive(self) -> bool:
        """Return True between start and end."""
        own = self._checked()
        self._threads.clock.step()
        return own.started and not own.ended

    def _checked(self) -> "_ThreadState":
        if self._own is None:
            raise RuntimeError("thread.__init__() not called")
        return self._own

    @property
    def name(self) -> str:
        """For people."""
        return self._checked().name

    @name.setter
    def name(self, name: str) -> None:
        self._checked().name = str(name)

    @property
    def daemon(self) -> bool:
        """Whether the program ends without waiting for it."""
        return self._checked().daemon

    @daemon.setter
    def daemon(self, daemon: bool) -> None:
        own = self._checked()
        if own.started:
            raise RuntimeError("cannot set daemon status of active thread")
        own.daemon = bool(daemon)

    @property
    def ident(self) -> Optional[int]:
        """Its number in Python; None before it starts."""
        thread = self._checked().thread
        return None if thread is None else self._threads.number_of(thread)

    @property
    def native_id(self) -> Optional[int]:
        """Its number in the brick's Linux; None before it starts."""
        thread = self._checked().thread
        return None if thread is None else self._threads.number_of(thread, native=True)

    def __repr__(self) -> str:
        own = self._checked()
        state = "stopped" if own.ended else "started" if own.started else "initial"
        daemon = " daemon" if own.daemon else ""
        return "<{}({}, {}{})>".format(type(self).__name__, own.name, state, daemon)


# The names from before Python 2.6, as scripts still write them.
_OLD_NAMES = {
    "isAlive": ProgramThread.is_alive,
    "getName": lambda self: self.name,
    "setName": lambda self, name: setattr(self, "name", name),
    "isDaemon": lambda self: self.daemon,
    "setDaemon": lambda self, daemonic: setattr(self, "daemon", daemonic),
}  # type: Dict[str, Callable[..., Any]]
for _name, _method in _OLD_NAMES.items():
    setattr(ProgramThread, _name, _method)


class _ThreadState(object):
    """State of a Thread, apart from its subclasses' attributes."""

    def __init__(self, name: str, waiting: WaitQueue) -> None:
        self.name = name
        self.waiting = waiting
        self.daemon = self.started = self.ended = False
        self.thread = None  # type: Optional[VirtualThread]


class _Timer(ProgramThread):
    """threading.Timer: calls a function after `interval` s unless cancelled."""

    def __init__(
        self,
        interval: float,
        function: Callable[..., object],
        args: Optional[Iterable[Any]] = None,
        kwargs: Optional[Mapping[str, Any]] = None,
    ) -> None:
        super(_Timer, self).__init__()
        self.interval, self.function = interval, function
        self.args, self.kwargs = args or [], kwargs or {}
        self.finished = self._threads.module.Event()

    def cancel(self) -> None:
        """Stop it if it has not called yet."""
        self.finished.set()

    def run(self) -> None:
        """Wait, and call."""
        self.finished.wait(self.interval)
        if not self.finished.is_set():
            self.function(*self.args, **self.kwargs)
        self.finished.set()
