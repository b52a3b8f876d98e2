"""Virtual /sys/class, for scripts that read and write the brick's devices as files themselves.

There are no real folders or files: `os`, `os.path` and `open` get their results from the devices
that are plugged in.  All other paths go to the host.
"""

import contextlib
import errno
import io
import os
import posixpath
import stat
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Type

from laptop.emulator.host.brick_files import Entries
from laptop.emulator.host.clocks import EPOCH, Builtin

MYPY = False
if MYPY:
    from laptop.emulator.device.sysfs import Attribute, Sysfs

    Path = Any  # str, bytes, os.PathLike or a descriptor, as functions of `os` take it

ROOT = "/sys/class"

ATTRIBUTES = {
    "tacho-motor": "address command commands count_per_rot driver_name duty_cycle duty_cycle_sp "
    "hold_pid/Kd hold_pid/Ki hold_pid/Kp max_speed polarity position position_sp ramp_down_sp "
    "ramp_up_sp speed speed_pid/Kd speed_pid/Ki speed_pid/Kp speed_sp state stop_action "
    "stop_actions time_sp",
    "lego-sensor": "address bin_data bin_data_format command commands decimals direct driver_name "
    "fw_version mode modes num_values poll_ms text_value units value0 value1 value2 value3 value4 "
    "value5 value6 value7",
    "lego-port": "address driver_name mode modes set_device status",
    "leds": "brightness delay_off delay_on max_brightness trigger",
    "power_supply": "current_now scope technology type voltage_max_design voltage_min_design "
    "voltage_now",
    "dc-motor": "",
    "servo-motor": "",
}
"""Names of the files in the folder of each device, by class; two classes are empty."""

WRITTEN = ("brightness", "delay_off", "delay_on", "direct", "duty_cycle_sp", "mode", "polarity",
           "poll_ms", "position", "position_sp", "ramp_down_sp", "ramp_up_sp", "speed_sp",
           "stop_action", "time_sp", "trigger")  # fmt: skip
"""Readable and writable files, beside those of the regulators."""

ONLY_WRITTEN = "command", "set_device"
"""Write-only files."""


def _parts(path: "Path") -> Optional[List[str]]:
    """Split a path within ROOT into a list of names; None for any other path."""
    if path is None or isinstance(path, int):
        return None
    path = path.__fspath__() if hasattr(path, "__fspath__") else path
    text = posixpath.normpath(os.fsdecode(path).replace(os.sep, "/"))
    if text != ROOT and not text.startswith(ROOT + "/"):
        return None
    return text[len(ROOT) + 1 :].split("/") if text != ROOT else []


def _mode(parts: Sequence[str]) -> int:
    """Return the permissions of a file for the brick's users."""
    if parts[-1] in ONLY_WRITTEN:
        return 0o220
    return 0o664 if parts[-1] in WRITTEN or "_pid" in parts[-2] else 0o444


class DeviceFile(io.RawIOBase):
    """The open file of one attribute; each read from its beginning samples the device.

    Args:
        attribute: sysfs.Attribute.
        mode: as of `open`.
    """

    def __init__(self, attribute: "Attribute", mode: str) -> None:
        super(DeviceFile, self).__init__()
        self.mode = mode
        self.name = attribute.name
        self._attribute = attribute
        self._data, self._at = b"", 0

    device = property(lambda self: self._attribute.device, doc="What `select.poll` watches.")
    seen = property(lambda self: self._attribute.seen, doc="See sysfs.Attribute.")

    def readable(self) -> bool:
        """Return whether it was opened for reading."""
        return "r" in self.mode or "+" in self.mode

    def writable(self) -> bool:
        """Return whether it was opened for writing."""
        return "r" not in self.mode or "+" in self.mode

    def seekable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read the next bytes into `buffer`; return their number."""
        if not self.readable():
            raise io.UnsupportedOperation("not readable")
        if self._at == 0:
            self._data = self._attribute.read()
        piece = self._data[self._at : self._at + len(buffer)]
        buffer[: len(piece)] = piece
        self._at += len(piece)
        return len(piece)

    def write(self, data: Any) -> int:
        """Write the text by one access; do nothing once the program is over."""
        if not self.writable():
            raise io.UnsupportedOperation("not writable")
        if self._attribute.sysfs.world.exit is None:
            self._attribute.write(bytes(data))
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Set the position, and return it."""
        if whence == 2:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self._at = offset + (self._at if whence else 0)
        return self._at

    def truncate(self, size: Optional[int] = None) -> int:
        """Do nothing: no contents are stored."""
        return self._at


