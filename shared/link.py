"""A connected socket that sends messages and hands over the newest.

One thread, no sleep: `poll` and `send` do all that is due. Only `poll` waits, up to its timeout.
An unsent observation waits in one slot per camera, where the newest wins.
"""

import collections
import select

from shared.connection import MAX_READS, READ_SIZE, Connection
from shared.framing import MAX_LINE, MAX_QUEUE, LineBuffer
from shared.message_fields import compile_patterns
from shared.messages import (
    BadMessage,
    Bye,
    Challenge,
    Hello,
    Observation,
    Ping,
    Pong,
    Proof,
    Refused,
    Welcome,
    decode,
    encode,
)
from shared.newest_observations import NewestObservations, by_camera
from shared.peer_clock import Pings
from shared.signing import LineSigner

MYPY = False
if MYPY:
    import socket  # noqa: F401
    from typing import Callable, Deque, Dict, List, Optional, Sequence  # noqa: F401

    from shared.connection import Wait  # noqa: F401
    from shared.messages import Message  # noqa: F401
    from shared.newest_observations import Line  # noqa: F401
    from shared.peer_clock import PeerClock  # noqa: F401


SILENCE_TIMEOUT = 2.0
"""Longest silence of the other side, or time in which it reads nothing, until the link ends, s."""

MAX_AGE = 1.0
"""Greatest age of an observation that is handed over, s."""

MAX_BAD_LINES = 20
"""Number of bad lines in a row, though signed, that ends the connection."""

FOREIGN = "it does not speak our language"
"""Reason of a link that ended because its first lines were no handshake."""

FORGED = "a message was changed or repeated on the way"
"""Reason of a link that ended at a line that the other side did not sign as the next one."""

MAX_TRIES = 4
"""Greatest number of a camera's observations that are parsed, newest first, until one is good, if
several came at once; the others are skipped."""

UNDATED_PATIENCE = 10
"""Factor of `patience` while no observation can be dated without the answer."""

MAX_PING_WAITS = 4
"""Greatest number of waits for one answer, which other messages may interrupt."""

COUNTERS = (
    "bad", "skipped", "out_of_sequence", "stale", "future", "undated", "replaced", "dropped",
)  # fmt: skip
"""Names of a link's counters."""

_HANDSHAKE = (Hello, Challenge, Proof, Welcome, Refused)


