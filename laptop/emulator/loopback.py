"""Connections within this process that pass on all that is sent before virtual time goes on.

The system hands over what is sent on its loopback by the wall's clock: at once if it can, later if
it is busy. Then what a program finds on its socket at a time of the world's would hang on how busy
this computer is. So both ends of a connection count their bytes, and `Loopback.settle` waits until
those on the way have arrived.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time as wall
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

PATIENCE = 1.0
"""Longest wait for what is on its way, wall s; then the connection is as it is."""

POLL_PAUSE = 0.0002
"""Pause between two looks for it, wall s."""

ENOUGH = 16384
"""Number of bytes that need not be more to go on, bytes: of lines of a hundred, as many and half of
that again find room in a client's receive buffer; the rest may wait until it has read."""


@dataclass
class _LoopbackEnd:
    """One end of a connection, whose socket lives as long as others need it.

    Attributes:
        socket_of: returns its socket, None once nobody holds it.
        plain: class of the socket, by which it is read without a count.
        sent, read: number of bytes so far.
        arrived: number of bytes of the other end's of which is known that they have arrived.
        hung_up: whether it is known that the end of the other one has arrived.
    """

    socket_of: Callable[[], socket.socket | None]
    plain: Any
    sent: int = 0
    read: int = 0
    arrived: int = 0
    hung_up: bool = False

    @property
    def closed(self) -> bool:
        sock = self.socket_of()
        return sock is None or sock.fileno() < 0

    def holds(self, size: int) -> bool:
        """Return True if it holds so many bytes, or no more can come."""
        try:
            data = self.plain.recv(self.socket_of(), size, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return len(data) >= size or not data

    def await_all_of(self, other: _LoopbackEnd) -> None:
        """Wait until it has what the other end has sent, and that it has hung up."""
        sock = self.socket_of()
        if sock is None or self.closed:
            return
        if other.sent > self.arrived:
            size = min(other.sent - self.read, ENOUGH)
            limit = wall.monotonic() + PATIENCE
            while size and not self.holds(size) and wall.monotonic() < limit:
                wall.sleep(POLL_PAUSE)
            self.arrived = other.sent
        if other.closed and not self.hung_up:
            _await_end(sock)
            self.hung_up = True


@dataclass
class _LoopbackPair:
    """Ends of a connection, those that are known.

    Attributes:
        ends: by role, "client" or "server".
        awaited: whether the listener has been waited for.
    """

    ends: dict[str, _LoopbackEnd] = field(default_factory=dict)
    awaited: bool = False

    @property
    def closed(self) -> bool:
        return all(end.closed for end in self.ends.values())


class Loopback:
    """Connections of clients to one listener, all in this process."""

    def __init__(self) -> None:
        self._listener: socket.socket | None = None
        self._address: Any = ("", 0)
        self._connections: dict[Any, _LoopbackPair] = {}  # by the client's address

    def listen(self, listener: socket.socket) -> None:
        """Count on all that comes to a listener; it takes the place of an earlier one."""
        plain: Any = type(listener)

        def accept(listener: socket.socket) -> tuple[socket.socket, Any]:
            sock, address = plain.accept(listener)
            sock.setblocking(False)
            self._add(address, "server", sock)
            self.settle()  # its client may have sent before
            return sock, address

        _change(listener, accept=accept)
        self._listener, self._address = listener, listener.getsockname()

    def connect(self, socks: Sequence[Any]) -> None:
        """Await the connections of sockets, and count those to the listener as its clients.

        Args:
            socks: that wait to be written; others than those that connect are let be.
        """
        for sock in socks:
            if not hasattr(sock, "getpeername") or hasattr(type(sock), "counted"):
                continue
            with contextlib.suppress(OSError):
                address = sock.getsockname()
                if address[0] != self._address[0]:
                    continue  # it is about to leave this computer, and may take its time
                select.select([], [sock], [], PATIENCE)
                if sock.getpeername() == self._address:
                    self._add(address, "client", sock)

    def settle(self) -> None:
        """Wait until all that is on its way has arrived."""
        for address, connection in list(self._connections.items()):
            ends = list(connection.ends.values())
            if connection.closed:
                del self._connections[address]
            elif len(ends) == 2:
                ends[0].await_all_of(ends[1])
                ends[1].await_all_of(ends[0])
            elif "client" in connection.ends and not connection.awaited:
                connection.awaited = True
                if self._listener is not None and self._listener.fileno() >= 0:
                    select.select([self._listener], [], [], PATIENCE)

    def _add(self, address: Any, role: str, sock: socket.socket) -> None:
        connection = self._connections.get(address)
        if connection is None or role in connection.ends:  # the number of an earlier one
            connection = self._connections[address] = _LoopbackPair()
        connection.ends[role] = _counted(sock)


def _counted(sock: socket.socket) -> _LoopbackEnd:
    """Have a socket count its bytes from now on."""
    plain: Any = type(sock)
    end = _LoopbackEnd(weakref.ref(sock), plain)

    def send(sock: socket.socket, data: bytes, *flags: int) -> int:
        sent: int = plain.send(sock, data, *flags)
        end.sent += sent
        return sent

    def recv(sock: socket.socket, size: int, flags: int = 0) -> bytes:
        data: bytes = plain.recv(sock, size, flags)
        end.read += 0 if flags & socket.MSG_PEEK else len(data)
        return data

    _change(sock, send=send, recv=recv, counted=True)
    return end


def _await_end(sock: socket.socket) -> None:
    """Wait until a socket is told that the other side has hung up; data may lie before that."""
    if not hasattr(select, "poll"):
        select.select([sock], [], [], PATIENCE)
        return
    watched = select.poll()
    watched.register(sock, getattr(select, "POLLRDHUP", 0))  # elsewhere POLLHUP tells it
    watched.poll(1000 * PATIENCE)


def _change(sock: socket.socket, **names: object) -> None:
    """Give a socket other methods: an object has no place for its own."""
    plain: Any = type(sock)
    changed: Any = type(plain.__name__, (plain,), {**names, "__slots__": ()})
    sock.__class__ = changed
