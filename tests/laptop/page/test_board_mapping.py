"""Where the paper is, by a board on it and the tip's moves; the truth is a camera's."""

import cv2
import numpy as np
import pytest

from laptop.page.board_mapping import BoardMapping, rigid

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


def place(marker, pixel):
    """What a calibrated camera says, exactly."""
    matrix = K @ np.column_stack([R[:, :2], (R[:, 2] * (HEIGHT if marker == "tip" else 0.0) + T)])
    x, y, w = np.linalg.solve(matrix, (*pixel, 1.0))
    return x / w, y / w


def to_board(arm):
    return (arm - SHIFT) @ TURN


def learn(places, noise=0.0, height=HEIGHT, place=place):
    mapping = BoardMapping(place, "tip")
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


def test_what_tells_too_little_or_does_not_fit_is_not_believed():
    assert learn(PLACES[:3]).view is None
    assert learn(np.column_stack([np.linspace(8, 12, 5), np.zeros(5)])).view is None, "too near"
    assert learn(PLACES, place=lambda marker, pixel: None).view is None
    wrong = BoardMapping(place, "tip")
    pixels = project(to_board(PLACES), HEIGHT)
    for p, pixel in zip(PLACES * (1.0, -1.0), pixels, strict=True):
        wrong.add(p, tuple(pixel), 1.0, SIZE)
    assert wrong.view is None, "no turn and shift mirror an arm"


def test_a_turn_and_a_shift_are_found_and_never_a_mirror():
    turn, shift = rigid(to_board(PLACES), PLACES)
    assert turn == pytest.approx(TURN)
    assert shift == pytest.approx(SHIFT)
    turn, _ = rigid(PLACES * (1, -1), PLACES)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_the_pen_is_beside_the_marker_and_what_was_learned_can_be_forgotten():
    mapping = learn(PLACES)
    asked = np.random.default_rng(3).uniform((5, -10), (18, 10), (50, 2))
    shifts = np.random.default_rng(4).uniform(-0.7, 0.7, asked.shape)
    seen = project(to_board(asked + shifts), HEIGHT)
    assert mapping.pen(seen, shifts) == pytest.approx(asked, abs=1e-6)
    mapping.forget()
    assert mapping.view is None
    assert mapping.pen(seen, shifts) is None
