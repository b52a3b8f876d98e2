"""Framing: lines cut out of a stream of bytes, and lines that wait to go out.

TCP carries bytes, not messages. Here a message is a line that ends in a newline, as in NDJSON:
JSON escapes line ends, so a newline never stands inside a message. A length before each message
would also do, but a damaged length loses all that follows; after a newline the reader is in step
again, and people can read the stream.

Both ends are bounded, so neither side can fill the other's memory. An overlong line is skipped up
to its newline and counted. Of the observations of one camera only the newest waits to be sent: in
visual servoing an old picture is worse than none.
"""

import collections

MYPY = False
if MYPY:
    import socket  # noqa: F401
    from typing import Callable, Deque, List, Optional  # noqa: F401

MAX_LINE = 2048
"""Greatest length of a message, bytes, without its newline."""

TAG_LENGTH = 16
"""Length of the signature, bytes, that follows a message on its line (shared.signing)."""

MAX_QUEUE = 16
"""Greatest number of messages, other than observations, that wait to be sent or received."""


class LineBuffer(object):
    """Reader that cuts a stream of bytes into lines, and holds at most one unfinished line.

    Attributes:
        overlong: number of lines left out, longer than a message and its signature.
    """

    def __init__(self):
        # type: () -> None
        self.overlong = 0
        self._rest = b""
        self._skipping = False

    @property
    def size(self):
        # type: () -> int
        """Length of the unfinished line, bytes."""
        return len(self._rest)

    def feed(self, data):
        # type: (bytes) -> List[bytes]
        """Return the lines that `data` completes: a list of bytes, without their newlines."""
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
        complete = [line for line in lines if len(line) <= MAX_LINE + TAG_LENGTH]
        self.overlong += len(lines) - len(complete)
        return complete


class SendQueue(object):
    """Queue of lines to send: in order, but of each camera only the newest observation.

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
        """Whether something is still unsent."""
        return bool(self._unsent or self._queue or self._newest)

    @property
    def size(self):
        # type: () -> int
        """Number of bytes that wait."""
        lines = list(self._queue) + list(self._newest.values())
        return len(self._unsent) + sum([len(line) for line in lines])

    def sign_with(self, sign):
        # type: (Callable[[bytes], bytes]) -> None
        """Sign every later line by `sign` (bytes -> bytes); those that wait go out as they are."""
        self._unsent += b"".join(self._queue)
        self._queue.clear()
        self._sign = sign

    def put(self, line):
        # type: (bytes) -> bool
        """Append a line; return False if there are too many already."""
        if len(self._queue) >= MAX_QUEUE:
            return False
        self._queue.append(line)
        return True

    def put_newest(self, camera, line):
        # type: (str, bytes) -> bool
        """Replace a camera's line by this one; return whether the last one was still waiting."""
        replaced = camera in self._newest
        self._newest[camera] = line
        return replaced

    def write(self, now):
        # type: (Callable[[], float]) -> None
        """Send as much as the other side takes now.

        Args:
            now: returns the time, s.

        Raises:
            OSError: the connection is broken.
        """
        while self.waits:
            if not self._unsent:
                # Signed as late as this: a line that was replaced must leave no gap in the count.
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
        """Count from `t` (s) on, after a jump of the own clock."""
        self._blocked_since = None if self._blocked_since is None else t
