"""What runs of the servo add to the record of a run: tables, figures, the true path."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from laptop.record.run import Run
from laptop.record.run_folder import writer_of
from laptop.record.servo.figures import Scenery, draw
from laptop.record.servo.servo_run import ServoRun, goals_table

Files = dict[str, tuple[Callable[[str], None], str]]
"""By name, what writes a file at the path that it is given, and what it then holds."""


def add_servo(
    told: Run,
    runs: Sequence[ServoRun],
    scenery: Scenery,
    baseline: ServoRun | None = None,
    drawn: bool = True,
) -> Files:
    """Add runs of the servo to a record, and return what writes their files.

    Args:
        told: the record.
        runs: one after another.
        scenery: pictures of the cameras, and what else is to be seen in them.
        baseline: the first goal by another method, for comparison.
        drawn: with figures.
    """
    every = [(run.goal if len(runs) == 1 else run.name, run) for run in runs]
    if baseline:
        every.append((f"{baseline.name}, for comparison", baseline))
    told.methods = sorted({*told.methods, *(run.method for _, run in every if run.method)})
    told.tables = [*told.tables, goals_table(every)]
    files: Files = {}
    if drawn:
        for stem, caption, picture in draw(runs, scenery, baseline):
            files[f"{stem}.png"] = (writer_of(picture), caption)
    for _, run in every:
        stem = _stem(run, baseline)
        if run.steps:
            told.tables = [*told.tables, run.steps]
        if run.truth is not None:
            words = "the true way of the tip in the pictures, px"
            files[f"{stem}-true-path.csv"] = (partial(_write_path, run=run), words)
    return files


def _stem(run: ServoRun, baseline: ServoRun | None) -> str:
    return ("compared" if run is baseline else run.name).replace(" ", "-")


def _write_path(path: str, run: ServoRun) -> None:
    assert run.truth is not None
    heading = ["t_s", *(f"{camera}.{axis}_px" for camera in run.truth.cameras for axis in "uv")]
    rows = np.round(run.truth.path, 3).tolist()
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([heading, *rows])
