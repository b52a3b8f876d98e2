"""A tip that two cameras see teaches where in the second what is clicked in the first must be.

The oracle is where pinhole cameras truly see the place in space.
"""

import math

import numpy as np
import pytest

from laptop.see.markers.two_views import MIN_PAIRS, TwoViews

SIZE = 640, 480
LINE, PLACE, NOTHING = 2, 1, 0


class Pinhole:
    """60 cm from the middle of the workspace, tilt and azimuth in degrees."""

    def __init__(self, tilt, azimuth):
        t, a = math.radians(tilt), math.radians(azimuth)
        away = np.array([math.sin(a) * math.sin(t), -math.cos(a) * math.sin(t), math.cos(t)])
        right = np.array([math.cos(a), math.sin(a), 0.0])
        self.axes = np.array([right, np.cross(right, away), away])

    def __call__(self, place):
        right, down, along = self.axes @ (np.asarray(place) - (6.0, 0.0, 10.0))
        zoom = 450 / (60 - along)
        return 320 + zoom * right, 240 + zoom * down


ABOVE, SIDE = Pinhole(15, 0), Pinhole(80, 40)


def taught(places, noise=0.5, cameras=(ABOVE, SIDE), seed=1, false=0.0):
    rng, views = np.random.default_rng(seed), TwoViews()
    for place in places:
        one, other = (np.array(camera(place)) + rng.normal(0, noise, 2) for camera in cameras)
        if rng.random() < false:
            other = rng.uniform((0, 0), SIZE)
        views.add(tuple(one), tuple(other))
    return views


def in_space(count, seed=2):
    return np.random.default_rng(seed).uniform((-6, -8, 2), (16, 8, 18), (count, 3))


def in_plane(count, seed=2):
    return np.random.default_rng(seed).uniform((-6, -8, 3), (16, 8, 3), (count, 3))


def off_line(ends, place):
    (u0, v0), (u1, v1) = ends
    cross = (u1 - u0) * (place[1] - v0) - (v1 - v0) * (place[0] - u0)
    return abs(cross) / math.dist(*ends)


@pytest.mark.parametrize("false", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_clicked_in_one_picture_is_on_a_line_in_the_other(seed, false):
    views = taught(in_space(60, seed), false=false, seed=seed)
    for goal in in_space(10, 100 + seed):
        hint = views.where(ABOVE(goal), SIZE)
        assert len(hint) == LINE
        assert off_line(hint, SIDE(goal)) < 6
        assert all(0 <= u <= 639 and 0 <= v <= 479 for u, v in hint)


def test_a_tip_that_moved_in_a_plane_teaches_the_place_in_it():
    slanted = Pinhole(45, 60)
    views = taught(in_plane(40), cameras=(ABOVE, slanted))
    for goal in in_plane(10, 5):
        ((u, v),) = views.where(ABOVE(goal), SIZE)
        assert math.dist((u, v), slanted(goal)) < 3


def test_a_tip_that_moved_along_a_line_teaches_nothing():
    places = np.linspace((-6, -8, 2), (16, 8, 18), 60)
    assert taught(places).where(ABOVE(places[7]), SIZE) == ()


def test_too_few_positions_teach_nothing():
    views = taught(in_space(MIN_PAIRS - 1))
    assert views.where((320.0, 240.0), SIZE) == ()
    assert TwoViews().where((320.0, 240.0), SIZE) == ()


def test_positions_that_do_not_belong_together_teach_nothing():
    views = taught(in_space(60), false=0.9)
    assert views.where((320.0, 240.0), SIZE) == ()


def test_a_tip_that_stands_is_one_position():
    views = taught([(3.0, 2.0, 5.0)] * 500)
    assert len(views._pairs) == 1
