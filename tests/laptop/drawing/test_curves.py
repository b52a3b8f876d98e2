"""Curves become points: against closed forms, and for random curves."""

import math

import numpy as np
import pytest

from laptop.drawing.artwork import SMOOTH_TURN, Artwork, BadArtwork, stroke_length, turns
from laptop.drawing.curves import (
    Bezier,
    Elliptic,
    Straight,
    curve_points,
    flatten,
    rounded,
    without_repeats,
)

TOLERANCE = 0.002
SLACK = 1e-6


def circle(radius):
    return Elliptic(np.zeros(2), np.array([radius, 0.0]), np.array([0.0, radius]), 0.0, 2 * math.pi)


@pytest.mark.parametrize("radius", [0.5, 5.0, 50.0])
def test_a_circle_has_its_length_and_stays_within_tolerance(radius):
    points = curve_points(circle(radius), TOLERANCE)
    sagitta = radius - np.hypot(*((points[1:] + points[:-1]) / 2).T)
    assert sagitta.max() <= TOLERANCE * 1.05
    assert np.degrees(turns(points)).max() <= SMOOTH_TURN + SLACK
    assert stroke_length(points) == pytest.approx(2 * math.pi * radius, rel=2e-3)
    assert points[0].tolist() == points[-1].tolist()


def test_what_is_apart_by_rounding_only_is_one_point():
    """Else the direction between the two is noise, and a corner where there is none."""
    near = np.nextafter(1.0, 2.0)
    pieces = [Straight(np.array([[0.0, 0], [1, 0]])), Straight(np.array([[near, 0], [1, 1]]))]
    assert flatten(pieces, TOLERANCE).tolist() == [[0, 0], [1, 0], [1, 1]]
    pieces.append(Straight(np.array([[0.0, 1e-16], [0, 0]])))
    assert flatten(pieces, TOLERANCE)[-1].tolist() == [0, 0]


def test_a_small_circle_has_no_more_points_than_its_turn_demands():
    points = curve_points(circle(0.1), TOLERANCE)
    assert 60 <= len(points) - 1 <= 80


def test_a_quadratic_curve_has_the_length_of_its_parabola():
    """y = x^2 from 0 to 1 is sqrt(5)/2 + asinh(2)/4 long."""
    points = curve_points(Bezier(np.array([[0, 0], [0.5, 0], [1, 1]])), 1e-5)
    assert stroke_length(points) == pytest.approx(math.sqrt(5) / 2 + math.asinh(2) / 4, abs=1e-4)
    assert np.abs(points[:, 1] - points[:, 0] ** 2).max() < 1e-12


def test_an_affine_map_moves_the_points_of_all_pieces():
    affine = np.array([[2.0, 0.5, 3.0], [-1.0, 0.7, -4.0]])
    t = np.linspace(0, 1, 7)
    rng = np.random.default_rng(1)
    arc = Elliptic(rng.normal(size=2), rng.normal(size=2), rng.normal(size=2), 0.3, 2.2)
    for curve in (arc, Bezier(rng.normal(size=(4, 2))), Bezier(rng.normal(size=(3, 2)))):
        wanted = curve.at(t) @ affine[:, :2].T + affine[:, 2]
        assert curve.mapped(affine).at(t) == pytest.approx(wanted)
    straight = Straight(rng.normal(size=(5, 2)))
    wanted = straight.points @ affine[:, :2].T + affine[:, 2]
    assert straight.mapped(affine).points == pytest.approx(wanted)


def test_random_curves_turn_by_little_but_where_they_are_too_tight_to_be_seen():
    rng = np.random.default_rng(7)
    for _ in range(150):
        curve = Bezier(rng.normal(size=(rng.choice([3, 4]), 2)) * 5)
        points = curve_points(curve, TOLERANCE)
        turn, chord = np.degrees(turns(points)), np.hypot(*np.diff(points, axis=0).T)
        seen = np.minimum(chord[1:], chord[:-1]) > TOLERANCE
        assert turn[seen].max() <= SMOOTH_TURN + SLACK
        assert len(points) < 200
        # No point of the curve is farther from the chords than told
        exact = curve.at(np.linspace(0, 1, 500))
        a, b = points[:-1], points[1:]
        along = np.clip(((exact[:, None] - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1), 0, 1)
        off = np.linalg.norm(exact[:, None] - a - along[..., None] * (b - a), axis=-1).min(1)
        assert off.max() <= 1.6 * TOLERANCE


def test_a_cusp_stays_a_corner():
    points = curve_points(Bezier(np.array([[0, 0], [10, 10], [0, 10], [10, 0.0]])), TOLERANCE)
    assert np.degrees(turns(points)).max() > 20


@pytest.mark.parametrize(
    "control", [[[1, 1]] * 4, [[0, 0], [0, 0], [3, 0], [3, 0]], [[0, 0], [1, 1], [2, 2]]]
)
def test_a_curve_that_is_none_is_a_line_or_a_point(control):
    points = without_repeats(curve_points(Bezier(np.array(control, float)), TOLERANCE))
    assert len(points) <= 2
    assert points[0] == pytest.approx(control[0])
    assert points[-1] == pytest.approx(control[-1])


def test_a_sparse_circle_is_rounded_to_a_circle():
    angles = np.linspace(0, 2 * math.pi, 17)
    sparse = np.column_stack([np.cos(angles), np.sin(angles)])
    sparse[-1] = sparse[0]
    points = rounded(sparse, math.radians(55), 1e-4)
    assert np.abs(np.hypot(*points.T) - 1).max() < 5e-4
    assert np.degrees(turns(points)).max() <= SMOOTH_TURN + SLACK


def test_corners_and_straight_lines_stay_so():
    square = np.array([[0.0, 0], [4, 0], [4, 4], [0, 4], [0, 0]])
    assert rounded(square, math.radians(55), 1e-3).tolist() == square.tolist()
    line = np.array([[0.0, 0], [10, 0], [11, 0.5], [11.5, 1.5]])  # long, then bent
    points = rounded(line, math.radians(55), 1e-3)
    straight = points[points[:, 0] < 10]
    assert np.abs(straight[:, 1]).max() < 1e-9


def test_an_artwork_knows_its_bounds_points_and_length():
    strokes = (np.array([[0.0, 0], [3, 4]]), np.array([[-1.0, 2], [-1, 5], [1, 5]]))
    artwork = Artwork("two", strokes, ("", ""))
    least, greatest = artwork.bounds()
    assert (least.tolist(), greatest.tolist()) == ([-1, 0], [3, 5])
    assert (artwork.points(), artwork.length()) == (5, 10)
    with pytest.raises(BadArtwork, match="empty: nothing is to be drawn"):
        Artwork("empty", (), ()).bounds()
