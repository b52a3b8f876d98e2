"""The standard library's clocks, threads, signals and processes on an emulated world's time.

For the length of one run the modules a program could measure or pass time with are replaced, and
everything that had bound their names is imported afresh; afterwards all is as before.  So a script
runs unmodified, and so does python-ev3dev2 under it.

Rule: nothing here reaches out of the emulation.  No process is started, forked or signalled, and no
signal handler of the host is changed.

What costs virtual time: reading a clock, taking a lock or asking a thread's state CLOCK_COST, a
`print` PRINT_COST, starting a process START_COST.  So loops that poll come to an end.

Left as they are: sockets (a blocking call blocks the wall clock; let other threads run with the
valve), standard input, and the random generator, but that starts from the same seed in every run.
"""

import atexit as real_atexit
import builtins
import contextlib
import datetime as real_datetime
import fcntl as real_fcntl
import importlib
import importlib.machinery
import io
import os
import random
import select as real_select
import signal as real_signal
import sys
import time as real_time
import traceback
import types

from laptop.simulator.peripherals import EventFile, Finished, split_line
from laptop.simulator.sysfs import Poll
from laptop.simulator.world import ENDLESS, Verdict, WaitingLine

CLOCK_COST = 20e-6
PRINT_COST = 0.5e-3
START_COST = 0.03
THREAD_START_COST = 0.2e-3
#: When the emulated brick is switched on, s since 1970, and how long it had been up at t = 0.
EPOCH = 1586476800.0
UPTIME = 100.0
FD_POLL_PERIOD = 0.01

#: Modules that bind the names replaced here, and so must be imported afresh.
REBOUND = (
    "queue sched timeit selectors asyncio concurrent socketserver logging subprocess multiprocessing"
    " http wsgiref xmlrpc"
).split()
#: The program's own side: never shared with the host.
PROGRAM = ("ev3dev2", "robot", "shared")
#: Imported before any script starts; a sibling of the same name is not seen by real Python either.
_AT_START = (
    "abc codecs encodings genericpath importlib io os posixpath site stat sys sysconfig types warnings"
    " zipimport laptop"
).split()


def _copy(module):
    shim = types.ModuleType(module.__name__)
    vars(shim).update(vars(module))
    return shim


def _top(name):
    return name.partition(".")[0]


