"""A connected socket that sends messages and hands over the newest.

One thread, no sleep: everything that is due is done in `poll` and `send`, and only `poll` waits, as
long as it is told to. What cannot be sent yet waits in one slot per camera, where the newest wins.
"""

import collections
import contextlib
import select
import socket

from shared.messages import (
    MAX_CAMERAS,
    MAX_LINE,
    BadMessage,
    Bye,
    Challenge,
    Hello,
    LineBuffer,
    Observation,
    Ping,
    Pong,
    Proof,
    Refused,
    Welcome,
    decode,
    encode,
    prepare,
)
from shared.record import record

SILENCE = 2.0
"""A side that says nothing, or takes nothing, for so long is gone, s."""

MAX_AGE = 1.0
"""Older observations are stale, s."""

FUTURE = 0.01
"""How far from the future an observation may seem to come, beyond what the clocks explain, s."""

MAX_UNCERTAINTY = 0.1
"""While the clock offset is known no better, observations have no date, s."""

MAX_BAD_LINES = 20
"""So many in a row end the connection."""

MAX_QUEUE = 16
"""Messages, other than observations, that wait to be sent or taken."""

MOST_USUAL = 64
"""Names of cameras and markers that are kept in mind."""

FOREIGN = "it does not speak our language"
"""Why a link has ended whose first words were no handshake."""

READ_SIZE = 16384
READS = 4
"""Of READ_SIZE bytes, at most, in one poll: a flood must not keep us."""

TRIES = 4
"""Observations of a camera that came at once are looked at, from the newest on, until one is good;
after so many the others are skipped."""

FIRST_PINGS = 20
FAST_PING = 0.25
SLOW_PING = 0.5
"""Pings come every FAST_PING s at first, then every SLOW_PING s."""

UNDATED_PATIENCE = 10
"""As many times longer is an answer waited for while nothing can be dated without it."""

MOST_WAITS = 4
"""Other messages that may come in meanwhile, before it is given up."""

SAMPLES = 16
"""Pongs among which the clock offset is chosen."""

DRIFT = 100e-6
"""By which two clocks may run apart, s per s: two bad crystals."""

TICK = 1e-5
"""What rounding may do to an interval between time stamps, s."""

COUNTERS = (
    "bad",
    "skipped",
    "out_of_sequence",
    "stale",
    "future",
    "undated",
    "replaced",
    "dropped",
)

# How `encode` begins a line, and goes on after the camera's name: recognised without parsing.
_OBSERVATION, _SEQ = b'{"kind":"observation","camera":"', b'","seq":'

_HANDSHAKE = (Hello, Challenge, Proof, Welcome, Refused)

_Sample = record("_Sample", "t lowest highest")


def _seq(entry):
    """Of an observation's line and the time it came in: its number; -1: it has none."""
    line = entry[0]
    begin = line.find(_SEQ, len(_OBSERVATION)) + len(_SEQ)
    number = line[begin : line.find(b",", begin)]
    return int(number) if number.isdigit() and len(number) <= 16 else -1


class PeerClock(object):
    """The other side's clock, seen from ours: theirs = ours + offset.

    Each ping and its pong bound the offset from both sides: the pong was sent before it came in,
    the ping came in after it was sent. The tightest of the last SAMPLES is believed (Cristian 1989,
    as in NTP), and it is the middle of the bounds. Bounds that exclude each other prove that a
    clock has jumped: what was learned before is then forgotten.

    Attributes:
        jumps: how often a clock has jumped.
    """

    def __init__(self):
        self.jumps = 0
        self._samples = collections.deque(maxlen=SAMPLES)
        self._best = None

    def add(self, ping_sent, ping_received, pong_sent, pong_received):
        """Learn from one ping and its pong; the first and last time are ours, the others theirs.

        Returns:
            bool: whether these times can be true.
        """
        new = _Sample(pong_received, pong_sent - pong_received, ping_received - ping_sent)
        if pong_sent < ping_received or new.highest < new.lowest - TICK:
            return False
        for old in self._samples:
            play = DRIFT * abs(new.t - old.t) + TICK
            if new.lowest > old.highest + play or new.highest < old.lowest - play:
                self.jumps += 1
                self._samples.clear()
                break
        self._samples.append(new)
        # All grow less certain at the same rate, so the best now stays the best.
        self._best = min(
            self._samples, key=lambda s: (s.highest - s.lowest) / 2 + DRIFT * (new.t - s.t)
        )
        return True

    @property
    def is_known(self):
        """Whether anything is known."""
        return self._best is not None

    @property
    def offset(self):
        """Their clock minus ours, s."""
        return (self._best.lowest + self._best.highest) / 2

    @property
    def round_trip(self):
        """Of the ping that is believed, s; None while there is none."""
        return max(0.0, self._best.highest - self._best.lowest) if self._best else None

    def uncertainty(self, now):
        """By how much the offset may be wrong, s."""
        return self.round_trip / 2 + DRIFT * abs(now - self._best.t)


