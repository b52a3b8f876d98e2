"""Shims of the standard library: put a program on an emulated world for one run.

For the length of a run the standard library's modules of time, threads, signals and processes are
replaced, and modules that have bound their names are imported afresh; then all is restored.
So a script runs unmodified, and so does python-ev3dev2 under it.

Rule: nothing leaves the emulation.  No process is started or forked, none is signalled but the
other program that may move the same emulated motors in real time, and no signal handler of the host
is changed.

In virtual time a program also finds one process, user, host and card, those of a brick, so its
results do not depend on this computer.  In real time, where several programs run, process numbers
and what `os` returns on the system are this computer's.

Unchanged are: sockets (a blocking call blocks the wall clock, and the valve lets other threads
run), standard input, and where the script and the folder that it was started in are.
"""

import atexit as real_atexit
import builtins
import contextlib
import functools
import importlib
import importlib.machinery
import io
import locale
import os
import sys
import traceback
import warnings
from types import ModuleType
from typing import Any, Callable, Mapping, Optional, Sequence, Set

from laptop.emulator.device.buttons import EventFile, evdev_module
from laptop.emulator.host import linux, tracebacks
from laptop.emulator.host.brick_files import BrickFiles
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
from laptop.emulator.host.processes import Processes
from laptop.emulator.host.processor import library_charged
from laptop.emulator.host.program_code import PROGRAM, code_of, top_of
from laptop.emulator.host.program_os import MENU_CONSOLE, ProgramOs
from laptop.emulator.host.signals import ProgramSignals
from laptop.emulator.host.sys_class import SysClass, wrapped
from laptop.emulator.host.threads import Threads, thread_module
from laptop.emulator.host.wait_queue import WaitQueue
from shared.state import LOCK

MYPY = False
if MYPY:
    from types import CodeType
    from typing import Dict, Iterator, List, Tuple, Union  # noqa: F401

    from laptop.emulator.device.peripherals import Peripherals
    from laptop.emulator.host.world import World

    ExitCall = Tuple[Callable[..., object], Tuple[Any, ...], Dict[str, Any]]
    Read = Callable[[importlib.machinery.SourceFileLoader, str], Optional[CodeType]]

PRINT_COST = 0.5e-3
"""Virtual time of a `print`, s."""

OWN_STAT, UPTIME_FILE = "/proc/self/stat", "/proc/uptime"
"""Files with the start time of a program, and the uptime of the brick."""

