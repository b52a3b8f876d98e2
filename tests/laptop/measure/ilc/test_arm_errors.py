"""What a few taught strokes tell of an arm: a known error is found; from chance nothing is."""

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.measure.ilc import arm_errors, learning
from laptop.measure.ilc.learning import Offsets
from laptop.measure.ilc.piece_path import paths_of
from robot.motion import kinematics, paths, trajectory

LINES = [
    ((12, 0), (9, 5)),
    ((9, -4), (13, -6)),
    ((4, 10), (8, 12)),
    ((14, 8), (10, 3)),
    ((2, 14), (6, 9)),
    ((16, -2), (15, 4)),
    ((7, 7), (12, 9)),
    ((11, -9), (8, -3)),
    ((5, 15), (10, 12)),
]
TAUGHT = 6

BUILT = ARM._replace(joints=(ARM.joints[0]._replace(link=11.6), ARM.joints[1]._replace(link=9.2)))
ZEROS, BACKLASH = np.radians([1.2, -0.8]), np.radians([0.5, -0.4])


@pytest.fixture(scope="module")
def strokes():
    return [paths_of(ARM, trajectory.plan(ARM, paths.polyline(line))) for line in LINES]


def knots(piece):
    s = learning.none(piece).s
    return s, piece.at(s, piece.q), piece.at(s, piece.p), piece.at(s, piece.sides)


def wrong(sides):
    """What the joints of the arm as it is built stand beside their motors."""
    return ZEROS + sides * BACKLASH


def taught(piece, rng, noise=0.0):
    """Offsets that bring the arm as it is built onto the path, by its own inverse kinematics."""
    s, q, p, sides = knots(piece)
    angles = np.array([kinematics.inverse(BUILT, tuple(xy), "up") for xy in p])
    return Offsets(s, angles - wrong(sides) - q + noise * rng.standard_normal((1, 2)))


def off(piece, offsets):
    """Greatest distance of the true tip from the path, cm."""
    s, q, p, sides = knots(piece)
    true = [kinematics.forward(BUILT, pose) for pose in q + offsets.q + wrong(sides)]
    return np.linalg.norm(np.array(true)[:, :2] - p, axis=1).max()


def fitted(strokes, offsets_of):
    return arm_errors.fit(ARM, [[(piece, offsets_of(piece)) for piece in own] for own in strokes])


def test_a_known_error_is_taken_off_strokes_that_were_not_taught(strokes):
    rng = np.random.default_rng(1)
    found = fitted(strokes[:TAUGHT], lambda piece: taught(piece, rng))
    assert set(found.values) == set(arm_errors.KINDS)
    assert found.values["links"] == pytest.approx([0.3, -0.3], abs=0.05)
    assert np.degrees(found.values["zeros"]) == pytest.approx([1.2, -0.8], abs=0.15)
    assert np.degrees(found.values["backlash"]) == pytest.approx([0.5, -0.4], abs=0.1)
    assert found.without_cm > 0.2
    for (piece,) in strokes[TAUGHT:]:
        assert off(piece, learning.none(piece)) > 0.2
        (own,) = found.offsets(ARM, [piece])
        assert off(piece, own) < 0.05


def test_it_is_found_through_what_two_drawings_differ_by(strokes):
    rng = np.random.default_rng(2)
    found = fitted(strokes[:TAUGHT], lambda piece: taught(piece, rng, np.radians(0.15)))
    for (piece,) in strokes[TAUGHT:]:
        (own,) = found.offsets(ARM, [piece])
        assert off(piece, own) < 0.4 * off(piece, learning.none(piece))


def test_a_zero_alone_is_foretold_as_such(strokes):
    zero = np.radians(1.0)

    def offsets(piece):
        own = learning.none(piece)
        return Offsets(own.s, own.q - zero)

    found = fitted(strokes[:TAUGHT], offsets)
    assert "zeros" in found.values
    for (piece,) in strokes[TAUGHT:]:
        (own,) = found.offsets(ARM, [piece])
        assert own.q == pytest.approx(np.full_like(own.q, -zero), abs=np.radians(0.1))


@pytest.mark.parametrize("seed", range(12))
def test_from_chance_nothing_is_foretold(strokes, seed):
    rng = np.random.default_rng(seed)

    def chance(piece):
        s = learning.none(piece).s
        waves = rng.standard_normal((3, 2)) * np.radians(0.6)
        bends = np.stack([np.ones_like(s), np.cos(3 * s / s[-1]), np.sin(3 * s / s[-1])], axis=1)
        return Offsets(s, bends @ waves)

    found = fitted(strokes[:TAUGHT], chance)
    assert not found.values
    (own,) = found.offsets(ARM, strokes[-1])
    assert not own.q.any()


def test_two_strokes_tell_nothing_of_others(strokes):
    found = fitted(strokes[:2], lambda piece: taught(piece, np.random.default_rng(3)))
    assert not found.values
