"""The criteria, by hand and by numpy."""

import numpy as np
import pytest

from laptop.measure.accuracy import criteria

CROSS = np.array([(1.1, 2.0), (0.9, 2.0), (1.0, 2.1), (1.0, 1.9)])
"""Four places, each 1 mm from (1, 2) cm."""


def test_accuracy_is_the_way_from_the_commanded_position_to_the_barycentre():
    assert criteria.pose_accuracy(CROSS, np.array([1.3, 2.4])) == pytest.approx(5.0)


def test_repeatability_is_the_mean_distance_and_three_deviations():
    assert criteria.pose_repeatability(CROSS) == pytest.approx(1.0), "all are equally far"
    line = np.array([(-0.3, 0.0), (0.0, 0.0), (0.3, 0.0)])
    # Distances 3, 0, 3 mm: their mean is 2, their deviation with n - 1 is sqrt(6 / 2).
    assert criteria.pose_repeatability(line) == pytest.approx(2.0 + 3 * np.sqrt(3.0))


def test_variation_is_the_greatest_distance_between_two_directions():
    means = np.array([(0.0, 0.0, 0.0), (0.3, 0.4, 0.0), (0.0, 0.0, 0.1)])
    assert criteria.direction_variation(means) == pytest.approx(np.sqrt(26.0))


def test_distances_are_told_by_how_far_they_are_off_and_how_they_spread():
    one, other = np.zeros((3, 2)), np.array([(10.1, 0.0), (10.2, 0.0), (10.3, 0.0)])
    ad, rd = criteria.distance_accuracy(one, other, 10.0)
    assert (ad, rd) == (pytest.approx(2.0), pytest.approx(3.0))
    shorter, _ = criteria.distance_accuracy(one, other, 11.0)
    assert shorter == pytest.approx(8.0), "a distance that is too short counts as well"


def test_of_a_path_the_worst_plane_counts():
    crossings = np.array([[[0.1], [0.1], [0.1]], [[-0.4], [-0.2], [0.0]]])
    assert criteria.path_accuracy(crossings) == pytest.approx(2.0)
    # Distances 2, 0, 2 mm from the barycentre.
    assert criteria.path_repeatability(crossings) == pytest.approx(4 / 3 + 3 * np.sqrt(4 / 3))


def test_many_at_once_are_what_each_is_alone():
    luck = np.random.default_rng(1)
    many = luck.standard_normal((4, 5, 7, 3))
    assert criteria.pose_repeatability(many)[2, 3] == pytest.approx(
        float(criteria.pose_repeatability(many[2, 3]))
    )
    assert criteria.pose_accuracy(many, np.zeros(3))[1, 0] == pytest.approx(
        10 * np.linalg.norm(many[1, 0].mean(axis=0))
    )


def test_without_noise_the_covariance_is_less_by_just_the_noise():
    luck = np.random.default_rng(2)
    values = luck.standard_normal((50, 3)) @ np.array([(2.0, 0, 0), (1.0, 1.0, 0), (0, 0.5, 1.5)])
    noise = np.array([(0.3, 0.1, 0.0), (0.1, 0.2, 0.0), (0.0, 0.0, 0.1)])
    found = criteria.without_noise(values, noise)
    assert np.cov(found.T) == pytest.approx(np.cov(values.T) - noise)
    assert found.mean(axis=0) == pytest.approx(values.mean(axis=0))


def test_where_there_is_more_noise_than_spread_nothing_is_left():
    luck = np.random.default_rng(3)
    values = luck.standard_normal((20, 2)) * (1.0, 0.01)
    found = criteria.without_noise(values, np.diag([0.25, 0.25]))
    assert found[:, 1].std() < 0.01 * values[:, 0].std()
    assert found[:, 0].var(ddof=1) == pytest.approx(values[:, 0].var(ddof=1) - 0.25, rel=0.01)


def test_values_without_spread_or_noise_stay_as_they_are():
    same = np.tile([1.0, 2.0], (5, 1))
    assert criteria.without_noise(same, np.zeros((2, 2))) == pytest.approx(same)
    assert criteria.without_noise(CROSS, np.zeros((2, 2))) == pytest.approx(CROSS)
