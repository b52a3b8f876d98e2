"""The path of the tip with the pen down, as a camera sees it while a job is drawn."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from laptop.page.drawing_snapshots import InkPoint, Lines
from laptop.see.serve.pipeline import Point

POINT_SPACING = 1.5
"""Least distance between two points of the ink, px."""
MAX_POINTS = 6000
"""An ink of more points is thinned to half of them."""
MAX_GAP = 0.5
"""A tip that was not seen for so long leaves a gap, s."""
SHIFT_TIMEOUT = 2.0
"""Longest wait for the vector from the pen to the marker, s; then there is a gap."""

Shift = Callable[[float], Sequence[float] | None]
"""Function from a time, s, to the vector from the pen to the marker then, cm; None: that is not
known (yet)."""


class InkTrack:
    """The ink of one job in one camera's picture.

    The brick reports the pen later than the camera sees the tip, so samples wait until it is
    known.  While the pen goes down or up the tip stands.

    Args:
        shift: how the marker that is seen is beside the pen.

    Attributes:
        version: rises when points are taken away, so that whoever has some begins anew.
        points: of the marker while the pen drew, so far.
        shifts: of each the way from the pen to the marker, cm.
    """

    def __init__(self, shift: Shift = lambda t: (0.0, 0.0)) -> None:
        self.version = 0
        self._shift = shift
        self.begin()

    def begin(self) -> None:
        """Forget all: another job begins."""
        self.version += 1
        self.points: list[InkPoint] = []
        self.shifts: list[Sequence[float]] = []
        self._seen: deque[tuple[float, Point]] = deque(maxlen=600)  # unresolved
        self._spacing = POINT_SPACING
        self._changes: deque[tuple[float, bool]] = deque([(-math.inf, False)], maxlen=64)
        self._pen_known_until = -math.inf  # s, time of the brick's last report
        self._last: tuple[float, Point] | None = None

    def add_tip(self, t: float, pixel: Point) -> None:
        """Add a sample of the tip at t (s), px."""
        if not self._seen or t > self._seen[-1][0]:
            self._seen.append((t, pixel))

    def set_pen(self, t: float, down: bool) -> None:
        """Set whether the pen was down at t (s), and resolve the samples up to then."""
        if t <= self._pen_known_until:
            return
        self._pen_known_until = t
        if down != self._changes[-1][1]:
            self._changes.append((t, down))
        self.resolve(t)

    def resolve(self, now: float) -> None:
        """Resolve waiting samples at a time (s) up to which the pen's state is known."""
        while self._seen and self._seen[0][0] <= self._pen_known_until:
            seen, pixel = self._seen[0]
            down = self._was_down(seen)
            shift = self._shift(seen) if down else None
            if down and shift is None and now - seen < SHIFT_TIMEOUT:
                return
            self._seen.popleft()
            if shift is None:
                self._last = None
            else:
                self._add(seen, pixel, shift)

    def _was_down(self, t: float) -> bool:
        return next((down for since, down in reversed(self._changes) if since <= t), False)

    def _add(self, t: float, pixel: Point, shift: Sequence[float]) -> None:
        begins = self._last is None or t - self._last[0] > MAX_GAP
        if self._last and not begins and math.dist(self._last[1], pixel) < self._spacing:
            self._last = t, self._last[1]
            return
        self._last = t, pixel
        self.points.append(InkPoint(*pixel, begins))
        self.shifts.append(shift)
        if len(self.points) > MAX_POINTS:
            indices = [k for k, p in enumerate(self.points) if k % 2 == 0 or p.begins]
            self.points = [self.points[k] for k in indices]
            self.shifts = [self.shifts[k] for k in indices]
            self._spacing *= 2
            self.version += 1

    def lines(self, pen: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Lines:
        """Return the ink as lines of points (n, 2), cm.

        Args:
            pen: from the marker's pixels (n, 2) and shifts (n, 2 or 3) to the pen's places (n, 2).
        """
        if not self.points:
            return ()
        places = pen(np.array([(p.u, p.v) for p in self.points]), np.array(self.shifts))
        begins = [k for k, point in enumerate(self.points) if point.begins and k]
        return tuple(np.split(places, begins))
