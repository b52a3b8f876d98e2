"""Where the paper is, by a board on it and the tip's moves; the truth is a camera's."""

import math

import cv2
import numpy as np
import pytest

from laptop.page.board_mapping import BoardMapping

SIZE = 640, 480
K = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]])
R = cv2.Rodrigues(np.array([2.6, 0.3, -0.2]))[0]
T = np.array([-6.0, 5.0, 55.0])
HEIGHT = 3.0
"""Of the tip's marker, cm."""
ANGLE, SHIFT = 0.7, np.array([4.0, -7.0])
"""How the arm stands on the board."""
TURN = np.array([[np.cos(ANGLE), -np.sin(ANGLE)], [np.sin(ANGLE), np.cos(ANGLE)]])


def project(board, height):
    """Pixels (n, 2) of points of the board (n, 2), cm, at a height."""
    points = np.column_stack([board, np.full(len(board), height)])
    seen = (points @ R.T + T) @ K.T
    return seen[:, :2] / seen[:, 2:]


def place_at(pixel, height):
    """What a calibrated camera says, exactly."""
    matrix = K @ np.column_stack([R[:, :2], (R[:, 2] * height + T)])
    x, y, w = np.linalg.solve(matrix, (*pixel, 1.0))
    return x / w, y / w


def to_board(arm):
    return (arm - SHIFT) @ TURN


def learn(places, noise=0.0, height=HEIGHT, place_at=place_at, reported=HEIGHT):
    mapping = BoardMapping(place_at)
    mapping.lay_paper(reported)
    pixels = project(to_board(places), height)
    pixels += np.random.default_rng(1).normal(0, noise, pixels.shape)
    for p, pixel in zip(places, pixels, strict=True):
        mapping.add(p, tuple(pixel), 1.0, SIZE)
    return mapping


PLACES = np.random.default_rng(2).uniform((8, -8), (18, 8), (12, 2))


@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.01), (0.4, 1.0)])
def test_the_paper_is_seen_where_it_is_though_the_marker_rides_above_it(noise, most):
    view = learn(PLACES, noise).view
    asked = np.random.default_rng(3).uniform((5, -10), (18, 10), (100, 2))
    wanted = project(to_board(asked), 0.0)
    assert np.hypot(*(view.to_picture(asked) - wanted).T).max() < most
    above = project(to_board(asked), HEIGHT)
    assert np.hypot(*(above - wanted).T).min() > 5, "px: what the marker alone would tell is off"
    assert view.source == "the board on the table"
    assert view.misfit < 1.0


@pytest.mark.parametrize("seed", range(5))
def test_a_height_that_nobody_told_is_found_and_how_sure_it_is(seed):
    places = np.random.default_rng(seed).uniform((8, -8), (18, 8), (40, 2))
    mapping = learn(places, 0.4, reported=None)
    assert abs(mapping.height - HEIGHT) < 3 * mapping.height_sigma
    assert 0.05 < mapping.height_sigma < 0.5
    asked = np.random.default_rng(3).uniform((8, -8), (18, 8), (100, 2))
    wanted = project(to_board(asked), 0.0)
    off = np.hypot(*(mapping.view.to_picture(asked) - wanted).T)
    assert off.max() < 3.0, "px"
    assert mapping.view.is_paper
    scale = mapping.view.px_per_cm(np.array([13.0, 0.0]))
    assert 10 * math.sqrt(np.mean(off**2)) / scale < 2 * mapping.view.misfit, "mm, as it says"


def test_a_height_that_places_do_not_tell_is_not_made_up():
    few = learn(PLACES[:8], reported=None)
    assert (few.view, few.height) == (None, None)
    few.lay_paper(HEIGHT)
    assert few.view
    near = np.random.default_rng(2).uniform((8, -2), (11, 2), (20, 2))
    blurred = learn(near, 3.0, reported=None)
    assert (blurred.view, blurred.height) == (None, None)


def test_what_tells_too_little_or_does_not_fit_is_not_believed():
    assert learn(PLACES[:3]).view is None
    assert learn(np.column_stack([np.linspace(8, 12, 5), np.zeros(5)])).view is None, "too near"
    assert learn(PLACES, place_at=lambda pixel, height: None).view is None
    wrong = BoardMapping(place_at)
    wrong.lay_paper(HEIGHT)
    pixels = project(to_board(PLACES), HEIGHT)
    for p, pixel in zip(PLACES * (1.0, -1.0), pixels, strict=True):
        wrong.add(p, tuple(pixel), 1.0, SIZE)
    assert wrong.view is None, "no turn and shift mirror an arm"


def test_the_pen_is_beside_the_marker_and_what_was_learned_can_be_forgotten():
    mapping = learn(PLACES)
    asked = np.random.default_rng(3).uniform((5, -10), (18, 10), (50, 2))
    shifts = np.random.default_rng(4).uniform(-0.7, 0.7, asked.shape)
    seen = project(to_board(asked + shifts), HEIGHT)
    assert mapping.pen(seen, shifts) == pytest.approx(asked, abs=1e-6)
    mapping.forget()
    assert mapping.view is None
    assert mapping.pen(seen, shifts) is None
