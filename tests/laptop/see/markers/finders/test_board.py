"""The board in pictures of the synthetic camera, whose truth comes through its own optics."""

import random

import cv2
import numpy as np
import pytest

from laptop.emulator.scene.board_items import board_place
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.sensor import Sensor
from laptop.see.markers.finders.board import find_again, find_board
from shared.arm_description import find_arm, read_arm

ASIDE = (2.6, 1.2)
"""A pose of the arm beside the board."""


def photograph(text="", q=ASIDE):
    scene = Scene(read_arm(find_arm("planar")), read_scene(f"board=a4,clutter=0,{text}"))
    image = Sensor(scene.constants).develop(scene, scene.patch([q], (), 0.0), 1.0, random.Random(1))
    return scene, image


@pytest.fixture(scope="module")
def shown():
    return photograph()


def off(scene, view):
    """Distances of what was found from where it is, px."""
    there = scene.project(board_place(scene.constants, view.points[:, :2]))
    return np.linalg.norm(view.pixels - there, axis=1)


def test_markers_are_placed_to_a_few_hundredths_of_a_pixel(shown):
    scene, image = shown
    view = find_board(image)
    assert view.board.paper == "a4"
    assert len(view.numbers) >= 20
    assert view.points.shape == (4 * len(view.numbers), 3)
    assert np.sqrt(np.mean(off(scene, view) ** 2)) < 0.05
    assert np.median(off(scene, view)) < 0.03
    assert off(scene, view).max() < 0.4  # beside the shoulder, which hides a rim
    assert view.size == (640, 480)
    assert view.side == pytest.approx(28, abs=3)
    assert view.blur == pytest.approx(0.8, abs=0.15)


def test_a_grey_picture_does_as_well(shown):
    _, image = shown
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    assert (find_board(grey).pixels == find_board(image).pixels).all()


def test_what_the_arm_hides_is_not_claimed():
    scene, image = photograph(q=(0.2, 0.4))
    view = find_board(image)
    assert 10 <= len(view.numbers) < 26
    assert off(scene, view).max() < 0.5


def test_a_blurred_picture_says_so():
    _, image = photograph("blur=1.6")
    assert find_board(image).blur > 1.2


def test_of_two_boards_that_with_more_markers_counts(shown):
    _, image = shown
    _, other = photograph("board=letter", (0.2, 0.4))
    assert find_board(np.hstack([image, other[:, 300:420]])).board.paper == "a4"
    _, letter = photograph("board=letter")
    assert find_board(letter).board.paper == "letter"


def test_markers_that_are_seen_twice_are_left_out(shown):
    _, image = shown
    assert find_board(np.hstack([image, image])) is None


@pytest.mark.parametrize("shape", [(1, 1, 3), (5, 5, 3), (2, 640, 3), (480, 640), (480, 640, 3)])
def test_where_there_is_none_none_is_found(shape):
    assert find_board(np.full(shape, 90, np.uint8)) is None
    noise = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    assert find_board(noise) is None


def test_markers_that_are_about_where_they_were_are_found_again(shown):
    scene, image = shown
    whole = find_board(image)
    first = {
        n: scene.project(board_place(scene.constants, whole.board.square(n)[:, :2])) + (0.9, -0.7)
        for n in whole.numbers
    }
    view = find_again(image, whole.board, first)
    assert set(view.numbers) >= set(whole.numbers)
    assert np.median(off(scene, view)) < 0.03
    assert find_again(image, whole.board, {n: quad + 10 for n, quad in first.items()}) is None
    outside = {n: quad + (500, 0) for n, quad in first.items()}
    assert find_again(image, whole.board, outside) is None
    assert find_again(image, whole.board, {}) is None