class Shims(object):
    """All replacements for one run.

    Args:
        world: World.  peripherals: Peripherals.
    """

    def __init__(self, world, peripherals):
        self.world = world
        self.peripherals = peripherals
        self.clock = _Clock(world)
        self.signals = Signals(world, self.clock)
        self.processes = _Processes(world, self.clock, peripherals)
        self.exit_calls = []
        self._screens = set()
        self.threads = None

    @contextlib.contextmanager
    def installed(self, folder):
        """Replace the modules for a `with` block.

        Args:
            folder: where the script is; what it may import from there is imported afresh.
        """
        kept = _Kept()
        try:
            random.seed(0)
            importlib.invalidate_caches()
            siblings = {os.path.splitext(name)[0] for name in os.listdir(folder)}
            siblings -= set(_AT_START) | set(sys.builtin_module_names)
            for name in list(sys.modules):
                if _top(name) in siblings or _top(name) in PROGRAM or _top(name) in REBOUND:
                    del sys.modules[name]
            # These two would wait in C, where no baton is passed; Python's own versions step in.
            sys.modules["_queue"] = sys.modules["_asyncio"] = None
            self._replace_os()
            sys.modules["time"] = self._time_module()
            sys.modules["_thread"] = low = self._thread_module()
            sys.modules.pop("threading", None)
            self.threads = Threads(self.world, self.clock, importlib.import_module("threading"), low)
            sys.modules["select"] = self._select_module()
            sys.modules["signal"] = self.signals.module()
            sys.modules["datetime"] = _datetime_module(self.clock)
            sys.modules["atexit"] = self._atexit_module()
            sys.modules["fcntl"] = self._fcntl_module()
            sys.modules["evdev"] = self.peripherals.evdev_module(lambda: WaitingLine(self.world))
            sys.modules["evdev.ecodes"] = sys.modules["evdev"].ecodes
            importlib.import_module("subprocess").Popen = self.processes.popen()
            builtins.print = self._print
            builtins.open = self._open
            library = importlib.import_module("ev3dev2")
            library.get_current_platform = lambda: "ev3"
            if not _has_fonts(library):
                library.fonts = sys.modules["ev3dev2.fonts"] = _fonts_module()
            yield self
        finally:
            kept.restore()
            for descriptor in self._screens:
                os.close(descriptor)
            self._screens.clear()
            self.peripherals.close_screen()

    def finish(self):
        """What Python does when the main module has come to its end; called in its thread."""
        self.threads.join_all()
        while self.exit_calls:
            function, args, kwargs = self.exit_calls.pop()
            try:
                function(*args, **kwargs)
            except Exception:
                traceback.print_exc()

    # Modules

    def _time_module(self):
        clock, world = self.clock, self.world
        shim = _copy(real_time)

        def sleep(secs):
            """Wait `secs` of virtual time."""
            if secs < 0:
                raise ValueError("sleep length must be non-negative")
            clock.step()
            world.sleep(secs)

        def clock_gettime(clk_id):
            """Time of one of the system's clocks, s."""
            return clock.time() if clk_id == real_time.CLOCK_REALTIME else clock.monotonic()

        def since_epoch(convert):
            def converted(secs=None):
                return convert(clock.time() if secs is None else secs)

            return converted

        def formatted(write):
            def written(t=None):
                return write(shim.localtime() if t is None else t)

            return written

        shim.sleep = sleep
        shim.time = clock.time
        shim.monotonic = shim.perf_counter = clock.monotonic
        shim.process_time = shim.thread_time = clock.busy
        shim.clock_gettime = clock_gettime
        for name in ("time", "monotonic", "perf_counter", "process_time", "thread_time"):
            setattr(shim, name + "_ns", _in_nanoseconds(getattr(shim, name)))
        shim.clock_gettime_ns = lambda clk_id: int(round(clock_gettime(clk_id) * 1e9))
        if hasattr(real_time, "clock"):
            shim.clock = clock.busy
        for name in ("localtime", "gmtime", "ctime"):
            setattr(shim, name, since_epoch(getattr(real_time, name)))
        shim.asctime = formatted(real_time.asctime)
        shim.strftime = lambda format, t=None: real_time.strftime(
            format, shim.localtime() if t is None else t
        )
        return shim

    def _thread_module(self):
        import _thread as real

        shim = _copy(real)
        world, clock = self.world, self.clock

        def start_new_thread(function, args, kwargs=None):
            """Run `function` in a new thread that nobody waits for; returns its identifier."""

            def body():
                try:
                    function(*args, **(kwargs or {}))
                except SystemExit:
                    pass
                except Exception:
                    sys.stderr.write("Unhandled exception in thread started by {!r}\n".format(function))
                    _print_exception(*sys.exc_info())

            thread = world.spawn(body, "Dummy")
            clock.step(THREAD_START_COST)
            return thread.ident or id(thread)

        shim.start_new_thread = shim.start_new = start_new_thread
        shim.allocate_lock = shim.allocate = shim.lock = lambda: Lock(world, clock)
        shim.LockType = Lock
        # Bound to the calling thread by the real ones, and of no use to ours.
        shim._set_sentinel = real.allocate_lock
        shim.__dict__.pop("RLock", None)
        return shim

    def _select_module(self):
        shim = _copy(real_select)
        world = self.world

        class WatchedFiles(object):
            """select.poll() on attributes of the brick and on files of the host."""

            def __init__(self):
                self._attributes = Poll(world)
                self._some = False
                self._files = real_select.poll()

            def register(self, fd, eventmask=real_select.POLLIN | real_select.POLLPRI):
                if hasattr(fd, "device"):
                    self._some = True
                    self._attributes.register(fd, eventmask)
                else:
                    self._files.register(fd, eventmask)

            def unregister(self, fd):
                self._files.unregister(fd)

            def modify(self, fd, eventmask):
                self._files.modify(fd, eventmask)

            def poll(self, timeout=None):
                if timeout is not None and timeout < 0:
                    timeout = None
                if self._some:
                    return self._attributes.poll(timeout)
                seconds = None if timeout is None else timeout / 1000.0
                return _watch(world, lambda: self._files.poll(0), seconds)

        class WatchedEpoll(object):
            """select.epoll() that waits in virtual time."""

            def __init__(self, *args):
                self._real = real_select.epoll()

            def __getattr__(self, name):
                return getattr(self._real, name)

            def poll(self, timeout=None, maxevents=-1):
                seconds = None if timeout is None or timeout < 0 else timeout
                return _watch(world, lambda: self._real.poll(0, maxevents), seconds)

        def select(rlist, wlist, xlist, timeout=None):
            """select.select() that waits in virtual time."""
            found = _watch(
                world, lambda: [f for f in [real_select.select(rlist, wlist, xlist, 0)] if any(f)], timeout
            )
            return found[0] if found else ([], [], [])

        shim.poll = WatchedFiles
        shim.select = select
        if hasattr(real_select, "epoll"):
            shim.epoll = WatchedEpoll
        return shim

    def _atexit_module(self):
        shim = _copy(real_atexit)

        def register(func, *args, **kwargs):
            """Call `func` when the program has ended."""
            self.exit_calls.append((func, args, kwargs))
            return func

        def unregister(func):
            """Take `func` back."""
            self.exit_calls[:] = [call for call in self.exit_calls if call[0] != func]

        shim.register, shim.unregister = register, unregister
        shim._clear = lambda: self.exit_calls.clear()
        return shim

    def _fcntl_module(self):
        shim = _copy(real_fcntl)

        def ioctl(fd, request, arg=0, mutate_flag=True):
            """ioctl that knows the brick's buttons and screen."""
            if self.peripherals.ioctl(fd, request, arg, self._screens):
                return 0
            return real_fcntl.ioctl(fd, request, arg, mutate_flag)

        shim.ioctl = ioctl
        return shim

    # Names in modules that stay

    def _replace_os(self):
        processes, world = self.processes, self.world

        def refuse(name):
            def refused(*args, **kwargs):
                raise OSError("os.{} does not work on the emulated brick: use threads".format(name))

            return refused

        for name in dir(os):
            if name.startswith(("fork", "exec", "spawn", "posix_spawn")):
                setattr(os, name, refuse(name))

        def leave(status):
            """End the program at once."""
            world.halt(Verdict(status & 0xFF, "ended"))
            world.touch(0.0)

        def kill(pid, sig):
            """Signal the program itself; there is nobody else."""
            if pid not in (os.getpid(), 0):
                raise ProcessLookupError("no process {} on the emulated brick".format(pid))
            if sig:
                self.signals.post(sig)
            self.clock.step()

        def listdir(path="."):
            """os.listdir in alphabetical order, so that runs repeat."""
            return sorted(real_listdir(path))

        def open_descriptor(path, flags, mode=0o777, dir_fd=None):
            """os.open that knows the brick's framebuffer."""
            if path == "/dev/fb0":
                descriptor = self.peripherals.open_screen()
                self._screens.add(descriptor)
                return descriptor
            return real_open(path, flags, mode, dir_fd=dir_fd)

        def close(fd):
            """os.close that lets go of the framebuffer."""
            self._screens.discard(fd)
            real_close(fd)

        real_listdir, real_open, real_close = os.listdir, os.open, os.close
        os.listdir, os.open, os.close = listdir, open_descriptor, close
        os.system = processes.system
        os._exit = leave
        os.abort = lambda: leave(128 + real_signal.SIGABRT)
        os.kill = os.killpg = kill
        os.register_at_fork = lambda before=None, after_in_parent=None, after_in_child=None: None

    def _print(self, *args, **kwargs):
        self.clock.step(PRINT_COST)
        _REAL_PRINT(*args, **kwargs)

    def _open(self, file, mode="r", *args, **kwargs):
        device = self.peripherals.open(file) if isinstance(file, str) else None
        if device is None:
            return _REAL_OPEN(file, mode, *args, **kwargs)
        return device if isinstance(device, EventFile) else _AttributeFile(device, "b" in mode)


