"""The claim of disturbances: what it does to a run, and what it counts."""

from dataclasses import replace

import pytest

from tests.claims import disturbances as servo_disturbances
from tests.claims.disturbances import (
    DISTURBANCES,
    MODES,
    DisturbedCase,
    DisturbedResult,
    run_case,
)

RUN = DisturbedResult(
    "link cut", "look", "planar", 1, "converged", "", 6.0, 5, 2.0, False, 1.5, 0.0, 0.0, -20.0
)


@pytest.mark.parametrize("mode", MODES)
def test_a_picture_that_freezes_is_counted_from_when_it_would_show(mode):
    result = run_case(DisturbedCase("picture frozen for ever", mode, "planar", 1000, 0.0))
    assert result.verdict == "picture frozen"
    assert result.struck is not None
    assert 0 < result.blind_s < 0.45
    assert result.blind_deg < 0.5
    assert not result.false


def test_what_lies_at_the_goal_is_not_the_tip():
    name = "a thing at the goal taken for the tip"
    result = run_case(DisturbedCase(name, "look", "planar", 1001, 0.0))
    assert (result.verdict, result.false) == ("singular", False)
    assert result.error > 100


@pytest.mark.long
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", sorted(DISTURBANCES))
def test_nothing_is_claimed_that_is_not_so_and_nothing_moves_blindly(name, mode):
    result = run_case(DisturbedCase(name, mode, "planar", 1002))
    assert result.struck is not None, "it was over before"
    assert not result.false
    assert result.blind_deg < 1
    assert result.beyond < servo_disturbances.BEYOND


def test_one_that_claims_what_is_not_so_is_told_from_one_that_does_not(monkeypatch):
    """A servo that believes anything: the claim must see through it."""
    monkeypatch.setattr(
        "robot.servoing.tip_verification.TipVerification.is_needed", lambda *told: False
    )
    name = "a thing at the goal taken for the tip"
    result = run_case(DisturbedCase(name, "look", "planar", 1001, 0.0))
    assert (result.verdict, result.false) == ("converged", True)


def test_one_that_goes_on_by_repeated_pictures_moves_blindly(monkeypatch):
    monkeypatch.setattr(
        "robot.servoing.repeated_pictures.RepeatedPictures.is_new", lambda *seen: True
    )
    result = run_case(DisturbedCase("picture frozen for ever", "look", "planar", 1000, 0.0))
    assert result.blind_s > 1
    assert result.blind_deg > 10


def test_the_table_and_the_last_line_count_what_is_wrong():
    results = [
        RUN,
        replace(RUN, seed=2, false=True, error=90.0),
        replace(RUN, seed=3, verdict="link lost", blind_s=2.0, blind_deg=33.0, beyond=4.0),
        replace(RUN, mode="stream", struck=None),
    ]
    assert servo_disturbances.table(results) == [
        ("link cut", "look", "3", "2 x converged, 1 x link lost", "1", "90.0", "2.00", "33.0",
         "4.0"),
        ("link cut", "stream", "1", "1 x converged", "0", "2.0", "0.00", "0.0", "-20.0"),
    ]  # fmt: skip
    assert servo_disturbances.summary(results) == (
        "4 runs, 3 struck: 1 false converged, 1 moved blindly, 1 more than 3 deg beyond a limit"
    )
