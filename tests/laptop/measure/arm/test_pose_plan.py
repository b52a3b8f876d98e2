"""Poses tell as much as a brute-force search has it, and the job goes where it should."""

import math
from pathlib import Path

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_model import ArmModel, CameraPrior, JointStates
from laptop.measure.arm.emulated_table import camera_over
from laptop.measure.arm.pose_plan import (
    ACCELERATION,
    APPROACH_SPEED,
    ApproachedPose,
    NoPose,
    approach_turn,
    candidates,
    choose,
    joint_path,
    joint_states_at,
    ordered,
    pose_job,
    scouts,
    sensitivities,
    start_of,
)
from laptop.measure.run_data import RunData
from robot.motion import kinematics
from shared.job import Job
from shared.job_log import LogRow

CAMERA = camera_over(560.0, (-8.0, 0.0), 46.0, math.radians(20), 1.0, 0.1)
ARM, SPATIAL = seen_arms.ARM, seen_arms.SPATIAL


@pytest.mark.parametrize("arm", [ARM, SPATIAL], ids=lambda arm: arm.name)
def test_all_poses_and_the_ways_to_them_are_within_the_limits(arm):
    poses = candidates(arm)
    lower, upper = (np.array([getattr(j, key) for j in arm.joints]) for key in ("lower", "upper"))
    for pose in poses:
        for q in (pose.q, start_of(arm, pose)):
            assert (lower < q).all()
            assert (q < upper).all()
    assert {pose.sides for pose in poses} >= {(1,) * len(lower), (-1,) * len(lower)}


def test_in_space_no_pose_is_low_over_the_table():
    heights = [
        min(p[2] for p in kinematics.joint_positions(SPATIAL, pose.q)[1:])
        for pose in candidates(SPATIAL)
    ]
    assert 2.0 < min(heights) < 6.0


def test_limits_that_leave_no_room_are_told():
    narrow = ARM.joints[1]._replace(lower=-0.1, upper=0.1)
    arm = ARM._replace(joints=(ARM.joints[0], narrow))
    with pytest.raises(NoPose, match="the elbow has 11 degrees between its limits, and 27 are the"):
        candidates(arm)


def test_a_pose_is_come_to_from_below_or_above_by_more_than_the_backlash():
    begin = start_of(ARM, ApproachedPose((0.5, -0.5), (1, -1)))
    assert begin == pytest.approx((0.5 - math.radians(6), -0.5 + math.radians(6)))
    assert approach_turn(math.radians(2)) == pytest.approx(math.radians(6))


def test_scouts_lie_apart_and_come_from_all_sides():
    poses = scouts(ARM, 12)
    q = np.array([pose.q for pose in poses])
    apart = np.abs(q[:, None] - q).max(axis=2)[~np.eye(12, dtype=bool)]
    assert apart.min() > math.radians(40)
    assert len({pose.sides for pose in poses}) == 4


@pytest.fixture(scope="module")
def model():
    return ArmModel(ARM, {"A": CameraPrior.of(CAMERA)})


@pytest.fixture(scope="module")
def state(model):
    found = model.mean.copy()
    found[model.index("board.x")] = -12.0
    return found


def test_the_pose_is_chosen_that_tells_most_and_then_another(model, state):
    spread = np.where(model.spread > 0, np.minimum(model.spread, 1.0), 1e-9)
    information = np.diag(spread**-2.0)
    wanted = {"shoulder.link": 0.01, "elbow.backlash": math.radians(0.1)}
    chosen = choose(model, state, information, wanted, 2, 0.5)
    every = candidates(ARM)
    rows = sensitivities(model, state, joint_states_at(ARM, every), 0.5)

    def left(*poses):
        whole = information + sum(rows[every.index(p)].T @ rows[every.index(p)] for p in poses)
        variances = np.diag(np.linalg.inv(whole))
        return sum(variances[model.index(name)] / sigma**2 for name, sigma in wanted.items())

    best = min(left(pose) for pose in every)
    assert left(chosen[0]) == pytest.approx(best, rel=1e-6)
    best = min(left(chosen[0], pose) for pose in every if pose != chosen[0])
    assert left(*chosen) == pytest.approx(best, rel=1e-6)


