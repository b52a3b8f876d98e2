"""A dragged path is what was meant: corners stay corners, and what trembles is smooth."""

import math

import numpy as np
import pytest

from laptop.page.drag_path import smooth_path


def dragged(*corners, step=9.0, noise=0.7):
    """What a hand makes of straight ways between these points."""
    dice = np.random.default_rng(3)
    points = [corners[0]]
    for start, end in zip(corners, corners[1:], strict=False):
        count = max(1, round(math.dist(start, end) / step))
        points += [np.add(start, np.subtract(end, start) * k / count) for k in range(1, count + 1)]
    return [tuple(point) for point in np.array(points) + dice.normal(0, noise, (len(points), 2))]


def turns(line):
    heading = np.unwrap(np.arctan2(*np.diff(line, axis=0).T[::-1]))
    return np.degrees(np.abs(np.diff(heading)))


def test_a_triangle_is_three_straight_lines_and_closed():
    corners = [(100, 100), (300, 120), (180, 260), (101, 102)]
    line = smooth_path(dragged(*corners))
    assert len(line) == 4
    assert np.abs(line[:3] - corners[:3]).max() < 4
    assert line[0] == pytest.approx(line[-1])


def test_a_circle_is_smooth_all_the_way():
    t = np.linspace(0, 2 * np.pi, 70)
    dice = np.random.default_rng(5)
    ring = np.column_stack([300 + 90 * np.cos(t), 200 + 90 * np.sin(t)])
    line = smooth_path([tuple(p) for p in ring + dice.normal(0, 0.5, ring.shape)])
    radius = np.hypot(*(line - (300, 200)).T)
    assert np.abs(radius - 90).max() < 2.5
    assert turns(line).max() < 12, "nowhere a corner, at which a pen would stop"


def test_a_way_of_two_points_is_a_line():
    assert smooth_path([(1.0, 2.0), (50.0, 70.0)]) == pytest.approx(
        np.array([(1.0, 2.0), (50.0, 70.0)])
    )
    assert len(smooth_path([(1.0, 2.0), (1.0, 2.0)])) == 1


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_dragged_the_ends_stay_and_nothing_is_far_off(seed):
    dice = np.random.default_rng(seed)
    path = np.cumsum(dice.normal(0, 12, (dice.integers(2, 120), 2)), axis=0) + 300
    line = smooth_path([tuple(p) for p in path])
    assert line[0] == pytest.approx(path[0])
    assert np.isfinite(line).all()
    nearest = np.hypot(*(line[:, None] - path[None]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() < 40
