"""The encoder of an emulated EV3 motor, with the speed that the kernel's driver makes of it.

The encoder gives 720 edges a turn of the shaft, two for each count of 1 degree.  The driver takes

    speed = (edges now - edges then) / 2 / (t now - t then),  counts/s, towards zero,

over its latest edges: at least 4, at most 64, and as many as span 20 ms.  So few edges are averaged
when the motor is slow and many when it is fast, and each edge counts with its own time.  Counts
per tick would be the obvious estimate.  At 500 Hz one count more or less is 500 counts/s, half of
the large motor's full speed, and no regulator could work with that.  A shaft that stands gives no
edges; after 50 ms without one the driver enters its standstill as if it were an edge, so speed is 0
only 200 ms after the last.  Source: the speeds that ev3dev's driver was observed to report.
"""

import math

MYPY = False
if MYPY:
    from typing import List, Tuple  # noqa: F401

EDGES_PER_COUNT = 2
SPEED_WINDOW = 0.02
"""Time that the edges of an estimate have to span, s, if there are enough of them."""
STANDSTILL_TIME = 0.05
"""Time without an edge after which a standstill is entered, s."""
MIN_EDGES, MAX_EDGES = 4, 64
"""Fewest and most edges of an estimate."""


class Encoder(object):
    """Edges of the shaft's encoder, with the driver's estimate of speed from their times.

    Args:
        phase: angle of the shaft past an edge where it starts, deg, 0 to 0.5; of a finer encoder
            the same share of its step.
        fineness: counts per degree; those of an EV3 motor give 1.

    Attributes:
        edges: seen so far, positive forwards; two a count.
        dead: whether it counts no more.
        updated_at: time of the latest edge, or of the latest notice that there was none, s.
    """

    def __init__(self, phase: float = 0.0, fineness: int = 1) -> None:
        self.phase = phase
        self._fineness, self._most = fineness, MAX_EDGES * fineness + 1
        self.edges = 0
        self.dead = False
        # It has stood still for as long as it takes to know that.
        self._times = [(-k * STANDSTILL_TIME, 0) for k in range(MIN_EDGES, -1, -1)]  # type: List[Tuple[float, int]]
        self.updated_at = 0.0
        self.speed = 0
        """Counts per second over the last 4 to 64 edges that span 20 ms, a whole number."""

    def update(self, t: float, shaft: float) -> None:
        """Count the edges up to the shaft's angle (rad) at time `t`, s."""
        turned = math.degrees(shaft) * self._fineness
        edges = math.floor((turned + self.phase) * EDGES_PER_COUNT)
        if edges != self.edges and not self.dead:
            step = 1 if edges > self.edges else -1
            for edge in range(self.edges + step, edges + step, step):
                self._append(t, edge)
            self.edges = edges
        elif t - self.updated_at >= STANDSTILL_TIME:
            self.add_standstill(t)

    def add_standstill(self, t: float) -> None:
        """Enter that there was no edge for `STANDSTILL_TIME` s since `updated_at`."""
        self._append(t, self.edges)

    def _append(self, t: float, edge: int) -> None:
        times = self._times
        times.append((t, edge))
        while len(times) > self._most or (
            len(times) > MIN_EDGES + 1 and t - times[1][0] >= SPEED_WINDOW
        ):
            times.pop(0)
        self.updated_at = t
        since, first = times[0]
        turned = (edge - first) / EDGES_PER_COUNT
        self.speed = int(turned / (t - since)) if t > since else 0
