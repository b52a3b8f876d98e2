"""A connected socket: made non-blocking, waited for, closed with a reason."""

import contextlib
import socket

from shared.framing import SendQueue

MYPY = False
if MYPY:
    from typing import Callable, List  # noqa: F401

    Sockets = List[socket.socket]
    Wait = Callable[[Sockets, Sockets, Sockets, float], object]

READ_SIZE = 16384
"""Size of one read, bytes."""

MAX_READS = 4
"""Greatest number of reads in one poll: a flood must not keep the caller."""


class Connection(object):
    """A connected socket that blocks only on request, and its queue of unsent lines.

    Args:
        sock: a connected stream socket, which is closed at the end.
        select: waits for sockets, with the arguments of select.select.

    Attributes:
        reason: why it is closed; "" while it is open.
    """

    def __init__(self, sock, select):
        # type: (socket.socket, Wait) -> None
        self.reason = ""
        self._sock, self._select = sock, select
        self._is_open = True
        self._outgoing = SendQueue(sock)
        sock.setblocking(False)
        if sock.family in (socket.AF_INET, socket.AF_INET6):
            try:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            except OSError as error:  # it is closed already
                self._fail(error.strerror or str(error))

    @property
    def closed(self):
        # type: () -> bool
        """Whether it has ended; `reason` says why."""
        return bool(self.reason)

    @property
    def blocked(self):
        # type: () -> bool
        """Whether something waits until the other side takes more."""
        return self._outgoing.waits

    def fileno(self):
        # type: () -> int
        """Return the socket's descriptor, for `select`; -1 once it is closed."""
        return self._sock.fileno()

    def _wait(self, seconds):
        # type: (float) -> None
        self._select([self._sock], [self._sock] if self.blocked else [], [], seconds)

    def _fail(self, reason):
        # type: (str) -> None
        self.reason = self.reason or reason

    def abort(self):
        # type: () -> None
        """Close the socket without a Bye, as if the program were killed."""
        if not self._is_open:
            return
        self._is_open = False
        with contextlib.suppress(OSError):  # it is closed, or there is nothing to read
            # What lies unread would make TCP throw away what we have just sent.
            self._sock.shutdown(socket.SHUT_WR)
            for _ in range(MAX_READS):
                if not self._sock.recv(READ_SIZE):
                    break
        self._sock.close()
