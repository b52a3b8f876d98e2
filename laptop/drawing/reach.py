"""Reach of the arm's tip on the table, for many points at once.  Pure.

The formulas are those of robot.motion.chains, by numpy for all points together.  A *posture* is
the way the elbow is bent, "up" or "down"; within one a stroke can be drawn whole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robot.motion import kinematics
from shared.arm_description import Arm, ArmError

POSTURES = ("up", "down")

SPACING = 0.1
"""Greatest distance between points of a stroke that are tried, cm."""

MAX_JOINT_STEP = math.radians(30)
"""Greatest turn of a joint between two of these, rad: a larger one is a change of posture."""

LIMIT_MARGIN = math.radians(0.1)
"""Distance that joints keep from their limits, rad: a curve may bulge out between its points."""

EASY_MARGIN, EASY_SINGULARITY = math.radians(1), 0.3
"""Distance from the joint limits, rad, and least `kinematics.singularity`, where the arm moves
easily."""

CELL_SIZE = 0.1
"""Width of a cell of a ReachMap, cm."""


def joint_angles(
    arm: Arm,
    points: np.ndarray,
    elbow: str,
    margin: float = 0.0,
    least_singularity: float = 0.0,
) -> np.ndarray:
    """Return joint angles, rad, that bring the tip to each point; NaN where there are none.

    Args:
        arm: shared.arm_description.Arm.
        points: (n, 2) or (n, 3), cm.
        elbow: "up" or "down".
        margin: to keep off the joints' limits, rad.
        least_singularity: to keep off singular poses, see kinematics.singularity.

    Returns:
        (n, joints), rad.

    Raises:
        ArmError: a chain that is not known here.
    """
    if arm.chain == "planar":
        poses = [_planar(arm, points, elbow)]
    elif arm.chain == "spatial":
        poses = _spatial(arm, points, elbow)
    else:
        raise ArmError(
            f"{arm.file}: no drawing with chain = {arm.chain}; use one of planar, spatial"
        )
    lower = np.array([joint.lower for joint in arm.joints])
    upper = np.array([joint.upper for joint in arm.joints])
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    chosen = np.full((len(points), len(arm.joints)), np.nan)
    for q in poses:
        q = q - kinematics.TURN * np.round((q - middle) / kinematics.TURN)
        with np.errstate(invalid="ignore"):
            allowed = (np.abs(q - middle) <= half - margin + kinematics.LIMIT_SLACK).all(axis=1)
            allowed &= singularity(arm, q) >= least_singularity
        chosen_now = allowed & np.isnan(chosen[:, 0])
        chosen[chosen_now] = np.clip(q[chosen_now], lower, upper)
    return chosen


def _bend(arm: Arm, ahead: np.ndarray, height: np.ndarray, bent: int) -> list[np.ndarray]:
    """Return [heading of the upper link, bend of the forearm], rad; NaN out of reach."""
    upper, fore = arm.joints[-2].link, arm.joints[-1].link
    hole, outer = abs(upper - fore), upper + fore
    far = np.hypot(ahead, height)
    slack = 1e-9
    inside = (far >= hole - slack) & (far <= outer + slack)
    far = np.where(inside, far, np.nan)
    bend = 2 * np.arctan2(
        np.sqrt(np.maximum(0.0, (outer - far) * (outer + far))),
        np.sqrt(np.maximum(0.0, (far - hole) * (far + hole))),
    )
    bend = np.where(inside, bend, np.nan)
    heading = np.arctan2(height, ahead)
    within = np.arctan2(fore * np.sin(bend), upper + fore * np.cos(bend))
    return [heading - bent * within, bent * bend]


def _planar(arm: Arm, points: np.ndarray, elbow: str) -> np.ndarray:
    bent = 1 if elbow == "up" else -1
    return np.column_stack(_bend(arm, points[:, 0], points[:, 1], bent))


def _spatial(arm: Arm, points: np.ndarray, elbow: str) -> list[np.ndarray]:
    """Return the poses that face the point, and those bent over backwards, elbow mirrored."""
    out = np.hypot(points[:, 0], points[:, 1])
    yaw = np.arctan2(points[:, 1], points[:, 0])
    height = points[:, 2] - arm.joints[0].link
    bent = -1 if elbow == "up" else 1
    facing = np.column_stack([yaw, *_bend(arm, out, height, bent)])
    behind = np.column_stack([yaw + math.pi, *_bend(arm, -out, height, -bent)])
    # Of both, the one that a motion begins with is the nearer to home; the arm faces its paper.
    return [facing, behind]


def singularity(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Return `kinematics.singularity` for poses (n, joints), rad: (n,)."""
    if arm.chain == "planar":
        return np.abs(np.sin(q[:, 1]))
    upper, fore = arm.joints[1].link, arm.joints[2].link
    out = upper * np.cos(q[:, 1]) + fore * np.cos(q[:, 1] + q[:, 2])
    return np.abs(np.sin(q[:, 2]) * out) / (upper + fore)


