"""Additions of servo runs to the record of a run: tables, figures, the true path."""

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
"""Files by name: a writer to a path, and the content in words."""


def add_servo(
    record: Run,
    runs: Sequence[ServoRun],
    scenery: Scenery,
    baseline: ServoRun | None = None,
    drawn: bool = True,
) -> Files:
    """Add runs of the servo to a record, and return the writers of their files.

    Args:
        record: the record.
        runs: one after another.
        scenery: pictures of the cameras, and the lines in them.
        baseline: the first goal by another method, for comparison.
        drawn: with figures.
    """
    every = [(run.goal if len(runs) == 1 else run.name, run) for run in runs]
    if baseline:
        every.append((f"{baseline.name}, for comparison", baseline))
    record.methods = sorted({*record.methods, *(run.method for _, run in every if run.method)})
    record.tables = [*record.tables, goals_table(every)]
    files: Files = {}
    if drawn:
        for stem, caption, picture in draw(runs, scenery, baseline):
            files[f"{stem}.png"] = (writer_of(picture), caption)
    for _, run in every:
        stem = _stem(run, baseline)
        if run.steps:
            record.tables = [*record.tables, run.steps]
        if run.truth is not None:
            caption = "the true way of the tip in the pictures, px"
            files[f"{stem}-true-path.csv"] = (partial(_write_path, run=run), caption)
    return files


def _stem(run: ServoRun, baseline: ServoRun | None) -> str:
    return ("compared" if run is baseline else run.name).replace(" ", "-")


def _write_path(path: str, run: ServoRun) -> None:
    assert run.truth is not None
    heading = ["t_s", *(f"{camera}.{axis}_px" for camera in run.truth.cameras for axis in "uv")]
    rows = np.round(run.truth.path, 3).tolist()
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([heading, *rows])