#: Locale at the start of a program, whatever another has set, without the encoding.
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
        folders: path of a folder on the brick -> its path on this computer.

    Attributes:
        from_menu: whether the script was started from the brick's own menu, and so has its screen
            for a terminal, the console tty1.
    """

    def __init__(
        self,
        world: "World",
        peripherals: "Peripherals",
        folders: Optional[Mapping[str, str]] = None,
    ) -> None:
        self.world = world
        self.peripherals = peripherals
        self._folders = dict(folders or {})
        self._files = BrickFiles(self._folders, {})  # until it is installed
        self.clock = ProgramClock(world)
        self._started = UPTIME + world.now()
        self.signals = ProgramSignals(world, self.clock)
        self.processes = Processes(world, self.clock, peripherals.programs)
        self.exit_calls = []  # type: List[ExitCall]
        self.devices = SysClass(peripherals.sysfs)
        self._screens = set()  # type: Set[int]
        self.threads = None  # type: Optional[Threads]
        self.from_menu = False
        self._own = set()  # type: Set[str]

    @contextlib.contextmanager
    def installed(self, folder: str, argv: Sequence[str] = ("python3",)) -> "Iterator[Shims]":
        """Replace the modules for a `with` block.

        Args:
            folder: that of the script; modules in it are imported afresh.
            argv: the program's command line.
        """
        host_state, within = HostState(), contextlib.ExitStack()
        alone = LOCK not in os.environ  # else others may move the same motors
        system_files = linux.system_files(argv, self._started) if alone else {}
        self._files = BrickFiles(self._folders, system_files)
        read_by = importlib.machinery.SourceFileLoader
        setattr(read_by, "get_code", self._loader())  # noqa: B010 (another's method, for mypy)
        try:
            within.enter_context(tracebacks.program_tracebacks())
            within.enter_context(warnings.catch_warnings())
            for category in _LOCALE:
                locale.setlocale(getattr(locale, category), "C")
            importlib.invalidate_caches()
            self._own = siblings(folder) | set(PROGRAM)
            if self.world.processor:
                setattr(builtins, ENROL, self.world.processor.enrol)
                within.enter_context(library_charged(self._spend))
            forget(self._own | set(REBOUND))
            self._replace_os(alone)
            within.enter_context(self.devices.installed(self._open))
            self._make_modules()
            sys.executable = linux.EXECUTABLE
            vars(builtins).update(print=self._print, open=self._open, input=self._input)
            import_library()
            yield self
        finally:
            del read_by.get_code  # it is inherited
            within.close()
            host_state.restore()
            for descriptor in self._screens:
                os.close(descriptor)
            self._screens.clear()
            self._files.close()
            self.peripherals.screen.close()

    def _loader(self) -> "Read":
        """Return the loader of modules: those of the program are counted, where it is charged."""

        def get_code(
            loader: importlib.machinery.SourceFileLoader, name: str
        ) -> "Optional[CodeType]":
            return code_of(
                loader, name, self.world.processor is not None and top_of(name) in self._own
            )

        return get_code

    def _spend(self, thousands: float) -> None:
        if self.world.processor is not None and self.world.current() is not None:
            self.world.processor.spend(thousands)

    def begin(self) -> None:
        """Make the caller the program's main thread."""
        if self.threads is not None:
            self.threads.enter_main()

    def finish(self) -> None:
        """Run Python's exit procedure after the main module; called in its thread."""
        if self.threads is not None:
            self.threads.join_all()
        self.call_at_exit()

    def call_at_exit(self) -> None:
        """Call the functions registered with `atexit`."""
        while self.exit_calls:
            function, args, kwargs = self.exit_calls.pop()
            try:
                function(*args, **kwargs)
            except Exception:
                traceback.print_exc()

    # Modules

    def _make_modules(self) -> None:
        """Replace modules of the host by the program's own."""
        modules, clock = sys.modules, self.clock
        modules["time"] = time_module(clock)
        modules["_thread"] = low = thread_module(self.world, clock)
        modules.pop("threading", None)
        self.threads = Threads(self.world, clock, importlib.import_module("threading"), low)
        modules["select"] = select_module(self.world)
        modules["signal"] = modules["_signal"] = self.signals.module()
        modules["datetime"] = datetime_module(clock)
        modules["atexit"] = self._atexit_module()
        modules["fcntl"] = linux.fcntl_module(self._ioctl)
        modules["evdev"] = self._evdev_module()
        modules["evdev.ecodes"] = modules["evdev"].ecodes
        vars(importlib.import_module("subprocess"))["Popen"] = self.processes.popen()
        set_host_name(importlib.import_module("socket"))
        time_out_sockets(self.world, importlib.import_module("socket"))
        seed(importlib.import_module("random"))
        modules["pwd"] = linux.users_module()

    def _atexit_module(self) -> ModuleType:
        def register(
            func: Callable[..., object], *args: Any, **kwargs: Any
        ) -> Callable[..., object]:
            """Call `func` when the program has ended."""
            self.exit_calls.append((func, args, kwargs))
            return func

        def unregister(func: Callable[..., object]) -> None:
            """Unregister `func`."""
            self.exit_calls[:] = [call for call in self.exit_calls if call[0] != func]

        return copy_module(
            real_atexit,
            register=register,
            unregister=unregister,
            _clear=lambda: self.exit_calls.clear(),
        )

    def _evdev_module(self) -> ModuleType:
        peripherals, line = self.peripherals, functools.partial(WaitQueue, self.world)
        module = evdev_module(peripherals.sysfs, peripherals.buttons, line)  # type: ModuleType
        return module

    def _ioctl(self, fd: Any, request: int, arg: Any) -> bool:
        return self.peripherals.ioctl(fd, request, arg, self._screens)

    # Names in modules that stay

    def _replace_os(self, alone: bool) -> None:
        names = vars(os)
        if alone:
            names.update(linux.os_functions(self.clock))
        program_os = ProgramOs(
            self.world,
            self.clock,
            self.signals,
            self.processes,
            self._files,
            self.peripherals.screen,
            MENU_CONSOLE if self.from_menu else None,
        )
        self._screens = program_os.screens
        names.update(program_os.functions())
        for name, stand_in in linux.OS.items():
            names.setdefault(name, stand_in)

    def _print(self, *args: Any, **kwargs: Any) -> None:
        self.clock.step(PRINT_COST)
        _REAL_PRINT(*args, **kwargs)

    def _input(self, *prompt: object) -> str:
        self.world.typing = sys.stdin.isatty()
        try:
            return _REAL_INPUT(*prompt)
        finally:
            self.world.typing = False

    def _open(self, file: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
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
            return self._files.wrapping(_REAL_OPEN, 1)(file, mode, *args, **kwargs)
        return attribute if isinstance(attribute, EventFile) else wrapped(attribute, mode, *args)


_REAL_PRINT, _REAL_OPEN, _REAL_INPUT = builtins.print, builtins.open, builtins.input


def _text_file(text: str, mode: str) -> "Union[io.BytesIO, io.StringIO]":
    return io.BytesIO(text.encode()) if "b" in mode else io.StringIO(text)


def siblings(folder: str) -> Set[str]:
    """Return the names of the modules beside a script that it may import."""
    names = {os.path.splitext(name)[0] for name in os.listdir(folder)}
    return names - set(_AT_START) - set(sys.builtin_module_names)


def forget(afresh: Set[str]) -> None:
    """Have these modules and their submodules imported anew.

    Two would block in C, where no baton is passed: Python's own versions replace them.
    """
    modules = sys.modules  # type: Dict[str, Any]
    for name in list(modules):
        # Of the emulator's own package only the head: its modules work here.
        if name in afresh or (top_of(name) in afresh and top_of(name) != "laptop"):
            del modules[name]
    modules["_queue"] = modules["_asyncio"] = None


def import_library() -> None:
    """Import ev3dev2 as on an EV3, with the fonts that it has there."""
    library = importlib.import_module("ev3dev2")
    vars(library)["get_current_platform"] = lambda: "ev3"
    if not has_fonts(library):
        vars(library)["fonts"] = sys.modules["ev3dev2.fonts"] = fonts_module()


def seed(module: ModuleType) -> None:
    """Seed a new `random` alike in each run, also where a program asks for the system's entropy."""
    seed_by = module.Random.seed

    def seeded(self: Any, a: Any = None, version: int = 2) -> None:
        seed_by(self, int.from_bytes(os.urandom(32), "big") if a is None else a, version)

    module.Random.seed = seeded
    vars(module)["seed"] = module._inst.seed
    module.seed(0)


def set_host_name(module: ModuleType) -> None:
    """Have a new `socket` resolve the brick's name, as its own host name."""
    resolve = module.gethostbyname
    module.setdefaulttimeout(None)
    vars(module).update(
        gethostname=lambda: linux.HOST,
        getfqdn=lambda name="": name or linux.HOST,
        gethostbyname=lambda name: resolve("localhost" if name == linux.HOST else name),
    )
