"""Everything a program could measure or pass time with, put on an emulated world for one run.

For the length of a run the standard library's modules of time, threads, signals and processes are
replaced, and everything that had bound their names is imported afresh; afterwards all is as before.
So a script runs unmodified, and so does python-ev3dev2 under it.

Rule: nothing gets out of the emulation.  No process is started or forked, none is signalled but the
other program that may move the same emulated motors in real time, and no signal handler of the host
is changed.

In virtual time a program also finds one process, user, host and card, those of a brick:
what it does hangs on nothing of this computer.  In real time, where programs may meet each other,
numbers of processes and what `os` tells of the system are this computer's.

Left as they are: sockets (a blocking call blocks the wall clock, and the valve lets other threads
run), standard input, and where the script and the folder that it was started in are.
"""

import atexit as real_atexit
import builtins
import contextlib
import errno
import importlib
import importlib.machinery
import io
import locale
import os
import re
import sys
import traceback
import warnings

from laptop.emulator.device.buttons import EventFile, evdev_module
from laptop.emulator.host import linux, tracebacks
from laptop.emulator.host.brick_files import (
    ONE_PATH,
    TWO_PATHS,
    BrickFiles,
    Entries,
    MovedEntry,
)
from laptop.emulator.host.clocks import (
    UPTIME,
    ProgramClock,
    copy_module,
    datetime_module,
    time_module,
)
from laptop.emulator.host.counting import ENROL
from laptop.emulator.host.file_waiting import select_module, time_out_sockets
from laptop.emulator.host.fonts import fonts_module, has_fonts
from laptop.emulator.host.host_state import HostState
from laptop.emulator.host.process_exit import ProcessExit
from laptop.emulator.host.processes import Processes
from laptop.emulator.host.processor import library_charged
from laptop.emulator.host.program_code import PROGRAM, code_of, top_of
from laptop.emulator.host.signals import ProgramSignals
from laptop.emulator.host.sys_class import SysClass, wrapped
from laptop.emulator.host.threads import Threads, thread_module
from laptop.emulator.host.waiting_line import WaitingLine
from laptop.system import platforms
from robot.ev3.brick_lock import BrickLock
from shared.state import LOCK

PRINT_COST = 0.5e-3
"""Virtual time of a `print`, s."""

MENU_CONSOLE = "/dev/tty1"
"""The console on which the brick's menu shows a program."""

OWN_STAT, UPTIME_FILE = "/proc/self/stat", "/proc/uptime"
"""The files that tell a program when it was started, and how long ago the brick was."""

#: What a program finds as Python starts it, whatever another has set; not how texts are encoded.
_LOCALE = [
    name
    for name in ("LC_COLLATE", "LC_MESSAGES", "LC_MONETARY", "LC_NUMERIC", "LC_TIME")
    if hasattr(locale, name)
]
#: Modules that bind the names replaced here, and so must be imported afresh.
REBOUND = (
    "queue", "sched", "timeit", "selectors", "asyncio", "concurrent", "socketserver", "logging",
    "subprocess", "multiprocessing", "http", "wsgiref", "xmlrpc", "socket", "ssl", "urllib", "glob",
    "pathlib", "platform", "random", "secrets", "tempfile", "uuid",
)  # fmt: skip
#: Imported before any script starts; a sibling of the same name is not seen by real Python either.
_AT_START = (
    "abc", "codecs", "encodings", "genericpath", "importlib", "io", "os", "posixpath", "site",
    "stat", "sys", "sysconfig", "types", "warnings", "zipimport",
)  # fmt: skip


