"""The encoder of an emulated EV3 motor, with the speed that the kernel's driver makes of it."""

import math
from collections import deque


class Encoder(object):
    """Edges of the shaft's encoder, with the driver's estimate of speed from their times."""

    EDGES_PER_COUNT = 2
    SPAN = 0.02
    IDLE = 0.05
    FEWEST, MOST = 4, 64

    def __init__(self, phase: float = 0.0) -> None:
        self.phase = phase
        self.edges = 0
        self.dead = False
        # It has stood still for as long as it takes to know that.
        self._times = deque((-k * self.IDLE, 0) for k in range(self.FEWEST, -1, -1))
        self.noted = 0.0
        self.speed = 0
        """Counts per second over the last 4 to 64 edges that span 20 ms; whole numbers."""

    def update(self, t: float, shaft: float) -> None:
        """Take in the shaft's angle (rad) at time `t`."""
        edges = math.floor((math.degrees(shaft) + self.phase) * self.EDGES_PER_COUNT)
        if edges != self.edges and not self.dead:
            step = 1 if edges > self.edges else -1
            for edge in range(self.edges + step, edges + step, step):
                self._note(t, edge)
            self.edges = edges
        elif t - self.noted >= self.IDLE:
            self.stand(t)

    def stand(self, t: float) -> None:
        """Take in that there was no edge for `IDLE` seconds since it was `noted`."""
        self._note(t, self.edges)

    def _note(self, t: float, edge: int) -> None:
        times = self._times
        times.append((t, edge))
        while len(times) > self.MOST + 1 or (
            len(times) > self.FEWEST + 1 and t - times[1][0] >= self.SPAN
        ):
            times.popleft()
        self.noted = t
        since, first = times[0]
        turned = (edge - first) / self.EDGES_PER_COUNT
        self.speed = int(turned / (t - since)) if t > since else 0
