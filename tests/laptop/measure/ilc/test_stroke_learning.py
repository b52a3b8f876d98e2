"""An arm that is not as described learns a line from what a camera saw of it."""

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.measure.ilc import learning
from laptop.measure.ilc.piece_path import paths_of
from laptop.measure.ilc.stroke_learning import StrokeLearner, floor
from laptop.measure.ilc.tracks import PieceTrack
from robot.motion import kinematics, paths, trajectory

BUILT = ARM._replace(joints=(ARM.joints[0]._replace(link=11.7), ARM.joints[1]._replace(link=9.2)))


@pytest.fixture
def pieces():
    return paths_of(ARM, trajectory.plan(ARM, paths.polyline([(10.0, 0.0), (5.0, 10.0)])))


def drawn(piece, offsets, rng, noise=0.05):
    """What a camera sees of the arm as it was built, its zero a degree off."""
    s = np.concatenate([np.zeros(5), np.linspace(0, piece.length, 25), np.full(5, piece.length)])
    q = piece.at(s, piece.q) + np.radians(1.0)
    q += np.stack([np.interp(s, offsets.s, column) for column in offsets.q.T], axis=1)
    p = np.array([kinematics.forward(BUILT, pose) for pose in q])
    standing = np.repeat([-1, 0, 1], [5, 25, 5])
    return PieceTrack(s, p + noise * rng.standard_normal(p.shape), standing), p


def test_each_trial_brings_the_tip_nearer(pieces):
    rng, (piece,) = np.random.default_rng(1), pieces
    learner, off = StrokeLearner(pieces, floor(ARM, pieces), [learning.none(piece)]), []
    for _ in range(4):
        track, true = drawn(piece, learner.offsets[0], rng)
        off.append(np.linalg.norm(true - piece.at(track.s, piece.p), axis=1).max())
        learner.add([learning.trajectory_error(piece, track)])
    assert off[0] > 0.4
    assert off[1] < 0.15
    assert off[3] < 0.08


def test_of_an_arm_that_is_as_described_nothing_is_learned(pieces):
    (piece,) = pieces
    learner = StrokeLearner(pieces, floor(ARM, pieces), [learning.none(piece)])
    noise = 0.03 * np.random.default_rng(2).standard_normal((len(piece.s), 2))
    learner.add(
        [learning.trajectory_error(piece, PieceTrack(piece.s, piece.p + noise, 0 * piece.s))]
    )
    assert learner.is_at_noise_floor
    assert not learner.offsets[0].q.any()


def test_what_only_grows_worse_is_given_up(pieces):
    (piece,) = pieces
    learner = StrokeLearner(pieces, 0.01, [learning.none(piece)])
    for far in (0.2, 0.5):
        seen = PieceTrack(piece.s, piece.p + far * piece.left, 0 * piece.s)
        learner.add([learning.trajectory_error(piece, seen)])
    assert learner.has_no_gain
    assert not learner.offsets[0].q.any()
