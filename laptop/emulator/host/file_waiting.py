"""Waiting for files and sockets of the host, on the world's clock: `select` and `socket`."""

import select as real_select
from types import ModuleType
from typing import Any, Callable, List, Optional, Tuple

from laptop.emulator.device.sysfs import Poll
from laptop.emulator.host.clocks import copy_module
from laptop.emulator.host.linux import POLL

MYPY = False
if MYPY:
    from typing import Dict, TypeVar  # noqa: F401

    from laptop.emulator.host.linux import FileDescriptorLike
    from laptop.emulator.host.world import Address, Files, Ready, World

    Value = TypeVar("Value")

FD_POLL_PERIOD = 0.01
"""Period at which waiting threads poll files of the host, s."""

PERSON_POLL_PERIOD = 0.05
"""Period at which signals are polled during keyboard input, wall s."""


def select_module(world: "World") -> ModuleType:
    """Return a `select` module on the world's clock."""

    def select(
        rlist: "Files", wlist: "Files", xlist: "Files", timeout: Optional[float] = None
    ) -> "Ready":
        """select.select() that waits in virtual time."""
        if world.select is not None:
            return world.select(rlist, wlist, xlist, timeout)
        if timeout is None and 0 in [fd if isinstance(fd, int) else fd.fileno() for fd in rlist]:
            return _wait_for_person(world, rlist, wlist, xlist)
        return _watch_all(world, rlist, wlist, xlist, timeout)

    shim = copy_module(real_select, poll=lambda: WatchedFiles(world), select=select, **POLL)
    if hasattr(real_select, "epoll"):
        vars(shim)["epoll"] = lambda *args: WatchedEpoll(world)
    return shim


class WatchedFiles(object):
    """select.poll() on attributes of the brick and on files of the host."""

    def __init__(self, world: "World") -> None:
        self._world = world
        self._devices = []  # type: List[Any]
        self._files = real_select.poll() if hasattr(real_select, "poll") else _Selecting()

    def register(self, fd: Any, eventmask: int = POLL["POLLIN"] | POLL["POLLPRI"]) -> None:
        """Register a file; the events make no difference for a device."""
        device = _device_file(fd)
        if device is None:
            self._files.register(fd, eventmask)
        elif device not in self._devices:
            self._devices.append(device)

    def unregister(self, fd: Any) -> None:
        """Unregister a file.

        Raises:
            KeyError: it is not registered.
        """
        device = _device_file(fd)
        if device is None:
            self._files.unregister(fd)
        elif device in self._devices:
            self._devices.remove(device)
        else:
            raise KeyError(fd)

    def modify(self, fd: Any, eventmask: int) -> None:
        """Change the events of a file."""
        if _device_file(fd) is None:
            self._files.modify(fd, eventmask)

    def poll(self, timeout: Optional[float] = None) -> List[Tuple[Any, int]]:
        """Wait at most `timeout` ms; those that are ready, with their events."""
        if timeout is not None and timeout < 0:
            timeout = None
        if self._devices:
            devices = Poll(self._world)
            for device in self._devices:
                devices.register(device)
            return devices.poll(timeout)
        seconds = None if timeout is None else timeout / 1000.0
        return _watch(self._world, lambda: self._files.poll(0), seconds)


def _device_file(file: Any) -> Any:
    """Return a device's file beneath its buffers; None for a file of the host."""
    binary = getattr(file, "buffer", file)
    for one in (file, binary, getattr(binary, "raw", None)):
        if hasattr(one, "device"):
            return one
    return None


class WatchedEpoll(object):
    """select.epoll() that waits in virtual time."""

    def __init__(self, world: "World") -> None:
        self._world = world
        self._real = vars(real_select)["epoll"]()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)

    def poll(self, timeout: Optional[float] = None, maxevents: int = -1) -> List[Tuple[int, int]]:
        """Wait at most `timeout` s; descriptors that are ready, with their events."""
        seconds = None if timeout is None or timeout < 0 else timeout
        return _watch(self._world, lambda: self._looked(maxevents), seconds)

    def _looked(self, maxevents: int) -> List[Tuple[int, int]]:
        found = self._real.poll(0, maxevents)  # type: List[Tuple[int, int]]
        return found