_REAL_PRINT, _REAL_OPEN = builtins.print, builtins.open


class _Kept(object):
    """What of the host a run may change, to be put back."""

    def __init__(self):
        self._modules = dict(sys.modules)
        self._builtins = dict(vars(builtins))
        self._os = dict(vars(os))
        self._sys = {
            name: getattr(sys, name)
            for name in ("argv", "path", "stdin", "stdout", "stderr", "excepthook", "displayhook",
                         "dont_write_bytecode", "unraisablehook", "meta_path", "path_hooks")
            if hasattr(sys, name)
        }  # fmt: skip
        self._lists = [(value, list(value)) for value in self._sys.values() if isinstance(value, list)]
        self._recursion = sys.getrecursionlimit()
        self._environment = dict(os.environ)
        self._folder = os.getcwd()
        self._random = random.getstate()

    def restore(self):
        for namespace, before in ((vars(builtins), self._builtins), (vars(os), self._os)):
            for name in [name for name in namespace if name not in before]:
                del namespace[name]
            namespace.update(before)
        for name, value in self._sys.items():
            setattr(sys, name, value)
        for value, items in self._lists:
            value[:] = items
        sys.setrecursionlimit(self._recursion)
        os.environ.clear()
        os.environ.update(self._environment)
        os.chdir(self._folder)
        random.setstate(self._random)
        self._restore_modules()

    def _restore_modules(self):
        # Extension modules cannot be relied on to be imported twice: their packages stay, but for
        # Pillow, which can, and which python-ev3dev2 brings in.
        compiled = {
            _top(name)
            for name, module in list(sys.modules.items())
            if isinstance(
                getattr(getattr(module, "__spec__", None), "loader", None),
                importlib.machinery.ExtensionFileLoader,
            )
        } - {"PIL"}
        # A thread that never comes back from importing a module would hold that module's lock.
        locks = getattr(importlib._bootstrap, "_module_locks", {})
        for name in list(sys.modules):
            if name not in self._modules and _top(name) not in compiled:
                del sys.modules[name]
                locks.pop(name, None)
        sys.modules.update(self._modules)


