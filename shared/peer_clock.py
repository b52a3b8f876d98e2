"""Offset of the other side's clock, estimated from pings and pongs.  Pure.

A ping leaves at t1 on the own clock, arrives at t2 on theirs; the pong leaves at t3 on theirs and
arrives at t4 on the own clock. With theirs = own + offset, and since no message arrives before it
was sent,

    t3 - t4  <=  offset  <=  t2 - t1

The middle, ((t2 - t1) + (t3 - t4)) / 2, is NTP's estimate (RFC 5905, section 8). Its error is at
most half the round trip, (t4 - t1) - (t3 - t2), however unequal the two ways are. So the exchange
with the shortest round trip is the best: Cristian, Probabilistic clock synchronization,
Distributed Computing 3, 1989. A mean of all offsets would be worse: delays are one-sided, and a
single late pong would shift it. With age a bound widens by the drift of the two crystals.

Nothing here sets a clock. Observations keep the sender's times, which are converted on arrival.
"""

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
"""Number of pings at the short period, after the link begins."""

FAST_PING, SLOW_PING = 0.25, 0.5
"""Periods of the pings, s: of the first ones, and of the later ones."""

MAX_UNCERTAINTY = 0.1
"""Greatest uncertainty of the clock offset at which observations are dated, s."""

MAX_SAMPLES = 16
"""Number of the last pongs among which the clock offset is chosen."""

MAX_DRIFT = 100e-6
"""Greatest drift between two clocks, s per s: two bad crystals."""

TIME_RESOLUTION = 1e-5
"""Greatest rounding error of an interval between time stamps, s."""


class PeerClock(object):
    """Estimate of the other side's clock: theirs = ours + offset.

    The tightest bounds of the last MAX_SAMPLES exchanges count, and their middle is the offset.
    Bounds that exclude each other prove that a clock has jumped: all earlier ones are forgotten.

    Attributes:
        jumps: number of jumps of a clock.
        is_known: whether there is an estimate.
        offset: their clock minus ours, s; 0 while unknown.
        round_trip: of the exchange that was chosen, s; None while there is none.
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
        """Update the estimate by one ping and its pong.

        Args:
            ping_sent: t1, on our clock, s.
            ping_received: t2, on theirs, s.
            pong_sent: t3, on theirs, s.
            pong_received: t4, on ours, s.

        Returns:
            bool: whether these times are possible.
        """
        new = _Sample(pong_received, pong_sent - pong_received, ping_received - ping_sent)
        if pong_sent < ping_received or new.highest < new.lowest - TIME_RESOLUTION:
            return False
        for old in self._samples:
            slack = MAX_DRIFT * abs(new.t - old.t) + TIME_RESOLUTION
            if new.lowest > old.highest + slack or new.highest < old.lowest - slack:
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
        """Return the greatest error of the offset at `now`, s; infinite while it is unknown."""
        return self._uncertainty + MAX_DRIFT * abs(now - self._best_at)


class Pings(object):
    """Pings of one link, which estimate the other side's clock.

    Args:
        t: time at which the first is due, s.

    Attributes:
        clock: PeerClock.
        next_at: time at which the next ping is due, s.
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
        """Record that a ping is sent at `t` (s); return its number."""
        self._sent += 1
        self.next_at = t + (FAST_PING if self._sent <= FIRST_PINGS else SLOW_PING)
        self._in_flight[self._sent] = t
        if len(self._in_flight) > MAX_SAMPLES:
            self._in_flight.popitem(last=False)
        return self._sent

    def awaits(self, number):
        # type: (int) -> bool
        """Return whether the ping of this number is not answered yet."""
        return number in self._in_flight

    def handle(self, pong, t):
        # type: (Pong, float) -> bool
        """Update the clock by a Pong that came in at `t` (s); return whether it is possible."""
        sent = self._in_flight.pop(pong.id, None)
        if sent is None or not self.clock.add(sent, pong.received, pong.sent, t):
            return False
        if self._doubted_at is not None and pong.id > self._doubted_at:
            self._doubted_at = None
        return True

    def can_convert(self, t):
        # type: (float) -> bool
        """Return whether at `t` (s) the other side's times can be converted to ours."""
        return (
            self._doubted_at is None
            and self.clock.is_known
            and self.clock.uncertainty(t) <= MAX_UNCERTAINTY
        )

    def invalidate(self, t):
        # type: (float) -> None
        """Doubt the clocks after an impossible time at `t` (s): no dates until a new pong."""
        self._doubted_at = self._sent
        self.next_at = min(self.next_at, t + FAST_PING / 2)

    def restart(self, t):
        # type: (float) -> None
        """Forget the pings in flight: our own clock has jumped back to `t` (s)."""
        self.next_at = t
        self._in_flight.clear()