class Shims(object):
    """All replacements for one run.

    Args:
        world: World.  peripherals: Peripherals.
        folders: the brick's path of what is elsewhere on this computer -> its path here.

    Attributes:
        from_menu: whether the script was started from the brick's own menu, and so has its screen
            for a terminal, the console tty1.
    """

    def __init__(self, world, peripherals, folders=()):
        self.world = world
        self.peripherals = peripherals
        self._folders = dict(folders)
        self._files = None
        self.clock = ProgramClock(world)
        self._started = UPTIME + world.now()
        self.signals = ProgramSignals(world, self.clock)
        self.processes = Processes(world, self.clock, peripherals.programs)
        self.exit_calls = []
        self.devices = SysClass(peripherals.sysfs)
        self._screens = set()
        self.threads = None
        self.from_menu = False
        self._own = ()

    @contextlib.contextmanager
    def installed(self, folder, words=("python3",)):
        """Replace the modules for a `with` block.

        Args:
            folder: where the script is; what it may import from there is imported afresh.
            words: the program's command line.
        """
        kept, within = HostState(), contextlib.ExitStack()
        alone = LOCK not in os.environ  # else others may move the same motors
        system_files = linux.system_files(words, self._started) if alone else {}
        self._files = BrickFiles(self._folders, system_files)
        read_by = importlib.machinery.SourceFileLoader
        setattr(read_by, "get_code", self._loader())  # noqa: B010 (another's method, for mypy)
        try:
            within.enter_context(tracebacks.of_the_program())
            within.enter_context(warnings.catch_warnings())
            for category in _LOCALE:
                locale.setlocale(getattr(locale, category), "C")
            importlib.invalidate_caches()
            siblings = {os.path.splitext(name)[0] for name in os.listdir(folder)}
            siblings -= set(_AT_START) | set(sys.builtin_module_names)
            self._own = siblings | set(PROGRAM)
            if self.world.processor:
                setattr(builtins, ENROL, self.world.processor.enrol)
                within.enter_context(library_charged(self._spend))
            afresh = siblings | set(PROGRAM) | set(REBOUND)
            for name in list(sys.modules):
                # Of the emulator's own package the head alone: what is in it works here.
                if name in afresh or (top_of(name) in afresh and top_of(name) != "laptop"):
                    del sys.modules[name]
            # These two would wait in C, where no baton is passed; Python's own versions step in.
            sys.modules["_queue"] = sys.modules["_asyncio"] = None
            self._replace_os(alone)
            within.enter_context(self.devices.installed(self._open))
            sys.modules["time"] = time_module(self.clock)
            sys.modules["_thread"] = low = thread_module(self.world, self.clock)
            sys.modules.pop("threading", None)
            self.threads = Threads(
                self.world, self.clock, importlib.import_module("threading"), low
            )
            sys.modules["select"] = select_module(self.world)
            sys.modules["signal"] = sys.modules["_signal"] = self.signals.module()
            sys.modules["datetime"] = datetime_module(self.clock)
            sys.modules["atexit"] = self._atexit_module()
            sys.modules["fcntl"] = linux.fcntl_module(self._ioctl)
            sys.modules["evdev"] = self._evdev_module()
            sys.modules["evdev.ecodes"] = sys.modules["evdev"].ecodes
            importlib.import_module("subprocess").Popen = self.processes.popen()
            name_host(importlib.import_module("socket"))
            time_out_sockets(self.world, importlib.import_module("socket"))
            seed(importlib.import_module("random"))
            sys.modules["pwd"] = linux.users_module()
            sys.executable = linux.EXECUTABLE
            builtins.print = self._print
            builtins.open = self._open
            builtins.input = self._input
            library = importlib.import_module("ev3dev2")
            library.get_current_platform = lambda: "ev3"
            if not has_fonts(library):
                library.fonts = sys.modules["ev3dev2.fonts"] = fonts_module()
            yield self
        finally:
            del read_by.get_code  # it is inherited
            within.close()
            kept.restore()
            for descriptor in self._screens:
                os.close(descriptor)
            self._screens.clear()
            self._files.close()
            self.peripherals.screen.close()

    def _loader(self):
        """Return how modules are read: those of the program with counts, where it is charged."""

        def get_code(loader, name):
            return code_of(
                loader, name, self.world.processor is not None and top_of(name) in self._own
            )

        return get_code

    def _spend(self, thousands):
        if self.world.current() is not None:
            self.world.processor.spend(thousands)

    def finish(self):
        """Do what Python does at the end of the main module; called in its thread."""
        self.threads.join_all()
        self.call_at_exit()

    def call_at_exit(self):
        """Call what the program has registered with `atexit`."""
        while self.exit_calls:
            function, args, kwargs = self.exit_calls.pop()
            try:
                function(*args, **kwargs)
            except Exception:
                traceback.print_exc()

    # Modules

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

    def _evdev_module(self):
        peripherals = self.peripherals
        return evdev_module(peripherals.sysfs, peripherals.buttons, lambda: WaitingLine(self.world))

    def _ioctl(self, fd, request, arg):
        return self.peripherals.ioctl(fd, request, arg, self._screens)

    # Names in modules that stay

    def _replace_os(self, alone):
        processes, world, files = self.processes, self.world, self._files

        def refuse(name):
            def refused(*args, **kwargs):
                raise OSError("os.{} does not work on the emulated brick: use threads".format(name))

            return refused

        for name in set(dir(os)) | {"fork", "forkpty"}:
            if name.startswith(("fork", "exec", "spawn", "posix_spawn")):
                setattr(os, name, refuse(name))

        def leave(status):
            """End the program at once."""
            world.halt(ProcessExit(status & 0xFF, "ended"))
            world.touch(0.0)

        def kill(pid, sig):
            """Signal the program itself; nobody else is there but who may move the motors."""
            if pid not in (os.getpid(), 0):
                if LOCK in os.environ and pid == getattr(BrickLock("").holder(), "pid", None):
                    real_kill(pid, sig)
                    return
                raise ProcessLookupError("no process {} on the emulated brick".format(pid))
            if sig:
                self.signals.post(sig)
            self.clock.step()

        def listdir(path="."):
            """os.listdir in natural order, so that runs repeat and port A comes first."""
            return sorted(real_listdir(path), key=_natural)

        def scandir(path="."):
            """os.scandir in that order, too."""
            with real_scandir(path) as entries:
                found = sorted(entries, key=lambda entry: _natural(entry.name))
            if files.here(path) != path:
                found = [MovedEntry(entry, os.path.join(path, entry.name)) for entry in found]
            return Entries(found)

        def open_descriptor(path, flags, mode=0o777, dir_fd=None):
            """os.open that knows the brick's framebuffer, and opens folders as Linux does."""
            if path == "/dev/fb0":
                descriptor = self.peripherals.screen.open()
                self._screens.add(descriptor)
                return descriptor
            if not platforms.OPENS_FOLDERS and os.path.isdir(path):
                return platforms.open_folder(path)
            return real_open(path, flags, mode, dir_fd=dir_fd)

        def close(fd):
            """os.close that lets go of the framebuffer."""
            self._screens.discard(fd)
            real_close(fd)

        def ttyname(fd):
            """os.ttyname of a script that is started from the brick's menu, or over ssh."""
            if self.from_menu:
                return MENU_CONSOLE
            if real_ttyname is None:
                raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
            return re.sub(r"^/dev/tty\d+$", "/dev/pts/0", real_ttyname(fd))

        if alone:
            vars(os).update(linux.own_os(self.clock))
        for names, paths in ((ONE_PATH, 1), (TWO_PATHS, 2)):
            for name in [name for name in names if hasattr(os, name)]:
                setattr(os, name, files.taking(getattr(os, name), paths))
        real_listdir, real_scandir = os.listdir, os.scandir
        real_open, real_close, real_kill = os.open, os.close, os.kill
        real_ttyname = getattr(os, "ttyname", None)
        os.ttyname = ttyname
        os.listdir, os.scandir, os.open, os.close = listdir, scandir, open_descriptor, close
        os.system = processes.system
        os._exit = leave
        os.abort = lambda: leave(128 + linux.Signals.SIGABRT)
        os.kill = os.killpg = kill
        vars(os)["register_at_fork"] = lambda **calls: None
        for name, stand_in in linux.OS.items():
            vars(os).setdefault(name, stand_in)

    def _print(self, *args, **kwargs):
        self.clock.step(PRINT_COST)
        _REAL_PRINT(*args, **kwargs)

    def _input(self, *prompt):
        self.world.typing = sys.stdin.isatty()
        try:
            return _REAL_INPUT(*prompt)
        finally:
            self.world.typing = False

    def _open(self, file, mode="r", *args, **kwargs):
        if file == OWN_STAT:
            return _text_file(linux.stat_of(os.getpid(), self._started), mode)
        if file == UPTIME_FILE:
            return _text_file("{:.2f} 0.00\n".format(self.clock.monotonic()), mode)
        device = self.devices.open(file, mode, *args, **kwargs)
        if device is not None:
            return device
        attribute = self.peripherals.open(file) if isinstance(file, str) else None
        if attribute is None:
            if "b" not in mode and len(args) < 2 and kwargs.get("encoding") is None:
                kwargs["encoding"] = "utf-8"  # the brick's
            return self._files.taking(_REAL_OPEN, 1)(file, mode, *args, **kwargs)
        return attribute if isinstance(attribute, EventFile) else wrapped(attribute, mode, *args)


_REAL_PRINT, _REAL_OPEN, _REAL_INPUT = builtins.print, builtins.open, builtins.input


def _natural(name):
    """A sort key that has motor9 before motor10."""
    parts = re.split("([0-9]+)", os.fsdecode(name))
    return [int(part) if number % 2 else part for number, part in enumerate(parts)]


def _text_file(text, mode):
    return io.BytesIO(text.encode()) if "b" in mode else io.StringIO(text)


def seed(module):
    """Let all of a new `random` begin as it always does, also where a program asks for chance."""
    seed_by = module.Random.seed

    def seeded(self, a=None, version=2):
        seed_by(self, int.from_bytes(os.urandom(32), "big") if a is None else a, version)

    module.Random.seed = seeded
    module.seed = module._inst.seed
    module.seed(0)


def name_host(module):
    """Let a new `socket` know the brick by its name, and itself by that."""
    resolve = module.gethostbyname
    module.setdefaulttimeout(None)
    module.gethostname = lambda: linux.HOST
    module.getfqdn = lambda name="": name or linux.HOST
    module.gethostbyname = lambda name: resolve("localhost" if name == linux.HOST else name)
