"""From crosses that somebody touches to an offset: what counts, and what is asked for again."""

import json
import math

import numpy as np
import pytest
from arms import PLANAR, SPATIAL
from board_views import pixels, stand, turned, view

from laptop.see.markers.board import CROSSES
from laptop.see.table.camera_fit import BadCalibration, calibrate
from laptop.see.table.cross_sampling import CrossSample
from laptop.see.table.cross_touching import BrickPoint, CrossTouching, read_point
from laptop.see.table.marker_offset import BadTouches
from robot.motion import kinematics

CAMERA = stand(58, 25, 200, 3)
OFFSET, HEIGHT, TURN, BASE = np.array([0.45, -0.3]), 2.2, 0.1, np.array([-12.3, 0.8])
VIEW = view(CAMERA, np.random.default_rng(1), 0.02)


class Scene:
    """An arm that stands on a cross, with joints that are known to their play, and its camera."""

    def __init__(self, play=0.0):
        self.rng, self.play = np.random.default_rng(5), play
        self.heard = []
        self.seen = CrossSample(None, "", VIEW)
        self.touching = CrossTouching(
            PLANAR, calibrate([view(CAMERA, np.random.default_rng(0), 0.02)]), lambda: self.seen,
            self.heard.append,
        )  # fmt: skip

    def at(self, k):
        """The point of the brick with the pen on cross k; the camera sees it."""
        pen = CROSSES[k] + 0.02 * self.rng.standard_normal(2)
        q = np.array(kinematics.inverse(PLANAR, tuple(turned(-TURN, pen - BASE))))
        marker = pen + turned(TURN + q.sum(), OFFSET)
        seen = pixels(CAMERA, [[*marker, HEIGHT]])[0]
        self.seen = CrossSample(tuple(seen), "", VIEW)
        q = tuple(q + math.radians(self.play) * self.rng.uniform(-0.5, 0.5, 2))
        return BrickPoint(tuple(kinematics.forward(PLANAR, q)), q, 1.0)


@pytest.mark.parametrize("play", [0.0, 2.0, 4.0])
def test_nine_crosses_give_the_offset_whatever_the_play(play):
    scene = Scene(play)
    asked = []
    while scene.touching.cross is not None:
        asked.append(scene.touching.request())
        assert scene.touching.handle(scene.at(scene.touching.cross))
    assert asked[2] == "set the pen on cross 3 of 9, top right on the sheet, and press"
    fit = scene.touching.fit()
    assert fit.offset == pytest.approx(OFFSET, abs=0.05)
    assert fit.height == pytest.approx(HEIGHT, abs=0.1)
    off = np.linalg.norm(fit.offset - OFFSET)
    assert off < 3.5 * fit.offset_sigma


def test_a_marker_that_is_not_seen_is_asked_for_again():
    scene = Scene()
    point = scene.at(0)
    scene.seen = CrossSample(None, "the arm's marker is not seen (covered)", VIEW)
    assert not scene.touching.handle(point)
    assert scene.touching.cross == 0
    assert scene.heard == [
        "the arm's marker is not seen (covered): cross 1 does not count yet; set it right and "
        "press again"
    ]
    assert scene.touching.handle(scene.at(0))
    assert scene.touching.cross == 1


def test_the_same_cross_twice_is_noticed():
    scene = Scene()
    assert scene.touching.handle(scene.at(0))
    assert not scene.touching.handle(scene.at(0))
    assert (
        "the pen is 0.0 cm from where it touched the cross 1, and the two are 5.0 cm apart"
        in (scene.heard[-1])
    )
    assert scene.touching.handle(scene.at(1))


def test_a_camera_that_moved_ends_it():
    scene = Scene()
    point = scene.at(0)
    moved = view(stand(58, 25, 200, 3, (0.1, 0)), np.random.default_rng(1), 0.02)
    scene.seen = scene.seen._replace(view=moved)
    with pytest.raises(BadCalibration, match="has moved since by .*; nothing is written"):
        scene.touching.handle(point)


def test_a_board_that_is_gone_ends_it():
    scene = Scene()
    point = scene.at(0)
    scene.seen = scene.seen._replace(view=None)
    with pytest.raises(BadCalibration, match="no marker of the board is seen any more"):
        scene.touching.handle(point)


def test_a_brick_with_another_arms_numbers_is_noticed():
    scene = Scene()
    point = scene.at(0)
    with pytest.raises(BadTouches, match="the brick's file of this arm is another one"):
        scene.touching.handle(point._replace(p=(point.p[0] + 0.1, point.p[1])))


def test_crosses_that_are_left_out_are_too_few_in_the_end():
    scene = Scene()
    for k in range(9):
        if k in (2, 5, 7, 8):
            scene.touching.skip()
        else:
            assert scene.touching.handle(scene.at(k))
    scene.touching.skip()
    assert scene.heard.count("cross 3 is left out") == 1
    with pytest.raises(BadTouches, match="5 crosses were touched; 6 are the least"):
        scene.touching.fit()


def test_an_arm_in_space_is_refused():
    with pytest.raises(BadTouches, match="let go it would drop"):
        CrossTouching(SPATIAL, None, None, print)


def test_a_line_of_the_brick_is_a_point():
    line = json.dumps({"p": [1, 2.5], "q": [0.1, -0.2], "t": 7, "play": 0.3})
    assert read_point(line) == BrickPoint((1.0, 2.5), (0.1, -0.2), 7.0)


@pytest.mark.parametrize(
    "line",
    [
        *("", "x", "[]", "{}", '{"p": 1, "q": [1, 2], "t": 3}', '{"p": [1], "q": [1, 2], "t": 3}'),
        *('{"p": [1, 2, 3], "q": [1, 2, 3], "t": 3}', '{"p": [1, NaN], "q": [1, 2], "t": 3}'),
        *('{"p": ["1", 2], "q": [1, 2], "t": 3}', "[" * 5000, '{"p": [1, 2], "q": [1, 2]}'),
    ],
)
def test_what_is_no_point_is_refused(line):
    with pytest.raises(BadTouches, match="it is no point of driver.py touch --json"):
        read_point(line)
