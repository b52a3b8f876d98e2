"""Runs that went to what cameras see: logs of visual_servoing.py, and demos."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from laptop.record.figures.document import figures
from laptop.record.figures.private_paths import without_folders
from laptop.record.report.drawing_runs import PATH_KEYS, PATHS
from laptop.record.report.findings import (
    NOT_THERE,
    SERVO,
    DamagedRun,
    LabFigure,
    LabRun,
    LabTable,
    RawData,
)
from laptop.record.report.lab_figures import draw_servo, draw_ways
from laptop.record.report.run_files import decimal, is_plain, number, read_picture
from laptop.record.servo import demo_report
from laptop.record.servo.results import BadRun, DemoResult, GoalRun, Log, read_log, read_run

GOALS = "goals"
MAX_STEP_ROWS = 25
"""A table of more steps is a CSV beside the report only."""
STEP_HEADINGS = ("s", "action", "model", "off px", "joints deg", "turned by deg", "condition")
WAY_CAPTION = (
    "Way of the tip in the picture as it was seen. The ring is where it started, dots where the "
    "servo stopped to look, the cross the goal with its circle of tolerance."
)
TIME_CAPTION = (
    "Above: distance from the goal in time, on a logarithmic scale; dots are what the servo "
    "measured. Below: joint angles as the encoders have them, and the condition number of the "
    "estimated image Jacobian."
)
MALFORMED = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
"""What reading values that are not as they are written ends in."""


def is_log(file: Path) -> bool:
    """Return whether a file begins as a log of visual_servoing.py."""
    try:
        with file.open("rb") as opened:
            return opened.read(20).replace(b" ", b"").startswith(b'{"kind":"run"')
    except OSError:
        return False


def read_servo_log(run: LabRun, file: Path) -> None:
    """Put a log's goal, figures and steps into a run.

    Raises:
        DamagedRun: it is no log, or not as it is written.
    """
    try:
        log = read_log(file)
        run.kind = SERVO
        _add_log(run, log, file)
    except BadRun as error:
        raise DamagedRun(str(error).replace(str(file), file.name)) from None
    except MALFORMED:
        raise DamagedRun(f"{file.name} is not as visual_servoing.py writes it") from None


def _add_log(run: LabRun, log: Log, file: Path) -> None:
    method, verdict = str(log.run["method"]), log.verdict or {}
    tolerance = float(log.run["tolerance"])
    run.methods.append(method)
    run.arm = run.arm or str(log.run.get("arm") or "")
    run.what = run.what or f"servo, method {method}"
    cameras = sorted({str(seen["camera"]) for seen in log.seen})
    run.set_up.append(
        (
            "servo",
            f"method {method}, mode {log.run.get('mode')}, tolerance {tolerance:g} px, "
            f"camera{'s' * (len(cameras) > 1)} {', '.join(cameras) or NOT_THERE}",
        )
    )
    if log.verdict is None:
        run.gaps.append(f"{file.name} ends without a verdict: the run was cut off")
    outcome = str(verdict.get("verdict") or NOT_THERE)
    reason = without_folders(str(verdict.get("reason") or ""))
    run.outcome = outcome + (f", {reason}" if reason else "")
    run.seconds = run.seconds if run.seconds is not None else verdict.get("t")
    goal = without_folders(str(log.run.get("goal") or ""))
    row = [run.arm, goal, method, outcome, str(verdict.get("moves", NOT_THERE))]
    row += [decimal(verdict.get("t"), 1), decimal(verdict.get("error"), 1)]
    run.results.append((GOALS, (*row, NOT_THERE, NOT_THERE)))
    _add_steps(run, log, file.stem)
    _add_log_figures(run, log, tolerance)


def _add_log_figures(run: LabRun, log: Log, tolerance: float) -> None:
    seen = [s for s in log.seen if s.get("s") is not None]
    cameras = sorted({str(s["camera"]) for s in seen})
    ways = {
        camera: np.array([s["s"][:2] for s in seen if s["camera"] == camera], float)
        for camera in cameras
    }
    measured = [step for step in log.steps if step.get("s") is not None]
    looks, goals = {}, {}
    for camera in cameras:
        names = [f"{camera}.u", f"{camera}.v"]
        told = [
            ([dict(zip(step["rows"], step[key], strict=True)) for key in ("s", "goal")])
            for step in measured
            if step.get("goal") is not None and set(names) <= set(step["rows"])
        ]
        if told:
            looks[camera] = np.array([[at[name] for name in names] for at, _ in told], float)
            goals[camera] = (float(told[-1][1][names[0]]), float(told[-1][1][names[1]]))
    steps = np.array(
        [(s["t"], s["error"]) for s in log.steps if s.get("error") is not None], float
    ).reshape(-1, 2)
    errors = steps
    if len(cameras) == 1:  # of several, each is seen at a time of its own
        rows = [(s["t"], math.dist(s["s"], s["goal"])) for s in seen if s.get("goal") is not None]
        errors = np.array(rows, float).reshape(-1, 2)
    names = [str(name) for name in log.run.get("joints") or []]
    joints = {
        name: np.array([(s["t"], s["q"][k]) for s in log.seen if s.get("q")], float).reshape(-1, 2)
        for k, name in enumerate(names)
    }
    condition = np.array(
        [(s["t"], s["condition"]) for s in log.steps if s.get("condition") is not None], float
    ).reshape(-1, 2)
    condition = condition[np.isfinite(condition).all(axis=1)]
    drawn = (
        (WAY_CAPTION, draw_ways(ways, goals, looks, tolerance)),
        (TIME_CAPTION, draw_servo(errors, steps, joints, condition, tolerance)),
    )
    run.figures[:0] = [LabFigure(caption, picture) for caption, picture in drawn if picture]
    if not ways:
        run.gaps.append("its log holds no place at which the marker was seen")


def _add_steps(run: LabRun, log: Log, stem: str) -> None:
    """Add the steps of a log: as CSV, and as a table if they are few."""
    if not log.steps:
        return
    joints = [str(name) for name in log.run.get("joints") or []]
    heading = ["t_s", "action", "model", "error_px", *(f"{name}_deg" for name in joints)]
    heading += [*(f"{name}_wanted_deg" for name in joints), "condition", "frames"]
    rows, cells = [], []
    for step in log.steps:
        q = [math.degrees(angle) for angle in step.get("q") or []]
        wanted = [math.degrees(angle) for angle in step.get("q_wanted") or []]
        told = [step["t"], step.get("action"), step.get("model"), step.get("error")]
        blank = [None] * len(joints)
        rows.append(
            [*told, *(q or blank), *(wanted or blank), step.get("condition"), step.get("frames")]
        )
        cells.append(
            (
                decimal(step["t"], 1),
                str(step.get("action") or ""),
                str(step.get("model") or ""),
                decimal(step.get("error"), 1),
                figures(q, "{:.1f}"),
                figures(
                    [b - a for a, b in zip(q, wanted, strict=True)] if wanted else [], "{:+.1f}"
                ),
                decimal(step.get("condition"), 1),
            )
        )
    run.data.append(RawData(f"{stem}-steps.csv", as_csv(heading, rows), "each step of the servo"))
    if len(cells) > MAX_STEP_ROWS:
        run.gaps.append(f"its {len(cells)} steps are in {stem}-steps.csv, too many to print")
    else:
        run.tables.append(
            LabTable("What the servo measured and did, step by step", STEP_HEADINGS, cells)
        )


def as_csv(heading: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a table as CSV; None is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(
        [f"{x:.10g}" if isinstance(x, float) else "" if x is None else x for x in row]
        for row in rows
    )
    return out.getvalue()


# Demos


def read_demo(name: str, folder: Path) -> LabRun:
    """Return a demo: three lines and some goals, with the truth about them.

    Raises:
        DamagedRun: it is not whole.
    """
    try:
        demo = read_run(folder)
        for file in sorted(folder.glob("camera*.png")):
            read_picture(file)  # it goes into a figure
        number(demo.results, "seconds", "demo.json")
        return _demo(name, folder, demo)
    except DamagedRun:
        raise
    except BadRun as error:
        told = str(error).replace(f"{folder}{os.sep}", "")
        raise DamagedRun(without_folders(told)) from None
    except MALFORMED:
        raise DamagedRun("demo.json is not of a demo; run the demo again") from None


def _demo(name: str, folder: Path, demo: DemoResult) -> LabRun:
    results = demo.results
    run = LabRun(name, SERVO, "demo: lines, then goals", arm=str(results["arm"]))
    run.outcome = "all lines drawn, all goals reached" if demo.worked else "not all worked"
    run.seconds = results.get("seconds")
    cpu = results.get("cpu")
    run.set_up = [
        ("brick", "emulated" + ("" if cpu is None else f", cpu={float(cpu):g}")),
        (
            "camera",
            f"synthetic, {' and '.join(results['cameras'])}, "
            f"{' x '.join(map(str, results['size']))} px, scene '{results['scene']}'",
        ),
    ]
    lines = [] if (folder / "drawing" / "summary.json").exists() else results["lines"]
    for k, line in enumerate(lines, 1):  # there it is a run of its own
        cells = [decimal((line or {}).get(key)) for key in PATH_KEYS]
        run.results.append((PATHS, (run.arm, str(k), *cells)))
    runs: list[tuple[str, GoalRun]] = [(a.name, a) for a in demo.goal_runs]
    if demo.baseline:
        runs.append((f"{demo.baseline.name}, for comparison", demo.baseline))
    for goal, told in runs:
        run.methods.append(told.method)
        row = [run.arm, goal, told.method, str(told.verdict["verdict"])]
        row += [str(told.verdict["moves"]), decimal(told.seconds, 1)]
        row += [decimal(told.verdict.get("error"), 1), decimal(told.error, 1)]
        run.results.append((GOALS, (*row, decimal(told.miss_mm, 1))))
        stem = goal.replace(", for comparison", "-compared").replace(" ", "-")
        _add_goal_data(run, told, stem)
    for _, caption, draw in demo_report.CAPTIONS:
        if draw in (demo_report.draw_lines, demo_report.draw_lines_from_the_side):
            continue  # of its drawing
        if picture := draw(demo):
            run.figures.append(LabFigure(caption, picture))
    if is_plain(folder / "track.csv"):
        run.data.append(
            RawData("track.csv", folder / "track.csv", "where the tracker saw the markers")
        )
    if results.get("trouble"):
        run.gaps.append(f"the comparison is missing: {without_folders(str(results['trouble']))}")
    return run


def _add_goal_data(run: LabRun, told: GoalRun, stem: str) -> None:
    tables, gaps = len(run.tables), len(run.gaps)
    _add_steps(run, told.log, stem)
    del run.tables[tables:], run.gaps[gaps:]  # of several goals they would fill pages
    cameras = sorted({name.split(".")[0] for name in told.log.steps[0]["rows"]}) or ["A"]
    heading = ["t_s", *(f"{camera}.{axis}_px" for camera in cameras for axis in "uv")]
    if len(heading) == told.path.shape[1]:
        text = as_csv(heading, told.path.tolist())
        run.data.append(RawData(f"{stem}-true-path.csv", text, "the true way of the tip"))
