"""One camera as the page sees it: trail, marks, masks, encoding."""

import cv2
import numpy as np
import pytest
from page_scene import BLUE, mark

from laptop.page import camera_feed
from shared.messages import EFFECTOR


def test_where_the_marker_is_expected_is_looked_first(scene):
    assert mark(scene.show(tip=(100, 120))).window is None, "the whole picture"
    left, top, right, bottom = mark(scene.show(tip=(104, 120))).window
    assert (left + right) / 2 == pytest.approx(100, abs=0.5)
    assert (top + bottom) / 2 == pytest.approx(120, abs=0.5)
    assert bottom - top == pytest.approx(right - left)
    assert right - left > 2 * 14


def test_the_trail_ends_where_the_tip_is_in_this_picture(scene):
    places = [(60 + 10 * k, 120) for k in range(6)]
    shown = [scene.show(tip=place) for place in places][-1]
    assert np.array(shown.trail) == pytest.approx(np.array(places, float), abs=0.3)


@pytest.mark.parametrize(
    ("looks", "why", "advice"),
    [
        ({"tip": None}, "nothing of this colour", "bring it into the picture"),
        ({"ink": BLUE}, "nothing of this colour", "pick it anew"),
        ({"light": 0.02}, "too dark", "more light"),
        ({"goal": None}, "", ""),
    ],
)
def test_a_lost_marker_has_its_reason_and_what_to_do(scene, looks, why, advice):
    seen = mark(scene.show(**looks))
    assert seen.why == why
    assert advice in seen.advice
    assert (seen.u is None) == bool(why)


def test_a_mask_shows_the_pixels_of_the_colour_in_this_very_picture(scene):
    scene.show(tip=(80, 120))
    shown = scene.controller.frames.view("A", masks=(EFFECTOR,))
    (png,) = shown.masks.values()
    layer = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    v, u = np.nonzero(layer[..., 3])
    assert (u.mean(), v.mean()) == pytest.approx((80, 120), abs=0.5)
    assert len(u) == pytest.approx(np.pi * 14**2, rel=0.1)


def test_a_picture_is_encoded_once_however_many_look(scene, monkeypatch):
    scene.show()
    monkeypatch.setattr(camera_feed.cv2, "imencode", None)
    assert [scene.controller.frames.view("A").index for _ in range(5)] == [0] * 5
