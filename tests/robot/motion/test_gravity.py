"""What gravity does to the joints: against the slope of the potential energy; pure."""

import random

import pytest
from rig import degrees, described

from robot.motion.gravity import G, Gravity
from robot.motion.kinematics import forward

ARM = described("spatial")


def potential_energy(arm, q):
    """Of every link's weight, J; the place of a weight is the tip of an arm that ends there."""
    energy = 0.0
    for k, joint in enumerate(arm.joints):
        cut = arm._replace(joints=arm.joints[:k] + (joint._replace(link=joint.centre),))
        energy += joint.mass * G * 0.01 * forward(cut, q[: k + 1])[-1]
    return energy


@pytest.mark.parametrize("seed", range(20))
def test_torques_are_minus_the_slope_of_the_potential_energy(seed):
    rng = random.Random(seed)
    joints = tuple(
        joint._replace(mass=rng.uniform(0, 0.2), centre=rng.uniform(0.1, 20))
        for joint in ARM.joints
    )
    arm = ARM._replace(joints=joints)
    q = [rng.uniform(-3, 3) for _ in joints]
    torques = Gravity(arm).torques(q)
    for k in range(3):
        ahead, behind = (q[:k] + [q[k] + e] + q[k + 1 :] for e in (1e-5, -1e-5))
        slope = (potential_energy(arm, ahead) - potential_energy(arm, behind)) / 2e-5
        assert torques[k] == pytest.approx(-slope, abs=1e-8)


def test_by_hand():
    """Stretched out level: 106 g at 5.5 cm, and 56 g at 11.3 + 5.3 cm."""
    assert Gravity(ARM).torques((0.7, 0.0, 0.0)) == pytest.approx(
        [0, -9.81 * (0.106 * 0.055 + 0.056 * 0.166), -9.81 * 0.056 * 0.053]
    )


@pytest.mark.parametrize(
    ("pose", "sides"),
    [
        ((0, 0, 0), (0, 1, 1)),
        ((50, 45, -60), (0, 1, 1)),
        ((0, 130, -130), (0, -1, 1)),  # past the vertical the arm falls over backwards
        ((0, 130, 20), (0, -1, -1)),
        ((0, 90, 0), (0, 0, 0)),  # upright: it leans on nothing
        ((0, 30, -115), (0, 1, 0)),  # the forearm hangs: its friction holds it where it is
        ((0, 30, -145), (0, 1, -1)),
    ],
    ids=str,
)
def test_a_link_lies_on_its_motor_on_the_side_to_which_it_is_pulled(pose, sides):
    assert Gravity(ARM).preload_sides(degrees(*pose)) == sides
    assert Gravity(ARM, preloads=False).preload_sides(degrees(*pose)) == (0, 0, 0)


def test_it_lets_go_where_friction_takes_over():
    """The forearm's 0.0291 Nm turn to 0.01 Nm at 20.1 degrees from hanging straight."""
    for off, side in ((19.5, 0), (20.5, 1)):
        assert Gravity(ARM).preload_sides(degrees(0, 0, -90 + off))[2] == side


def test_where_gravity_does_not_press_the_play_lies_as_it_was_left():
    gravity = Gravity(ARM)
    assert gravity.sides(degrees(0, 0, 0), (-1, -1, 0.3)) == (-1, 1, 1)
    assert gravity.sides(degrees(0, 90, 0), (1, -1, 0.3)) == (1, -1, 0.3)


@pytest.mark.parametrize(
    "arm", [described("planar"), described("geared"), described("spatial", mass=0)]
)
def test_what_weighs_nothing_is_not_pulled(arm):
    gravity = Gravity(arm)
    q = (0.3,) * len(arm.joints)
    assert not gravity.loaded
    assert gravity.torques(q) == [0] * len(q)
    assert gravity.preload_sides(q) == (0,) * len(q)


def test_a_weight_may_be_kept_from_the_torques():
    assert Gravity(ARM, known=False).torques((0, 0, 0)) == [0, 0, 0]
    assert Gravity(ARM, known=False).preload_sides((0, 0, 0)) == (0, 1, 1)