class _Selecting(object):
    """select.poll() by select.select(), for systems that have only that; it never waits."""

    _KINDS = "POLLIN", "POLLOUT", "POLLPRI"  # in the order of select.select

    def __init__(self) -> None:
        self._events = {}  # type: Dict[int, int]

    def register(self, fd: "FileDescriptorLike", eventmask: int) -> None:
        self._events[fd if isinstance(fd, int) else fd.fileno()] = eventmask

    modify = register

    def unregister(self, fd: "FileDescriptorLike") -> None:
        del self._events[fd if isinstance(fd, int) else fd.fileno()]

    def poll(self, timeout: float) -> List[Tuple[int, int]]:
        """Return (descriptor, event) of all that are ready."""
        events = [POLL[kind] for kind in self._KINDS]
        asked = [[fd for fd, mask in self._events.items() if mask & event] for event in events]
        if not any(asked):  # Windows takes no three empty lists
            return []
        found = {}  # type: Dict[int, int]
        for event, ready in zip(events, real_select.select(asked[0], asked[1], asked[2], 0)):
            for fd in ready:
                found[fd] = found.get(fd, 0) | event
        return list(found.items())


def time_out_sockets(world: "World", module: ModuleType) -> None:
    """Let sockets with a timeout wait in virtual time; a connect ends a program's start.

    Args:
        world: World, whose clock they wait on.
        module: `socket`, which is changed.
    """

    def waiting(call: Callable[..., Any]) -> Callable[..., Any]:
        def waited(sock: Any, *args: Any, **kwargs: Any) -> Any:
            limit = sock.gettimeout()
            if limit and not _watch(world, lambda: real_select.select([sock], [], [], 0)[0], limit):
                raise module.timeout("timed out")
            return call(sock, *args, **kwargs)

        return waited

    def connecting(call: Callable[..., Any]) -> Callable[..., Any]:
        def connected(sock: Any, address: "Address") -> Any:
            world.begin()
            return call(sock, world.addresses.get(address, address))

        return connected

    names = ("_accept", "recv", "recvfrom", "recv_into", "recvfrom_into")
    calls = {name: waiting(getattr(module.socket, name)) for name in names}
    for name in ("connect", "connect_ex"):
        calls[name] = connecting(getattr(module.socket, name))
    vars(module)["socket"] = type("socket", (module.socket,), dict(calls, __slots__=()))


def _wait_for_person(world: "World", rlist: "Files", wlist: "Files", xlist: "Files") -> "Ready":
    """Return what `select` finds of these in the end; the emulated clock stops meanwhile."""
    while True:
        found = real_select.select(rlist, wlist, xlist, PERSON_POLL_PERIOD)
        if any(found):
            return found
        world.touch(0.0)  # signals are handled


def _watch_all(
    world: "World", rlist: "Files", wlist: "Files", xlist: "Files", timeout: Optional[float]
) -> "Ready":
    """Return what `select` finds of these until `timeout` s (None: never) have passed."""

    def poll() -> "List[Ready]":
        found = real_select.select(rlist, wlist, xlist, 0)
        return [found] if any(found) else []

    found = _watch(world, poll, timeout)
    return found[0] if found else ([], [], [])


def _watch(world: "World", poll: "Callable[[], Value]", timeout: Optional[float]) -> "Value":
    """Return what `poll()` finds, called until `timeout` s (None: never) have passed."""
    deadline = None if timeout is None else world.now() + timeout
    while True:
        found = poll()
        left = FD_POLL_PERIOD if deadline is None else deadline - world.now()
        if found or left <= 0:
            return found
        world.sleep(min(left, FD_POLL_PERIOD))
