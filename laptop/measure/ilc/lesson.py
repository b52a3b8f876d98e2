"""Offsets of one stroke from all its rehearsals together; and when to stop.  Pure.

Each rehearsal says where the offsets should be: where they were, less what was missed.  It is wrong
by what two drawings of one stroke differ by anyway, and by a share of what was missed.  So the
offsets to come are the mean of what all rehearsals say, each weighed by how sure it is; and of
those that the stroke began with, weighed by how much there is to learn at all.  A rehearsal that
went wrong hardly counts, and what is learned does not swing from one to the next.

With w_k the inverse variance of rehearsal k, the offsets are sum w_k (u_k - J^+ Q e_k) / sum w_k:
the minimum variance estimate of independent ones (Gauss and Markov).  The classic law takes the
last rehearsal alone (see `learning`); then its chance errors would be drawn the next time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from laptop.measure.ilc.learning import Offsets, PathMiss, corrected, joined, softened
from laptop.measure.ilc.way import PiecePath
from shared.arm_description import Arm

MODEL_ERROR = 0.15
"""Error of a correction, a share of what was missed: of the links, and of the camera's pose."""

FLOOR_SHARE = 1.0
"""Difference of two drawings of a stroke, in units of what half a count makes, see `floor`."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One, of one stroke.

    offsets  with which it was drawn, piece by piece
    missed   by how much that missed
    """

    offsets: Sequence[Offsets]
    missed: Sequence[PathMiss]

    @property
    def rms(self) -> float:
        """Of what was missed, cm."""
        weights = [miss.s[-1] for miss in self.missed]
        squares = [miss.mean_square for miss in self.missed]
        return float(np.sqrt(np.average(squares, weights=weights)))

    @property
    def greatest(self) -> float:
        """Of what was missed, cm."""
        return max(miss.greatest for miss in self.missed)


@dataclass
class Lesson:
    """Learning of one stroke.

    Attributes:
        pieces: its PiecePaths.
        floor: what two drawings of it differ by, about, rms, cm.
        first: offsets with which it began: none, or what was learned before.
        rehearsals: so far.
    """

    pieces: Sequence[PiecePath]
    floor: float
    first: Sequence[Offsets]
    rehearsals: list[Trial] = field(default_factory=list)

    def add(self, missed: Sequence[PathMiss]) -> None:
        """Take in a rehearsal that was drawn with `offsets`."""
        self.rehearsals.append(Trial(self.offsets, missed))

    @property
    def offsets(self) -> Sequence[Offsets]:
        """The best that is known, piece by piece."""
        if not self.rehearsals or self.is_in_vain:
            return self.first
        wished = [
            [
                corrected(piece, own, miss)
                for piece, own, miss in zip(self.pieces, one.offsets, one.missed, strict=True)
            ]
            for one in self.rehearsals
        ]
        weights = [1 / self._variance(one) for one in self.rehearsals]
        to_learn = self.rehearsals[0].rms ** 2 - self._noise(self.rehearsals[0])
        if to_learn <= 0:
            return self.first
        every, weights = [list(self.first), *wished], [1 / to_learn, *weights]
        means = [
            Offsets(own[0].s, np.average([one.q for one in own], axis=0, weights=weights))
            for own in zip(*every, strict=True)
        ]
        soft = [softened(piece, own) for piece, own in zip(self.pieces, means, strict=True)]
        return joined(soft)

    def _noise(self, one: Trial) -> float:
        """Mean square of what a rehearsal missed by chance, cm^2."""
        seen = max(miss.unsure for miss in one.missed)
        return self.floor**2 + seen**2

    def _variance(self, one: Trial) -> float:
        return self._noise(one) + (MODEL_ERROR * one.rms) ** 2

    @property
    def is_at_floor(self) -> bool:
        """Whether there is no more to learn: all rehearsals, or the last two, missed by chance.

        One of them after others is still worth a second: the mean of both is surer.
        """
        last = self.rehearsals[-2:]
        by_chance = [one.rms**2 <= self._noise(one) for one in last]
        return bool(last) and all(by_chance)

    @property
    def is_in_vain(self) -> bool:
        """Whether nothing that was tried was better than what it began with."""
        before, *tried = self.rehearsals
        return bool(tried) and min(one.rms for one in tried) >= before.rms


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
