"""Detector of a joint that has settled at a set-point at rest.  Pure."""

MYPY = False
if MYPY:
    from typing import Optional  # noqa: F401

SETTLED_TIME = 0.028
"""Time within its tolerance after which a joint has settled, s."""

STANDSTILL_TIME = 0.2
"""Time without a count after which friction holds a joint, or its encoder is dead, s."""

GRACE_TIME = 1.0
"""Extra time of a joint that is late but still turns, s."""

ARRIVAL_TOLERANCES = 3
"""Maximum error of a joint that has arrived, as a multiple of its tolerance."""


class SettlingDetector(object):
    """The correction of one joint after its set-point has come to rest.

    Args:
        longest: maximum time of the correction, s.
        fine: tolerance within which it has settled, rad.

    Attributes:
        begun: whether the set-point stands.
        over: whether the correction is over: settled, or at its limit.
    """

    def __init__(self, longest, fine):
        # type: (float, float) -> None
        self._longest = longest
        self._fine = fine
        self._seen_since = 0.0
        self.begin_again()

    def begin_again(self):
        # type: () -> None
        """Reset: the set-point moves."""
        self._near_since = self._seen = None  # type: Optional[float]
        self.begun = self.over = False

    def update(self, t, time_at_rest, seen, error):
        # type: (float, float, Optional[float], float) -> bool
        """Update with a tick; return False if the joint has not arrived and will not.

        Args:
            t: s.
            time_at_rest: time since the set-point came to rest, s.
            seen: the encoder's lower bound of the angle, rad.
            error: set-point minus angle, rad.
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