class _Clock(object):
    """Readings of the world's clock by a program.  Who is not of the program pays nothing."""

    def __init__(self, world):
        self._world = world

    def step(self, cost=CLOCK_COST):
        """Spend a moment, s."""
        if self._world.current() is not None:
            self._world.touch(cost)

    def time(self):
        """Seconds since 1970."""
        self.step()
        return EPOCH + self._world.now()

    def monotonic(self):
        """Seconds since the brick was switched on."""
        self.step()
        return UPTIME + self._world.now()

    def busy(self):
        """Seconds the program has computed."""
        self.step()
        return self._world.busy


def _in_nanoseconds(read):
    def read_ns():
        return int(round(read() * 1e9))

    return read_ns


def _watch(world, look, timeout):
    """Ask `look()` until it finds something or `timeout` s (None: never) have passed."""
    deadline = None if timeout is None else world.now() + timeout
    while True:
        found = look()
        left = FD_POLL_PERIOD if deadline is None else deadline - world.now()
        if found or left <= 0:
            return found
        world.sleep(min(left, FD_POLL_PERIOD))


class _AttributeFile(object):
    """A device attribute that the script opened itself."""

    def __init__(self, attribute, binary):
        self._attribute = attribute
        self._binary = binary

    def read(self, size=-1):
        data = self._attribute.read()
        return data if self._binary else data.decode()

    readline = read

    def readlines(self):
        return self.read().splitlines(True)

    def __iter__(self):
        return iter(self.readlines())

    def write(self, text):
        self._attribute.write(text if self._binary else text.encode())
        return len(text)

    def seek(self, offset, whence=0):
        return 0

    def flush(self):
        """Nothing is buffered."""

    def close(self):
        """Nothing to let go of."""

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass


