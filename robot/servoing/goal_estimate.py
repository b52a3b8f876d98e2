"""Where the goal is, and whether it moves.  Pure."""

import math

from robot.servoing.linear_algebra import dot, length, median


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
        self._velocity = (0.0, 0.0)
        self._seen = []
        self._strays = []  # the last sightings in a row that were elsewhere
        self._place = None
        self._refreshed_at = -math.inf

    @property
    def velocity(self):
        """px/s; zeros while it stands."""
        self._refresh()
        return self._velocity

    @property
    def moving(self):
        """Whether it moves, and is not only noisy."""
        return any(self.velocity)

    def add(self, t, g, confidence, s):
        """It was seen at g (px) at time t (s), the tip at s."""
        unclear = confidence < self.CLEAR and self._seen and not any(self._velocity)
        if unclear and length([a - b for a, b in zip(g, s)]) < self.HIDES:
            return
        self._seen.append((t, g))
        if self._has_jumped(t, g):
            self._seen, self._strays, self._refreshed_at = self._strays, [], -math.inf
        while t - self._seen[0][0] > self.WINDOW:
            del self._seen[0]

    def _has_jumped(self, t, g):
        """Whether the last sightings are all elsewhere, and near one another."""
        if self._place is None:
            return False
        t0, (x, y) = self._place
        u, v = self._velocity
        if math.hypot(g[0] - x - u * (t - t0), g[1] - y - v * (t - t0)) < self.JUMPS:
            if self._strays:
                self._strays = []
            return False
        self._strays.append((t, g))
        first = self._strays[0][1]
        if length([a - b for a, b in zip(g, first)]) > self.JUMPS / 2:
            self._strays = [(t, g)]
        return len(self._strays) == self.FEWEST

    def _refresh(self):
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
        velocity = (0.0,) * len(self._seen[0][1])
        if third >= self.FEWEST:
            t0, early = _middle(self._seen[:third])
            t1, late = _middle(self._seen[-third:])
            velocity = [(b - a) / (t1 - t0) for a, b in zip(early, late)]
        if length(velocity) < self.MOVES:
            self._velocity = (0.0,) * len(velocity)
            self._place = _middle(self._seen)
        else:
            self._fit(velocity)

    def _fit(self, velocity):
        """A line through the last sightings that lie near the one by medians."""
        since = self._seen[-1][0] - self.LATELY
        lately = [seen for seen in self._seen if seen[0] >= since]
        t0, place = _middle(lately)
        off = [
            length([x - y - v * (t - t0) for x, y, v in zip(g, place, velocity)]) for t, g in lately
        ]
        limit = max(3 * median(off), 3.0)
        kept = [seen for seen, far in zip(lately, off) if far <= limit]
        n = len(kept)
        t0 = sum(t for t, _ in kept) / n
        columns = list(zip(*(g for _, g in kept)))
        times = [t - t0 for t, _ in kept]
        spread = dot(times, times) or 1.0
        self._velocity = tuple(dot(times, column) / spread for column in columns)
        self._place = t0, [sum(c) / n for c in columns]

    @property
    def latest(self):
        """Where it was seen last, px; None if it never was."""
        return self._seen[-1][1] if self._seen else None

    def at(self, t):
        """Where it is at time t, px; None if it was never seen, or moves and was not lately."""
        self._refresh()
        if self._place is None:
            return None
        t0, place = self._place
        if not any(self._velocity):
            return tuple(place)
        if t - self._seen[-1][0] > self.LATELY_SEEN:
            return None
        return tuple([x + v * (t - t0) for x, v in zip(place, self._velocity)])


def _middle(seen):
    """Medians of the times and of the places of sightings."""
    return median([t for t, _ in seen]), [median(c) for c in zip(*(g for _, g in seen))]
