"""Test cards: their measures, and that the boundary of the reach is one."""

import math
import re

import numpy as np
import pytest

from laptop.drawing.artwork import SMOOTH_TURN, BadArtwork, stroke_length, turns
from laptop.drawing.test_patterns import MARGIN, TEST_PATTERNS, draw_test_pattern, reach_pattern
from shared.arm_description import find_arm, read_arm


def arm(name):
    return read_arm(find_arm(name))


@pytest.mark.parametrize("name", TEST_PATTERNS)
def test_a_card_lies_on_its_sheet(name):
    artwork = draw_test_pattern(name, 6.0)
    least, greatest = artwork.bounds()
    assert artwork.size == (6.0, 6.0)
    assert least.min() >= -1e-9
    assert greatest.max() <= 6 + 1e-9
    for stroke in artwork.strokes:
        if len(stroke) > 10:
            assert np.degrees(turns(stroke)).max() <= SMOOTH_TURN


def test_the_grid_has_lines_a_centimetre_apart_to_and_fro():
    lines = draw_test_pattern("grid", 8.0).strokes
    level = [line for line in lines if line[0, 1] == line[1, 1]]
    assert [line[0, 1] for line in level] == pytest.approx(range(9))
    assert [np.sign(line[1, 0] - line[0, 0]) for line in level] == [1, -1] * 4 + [1]
    assert len(lines) == 18
    assert len(draw_test_pattern("grid", 40.0).strokes) == 18


def test_all_lines_of_the_star_meet_in_its_middle():
    for line in draw_test_pattern("star", 8.0).strokes:
        assert line.mean(axis=0) == pytest.approx([4, 4])
        assert stroke_length(line) == pytest.approx(8)


def test_every_other_circle_goes_the_other_way_round():
    areas = []
    for ring in draw_test_pattern("circles", 8.0).strokes:
        x, y = ring.T
        areas.append((np.dot(x[:-1], y[1:]) - np.dot(y[:-1], x[1:])) / 2)
        assert ring[0].tolist() == ring[-1].tolist()
    wanted = [math.pi, -4 * math.pi, 9 * math.pi, -16 * math.pi]
    assert areas == pytest.approx(wanted, rel=2e-3)


def test_the_standards_square_is_a_tenth_of_the_diagonal_from_the_corners():
    square, one, other, large, small = draw_test_pattern("iso9283", 10.0).strokes
    for corner in square[:4]:
        near = min(np.hypot(*(corner - c)) for c in np.array([[0, 0], [0, 10], [10, 0], [10, 10]]))
        assert near == pytest.approx(0.1 * math.hypot(10, 10))
    assert [stroke_length(line) for line in (one, other)] == pytest.approx([8 * math.sqrt(2)] * 2)
    assert np.hypot(*(large - 5).T) == pytest.approx(4)
    assert np.hypot(*(small - 5).T) == pytest.approx(0.4)


def reached(description, points):
    """Which of points (n, 2) a planar arm reaches within its limits: by the cosine rule."""
    first, second = description.joints
    far, heading = np.hypot(*points.T), np.arctan2(*points.T[::-1])
    cosine = (far**2 - first.link**2 - second.link**2) / (2 * first.link * second.link)
    bend = np.arccos(np.clip(cosine, -1, 1))
    inside = np.arctan2(second.link * np.sin(bend), first.link + second.link * np.cos(bend))
    found = np.zeros(len(points), bool)
    for side in (1, -1):
        for turn in (-2 * math.pi, 0, 2 * math.pi):
            q1, q2 = heading - side * inside + turn, side * bend
            found |= (
                (first.lower <= q1) & (q1 <= first.upper)
                & (second.lower <= q2) & (q2 <= second.upper)
            )  # fmt: skip
    return found & (np.abs(cosine) <= 1)


@pytest.mark.parametrize("name", ["planar", "geared"])
def test_the_boundary_is_a_margin_away_from_where_the_reach_ends(name):
    description = arm(name)
    angles = np.linspace(0, 2 * math.pi, 180)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    for point in np.concatenate(reach_pattern(description).strokes):
        assert reached(description, point + 0.78 * MARGIN * around).all()
        assert not reached(description, point + 1.06 * MARGIN * around).all()


def test_the_boundary_goes_all_around():
    """From a grid of points that are reached, no way leads out but across it, or through a gap
    less wide than a margin.
    """
    description = arm("planar")
    step = MARGIN
    axis = np.arange(-24, 24, step)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    is_reached = reached(description, grid)
    drawn = np.concatenate(reach_pattern(description).strokes)
    near = np.array([np.hypot(*(drawn - p).T).min() < 2 * MARGIN for p in grid])
    inside, outside = (
        part.reshape(len(axis), -1) for part in (is_reached & ~near, ~is_reached & ~near)
    )
    for shift in ((0, 1), (1, 0)):
        moved = np.roll(outside, shift, (0, 1))
        assert not (inside & moved).any()
        assert not (np.roll(inside, shift, (0, 1)) & outside).any()
    assert inside.sum() * step**2 == pytest.approx(1000, rel=0.2)
    assert outside.any()


def test_the_boundary_in_space_is_where_the_ends_of_the_arm_touch_the_table():
    """By all poses of shoulder and elbow that bring the tip down to the table."""
    description = arm("spatial")
    radii = np.hypot(*np.concatenate(reach_pattern(description).strokes).T)
    base, shoulder, elbow = description.joints
    q1 = np.linspace(shoulder.lower, shoulder.upper, 601)[:, None]
    q2 = np.linspace(elbow.lower, elbow.upper, 601)[None, :]
    height = base.link + shoulder.link * np.sin(q1) + elbow.link * np.sin(q1 + q2)
    out = shoulder.link * np.cos(q1) + elbow.link * np.cos(q1 + q2)
    on_table = np.abs(out[np.abs(height) < 0.03])
    assert radii.max() == pytest.approx(on_table.max() - MARGIN, abs=0.2 * MARGIN)
    assert radii.min() == pytest.approx(on_table.min() + MARGIN, abs=0.2 * MARGIN)
    headings = np.arctan2(*np.concatenate(reach_pattern(description).strokes).T[::-1])
    assert headings.max() == pytest.approx(base.upper, abs=0.07)


def test_the_boundary_is_smooth_and_in_few_strokes():
    for name, count in (("planar", 4), ("spatial", 4)):
        artwork = draw_test_pattern("reach", arm=arm(name))
        assert len(artwork.strokes) == count
        for stroke in artwork.strokes:
            assert np.degrees(turns(stroke)).max() <= SMOOTH_TURN


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ("gird",),
            "gird: there is no such test card; there are grid, star, circles, iso9283, reach",
        ),
        (("grid", 0.0), "size = 0 cm: a test card's side must be from 1 to 100 cm"),
        (("grid", float("nan")), "size = nan cm"),
        (("reach",), "reach: is the boundary of an arm's reach; say of which arm"),
    ],
)
def test_a_card_that_is_none_is_refused(words, told):
    with pytest.raises(BadArtwork, match=f"^{re.escape(told)}"):
        draw_test_pattern(*words)


def test_a_margin_that_leaves_nothing_is_refused():
    with pytest.raises(BadArtwork, match="reaches nothing on the paper"):
        reach_pattern(arm("planar"), margin=30.0)
