"""True places of the tip, by the record of an emulated arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from laptop.measure.accuracy.plan import PlannedMotion
from laptop.measure.accuracy.sighting import Places, nearest_arm_pose
from laptop.measure.run_data import SETTLED_SHARE, RunData


def true_places(
    record: Sequence[Any], motions: Sequence[PlannedMotion], run: RunData
) -> Iterator[tuple[PlannedMotion, Places]]:
    """Yield each motion with where the tip truly was: at its end at rest, or all along a path.

    Args:
        record: MotionSamples of the run.
        motions: of its job.
        run: whose rows tell when.
    """
    t = np.array([row.t for row in record])
    tips = np.array([(row.x, row.y) if row.z is None else (row.x, row.y, row.z) for row in record])
    rests = {row.stroke: row.t for row in run.rows if row.rest}
    begins: dict[int, float] = {}
    for row in run.rows:
        begins.setdefault(row.stroke, row.t)
    for number, motion in enumerate(motions, 1):
        end = rests[number]
        if motion.what == "path":
            along = tips[(t >= begins[number]) & (t <= end - run.rest)]
        else:
            along = tips[(t > end - SETTLED_SHARE * run.rest) & (t <= end)].mean(axis=0)[None]
        n, d = along.shape
        yield motion, Places(along, np.zeros((n, d, d)), np.zeros((n, d, 0)))


def in_nearest_frame(
    truth: Sequence[tuple[PlannedMotion, Places]],
) -> list[tuple[PlannedMotion, Places]]:
    """Return true places in that frame in which the poses are nearest to where they should be."""
    poses = [(m.points[-1], places.points[0]) for m, places in truth if m.what == "pose"]
    commanded, attained = (np.array(points) for points in zip(*poses, strict=True))
    arm_pose = nearest_arm_pose(attained[:, :2], commanded[:, :2])
    return [(m, arm_pose.in_arm(places)) for m, places in truth]
