"""Kinematics against numpy: turns as matrices, the inverse by numerical minimisation."""

from operator import sub

import numpy as np
import pytest

from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm


def turns(angles, axis):
    """Rotation matrices, (N, 3, 3), by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    sin, cos = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.eye(3) + sin * cross + (1 - cos) * (cross @ cross)


def tips(arm, q):
    """Where the tips are, (N, 3), the links carried by one frame after the other."""
    if arm.chain == "planar":
        axes = [(0, 0, 1)] * 2
        links = [(joint.link, 0, 0) for joint in arm.joints]
    else:
        axes = [(0, 0, 1), (0, -1, 0), (0, -1, 0)]
        links = [(0, 0, arm.joints[0].link)] + [(joint.link, 0, 0) for joint in arm.joints[1:]]
    turned, place = np.eye(3)[None], np.zeros((len(q), 3))
    for k, (axis, link) in enumerate(zip(axes, links, strict=True)):
        turned = turned @ turns(q[:, k], axis)
        place = place + turned @ np.array(link, float)
    return place


def minimised(arm, p, q, rounds=40):
    """Poses, (N, n), whose tips are nearest to p: Levenberg and Marquardt from q, all at once."""
    damping = np.full(len(q), 1e-2)
    off = p - tips(arm, q)
    for _ in range(rounds):
        h = 1e-6
        J = np.stack(
            [(tips(arm, q + h * e) - tips(arm, q - h * e)) / (2 * h) for e in np.eye(q.shape[1])],
            axis=2,
        )
        square = J.transpose(0, 2, 1) @ J + damping[:, None, None] * np.eye(q.shape[1])
        step = np.linalg.solve(square, J.transpose(0, 2, 1) @ off[:, :, None])[:, :, 0]
        there = q + np.clip(step, -0.5, 0.5)
        off_there = p - tips(arm, there)
        better = np.linalg.norm(off_there, axis=1) < np.linalg.norm(off, axis=1)
        q, off = np.where(better[:, None], there, q), np.where(better[:, None], off_there, off)
        damping = np.where(better, damping / 4, damping * 4)
    return q, np.linalg.norm(off, axis=1)


@pytest.mark.short("planar-500", "spatial-500")
@pytest.mark.parametrize(
    ("name", "count"), [("planar", 500), ("spatial", 500), ("planar", 2000), ("spatial", 10_000)]
)
def test_inverse_and_jacobian_agree_with_numerical_minimisation(name, count):
    arm = read_arm(find_arm(name))
    rng = np.random.default_rng(5)
    low, high = (
        np.array([getattr(joint, side) for joint in arm.joints]) for side in ("lower", "upper")
    )
    truth = rng.uniform(low, high, (count, len(arm.joints)))
    p = tips(arm, truth)
    found, off = minimised(arm, p, rng.uniform(low, high, truth.shape))
    inside = ((found >= low) & (found <= high)).all(axis=1) & (off < 1e-9)
    assert inside.mean() > 0.4
    size = len(kinematics.forward(arm, truth[0].tolist()))
    assert np.allclose([kinematics.forward(arm, q) for q in truth.tolist()], p[:, :size], atol=1e-9)
    others, again = np.where(inside[:, None], found, truth), []
    for pose, other, wanted in zip(
        truth.tolist(), others.tolist(), p[:, :size].tolist(), strict=True
    ):
        branches = kinematics.branches(arm, wanted)
        # (Stretched, the elbow's angle goes with the root of a rounding error.)
        for solution in (pose, other):
            off = min(max(map(abs, map(sub, q, solution))) for q in branches)
            assert off < 1e-5
        again.append(kinematics.inverse(arm, wanted, near=pose))
    assert np.abs(again - truth).max() < 1e-5

    h = 1e-6
    for q in truth[:500]:
        J = np.array(kinematics.jacobian(arm, q.tolist()))
        for k, e in enumerate(np.eye(len(q))):
            slope = (tips(arm, (q + h * e)[None]) - tips(arm, (q - h * e)[None]))[0] / (2 * h)
            assert np.allclose(J[:, k], slope[:size], atol=1e-6)


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_nearest_pose_is_the_nearest_of_all_close_to_the_axis_too(name):
    """From many starts about a pose no other one is found that is nearer."""
    arm, starts = read_arm(find_arm(name)), 12
    rng = np.random.default_rng(3)
    low, high = (
        np.array([getattr(joint, side) for joint in arm.joints]) for side in ("lower", "upper")
    )
    size = kinematics.coordinates(arm)
    poses = rng.uniform(low, high, (60_000, len(low)))
    poses = poses[np.argsort(np.linalg.norm(tips(arm, poses)[:, :2], axis=1))[:250]]
    wanted = tips(arm, poses)
    wanted[:, :size] += rng.uniform(-0.5, 0.5, (len(poses), size))
    begin = poses.repeat(starts, axis=0)
    found, off = minimised(
        arm, wanted.repeat(starts, axis=0), begin + rng.normal(0, 0.4, begin.shape)
    )
    usable = ((found >= low) & (found <= high)).all(axis=1) & (off < 1e-9)
    errors = np.where(usable, np.abs(found - begin).max(axis=1), np.inf).reshape(-1, starts)
    compared = 0
    for q, p, error in zip(poses.tolist(), wanted, errors.min(axis=1), strict=True):
        if error < np.inf:
            given = kinematics.nearest(arm, p[:size].tolist(), q)
            assert np.allclose(tips(arm, np.array([given]))[0], p, atol=1e-6)
            assert max(map(abs, map(sub, given, q))) < error + 1e-6, (q, p)
            compared += 1
    assert compared > 50
