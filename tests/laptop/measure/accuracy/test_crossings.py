"""Planes across a path, and where runs cross them."""

import math

import numpy as np
import pytest

from laptop.measure.accuracy.crossings import (
    MAX_SLOPE,
    CirclePath,
    StraightPath,
    crossings,
    stations,
)

LINE = StraightPath(np.array([1.0, 1.0]), np.array([4.0, 5.0]))
CIRCLE = CirclePath(np.array([10.0, 2.0]), 3.0, np.array([1.0, 0.0]), np.array([0.0, 1.0]))


def test_planes_lie_evenly_half_a_spacing_from_the_ends():
    assert stations(LINE, 5) == pytest.approx([0.5, 1.5, 2.5, 3.5, 4.5])


def test_a_run_beside_a_line_crosses_all_planes_at_that_distance():
    motion, left = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    s = np.linspace(0, 5, 23)[:, None]
    found = crossings(LINE, 5, LINE.start + s * motion + 0.2 * left)
    assert found.values == pytest.approx(np.full((5, 1), 0.2))


def test_what_happens_along_a_line_does_not_count():
    s = np.array([0.0, 0.1, 0.1, 2.0, 2.1, 3.0, 3.1, 4.4, 5.0])[:, None]
    found = crossings(LINE, 5, LINE.start + s * np.array([0.6, 0.8]))
    assert np.nanmax(np.abs(found.values)) < 1e-12


def test_a_circle_that_is_too_large_is_too_large_everywhere_wherever_it_begins_and_ends():
    for begin in (-0.05, 0.0, 0.05):  # before the start, at it, behind it
        angles = begin + np.linspace(0, 2 * math.pi, 60)
        points = CIRCLE.centre + 3.1 * np.column_stack([np.cos(angles), np.sin(angles)])
        found = crossings(CIRCLE, 36, points)
        assert found.values == pytest.approx(np.full((36, 1), 0.1), abs=1e-9), begin


def test_a_bump_is_found_at_its_place_on_the_circle():
    angles = np.linspace(0, 2 * math.pi, 400)
    radius = 3.0 + 0.3 * np.exp(-(((angles - math.pi / 2) / 0.2) ** 2))
    points = CIRCLE.centre + radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    values = crossings(CIRCLE, 36, points).values[:, 0]
    assert abs(stations(CIRCLE, 36)[values.argmax()] - 3.0 * math.pi / 2) < 0.27


def test_in_space_both_directions_across_count():
    line = StraightPath(np.array([1.0, 0.0, 5.0]), np.array([5.0, 0.0, 5.0]))
    points = np.column_stack([np.linspace(1, 5, 9), np.full(9, 0.3), np.full(9, 5.4)])
    values = crossings(line, 4, points).values
    assert np.abs(values) == pytest.approx(np.tile([0.3, 0.4], (4, 1)))
    u, v = np.array([1.0, 0, 1.0]) / math.sqrt(2), np.array([0.0, 1.0, 0.0])
    circle = CirclePath(np.array([9.0, 0.0, 9.0]), 2.0, u, v)
    values = crossings(circle, 12, circle.points() + 0.1 * np.cross(u, v)).values
    assert values == pytest.approx(np.tile([0.0, 0.1], (12, 1)), abs=1e-6)


def test_planes_around_which_nothing_was_seen_have_no_value():
    s = np.concatenate([np.linspace(0, 1, 9), np.linspace(4, 5, 9)])[:, None]
    points = LINE.start + s * np.array([0.6, 0.8])
    values = crossings(LINE, 5, points).values[:, 0]
    assert np.isfinite(values).tolist() == [True, False, False, False, True]
    points[3] = np.nan
    assert np.isfinite(crossings(LINE, 5, points).values[0, 0])
    assert np.isnan(crossings(LINE, 5, points[:1]).values).all()
    assert np.isnan(crossings(LINE, 5, np.full((9, 2), np.nan)).values).all()


def test_noise_of_a_crossing_is_that_of_the_sights_by_their_shares():
    s = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])[:, None]
    points = LINE.start + s * np.array([0.6, 0.8])
    left = np.array([-0.8, 0.6])
    noise = np.tile(0.04 * np.outer(left, left) + 9.0 * np.outer((0.6, 0.8), (0.6, 0.8)), (6, 1, 1))
    common = np.tile(left[:, None] * 0.5, (6, 1, 1))
    found = crossings(LINE, 5, points, noise, common)
    # Half way between four sights a cubic has -1/16, 9/16, 9/16, -1/16 of them.
    shares = np.array([-1, 9, 9, -1]) / 16
    assert found.noise[1:4, 0, 0] == pytest.approx(np.full(3, 0.04 * (shares**2).sum()))
    assert found.common[:, 0, 0] == pytest.approx(np.full(5, 0.5)), "shares sum up to 1"


def test_who_errs_along_a_path_that_the_tip_leaves_errs_across_it():
    s = np.linspace(0.0, 5.0, 11)[:, None]
    motion, left = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    noise = np.tile(0.01 * np.outer(motion, motion), (11, 1, 1))
    for steepness, reckoned in ((0.5, 0.5), (-2.0, 2.0), (50.0, MAX_SLOPE)):
        points = LINE.start + s * motion + (s - 2.5) * steepness * left
        found = crossings(LINE, 5, points, noise)
        shares = found.noise[1:4, 0, 0] / 0.01 / reckoned**2
        assert ((shares > 0.5) & (shares < 1.001)).all(), steepness


def test_between_two_pictures_a_swinging_tip_is_followed_and_not_cut_short():
    """At 30 pictures a second 4 Hz are 0.84 rad a picture: a chord misses 1 - cos(0.42) of it."""
    t = np.arange(0.0, 5.0, 1 / 30)
    swing = 0.1 * np.sin(2 * math.pi * 4 * t)[:, None] * np.array([-0.8, 0.6])
    points = LINE.start + t[:, None] * np.array([0.6, 0.8]) + swing
    found = crossings(LINE, 40, points).values[:, 0]
    true = 0.1 * np.sin(2 * math.pi * 4 * stations(LINE, 40))
    assert np.abs(found - true).max() < 0.003
    chord = np.interp(stations(LINE, 40), t, swing @ np.array([-0.8, 0.6]))
    assert np.abs(chord - true).max() > 0.008


def test_a_sight_far_ahead_is_no_crossing_of_the_planes_before_it():
    s = np.linspace(0.0, 5.0, 51)
    points = LINE.start + s[:, None] * np.array([0.6, 0.8])
    points[8] = LINE.end + np.array([-0.8, 0.6])
    found = crossings(LINE, 5, points).values[1:, 0]
    assert found == pytest.approx(np.zeros(4), abs=1e-9)


def test_a_run_that_is_first_seen_just_behind_a_plane_has_crossed_it_there():
    left = np.array([-0.8, 0.6])
    for begin, end, missed in ((0.9, 4.2, []), (1.2, 3.8, [0, 4])):
        s = np.linspace(begin, end, 12)[:, None]
        points = LINE.start + s * np.array([0.6, 0.8]) + 0.2 * left
        values = crossings(LINE, 5, points).values[:, 0]
        assert np.flatnonzero(np.isnan(values)).tolist() == missed
        assert np.nanmax(np.abs(values - 0.2)) < 1e-9
