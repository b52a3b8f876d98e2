"""Rigid fit in the plane: the motion by which points come nearest to others.  Pure.

Given points a_i and goals b_i, find the turn R and shift t that minimise sum |R a_i + t - b_i|^2.
The best shift takes the mean of the points to that of the goals, whatever R is.  With both means
taken off, R maximises trace(R sum a_i b_i^T).  In general that takes a singular value decomposition
and a check that R is no reflection (W. Kabsch, Acta Cryst. A32, 1976; S. Umeyama, PAMI 13, 1991).
In the plane it is a closed form: the trace is C cos(turn) + S sin(turn) with C = sum a_i . b_i and
S = sum a_i x b_i, which is greatest at turn = atan2(S, C).  No reflection can come of that, and no
iteration is needed.  A fitted scale (a similarity) would hide that links are too long or a board
is printed too small, so it is left at 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class PlaneMotion(NamedTuple):
    """A turn about the origin, rad, and then a shift, (x, y), cm."""

    turn: float
    shift: tuple[float, float]

    def moved(self, points: np.ndarray) -> np.ndarray:
        """Return where points (n, 2), cm, come by it."""
        return np.asarray(points @ rotation(self.turn).T + self.shift)


def nearest_motion(points: np.ndarray, goals: np.ndarray) -> PlaneMotion:
    """Return the motion of points (n, 2), cm, that leaves least squares to goals (n, 2)."""
    a, b = points - points.mean(axis=0), goals - goals.mean(axis=0)
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    x, y = goals.mean(axis=0) - rotation(turn) @ points.mean(axis=0)
    return PlaneMotion(turn, (float(x), float(y)))


def rotation(turn: float, d: int = 2) -> np.ndarray:
    """Return the matrix (d, d) that turns counter-clockwise about the vertical, rad."""
    matrix = np.eye(d)
    matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    return matrix