def _datetime_module(clock):
    shim = _copy(real_datetime)

    class AnyDatetime(type):
        def __instancecheck__(cls, value):
            return isinstance(value, real_datetime.datetime)

        def __subclasscheck__(cls, other):
            return issubclass(other, real_datetime.datetime)

    class datetime(real_datetime.datetime, metaclass=AnyDatetime):
        """datetime.datetime on virtual time."""

        @classmethod
        def now(cls, tz=None):
            return cls.fromtimestamp(clock.time(), tz)

        @classmethod
        def utcnow(cls):
            return cls.fromtimestamp(clock.time(), real_datetime.timezone.utc).replace(tzinfo=None)

        @classmethod
        def today(cls):
            return cls.now()

    class AnyDate(type):
        def __instancecheck__(cls, value):
            return isinstance(value, real_datetime.date)

        def __subclasscheck__(cls, other):
            return issubclass(other, real_datetime.date)

    class date(real_datetime.date, metaclass=AnyDate):
        """datetime.date on virtual time."""

        @classmethod
        def today(cls):
            return cls.fromtimestamp(clock.time())

    shim.datetime, shim.date = datetime, date
    return shim


def _print_exception(kind, value, trace):
    """As Python would, without the frames of the emulator the program was called from."""
    while trace is not None and trace.tb_frame.f_globals.get("__name__", "").startswith("laptop."):
        trace = trace.tb_next
    traceback.print_exception(kind, value, trace)


class Lock(object):
    """_thread.lock for the program's threads: first come, first served.

    A thread of the host that meets one (a module imported during a run may keep it) gets it when
    it is free.
    """

    def __init__(self, world, clock):
        self._world = world
        self._clock = clock
        self._line = WaitingLine(world)
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
        self._clock.step(0.0)
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
        _print_exception(kind, value, trace)


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
        own.thread = threads.world.spawn(self._bootstrap, own.name)
        threads.known[own.thread] = self
        threads.clock.step(THREAD_START_COST)

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
            if self._threads.world.verdict is None:
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
        return self._checked().thread and self._own.thread.ident

    native_id = ident
    isAlive = is_alive

    def getName(self):
        return self.name

    def setName(self, name):
        self.name = name

    def isDaemon(self):
        return self.daemon

    def setDaemon(self, daemonic):
        self.daemon = daemonic

    def __repr__(self):
        own = self._checked()
        state = "stopped" if own.ended else "started" if own.started else "initial"
        daemon = " daemon" if own.daemon else ""
        return "<{}({}, {}{})>".format(type(self).__name__, own.name, state, daemon)


class _ThreadState(object):
    """What a Thread knows of itself, out of the way of its subclasses' attributes."""

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