class Link(object):
    """One connection; it ends by itself when the other side falls silent or talks nonsense.

    Args:
        sock: a connected stream socket; the link closes it.
        now: gives the time, s.
        proven: whether it is known who is there. If not, only the handshake passes, message by
            message, and one bad line ends it; `trust` opens it.
        patience: s that `poll` waits for the answer to a ping of ours, whatever its timeout (and
            UNDATED_PATIENCE times that where nothing can be dated yet): a pong that was found lying
            there does not tell when it came.
        max_age: older observations are not handed over, s.
        select: waits for sockets, as select.select does.

    Attributes:
        reason: why it is closed; "" while it is open.
        clock: PeerClock of the other side.
        counters: by name (COUNTERS): lines that were `bad`; observations that were `skipped`, not
            even parsed (a newer one came with them), `out_of_sequence`, `stale`, from the `future`,
            or `undated` (the clock offset was not known); observations of ours that were `replaced`
            by newer ones before they could go out; messages that nobody took, and were `dropped`.
    """

    def __init__(self, sock, now, proven=True, patience=0.0, max_age=MAX_AGE, select=select.select):
        self.reason = ""
        self.clock = PeerClock()
        self.counters = dict.fromkeys(COUNTERS, 0)
        self._sock = sock
        self._now = now
        self._proven = proven
        self._patience = patience
        self._max_age = max_age
        self._select = select
        self._is_open = True

        self._buffer = LineBuffer()
        self._lines = collections.deque()  # not looked at yet; (line, time it came in)
        self._inbox = collections.deque(maxlen=MAX_QUEUE)
        self._bad_in_a_row = 0
        self._latest = {}  # camera: (seq, t on their clock) of the newest observation accepted
        self._slots = {}  # camera: the observation to hand over
        self._usual = set()  # names that have been found right

        self._unsent = b""  # the rest of a line that has begun to go out
        self._queue = collections.deque()
        self._mailbox = collections.OrderedDict()  # camera: line
        self._blocked_since = None

        self._pings = 0
        self._in_flight = collections.OrderedDict()  # id of a ping: when it was sent
        self._doubted_at = None  # pings sent when a clock came under suspicion
        self._polled = self._heard = self._next_ping = now()

        sock.setblocking(False)
        if sock.family in (socket.AF_INET, socket.AF_INET6):
            try:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            except OSError as error:  # it has gone already
                self._fail(error.strerror)

    @property
    def closed(self):
        """Whether it has ended; `reason` says why."""
        return bool(self.reason)

    @property
    def blocked(self):
        """Whether something waits until the other side takes more."""
        return bool(self._unsent or self._queue or self._mailbox)

    def backlog(self):
        """Count what it holds, all of which has a bound: a dict.

        lines, line_bytes   come in, and not looked at yet
        part_bytes          of a line that has not come in whole
        inbox               messages that nobody has taken
        cameras             of which the newest observation is known
        pings               not answered yet
        queue, mailbox      messages, and observations, that wait to go out
        waiting_bytes       of these
        unsent_bytes        of a line that has begun to go out
        """
        waiting = list(self._queue) + list(self._mailbox.values())
        return {
            "lines": len(self._lines),
            "line_bytes": sum(len(line) for line, _ in self._lines),
            "part_bytes": self._buffer.pending,
            "inbox": len(self._inbox),
            "cameras": len(self._latest),
            "pings": len(self._in_flight),
            "queue": len(self._queue),
            "mailbox": len(self._mailbox),
            "waiting_bytes": sum(map(len, waiting)),
            "unsent_bytes": len(self._unsent),
        }

    def fileno(self):
        """The socket's number, for `select`; -1 once it is closed."""
        return self._sock.fileno()

    def trust(self):
        """The other side has proven who it is: from here on everything passes, and pings go out."""
        prepare()
        self._proven = True
        self._heard = self._next_ping = self._now()

    # Sending

    def send(self, message):
        """Send a message, at once or as soon as the other side takes it; never waits.

        A newer observation replaces an unsent one of its camera.

        Raises:
            BadMessage: it has a value that the other side would not accept.
        """
        line = encode(message)
        if self.closed:
            return
        if type(message) is Observation:
            self.counters["replaced"] += message.camera in self._mailbox
            self._mailbox[message.camera] = line
        elif len(self._queue) < MAX_QUEUE:
            self._queue.append(line)
        else:
            self._fail("the other side takes no data")
        self._write()

    def _write(self):
        while not self.closed and self.blocked:
            if not self._unsent:
                self._unsent = (
                    self._queue.popleft() if self._queue else self._mailbox.popitem(last=False)[1]
                )
            try:
                sent = self._sock.send(self._unsent)
            except (BlockingIOError, InterruptedError):
                if self._blocked_since is None:
                    self._blocked_since = self._now()
                return
            except OSError as error:
                self._fail(error.strerror or str(error))
                return
            self._unsent = self._unsent[sent:]
            self._blocked_since = None

    # Receiving

    def poll(self, timeout=0.0):
        """Read and send what there is, answer and send pings, notice silence.

        Args:
            timeout: s to wait, at most, until something comes in.
        """
        if self._is_open and not self.closed:
            self._check_own_clock()
            if timeout > 0 and not self._lines:
                if self._proven and not self.blocked:
                    timeout = min(timeout, max(0.0, self._next_ping - self._now()))
                self._wait(timeout)
            self._read()
            self._write()
            if self._proven and not self.closed:
                self._ping()
            self._notice_silence()
        if self.closed:
            self._hang_up()

    def receive(self):
        """The next message other than pings and observations, or None."""
        if not self._inbox:
            self._digest()
        return self._inbox.popleft() if self._inbox else None

    def newest(self):
        """The newest Observation of each camera, unless it was handed over before: {camera: it}.

        Their t is on our clock.
        """
        oldest = self._now() - self._max_age
        fresh = {camera: seen for camera, seen in self._slots.items() if seen.t >= oldest}
        self.counters["stale"] += len(self._slots) - len(fresh)
        self._slots.clear()
        return fresh

    def _wait(self, seconds):
        self._select([self._sock], [self._sock] if self.blocked else [], [], seconds)

    def _read(self):
        if self._lines:
            return  # a stranger is heard one message at a time
        for _ in range(READS if self._proven else 1):
            try:
                data = self._sock.recv(READ_SIZE if self._proven else MAX_LINE)
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
            for _ in range(self._buffer.overlong - overlong):
                self._count_bad()
        self._digest()

    def _digest(self):
        """Look at the lines that came in; at a stranger's, one message at a time."""
        if not self._proven:
            while self._lines and not self._inbox and not self.closed:
                self._take(*self._lines.popleft())
            return
        if len(self._lines) == 1:  # nothing newer has come with it
            self._take(*self._lines.popleft())
            return
        cameras = {}
        while self._lines:
            entry = self._lines.popleft()
            line = entry[0]
            if line.startswith(_OBSERVATION):
                camera = line[: line.find(b'"', len(_OBSERVATION))]
                cameras.setdefault(camera, []).append(entry)
            else:
                self._take(*entry)
        for entries in cameras.values():
            if len(entries) > 1:
                entries.sort(key=_seq)  # in order already, but for a sender out of its mind
            refused = 0
            while entries and refused < TRIES:
                taken = self._take(*entries.pop())
                if taken:
                    break
                refused += taken is False
            self.counters["skipped"] += len(entries)

    def _take(self, line, t):
        """Act on one line that came in at t.

        Returns:
            True if it is an observation to hand over; None for a bad line; else False.
        """
        if self.closed:
            return False
        try:
            message = decode(line, self._usual)
            if type(message) is Observation and self._proven:  # most often by far
                kept = self._keep(message, t)
                self._bad_in_a_row, self._heard = 0, t
                return kept
            if not self._proven and not isinstance(message, _HANDSHAKE + (Bye,)):
                raise BadMessage("not before the handshake")
            if self._proven and isinstance(message, _HANDSHAKE):
                raise BadMessage("not after the handshake")
            kept = self._act(message, t)
        except BadMessage:
            self._count_bad()
            return None
        self._bad_in_a_row = 0
        self._heard = t
        return kept

    def _act(self, message, t):
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
        sent = self._in_flight.pop(pong.id, None)
        jumps = self.clock.jumps
        if sent is None or not self.clock.add(sent, pong.received, pong.sent, t):
            raise BadMessage("an answer to no ping of ours, or one with impossible times")
        if self._doubted_at is not None and pong.id > self._doubted_at:
            self._doubted_at = None
        if self.clock.jumps > jumps:
            # What was accepted was dated by a clock that is no more.
            self._slots.clear()
            self._latest = {camera: (seq, 0.0) for camera, (seq, _) in self._latest.items()}

    def _keep(self, seen, t):
        """Put an observation that came in at t into its slot, if it is newer and can be dated."""
        seq, last = self._latest.get(seen.camera, (-1, -1.0))
        if seq < 0 and len(self._latest) == MAX_CAMERAS:
            raise BadMessage("more than {} cameras".format(MAX_CAMERAS))
        for name in [seen.camera] + list(seen.markers) if seq < 0 else seen.markers:
            if name not in self._usual and len(self._usual) < MOST_USUAL:
                self._usual.add(name)
        if seen.seq <= seq:
            self.counters["out_of_sequence"] += 1
            return False
        if not self._can_date(t):
            self.counters["undated"] += 1
            return False
        age = t - (seen.t - self.clock.offset)
        if seen.t < last:
            self.counters["out_of_sequence"] += 1
            self._doubt(t)
        elif age < -FUTURE and age < -FUTURE - self.clock.uncertainty(t):
            self.counters["future"] += 1
            self._doubt(t)
        else:
            self._latest[seen.camera] = seen.seq, seen.t
            self._slots[seen.camera] = Observation(seen.seq, seen.camera, t - age, seen.markers)
            return True
        return False

    def _can_date(self, t):
        return (
            self._doubted_at is None
            and self.clock.is_known
            and self.clock.uncertainty(t) <= MAX_UNCERTAINTY
        )

    def _doubt(self, t):
        """A time that cannot be: has a clock jumped? Nothing is dated until a new ping has told."""
        self._doubted_at = self._pings
        self._next_ping = min(self._next_ping, t + FAST_PING / 2)

    # Keeping watch

    def _check_own_clock(self):
        t = self._now()
        if t < self._polled:  # what is due by its old times would come late
            self._heard = self._next_ping = t
            self._blocked_since = None if self._blocked_since is None else t
            self._in_flight.clear()
        self._polled = t

    def _ping(self):
        t = self._now()
        if t < self._next_ping or self.blocked:
            return
        self._pings += 1
        self._next_ping = t + (FAST_PING if self._pings <= FIRST_PINGS else SLOW_PING)
        self._in_flight[self._pings] = t
        if len(self._in_flight) > SAMPLES:
            self._in_flight.popitem(last=False)
        self.send(Ping(self._pings))
        patience = self._patience * (1 if self._can_date(t) else UNDATED_PATIENCE)
        end = t + patience
        for _ in range(MOST_WAITS):
            left = end - self._now()
            if left <= 0 or self._pings not in self._in_flight or self.closed:
                break
            self._wait(left)
            self._read()
            self._write()

    def _notice_silence(self):
        t = self._now()
        if t - self._heard > SILENCE:
            self._fail("nothing heard for {:.1f} s".format(t - self._heard))
        elif self._blocked_since is not None and t - self._blocked_since > SILENCE:
            self._fail("the other side takes no data")

    def _count_bad(self):
        self.counters["bad"] += 1
        self._bad_in_a_row += 1
        if not self._proven:
            self._fail(FOREIGN)
        elif self._bad_in_a_row >= MAX_BAD_LINES:
            self._fail("{} bad lines in a row".format(self._bad_in_a_row))

    def _fail(self, reason):
        self.reason = self.reason or reason

    # Closing

    def close(self, reason=""):
        """Say bye, if the other side has proven itself, and close the socket."""
        if not self.closed:
            if self._proven:
                self.send(Bye(reason))
            self._fail(reason or "closed")
        self._hang_up()

    def _hang_up(self):
        if not self._is_open:
            return
        self._is_open = False
        with contextlib.suppress(OSError):  # it has gone, or there is nothing to read
            # What lies unread would make TCP throw away what we have just sent.
            self._sock.shutdown(socket.SHUT_WR)
            for _ in range(READS):
                if not self._sock.recv(READ_SIZE):
                    break
        self._sock.close()
