"""The pen is set on the board's crosses by hand: on which, and what a camera sees then."""

from __future__ import annotations

import math

import numpy as np

from laptop.measure.arm.arm_fit import BadIdentification, TouchSight
from laptop.measure.run_data import MEDIAN_NOISE, Sights
from laptop.see.markers.board import CROSSES

MAX_REACH_SHARE = 0.88
"""Share of its reach beyond which an arm's elbow's angle is badly determined."""
FOLDED = 0.35
MIN_CROSS_PICTURES = 5
"""Fewest pictures of the marker at a cross."""
MAX_MARKER_SPREAD = 4.0
"""Greatest root mean square of a marker that stands, px."""
MIN_SIGMA = 0.1
"""Least error of its middle, px (standard deviation)."""


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
        (far > least) & (far < MAX_REACH_SHARE * reach[1])
    )]  # fmt: skip
    chosen: list[tuple[float, float]] = []
    while left and len(chosen) < count:
        nearest = [min((math.dist(c, other) for other in chosen), default=0.0) for c in left]
        x, y = left.pop(int(np.argmax(nearest)))
        chosen.append((x, y))
    return chosen


def touch_sight(cross: tuple[float, float], sights: Sights, camera: str = "A") -> TouchSight:
    """Return what a camera saw while the pen stood on a cross.

    Raises:
        BadIdentification: the marker was hardly seen, or did not stand.
    """
    seen = sights.pixels[np.isfinite(sights.pixels).all(axis=1)]
    x, y = cross
    if len(seen) < MIN_CROSS_PICTURES:
        raise BadIdentification(
            f"the marker was seen in {len(seen)} pictures while the pen stood on the cross at "
            f"{x:g}, {y:g} cm, and {MIN_CROSS_PICTURES} are the least: take hands and arm out "
            "of its way"
        )
    middle = np.median(seen, axis=0)
    spread = float(np.sqrt(np.mean((seen - middle) ** 2)))
    if spread > MAX_MARKER_SPREAD:
        raise BadIdentification(
            f"the marker moved by {spread:.0f} px while the pen stood on the cross at {x:g}, "
            f"{y:g} cm: hold the arm still, and touch it again"
        )
    sigma = max(MEDIAN_NOISE * spread / math.sqrt(len(seen)), MIN_SIGMA)
    return TouchSight(cross, (float(middle[0]), float(middle[1])), sigma, camera)
