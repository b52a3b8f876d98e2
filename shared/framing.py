"""Lines of bytes on their way: cut out of a stream, and waiting to go out.

Neither side lets the other fill its memory: both ends here are bounded.
"""

import collections

MYPY = False
if MYPY:
    import socket  # noqa: F401
    from typing import Callable, Deque, List, Optional  # noqa: F401

MAX_LINE = 2048
"""Bytes of a message, without its newline."""

TAG_LENGTH = 16
"""Bytes of the signature that follows a message on its line (shared.signing)."""

MAX_QUEUE = 16
"""Messages, other than observations, that wait to be sent or taken."""


class LineBuffer(object):
    """Cuts a stream of bytes into lines, and never holds more than one unfinished line.

    Attributes:
        overlong: lines that were longer than a message and its signature, left out.
    """

    def __init__(self):
        # type: () -> None
        self.overlong = 0
        self._rest = b""
        self._skipping = False

    @property
    def size(self):
        # type: () -> int
        """Bytes of the unfinished line."""
        return len(self._rest)

    def feed(self, data):
        # type: (bytes) -> List[bytes]
        """The lines that `data` completes, without their newlines: a list of bytes."""
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        if self._skipping and lines:
            del lines[0]  # the end of a line that was counted already
            self._skipping = False
        if self._skipping:
            self._rest = b""
        elif len(self._rest) > MAX_LINE + TAG_LENGTH:
            self.overlong += 1
            self._rest = b""
            self._skipping = True
        whole = [line for line in lines if len(line) <= MAX_LINE + TAG_LENGTH]
        self.overlong += len(lines) - len(whole)
        return whole


class SendQueue(object):
    """Lines that wait until the other side takes them: in order; of a camera only the newest.

    Args:
        sock: a non-blocking stream socket.
    """

    def __init__(self, sock):
        # type: (socket.socket) -> None
        self._sock = sock
        self._sign = bytes  # type: Callable[[bytes], bytes]  # as it is
        self._unsent = b""  # the rest of a line that has begun to go out
        self._queue = collections.deque()  # type: Deque[bytes]
        # camera: line
        self._newest = collections.OrderedDict()  # type: collections.OrderedDict[str, bytes]
        self._blocked_since = None  # type: Optional[float]

    @property
    def waits(self):
        # type: () -> bool
        """Whether something has not gone out yet."""
        return bool(self._unsent or self._queue or self._newest)

    @property
    def size(self):
        # type: () -> int
        """Bytes that wait."""
        lines = list(self._queue) + list(self._newest.values())
        return len(self._unsent) + sum([len(line) for line in lines])

    def sign_with(self, sign):
        # type: (Callable[[bytes], bytes]) -> None
        """Have all lines go through `sign` when they begin to go out, but for those that wait."""
        self._unsent += b"".join(self._queue)
        self._queue.clear()
        self._sign = sign

    def put(self, line):
        # type: (bytes) -> bool
        """Append a line; False if there are too many already."""
        if len(self._queue) >= MAX_QUEUE:
            return False
        self._queue.append(line)
        return True

    def put_newest(self, camera, line):
        # type: (str, bytes) -> bool
        """Put a camera's line in the place of its last one; whether that was still waiting."""
        replaced = camera in self._newest
        self._newest[camera] = line
        return replaced

    def write(self, now):
        # type: (Callable[[], float]) -> None
        """Send as much as the other side takes now.

        Args:
            now: gives the time, s.

        Raises:
            OSError: the connection is broken.
        """
        while self.waits:
            if not self._unsent:
                # Signed no sooner: what was replaced meanwhile must leave no gap in the count.
                self._unsent = self._sign(
                    self._queue.popleft() if self._queue else self._newest.popitem(last=False)[1]
                )
            try:
                sent = self._sock.send(self._unsent)
            except (BlockingIOError, InterruptedError):
                if self._blocked_since is None:
                    self._blocked_since = now()
                return
            self._unsent = self._unsent[sent:]
            self._blocked_since = None

    def blocked_for(self, t):
        # type: (float) -> float
        """Return how long, at the time `t` (s), the other side has been taking nothing, s."""
        return 0.0 if self._blocked_since is None else t - self._blocked_since

    def shift_to(self, t):
        # type: (float) -> None
        """Count from `t` (s) on: our clock has jumped."""
        self._blocked_since = None if self._blocked_since is None else t