class Signals(object):
    """The program's signal handlers; signals arrive by `post`, never by the host's kernel.

    `pending` holds the numbers of those the program has not looked at yet.
    """

    _HARMLESS = tuple(
        getattr(real_signal, name)
        for name in ("SIGCHLD", "SIGCONT", "SIGURG", "SIGWINCH")
        if hasattr(real_signal, name)
    )

    def __init__(self, world, clock):
        self._world = world
        self._clock = clock
        self._pausing = WaitingLine(world)
        self._timers = {}
        self.pending = set()
        self._handlers = {
            real_signal.SIGINT: real_signal.default_int_handler,
            real_signal.SIGPIPE: real_signal.SIG_IGN,
        }

    def post(self, number):
        """Deliver a signal to the program, now: its own handler runs, or the default action."""
        world = self._world
        if world.verdict is not None:
            return
        name = real_signal.Signals(number).name
        handler = self._handlers.get(number, real_signal.SIG_DFL)
        if number == real_signal.SIGSTOP:
            world.halt(Verdict(ENDLESS, "frozen"))
        elif number == real_signal.SIGKILL or handler == real_signal.SIG_DFL:
            if number not in self._HARMLESS:
                world.halt(Verdict(128 + number, name))
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
        shim = _copy(real_signal)
        world, clock = self._world, self._clock

        def signal(signalnum, handler):
            """Set the program's handler; returns the one before."""
            if not world.is_main():
                raise ValueError("signal only works in main thread")
            if signalnum in (real_signal.SIGKILL, real_signal.SIGSTOP):
                raise OSError(22, os.strerror(22))
            if not callable(handler) and handler not in (real_signal.SIG_DFL, real_signal.SIG_IGN):
                raise TypeError(
                    "signal handler must be signal.SIG_IGN, signal.SIG_DFL, or a callable object"
                )
            before = shim.getsignal(signalnum)
            self._handlers[real_signal.Signals(signalnum)] = handler
            return before

        def getsignal(signalnum):
            """The program's handler."""
            return self._handlers.get(real_signal.Signals(signalnum), real_signal.SIG_DFL)

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
            return int(round(setitimer(real_signal.ITIMER_REAL, seconds)[0]))

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
            real_signal.ITIMER_VIRTUAL: real_signal.SIGVTALRM,
            real_signal.ITIMER_PROF: real_signal.SIGPROF,
        }.get(which, real_signal.SIGALRM)

        def ring():
            del self._timers[which]
            if interval > 0:
                self._set_timer(which, interval, interval)
            self.post(number)

        self._timers[which] = (self._world.at(self._world.now() + seconds, ring), interval)


def _has_fonts(library):
    folder = os.path.join(os.path.dirname(library.__file__), "fonts")
    return os.path.isdir(folder) and any(name.endswith(".pil") for name in os.listdir(folder))


def _fonts_module():
    """`ev3dev2.fonts` by the names on the brick, all in Pillow's default font.

    The library's bitmap fonts are on the brick, but not in what pip installs.
    """
    module = types.ModuleType("ev3dev2.fonts")
    families = "charB charBI charI charR courB courBO courO courR helvB helvBO helvO helvR luBIS luBS"
    families += " luIS luRS lutBS lutRS ncenB ncenBI ncenI ncenR symb timB timBI timI timR"
    names = {family + size for family in families.split() for size in "08 10 12 14 18 24".split()}
    names.update("luBS19 luIS19 luRS19 lutBS19 lutRS19 tech14 techB14 term14 termB14".split())

    def available():
        """The names of the fonts."""
        return sorted(names)

    def load(name):
        """The font of that name."""
        if name not in names:
            raise Exception('Failed to load font "{}". '.format(name))
        return importlib.import_module("PIL.ImageFont").load_default()

    module.available, module.load = available, load
    return module


class _Output(io.BytesIO):
    """A process's output; `seconds` of sound may be in it."""

    seconds = 0.0


