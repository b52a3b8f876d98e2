"""Pieces: corners kept, looks kept, no more points than are needed."""

import itertools
import math

import numpy as np
import pytest
from arms import PLANAR

from laptop.drawing import simplify
from laptop.drawing.artwork import turns
from laptop.record.figures.line_accuracy import distances
from robot.motion import kinematics, trajectory
from robot.motion.paths import MIN_CORNER_ANGLE

TOLERANCE = 0.01


def circle(radius, n, centre=(13.0, 0.0)):
    t = np.linspace(0, 2 * math.pi, n)
    return np.column_stack([np.cos(t), np.sin(t)]) * radius + centre


def drawn(pieces):
    """Where the tip goes, cm, as the arm's own planning has it."""
    out = []
    ways = [[tuple(p) for p in piece.tolist()] for piece in pieces]
    for motion in trajectory.plan(PLANAR, ways):
        times = np.linspace(0, motion.duration, int(motion.duration / 0.01) + 2)
        out += [kinematics.forward(PLANAR, motion.at(t)[0]) for t in times]
    return np.array(out)


def greatest_mm(points, pieces):
    points = np.vstack([points[:: max(1, len(points) // 400)], points[-1:]])
    ink = drawn(pieces)
    return 10 * max(distances(ink, points).max(), distances(points, ink).max())


def test_a_square_has_four_straight_pieces():
    square = np.array([(10.0, 0.0), (12, 0), (12, 2), (10, 2), (10, 0)])
    pieces = simplify.pieces(square, TOLERANCE)
    assert [piece.tolist() for piece in pieces] == [
        [a, b] for a, b in zip(square.tolist(), square.tolist()[1:], strict=False)
    ]


def test_points_on_a_straight_line_are_left_out():
    line = np.column_stack([np.linspace(8, 16, 500), np.linspace(0, 3, 500)])
    (piece,) = simplify.pieces(line, TOLERANCE)
    assert piece.tolist() == line[[0, -1]].tolist()


@pytest.mark.parametrize("radius", [0.3, 1.0, 4.0])
def test_a_dense_circle_stays_one_smooth_piece_with_few_points(radius):
    dense = circle(radius, 4001)
    (piece,) = simplify.pieces(dense, TOLERANCE)
    assert len(piece) < 62 + 2 * math.pi * radius / simplify.CURVE_STEP + 2
    assert turns(piece).max() < MIN_CORNER_ANGLE / 2
    assert greatest_mm(dense, [piece]) < 0.1


def test_a_corner_between_curves_is_kept_where_it_is():
    """Two half circles that meet in a cusp: a heart's upper edge."""
    t = np.linspace(math.pi, 0, 90)
    half = np.column_stack([np.cos(t), np.sin(t)])
    heart = np.vstack([half + (12, 1), half[1:] + (14, 1)])
    pieces = simplify.pieces(heart, TOLERANCE)
    assert len(pieces) == 2
    assert pieces[0][-1] == pytest.approx((13, 1))
    assert greatest_mm(heart, pieces) < 0.1


def test_a_straight_part_before_a_bend_stays_straight():
    t = np.linspace(-math.pi / 2, 0, 20)
    line = np.vstack([[(9.0, 0.0)], np.column_stack([15 + 0.4 * np.cos(t), 0.4 + 0.4 * np.sin(t)])])
    pieces = simplify.pieces(line, TOLERANCE)
    assert len(pieces) == 1
    assert greatest_mm(line, pieces) < 0.1


def test_jitter_within_the_tolerance_is_no_row_of_corners():
    x = np.linspace(9, 15, 1200)
    jitter = np.where(np.arange(1200) % 2, 0.002, -0.002)
    pieces = simplify.pieces(np.column_stack([x, jitter]), TOLERANCE)
    assert len(pieces) == 1
    steps = np.column_stack([x, np.round(jitter + (x - 9) / 3, 1)])  # stairs of 1 mm show
    assert len(simplify.pieces(steps, TOLERANCE)) > 20


@pytest.mark.parametrize("points", [
    [(10, 0), (10, 0)], [(10, 0), (10.001, 0)], [(10, 0), (10.005, 0.005), (10, 0)],
])  # fmt: skip
def test_what_is_shorter_than_the_pen_is_wide_is_a_dot(points):
    (piece,) = simplify.pieces(np.array(points, float), TOLERANCE)
    assert len(piece) == 2
    assert np.hypot(*(piece[1] - piece[0])) == pytest.approx(simplify.PEN_WIDTH)
    assert piece.mean(axis=0) == pytest.approx((10, 0), abs=0.01)


def test_there_and_back_is_drawn():
    pieces = simplify.pieces(np.array([(10.0, 0.0), (12.0, 0.0), (10.0, 0.0)]), TOLERANCE)
    assert [piece.tolist() for piece in pieces] == [[[10, 0], [12, 0]], [[12, 0], [10, 0]]]


@pytest.mark.parametrize("seed", range(12))
def test_whatever_comes_pieces_join_and_no_points_coincide(seed):
    dice = np.random.default_rng(seed)
    points = dice.normal(0, 1, (200, 2)).cumsum(axis=0) * dice.choice([1e-4, 0.01, 0.3])
    points[dice.integers(0, 199, 30)] = points[dice.integers(0, 199, 30)]
    points = np.repeat(points, dice.integers(1, 3, 200), axis=0)
    pieces = simplify.pieces(points, TOLERANCE)
    for a, b in zip(pieces, pieces[1:], strict=False):
        assert (a[-1] == b[0]).all()
    for piece in pieces:
        assert len(piece) >= 2
        assert np.hypot(*np.diff(piece, axis=0).T).min() > 1e-4


@pytest.mark.long
def test_a_drawing_of_50000_points_keeps_its_looks():
    """Curves, corners and noise as a tracer leaves them, 25 strokes of 2000 points."""
    dice = np.random.default_rng(3)
    t = np.linspace(0, 2 * math.pi, 2000)
    left, count = 0, 0
    for k in range(25):
        lobes = 2 + k % 5
        radius = 1.2 + np.cos(lobes * t) * (0.2 + 0.03 * k)
        curve = np.column_stack([np.cos(t), np.sin(t)]) * radius[:, None] + (13, 0)
        curve += dice.normal(0, 0.0005, curve.shape)
        pieces = simplify.pieces(curve, TOLERANCE)
        left, count = left + sum(map(len, pieces)), count + len(pieces)
        if k % 6 == 0:
            assert greatest_mm(curve, pieces) < 0.25
    assert left < 6000
    assert count < 120  # noise makes hardly a corner


@pytest.mark.parametrize("radius", [0.002, 0.004, 0.005, 0.006, 0.008, 0.012])
@pytest.mark.parametrize("count", [4, 9, 24, 60])
def test_a_ring_smaller_than_the_tolerance_is_a_dot_or_small_and_never_in_one_place(radius, count):
    angle = np.linspace(0, 2 * np.pi, count + 1)
    ring = np.column_stack([4 + radius * np.cos(angle), 8 + radius * np.sin(angle)])
    for points in (ring, np.vstack([ring[:1] + (0, 4e-5), ring])):
        found = simplify.pieces(points, 0.01)
        for piece in found:
            assert np.hypot(*np.diff(piece, axis=0).T).min() > 0
            assert np.hypot(*(piece - (4, 8)).T).max() < radius + 0.02
        for piece, after in itertools.pairwise(found):
            assert (piece[-1] == after[0]).all()
