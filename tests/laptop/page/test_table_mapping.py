"""Where the table is in a picture, learned from the tip's moves; the truth is a camera's."""

import math

import cv2
import numpy as np
import pytest

from laptop.page.table_mapping import MIN_PLACES, MOVED_PLACES, TableMapping

# A camera that looks down askew: its matrix times the pose of the table before it.
K = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]])
R = cv2.Rodrigues(np.array([2.6, 0.3, -0.2]))[0]
T = np.array([-6.0, 5.0, 55.0])
REACH = 20.8


def truth(points):
    """Pixels of points (n, 2 or 3), cm."""
    points = np.asarray(points, float)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.full(len(points), 1.5)])
    seen = (points @ R.T + T) @ K.T
    return seen[:, :2] / seen[:, 2:]


def places(count, seed=1, height=None):
    """Places that an arm reaches, spread at random."""
    dice = np.random.default_rng(seed)
    radius, angle = dice.uniform(6, 20, count), dice.uniform(-1.2, 1.2, count)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    if height is not None:
        points = np.column_stack([points, dice.uniform(*height, count)])
    return points


def learn(mapping, points, noise=0.0, speed=10.0, pixels=None):
    dice = np.random.default_rng(7)
    pixels = truth(points) if pixels is None else pixels
    for point, pixel in zip(points, pixels + dice.normal(0, noise, pixels.shape), strict=True):
        mapping.add(point, tuple(pixel), speed)
    return mapping


@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.001), (0.5, 0.6)])
def test_moves_in_a_plane_tell_where_the_table_is(noise, most):
    view = learn(TableMapping(REACH), places(60), noise).view
    asked = places(200, seed=2)
    assert np.abs(view.to_picture(asked) - truth(asked)).max() < most
    assert np.abs(view.to_table(truth(asked)) - asked).max() < most / 10
    assert view.misfit == pytest.approx(10 * noise * math.sqrt(2) / 12.6, rel=0.4, abs=1e-4)
    step = np.array([0.01, 0])
    around = truth([(12.0, 0), (12.01, 0), (12.0, 0.01)])
    area = abs(np.linalg.det(around[1:] - around[0])) / step[0] ** 2
    assert view.px_per_cm(np.array([12.0, 0.0])) == pytest.approx(math.sqrt(area), rel=1e-2)


def test_the_paper_below_the_marker_is_seen_once_its_height_is_told():
    mapping = TableMapping(REACH)
    for point in places(60):
        mapping.add(point, tuple(truth([point])[0]), 10.0, (640, 480))
    asked = places(100, seed=2)
    assert not mapping.view.is_paper
    assert np.abs(mapping.view.to_picture(asked) - truth(asked)).max() < 0.01
    mapping.lay_paper(1.5)
    on_paper = truth(np.column_stack([asked, np.zeros(len(asked))]))
    assert np.hypot(*(on_paper - truth(asked)).T).min() > 3, "px: they are not the same"
    assert mapping.view.is_paper
    assert np.abs(mapping.view.to_picture(asked) - on_paper).max() < 0.5
    assert mapping.pen(truth(asked), np.zeros_like(asked)) == pytest.approx(asked, abs=1e-4)
    mapping.lay_paper(None)
    assert np.abs(mapping.view.to_picture(asked) - truth(asked)).max() < 0.01
    mapping.forget()
    mapping.lay_paper(1.5)
    assert mapping.view is None


@pytest.mark.parametrize("height", [0.0, 2.0])
def test_moves_in_space_tell_where_any_height_is(height):
    mapping = learn(TableMapping(REACH, height), places(80, height=(0, 12)), noise=0.3)
    asked = places(100, seed=2)
    wanted = truth(np.column_stack([asked, np.full(len(asked), height)]))
    assert np.abs(mapping.view.to_picture(asked) - wanted).max() < 1.5


def test_the_pen_is_beside_the_marker_that_is_seen():
    mapping = learn(TableMapping(REACH), places(60))
    asked = places(50, seed=2)
    shifts = np.random.default_rng(3).uniform(-0.7, 0.7, asked.shape)
    assert mapping.pen(truth(asked + shifts), shifts) == pytest.approx(asked, abs=1e-4)
    assert TableMapping(REACH).pen(truth(asked), shifts) is None


def test_in_space_the_pen_on_the_paper_is_below_the_marker_that_is_seen():
    mapping = learn(TableMapping(REACH), places(80, height=(0, 12)))
    asked = places(50, seed=2)
    pens = np.column_stack([asked, np.zeros(len(asked))])
    shifts = np.random.default_rng(3).uniform((-0.7, -0.7, 0.2), (0.7, 0.7, 1.5), pens.shape)
    assert mapping.pen(truth(pens + shifts), shifts) == pytest.approx(asked, abs=1e-3)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (places(MIN_PLACES - 1), "the tip was seen at 7 places so far"),
        (np.column_stack([np.linspace(6, 20, 15), np.zeros(15)]), "a small part of its reach"),
        (8 + np.indices((4, 4)).reshape(2, -1).T * 1.0, "a small part of its reach"),
        (np.column_stack([places(60), np.full(60, 3.0)]), "at one height so far"),
    ],
)
def test_what_tells_too_little_is_not_believed_and_it_says_why(points, words):
    mapping = learn(TableMapping(REACH), points, noise=0.2)
    assert mapping.view is None
    assert words in mapping.why


def test_a_few_wrong_places_do_no_harm():
    points = places(60)
    pixels = truth(points)
    pixels[::10] += (80, -50)
    view = learn(TableMapping(REACH), points, 0.3, pixels=pixels).view
    asked = places(100, seed=2)
    assert np.abs(view.to_picture(asked) - truth(asked)).max() < 1.0


def test_an_arm_whose_zero_is_wrong_is_told():
    points = places(60)
    seen = points.copy()
    seen[:, 1] += 3 * np.sin(points[:, 0])  # no camera makes that of a plane
    mapping = learn(TableMapping(REACH), points, pixels=truth(seen))
    assert mapping.view is None
    assert "with its zero found" in mapping.why


def test_a_tip_that_is_fast_or_not_a_number_tells_nothing():
    mapping = learn(TableMapping(REACH), places(60), speed=500.0)
    mapping.add((math.nan, 1.0), (3.0, 4.0), 1.0)
    assert mapping.places == 0


def test_of_one_place_the_slowest_is_kept():
    mapping = learn(TableMapping(REACH), places(60), noise=3.0, speed=100.0)
    loose = mapping.view.misfit
    learn(mapping, places(60), noise=0.1, speed=5.0)
    assert mapping.view.misfit < loose / 5
    tight = mapping.view.misfit
    learn(mapping, places(60), noise=3.0, speed=100.0)
    assert mapping.view.misfit == tight


def test_a_camera_that_was_moved_is_noticed_and_learned_anew():
    mapping = learn(TableMapping(REACH), places(60))
    moved = places(60, seed=5)
    learn(mapping, moved[: MOVED_PLACES - 1], pixels=truth(moved[: MOVED_PLACES - 1]) + 40)
    assert mapping.moved == 0
    learn(mapping, moved[MOVED_PLACES - 1 :], pixels=truth(moved[MOVED_PLACES - 1 :]) + 40)
    assert mapping.moved == 1
    asked = places(50, seed=2)
    assert np.abs(mapping.view.to_picture(asked) - truth(asked) - 40).max() < 0.01
