"""From pixels to the tip: places, their noise, and what a fitted stand takes up."""

from dataclasses import replace

import numpy as np
import pytest
from accuracy_rigs import camera_above

from laptop.measure.accuracy.sighting import (
    ArmSighting,
    BadSighting,
    BoardArmPose,
    Places,
    SeenMarker,
    nearest_arm_pose,
    without_common_error,
)
from laptop.measure.run_data import RunData, Sights
from laptop.see.serve.joint_track import marker_shift
from laptop.see.table.plane_motion import rotation
from shared.arm_description import find_arm, read_arm
from shared.job_log import LogRow

PLANAR = read_arm(find_arm("planar"))._replace(marker_offset=(0.5, -0.3))
SPATIAL = read_arm(find_arm("spatial"))
CAMERA = camera_above()
STAND = BoardArmPose(0.4, (3.0, -2.0))


def places_at(points, sigma=0.0, common=0):
    n, d = points.shape
    return Places(points, np.tile(sigma**2 * np.eye(d), (n, 1, 1)), np.zeros((n, d, common)))


def at_rests(pixels, rest=1.0):
    """A run in which each row of `pixels` (rests, pictures, 2) is what was seen at a rest."""
    rows, t, seen = [], [], []
    for k, own in enumerate(pixels, 1):
        end = 2.0 * k
        rows.append(LogRow(k, 0.0, end, True, (0.3, 0.4)))
        t += list(end - rest / 2 + rest / 2 * (np.arange(len(own)) + 1) / len(own))
        seen += list(own)
    return RunData(rows, rest, {"A": Sights(np.array(t), np.array(seen))})


def test_noise_is_that_of_a_picture_though_a_rest_takes_its_mean_away():
    luck = np.random.default_rng(1)
    middles = luck.uniform(0, 400, (60, 1, 2))
    run = at_rests(middles + 0.2 * luck.standard_normal((60, 15, 2)))
    sighting = ArmSighting(PLANAR, {"A": CAMERA}, 2.5)
    sigma = sighting.sigma(run)
    assert sigma["A"] == pytest.approx(0.2, rel=0.06)
    found = sighting.at_rest(run, sigma).places
    again = luck.standard_normal((20000, 15)) * sigma["A"]
    px = np.median(again, axis=1).std()  # what a rest's median is unsure by
    moved = CAMERA.to_table(middles[:, 0] + (px, 0.0), 2.5) - CAMERA.to_table(middles[:, 0], 2.5)
    down = CAMERA.to_table(middles[:, 0] + (0.0, px), 2.5) - CAMERA.to_table(middles[:, 0], 2.5)
    whole = (moved**2).sum(axis=1) + (down**2).sum(axis=1)
    assert np.trace(found.noise, axis1=1, axis2=2) == pytest.approx(whole, rel=0.08)


def test_noise_is_not_told_too_small_where_a_rest_has_few_pictures():
    luck = np.random.default_rng(6)
    run = at_rests(200 + 0.2 * luck.standard_normal((1500, 3, 2)))
    sigma = ArmSighting(PLANAR, {"A": CAMERA}, 2.5).sigma(run)
    assert sigma["A"] == pytest.approx(0.2, rel=0.06)  # without Bessel's correction 0.163


def test_a_marker_that_was_hardly_seen_at_rest_tells_no_noise():
    run = at_rests(np.full((5, 15, 2), np.nan))
    with pytest.raises(BadSighting, match="camera A saw the marker in hardly a picture while"):
        ArmSighting(PLANAR, {"A": CAMERA}).sigma(run)


def test_the_tip_is_found_beside_its_marker_and_where_the_arm_stands():
    q = np.array([(0.3, 0.8), (-0.5, 1.2)])
    tips = np.array([(10.0, 2.0), (12.0, -3.0)])
    shifts = np.array([marker_shift(PLANAR, pose) for pose in q])
    on_board = (tips + shifts) @ rotation(STAND.turn, 2).T + STAND.base
    sighting = ArmSighting(PLANAR, {"A": CAMERA}, 2.5)
    found = sighting.tip(SeenMarker(places_at(on_board), q), STAND)
    assert found.points == pytest.approx(tips)