def on_table(arm: Arm, points: np.ndarray, height: float) -> np.ndarray:
    """Return the table points (n, 2) as the arm takes them, in space with their height, cm."""
    if kinematics.coordinates(arm) == 2:
        return points
    return np.column_stack([points, np.full(len(points), height)])


def densified(
    strokes: Sequence[np.ndarray], spacing: float = SPACING
) -> tuple[np.ndarray, np.ndarray]:
    """Return lines (n, 2), cm, with points at most `spacing` apart.

    Returns:
        All points (m, 2), one stroke after the other; and the number of each one's stroke, (m,).
    """
    if not strokes:
        return np.empty((0, 2)), np.empty(0, int)
    points = np.vstack(strokes)
    ends = np.cumsum([len(stroke) for stroke in strokes]) - 1
    steps = np.diff(points, axis=0, append=points[-1:])
    steps[ends] = 0.0  # from one stroke to the next nothing is drawn
    counts = np.maximum(1, np.ceil(np.hypot(*steps.T) / spacing - 1e-9)).astype(int)
    first = np.cumsum(counts) - counts
    k = np.repeat(np.arange(len(points)), counts)
    share = (np.arange(len(k)) - first[k]) / counts[k]
    number = np.repeat(np.arange(len(strokes)), [len(stroke) for stroke in strokes])
    return points[k] + share[:, None] * steps[k], number[k]


@dataclass(frozen=True, eq=False)
class Reached:
    """Points that were tried, one after the other along strokes.

    points       (n, 2), cm
    stroke       (n,): number of its stroke, from 0 on
    poses        per posture (n, joints), rad; NaN: not in that one
    is_complete  per posture (strokes,): whether a stroke can be drawn in it from end to end
    """

    points: np.ndarray
    stroke: np.ndarray
    poses: dict[str, np.ndarray]
    is_complete: dict[str, np.ndarray]

    def runs(self, posture: str) -> np.ndarray:
        """Return the number of points from each one on, on its stroke, without a leap: (n,)."""
        joined = _joined(self.poses[posture], self.stroke)
        allowed = ~np.isnan(self.poses[posture][:, 0])
        ends = np.flatnonzero(np.append(~joined, True))
        last = ends[np.searchsorted(ends, np.arange(len(allowed)))]
        return np.where(allowed, last - np.arange(len(allowed)) + 1, 0)


def _joined(poses: np.ndarray, stroke: np.ndarray) -> np.ndarray:
    """Return whether the arm gets from each point to the next of the same stroke: (n - 1,)."""
    with np.errstate(invalid="ignore"):
        near = (np.abs(np.diff(poses, axis=0)) <= MAX_JOINT_STEP).all(axis=1)
    return near & (np.diff(stroke) == 0)


def try_strokes(
    arm: Arm,
    strokes: Sequence[np.ndarray],
    height: float,
    postures: tuple[str, ...] = POSTURES,
    margin: float = LIMIT_MARGIN,
    least_singularity: float = 0.0,
) -> Reached:
    """Try strokes (n, 2), cm, on the table in each posture."""
    points, number = densified(strokes)
    poses, is_complete = {}, {}
    for posture in postures:
        q = joint_angles(arm, on_table(arm, points, height), posture, margin, least_singularity)
        poses[posture] = q
        broken = np.isnan(q[:, 0])
        broken[:-1] |= ~_joined(q, number) & (np.diff(number) == 0)
        is_complete[posture] = np.bincount(number, broken, len(strokes)) == 0
    return Reached(points, number, poses, is_complete)


@dataclass(frozen=True, eq=False)
class ReachMap:
    """The table in cells of CELL_SIZE: bit k is set where POSTURES[k] has the middle of the cell.

    cells   (m, m) uint8, by y and x
    origin  x and y of the middle of the first cell, cm
    """

    cells: np.ndarray
    origin: float

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the posture bits at points (..., 2), cm; 0 beyond the map."""
        size = len(self.cells)
        k = np.rint((points - self.origin) / CELL_SIZE).astype(np.int32)
        inside = ((k >= 0) & (k < size)).all(axis=-1)
        k = np.where(inside[..., None], k, 0)
        return np.where(inside, self.cells[k[..., 1], k[..., 0]], 0)


def reach_map(
    arm: Arm,
    height: float,
    postures: tuple[str, ...] = POSTURES,
    margin: float = LIMIT_MARGIN,
    least_singularity: float = 0.0,
) -> ReachMap:
    """Return the map of where on the table the arm can draw, and in which posture."""
    _, outer = kinematics.reach(arm)
    half = int(math.ceil(outer / CELL_SIZE)) + 2
    places = np.arange(-half, half + 1) * CELL_SIZE
    x, y = np.meshgrid(places, places)
    points = on_table(arm, np.column_stack([x.ravel(), y.ravel()]), height)
    cells = np.zeros(x.size, np.uint8)
    for posture in postures:
        q = joint_angles(arm, points, posture, margin, least_singularity)
        cells |= (~np.isnan(q[:, 0])).astype(np.uint8) << POSTURES.index(posture)
    return ReachMap(cells.reshape(x.shape), float(places[0]))
