import math

import numpy as np
import pytest

from laptop.see.table.plane_motion import nearest_motion, rotation


def test_the_motion_of_points_is_found():
    points = np.random.default_rng(1).uniform(-10, 10, (12, 2))
    for turn in (0.0, 0.4, -2.9, math.pi / 2):
        goals = points @ rotation(turn, 2).T + (3.0, -4.0)
        found = nearest_motion(points, goals)
        assert found.turn == pytest.approx(turn)
        assert found.shift == pytest.approx((3.0, -4.0))


def test_of_points_that_do_not_fit_the_middle_does():
    points = np.random.default_rng(2).uniform(-10, 10, (30, 2))
    goals = points + np.random.default_rng(3).normal(0, 0.5, (30, 2))
    turn, shift = nearest_motion(points, goals)
    off = points @ rotation(turn, 2).T + shift - goals
    assert off.mean(axis=0) == pytest.approx((0, 0), abs=1e-12)
    for other in (turn - 0.01, turn + 0.01):
        moved = (points - points.mean(axis=0)) @ rotation(other, 2).T + goals.mean(axis=0)
        assert ((moved - goals) ** 2).sum() > (off**2).sum()


def test_a_mirrored_set_is_turned_and_never_mirrored():
    points = np.random.default_rng(4).uniform(-10, 10, (12, 2))
    turn, _ = nearest_motion(points * (1, -1), points)
    assert np.linalg.det(rotation(turn)) == pytest.approx(1.0)


def test_what_turns_leaves_heights():
    assert rotation(0.3, 3)[2].tolist() == [0, 0, 1]
