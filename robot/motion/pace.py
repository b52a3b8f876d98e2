"""How often the control loop goes round, on a brick that computes as slowly as it does.  Pure.

The period is chosen from what ticks take, and goes on following that.  On a brick that needs longer
than MAX_PERIOD the plan goes slower than the clock: it costs time, not accuracy.
"""

from robot.motion.joint_controller import LEAD

MYPY = False
if MYPY:
    from typing import Callable, Optional  # noqa: F401

    Say = Callable[[str], object]  # tells people one line

MIN_PERIOD, MAX_PERIOD = 0.02, 0.05
"""Periods, s."""

AVERAGED_TICKS = 12
"""So many ticks tell how long one takes."""

PERIOD_MARGIN = 1.25
"""The period leaves room for ticks that take so many times the mean."""

READ_SHARE = 0.7
"""So much of a tick's computing comes between reading and command."""

LEAD_SHARE = 0.7
"""What is fed forward is so by this share of what the period is longer than MIN_PERIOD, more."""

SLOWDOWN_FACTOR = 1.3
"""A period so many times as long as it was at first, and so long that the plan goes slower, is
worth a word."""

MAX_RATE_CHANGE = 1.0
"""The plan's rate changes no faster, 1/s."""

LATE_TICK_TIME, RECENT_TIME = 0.06, 0.3
"""What comes later than this after the tick before is late (s); and so long ago is lately, s."""

COARSE_FACTOR = 1.4
"""With a period of more than so many times the shortest, joints end a little off."""

HOPELESS_TICK_TIME, HOPELESS_TICKS = 0.1, 4
"""So many ticks in a row that take longer than this (s) control nothing."""


class LoopTiming(object):
    """The pace of one arm's control loop, from motion to motion.

    Args:
        say: called with what people should know of it.

    Attributes:
        period: of the loop, s.
        rate: how fast the plan goes, by the clock.
        delay: from a reading to the middle of the time for which the command acts that it leads
            to, s.
        lead: speed and acceleration are fed forward so much early, s.
        latest: the last late tick, s.
        slow: ticks in a row that took longer than HOPELESS_TICK_TIME.
    """

    def __init__(self, say):
        # type: (Say) -> None
        self._say = say
        self.period = MIN_PERIOD
        self.rate = self._wanted = 1.0
        self.delay = MIN_PERIOD / 2
        self.lead = LEAD
        self.slow = 0
        self.latest = 0.0
        self._n, self._sum = 0, 0.0
        self._first = None  # type: Optional[float]
        self._reported = False
        self._late_at = None  # type: Optional[float]

    def begin(self):
        # type: () -> None
        """A motion begins."""
        self.slow = 0
        self._late_at = None
        self.rate = self._wanted

    def update(self, t, since_last, computing):
        # type: (float, float, float) -> None
        """Take in a tick that ended at `t` (s), so long after the one before; and took so long."""
        if since_last > LATE_TICK_TIME:
            self._late_at, self.latest = t, since_last
        self.slow = self.slow + 1 if since_last > HOPELESS_TICK_TIME else 0
        self._n += 1
        self._sum += computing
        if self.rate != self._wanted:
            most = MAX_RATE_CHANGE * since_last
            self.rate += min(max(self._wanted - self.rate, -most), most)
        if self._n == AVERAGED_TICKS:
            self._choose(self._sum / AVERAGED_TICKS)
            self._n, self._sum = 0, 0.0

    def _choose(self, computing):
        # type: (float) -> None
        wanted = PERIOD_MARGIN * computing
        self.period = min(max(wanted, MIN_PERIOD), MAX_PERIOD)
        self.delay = max(self.period, computing) / 2 + READ_SHARE * computing
        self.lead = LEAD + LEAD_SHARE * (self.period - MIN_PERIOD)
        self._wanted = min(1.0, MAX_PERIOD / wanted)
        if self._first is None:
            self._first = wanted
            self._say(
                "a control tick takes {:.0f} ms of this brick, so there is one every {:.0f} ms"
                "".format(1000 * computing, 1000 * max(self.period, computing))
            )
        elif not self._reported and wanted > max(SLOWDOWN_FACTOR * self._first, MAX_PERIOD):
            self._reported = True
            self._say(
                "the brick has become slower, a control tick takes {:.0f} ms: the arm slows down; "
                "end other programs on the brick".format(1000 * computing)
            )

    def was_late(self, t):
        # type: (float) -> bool
        """Whether lately a tick was late, so that what motors did says nothing of the arm."""
        return self._late_at is not None and t - self._late_at < RECENT_TIME

    def is_coarse(self, t):
        # type: (float) -> bool
        """Whether ticks are so far apart that a joint may not get to where it should be exactly."""
        return self.period > COARSE_FACTOR * MIN_PERIOD or self.was_late(t)