def wrapped(
    attribute: "Attribute",
    mode: str,
    buffering: int = -1,
    encoding: Optional[str] = None,
    errors: Optional[str] = None,
    newline: Optional[str] = None,
    closefd: bool = True,
    opener: object = None,
) -> io.IOBase:
    """Open a sysfs.Attribute by the arguments of `open`."""
    raw = DeviceFile(attribute, mode)
    if buffering == 0:
        return raw
    kinds = {(True, True): io.BufferedRandom, (True, False): io.BufferedReader}
    file = kinds.get((raw.readable(), raw.writable()), io.BufferedWriter)(raw)
    return file if "b" in mode else io.TextIOWrapper(file, encoding or "utf-8", errors, newline)


class _Entry(object):
    """os.DirEntry of an entry in ROOT; folder and name are both texts, or both bytes."""

    def __init__(self, folder: Any, name: Any, parts: List[str], tree: "SysClass") -> None:
        self.name = name
        self.path = os.path.join(folder, name)
        self._parts = parts
        self._tree = tree

    def __fspath__(self) -> Any:
        return self.path

    def is_dir(self, follow_symlinks: bool = True) -> bool:
        """Return whether it is a folder."""
        return self._tree.names(self._parts) is not None

    def is_file(self, follow_symlinks: bool = True) -> bool:
        """Return whether it is a file."""
        return not self.is_dir()

    def is_symlink(self) -> bool:
        """Return False: there are no links here."""
        return False

    def is_junction(self) -> bool:
        """Return False: Linux has no junctions."""
        return False

    def stat(self, follow_symlinks: bool = True) -> os.stat_result:
        """Return its status as os.stat does."""
        return self._tree.stat(self._parts, self.path)

    def inode(self) -> int:
        """Return a number of its own."""
        return self.stat().st_ino


class SysClass(object):
    """Tree of files.

    Args:
        sysfs: Sysfs.
    """

    def __init__(self, sysfs: "Sysfs") -> None:
        self._sysfs = sysfs

    def names(self, parts: List[str]) -> Optional[List[str]]:
        """Return the names in a folder; None for any other path."""
        if not parts:
            return sorted(ATTRIBUTES)
        if parts[0] not in ATTRIBUTES:
            return None
        if len(parts) == 1:
            return self._sysfs.names(parts[0])
        if parts[1] not in self._sysfs.names(parts[0]):
            return None
        inside = "/".join(parts[2:] + [""])
        found = [
            name[len(inside) :].partition("/")[0]
            for name in ATTRIBUTES[parts[0]].split()
            if name.startswith(inside)
        ]
        return sorted(set(found)) or None

    def stat(self, parts: List[str], path: "Path") -> os.stat_result:
        """Return the result of os.stat.

        Raises:
            FileNotFoundError: there is no such path.
        """
        if self.names(parts) is not None:
            mode = stat.S_IFDIR | 0o755
        elif parts[:-1] and parts[-1] in (self.names(parts[:-1]) or ()):
            mode = stat.S_IFREG | _mode(parts)
        else:
            raise _missing(path)
        number = sum(ord(letter) * (k + 1) for k, letter in enumerate("/".join(parts)))
        return os.stat_result((mode, number + 2, 0, 1, 0, 0, 4096, EPOCH, EPOCH, EPOCH))

    def open(self, file: "Path", mode: str = "r", *args: Any, **kwargs: Any) -> Optional[io.IOBase]:
        """Open a device's file; return None for any other file.

        Raises:
            OSError: there is none, it is a folder, or access is denied.
        """
        parts = _parts(file)
        if parts is None:
            return None
        found = self.stat(parts, file)
        if stat.S_ISDIR(found.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), file)
        reads, writes = "r" in mode or "+" in mode, "r" not in mode or "+" in mode
        if (reads and not found.st_mode & 0o440) or (writes and not found.st_mode & 0o220):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), file)
        attribute = self._sysfs.open(os.path.join(*parts[:2]), "/".join(parts[2:]))
        return wrapped(attribute, mode, *args, **kwargs)

    @contextlib.contextmanager
    def installed(self, opener: Callable[..., Any]) -> Iterator[None]:
        """Install the tree in `os`, `os.path` and `io`, for a `with` block.

        Args:
            opener: becomes io.open.
        """
        functions = _TreeFunctions(self)
        replaced = (
            (vars(os), functions.os_functions()),
            (vars(os.path), functions.path_functions()),
            (vars(io), {"open": opener, "FileIO": _file_io(self)}),
        )
        before = [{name: names[name] for name in ours} for names, ours in replaced]
        for names, ours in replaced:
            names.update(ours)
        try:
            yield
        finally:
            for (names, _), own in zip(replaced, before):
                names.update(own)

    def listed(self, parts: List[str], path: "Path") -> List[str]:
        """Return the names in the folder `parts`.

        Raises:
            OSError: there is no such folder.
        """
        names = self.names(parts)
        if names is None:
            self.stat(parts, path)
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), path)
        return names


