"""Drawings on paper are told from photos, and their lines are followed along their middles."""

import math

import cv2
import numpy as np
import pytest

from laptop.drawing.line_drawings import centre_lines, is_line_drawing
from laptop.drawing.pictures import ShowsNothing, Tracing, read_picture

SHARP = 4
"""Places are given to the sixteenth of a pixel."""


def paper(shadow=False, noise=0.0, rows=400, columns=600):
    """Grey paper, on which a shadow may lie."""
    y, x = np.mgrid[:rows, :columns].astype(np.float32)
    lit = 0.4 + 0.6 / (1 + np.exp(-(x + 0.4 * y - 300) / 40)) if shadow else np.float32(1.0)
    return 230 * lit * (1 - 0.2 * y / rows) + np.random.default_rng(1).normal(0, noise, x.shape)


def inked(lines, light, width=4, dark=0.3):
    """Lines (n, 2) of x, y on paper."""
    mask = np.zeros(light.shape, np.uint8)
    for line in lines:
        points = np.round((np.array(line) - 0.5) * 2**SHARP).astype(np.int32)
        cv2.polylines(mask, [points], False, 255, width, cv2.LINE_AA, SHARP)
    mask = cv2.GaussianBlur(mask, (0, 0), 0.7) / 255.0
    return np.clip(light * (1 - (1 - dark) * mask), 0, 255).astype(np.uint8)


def ring(x, y, radius):
    angles = np.linspace(0, 2 * np.pi, 100)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])


def off(points, line):
    """How far points (n, 2) are from a line (m, 2), px."""
    a, b = np.array(line[:-1], float), np.array(line[1:], float)
    ahead = b - a
    share = ((points[:, None] - a) * ahead).sum(2) / (ahead**2).sum(1)
    nearest = a + np.clip(share, 0, 1)[..., None] * ahead
    return np.hypot(*(points[:, None] - nearest).transpose(2, 0, 1)).min(1)


@pytest.mark.parametrize("shadow", [False, True])
@pytest.mark.parametrize("width", [2, 4, 8])
def test_a_circle_is_one_line_along_its_middle_though_a_shadow_lies_on_it(shadow, width):
    wish = ring(250, 200, 120)
    (line,) = centre_lines(inked([wish], paper(shadow, 2.0), width))
    assert off(line + 0.5, wish).max() < 1.5
    assert off(wish, line + 0.5).max() < 1.5
    assert line[0].tolist() == line[-1].tolist()


def test_where_lines_cross_each_goes_on_straight():
    crossing = [[(100, 100), (400, 300)], [(100, 300), (400, 100)]]
    found = centre_lines(inked(crossing, paper()))
    assert len(found) == 2
    for line in found:
        assert min(off(line + 0.5, wish).max() for wish in crossing) < 2.0
        assert np.hypot(*(line[-1] - line[0])) == pytest.approx(math.hypot(300, 200), abs=6)


def test_a_line_ends_at_another_that_it_meets():
    found = centre_lines(inked([[(100, 200), (500, 200)], [(300, 200), (300, 350)]], paper()))
    assert sorted(round(np.ptp(line, axis=0).max(), -1) for line in found) == [150, 400]
    (upright,) = (line for line in found if np.ptp(line[:, 0]) < 20)
    assert abs(upright[:, 1].min() + 0.5 - 200) < 2


def test_a_corner_is_no_line_of_its_own():
    square = [(150, 100), (350, 100), (350, 300), (150, 300), (150, 100)]
    (line,) = centre_lines(inked([square], paper(), width=9))
    assert off(line + 0.5, square).max() < 3.0


def test_specks_and_grain_are_no_lines():
    light = paper(noise=6.0)
    cv2.circle(light, (50, 50), 3, 40, -1)
    (line,) = centre_lines(inked([[(100, 200), (500, 250)]], light))
    assert off(line + 0.5, [(100, 200), (500, 250)]).max() < 2.0


def photo(seed):
    """Something in half-tones: large soft spots, edges of light, texture."""
    dice = np.random.default_rng(seed)
    rough = cv2.resize(dice.uniform(20, 235, (9, 12)).astype(np.float32), (600, 400), None, 0, 0, 2)
    for _ in range(6):
        x, y, r = dice.integers(50, 550), dice.integers(50, 350), dice.integers(20, 90)
        cv2.circle(rough, (int(x), int(y)), int(r), float(dice.uniform(20, 235)), -1)
    return np.clip(rough + dice.normal(0, 4, rough.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("seed", range(4))
def test_drawings_are_told_from_photos(seed):
    dice = np.random.default_rng(seed)
    shapes = [ring(*dice.uniform(120, 280, 2), dice.uniform(40, 100)) for _ in range(4)]
    shapes.append(dice.uniform(50, 350, (6, 2)))
    for shadow in (False, True):
        assert is_line_drawing(inked(shapes, paper(shadow, 3.0), 3, 0.4))
    assert not is_line_drawing(photo(seed))


def test_what_is_filled_or_empty_is_no_drawing_of_lines():
    black = inked([], paper())
    cv2.circle(black, (300, 200), 90, 20, -1)
    assert not is_line_drawing(black)
    assert not is_line_drawing(inked([], paper(True, 3.0)))
    assert not is_line_drawing(np.full((50, 50), 255, np.uint8))


def file_of(image):
    return cv2.imencode(".png", image)[1].tobytes()


def test_a_picture_is_drawn_as_what_it_is_unless_it_is_said():
    data = file_of(inked([ring(250, 200, 120)], paper(True, 2.0)))
    lines, photo_of_it = read_picture(data), read_picture(data, how=Tracing(style="photo"))
    assert len(lines.strokes) == 1
    assert lines.length() == pytest.approx(2 * math.pi * 2.0, rel=0.02)
    assert "along their middles" in lines.left_out[0]
    assert read_picture(data, how=Tracing(style="lines")).left_out == ()
    assert len(photo_of_it.strokes) > 3
    assert photo_of_it.left_out == ()
    with pytest.raises(ShowsNothing, match="shows no lines on paper"):
        read_picture(file_of(inked([], paper())), how=Tracing(style="lines"))
