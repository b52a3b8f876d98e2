"""Where the joints are to go: straight, to the target under way, or to another posture."""

import math

import pytest
from arms import PLANAR

from robot.servoing.progress import Progress
from robot.servoing.target_poses import LIMIT_MARGIN, TargetPoses

TOLERANCE, GOAL, UPPER = 5.0, [0.0, 0.0], 1.2
HERE = [0.9, 0.0]


class Wave:
    """An image that falls towards the upper limit, too, but is as wanted at -pi/6."""

    def predict(self, q):
        return [50 + 50 * math.sin(3 * q[0]), 100 * q[1]]

    def jacobian(self, q):
        return [[150 * math.cos(3 * q[0]), 0.0], [0.0, 100.0]]


def chosen(lower, under_way):
    """The target from HERE, what it leaves over, and whether it is a detour."""
    shoulder, elbow = PLANAR.joints
    joints = shoulder._replace(lower=lower, upper=UPPER), elbow
    progress = Progress(TOLERANCE)
    progress.target_pose = under_way
    error = math.hypot(*Wave().predict(HERE))  # of GOAL, 0
    poses = TargetPoses(PLANAR._replace(joints=joints), TOLERANCE)
    return (*poses.choose(Wave(), GOAL, HERE, None, error, progress), progress.detours)


@pytest.mark.parametrize("under_way", [None, [UPPER - LIMIT_MARGIN, 0.0]], ids=["none", "limit"])
def test_a_target_at_a_limit_gives_way_to_a_posture_of_which_the_model_knows_by_now(under_way):
    to, left, detours = chosen(-1.2, under_way)
    assert to == pytest.approx([-math.pi / 6, 0.0], abs=0.05)
    assert left < TOLERANCE
    assert detours


@pytest.mark.parametrize("under_way", [None, [UPPER - LIMIT_MARGIN, 0.0]], ids=["none", "limit"])
def test_a_target_at_a_limit_stays_where_no_posture_is_much_better(under_way):
    to, left, detours = chosen(-0.2, under_way)
    assert to == pytest.approx([UPPER - LIMIT_MARGIN, 0.0], abs=0.02)
    assert left > TOLERANCE
    assert not detours
