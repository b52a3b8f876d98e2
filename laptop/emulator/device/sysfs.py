"""A replacement of /sys/class under the unmodified python-ev3dev2.

A temporary folder holds only the files that discovery reads.  Every attribute that the library
opens is a file-like object bound to an emulated device.  Each access costs virtual time, and is
counted.
"""

import contextlib
import importlib
import os
import shutil
import sys
import time as real_time
import types
from typing import Callable, Dict, Iterator, List, Optional, Tuple, Union

from laptop.emulator import temporary_folders

MYPY = False
if MYPY:
    from typing import Any, Protocol  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401

    class AttributeDevice(Protocol):
        """A device whose attributes are files, see `Sysfs.add`."""

        notifications = 0  # type: int

        def read(self, attribute: str) -> Union[str, bytes]:
            """Return an attribute's text, or bytes of what is no text."""

        def write(self, attribute: str, value: str) -> None:
            """Set an attribute."""

    Opener = Callable[[Any, str], Any]  # of a library's Device and an attribute's name: its file


_REAL_OPEN = open
"""The real `open`: a program's own leads to the devices themselves."""

POLLPRI = 2
"""Event of linux/poll.h for news of a device; not every host's `select` has it."""


def _key(device_path: str) -> Tuple[str, str]:
    """Return the class and name of a device, the last two parts of its path."""
    class_name, device_name = device_path.split(os.sep)[-2:]
    return class_name, device_name


class Attribute(object):
    """A stand-in for the open file of one attribute.

    Args:
        sysfs: Sysfs, on which accesses are counted.
        device: read and written.
        name: of the attribute.
    """

    def __init__(self, sysfs: "Sysfs", device: "AttributeDevice", name: str) -> None:
        self.sysfs = sysfs
        self.device = device
        self.name = name
        self.seen = None  # type: Optional[int]
        """Number of the device's notifications when this was last read."""

    def seek(self, offset: int) -> None:
        """Rewind, as before every access; costs nothing."""

    def flush(self) -> None:
        """Flush nothing, as nothing is buffered."""

    def read(self, size: int = -1) -> bytes:
        """Read, in one access, the attribute's text with a newline, or its bytes."""
        self.sysfs.touch()
        self.seen = getattr(self.device, "notifications", 0)
        data = self.device.read(self.name)
        if not isinstance(data, bytes):
            data = (data + "\n").encode()
        return data if size < 0 else data[:size]

    def write(self, value: bytes) -> int:
        """Write, in one access, the attribute's text, bytes, without one newline at its end."""
        self.sysfs.touch()
        text = value.decode()
        self.device.write(self.name, text[:-1] if text.endswith("\n") else text)
        return len(value)


class Poll(object):
    """A stand-in for `select.poll()`: attributes notified since their last read are ready.

    Args:
        world: whose clock it waits on.
    """

    TICK = 0.002
    """Period between two samples of the attributes, s."""

    def __init__(self, world: "DeviceWorld") -> None:
        self.world = world
        self._watched = []  # type: List[Attribute]

    def register(self, attribute: Attribute, events: int = 0) -> None:
        """Watch one attribute."""
        self._watched.append(attribute)

    def poll(self, timeout: Optional[float] = None) -> List[Tuple[Attribute, int]]:
        """Wait at most `timeout` ms; return the attributes that are ready, with POLLPRI."""
        deadline = None if timeout is None else self.world.now() + timeout / 1000.0
        while True:
            ready = [
                (attribute, POLLPRI)
                for attribute in self._watched
                if attribute.device.notifications != attribute.seen
            ]
            left = self.TICK if deadline is None else deadline - self.world.now()
            if ready or left <= 0:
                return ready
            self.world.sleep(min(left, self.TICK))


