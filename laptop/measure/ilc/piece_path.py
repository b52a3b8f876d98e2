"""One smooth piece of a stroke as the tip is to go, and as the joints are planned to.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robot.motion import kinematics, trajectory
from robot.motion.backlash import BacklashCompensation, crossed_turns
from robot.motion.gravity import Gravity
from robot.motion.trajectory import Trajectory
from shared.arm_description import Arm

PLACE_SPACING = 0.1
"""Greatest distance between two sampled places, cm."""

MIN_PLACES = 9
"""Fewest places of a piece."""


@dataclass(frozen=True, eq=False)
class PiecePath:
    """A piece, place by place.

    Attributes:
        s: arc length from its beginning, (n,), cm; it grows.
        t: when the tip is to be there, s from its beginning, (n,).
        p: where that is, (n, 2), cm.
        ahead: unit vectors along it, (n, 2).
        q: the joints' angles there, (n, joints), rad.
        turns: the tip's moves (cm) by the joints' (rad): the Jacobian, (n, 2, joints).
        back: its inverse, (n, joints, 2).
        sides: where each joint's backlash lies as it is planned, -1 to 1, (n, joints).
    """

    s: np.ndarray
    t: np.ndarray
    p: np.ndarray
    ahead: np.ndarray
    q: np.ndarray
    turns: np.ndarray
    back: np.ndarray
    sides: np.ndarray

    @property
    def length(self) -> float:
        """Length of the path, cm."""
        return float(self.s[-1])

    @property
    def duration(self) -> float:
        """Planned duration, s."""
        return float(self.t[-1])

    @property
    def left(self) -> np.ndarray:
        """Unit vectors across it, to its left, (n, 2)."""
        return np.column_stack([-self.ahead[:, 1], self.ahead[:, 0]])

    def at(self, s: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return values (n, ...), known at its places, at other lengths (k,)."""
        flat = values.reshape(len(values), -1)
        out = np.stack([np.interp(s, self.s, column) for column in flat.T], axis=1)
        return out.reshape(len(s), *values.shape[1:])


def paths_of(arm: Arm, motions: Sequence[Trajectory]) -> list[PiecePath]:
    """Return the paths of a stroke's planned pieces.

    Args:
        arm: that draws it; in space its height is not looked at.
        motions: as planned.
    """
    gravity = Gravity(arm)
    preload = gravity.preload_sides if gravity.loaded else None
    # It is approached from behind: all backlash is taken up along its direction.
    sides = gravity.sides(motions[0].start, crossed_turns(arm.joints, motions[0])[0])
    out = []
    for motion in motions:
        backlash = BacklashCompensation(arm.joints, motion, sides, preload)
        out.append(_path(arm, motion, backlash))
        sides = backlash.sides
    return out


def _path(arm: Arm, motion: Trajectory, backlash: BacklashCompensation) -> PiecePath:
    times, segments, _ = motion.numbers()
    s, t, q, slopes = [], [], [], []
    lengths = [(b - a) * (v + 0.5 * c * (b - a)) for a, b, (v, c, _, _) in _spans(times, segments)]
    counts = np.maximum(1, np.ceil(np.array(lengths) / PLACE_SPACING)).astype(int)
    counts = np.maximum(counts, -(-MIN_PLACES // len(counts)))
    begun = 0.0
    for (start, _, (v, a, cubics, _)), length, count in zip(
        _spans(times, segments), lengths, counts.tolist(), strict=True
    ):
        own = np.linspace(0.0, length, count + 1)
        own = own if length + begun >= sum(lengths) - 1e-9 else own[:-1]
        powers = np.stack([np.ones_like(own), own, own**2, own**3])
        s += (begun + own).tolist()
        # The speed is v at the beginning and grows by a: s = v t + a t^2 / 2.
        speeds = v + np.sqrt(np.maximum(v * v + 2 * a * own, 0.0))
        t += (start + np.divide(2 * own, speeds, out=np.zeros_like(own), where=speeds > 0)).tolist()
        q += (np.array(cubics) @ powers).T.tolist()
        derivatives = np.array(cubics)[:, 1:] * [1, 2, 3]
        slopes += (derivatives @ powers[:3]).T.tolist()
        begun += length
    jacobians = np.array([kinematics.jacobian(arm, pose) for pose in q])
    ahead = np.einsum("nij,nj->ni", jacobians, np.array(slopes))[:, :2]
    return PiecePath(
        np.array(s),
        np.array(t),
        np.array([kinematics.forward(arm, pose)[:2] for pose in q]),
        ahead / np.linalg.norm(ahead, axis=1, keepdims=True),
        np.array(q),
        jacobians[:, :2],
        np.linalg.pinv(jacobians)[:, :, :2],
        np.array([backlash.sides_at(at) for at in t], float),
    )


def _spans(
    times: Sequence[float], segments: Sequence[trajectory.Segment]
) -> list[tuple[float, float, trajectory.Segment]]:
    return list(zip(times, times[1:], segments, strict=False))
