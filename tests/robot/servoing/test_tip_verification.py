"""What only seems to be the tip: told from its track, and asked by turning the joints."""

import math
import random

import pytest

from robot.servoing.tip_verification import TipVerification, has_jumped, has_stayed

DEG = math.radians(1)
SIZE = 300.0
"""Of the image Jacobian, px/rad."""


def chase(turn, steps=12, noise=0.5, outliers=0.0, seed=1):
    """Frames of a tip that goes with joint 1, and then stands."""
    rng = random.Random(seed)
    frames = []
    for k in range(steps + 4):
        angle = turn * min(k, steps) / steps
        s = [SIZE * angle + rng.gauss(0, noise), 100 + rng.gauss(0, noise)]
        if rng.random() < outliers:
            s = [rng.uniform(0, 640), rng.uniform(0, 480)]
        frames.append((0.1 * k, (angle, 0.0), tuple(s)))
    return frames


def taken_for_tip(frames, since, place):
    return frames[:since] + [(t, q, place) for t, q, _ in frames[since:]]


@pytest.mark.parametrize("turn", [5, 20, 60])
@pytest.mark.parametrize("seed", range(5))
def test_a_tip_that_follows_the_joints_is_believed(turn, seed):
    frames = chase(turn * DEG, seed=seed)
    assert not has_jumped(frames, SIZE)
    assert not has_stayed(frames)


@pytest.mark.parametrize("seed", range(10))
def test_false_sightings_here_and_there_are_no_jump(seed):
    frames = chase(40 * DEG, outliers=0.15, seed=seed)
    assert not has_jumped([(0.0, (0.0, 0.0), (0.0, 100.0)), *frames], SIZE)


@pytest.mark.parametrize("since", [1, 2, 4, 8, 13])
def test_a_jump_that_lasts_is_one(since):
    frames = chase(40 * DEG)
    away = frames[since][2][0] + 150.0, 180.0
    assert has_jumped(taken_for_tip(frames, since, away), SIZE)


@pytest.mark.parametrize("since", [3, 6, 9])
def test_what_stands_while_a_joint_turns_is_noticed_though_it_was_near(since):
    frames = chase(40 * DEG)
    assert has_stayed(taken_for_tip(frames, since, frames[since][2]))


def test_a_surprise_is_asked_about_until_the_tip_leaves_the_goal_or_has_not_left_it():
    verification = TipVerification(5.0)
    verification.missed = 7.0
    assert not verification.is_needed((), (), True, None, None)
    verification.missed = 9.0
    assert verification.is_needed((), (), True, None, None)
    assert verification.begin()
    verification.missed = 0.0
    assert verification.is_needed((), (), True, None, None), "it is not answered yet"
    assert not verification.begin()
    verification.record_elsewhere()
    assert not verification.is_needed((), (), True, None, None)


def test_who_comes_to_the_goal_by_exploring_is_asked_once():
    verification = TipVerification(5.0)
    assert verification.is_needed((), (), False, None, None)
    verification.begin()
    verification.record_elsewhere()
    assert not verification.is_needed((), (), False, None, None)
