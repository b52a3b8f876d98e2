"""Crosses that an arm reaches well, and what is seen while the pen stands on one."""

import math

import numpy as np
import pytest

from laptop.measure.arm.arm_fit import BadIdentification
from laptop.measure.arm.touching import crosses_to_touch, touch_sight
from laptop.measure.run_data import Sights
from laptop.see.markers.board import CROSSES

BASE = (-12.5, 0.0)


def test_crosses_are_within_good_reach_and_apart():
    chosen = crosses_to_touch(BASE, (1.8, 20.8), 4)
    far = [math.dist(BASE, cross) for cross in chosen]
    assert len(chosen) == 4
    assert min(far) > 0.35 * 20.8
    assert max(far) < 0.88 * 20.8
    within = [c for c in CROSSES if 0.35 * 20.8 < math.dist(BASE, c) < 0.88 * 20.8]
    assert len(crosses_to_touch(BASE, (1.8, 20.8), 99)) == len(within)
    apart = min(math.dist(a, b) for a in chosen for b in chosen if a != b)
    assert apart >= min(math.dist(a, b) for a in within for b in within if (a != b).any())


def sights(*pixels):
    return Sights(np.arange(float(len(pixels))), np.array(pixels, float))


def test_the_median_of_what_is_seen_counts():
    seen = touch_sight((1.0, 2.0), sights(*[(100.0, 50.0)] * 5, (103.0, 50.0), (np.nan, np.nan)))
    assert seen.pixel == (100.0, 50.0)
    assert seen.cross == (1.0, 2.0)
    # RMS of (3, 0) and ten zeros, as the spread of a median of six.
    assert seen.sigma == pytest.approx(1.2533 * math.sqrt(9 / 12) / math.sqrt(6), rel=0.01)


@pytest.mark.parametrize(
    ("pixels", "told"),
    [
        ([(1.0, 1.0)] * 4 + [(np.nan, np.nan)] * 6, "seen in 4 pictures while the pen stood on"),
        ([(10.0 * k, 0.0) for k in range(6)], "the marker moved by 12 px while the pen stood"),
    ],
)
def test_a_marker_that_is_hardly_seen_or_moves_is_told(pixels, told):
    with pytest.raises(BadIdentification, match=told):
        touch_sight((1.0, 2.0), sights(*pixels))
