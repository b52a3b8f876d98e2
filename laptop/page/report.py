"""The report of a run on the page: its record and figures, made of what was recorded of it."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from laptop.page.run_records import RunGroup, RunRecord
from laptop.page.run_traces import servo_runs
from laptop.page.snapshots import points
from laptop.record.report.run_report import REPORT, report_of, write_report
from laptop.record.run import SERVO, Ending, Run, RunFile
from laptop.record.run_folder import RunFolder
from laptop.record.servo.figures import Scenery
from laptop.record.servo.servo_files import Files, add_servo
from laptop.record.servo.servo_run import ServoRun
from shared.verdicts import CONVERGED, VERDICT_TEXTS

COMMAND = "track"
NOTE = (
    "All of this is what the tracker saw and what the brick told. Distances are in pixels, of all "
    "cameras together: as the brick last measured its own, and as the tracker saw tip and goal in "
    "the last half second. Where tip and goal truly are in space nobody knows here"
)


def render(group: RunGroup, stored_in: Path | None = None, why_not_stored: str = "") -> str:
    """Return the report as the text of an HTML file.

    Slow, and to be called by one thread at a time: matplotlib's style is everybody's.

    Args:
        group: the runs.
        stored_in: the folder in which to store it; None: it is not stored.
        why_not_stored: why it could not be stored, a sentence for the report; or "".

    Raises:
        ArmError: it cannot be stored.
    """
    reported, files = record_of(group)
    reported.notes += [why_not_stored] * bool(why_not_stored)
    if stored_in is None:
        with tempfile.TemporaryDirectory() as folder:
            RunFolder(Path(folder)).write(reported, files)
            report = report_of(Path(folder))
    else:
        reported.files.append(RunFile(REPORT))
        RunFolder(stored_in).write(reported, files)
        report = report_of(stored_in)
        write_report(stored_in, report)
        report.values["kept"] = f"{stored_in.parent.name}/{stored_in.name}"
    report.values["save_as"] = file_name(group)
    return report.html()


def record_of(group: RunGroup) -> tuple[Run, Files]:
    """Return the record of a group of runs, and what writes its files."""
    last = group.runs[-1]
    succeeded = last.verdict == CONVERGED or last.ended is None
    runs = servo_runs(group)
    reported = Run(
        kind=SERVO,
        what=f"run {group.number} on the page",
        ending=Ending(None, f"{verdict_text(last)} {headline(group, runs)}", well=succeeded),
        set_up=_set_up(group),
        notes=[NOTE, *(f"{t:.1f} s: {text}" for run in runs for t, text in run.remarks)],
    )
    images: dict[str, Any] = {
        camera: cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        for camera, jpeg in sorted(group.images.items())
    }
    return reported, add_servo(reported, runs, Scenery(images))


def file_name(group: RunGroup) -> str:
    """Return the name under which the report is saved."""
    return time.strftime(f"brickservo-%Y-%m-%d-run-{group.number}.html", time.localtime(group.when))


def verdict_text(run: RunRecord) -> str:
    """Return the verdict for people."""
    if run.ended is not None and not run.verdict:
        return "How it ended was not heard: the link was lost."
    if run.verdict == "" and run.orders and run.orders.follow:
        return "Following the goal marker."
    return VERDICT_TEXTS.get(run.verdict, f"{run.verdict.capitalize()}.")


def headline(group: RunGroup, runs: Sequence[ServoRun]) -> str:
    """Return the outcome in one line."""
    records = group.runs
    last = records[-1]
    ends = [sample.t for record in records for sample in record.samples[-1:]]
    end = (ends or [records[0].began])[-1] if last.ended is None else last.ended
    end -= records[0].began
    moves = sum(record.samples[-1].moves for record in records if record.samples)
    parts = [f"{moves} move{'s' * (moves != 1)}, {end:.1f} s"]
    error = last.samples[-1].error if last.samples else None
    if error is not None:
        parts.insert(0, f"{error:.1f} px off as the brick measured it")
    if len(runs) > 1:
        reached = sum(record.verdict == CONVERGED for record in records)
        parts.append(f"{points(reached)} of the path reached")
    if last.reason:
        parts.insert(0, f"{last.reason[:1].upper()}{last.reason[1:]}")
    return "; ".join(parts)


def _set_up(group: RunGroup) -> dict[str, Any]:
    orders = group.runs[0].orders
    found: dict[str, Any] = {
        "when": time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(group.when)),
        "brick": group.brick.removeprefix("::ffff:"),
    }
    if orders is None:
        return found | {"servo": "ordered on the brick: method and tolerance are not known here"}
    servo = f"mode {orders.mode}, tolerance {orders.tolerance:g} px, budget {orders.budget:g} s"
    if len(orders.goals) > 1 or len(group.images) > 1:
        servo += f", rows {orders.rows}"
    return found | {"servo": servo + ", the goal marker is followed" * orders.follow}
