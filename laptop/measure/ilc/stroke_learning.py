"""Offsets of one stroke from all its trials together; and when to stop.  Pure.

Each trial proposes offsets: those it was drawn with, less what was missed.  A proposal is wrong
by what two drawings of one stroke differ by anyway, and by a share of what was missed.  So the
next offsets are the mean of what all trials propose, each weighed by its inverse variance; and of
those that the stroke began with, weighed by how much there is to learn at all.  A trial that
went wrong hardly counts, and what is learned does not swing from one to the next.

With w_k the inverse variance of trial k, the offsets are sum w_k (u_k - J^+ Q e_k) / sum w_k:
the minimum variance estimate of independent ones (Gauss and Markov).  The classic law takes the
last trial alone (see `learning`); then its chance errors would be drawn the next time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from laptop.measure.ilc.learning import Offsets, TrajectoryError, corrected, joined, softened
from laptop.measure.ilc.piece_path import PiecePath
from shared.arm_description import Arm

MODEL_ERROR = 0.15
"""Error of a correction, a share of what was missed: of the links, and of the camera's pose."""

FLOOR_SHARE = 1.0
"""Difference of two drawings of a stroke, in units of what half a count makes, see `floor`."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One trial of one stroke.

    offsets  with which it was drawn, piece by piece
    errors   trajectory error of each piece
    """

    offsets: Sequence[Offsets]
    errors: Sequence[TrajectoryError]

    @property
    def rms(self) -> float:
        """Root mean square of the trajectory error, cm."""
        weights = [error.s[-1] for error in self.errors]
        squares = [error.mean_square for error in self.errors]
        return float(np.sqrt(np.average(squares, weights=weights)))

    @property
    def greatest(self) -> float:
        """Greatest trajectory error, cm."""
        return max(error.greatest for error in self.errors)


@dataclass
class StrokeLearner:
    """Learns the joint offsets of one stroke from its trials.

    Attributes:
        pieces: its PiecePaths.
        floor: noise floor, what two drawings of it differ by, about, rms, cm.
        first: offsets with which it began: none, or what was learned before.
        trials: so far.
    """

    pieces: Sequence[PiecePath]
    floor: float
    first: Sequence[Offsets]
    trials: list[Trial] = field(default_factory=list)

    def add(self, errors: Sequence[TrajectoryError]) -> None:
        """Add the errors of a trial that was drawn with `offsets`."""
        self.trials.append(Trial(self.offsets, errors))

    @property
    def offsets(self) -> Sequence[Offsets]:
        """The best that is known, piece by piece."""
        if not self.trials or self.has_no_gain:
            return self.first
        proposed = [
            [
                corrected(piece, own, error)
                for piece, own, error in zip(self.pieces, trial.offsets, trial.errors, strict=True)
            ]
            for trial in self.trials
        ]
        weights = [1 / self._variance(trial) for trial in self.trials]
        to_learn = self.trials[0].rms ** 2 - self._noise(self.trials[0])
        if to_learn <= 0:
            return self.first
        every, weights = [list(self.first), *proposed], [1 / to_learn, *weights]
        means = [
            Offsets(own[0].s, np.average([offsets.q for offsets in own], axis=0, weights=weights))
            for own in zip(*every, strict=True)
        ]
        soft = [softened(piece, own) for piece, own in zip(self.pieces, means, strict=True)]
        return joined(soft)

    def _noise(self, trial: Trial) -> float:
        """Mean square of what a trial missed by chance, cm^2."""
        seen = max(error.sigma for error in trial.errors)
        return self.floor**2 + seen**2

    def _variance(self, trial: Trial) -> float:
        return self._noise(trial) + (MODEL_ERROR * trial.rms) ** 2

    @property
    def is_at_noise_floor(self) -> bool:
        """Whether there is no more to learn: all trials, or the last two, missed by chance.

        One of them after others is still worth a second: the mean of both is surer.
        """
        last = self.trials[-2:]
        by_chance = [trial.rms**2 <= self._noise(trial) for trial in last]
        return bool(last) and all(by_chance)

    @property
    def has_no_gain(self) -> bool:
        """Whether nothing that was tried was better than what it began with."""
        before, *tried = self.trials
        return bool(tried) and min(trial.rms for trial in tried) >= before.rms


def floor(arm: Arm, pieces: Sequence[PiecePath]) -> float:
    """Return what two drawings of a stroke differ by, about, rms, cm: encoders count degrees.

    An angle that is known to a count is wrong by a count / sqrt(12), rms.

    Args:
        arm: that draws it.
        pieces: of the stroke.
    """
    count = np.radians([1 / joint.gear for joint in arm.joints]) / np.sqrt(12)
    squares = []
    for piece in pieces:
        across = np.einsum("nk,nkj->nj", piece.left, piece.turns)
        squares.append(((across * count) ** 2).sum(axis=1).mean())
    weights = [piece.length for piece in pieces]
    return FLOOR_SHARE * float(np.sqrt(np.average(squares, weights=weights)))
