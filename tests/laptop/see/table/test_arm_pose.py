"""The pen's place by the marker's; the truth is by the joints."""

import math

import numpy as np
import pytest
from board_views import turned

from laptop.see.table.arm_pose import ArmPose
from laptop.see.table.marker_offset import BadTouches, MarkerFit
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
OFFSET, TURN, BASE, SCALE = np.array([0.6, -0.4]), 0.35, np.array([-12.3, 0.8]), 1.02
FIT = MarkerFit(OFFSET, 2.2, TURN, BASE, SCALE, np.eye(7), 0.2)


def places(q):
    """Pen and marker on the board, with the joints at q."""
    pen = BASE + SCALE * turned(TURN, kinematics.forward(ARM, q))
    return pen, pen + turned(TURN + sum(q), OFFSET)


POSES = [(0.2, 0.9), (-0.7, 1.6), (1.0, 0.3), (0.4, 2.0)]


@pytest.mark.parametrize("q", POSES)
def test_the_pen_is_where_the_joints_have_it(q):
    arm_pose = ArmPose(FIT, ARM)
    pen, marker = places(q)
    assert arm_pose.pen(tuple(marker)) == pytest.approx(pen, abs=1e-9)
    assert arm_pose.in_arm(tuple(pen)) == pytest.approx(kinematics.forward(ARM, q))
    assert arm_pose.height == 2.2


def test_the_joints_tell_which_way_the_elbow_is_bent():
    arm_pose = ArmPose(FIT, ARM)
    q = (0.8, -1.2)
    pen, marker = places(q)
    assert np.linalg.norm(np.subtract(arm_pose.pen(tuple(marker)), pen)) > 0.3, "the usual elbow"
    assert arm_pose.pen(tuple(marker), (0.7, -1.0)) == pytest.approx(pen, abs=1e-9)


@pytest.mark.parametrize("beyond", [-0.1, 0.0, 0.1])
def test_of_a_stretched_arm_the_pen_is_told_though_the_marker_is_seen_beyond_its_reach(beyond):
    arm_pose = ArmPose(FIT, ARM)
    pen, marker = places((0.3, -math.atan2(-0.4, ARM.joints[1].link + 0.6)))
    outwards = turned(TURN + 0.3, (1.0, 0.0))
    assert arm_pose.pen(tuple(marker + beyond * outwards)) == pytest.approx(
        pen + beyond * outwards, abs=0.12
    )
    assert arm_pose.pen(tuple(marker + 0.5 * outwards)) is None


def test_a_joint_that_is_seen_a_little_beyond_its_limit_is_there():
    arm_pose = ArmPose(FIT, ARM)
    q = ARM.joints[0].upper + 0.02, 0.5
    pen, marker = places(q)
    assert arm_pose.pen(tuple(marker)) == pytest.approx(pen, abs=1e-9)


def test_where_no_pose_puts_the_marker_there_is_no_pen():
    arm_pose = ArmPose(FIT, ARM)
    assert arm_pose.pen((100.0, 0.0)) is None
    assert arm_pose.pen(tuple(BASE)) is None


def test_an_arm_in_space_was_not_touched_like_this():
    with pytest.raises(BadTouches, match="spatial moves in space; leave --touched out"):
        ArmPose(FIT, read_arm(find_arm("spatial")))