class _Processes(object):
    """Stands for the shell and the programs of the brick; nothing is started."""

    def __init__(self, world, clock, peripherals):
        self._world = world
        self._clock = clock
        self._peripherals = peripherals
        self._last_pid = 1000

    def execute(self, args, shell, piped):
        """What a command does, as Finished."""
        if shell:
            return self._shell(args if isinstance(args, str) else args[0], piped)
        words = [args] if isinstance(args, str) else [str(word) for word in args]
        finished = self._peripherals.command(words, piped)
        if finished is None:
            raise FileNotFoundError(
                2, "No such program on the emulated brick, which starts none of the laptop's", words[0]
            )
        return finished

    def _shell(self, line, piped):
        status, output, errors, seconds = 0, b"", b"", 0.0
        try:
            commands = split_line(line)
        except ValueError as error:
            return Finished(2, b"", "sh: {}\n".format(error).encode(), 0.0)
        for words, background, reads_pipe in commands:
            sound = getattr(output, "seconds", 0.0) if reads_pipe else piped
            finished = self._peripherals.command(words, sound)
            if finished is None:
                message = "sh: 1: {}: not found\n".format(words[0]).encode()
                finished = Finished(127, b"", message, 0.0)
            status = finished.status
            output = finished.output if reads_pipe or not output else output + finished.output
            errors += finished.errors
            seconds += 0.0 if background else finished.seconds
        return Finished(status, output, errors, seconds)

    def system(self, command):
        """os.system."""
        self._clock.step(START_COST)
        finished = self._shell(command, 0.0)
        self._world.sleep(finished.seconds)
        sys.stdout.write(finished.output.decode())
        sys.stderr.write(finished.errors.decode())
        return finished.status << 8

    def popen(self):
        """A class for subprocess.Popen."""
        processes, world, clock = self, self._world, self._clock

        class Popen(object):
            """A program of the brick, running in virtual time."""

            def __init__(self, args, bufsize=-1, executable=None, **options):
                module = sys.modules["subprocess"]
                stdin, stdout, stderr = (
                    options.get(name) for name in ("stdin", "stdout", "stderr")
                )
                text = any(
                    options.get(name) for name in ("universal_newlines", "text", "encoding", "errors")
                )
                clock.step(START_COST)
                piped = getattr(stdin, "seconds", 0.0)
                finished = processes.execute(args, options.get("shell", False), piped)
                self.args = args
                processes._last_pid += 1
                self.pid = processes._last_pid
                self.returncode = None
                self._status = finished.status
                self._end = world.now() + finished.seconds
                self._waiting = WaitingLine(world)

                def stream(target, data, own):
                    if target == module.PIPE:
                        file = _Output(data)
                        file.seconds = getattr(data, "seconds", 0.0)
                        if not text:
                            return file
                        return io.StringIO(data.decode())
                    if target is None and data:
                        own.write(data.decode())
                    elif target not in (None, module.DEVNULL, module.STDOUT) and data:
                        os.write(target if isinstance(target, int) else target.fileno(), data)
                    return None

                output, errors = finished.output, finished.errors
                if stderr == module.STDOUT:
                    output, errors = output + errors, b""
                self.stdout = stream(stdout, output, sys.stdout)
                self.stderr = stream(stderr, errors, sys.stderr)
                self.stdin = None
                if stdin == module.PIPE:
                    self.stdin = io.StringIO() if text else io.BytesIO()

            def poll(self):
                """The exit status, or None while it runs."""
                clock.step()
                if self.returncode is None and world.now() >= self._end:
                    self.returncode = self._status
                return self.returncode

            def wait(self, timeout=None):
                """Wait for its end and return the exit status."""
                deadline = None if timeout is None else world.now() + timeout
                while self.poll() is None:
                    until = self._end if deadline is None else min(self._end, deadline)
                    self._waiting.wait(max(0.0, until - world.now()))
                    if deadline is not None and deadline <= world.now() < self._end:
                        raise sys.modules["subprocess"].TimeoutExpired(self.args, timeout)
                return self.returncode

            def communicate(self, input=None, timeout=None):
                """Wait for its end; (output, errors)."""
                self.wait(timeout)
                return tuple(file and file.read() for file in (self.stdout, self.stderr))

            def send_signal(self, sig):
                """Any signal ends it."""
                if self.poll() is None:
                    self._end = world.now()
                    self._status = -sig
                    while self._waiting.wake():
                        pass

            def terminate(self):
                """End it."""
                self.send_signal(real_signal.SIGTERM)

            def kill(self):
                """End it."""
                self.send_signal(real_signal.SIGKILL)

            def __enter__(self):
                return self

            def __exit__(self, *error):
                self.wait()

        return Popen
