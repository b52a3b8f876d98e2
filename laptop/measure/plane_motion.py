"""The rigid motion in the plane by which points come nearest to others.  Pure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class PlaneMotion(NamedTuple):
    """A turn about the origin, rad, and then a shift, (x, y), cm."""

    turn: float
    shift: tuple[float, float]


def nearest_motion(points: np.ndarray, goals: np.ndarray) -> PlaneMotion:
    """Return the motion of points (n, 2), cm, that leaves least squares to goals (n, 2).

    After W. Kabsch (1976), in the plane.
    """
    a, b = points - points.mean(axis=0), goals - goals.mean(axis=0)
    turn = float(np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum()))
    x, y = goals.mean(axis=0) - turning(turn, 2) @ points.mean(axis=0)
    return PlaneMotion(turn, (float(x), float(y)))


def turning(turn: float, d: int) -> np.ndarray:
    """Return the matrix (d, d) that turns about the vertical, rad."""
    matrix = np.eye(d)
    matrix[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    return matrix
