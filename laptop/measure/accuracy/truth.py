"""True places of the tip, by the record of an emulated arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from laptop.measure.accuracy.plan import PlannedWay
from laptop.measure.accuracy.sighting import Places, nearest_stand
from laptop.measure.measured_run import SETTLED_SHARE, MeasuredRun


def true_places(
    record: Sequence[Any], ways: Sequence[PlannedWay], run: MeasuredRun
) -> Iterator[tuple[PlannedWay, Places]]:
    """Yield each way with where the tip truly was: at its end at rest, or all along a path.

    Args:
        record: MotionSamples of the run.
        ways: of its job.
        run: whose rows tell when.
    """
    t = np.array([row.t for row in record])
    tips = np.array([(row.x, row.y) if row.z is None else (row.x, row.y, row.z) for row in record])
    rests = {row.stroke: row.t for row in run.rows if row.rest}
    begins: dict[int, float] = {}
    for row in run.rows:
        begins.setdefault(row.stroke, row.t)
    for number, way in enumerate(ways, 1):
        end = rests[number]
        if way.what == "path":
            along = tips[(t >= begins[number]) & (t <= end - run.rest)]
        else:
            along = tips[(t > end - SETTLED_SHARE * run.rest) & (t <= end)].mean(axis=0)[None]
        n, d = along.shape
        yield way, Places(along, np.zeros((n, d, d)), np.zeros((n, d, 0)))


def in_nearest_frame(
    truth: Sequence[tuple[PlannedWay, Places]],
) -> list[tuple[PlannedWay, Places]]:
    """Return true places in that frame in which the poses are nearest to where they should be."""
    poses = [(way.way[-1], places.points[0]) for way, places in truth if way.what == "pose"]
    commanded, attained = (np.array(points) for points in zip(*poses, strict=True))
    stand = nearest_stand(attained[:, :2], commanded[:, :2])
    return [(way, stand.in_arm(places)) for way, places in truth]