def test_an_arms_stand_is_fitted_to_its_poses_whatever_else_they_are_off_by():
    luck = np.random.default_rng(2)
    there = luck.uniform(-5, 5, (40, 2)) + (14, 0)
    here = there @ rotation(STAND.turn, 2).T + STAND.base + 0.01 * luck.standard_normal((40, 2))
    found = nearest_arm_pose(here, there)
    assert (found.turn, *found.base) == pytest.approx((0.4, 3.0, -2.0), abs=0.02)
    # No other stand is nearer.
    left = ((found.in_arm(places_at(here)).points - there) ** 2).sum()
    for turn, x, y in 1e-3 * np.vstack([np.eye(3), -np.eye(3)]):
        other = BoardArmPose(found.turn + turn, (found.base[0] + x, found.base[1] + y))
        assert ((other.in_arm(places_at(here)).points - there) ** 2).sum() > left


def test_two_cameras_tell_where_a_marker_in_space_is_and_how_surely():
    cameras = {"A": camera_above(tilt=0.6), "B": camera_above(tilt=-0.6)}
    sighting = ArmSighting(SPATIAL, cameras)
    points = np.array([(12.0, 0.0, 8.0), (14.0, 3.0, 12.0), (10.0, -3.0, 5.0)])
    pixels = {name: camera.project(points) for name, camera in cameras.items()}
    sigma = {name: np.full(3, 0.2) for name in cameras}
    found = sighting._places(pixels, sigma)
    assert found.points == pytest.approx(points, abs=1e-6)
    luck = np.random.default_rng(3)
    many = {
        name: np.repeat(px, 4000, axis=0) + 0.2 * luck.standard_normal((12000, 2))
        for name, px in pixels.items()
    }
    scattered = sighting._marker(cameras, many).reshape(3, 4000, 3)
    for noise, own in zip(found.noise, scattered, strict=True):
        assert noise == pytest.approx(np.cov(own.T), rel=0.08, abs=0.03 * np.trace(noise))


def test_what_a_calibration_leaves_open_moves_all_places_as_it_says():
    camera = camera_above(spread=0.05)
    sighting = ArmSighting(PLANAR, {"A": camera}, 2.5)
    pixels = np.array([(300.0, 200.0), (100.0, 400.0)])
    common = sighting._places({"A": pixels}, {"A": np.zeros(2)}).common
    by_shift = []
    for step in 0.01 * np.eye(3):
        ends = [replace(camera, translation=camera.translation + off) for off in (step, -step)]
        one, other = (end.to_table(pixels, 2.5).ravel() for end in ends)
        by_shift.append(0.05 * (one - other) / 0.02)
    stated = common.reshape(4, -1) @ common.reshape(4, -1).T
    assert stated == pytest.approx(np.transpose(by_shift) @ np.array(by_shift), rel=1e-3, abs=1e-7)


def test_a_fitted_stand_takes_up_shifts_and_turns_but_no_stretching():
    luck = np.random.default_rng(5)
    points = luck.uniform(-5, 5, (30, 2))
    poses = places_at(points, common=3)
    poses.common[:, 0, 0] = 0.1  # all to the right
    poses.common[:, :, 1] = 0.02 * np.column_stack([-points[:, 1], points[:, 0]])  # a turn
    poses.common[:, :, 2] = 0.02 * (points - points.mean(axis=0))  # larger
    left = without_common_error(poses, poses).common
    assert np.abs(left[..., :2]).max() < 1e-12
    assert left[..., 2] == pytest.approx(poses.common[..., 2], abs=0.01)
    assert np.abs(left[..., 2]).max() > 0.05


def test_a_stroke_of_which_nothing_was_logged_is_said():
    run = RunData(
        [LogRow(1, 0.0, 2.0, True, (0.3, 0.4))], 0.3, {"A": Sights(np.zeros(0), np.zeros((0, 2)))}
    )
    with pytest.raises(BadSighting, match="the brick has logged nothing along stroke 1"):
        ArmSighting(PLANAR, {"A": CAMERA}).along_strokes(run, {"A": 0.1})


def test_along_a_path_only_pictures_between_its_beginning_and_its_rest_count():
    t = np.arange(0.0, 4.0, 0.1)
    rows = [LogRow(1, 0.0, at, False, (0.1 * at, 0.2)) for at in (1.0, 2.0, 3.0)]
    rows.append(LogRow(1, 0.0, 3.4, True, (0.3, 0.2)))
    pixels = np.column_stack([100 + 10 * t, np.full(len(t), 200.0)])
    run = RunData(rows, 0.3, {"A": Sights(t, pixels)})
    (seen,) = ArmSighting(PLANAR, {"A": CAMERA}, 2.5).along_strokes(run, {"A": 0.1})
    chosen = (t >= 1.0) & (t <= 3.1)
    assert seen.places.points == pytest.approx(CAMERA.to_table(pixels[chosen], 2.5))
    assert seen.q[:, 0] == pytest.approx(np.minimum(0.1 * t[chosen], 0.3))
