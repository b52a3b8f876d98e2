"""Where pen and marker are by the joints; the marker's truth is that of the synthetic camera."""

import math

import numpy as np
import pytest
from arms import PLANAR, SPATIAL

from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.see.serve.joint_track import DURATION, JointTrack, marker_place, marker_shift
from robot.motion import kinematics

OFFSET = 0.6, -0.4


def test_in_the_plane_the_marker_turns_with_the_last_link():
    arm = PLANAR._replace(marker_offset=OFFSET)
    for q in ((0.0, 0.0), (0.3, 0.9), (-1.0, 0.4)):
        ahead = np.array(kinematics.forward(arm, q)) - kinematics.joint_positions(arm, q)[-2]
        ahead /= np.linalg.norm(ahead)
        shift = OFFSET[0] * ahead + OFFSET[1] * np.array([-ahead[1], ahead[0]])
        assert marker_shift(arm, q) == pytest.approx(shift)
        assert marker_place(arm, q) == pytest.approx(kinematics.forward(arm, q) + shift)


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0), (0.4, 0.8, -1.1), (-1.2, 0.3, 0.5)])
def test_in_space_it_is_where_the_emulated_one_is(q):
    arm = SPATIAL._replace(marker_offset=OFFSET)
    scene = Scene(arm, read_scene("marker_stray=0"))
    assert marker_place(arm, q) == pytest.approx(scene.cell.tip_marker(q))


def test_between_two_words_the_joints_are_between_them():
    track = JointTrack()
    assert track.at(1.0) is None
    for t in (1.0, 1.2, 1.4):
        track.add(t, (t, -t))
    track.add(1.3, (9.0, 9.0))  # late, and left
    assert track.at(1.3) == pytest.approx((1.3, -1.3))
    assert track.at(1.4) == pytest.approx((1.4, -1.4))
    assert track.at(1.0) == (1.0, -1.0)
    assert track.at(0.9) is None
    assert track.at(1.5) is None, "nobody has told that yet"
    track.add(5.0, (5.0, -5.0))
    assert track.at(3.0) is None, "nobody told anything for so long"
    track.add(5.0 + DURATION, (0.0, 0.0))
    assert track.at(1.3) is None
    assert not math.isnan(track.at(5.0 + DURATION)[0])
