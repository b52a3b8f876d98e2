"""Timing of the control loop: its period and lead, adapted to the brick's computing time.  Pure.

The period follows the mean computing time of the ticks.  On a brick that needs more than MAX_PERIOD
the plan goes slower than the clock: that costs time, not accuracy.
"""

from robot.motion.joint_controller import LEAD

MYPY = False
if MYPY:
    from typing import Callable, Optional  # noqa: F401

    ReportLine = Callable[[str], object]  # reports one line to people

MIN_PERIOD, MAX_PERIOD = 0.02, 0.05
"""Bounds of the period, s."""

AVERAGED_TICKS = 12
"""Number of ticks over which the computing time is averaged."""

PERIOD_MARGIN = 1.25
"""Ratio of the period to the mean computing time of a tick."""

READ_SHARE = 0.7
"""Share of a tick's computing time between reading and command."""

LEAD_SHARE = 0.7
"""Share of the period beyond MIN_PERIOD that is added to the lead of the feed-forward."""

SLOWDOWN_FACTOR = 1.3
"""Ratio of a period to the first one from which a plan that goes slower is reported."""

MAX_RATE_CHANGE = 1.0
"""Maximum change of the plan's rate, 1/s."""

LATE_TICK_TIME, RECENT_TIME = 0.06, 0.3
"""Interval of ticks from which one is late, s; and time for which `was_late` remembers it, s."""

COARSE_FACTOR = 1.4
"""Ratio of the period to MIN_PERIOD from which joints need not end exactly."""

HOPELESS_TICK_TIME, HOPELESS_TICKS = 0.1, 4
"""Interval of ticks, s, and number of longer ones in a row, with which there is no control."""


class LoopTiming(object):
    """The timing of one arm's control loop, stored from motion to motion.

    Args:
        report: called with a line for people.

    Attributes:
        period: of the loop, s.
        rate: rate of the plan's time by the clock's, 0 .. 1.
        delay: time from a reading to the middle of its command's action, s.
        lead: lead of the feed-forward of speed and acceleration, s.
        latest: interval of the last late tick, s.
        slow: number of ticks in a row that took longer than HOPELESS_TICK_TIME.
    """

    def __init__(self, report):
        # type: (ReportLine) -> None
        self._report = report
        self.period = MIN_PERIOD
        self.rate = self._wanted = 1.0
        self.delay = MIN_PERIOD / 2
        self.lead = LEAD
        self.slow = 0
        self.latest = 0.0
        self._n, self._sum, self._spare = 0, 0.0, 0.0
        self._first = None  # type: Optional[float]
        self._reported = False
        self._late_at = None  # type: Optional[float]

    def begin(self):
        # type: () -> None
        """Begin a motion."""
        self.slow = 0
        self._late_at = None
        self.rate = self._wanted

    def add_spare(self, seconds):
        # type: (float) -> None
        """Add the time of this tick that other work takes after the command, s."""
        self._spare += seconds

    def update(self, t, since_last, computing):
        # type: (float, float, float) -> None
        """Update with a tick that ended at `t`, its interval and its computing time, all in s."""
        if since_last > LATE_TICK_TIME:
            self._late_at, self.latest = t, since_last
        self.slow = self.slow + 1 if since_last > HOPELESS_TICK_TIME else 0
        self._n += 1
        self._sum += computing
        if self.rate != self._wanted:
            most = MAX_RATE_CHANGE * since_last
            self.rate += min(max(self._wanted - self.rate, -most), most)
        if self._n == AVERAGED_TICKS:
            self._choose(self._sum / AVERAGED_TICKS, self._spare / AVERAGED_TICKS)
            self._n, self._sum, self._spare = 0, 0.0, 0.0

    def _choose(self, computing, spare):
        # type: (float, float) -> None
        """Choose period, delay, lead and rate by a tick's mean computing and spare time, s."""
        wanted = PERIOD_MARGIN * (computing + spare)
        self.period = min(max(wanted, MIN_PERIOD), MAX_PERIOD)
        self.delay = max(self.period, computing) / 2 + READ_SHARE * computing
        self.lead = LEAD + LEAD_SHARE * (self.period - MIN_PERIOD)
        self._wanted = min(1.0, MAX_PERIOD / wanted)
        if self._first is None:
            self._first = wanted
            self._report(
                "a control tick takes {:.0f} ms of this brick, so there is one every {:.0f} ms"
                "".format(1000 * computing, 1000 * max(self.period, computing))
            )
        elif not self._reported and wanted > max(SLOWDOWN_FACTOR * self._first, MAX_PERIOD):
            self._reported = True
            self._report(
                "the brick has become slower, a control tick takes {:.0f} ms: the arm slows down; "
                "end other programs on the brick".format(1000 * computing)
            )

    def was_late(self, t):
        # type: (float) -> bool
        """Return whether a tick was late in the RECENT_TIME before `t` (s)."""
        return self._late_at is not None and t - self._late_at < RECENT_TIME

    def is_coarse(self, t):
        # type: (float) -> bool
        """Return whether ticks are too far apart for a joint to end exactly."""
        return self.period > COARSE_FACTOR * MIN_PERIOD or self.was_late(t)
