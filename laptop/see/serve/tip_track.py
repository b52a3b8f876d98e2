"""Recent places of a marker in one camera's picture, by time.  Pure."""

from __future__ import annotations

import math
from collections import deque

from laptop.see.serve.pipeline import Point


class TipTrack:
    """Recent places of the tip in one camera's picture, by time.

    Args:
        duration: s that are kept.
    """

    def __init__(self, duration: float = 3.0) -> None:
        self._duration = duration
        self._seen: deque[tuple[float, Point]] = deque()

    @property
    def last(self) -> float:
        """Time at which it was seen last, s."""
        return self._seen[-1][0] if self._seen else -math.inf

    def add(self, t: float, pixel: Point) -> None:
        """Add a sample of the tip at t (s), px."""
        if self._seen and t <= self._seen[-1][0]:
            return
        self._seen.append((t, pixel))
        while self._seen[0][0] < t - self._duration:
            self._seen.popleft()

    def at(self, t: float, gap: float = 0.2) -> tuple[Point, float] | None:
        """Return (pixel, speed px/s) of the tip at t (s); None where it was not seen about then.

        Args:
            t: s.
            gap: greatest time between the two frames about it, s.
        """
        before = None
        for t1, pixel in self._seen:
            if t1 >= t:
                if before is None or t1 - before[0] > gap:
                    return None
                t0, (u0, v0) = before
                share = (t - t0) / (t1 - t0)
                u1, v1 = pixel
                place = u0 + share * (u1 - u0), v0 + share * (v1 - v0)
                return place, math.hypot(u1 - u0, v1 - v0) / (t1 - t0)
            before = t1, pixel
        return None
