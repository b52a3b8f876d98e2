"""The rigid motion in the plane by which points come nearest to others.  Pure."""

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


# The rotation of least squares between two sets of paired points (W. Kabsch, 1976), in the plane:
# with both sets about their means, sum |R a - b|^2 is least where sum (R a) . b is greatest, at
#     turn = atan2(sum a x b, sum a . b),
# and the shift takes one mean to the other: no first guess, no iteration, and never a mirror image,
# which the singular values of the usual way in space would have to be kept from.
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
