"""How far a step may go, by how well the last one was predicted.  Pure."""

import math

FIRST_STEP, MIN_STEP, MAX_STEP = (math.radians(x) for x in (35, 3, 60))
"""Trust region: the greatest step of a joint, rad."""

GROW_BELOW, SHRINK_ABOVE, GROWTH, SHRINKAGE = 0.3, 0.6, 2.0, 0.5
"""Share of a step that was predicted wrongly, below and above which the region grows or shrinks, to
so many times the step."""


def next_region(region, step, wrong):
    """The greatest next step of a joint, rad.

    Args:
        region: the last one, rad.  step: what was made of it, rad.
        wrong: share of it that was predicted wrongly.
    """
    if wrong > SHRINK_ABOVE:
        return max(MIN_STEP, SHRINKAGE * step)
    if wrong < GROW_BELOW:
        return min(MAX_STEP, max(region, GROWTH * step))
    return region
