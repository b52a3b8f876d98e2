"""What truly happened, from the files of the emulated brick; the brick's claims decide nothing."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from laptop.demo import results
from laptop.demo.goals import Goal, Vector, Views, slope
from laptop.demo.processes import ENDED, ChildProcess, DemoFailed
from laptop.reporting.line_accuracy import pen_down_runs
from laptop.simulator.host.clocks import UPTIME


class Row(NamedTuple):
    """One of trace.csv: s, true joint angles (rad), whether the pen was down."""

    t: float
    q: tuple[float, ...]
    pen: bool


def read_trace(file: Path) -> list[Row]:
    """The true motion that `simulate` left.

    Raises:
        DemoFailed: it left none.
    """
    try:
        with file.open(newline="", encoding="ascii") as lines:
            heading, *rows = csv.reader(lines)
            joints = [column for column, name in enumerate(heading) if name.startswith("q")]
            trace = [
                Row(float(row[0]), tuple(float(row[k]) for k in joints), row[-1] == "1")
                for row in rows
            ]
        if trace:
            return trace
        raise ValueError("no row")
    except (OSError, ValueError, IndexError):
        raise DemoFailed(f"{file} cannot be read; is the disk full?") from None


def _starting(home: Path) -> float:
    """How long a program took to start, of which the world's clock knows nothing, s.

    Raises:
        DemoFailed: `simulate` has not told.
    """
    try:
        return json.loads((home / SUMMARY).read_text(encoding="utf-8"))["start_s"] or 0.0
    except (OSError, ValueError, KeyError):
        raise DemoFailed(f"{home / SUMMARY} cannot be read; is the disk full?") from None


def approach_of(views: Views, goal: Goal, home: Path, program: ChildProcess) -> dict[str, Any]:
    """One run of the servo as it truly was; what results.read_approach reads.

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
    path = _path(views, rows)
    tip = views.centre("effector", rows[-1].q)
    record = {
        "name": goal.name,
        "log": log.name,
        "goal": [round(value, 3) for value in goal.pixels],
        "path": [
            [round(t - zero, 3), *(round(value, 2) for value in views.truth(q))] for t, q in path
        ],
        "miss_mm": round(10 * math.dist(tip, goal.place), 3),
    }
    if len(views) > 1:
        record["place"] = [round(value, 3) for value in goal.place]
        record["tips"] = [_rounded(views.centre("effector", q)) for _, q in path]
        record["mm_per_px"] = round(_worth(views, goal.place), 4)
    return record


def _rounded(values: Sequence[float] | np.ndarray) -> list[float]:
    return [round(float(value), 3) for value in values]


def _worth(views: Views, place: Sequence[float]) -> float:
    """How far apart, mm, places near this one may be that are 1 px apart in the pictures.

    That is in the direction in which the cameras together tell least.
    """
    singular = np.linalg.svd(slope(views.project, tuple(place)), compute_uv=False)
    return 10 / float(singular[-1])


def ink_in_space(views: Views, rows: Sequence[Row]) -> list[list[list[float]]]:
    """The lines drawn in the air: x, y, z (cm) and the pixels of each camera, point by point.

    In the plane the pictures show the ink itself.
    """
    if len(views) == 1:
        return []
    return [
        [[*_rounded(views.centre("effector", q)), *_rounded(views.truth(q))] for _, q in stroke]
        for stroke in (_path(views, run) for run in pen_down_runs(rows))
    ]


SUMMARY = "summary.json"
"""What `simulate` leaves, behind trace.csv."""
FINEST = 0.2
"""Of the true path, points so far apart are kept, px."""
STILL = 1e-4
"""Joints that moved less than this have not moved, rad."""
REST = 0.05
"""After so long a rest it is kept when it ended, s."""


def _path(views: Views, rows: Sequence[Row]) -> list[tuple[float, Vector]]:
    """When (s) the joints truly were where (rad); in the pictures what lies between is straight."""
    kept = rows[0]
    place = views.truth(kept.q)
    path = [(kept.t, kept.q)]
    for before, row in zip(rows, rows[1:], strict=False):
        if row is not rows[-1] and max(map(abs, np.subtract(row.q, kept.q))) < STILL:
            continue
        here = views.truth(row.q)
        if row is rows[-1] or math.dist(here, place) > FINEST:
            if before.t - kept.t > REST:
                path.append((before.t, kept.q))
            path.append((row.t, row.q))
            kept, place = row, here
    return path
