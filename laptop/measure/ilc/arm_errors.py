"""Errors of an arm's description, from the offsets of a few strokes; offsets of all others.  Pure.

The tip of an arm with links l_k, its joints at the angles q, is in the plane at

    f(q, l) = sum_k l_k (cos a_k, sin a_k),    a_k = q_1 + ... + q_k.

An arm that is not as described has other links, l + d, its zeros are off by z, and its backlash is
wider to each side by h.  Let sigma be the sides to which the planned backlash lies, u the offsets
that a stroke was taught, and p = f(q, l) its path; then

    f(q + u + z + diag(sigma) h, l + d) = p.

A load that is too weak to move a link through its backlash changes none of these; a stronger one
presses it to one side while it stands and not while it is pushed, and is foretold in part.

From the taught strokes follow z, h and d, by nonlinear least squares (Gauss and Newton), each with
a prior of its usual size (ridge regression: Hoerl and Kennard, 1970); for all others the same
equation is solved for u.  The errors are smooth along a stroke: its knots count as so many
observations as it has wavelengths that are learned.

Which of the three kinds of error are fitted at all, each stroke tells that is left out and foretold
from the others (cross-validation: Stone, 1974).  Where none of them foretells better than to expect
no error, nothing is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from laptop.measure.ilc.learning import (
    ACROSS_WAVELENGTH,
    END_LENGTH,
    Offsets,
    joined,
    none,
    softened,
)
from laptop.measure.ilc.piece_path import PiecePath
from shared.arm_description import Arm

ZEROS, BACKLASH, LINKS = "zeros", "backlash", "links"
KINDS = (ZEROS, BACKLASH, LINKS)
"""Kinds of error that are fitted."""

PRIOR_SIGMAS = {ZEROS: np.radians(1.5), BACKLASH: np.radians(1.0), LINKS: 0.5}
"""Usual size of each, standard deviation: rad, rad and cm."""

NOISE = 0.06
"""Standard deviation of what the offsets of a wavelength are wrong by, cm."""

MIN_STROKES = 3
"""Fewest strokes from which others are foretold."""

MAX_SHARE = 0.6
"""Greatest share of the mean square error that may be left of strokes that were left out: of 100
times six strokes that err by chance, 2 are below it."""

STEPS = 4
"""Number of Newton's steps."""

Values = dict[str, np.ndarray]
"""Errors of an arm, by kind, of each joint."""

Stroke = Sequence[tuple[PiecePath, Offsets]]
"""A stroke's pieces with their offsets."""


@dataclass(frozen=True, eq=False)
class ArmErrors:
    """Errors of an arm's description, as far as they are known.

    Attributes:
        values: see Values; none: nothing foretells a stroke.
        without_cm: rms error of the strokes as the arm is described, cm.
        left_cm: of each stroke as the others foretell it, rms, cm.
    """

    values: Values
    without_cm: float
    left_cm: float

    def offsets(self, arm: Arm, pieces: Sequence[PiecePath]) -> list[Offsets]:
        """Return the offsets of a stroke's pieces that take these errors off."""
        return joined([softened(piece, self._of_piece(arm, piece)) for piece in pieces])

    def _of_piece(self, arm: Arm, piece: PiecePath) -> Offsets:
        own = none(piece)
        knots = _Knots(arm, piece, own)
        for _ in range(STEPS if self.values else 0):
            missed, turns = knots.missed(self.values)
            own.q[:] -= np.einsum("njk,nk->nj", np.linalg.pinv(turns), missed)
        return own


