"""Choice of a few strokes of a drawing that stand for all: joint angles and directions.  Pure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from laptop.measure.ilc.piece_path import PiecePath

DIRECTION_SHARE = 0.5
"""Distance of two directions of a joint, in units of its range in the drawing."""

MIN_LENGTH = 1.0
"""Least length of a stroke that is chosen while there are longer ones, cm."""


def choose(strokes: Sequence[Sequence[PiecePath]], count: int) -> list[int]:
    """Return the numbers of strokes, from 0 on, in order, that lie farthest from one another.

    The first is the one farthest from the middle of all; each further one is as far as possible
    from its nearest chosen one (T. Gonzalez, 1985: at most twice as far as the best choice).

    Args:
        strokes: pieces of each.
        count: number of them to be chosen; all if there are no more.
    """
    if count >= len(strokes):
        return list(range(len(strokes)))
    features = np.array([_features(stroke) for stroke in strokes])
    joints = features.shape[1] // 3
    span = np.ptp(features[:, : 2 * joints].reshape(-1, joints), axis=0)
    scale = np.where(span > 0, span, 1.0)
    features[:, : 2 * joints] /= np.tile(scale, 2)
    features[:, 2 * joints :] *= DIRECTION_SHARE
    lengths = [sum(piece.length for piece in stroke) for stroke in strokes]
    usable = np.array(lengths) >= MIN_LENGTH
    if np.count_nonzero(usable) < count:
        usable = np.ones(len(strokes), bool)
    distance = np.linalg.norm(features - features[usable].mean(axis=0), axis=1)
    chosen: list[int] = []
    nearest = np.full(len(strokes), np.inf)
    for _ in range(count):
        k = int(np.argmax(np.where(usable, distance, -1.0)))
        chosen.append(k)
        usable[k] = False
        nearest = np.minimum(nearest, np.linalg.norm(features - features[k], axis=1))
        distance = nearest
    return sorted(chosen)


def _features(stroke: Sequence[PiecePath]) -> np.ndarray:
    """Return a stroke's joint angles at both ends, rad, and mean sides of the backlash."""
    sides = np.concatenate([piece.sides for piece in stroke]).mean(axis=0)
    return np.concatenate([stroke[0].q[0], stroke[-1].q[-1], sides])
