"""What a camera should see of an arm agrees with what moves arms, by other formulas."""

import math

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_model import (
    ArmModel,
    CameraPrior,
    JointStates,
    MeasuredByHand,
    running_on,
)
from laptop.measure.arm.emulated_table import camera_over
from laptop.measure.emulated_rig import marker_point

CAMERA = CameraPrior.of(camera_over(600.0, (0.0, 0.0), 60.0, 0.3, 1.0, 0.2))
POSES = np.radians([(20.0, 40.0), (-50.0, 100.0), (120.0, -80.0)])


def joint_states_at(q, sides=0.0, back=0.0):
    return JointStates(q, np.full(q.shape, sides), np.full(q.shape, back))


def changed(model, **values):
    state = model.mean.copy()
    for name, value in values.items():
        state[model.index(name.replace("__", "."))] = value
    return state


@pytest.mark.parametrize("arm", [seen_arms.ARM, seen_arms.SPATIAL], ids=lambda arm: arm.name)
def test_the_marker_is_where_the_kinematics_have_it(arm):
    arm = arm._replace(marker_offset=(0.4, -0.3))
    model = ArmModel(arm, {"A": CAMERA})
    q = np.column_stack([POSES, POSES[:, 0] / 3])[:, : len(arm.joints)]
    found = model.marker(model.mean, q)
    height = 0.0 if model.spatial else model.mean[model.index("marker.height")]
    assert found == pytest.approx(np.array([marker_point(arm, pose, height) for pose in q]))


def test_the_arm_stands_turned_and_shifted_on_the_board():
    model = ArmModel(seen_arms.ARM, {"A": CAMERA})
    state = changed(model, board__turn=math.pi / 2, board__x=-12.0, board__y=3.0)
    (place,) = model.marker(state, np.zeros((1, 2)))
    assert place[:2] == pytest.approx([-12.0, 3.0 + 11.3 + 9.5])


def test_a_tilted_base_lowers_the_tip_in_front_of_it():
    model = ArmModel(seen_arms.SPATIAL, {"A": CAMERA})
    flat, tilted = (
        model.marker(changed(model, base__tilt_y=tilt), np.zeros((1, 3)))[0] for tilt in (0.0, 0.01)
    )
    assert tilted[2] - flat[2] == pytest.approx(-0.01 * flat[0], rel=0.01)


def test_a_link_lags_by_half_its_backlash_and_less_where_the_motor_went_back():
    model = ArmModel(seen_arms.ARM, {"A": CAMERA})
    state = changed(model, shoulder__lag=0.0, elbow__lag=0.0)
    q = POSES[:1]
    half = math.radians(1.0)
    for side in (1.0, -1.0):
        (theta,) = model.links_at(state, joint_states_at(q, side))
        assert theta == pytest.approx(q[0] - side * half)
        (theta,) = model.links_at(state, joint_states_at(q, side, math.radians(0.4)))
        assert theta == pytest.approx(q[0] - side * (half - math.radians(0.4)))
        # It can stay behind by no more than the whole backlash.
        (theta,) = model.links_at(state, joint_states_at(q, side, math.radians(9.0)))
        assert theta == pytest.approx(q[0] + side * half)


def test_a_pen_on_a_cross_has_the_marker_where_forward_kinematics_have_it():
    model = ArmModel(seen_arms.ARM._replace(marker_offset=(0.4, -0.3)), {"A": CAMERA})
    q = np.radians([(25.0, 50.0), (60.0, -70.0)])
    bare = ArmModel(seen_arms.ARM, {"A": CAMERA})
    crosses = bare.marker(bare.mean, q)[:, :2]
    seen = model.touched(model.mean, "A", crosses, np.array([1, -1]))
    assert seen == pytest.approx(model.pixels(
        changed(model, shoulder__lag=0.0, elbow__lag=0.0), "A", joint_states_at(q)
    ))  # fmt: skip


def test_a_cameras_standard_normal_numbers_have_its_covariance():
    root = np.random.default_rng(1).standard_normal((14, 14))
    covariance = root @ root.T
    camera = camera_over(600.0, (0.0, 0.0), 60.0, 0.3, 1.0, 0.2)
    prior = CameraPrior.of(
        type(camera)(camera.size, camera.lens, camera.rotation, camera.translation, covariance)
    )
    assert prior.root @ prior.root.T == pytest.approx(covariance)
    assert prior.model(np.zeros(14)).covariance == pytest.approx(covariance)


def test_a_link_has_no_less_play_than_none_and_all_else_is_free():
    model = ArmModel(seen_arms.ARM, {"A": CAMERA})
    least = model.mean + model.spread * model.least()
    for name, value in zip(model.names, least, strict=True):
        assert value == pytest.approx(0.0) if name.endswith("backlash") else value == -np.inf


def test_a_link_runs_on_where_its_motor_mostly_goes_back():
    back = np.radians([[0.9, 0.0], [0.9, 0.9], [0.1, 0.0], [0.5, 0.3]])
    joint_states = JointStates(np.zeros((4, 2)), np.ones((4, 2)), back)
    assert running_on(seen_arms.ARM, joint_states) == (True, False)
    model = ArmModel(seen_arms.ARM, {"A": CAMERA}, run_on=(True, False))
    spreads = np.degrees([model.spread[model.index(f"{j}.lag")] for j in ("shoulder", "elbow")])
    assert spreads == pytest.approx([0.2, 0.06])


def test_in_space_the_height_that_a_ruler_has_is_the_shoulders():
    given = ArmModel(seen_arms.SPATIAL, {"A": CAMERA}, MeasuredByHand(height=12.4))
    k = given.index("base.link")
    assert (given.mean[k], given.spread[k]) == (12.4, 0.05)
    free = ArmModel(seen_arms.SPATIAL, {"A": CAMERA})
    assert (free.mean[k], free.spread[k]) == (12.0, 1.0)