class _TreeFunctions(object):
    """Functions of `os` and `os.path` on the tree; all other files are the host's.

    Args:
        tree: SysClass.
    """

    def __init__(self, tree: SysClass) -> None:
        self._tree = tree
        self._listdir, self._scandir = os.listdir, os.scandir
        self._stat, self._lstat, self._access = os.stat, os.lstat, os.access
        self._exists, self._lexists = os.path.exists, os.path.lexists
        self._isdir, self._isfile = os.path.isdir, os.path.isfile

    def os_functions(self) -> Dict[str, Builtin]:
        """Return them, by their names in `os`."""
        functions = (self.listdir, self.scandir, self.stat, self.lstat, self.access)
        return {function.__name__: Builtin(function) for function in functions}

    def path_functions(self) -> Dict[str, Callable[["Path"], bool]]:
        """Return them, by their names in `os.path`."""
        return {
            "exists": self.exists,
            "lexists": self.lexists,
            "isdir": self.isdir,
            "isfile": self.isfile,
        }

    def listdir(self, path: "Path" = ".") -> List[Any]:
        """List a folder as os.listdir does."""
        parts = _parts(path)
        return self._listdir(path) if parts is None else self._names(parts, path)

    def scandir(self, path: "Path" = ".") -> Any:
        """Scan a folder as os.scandir does."""
        parts = _parts(path)
        if parts is None:
            return self._scandir(path)
        folder = path.__fspath__() if hasattr(path, "__fspath__") else path
        return Entries(
            _Entry(folder, name, parts + [os.fsdecode(name)], self._tree)
            for name in self._names(parts, folder)
        )

    def _names(self, parts: List[str], path: "Path") -> List[Any]:
        """Return the names in a folder, in bytes if its path is."""
        names = self._tree.listed(parts, path)
        return [os.fsencode(name) for name in names] if isinstance(path, bytes) else names

    def stat(self, path: "Path", **options: Any) -> os.stat_result:
        """As that of os."""
        parts = _parts(path)
        return self._stat(path, **options) if parts is None else self._tree.stat(parts, path)

    def lstat(self, path: "Path", **options: Any) -> os.stat_result:
        """As that of os."""
        parts = _parts(path)
        return self._lstat(path, **options) if parts is None else self._tree.stat(parts, path)

    def access(self, path: "Path", mode: int, **options: Any) -> bool:
        """os.access."""
        parts = _parts(path)
        if parts is None:
            return self._access(path, mode, **options)
        try:
            rights = self._tree.stat(parts, path).st_mode
        except OSError:
            return False
        return not mode & ~(rights >> 3 | rights) & 7

    def exists(self, path: "Path") -> bool:
        """os.path.exists."""
        parts = _parts(path) if path else None
        return self._exists(path) if parts is None else self._is_there(parts)

    def lexists(self, path: "Path") -> bool:
        """os.path.lexists."""
        parts = _parts(path) if path else None
        return self._lexists(path) if parts is None else self._is_there(parts)

    def isdir(self, path: "Path") -> bool:
        """os.path.isdir."""
        parts = _parts(path) if path else None
        return self._isdir(path) if parts is None else self._tree.names(parts) is not None

    def isfile(self, path: "Path") -> bool:
        """os.path.isfile."""
        parts = _parts(path) if path else None
        if parts is None:
            return self._isfile(path)
        return self._is_there(parts) and self._tree.names(parts) is None

    def _is_there(self, parts: List[str]) -> bool:
        try:
            self._tree.stat(parts, "")
        except OSError:
            return False
        return True


def _file_io(tree: SysClass) -> Type[io.FileIO]:
    """Return an io.FileIO that sees the tree."""

    class FileIO(io.FileIO):
        """io.FileIO."""

        def __new__(cls, file: "Path", mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            return tree.open(file, mode.replace("b", ""), 0) or super().__new__(cls)

    return FileIO


def _missing(path: "Path") -> FileNotFoundError:
    return FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)
