"""The way of the tip with the pen down, as cameras see it while a job is drawn."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from laptop.page.drawing_snapshots import InkPoint, Lines
from laptop.page.table_mapping import TableView
from laptop.tracking.pipeline import Point

SPACING = 1.5
"""Least distance between two points of the ink, px."""
MAX_POINTS = 6000
"""An ink of more points is thinned to half of them."""
MAX_GAP = 0.5
"""A tip that was not seen for so long leaves a gap, s."""


class InkTrack:
    """The ink of one job in one camera's picture.

    When the pen was down is told by the brick, later than the camera sees the tip: so places wait
    until it is known of them.  While the pen goes down or up the tip stands.

    Attributes:
        version: rises when points are taken away, so that whoever has some begins anew.
        points: of the ink so far.
    """

    def __init__(self) -> None:
        self.version = 0
        self.begin()

    def begin(self) -> None:
        """Forget all: another job begins."""
        self.version += 1
        self.points: list[InkPoint] = []
        self._seen: deque[tuple[float, Point]] = deque(maxlen=600)  # and not judged yet
        self._spacing = SPACING
        self._changes: deque[tuple[float, bool]] = deque([(-math.inf, False)], maxlen=64)
        self._told = -math.inf  # s, of the last word of the brick
        self._last: tuple[float, Point] | None = None

    def see(self, t: float, pixel: Point) -> None:
        """Take in where the tip was at t (s), px."""
        if not self._seen or t > self._seen[-1][0]:
            self._seen.append((t, pixel))

    def tell(self, t: float, down: bool) -> None:
        """Take in whether the pen was down at t (s), and judge what was seen by then."""
        if t <= self._told:
            return
        self._told = t
        if down != self._changes[-1][1]:
            self._changes.append((t, down))
        while self._seen and self._seen[0][0] <= t:
            seen, pixel = self._seen.popleft()
            if self._was_down(seen):
                self._add(seen, pixel)
            else:
                self._last = None

    def _was_down(self, t: float) -> bool:
        return next((down for since, down in reversed(self._changes) if since <= t), False)

    def _add(self, t: float, pixel: Point) -> None:
        begins = self._last is None or t - self._last[0] > MAX_GAP
        if self._last and not begins and math.dist(self._last[1], pixel) < self._spacing:
            self._last = t, self._last[1]
            return
        self._last = t, pixel
        self.points.append(InkPoint(*pixel, begins))
        if len(self.points) > MAX_POINTS:
            kept = [p for k, p in enumerate(self.points) if k % 2 == 0 or p.begins]
            self.points, self._spacing = kept, 2 * self._spacing
            self.version += 1

    def on_table(self, view: TableView) -> Lines:
        """Return the ink as lines of points (n, 2), cm."""
        lines: list[list[tuple[float, float]]] = []
        for point in self.points:
            if point.begins or not lines:
                lines.append([])
            lines[-1].append((point.u, point.v))
        return tuple(view.to_table(np.array(line)) for line in lines)