class _Knots:
    """The knots of a piece's offsets.

    Args:
        arm: as described.
        piece: the path.
        offsets: of it; they may change.
    """

    def __init__(self, arm: Arm, piece: PiecePath, offsets: Offsets) -> None:
        self._links = np.array([joint.link for joint in arm.joints])
        self._q, self._offsets = piece.at(offsets.s, piece.q), offsets
        self._sides = piece.at(offsets.s, piece.sides)
        self._desired = (_headings(self._q) * self._links[:, None]).sum(axis=1)

    def _angles(self, values: Values) -> np.ndarray:
        turned = values.get(ZEROS, 0.0) + self._sides * values.get(BACKLASH, 0.0)
        return np.asarray(self._q + self._offsets.q + turned)

    def missed(self, values: Values) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much the tip misses its path, (n, 2), cm, and its Jacobian, (n, 2, joints).

        Args:
            values: errors of the arm, by kind.
        """
        links = (self._links + values.get(LINKS, 0.0))[:, None]
        along = _headings(self._angles(values)) * links
        # A joint turns all links from its own on.
        beyond = np.cumsum(along[:, ::-1], axis=1)[:, ::-1]
        turns = np.stack([-beyond[:, :, 1], beyond[:, :, 0]], axis=1)
        return along.sum(axis=1) - self._desired, turns

    def columns(self, values: Values, turns: np.ndarray, kind: str) -> np.ndarray:
        """Return the tip's moves by each joint's error of a kind, (n, 2, joints)."""
        if kind == LINKS:
            return _headings(self._angles(values)).transpose(0, 2, 1)
        return np.asarray(turns * self._sides[:, None, :]) if kind == BACKLASH else turns


def _headings(q: np.ndarray) -> np.ndarray:
    """Return the links' unit vectors, (n, joints, 2), at the joints' angles, (n, joints), rad."""
    angles = np.cumsum(q, axis=1)
    return np.stack([np.cos(angles), np.sin(angles)], axis=2)


class _StrokeRows:
    """Equations of a stroke, weighted: across it everywhere, and along it where its tip stands.

    Attributes:
        weight: number of its observations.
    """

    def __init__(self, arm: Arm, stroke: Stroke) -> None:
        length = sum(piece.length for piece, _ in stroke)
        self.weight = (length + END_LENGTH) / ACROSS_WAVELENGTH
        self._pieces = []
        for number, (piece, own) in enumerate(stroke):
            along = np.zeros(len(own.s))
            along[0] = END_LENGTH / 2 * (number == 0)
            along[-1] = END_LENGTH / 2 * (number == len(stroke) - 1)
            lengths = np.gradient(own.s), np.minimum(along, length / 2)
            units = piece.at(own.s, piece.left), piece.at(own.s, piece.ahead)
            weighted = [
                np.sqrt(by / ACROSS_WAVELENGTH)[:, None] * unit
                for by, unit in zip(lengths, units, strict=True)
            ]
            self._pieces.append((_Knots(arm, piece, own), weighted))

    def linear(self, values: Values, kinds: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the weighted errors, (n,), cm, and their matrix, for small changes of values."""
        errors, matrices = [], []
        for knots, weighted in self._pieces:
            missed, turns = knots.missed(values)
            columns = [knots.columns(values, turns, kind) for kind in kinds]
            matrix = np.concatenate([turns[:, :, :0], *columns], axis=2)
            for units in weighted:
                errors.append((units * missed).sum(axis=1))
                matrices.append(np.einsum("nk,nkm->nm", units, matrix))
        return np.concatenate(errors), np.vstack(matrices)

    def square(self, values: Values) -> float:
        """Return the weighted sum of squares, cm^2."""
        errors, _ = self.linear(values, ())
        return float((errors**2).sum())


def _fitted(rows: Sequence[_StrokeRows], kinds: Sequence[str], joints: int) -> Values:
    """Return the errors of these kinds from the equations of strokes."""
    sigmas = np.repeat([PRIOR_SIGMAS[kind] for kind in kinds], joints)
    ridge = (NOISE / sigmas) ** 2
    found = np.zeros(len(sigmas))
    for _ in range(STEPS):
        values = dict(zip(kinds, np.split(found, len(kinds)), strict=True))
        parts = [own.linear(values, kinds) for own in rows]
        errors = np.concatenate([own for own, _ in parts])
        matrix = np.vstack([own for _, own in parts])
        wanted = matrix.T @ errors + ridge * found
        found = found - np.linalg.solve(matrix.T @ matrix + np.diag(ridge), wanted)
    return dict(zip(kinds, np.split(found, len(kinds)), strict=True))


def fit(arm: Arm, strokes: Sequence[Stroke]) -> ArmErrors:
    """Return the errors of an arm that the offsets of taught strokes tell.

    Args:
        arm: as described, in the plane.
        strokes: each with its learned offsets; none of them is joined to another one.
    """
    rows = [_StrokeRows(arm, stroke) for stroke in strokes]
    without = sum(own.square({}) for own in rows)
    weight, joints = sum(own.weight for own in rows), len(arm.joints)
    best: tuple[str, ...] = ()
    least = MAX_SHARE * without
    if len(rows) >= MIN_STROKES:
        every = chain.from_iterable(combinations(KINDS, n) for n in range(1, len(KINDS) + 1))
        for kinds in every:
            left = sum(
                own.square(_fitted([*rows[:k], *rows[k + 1 :]], kinds, joints))
                for k, own in enumerate(rows)
            )
            if left < least:
                best, least = kinds, left
    values = _fitted(rows, best, joints) if best else {}
    left_cm = float(np.sqrt((least if best else without) / weight))
    return ArmErrors(values, float(np.sqrt(without / weight)), left_cm)
