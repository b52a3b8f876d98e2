"""An arm's numbers come out of what was seen of it, as sure as is said."""

import math

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm import arm_fit
from laptop.measure.arm.arm_fit import BadIdentification, RestSights, fit_arm
from laptop.measure.arm.arm_model import MeasuredByHand

ZEROS = (math.radians(0.8), math.radians(-1.2))
TABLE = seen_arms.table(turn=0.01)


def fitted(over=TABLE, touches=6, known=None, described=seen_arms.ARM, zeros=ZEROS, **seen):
    sights = seen_arms.rests(over, zeros=zeros, **seen)
    hand = over.touches(touches, np.random.default_rng(5), 0.05) if touches else []
    return fit_arm(seen_arms.model(over, known, described), sights, hand)


def test_everything_is_found_where_nothing_is_noisy():
    fit = fitted(known=MeasuredByHand(2.5, 0, 0.3))
    # The hand that touches is never exact; all else is.
    assert fit.value("shoulder.link") == pytest.approx(11.6, abs=0.02)
    assert fit.value("elbow.link") == pytest.approx(9.2, abs=0.04)
    assert fit.value("marker.along") == pytest.approx(0.3, abs=0.04)
    assert fit.value("marker.aside") == pytest.approx(-0.2, abs=0.04)
    assert math.degrees(fit.value("elbow.zero")) == pytest.approx(-1.2, abs=0.25)
    for name, true in (("shoulder", 3.0), ("elbow", 1.0)):
        joint = fit.value(f"{name}.backlash") + 2 * fit.value(f"{name}.lag")
        assert math.degrees(joint) == pytest.approx(true, abs=0.02)
    assert fit.rms < 0.1


@pytest.mark.long
def test_by_sight_alone_only_the_sum_of_last_link_and_marker_is_known():
    fit = fitted(touches=0)
    total = fit.value("elbow.link") + fit.value("marker.along")
    assert total == pytest.approx(9.5, abs=0.02)
    assert fit.sigma("elbow.link") > 0.15
    assert fitted().sigma("elbow.link") < 0.04


@pytest.mark.long
def test_the_shoulders_zero_is_only_known_by_the_boards_edge():
    assert math.degrees(fitted(known=MeasuredByHand(2.5, None, 0.3)).sigma("shoulder.zero")) > 4
    fit = fitted(known=MeasuredByHand(2.5, 0, 0.3))
    assert math.degrees(fit.sigma("shoulder.zero")) < 0.4
    # The board is turned by 0.01 rad, which nobody knows.
    assert fit.value("shoulder.zero") == pytest.approx(ZEROS[0] + 0.01, abs=0.005)


@pytest.mark.long
def test_a_joint_that_turns_the_other_way_round_is_noticed():
    fit = fitted(touches=0, moved=lambda q: q * (1, -1), zeros=(0.0, 0.0))
    assert fit.model.signs == (1, -1)
    assert fit.noise < 1


@pytest.mark.long
def test_a_gear_that_is_not_as_described_is_found():
    fit = fitted(touches=0, moved=lambda q: q * (1, 1.05))
    assert fit.value("elbow.gear") == pytest.approx(1.05, abs=0.002)
    assert fit.value("shoulder.gear") == 1.0
    assert fit.sigma("shoulder.gear") == 0.0


@pytest.mark.claims
def test_the_stated_uncertainties_are_true():
    near, names = [], ("shoulder.link", "shoulder.backlash", "elbow.backlash", "marker.height")
    true = {"shoulder.link": 11.6, "marker.height": 2.5}
    true |= {"shoulder.backlash": math.radians(3.02), "elbow.backlash": math.radians(1.02)}
    for seed in range(8):
        sights = seen_arms.rests(TABLE, 36, ZEROS, noise_px=0.4, phase=0.5, seed=seed)
        height = 2.5 + 0.05 * np.random.default_rng([seed, 1]).standard_normal()
        model = seen_arms.model(TABLE, MeasuredByHand(height, 0, 0.3), seed=seed)
        fit = fit_arm(model, sights)
        assert 0.6 < fit.noise < 1.4
        near += [abs(fit.value(name) - true[name]) / fit.sigma(name) for name in names]
    # Of a normal distribution 68 and 95 of 100; of backlash a part is the same in all arms.
    assert 0.5 < np.mean(np.array(near) < 1) < 0.95
    assert np.mean(np.array(near) < 2) > 0.85


@pytest.mark.long
def test_one_slip_of_the_tracker_spoils_nothing():
    sights = seen_arms.rests(TABLE, 36, ZEROS, noise_px=0.3, seed=1)
    model = seen_arms.model(TABLE)
    before = fit_arm(model, sights)
    sights.pixels["A"][10] += 80.0
    after = fit_arm(model, sights)
    assert after.value("shoulder.link") == pytest.approx(before.value("shoulder.link"), abs=0.03)
    assert after.value("elbow.backlash") == pytest.approx(
        before.value("elbow.backlash"), abs=math.radians(0.3)
    )


def test_too_few_sights_are_refused():
    sights = seen_arms.rests(TABLE, 20)
    sights.pixels["A"][5:] = np.nan
    with pytest.raises(BadIdentification, match="seen in 5 of 20 poses, and 6 are the least"):
        fit_arm(seen_arms.model(TABLE), sights)


@pytest.mark.long
def test_no_play_is_never_found_as_less_than_none():
    over = seen_arms.table(seen_arms.built(backlash=(0.0, 2.0)))
    sights = seen_arms.rests(over, 36, ZEROS, noise_px=0.4, phase=0.5, seed=2)
    # The links ran on a little, as if pushed beyond the motors.
    joint_states = sights.joint_states._replace(
        e=sights.joint_states.e - np.radians(0.2) * sights.joint_states.sides
    )
    fit = fit_arm(seen_arms.model(over), RestSights(joint_states, sights.pixels, sights.sigma))
    assert 0 <= fit.value("shoulder.backlash") < math.radians(0.1)


@pytest.mark.claims
def test_where_a_link_mostly_runs_on_its_backlash_is_known_less_well():
    sights = seen_arms.rests(TABLE, 36, ZEROS, noise_px=0.3)
    fit = fit_arm(seen_arms.model(TABLE), sights)
    back = np.zeros(sights.joint_states.back.shape)
    back[:25, 0] = math.radians(0.9)
    joint_states = sights.joint_states._replace(
        back=back, e=sights.joint_states.e - sights.joint_states.sides * back
    )
    other = fit_arm(seen_arms.model(TABLE), RestSights(joint_states, sights.pixels, sights.sigma))
    assert other.value("shoulder.backlash") == pytest.approx(math.radians(3.0), abs=0.003)
    assert other.sigma("shoulder.backlash") > 2 * fit.sigma("shoulder.backlash")
    assert other.sigma("elbow.backlash") == pytest.approx(fit.sigma("elbow.backlash"), rel=0.1)


@pytest.mark.long
def test_an_elbow_that_was_taken_for_bent_the_other_way_is_righted(monkeypatch):
    right = fitted(known=MeasuredByHand(2.5, 0, 0.3))
    guessed = arm_fit.bent_at

    def wrong(fit, touches):
        signs = guessed(fit, touches)
        return [-signs[0], *signs[1:]]

    monkeypatch.setattr(arm_fit, "bent_at", wrong)
    righted = fitted(known=MeasuredByHand(2.5, 0, 0.3))
    for name in ("elbow.link", "elbow.zero", "marker.along", "marker.aside"):
        assert righted.value(name) == pytest.approx(right.value(name), abs=1e-3)
