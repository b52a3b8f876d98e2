"""The truth about a demo, from the emulated brick's files; its claims decide nothing."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from laptop.emulator.host.clocks import UPTIME
from laptop.measure.demo.goals import CameraRig, Goal, Vector, slope
from laptop.measure.demo.processes import ENDED, ChildProcess, DemoFailed
from laptop.record.figures.line_accuracy import pen_down_runs
from laptop.record.servo import results


class TracePoint(NamedTuple):
    """One of trace.csv: s, true joint angles (rad), whether the pen was down."""

    t: float
    q: tuple[float, ...]
    pen: bool


def read_trace(file: Path) -> list[TracePoint]:
    """Read the true motion that `simulate` left.

    Raises:
        DemoFailed: it left none.
    """
    try:
        with file.open(newline="", encoding="ascii") as lines:
            heading, *rows = csv.reader(lines)
            joints = [column for column, name in enumerate(heading) if name.startswith("q")]
            trace = [
                TracePoint(float(row[0]), tuple(float(row[k]) for k in joints), row[-1] == "1")
                for row in rows
            ]
        if trace:
            return trace
        raise ValueError("no row")
    except (OSError, ValueError, IndexError):
        raise DemoFailed(f"{file} cannot be read; is the disk full?") from None


def _starting(home: Path) -> float:
    """Time a program took to start, of which the world's clock knows nothing, s.

    Raises:
        DemoFailed: `simulate` has not told.
    """
    try:
        return json.loads((home / SUMMARY).read_text(encoding="utf-8"))["start_s"] or 0.0
    except (OSError, ValueError, KeyError):
        raise DemoFailed(f"{home / SUMMARY} cannot be read; is the disk full?") from None


def record_goal_run(
    rig: CameraRig, goal: Goal, home: Path, program: ChildProcess
) -> dict[str, Any]:
    """Record one run of the servo as it truly was; results.read_goal_run reads it.

    Raises:
        DemoFailed: it ended without a verdict.
    """
    log = home.with_suffix(".jsonl")
    notes = results.read_log(log) if log.exists() else results.Log({}, [], [], [], None)
    if notes.verdict is None:
        program.wait(ENDED)
        raise program.failure()
    rows = read_trace(home / "trace.csv")
    zero = notes.run["clock"] - UPTIME - _starting(home)
    path = _path(rig, rows)
    tip = rig.centre("effector", rows[-1].q)
    record = {
        "name": goal.name,
        "log": log.name,
        "goal": [round(value, 3) for value in goal.pixels],
        "path": [
            [round(t - zero, 3), *(round(value, 2) for value in rig.truth(q))] for t, q in path
        ],
        "miss_mm": round(10 * math.dist(tip, goal.place), 3),
    }
    if len(rig) > 1:
        record["place"] = [round(value, 3) for value in goal.place]
        record["tips"] = [_rounded(rig.centre("effector", q)) for _, q in path]
        record["mm_per_px"] = round(_worth(rig, goal.place), 4)
    return record


def _rounded(values: Sequence[float] | np.ndarray) -> list[float]:
    return [round(float(value), 3) for value in values]


def _worth(rig: CameraRig, place: Sequence[float]) -> float:
    """Greatest distance, mm, of places near this one that are 1 px apart in the pictures.

    That is in the direction in which the cameras together tell least.
    """
    singular = np.linalg.svd(slope(rig.project, tuple(place)), compute_uv=False)
    return 10 / float(singular[-1])


def ink_in_space(rig: CameraRig, rows: Sequence[TracePoint]) -> list[list[list[float]]]:
    """The lines drawn in the air: x, y, z (cm) and the pixels of each camera, point by point.

    In the plane the pictures show the ink itself.
    """
    if len(rig) == 1:
        return []
    return [
        [[*_rounded(rig.centre("effector", q)), *_rounded(rig.truth(q))] for _, q in stroke]
        for stroke in (_path(rig, run) for run in pen_down_runs(rows))
    ]


SUMMARY = "summary.json"
"""File that `simulate` leaves after trace.csv."""
PATH_SPACING = 0.2
"""Distance of the points kept of the true path, px."""
STILL_ANGLE = 1e-4
"""Motion of a joint below which it has not moved, rad."""
LEAST_REST = 0.05
"""Shortest rest of which the end is kept, s."""


def _path(rig: CameraRig, rows: Sequence[TracePoint]) -> list[tuple[float, Vector]]:
    """When (s) the joints truly were where (rad); in the pictures what lies between is straight."""
    kept = rows[0]
    place = rig.truth(kept.q)
    path = [(kept.t, kept.q)]
    for before, row in zip(rows, rows[1:], strict=False):
        if row is not rows[-1] and max(map(abs, np.subtract(row.q, kept.q))) < STILL_ANGLE:
            continue
        here = rig.truth(row.q)
        if row is rows[-1] or math.dist(here, place) > PATH_SPACING:
            if before.t - kept.t > LEAST_REST:
                path.append((before.t, kept.q))
            path.append((row.t, row.q))
            kept, place = row, here
    return path