def test_what_lies_outside_the_picture_tells_nothing(model, state):
    away = state.copy()
    away[model.index("board.x")] = 500.0
    rows = sensitivities(model, away, joint_states_at(ARM, scouts(ARM, 4)), 0.5)
    assert not rows.any()
    joint_states = joint_states_at(ARM, scouts(ARM, 12))
    u, v = CAMERA.project(model.marker(state, model.links_at(state, joint_states))).T
    inside = (u > 12) & (u < 628) & (v > 12) & (v < 468)
    assert 1 < inside.sum() < 12
    assert (sensitivities(model, state, joint_states, 0.5).any(axis=(1, 2)) == inside).all()


def test_poses_are_gone_through_from_the_nearest_on():
    poses = [ApproachedPose((x, 0.0), (1, 1)) for x in (1.0, -0.5, 0.2)]
    found = ordered(ARM, poses, (0.0, 0.0))
    assert [pose.q[0] for pose in found] == [0.2, 1.0, -0.5]


def test_a_way_is_straight_in_the_joints_slow_and_as_long_as_it_should_be():
    begin, end = (0.1, 0.4), (0.9, 0.0)
    times, segments, last = joint_path(begin, end)
    assert last == pytest.approx(end)
    at, speed = 0.0, 0.0
    for a, b, (v, rate, cubics, _) in zip(times, times[1:], segments, strict=False):
        assert v == pytest.approx(speed, abs=1e-5)
        assert [cubic[0] for cubic in cubics] == pytest.approx(
            np.array(begin) + at / 0.8 * (np.array(end) - begin), abs=1e-5
        )
        assert [cubic[1] for cubic in cubics] == pytest.approx([1.0, -0.5])
        assert abs(rate) <= ACCELERATION * 1.001
        at, speed = at + v * (b - a) + rate * (b - a) ** 2 / 2, v + rate * (b - a)
        assert speed <= APPROACH_SPEED * 1.001
    assert at == pytest.approx(0.8, abs=1e-4)
    assert speed == pytest.approx(0.0, abs=1e-4)


def test_the_job_ends_each_stroke_at_a_pose_and_rests(tmp_path):
    poses = scouts(ARM, 3)
    file = Path(tmp_path) / "poses.job"
    pose_job(ARM, poses, file)
    job = Job(str(file))
    assert job.header.strokes == 3
    assert job.header.rest == 1.0
    for number, pose in enumerate(poses, 1):
        (piece,) = job.stroke(number).pieces
        assert piece[-1] == pytest.approx(pose.q, abs=1e-6)


def test_how_far_a_motor_went_back_is_told_by_the_log():
    poses = [ApproachedPose((0.5, 0.2), (1, -1)), ApproachedPose((0.9, 0.1), (-1, 1))]
    rows = [
        LogRow(1, 0.1, 0.1, False, (0.40, 0.30)),
        LogRow(1, 0.2, 0.2, False, (0.52, 0.19)),
        LogRow(1, 0.2, 1.2, True, (0.50, 0.20)),
        LogRow(2, 0.3, 2.0, False, (0.92, 0.08)),
        LogRow(2, 0.3, 3.0, True, (0.90, 0.10)),
    ]
    joint_states = joint_states_at(ARM, poses, RunData(rows, 1.0, {}))
    assert isinstance(joint_states, JointStates)
    assert joint_states.e == pytest.approx(np.array([[0.5, 0.2], [0.9, 0.1]]))
    assert joint_states.back == pytest.approx(np.array([[0.02, 0.01], [-0.02, -0.02]]))
    assert joint_states.sides.tolist() == [[1, -1], [-1, 1]]
