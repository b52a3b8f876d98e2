"""`os` of a program on the brick: its files and screen, and a single process."""

import errno
import os
import re
from typing import Any, Callable, Dict, List, Optional

from laptop.emulator.host import linux
from laptop.emulator.host.brick_files import (
    ONE_PATH,
    TWO_PATHS,
    BrickFiles,
    Entries,
    MovedEntry,
)
from laptop.emulator.host.process_exit import ProcessExit
from laptop.system import platforms
from robot.ev3.brick_lock import BrickLock
from shared.state import LOCK

MYPY = False
if MYPY:
    from typing import NoReturn, Set, Union  # noqa: F401

    from laptop.emulator.device.screen import Screen
    from laptop.emulator.host.clocks import ProgramClock
    from laptop.emulator.host.processes import Processes
    from laptop.emulator.host.signals import ProgramSignals
    from laptop.emulator.host.world import World

MENU_CONSOLE = "/dev/tty1"
"""The console on which the brick's menu shows a program."""

_STARTING = ("fork", "exec", "spawn", "posix_spawn")
"""Prefixes of the functions that start or replace a process."""


class ProgramOs(object):
    """Substitutes for functions of `os`, as it is when this is made.

    Args:
        signals: ProgramSignals, which `kill` posts.
        processes: Processes, which `system` starts.
        files: BrickFiles, to which paths lead.
        screen: Screen, as a file.
        console: the script's terminal; None: that of this process.

    Attributes:
        screens: descriptors of the screen that are open.
    """

    def __init__(
        self,
        world: "World",
        clock: "ProgramClock",
        signals: "ProgramSignals",
        processes: "Processes",
        files: BrickFiles,
        screen: "Screen",
        console: Optional[str] = None,
    ) -> None:
        self._world = world
        self._clock = clock
        self._signals = signals
        self._processes = processes
        self._files = files
        self._screen = screen
        self._console = console
        self.screens = set()  # type: Set[int]
        self._on_the_brick = {
            name: files.wrapping(getattr(os, name), paths)
            for names, paths in ((ONE_PATH, 1), (TWO_PATHS, 2))
            for name in names
            if hasattr(os, name)
        }  # type: Dict[str, Callable[..., Any]]
        self._close, self._kill = os.close, os.kill
        self._ttyname = getattr(os, "ttyname", None)  # type: Optional[Callable[[int], str]]

    def functions(self) -> Dict[str, Callable[..., Any]]:
        """Return all of them, by name."""
        starting = [name for name in {*dir(os), "fork", "forkpty"} if name.startswith(_STARTING)]
        functions = {name: _refusing(name) for name in starting}  # type: Dict[str, Callable[..., Any]]
        functions.update(
            self._on_the_brick,
            _exit=self.leave,
            abort=self.abort,
            close=self.close,
            kill=self.kill,
            killpg=self.kill,
            listdir=self.listdir,
            open=self.open,
            register_at_fork=lambda **calls: None,
            scandir=self.scandir,
            system=self._processes.system,
            ttyname=self.ttyname,
        )
        return functions

    def leave(self, status: int) -> None:
        """End the program at once."""
        self._world.halt(ProcessExit(status & 0xFF, "ended"))
        self._world.touch(0.0)

    def abort(self) -> None:
        """End it as the signal would."""
        self.leave(128 + linux.Signals.SIGABRT)

    def kill(self, pid: int, sig: int) -> None:
        """Signal the program itself, or another one that may move the motors."""
        if pid not in (os.getpid(), 0):
            if LOCK in os.environ and pid == getattr(BrickLock("").holder(), "pid", None):
                self._kill(pid, sig)
                return
            raise ProcessLookupError("no process {} on the emulated brick".format(pid))
        if sig:
            self._signals.post(sig)
        self._clock.step()

    def listdir(self, path: Any = ".") -> List[Any]:
        """List a folder in natural order, so that runs repeat and port A comes first."""
        return sorted(self._on_the_brick["listdir"](path), key=_natural)

    def scandir(self, path: Any = ".") -> Entries:
        """Scan a folder in that order, too."""
        with self._on_the_brick["scandir"](path) as entries:
            found = sorted(entries, key=lambda entry: _natural(entry.name))
        if self._files.host_path(path) != path:
            found = [MovedEntry(entry, os.path.join(path, entry.name)) for entry in found]
        return Entries(found)

    def open(self, path: Any, flags: int, mode: int = 0o777, dir_fd: Optional[int] = None) -> int:
        """Open a file, also the brick's framebuffer, and folders as Linux does."""
        if path == "/dev/fb0":
            descriptor = self._screen.open()  # type: int
            self.screens.add(descriptor)
            return descriptor
        if not platforms.OPENS_FOLDERS and os.path.isdir(path):
            folder = platforms.open_folder(path)  # type: int
            return folder
        file = self._on_the_brick["open"](path, flags, mode, dir_fd=dir_fd)  # type: int
        return file

    def close(self, fd: int) -> None:
        """Close a descriptor, also of the framebuffer."""
        self.screens.discard(fd)
        self._close(fd)

    def ttyname(self, fd: int) -> str:
        """Return the terminal of a script that is started from the brick's menu, or over ssh."""
        if self._console is not None:
            return self._console
        if self._ttyname is None:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        return re.sub(r"^/dev/tty\d+$", "/dev/pts/0", self._ttyname(fd))

    def close_screens(self) -> None:
        """Close the descriptors of the screen that the program has left open."""
        for descriptor in self.screens:
            os.close(descriptor)
        self.screens.clear()


def _refusing(name: str) -> "Callable[..., NoReturn]":
    def refused(*args: object, **kwargs: object) -> "NoReturn":
        raise OSError("os.{} does not work on the emulated brick: use threads".format(name))

    return refused


def _natural(name: "Union[str, bytes]") -> "List[Union[str, int]]":
    """Return a sort key that has motor9 before motor10."""
    parts = re.split("([0-9]+)", os.fsdecode(name))
    return [int(part) if number % 2 else part for number, part in enumerate(parts)]
