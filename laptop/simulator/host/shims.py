"""Everything a program could measure or pass time with, put on an emulated world for one run.

For the length of a run the standard library's modules of time, threads, signals and processes are
replaced, and everything that had bound their names is imported afresh; afterwards all is as before.
So a script runs unmodified, and so does python-ev3dev2 under it.

Rule: nothing gets out of the emulation.  No process is started, forked or signalled, and no signal
handler of the host is changed.

Left as they are: sockets (a blocking call blocks the wall clock, and the valve lets other threads
run), standard input, and the random generator, but that starts from the same seed in every run.
"""

import atexit as real_atexit
import builtins
import contextlib
import fcntl as real_fcntl
import importlib
import importlib.machinery
import io
import os
import random
import re
import select as real_select
import signal as real_signal
import sys
import traceback
import types

from laptop.simulator.device.peripherals import EventFile
from laptop.simulator.device.sysfs import Poll
from laptop.simulator.host import counting
from laptop.simulator.host.clocks import UPTIME, Clock, copy_module, datetime_module, time_module
from laptop.simulator.host.counting import ENROL
from laptop.simulator.host.processes import Processes
from laptop.simulator.host.processor import library_charged
from laptop.simulator.host.signals import Signals
from laptop.simulator.host.threads import Threads, thread_module
from laptop.simulator.host.world import Verdict, WaitingLine

#: What a `print` costs, s, and how often files of the host are looked at by those that wait, s.
PRINT_COST = 0.5e-3
FD_POLL_PERIOD = 0.01

#: Where a program reads when it was started.
OWN_STAT = "/proc/self/stat"

#: Modules that bind the names replaced here, and so must be imported afresh.
REBOUND = (
    "queue", "sched", "timeit", "selectors", "asyncio", "concurrent", "socketserver", "logging",
    "subprocess", "multiprocessing", "http", "wsgiref", "xmlrpc", "socket", "ssl", "urllib",
)  # fmt: skip
#: The program's own side: never shared with the host.
PROGRAM = ("ev3dev2", "robot", "shared")
#: Imported before any script starts; a sibling of the same name is not seen by real Python either.
_AT_START = (
    "abc", "codecs", "encodings", "genericpath", "importlib", "io", "os", "posixpath", "site",
    "stat", "sys", "sysconfig", "types", "warnings", "zipimport", "laptop",
)  # fmt: skip


def top_of(name):
    """The package of a module, by its name."""
    return name.partition(".")[0]


