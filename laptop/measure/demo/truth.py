"""The truth about a demo, from the emulated brick's files; its claims decide nothing."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from laptop.emulator.host.clocks import UPTIME
from laptop.emulator.scene.camera_rig import CameraRig
from laptop.emulator.scene.servo_truth import true_path, truth_of
from laptop.measure.demo.goals import Goal
from laptop.measure.demo.processes import END_TIMEOUT, ChildProcess, DemoFailed
from laptop.record.figures.line_accuracy import pen_down_runs
from laptop.record.names import TRACE
from laptop.record.run import DamagedRun, read_run
from laptop.record.servo.servo_log import Log, read_log
from laptop.record.servo.servo_run import ServoRun, run_of_log


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


def run_of_goal(rig: CameraRig, goal: Goal, out_dir: Path, program: ChildProcess) -> ServoRun:
    """Return one run of the servo as it truly was.

    Raises:
        DemoFailed: it ended without a verdict, or left no record.
    """
    file = out_dir.with_suffix(".jsonl")
    log = read_log(file) if file.exists() else Log({}, [], [], [], None)
    if log.verdict is None:
        program.wait(END_TIMEOUT)
        raise program.failure()
    try:
        start = read_run(out_dir).ending.more.get("start_s") or 0.0
    except DamagedRun as error:
        raise DemoFailed(f"{out_dir}: {error}; is the disk full?") from None
    rows = read_trace(out_dir / TRACE)
    began = log.run["clock"] - UPTIME - start
    return run_of_log(goal.name, log, truth_of(rig, rows, log, began, goal.pixels))


def ink_in_space(rig: CameraRig, rows: Sequence[TracePoint]) -> list[np.ndarray]:
    """Return the lines drawn in the air, point by point: x, y, z (cm), pixels of each camera.

    In the plane the pictures show the ink itself.
    """
    if len(rig) == 1:
        return []
    return [
        np.array([[*rig.centre("effector", q), *rig.truth(q)] for _, q in true_path(rig, run)])
        for run in pen_down_runs(rows)
    ]
