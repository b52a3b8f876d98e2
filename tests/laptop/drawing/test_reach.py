"""Reach for many points at once, against the brick's own kinematics, point by point."""

import math

import numpy as np
import pytest

from laptop.drawing import reach
from robot.motion import kinematics, trajectory
from shared.arm_description import find_arm, read_arm


def arm_named(name):
    return read_arm(find_arm(name))


def places(arm, n=300):
    """Points all over and around the reach, and as many where random poses have the tip."""
    dice = np.random.default_rng(5)
    size = kinematics.coordinates(arm)
    limits = np.array([(joint.lower, joint.upper) for joint in arm.joints])
    poses = dice.uniform(*limits.T, (n, len(limits)))
    tips = [kinematics.forward(arm, q) for q in poses.tolist()]
    return np.vstack([dice.uniform(-23, 23, (n, size)), tips])


@pytest.mark.parametrize("name", ["planar", "geared", "spatial"])
@pytest.mark.parametrize("elbow", reach.POSTURES)
def test_poses_are_those_that_the_brick_finds(name, elbow):
    arm = arm_named(name)
    points = places(arm)
    found = reach.joint_angles(arm, points, elbow)
    reached = 0
    for point, q in zip(points.tolist(), found, strict=True):
        try:
            kinematics.inverse(arm, point, elbow)
        except kinematics.Unreachable:
            assert np.isnan(q).all(), point
            continue
        reached += 1
        # Of two poses with this elbow, bent over backwards or not, either will do.
        assert kinematics.forward(arm, q) == pytest.approx(tuple(point), abs=1e-6)
        assert tuple(q) in [
            pytest.approx(pose, abs=1e-6) for pose in kinematics.branches(arm, point)
        ]
    assert reached > 30


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_singularity_is_the_bricks(name):
    arm = arm_named(name)
    dice = np.random.default_rng(2)
    poses = dice.uniform(-2, 2, (50, len(arm.joints)))
    expected = [kinematics.singularity(arm, q) for q in poses.tolist()]
    assert reach.singularity(arm, poses) == pytest.approx(expected)


def test_a_margin_keeps_off_limits_and_singular_poses():
    arm = arm_named("planar")
    points = places(arm, 1000)
    margin = math.radians(5)
    q = reach.joint_angles(arm, points, "up", margin, 0.4)
    kept = q[~np.isnan(q[:, 0])]
    assert len(kept) > 100
    assert np.abs(np.sin(kept[:, 1])).min() >= 0.4
    for joint, angles in zip(arm.joints, kept.T, strict=True):
        assert angles.min() >= joint.lower + margin - 1e-5
        assert angles.max() <= joint.upper - margin + 1e-5
    assert len(kept) < (~np.isnan(reach.joint_angles(arm, points, "up")[:, 0])).sum()


def test_what_is_whole_in_a_posture_is_what_the_brick_can_follow():
    arm = arm_named("planar")
    dice = np.random.default_rng(11)
    strokes = []
    for _ in range(60):
        a = dice.uniform(-21, 21, 2)
        strokes.append(np.vstack([a, a + dice.uniform(-6, 6, 2)]))
    tried = reach.try_strokes(arm, strokes, 0.0)
    seen = set()
    for posture in reach.POSTURES:
        for stroke, whole in zip(strokes, tried.is_complete[posture], strict=True):
            dense = [tuple(p) for p in reach.densified([stroke])[0].tolist()]
            try:
                trajectory.joint_path(arm, dense, posture)
                follows = True
            except kinematics.Unreachable:
                follows = False
            # (A line along the very limit is left to the margin.)
            assert follows or not whole
            seen.add((follows, bool(whole)))
    assert {(True, True), (False, False)} <= seen


def test_points_lie_close_together_on_the_same_line():
    stroke = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.05), (1.0, 2.0)])
    dense, number = reach.densified([stroke, stroke + 7], 0.1)
    assert number.tolist() == [0] * (len(dense) // 2) + [1] * (len(dense) // 2)
    dense = dense[number == 0]
    steps = np.hypot(*np.diff(dense, axis=0).T)
    assert steps.max() <= 0.1 + 1e-9
    assert steps.sum() == pytest.approx(3.0)
    for corner in stroke:
        assert np.abs(dense - corner).sum(axis=1).min() < 1e-12


def test_the_map_knows_the_hole_and_the_rim():
    arm = arm_named("planar")
    table = reach.reach_map(arm, 0.0)
    hole, rim = kinematics.reach(arm)
    there = np.array([[10.0, 0.0], [0.0, 0.0], [rim + 0.3, 0.0], [400.0, 0.0]])
    assert table.at(there).tolist() == [3, 0, 0, 0]
    assert hole < 5 < rim