class Sysfs(object):
    """An emulated /sys/class.

    Args:
        world: whose clock the accesses take time on.
        access_cost: virtual seconds each access takes.
    """

    def __init__(self, world: "DeviceWorld", access_cost: float = 0.001) -> None:
        self.world = world
        self.access_cost = access_cost
        self.accesses = 0
        self._devices = {}  # type: Dict[Tuple[str, str], AttributeDevice]
        self._discovery = {}  # type: Dict[Tuple[str, str], Dict[str, str]]
        self._root = None  # type: Optional[str]

    def add(
        self,
        class_name: str,
        device_name: str,
        discovery: Dict[str, str],
        device: "AttributeDevice",
    ) -> None:
        """Make `device` found as /sys/class/`class_name`/`device_name`.

        Args:
            class_name: such as "tacho-motor".
            device_name: such as "motor9".
            discovery: file name -> text, for the library's search.
            device: has `read(attribute) -> str`, or bytes of what is no text, and
                `write(attribute, str)`, both raising OSError, and `notifications`, an int that
                rises whenever poll() should wake.
        """
        self._devices[(class_name, device_name)] = device
        self._discovery[(class_name, device_name)] = discovery
        if self._root:
            self._lay_out(self._root, class_name, device_name)

    def remove(self, class_name: str, device_name: str) -> None:
        """Take the device away from discovery; open attributes keep leading to it."""
        del self._discovery[(class_name, device_name)]
        if self._root:
            shutil.rmtree(os.path.join(self._root, class_name, device_name))

    def touch(self) -> None:
        """Count one access and let it take its time."""
        self.accesses += 1
        self.world.begin()
        self.world.touch(self.access_cost)

    def open(self, device_path: str, attribute: str) -> Attribute:
        """Return the file-like object of one attribute of the device at `device_path`."""
        return Attribute(self, self._devices[_key(device_path)], attribute)

    def _opener(self, other: "Opener") -> "Opener":
        """Return the library's opener of attributes: ours here, any other by the library itself."""

        def opened(device: "Any", name: str) -> "Any":
            ours = _key(device._path) in self._devices
            return self.open(device._path, name) if ours else other(device, name)

        return opened

    def has(self, device_path: str) -> bool:
        """Return True if there is a device at `device_path`, a class and a name."""
        return _key(device_path) in self._discovery

    def names(self, class_name: str) -> List[str]:
        """Return the names of the devices of a class, motor9 before motor10."""
        found = [name for of, name in self._discovery if of == class_name]
        return sorted(found, key=lambda name: (len(name), name))

    def plugged_in(self) -> List[str]:
        """Return the device at each port, such as `outA lego-ev3-l-motor`."""
        found = [
            "{} {}".format(text["address"].partition(":")[2], text["driver_name"])
            for (class_name, _), text in self._discovery.items()
            if class_name in ("tacho-motor", "lego-sensor")
        ]
        return sorted(found, key=lambda text: (text[:2] == "in", text))

    def is_inside(self, path: str) -> bool:
        """Return True for a file of a device's folder as the library names it to programs."""
        return self._root is not None and path.startswith(self._root + os.sep)

    def _lay_out(self, root: str, class_name: str, device_name: str) -> None:
        folder = os.path.join(root, class_name, device_name)
        os.makedirs(folder)
        for name, text in self._discovery[(class_name, device_name)].items():
            path = os.path.join(folder, name)
            with _REAL_OPEN(path, "w") as file:
                file.write(text + "\n")
            os.chmod(path, 0o664)

    @contextlib.contextmanager
    def installed(self) -> Iterator["Sysfs"]:
        """Put the library on this sysfs for the length of a `with` block.

        The library is the copy that a program would import now.
        """
        ev3dev2 = importlib.import_module("ev3dev2")
        importlib.import_module("ev3dev2.motor")
        device = ev3dev2.Device
        before = (device.DEVICE_ROOT_PATH, device._attribute_file_open)
        before_motor = (ev3dev2.motor.select, ev3dev2.motor.time)
        self._root = root = temporary_folders.make("sysfs")
        try:
            for class_name, device_name in self._discovery:
                self._lay_out(root, class_name, device_name)
            device.DEVICE_ROOT_PATH = root
            device._attribute_file_open = self._opener(device._attribute_file_open)
            if sys.modules["time"] is real_time:
                # Not for a script: its modules are whole, and `import *` hands them on.
                ev3dev2.motor.select = types.SimpleNamespace(
                    POLLPRI=POLLPRI, poll=lambda: Poll(self.world)
                )
                ev3dev2.motor.time = types.SimpleNamespace(
                    time=self.world.now, sleep=self.world.sleep
                )
            yield self
        finally:
            # The program has ended, or is killed: what it has locked is free.
            lock = sys.modules.get("robot.ev3.brick_lock")
            if lock:
                lock.release()
            device.DEVICE_ROOT_PATH, device._attribute_file_open = before
            ev3dev2.motor.select, ev3dev2.motor.time = before_motor
            temporary_folders.remove(root)
            self._root = None
