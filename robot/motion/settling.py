"""When a joint whose set-point stands has settled.  Pure."""

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

SETTLED_TIME = 0.028
"""A joint has settled that has been within its tolerance for so long, s."""

STANDSTILL_TIME = 0.2
"""One without a count for so long is held by friction, or blind, s."""

GRACE_TIME = 1.0
"""What has not arrived in time, but is on its way, is given so much more, s."""

ARRIVAL_TOLERANCES = 3
"""Farther off in the end than so many times the tolerance, a joint has not arrived."""


class SettlingDetector(object):
    """What is left to correct of one joint when its set-point stands.

    Args:
        longest: time for it, s.
        fine: rad within which it has settled.

    Attributes:
        begun: whether the set-point stands.
        over: whether nothing is left to correct, or nothing more can be.
    """

    def __init__(self, longest, fine):
        # type: (float, float) -> None
        self._longest = longest
        self._fine = fine
        self._seen_since = 0.0
        self.begin_again()

    def begin_again(self):
        # type: () -> None
        """The set-point moves."""
        self._near_since = self._seen = None  # type: Optional[float]
        self.begun = self.over = False

    def update(self, t, time_at_rest, seen, error):
        # type: (float, float, Optional[float], float) -> bool
        """Take in one tick; False if the joint has not arrived and will not.

        Args:
            t: s.
            time_at_rest: for how long the set-point has been standing, s.
            seen: what the encoder says.
            error: rad.
        """
        self.begun = True
        if self.over:
            return True
        if seen != self._seen:
            self._seen, self._seen_since = seen, t
        if not -self._fine < error < self._fine:
            self._near_since = None
        elif self._near_since is None:
            self._near_since = t
        near = self._near_since is not None and t - self._near_since >= SETTLED_TIME
        stands = t - self._seen_since >= STANDSTILL_TIME
        arrived = -ARRIVAL_TOLERANCES * self._fine <= error <= ARRIVAL_TOLERANCES * self._fine
        self.over = near or stands or (arrived and time_at_rest > self._longest)
        return arrived or not stands and time_at_rest <= self._longest + GRACE_TIME
