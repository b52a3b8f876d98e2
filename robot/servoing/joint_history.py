"""Where the joints were: a image is of the past.  Pure."""

import bisect

from robot.servoing.linear_algebra import apart

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, List, Optional, Tuple  # noqa: F401

    from robot.servoing.image_model import Pose  # noqa: F401


class JointHistory(object):
    """Where the joints were: a image is of the past.

    Args:
        seconds: how long it is kept.
    """

    def __init__(self, seconds=2.0):
        # type: (float) -> None
        self._seconds = seconds
        self._times, self._angles = [], []  # type: List[float], List[Tuple[float, ...]]

    def add(self, t, q):
        # type: (float, Pose) -> None
        """The joints are at q (rad) at time t (s); earlier times than the last are left out."""
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
        """q at time t, rad, between the neighbours in time; None before the first."""
        k = bisect.bisect(self._times, t)
        if k == 0:
            return None
        if k == len(self._times):
            return self._angles[-1]
        share = (t - self._times[k - 1]) / (self._times[k] - self._times[k - 1])
        return tuple(a + share * (b - a) for a, b in zip(self._angles[k - 1], self._angles[k]))

    def still_since(self, within):
        # type: (float) -> float
        """Since when the joints have been within so much (rad) of where they are now, s."""
        return self._since(lambda q: apart(q, self._angles[-1]) < within)

    def joint_still_since(self, joint, within):
        # type: (int, float) -> float
        """Since when that one, by its index, has been within so much (rad) of where it is now."""
        here = self._angles[-1][joint]
        return self._since(lambda q: abs(q[joint] - here) < within)

    def _since(self, is_here):
        # type: (Callable[[Pose], bool]) -> float
        k = len(self._times) - 1
        while k and is_here(self._angles[k - 1]):
            k -= 1
        return self._times[k]

    @property
    def last(self):
        # type: () -> Optional[Tuple[float, Tuple[float, ...]]]
        """(t, q) of the newest entry, or None."""
        return (self._times[-1], self._angles[-1]) if self._times else None
