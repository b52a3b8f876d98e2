"""What is to blame for a misfit is named, and nothing where all fits."""

import math

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_fit import fit_arm
from laptop.measure.arm.fault_hypotheses import explain, fault_hypotheses, loose_joint

TABLE = seen_arms.table()
COUNT = 30
TIMES = 5.0 * np.arange(1, COUNT + 1)


def fitted(after=None, push=(0.0, 0.0), **more):
    """A fit of rests as a tracker sees them; pixels pushed after some of them."""
    sights = seen_arms.rests(TABLE, COUNT, noise_px=0.4, phase=0.5, **more)
    if after is not None:
        sights.pixels["A"][after:] += push
    return fit_arm(seen_arms.model(TABLE), sights)


def late(joint, angle, after):
    """A link that stands off by an angle, deg, after some rests."""

    def moved(q):
        q = q.copy()
        q[after:, joint] += math.radians(angle)
        return q

    return moved


@pytest.fixture(scope="module")
def slipped():
    return fitted(moved=late(1, 4.0, 14))


@pytest.mark.long
def test_where_all_fits_nobody_is_to_blame():
    assert explain(fitted(), COUNT, TIMES) == ""


def test_a_joint_that_slipped_is_named_with_its_time_and_angle(slipped):
    said = explain(slipped, COUNT, TIMES)
    assert said.startswith("the elbow slipped after pose 14 of 30, 70 s after the start, by ")
    assert said.endswith("mend it, home the arm and calibrate again; nothing was written")
    (culprit,) = (one for one in fault_hypotheses(slipped) if one.name == "elbow")
    assert math.degrees(culprit.size) == pytest.approx(4.0, abs=0.6)
    assert culprit.explained > 0.8


def test_a_slip_is_also_seen_in_the_last_two_poses():
    fit = fitted(moved=late(0, 4.0, COUNT - 2))
    assert fit.noise < 1.7, "the robust loss takes it for two slips of the tracker"
    assert "the shoulder slipped after pose 28 of 30" in explain(fit, COUNT, TIMES)


@pytest.mark.long
def test_one_slip_of_the_tracker_is_nobodys_fault():
    assert explain(fitted(COUNT - 1, (80.0, 0.0)), COUNT, TIMES) == ""


@pytest.mark.long
def test_a_camera_that_was_moved_is_named():
    said = explain(fitted(11, (30.0, 10.0)), COUNT, TIMES)
    assert said.startswith("camera A or the board was moved after pose 11 of 30, 55 s after")
    assert "by 32 px in the picture; fasten both and calibrate again" in said


@pytest.mark.long
@pytest.mark.parametrize(("joint", "name"), [(0, "shoulder"), (1, "elbow")])
def test_a_loose_link_is_named(joint, name):
    luck = np.random.default_rng(3).uniform(-3, 3, COUNT)

    def moved(q):
        q = q.copy()
        q[:, joint] += np.radians(luck)
        return q

    fit = fitted(moved=moved)
    assert f"the {name} stands now here, now there, by " in explain(fit, COUNT, TIMES)
    found, degrees = loose_joint(fit)
    assert found == name
    assert degrees == pytest.approx(3 / math.sqrt(3), rel=0.5)


@pytest.mark.long
def test_what_no_arm_does_is_told_without_a_name():
    luck = np.random.default_rng(4)
    sights = seen_arms.rests(TABLE, COUNT, noise_px=0.4)
    sights.pixels["A"] += luck.normal(0, 12, (COUNT, 2))
    said = explain(fit_arm(seen_arms.model(TABLE), sights), COUNT, TIMES)
    assert said.startswith("no arm of this kind moves like that: what is left over is ")
