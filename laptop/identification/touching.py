"""Which of the board's crosses the pen is to be set on."""

from __future__ import annotations

import math

import numpy as np

from laptop.vision.board import CROSSES

STRETCHED = 0.88
"""Share of its reach beyond which an arm's elbow tells its angle badly."""
FOLDED = 0.35


def crosses_to_touch(
    base: tuple[float, float], reach: tuple[float, float], count: int
) -> list[tuple[float, float]]:
    """Return crosses within an arm's good reach, as far apart as they can be, (x, y), cm.

    Args:
        base: where the arm stands on the board, cm.
        reach: least and greatest distance of the tip, cm.
        count: of crosses at the most.
    """
    far = np.linalg.norm(CROSSES - np.array(base), axis=1)
    least = max(reach[0] * 1.1, FOLDED * reach[1])
    left = [tuple(map(float, CROSSES[k])) for k in np.flatnonzero(
        (far > least) & (far < STRETCHED * reach[1])
    )]  # fmt: skip
    chosen: list[tuple[float, float]] = []
    while left and len(chosen) < count:
        nearest = [min((math.dist(c, other) for other in chosen), default=0.0) for c in left]
        chosen.append(left.pop(int(np.argmax(nearest))))
    return chosen
