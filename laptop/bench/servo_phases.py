"""Phases of a run of the servoing bench: where its seconds go."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Any

from robot.servoing.linear_algebra import distance

PHASES = "first look", "exploring", "moving", "looking", "deciding"
"""Phases of a run: until something is measured first; joints turn, to explore or to get there;
from their rest to the next measurement; from there to the next motion or the verdict.  Who explores
while going does both in one motion, which counts as exploring."""

REST_RANGE = math.radians(0.2)
"""Distance of every joint from where it ends within which the arm rests, rad."""


def phases_of(
    decisions: Sequence[tuple[float, str, float]], record: Sequence[Any], began: float
) -> dict[str, float]:
    """Return where the seconds of a run went, by PHASES.

    Args:
        decisions: as ServoLoop has them.
        record: the brick's, of the true motion.
        began: when the run began, s.
    """
    seconds = dict.fromkeys(PHASES, 0.0)
    rested, kind = began, "first look"
    times = [sample.t for sample in record]
    for k, (t, action, computing) in enumerate(decisions):
        seconds["deciding"] += computing
        seconds[kind] += t - computing - rested
        if k + 1 == len(decisions):
            break
        kind = "looking"
        following = decisions[k + 1][0] - decisions[k + 1][2]
        poses = [s.q for s in record[bisect_left(times, t) : bisect_right(times, following)]]
        turning = [k for k, q in enumerate(poses) if distance(q, poses[-1]) > REST_RANGE]
        rested = times[bisect_left(times, t) + turning[-1]] if turning else t
        seconds["exploring" if action == "explore" else "moving"] += rested - t
    return seconds
