"""The other side's clock, seen from ours by pings and pongs.  Pure."""

import collections

from shared.record import record

MYPY = False
if MYPY:
    from typing import Deque, NamedTuple, Optional  # noqa: F401

    from shared.messages import Pong  # noqa: F401

    _Sample = NamedTuple("_Sample", [("t", float), ("lowest", float), ("highest", float)])
else:
    _Sample = record("_Sample", "t lowest highest")

FIRST_PINGS = 20
FAST_PING = 0.25
SLOW_PING = 0.5
"""Pings come every FAST_PING s at first, then every SLOW_PING s."""

MAX_UNCERTAINTY = 0.1
"""While the clock offset is known no better, observations have no date, s."""

MAX_SAMPLES = 16
"""Pongs among which the clock offset is chosen."""

MAX_DRIFT = 100e-6
"""By which two clocks may run apart, s per s: two bad crystals."""

TIME_RESOLUTION = 1e-5
"""What rounding may do to an interval between time stamps, s."""


class PeerClock(object):
    """The other side's clock, seen from ours: theirs = ours + offset.

    Each ping and its pong bound the offset from both sides: the pong was sent before it came in,
    the ping came in after it was sent. The tightest of the last MAX_SAMPLES is believed (Cristian
    1989, as in NTP), and it is the middle of the bounds. Bounds that exclude each other prove that
    a clock has jumped: what was learned before is then forgotten.

    Attributes:
        jumps: how often a clock has jumped.
        is_known: whether anything is known.
        offset: their clock minus ours, s; 0 while nothing is known.
        round_trip: of the ping that is believed, s; None while there is none.
    """

    def __init__(self):
        # type: () -> None
        self.jumps = 0
        self.is_known = False
        self.offset = 0.0
        self.round_trip = None  # type: Optional[float]
        self._samples = collections.deque(maxlen=MAX_SAMPLES)  # type: Deque[_Sample]
        self._uncertainty, self._best_at = float("inf"), 0.0

    def add(self, ping_sent, ping_received, pong_sent, pong_received):
        # type: (float, float, float, float) -> bool
        """Learn from one ping and its pong; the first and last time are ours, the others theirs.

        Returns:
            bool: whether these times can be true.
        """
        new = _Sample(pong_received, pong_sent - pong_received, ping_received - ping_sent)
        if pong_sent < ping_received or new.highest < new.lowest - TIME_RESOLUTION:
            return False
        for old in self._samples:
            play = MAX_DRIFT * abs(new.t - old.t) + TIME_RESOLUTION
            if new.lowest > old.highest + play or new.highest < old.lowest - play:
                self.jumps += 1
                self._samples.clear()
                break
        self._samples.append(new)
        # All grow less certain at the same rate, so the best now stays the best.
        best = min(
            self._samples, key=lambda s: (s.highest - s.lowest) / 2 + MAX_DRIFT * (new.t - s.t)
        )
        self.is_known = True
        self.offset = (best.lowest + best.highest) / 2
        self.round_trip = max(0.0, best.highest - best.lowest)
        self._uncertainty, self._best_at = self.round_trip / 2, best.t
        return True

    def uncertainty(self, now):
        # type: (float) -> float
        """By how much the offset may be wrong, s; infinite while nothing is known."""
        return self._uncertainty + MAX_DRIFT * abs(now - self._best_at)


class Pings(object):
    """The pings of one link, by which the other side's clock is known.

    Args:
        t: time at which the first is due, s.

    Attributes:
        clock: PeerClock.
        next_at: when the next ping is due, s.
    """

    def __init__(self, t):
        # type: (float) -> None
        self.clock = PeerClock()
        self.next_at = t
        self._sent = 0
        # number of a ping: when it was sent
        self._in_flight = collections.OrderedDict()  # type: collections.OrderedDict[int, float]
        # pings sent when a clock came under suspicion
        self._doubted_at = None  # type: Optional[int]

    def __len__(self):
        # type: () -> int
        return len(self._in_flight)

    def begin(self, t):
        # type: (float) -> int
        """Note that a ping goes out at `t` (s); its number."""
        self._sent += 1
        self.next_at = t + (FAST_PING if self._sent <= FIRST_PINGS else SLOW_PING)
        self._in_flight[self._sent] = t
        if len(self._in_flight) > MAX_SAMPLES:
            self._in_flight.popitem(last=False)
        return self._sent

    def awaits(self, number):
        # type: (int) -> bool
        """Whether a ping is not answered yet."""
        return number in self._in_flight

    def take(self, pong, t):
        # type: (Pong, float) -> bool
        """Learn from a Pong that came in at `t` (s); whether it can be true."""
        sent = self._in_flight.pop(pong.id, None)
        if sent is None or not self.clock.add(sent, pong.received, pong.sent, t):
            return False
        if self._doubted_at is not None and pong.id > self._doubted_at:
            self._doubted_at = None
        return True

    def can_date(self, t):
        # type: (float) -> bool
        """Whether at `t` (s) the other side's times can be told in ours."""
        return (
            self._doubted_at is None
            and self.clock.is_known
            and self.clock.uncertainty(t) <= MAX_UNCERTAINTY
        )

    def doubt(self, t):
        # type: (float) -> None
        """A time that cannot be: has a clock jumped? Nothing is dated until a new ping has told."""
        self._doubted_at = self._sent
        self.next_at = min(self.next_at, t + FAST_PING / 2)

    def restart(self, t):
        # type: (float) -> None
        """Our own clock has jumped back, to `t` (s): what is on its way tells nothing."""
        self.next_at = t
        self._in_flight.clear()
