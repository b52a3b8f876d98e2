"""Where the goal is, and whether it moves.  Pure."""

import math

from robot.servoing.linear_algebra import dot, length, median

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Pixel  # noqa: F401

    _Sighting = Tuple[float, float, float]  # t, s; u and v, px


class GoalEstimate(object):
    """Where a goal marker is in one camera's image, also while the arm hides it."""

    WINDOW, LATELY, FEWEST = 1.0, 0.75, 3
    """The sightings of so long tell whether it moves, s, and those how fast; so many at the least
    of a third of it."""
    JUMPS = 20.0
    """So far from where it should be, FEWEST times in a row and near one another, it has been moved
    to another place, px."""
    MOVES = 6.0
    """A goal slower than this stands, px/s."""
    LATELY_SEEN = 0.3
    """For so long is it known where a goal is that moves, s."""
    HIDES, CLEAR = 50.0, 0.9
    """So near to the tip (px) a standing goal may be half hidden; believed only if so confident."""
    REFRESHED, STANDING = 0.1, 0.3
    """What was worked out from sightings is good for so long, of a goal that moves and of one that
    stands, s: to do so takes a third of a tick."""

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
        """px/s; zeros while it stands."""
        self._refresh()
        return self._velocity

    @property
    def moving(self):
        # type: () -> bool
        """Whether it moves, and is not only noisy."""
        return any(self.velocity)

    def add(self, t, g, confidence, s):
        # type: (float, Pixel, float, Pixel) -> None
        """It was seen at g (px) at time t (s), the tip at s."""
        unclear = confidence < self.CLEAR and self._seen and not any(self._velocity)
        if unclear and length([a - b for a, b in zip(g, s)]) < self.HIDES:
            return
        u, v = g
        self._seen.append((t, u, v))
        if self._has_jumped(t, u, v):
            self._seen, self._strays, self._refreshed_at = self._strays, [], -math.inf
        # A busy brick looks at few pictures: it takes as many, then, from somewhat longer ago.
        few = 3 * self.FEWEST
        while t - self._seen[0][0] > self.WINDOW * (1 if len(self._seen) > few else 2):
            del self._seen[0]

    def _has_jumped(self, t, u, v):
        # type: (float, float, float) -> bool
        """Whether the last sightings are all elsewhere, and near one another."""
        if self._place is None:
            return False
        t0, x, y = self._place
        ut, vt = self._velocity
        if math.hypot(u - x - ut * (t - t0), v - y - vt * (t - t0)) < self.JUMPS:
            if self._strays:
                self._strays = []
            return False
        self._strays.append((t, u, v))
        _, u0, v0 = self._strays[0]
        if math.hypot(u - u0, v - v0) > self.JUMPS / 2:
            self._strays = [(t, u, v)]
        return len(self._strays) == self.FEWEST

    def _refresh(self):
        # type: () -> None
        """Work out place and velocity anew, where it is time for that."""
        good = self.STANDING if not any(self._velocity) else self.REFRESHED
        if not self._seen:
            return
        last = self._seen[-1][0]
        if last - self._seen[0][0] < self.WINDOW / 2:
            good = 0.0
        if last - self._refreshed_at < good:
            return
        self._refreshed_at = last
        third = len(self._seen) // 3
        velocity = (0.0, 0.0)
        if third >= self.FEWEST:
            t0, u0, v0 = _middle(self._seen[:third])
            t1, u1, v1 = _middle(self._seen[-third:])
            velocity = (u1 - u0) / (t1 - t0), (v1 - v0) / (t1 - t0)
        if math.hypot(*velocity) < self.MOVES:
            self._velocity = (0.0, 0.0)
            self._place = _middle(self._seen)
        else:
            self._fit(*velocity)

    def _fit(self, ut, vt):
        # type: (float, float) -> None
        """A line through the last sightings that lie near the one by medians."""
        since = self._seen[-1][0] - self.LATELY
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
        """Where it was seen last, px; None if it never was."""
        return self._seen[-1][1:] if self._seen else None

    def at(self, t):
        # type: (float) -> Optional[Pixel]
        """Where it is at time t, px; None if it was never seen, or moves and was not lately."""
        self._refresh()
        if self._place is None:
            return None
        t0, u, v = self._place
        if not any(self._velocity):
            return u, v
        if t - self._seen[-1][0] > self.LATELY_SEEN:
            return None
        ut, vt = self._velocity
        return u + ut * (t - t0), v + vt * (t - t0)


def _middle(seen):
    # type: (Sequence[_Sighting]) -> _Sighting
    """Of sightings in order of time: the middle one's time, the medians of u and v."""
    times, us, vs = zip(*seen)
    half = len(times) // 2
    return (times[half] + times[~half]) / 2, median(us), median(vs)
