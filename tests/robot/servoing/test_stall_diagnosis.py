"""What a camera tells of a joint that does not count: by images of a known planar arm."""

import math

import numpy as np
import pytest

from robot.servoing.image_model import straight
from robot.servoing.stall_diagnosis import ImageKnowledge, Residual, observed_turn, residual_motion

J = np.array([[200.0, -80.0], [60.0, 150.0]])
"""px/rad"""

SURE, UNSURE = 25.0, 500.0**2
"""Variances of J's elements, (px/rad)^2."""


def rest(turn, k=1, moved=(0.05, 0.0), variance=SURE, moving=False, bump=(0.0, 0.0)):
    """Residual of an arm of which joint k turned by `turn` (rad) without a count."""
    start = np.array([0.3, 0.4])
    end = start + moved
    truly = end + np.eye(2)[k] * turn
    known = ImageKnowledge(straight(J.tolist()), (variance * np.eye(2)).tolist(), 0.5)
    seen = J @ truly + bump
    frames = [(tuple(start), tuple(J @ start + d)) for d in ([0.3, 0], [-0.2, 0.1], [0, 0])]
    return residual_motion(known, frames, moving, list(end), list(seen), k, [0.01, 0.02])


def test_what_the_counts_explain_is_left_out_and_the_rest_is_the_joints():
    left = rest(0.2)
    assert left.off == pytest.approx(J[:, 1] * 0.2, abs=0.11)
    assert left.column == pytest.approx(J[:, 1])
    assert rest(0.2, moving=True).uncertainty > left.uncertainty
    assert rest(0.2, moved=(0.3, 0.0)).uncertainty > left.uncertainty
    assert rest(0.2, variance=UNSURE).column is None


@pytest.mark.parametrize("turn", [0.2, -0.2])
def test_a_turn_without_counts_is_measured(turn):
    assert observed_turn([rest(turn)], 0.03) == pytest.approx(turn, abs=0.01)


def test_two_cameras_are_weighed_by_what_they_can_tell():
    poor = Residual((30.0, 0.0), 60.0, (200.0, 0.0))
    assert observed_turn([rest(0.2), poor], 0.03) == pytest.approx(0.2, abs=0.02)


def test_a_joint_that_stands_where_a_free_one_would_have_turned_is_blocked():
    assert observed_turn([rest(0.0)], 0.1) == 0.0


@pytest.mark.parametrize("turn", [0.06, -0.08])
def test_a_joint_that_turned_by_less_than_a_free_one_is_blocked_though_it_turned(turn):
    assert observed_turn([rest(turn)], 0.1) == 0.0


@pytest.mark.parametrize(
    ("rests", "least"),
    [
        ([rest(0.0)], 0.02),  # a free one need not have turned by more
        ([rest(0.0)], 0.0),
        ([rest(0.2, variance=UNSURE)], 0.03),  # nobody knows what the joint does
        ([rest(0.0, bump=(-150.0, -80.0))], 0.03),  # across: the camera was knocked
        ([rest(0.2), rest(-0.2)], 0.03),  # they contradict each other
        ([], 0.03),
    ],
)
def test_where_it_might_be_either_nothing_is_told(rests, least):
    assert observed_turn(rests, least) is None


def test_a_joint_that_only_just_moved_in_its_backlash_does_not_turn():
    assert observed_turn([rest(math.radians(0.5))], 0.1) == 0.0
