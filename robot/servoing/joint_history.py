"""The joint angles of the last seconds: a picture is of the past.  Pure."""

import bisect

from robot.servoing.linear_algebra import distance

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Pose  # noqa: F401


class JointHistory(object):
    """The joint angles of the last seconds, by time.

    Args:
        seconds: how long they are kept, s.
    """

    def __init__(self, seconds=2.0):
        # type: (float) -> None
        self._seconds = seconds
        self._times, self._angles = [], []  # type: List[float], List[Tuple[float, ...]]

    def add(self, t, q):
        # type: (float, Pose) -> None
        """Add that the joints are at q (rad) at time t (s); times before the last are left out."""
        if self._times and t <= self._times[-1]:
            return
        self._times.append(t)
        self._angles.append(tuple(q))
        if t - self._times[0] > 1.5 * self._seconds:
            old = max(0, bisect.bisect(self._times, t - self._seconds) - 1)
            del self._times[:old]
            del self._angles[:old]

    def at(self, t):
        # type: (float) -> Optional[Tuple[float, ...]]
        """Return q at time t, rad (n), interpolated linearly; None before the first entry."""
        k = bisect.bisect(self._times, t)
        if k == 0:
            return None
        if k == len(self._times):
            return self._angles[-1]
        share = (t - self._times[k - 1]) / (self._times[k] - self._times[k - 1])
        return tuple(a + share * (b - a) for a, b in zip(self._angles[k - 1], self._angles[k]))

    def still_since(self, within):
        # type: (float) -> float
        """Return since when the joints have been within `within` (rad) of where they are now, s."""
        return self._since(lambda q: distance(q, self._angles[-1]) < within)

    def joint_still_since(self, joint, within):
        # type: (int, float) -> float
        """Return the same of one joint, by its index."""
        here = self._angles[-1][joint]
        return self._since(lambda q: abs(q[joint] - here) < within)

    def _since(self, is_here):
        # type: (Callable[[Pose], bool]) -> float
        """Return since when `is_here` has held, s."""
        k = len(self._times) - 1
        while k and is_here(self._angles[k - 1]):
            k -= 1
        return self._times[k]

    @property
    def last(self):
        # type: () -> Optional[Tuple[float, Tuple[float, ...]]]
        """Newest entry, (t, q), s and rad; None if there is none."""
        return (self._times[-1], self._angles[-1]) if self._times else None