class Link(Connection):
    """One connection; it ends by itself when the other side is silent or sends bad lines.

    Before authentication only the handshake passes, message by message, and one
    bad line ends it. `activate` opens it; from then on every line is signed, and the first one that
    was changed, repeated, left out or put in on the way ends it.

    Args:
        sock: a connected stream socket; the link closes it.
        now: gives the time, s.
        keys: as for `activate`, if the other side is authenticated already.
        patience: time that `poll` waits for the answer to its ping, whatever its timeout, s (and
            UNDATED_PATIENCE times that where nothing can be dated yet): a pong that lay unread
            does not show when it arrived.
        max_age: older observations are not handed over, s.
        select: waits for sockets, as select.select does.

    Attributes:
        reason: why it is closed; "" while it is open.
        proven: whether the other side is authenticated.
        counters: by name (COUNTERS): lines that were `bad`; observations that were `skipped`, not
            even parsed (a newer one came with them), `out_of_sequence`, `stale`, from the `future`,
            or `undated` (the clock offset was not known); observations of ours that were `replaced`
            by newer ones before they could go out; messages that nobody took, and were `dropped`.
    """

    def __init__(
        self,
        sock,  # type: socket.socket
        now,  # type: Callable[[], float]
        keys=None,  # type: Optional[Sequence[bytes]]
        patience=0.0,  # type: float
        max_age=MAX_AGE,  # type: float
        select=select.select,  # type: Wait
    ):
        # type: (...) -> None
        super(Link, self).__init__(sock, select)
        self.counters = dict.fromkeys(COUNTERS, 0)
        self._now = now
        self.proven = False
        # of what comes in, once it is proven
        self._theirs = None  # type: Optional[LineSigner]
        self._patience, self._max_age = patience, max_age

        self._buffer = LineBuffer()
        # not looked at yet; (line, time it came in)
        self._lines = collections.deque()  # type: Deque[Line]
        self._inbox = collections.deque(maxlen=MAX_QUEUE)  # type: Deque[Message]
        self._bad_in_a_row = 0

        self._polled = self._last_line_at = now()
        self._pings = Pings(self._polled)
        self._newest = NewestObservations(self._pings, self.counters)
        if keys is not None:
            self.activate(*keys)

    @property
    def clock(self):
        # type: () -> PeerClock
        """PeerClock of the other side."""
        return self._pings.clock

    @property
    def late(self):
        # type: () -> Dict[str, float]
        """{camera: age, s} of the cameras whose last observation was too old to be handed over."""
        return self._newest.late

    @property
    def buffer_sizes(self):
        # type: () -> Dict[str, int]
        """Amounts in memory, by name; all are bounded, whatever the other side sends."""
        return {
            "unfinished bytes": self._buffer.size, "lines": len(self._lines),
            "line bytes": sum([len(line) for line, _ in self._lines]),
            "messages": len(self._inbox), "cameras": len(self._newest), "pings": len(self._pings),
            "unsent bytes": self._outgoing.size,
        }  # fmt: skip

    def activate(self, own_key, their_key):
        # type: (bytes, bytes) -> None
        """Open the link after the handshake: from here on all messages pass, and pings go out.

        Args:
            own_key: 32 bytes; it signs the lines sent.
            their_key: 32 bytes; it checks the lines received.
        """
        compile_patterns()
        self._outgoing.sign_with(LineSigner(own_key).sign)
        self._theirs = LineSigner(their_key)
        self.proven = True
        self._last_line_at = self._pings.next_at = self._now()

    # Sending

    def send(self, message):
        # type: (Message) -> None
        """Send a message, at once or as soon as the other side takes it; never waits.

        A newer observation replaces an unsent one of its camera.

        Raises:
            BadMessage: it has a value that the other side would not accept.
        """
        line = encode(message)
        if self.closed:
            return
        if type(message) is Observation:
            self.counters["replaced"] += self._outgoing.put_newest(message.camera, line)
        elif not self._outgoing.put(line):
            self._fail("the other side takes no data")
        self._write()

    def _write(self):
        # type: () -> None
        if not self.closed:
            try:
                self._outgoing.write(self._now)
            except OSError as error:
                self._read()  # it may have sent a reason
                self._fail(error.strerror or str(error))

    # Receiving

    def poll(self, timeout=0.0):
        # type: (float) -> None
        """Read and send what there is, answer and send pings, notice silence.

        Args:
            timeout: s to wait, at most, until something comes in.
        """
        if self._is_open and not self.closed:
            self._check_own_clock()
            if timeout > 0 and not self._lines:
                if self.proven and not self.blocked:
                    timeout = min(timeout, max(0.0, self._pings.next_at - self._now()))
                self._wait(timeout)
            self._read()
            self._write()
            if self.proven and not self.closed:
                self._ping()
            self._notice_silence()
        if self.closed:
            self.abort()

    def receive(self):
        # type: () -> Optional[Message]
        """Return the next message other than pings and observations, or None."""
        if not self._inbox:
            self._digest()
        return self._inbox.popleft() if self._inbox else None

    def newest(self):
        # type: () -> Dict[str, Observation]
        """Return {camera: its newest Observation}, each only once; their t is on the own clock."""
        return self._newest.pop_fresh(self._now(), self._max_age)

    def _read(self):
        # type: () -> None
        if self._lines:
            return  # before authentication one message at a time
        for _ in range(MAX_READS if self.proven else 1):
            try:
                data = self._sock.recv(READ_SIZE if self.proven else MAX_LINE)
            except (BlockingIOError, InterruptedError):
                break
            except OSError as error:
                self._fail(error.strerror or str(error))
                break
            if not data:
                self._digest()
                self._fail("the other side closed the connection")
                break
            t = self._now()
            overlong = self._buffer.overlong
            self._lines.extend((line, t) for line in self._buffer.feed(data))
            if self._buffer.overlong > overlong:
                self._digest()
                self._refuse_line()
        self._digest()

    def _digest(self):
        # type: () -> None
        """Handle the lines that came in; before authentication one message at a time."""
        if self._theirs is None:
            while self._lines and not self._inbox and not self.closed:
                self._handle(*self._lines.popleft())
            return
        lines = self._theirs.checked(self._lines)
        if len(lines) == 1:  # nothing newer has come with it
            self._handle(*lines[0])
        elif lines:
            self._handle_newest(lines)
        if self._lines:  # the signature of the next one is wrong; those before it were right
            self._lines.clear()
            self._refuse_line()

    def _handle_newest(self, lines):
        # type: (List[Line]) -> None
        """Handle lines that came together; of a camera's observations only the newest good one."""
        others, cameras = by_camera(lines)
        for entry in others:
            self._handle(*entry)
        for entries in cameras:
            refused = 0
            while entries and refused < MAX_TRIES:
                accepted = self._handle(*entries.pop())
                if accepted:
                    break
                refused += accepted is False
            self.counters["skipped"] += len(entries)

    def _handle(self, line, t):
        # type: (bytes, float) -> Optional[bool]
        """Handle one line that came in at t (s).

        Returns:
            True if it is an observation to hand over; None for a bad line; else False.
        """
        if self.closed:
            return False
        try:
            message = decode(line, self._newest.names)
            if type(message) is Observation and self.proven:  # most often by far
                accepted = self._newest.handle(message, t)
                self._bad_in_a_row, self._last_line_at = 0, t
                return accepted
            if isinstance(message, _HANDSHAKE) == self.proven and not isinstance(message, Bye):
                raise BadMessage("the handshake comes first, and once")
            accepted = self._act(message, t)
        except BadMessage:
            self._count_bad()
            return None
        self._bad_in_a_row, self._last_line_at = 0, t
        return accepted

    def _act(self, message, t):
        # type: (Message, float) -> bool
        if isinstance(message, Ping):
            if not self.blocked:  # late, a pong is worth nothing
                self.send(Pong(message.id, t, self._now()))
        elif isinstance(message, Pong):
            self._learn(message, t)
        elif isinstance(message, Bye):
            self._fail("the other side said: {}".format(message.reason or "bye"))
        else:
            self.counters["dropped"] += len(self._inbox) == MAX_QUEUE
            self._inbox.append(message)
        return False

    def _learn(self, pong, t):
        # type: (Pong, float) -> None
        jumps = self.clock.jumps
        if not self._pings.handle(pong, t):
            raise BadMessage("an answer to no ping of ours, or one with impossible times")
        if self.clock.jumps > jumps:
            self._newest.forget_times()

    # Supervision

    def _check_own_clock(self):
        # type: () -> None
        t = self._now()
        if t < self._polled:  # what is due by its old times would come late
            self._last_line_at = t
            self._outgoing.shift_to(t)
            self._pings.restart(t)
        self._polled = t

    def _ping(self):
        # type: () -> None
        t = self._now()
        if t < self._pings.next_at or self.blocked:
            return
        number = self._pings.begin(t)
        self.send(Ping(number))
        end = t + self._patience * (1 if self._pings.can_convert(t) else UNDATED_PATIENCE)
        for _ in range(MAX_PING_WAITS):
            left = end - self._now()
            if left <= 0 or not self._pings.awaits(number) or self.closed:
                break
            self._wait(left)
            self._read()
            self._write()

    def _notice_silence(self):
        # type: () -> None
        t = self._now()
        if t - self._last_line_at > SILENCE_TIMEOUT:
            self._fail("nothing heard for {:.1f} s".format(t - self._last_line_at))
        elif self._outgoing.blocked_for(t) > SILENCE_TIMEOUT:
            self._fail("the other side takes no data")

    def _refuse_line(self):
        # type: () -> None
        """End the connection: the other side has not sent this line."""
        if self.closed:
            return
        self.counters["bad"] += 1
        if self.proven:
            self.send(Bye(FORGED))
        self._fail(FORGED if self.proven else FOREIGN)

    def _count_bad(self):
        # type: () -> None
        if not self.proven:
            return self._refuse_line()
        self.counters["bad"] += 1
        self._bad_in_a_row += 1
        if self._bad_in_a_row >= MAX_BAD_LINES:
            self._fail("{} bad lines in a row".format(self._bad_in_a_row))

    def close(self, reason=""):
        # type: (str) -> None
        """Say bye, if the other side has proven itself, and close the socket."""
        if not self.closed:
            if self.proven:
                self.send(Bye(reason))
            self._fail(reason or "closed")
        self.abort()
