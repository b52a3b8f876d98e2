"""Estimate of the goal's place in one camera's image, and of its velocity.  Pure."""

import math

from robot.servoing.linear_algebra import dot, length, median

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Pixel  # noqa: F401

    _Sighting = Tuple[float, float, float]  # t, s; u and v, px


class GoalEstimate(object):
    """Estimate of a goal marker's place in one camera's image, also while the arm hides it."""

    WINDOW, FIT_WINDOW, MIN_SIGHTINGS = 1.0, 0.75, 3
    """Age of the sightings that tell whether the goal moves, and of those that tell how fast, s;
    least number of sightings in a third of the window."""
    MIN_JUMP = 20.0
    """Least distance from the expected place, in MIN_SIGHTINGS sightings in a row near one
    another, of a goal that has been moved to another place, px."""
    MIN_SPEED = 6.0
    """Speed below which a goal stands, px/s."""
    MAX_EXTRAPOLATION = 0.3
    """Longest time for which a moving goal is extrapolated, s."""
    OCCLUSION_RADIUS, MIN_CONFIDENCE = 50.0, 0.9
    """Distance from the tip within which a standing goal may be half hidden, px; least confidence
    at which it is believed there."""
    MOVING_REFRESH_PERIOD, STANDING_REFRESH_PERIOD = 0.1, 0.3
    """Period of a new estimate of a goal that moves, and of one that stands, s: it takes a third
    of a tick."""

    def __init__(self):
        # type: () -> None
        self._velocity = (0.0, 0.0)
        self._seen = []  # type: List[_Sighting]  # (t, u, v)
        # The last sightings in a row that were elsewhere.
        self._strays = []  # type: List[_Sighting]
        self._place = None  # type: Optional[_Sighting]
        self._refreshed_at = -math.inf

    @property
    def velocity(self):
        # type: () -> Pixel
        """Velocity of the goal, px/s; zeros while it stands."""
        self._refresh()
        return self._velocity

    @property
    def moving(self):
        # type: () -> bool
        """Whether the goal moves, and is not only noisy."""
        return any(self.velocity)

    def add(self, t, g, confidence, s):
        # type: (float, Pixel, float, Pixel) -> None
        """Add a sighting of the goal.

        Args:
            t: s.
            g: u and v of the goal, px.
            confidence: 0 to 1.
            s: u and v of the tip, px.
        """
        unclear = confidence < self.MIN_CONFIDENCE and self._seen and not any(self._velocity)
        if unclear and length([a - b for a, b in zip(g, s)]) < self.OCCLUSION_RADIUS:
            return
        u, v = g
        self._seen.append((t, u, v))
        if self._has_jumped(t, u, v):
            self._seen, self._strays, self._refreshed_at = self._strays, [], -math.inf
        # A busy brick looks at few pictures: it takes as many, then, from somewhat longer ago.
        few = 3 * self.MIN_SIGHTINGS
        while t - self._seen[0][0] > self.WINDOW * (1 if len(self._seen) > few else 2):
            del self._seen[0]

    def _has_jumped(self, t, u, v):
        # type: (float, float, float) -> bool
        """Return whether the last sightings are all elsewhere, and near one another."""
        if self._place is None:
            return False
        t0, x, y = self._place
        ut, vt = self._velocity
        if math.hypot(u - x - ut * (t - t0), v - y - vt * (t - t0)) < self.MIN_JUMP:
            if self._strays:
                self._strays = []
            return False
        self._strays.append((t, u, v))
        _, u0, v0 = self._strays[0]
        if math.hypot(u - u0, v - v0) > self.MIN_JUMP / 2:
            self._strays = [(t, u, v)]
        return len(self._strays) == self.MIN_SIGHTINGS

    def _refresh(self):
        # type: () -> None
        """Estimate place and velocity anew, if that is due."""
        max_age = (
            self.STANDING_REFRESH_PERIOD if not any(self._velocity) else self.MOVING_REFRESH_PERIOD
        )
        if not self._seen:
            return
        last = self._seen[-1][0]
        if last - self._seen[0][0] < self.WINDOW / 2:
            max_age = 0.0
        if last - self._refreshed_at < max_age:
            return
        self._refreshed_at = last
        third = len(self._seen) // 3
        velocity = (0.0, 0.0)
        if third >= self.MIN_SIGHTINGS:
            t0, u0, v0 = _middle(self._seen[:third])
            t1, u1, v1 = _middle(self._seen[-third:])
            velocity = (u1 - u0) / (t1 - t0), (v1 - v0) / (t1 - t0)
        if math.hypot(*velocity) < self.MIN_SPEED:
            self._velocity = (0.0, 0.0)
            self._place = _middle(self._seen)
        else:
            self._fit(*velocity)

    def _fit(self, ut, vt):
        # type: (float, float) -> None
        """Fit a line through the last sightings that lie near the one by medians, (ut, vt) px/s."""
        since = self._seen[-1][0] - self.FIT_WINDOW
        lately = [seen for seen in self._seen if seen[0] >= since]
        t0, u0, v0 = _middle(lately)
        off = [math.hypot(u - u0 - ut * (t - t0), v - v0 - vt * (t - t0)) for t, u, v in lately]
        limit = max(3 * median(off), 3.0)
        times, us, vs = zip(*[seen for seen, far in zip(lately, off) if far <= limit])
        n = len(times)
        t0 = sum(times) / n
        late = [t - t0 for t in times]
        spread = dot(late, late) or 1.0
        self._velocity = dot(late, us) / spread, dot(late, vs) / spread
        self._place = t0, sum(us) / n, sum(vs) / n

    @property
    def latest(self):
        # type: () -> Optional[Pixel]
        """Place where it was seen last, px; None if it never was."""
        return self._seen[-1][1:] if self._seen else None

    def at(self, t):
        # type: (float) -> Optional[Pixel]
        """Return its place at time t, px; None if it was never seen, or moves and hides."""
        self._refresh()
        if self._place is None:
            return None
        t0, u, v = self._place
        if not any(self._velocity):
            return u, v
        if t - self._seen[-1][0] > self.MAX_EXTRAPOLATION:
            return None
        ut, vt = self._velocity
        return u + ut * (t - t0), v + vt * (t - t0)


def _middle(seen):
    # type: (Sequence[_Sighting]) -> _Sighting
    """Return (middle time, median of u, median of v) of sightings in order of time, s and px."""
    times, us, vs = zip(*seen)
    half = len(times) // 2
    return (times[half] + times[~half]) / 2, median(us), median(vs)