class Shims(object):
    """All replacements for one run.

    Args:
        world: World.  peripherals: Peripherals.
    """

    def __init__(self, world, peripherals):
        self.world = world
        self.peripherals = peripherals
        self.clock = Clock(world)
        self._started = UPTIME + world.now()
        self.signals = Signals(world, self.clock)
        self.processes = Processes(world, self.clock, peripherals)
        self.exit_calls = []
        self._screens = set()
        self.threads = None
        self._own = ()

    @contextlib.contextmanager
    def installed(self, folder):
        """Replace the modules for a `with` block.

        Args:
            folder: where the script is; what it may import from there is imported afresh.
        """
        kept, charges = _Kept(), contextlib.ExitStack()
        importlib.machinery.SourceFileLoader.get_code = self._loader()
        try:
            random.seed(0)
            importlib.invalidate_caches()
            siblings = {os.path.splitext(name)[0] for name in os.listdir(folder)}
            siblings -= set(_AT_START) | set(sys.builtin_module_names)
            self._own = siblings | set(PROGRAM)
            if self.world.processor:
                setattr(builtins, ENROL, self.world.processor.enrol)
                charges.enter_context(library_charged(self._spend))
            for name in list(sys.modules):
                if top_of(name) in siblings or top_of(name) in PROGRAM or top_of(name) in REBOUND:
                    del sys.modules[name]
            # These two would wait in C, where no baton is passed; Python's own versions step in.
            sys.modules["_queue"] = sys.modules["_asyncio"] = None
            self._replace_os()
            sys.modules["time"] = time_module(self.clock)
            sys.modules["_thread"] = low = thread_module(self.world, self.clock)
            sys.modules.pop("threading", None)
            self.threads = Threads(
                self.world, self.clock, importlib.import_module("threading"), low
            )
            sys.modules["select"] = self._select_module()
            sys.modules["signal"] = sys.modules["_signal"] = self.signals.module()
            sys.modules["datetime"] = datetime_module(self.clock)
            sys.modules["atexit"] = self._atexit_module()
            sys.modules["fcntl"] = self._fcntl_module()
            sys.modules["evdev"] = self.peripherals.evdev_module(lambda: WaitingLine(self.world))
            sys.modules["evdev.ecodes"] = sys.modules["evdev"].ecodes
            importlib.import_module("subprocess").Popen = self.processes.popen()
            self._time_out_sockets(importlib.import_module("socket"))
            builtins.print = self._print
            builtins.open = self._open
            library = importlib.import_module("ev3dev2")
            library.get_current_platform = lambda: "ev3"
            if not _has_fonts(library):
                library.fonts = sys.modules["ev3dev2.fonts"] = _fonts_module()
            yield self
        finally:
            del importlib.machinery.SourceFileLoader.get_code  # it is inherited
            charges.close()
            kept.restore()
            for descriptor in self._screens:
                os.close(descriptor)
            self._screens.clear()
            self.peripherals.close_screen()

    def _loader(self):
        """How modules are read: those of the program with counts, where it is to be charged."""

        def get_code(loader, name):
            return code_of(
                loader, name, self.world.processor is not None and top_of(name) in self._own
            )

        return get_code

    def _spend(self, thousands):
        if self.world.current() is not None:
            self.world.processor.spend(thousands)

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

    def _select_module(self):
        shim = copy_module(real_select)
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
            if world.select is not None:
                return world.select(rlist, wlist, xlist, timeout)
            found = _watch(
                world,
                lambda: [f for f in [real_select.select(rlist, wlist, xlist, 0)] if any(f)],
                timeout,
            )
            return found[0] if found else ([], [], [])

        shim.poll = WatchedFiles
        shim.select = select
        if hasattr(real_select, "epoll"):
            shim.epoll = WatchedEpoll
        return shim

    def _time_out_sockets(self, module):
        """Let sockets with a timeout wait in virtual time; a program that calls has started."""
        world = self.world

        def waiting(call):
            def waited(sock, *args, **kwargs):
                limit = sock.gettimeout()
                if limit and not _watch(
                    world, lambda: real_select.select([sock], [], [], 0)[0], limit
                ):
                    raise module.timeout("timed out")
                return call(sock, *args, **kwargs)

            return waited

        def connecting(call):
            def connected(sock, *args, **kwargs):
                world.begin()
                return call(sock, *args, **kwargs)

            return connected

        names = ("_accept", "recv", "recvfrom", "recv_into", "recvfrom_into")
        calls = {name: waiting(getattr(module.socket, name)) for name in names}
        for name in ("connect", "connect_ex"):
            calls[name] = connecting(getattr(module.socket, name))
        module.socket = type("socket", (module.socket,), dict(calls, __slots__=()))

    def _atexit_module(self):
        shim = copy_module(real_atexit)

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
        shim = copy_module(real_fcntl)

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
            """os.listdir in natural order, so that runs repeat and port A comes first."""
            return sorted(real_listdir(path), key=_natural)

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
        vars(os)["register_at_fork"] = lambda **calls: None

    def _print(self, *args, **kwargs):
        self.clock.step(PRINT_COST)
        _REAL_PRINT(*args, **kwargs)

    def _open(self, file, mode="r", *args, **kwargs):
        if file == OWN_STAT:
            return io.StringIO(self._stat())
        device = self.peripherals.open(file) if isinstance(file, str) else None
        if device is None:
            return _REAL_OPEN(file, mode, *args, **kwargs)
        return device if isinstance(device, EventFile) else _AttributeFile(device, "b" in mode)

    def _stat(self):
        """What the brick's Linux tells of this program; of 52 figures, its number and its start."""
        figures = ["0"] * 49
        figures[18] = str(int(self._started * os.sysconf("SC_CLK_TCK")))
        return "{} (python3) R {}\n".format(os.getpid(), " ".join(figures))


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
        self._lists = [
            (value, list(value)) for value in self._sys.values() if isinstance(value, list)
        ]
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
            top_of(name)
            for name, module in list(sys.modules.items())
            if isinstance(
                getattr(getattr(module, "__spec__", None), "loader", None),
                importlib.machinery.ExtensionFileLoader,
            )
        } - {"PIL"}
        # A thread that never comes back from importing a module would hold that module's lock.
        locks = getattr(importlib._bootstrap, "_module_locks", {})
        for name in list(sys.modules):
            if name not in self._modules and top_of(name) not in compiled:
                module = sys.modules.pop(name)
                parent, _, child = name.rpartition(".")
                if module is not None and getattr(self._modules.get(parent), child, None) is module:
                    delattr(self._modules[parent], child)
                locks.pop(name, None)
        sys.modules.update(self._modules)


_CODES = {}  # type: dict


def code_of(loader, name, counts):
    """The code of a module, compiled once for all runs, as long as its file is the same."""
    path = loader.get_filename(name)
    key = path, counts, tuple(sorted(loader.path_stats(path).items()))
    if key not in _CODES:
        if counts:
            _CODES[key] = counting.compiled(loader.get_data(path), path)
        else:
            _CODES[key] = super(importlib.machinery.SourceFileLoader, loader).get_code(name)
    return _CODES[key]


def _natural(name):
    """A sort key that has motor9 before motor10."""
    parts = re.split("([0-9]+)", os.fsdecode(name))
    return [int(part) if number % 2 else part for number, part in enumerate(parts)]


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


def _has_fonts(library):
    folder = os.path.join(os.path.dirname(library.__file__), "fonts")
    return os.path.isdir(folder) and any(name.endswith(".pil") for name in os.listdir(folder))


def _fonts_module():
    """`ev3dev2.fonts` by the names on the brick, all in Pillow's default font.

    The library's bitmap fonts are on the brick, but not in what pip installs.
    """
    module = types.ModuleType("ev3dev2.fonts")
    families = (
        "charB charBI charI charR courB courBO courO courR helvB helvBO helvO helvR luBIS luBS "
        "luIS luRS lutBS lutRS ncenB ncenBI ncenI ncenR symb timB timBI timI timR"
    )
    sizes = (8, 10, 12, 14, 18, 19, 24)
    names = {"{}{:02d}".format(family, size) for family in families.split() for size in sizes}
    names |= {"tech14", "techB14", "term14", "termB14"}

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
