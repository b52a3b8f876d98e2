"""The way from pen down to pen up, with what was learned of it."""

import math

import jobs
import pytest

from robot.jobs.pen_path import PenPath
from robot.motion.backlash import BacklashCompensation
from robot.motion.feed import with_speed_limit
from robot.motion.trajectory import Trajectory
from shared.arm_description import find_arm, read_arm
from shared.job import Job

ARM = read_arm(find_arm("planar"))
TURNING = [(10.0, -6.0), (10.0, 8.0)]
"""A line on which the elbow turns round."""


@pytest.fixture
def stroke(tmp_path):
    return Job(jobs.write(tmp_path, [TURNING]), ARM).stroke(1)


@pytest.fixture
def path(tmp_path, stroke):
    length = math.hypot(*[b - a for a, b in zip(*TURNING)])
    by_joint = [[0.0, 0.03, -0.02, 0.01], [0.02, -0.03, 0.03, 0.0]]
    learned = stroke._replace(offsets=[([0.0, 5.0, 9.0, length], by_joint)])
    return PenPath(Job(jobs.write(tmp_path, [TURNING]), ARM), 1, [learned], 1, ARM.joints)


def test_joints_turn_round_where_the_plan_does_at_whatever_speed(path, stroke):
    for share in (1.0, 0.5, 0.3):
        (motion,) = path.motions(share)
        plain = with_speed_limit(stroke.pieces[0], share) if share < 1 else stroke.pieces[0]
        wished = Trajectory(*plain)
        assert any(wished.reversals)
        for turns, own in zip(motion.reversals, wished.reversals):
            assert turns == pytest.approx(own, abs=1e-6)


def test_joints_turn_round_where_the_plan_does_after_pauses(path, stroke):
    (plan,) = [Trajectory(*piece) for piece in stroke.pieces]
    (elbow,) = plan.reversals[1]
    there = plan.at(elbow)[0]
    for cm in (1.0, 2.5):  # beyond where it was, each time
        (motion,) = path.motions(1.0)
        path.cut(0, _time_at(path.pieces[0], cm))
    (motion,) = path.motions(1.0)
    (turn,) = motion.reversals[1]
    # What was learned moves the joints by 2 degrees at the most.
    assert motion.at(turn)[0] == pytest.approx(there, abs=0.04)
    back = Trajectory(*path._planned[0])
    assert back.at(turn)[0] == pytest.approx(there, abs=1e-3)
    BacklashCompensation(ARM.joints, motion, (0, 0))


def _time_at(piece, cm):
    times, segments, _ = piece
    for t, t_end, (v, a, _, _) in zip(times, times[1:], segments):
        whole = (t_end - t) * (v + 0.5 * a * (t_end - t))
        if cm <= whole:
            return t + 2 * cm / (v + math.sqrt(v * v + 2 * a * cm))
        cm -= whole
    raise AssertionError(cm)
