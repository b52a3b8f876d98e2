"""Points taken by hand: when the arm stands still, and what points measure."""

import math

import numpy as np
import pytest

from robot.motion import kinematics
from robot.touching import StandstillDetector, angle_at, backlash_at, describe_points, midpoint
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
COUNT = math.radians(1)


def watched(readings, press=0.0):
    """What a watch says to readings every 0.1 s after a press."""
    watch = StandstillDetector([COUNT, COUNT])
    watch.press(press)
    return [watch.see(0.1 * k, angles) for k, angles in enumerate(readings)]


def test_a_point_is_the_mean_of_the_time_after_the_press():
    seen = watched([(0.1, 0.2), (0.11, 0.2), (0.1, 0.2), (0.11, 0.2)])
    assert seen[:3] == [None] * 3
    assert seen[3] == pytest.approx((0.105, 0.2))


def test_an_arm_that_moves_gives_no_point():
    assert watched([(0.1, 0.2), (0.1, 0.2 + 2 * COUNT)]) == [None, False]


def test_without_a_press_there_is_none_and_a_second_press_changes_nothing():
    watch = StandstillDetector([COUNT])
    assert watch.see(0.0, (0.1,)) is None
    watch.press(0.1)
    assert watch.see(0.1, (0.1,)) is None
    watch.press(0.3)
    assert watch.see(0.45, (0.1,)) == pytest.approx((0.1,))
    assert watch.see(0.9, (0.1,)) is None


@pytest.mark.parametrize(
    ("points", "degrees"),
    [
        (((1, 0), (0, 0), (0, 1)), 90),
        (((2, 0), (0, 0), (-3, 0)), 180),
        (((2, 0), (0, 0), (5, 0)), 0),
        (((1, 0), (0, 0), (math.sqrt(3) / 2, -0.5)), 30),
        (((0, 0), (0, 0), (0, 1)), None),
    ],
)
def test_the_angle_is_that_at_the_middle_one(points, degrees):
    angle = angle_at(*points)
    assert angle == (None if degrees is None else pytest.approx(math.radians(degrees)))


def test_the_angle_is_the_law_of_cosines():
    draw = np.random.default_rng(3)
    for a, b, c in draw.uniform(-20, 20, (50, 3, 2)):
        ab, bc, ca = (np.linalg.norm(x - y) for x, y in ((a, b), (b, c), (c, a)))
        cosine = (ab**2 + bc**2 - ca**2) / (2 * ab * bc)
        assert angle_at(tuple(a), tuple(b), tuple(c)) == pytest.approx(np.arccos(cosine))


def test_backlash_at_bounds_what_backlash_can_do():
    draw, worst = np.random.default_rng(4), 0.0
    for q in draw.uniform(-1, 1, (100, 2)):
        tip = np.array(kinematics.forward(ARM, tuple(q)))
        half = np.array([joint.backlash / 2 for joint in ARM.joints])
        off = np.array(kinematics.forward(ARM, tuple(q + half * draw.choice((-1, 1), 2)))) - tip
        worst = max(worst, np.linalg.norm(off) / backlash_at(ARM, q))
    assert 0.9 < worst < 1.01


def test_lines_fit_the_bricks_screen():
    lines = describe_points([(-10.126, 5.5), (-12.26, 8.76), (10.1, -3.2)], 0.43, 12)
    assert lines == [
        "point 12: 10.10,-3.20 cm",
        "to 0.4 cm (play)",
        "distance 25.36 cm",
        "angle 28.6 deg at 11",
        "middle -1.08,2.78 cm",
    ]
    assert describe_points([(1, -0.0)], 0.0, 1) == ["point 1: 1.00,0.00 cm"]
    assert describe_points([(1, 0), (1, 0), (1, 0)], 0.0, 3)[2] == "no angle: same place"
    assert midpoint((0, 4), (2, 8)) == (1, 6)
