"""The report of a run on the page: one HTML file, made of what was recorded of it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path

from laptop.page.report_figures import FIGURES
from laptop.page.run_records import RunGroup, RunRecord
from laptop.page.run_traces import RunTraces, traces_of
from laptop.page.snapshots import points
from laptop.record.figures.document import StepTable, figures, illustration, render_report
from shared.verdicts import CONVERGED, VERDICT_TEXTS

TEMPLATE = Path(__file__).with_name("templates") / "run_report.html"
HEADINGS = ("goal", "method", "brick says", "brick\npx", "tracker\npx", "moves", "s")
NOTE = (
    "All of this is what the tracker saw and what the brick told. Distances are in pixels, of all "
    "cameras together: as the brick last measured its own, and as the tracker saw tip and goal in "
    "the last half second. Where tip and goal truly are in space nobody knows here."
)


def render(group: RunGroup) -> str:
    """Return the report as the text of an HTML file.

    Slow, and to be called by one thread at a time: matplotlib's style is everybody's.
    """
    runs = traces_of(group)
    last = runs[-1].record
    return render_report(
        TEMPLATE,
        title=f"BrickServo: run {group.number}",
        good=last.verdict == CONVERGED or last.ended is None,
        verdict=verdict_text(last),
        headline=headline(runs),
        facts=", ".join(_facts(group)),
        headings=HEADINGS,
        rows=[_row(run) for run in runs],
        note=NOTE,
        file_name=file_name(group),
        illustrations=[
            illustration(heading, caption, picture)
            for heading, caption, draw in FIGURES
            if (picture := draw(group, runs))
        ],
        runs=[
            _step_table(run, number if len(runs) > 1 else 0) for number, run in enumerate(runs, 1)
        ],
    )


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


def headline(runs: Sequence[RunTraces]) -> str:
    """Return the outcome in one line."""
    records = [run.record for run in runs]
    last = records[-1]
    ends = [sample.t for run in runs for sample in run.samples[-1:]] or [0.0]
    end = ends[-1] if last.ended is None else last.ended - records[0].began
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


def _facts(group: RunGroup) -> list[str]:
    orders = group.runs[0].orders
    when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(group.when))
    facts = [when, f"brick {group.brick.removeprefix('::ffff:')}"]
    if orders is None:
        return [*facts, "ordered on the brick, so that method and tolerance are not known here"]
    facts += [f"method {orders.method}", f"mode {orders.mode}"]
    if len(orders.goals) > 1 or len(group.images) > 1:
        facts.append(f"rows {orders.rows}")
    facts += [f"tolerance {orders.tolerance:g} px", f"budget {orders.budget:g} s"]
    return [*facts, "the goal marker is followed"] if orders.follow else facts


def _row(run: RunTraces) -> tuple[str, ...]:
    """Return a run's row of the table of goals, see HEADINGS."""
    record = run.record
    last = record.samples[-1] if record.samples else None
    return (
        _goal(run),
        record.orders.method if record.orders else "not known",
        record.verdict or ("goes on" if record.ended is None else "not heard"),
        _decimal(last and last.error),
        _decimal(run.final_error),
        str(last.moves if last else 0),
        _decimal(record.ended and record.ended - record.began),
    )


def _goal(run: RunTraces) -> str:
    """Return the goal for people."""
    orders = run.record.orders
    if orders and not orders.goals:
        return "the marker"
    where = [
        f"{camera}: " * (len(run.goals) > 1) + f"{u:.0f}, {v:.0f}"
        for camera, (u, v) in sorted(run.goals.items())
    ]
    return "; ".join(where) or "not known"


def _decimal(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def _step_table(run: RunTraces, number: int) -> StepTable:
    """Return what the brick told of every step of a run; number 0: it is the only one."""
    measured = run.measured
    components = ", ".join(measured[-1].e if measured else ()) or "components"
    return StepTable(
        title=f"To goal {number}, {_goal(run)}" if number else f"To {_goal(run)}",
        reason="",
        notes=[(t, f"held, {why}") for t, why in run.holds],
        headings=("s", "moves", "off, px", f"{components}, px", "joints, deg", "condition"),
        rows=[
            (
                f"{sample.t:.1f}",
                str(sample.moves),
                _decimal(sample.error),
                figures(list(sample.e.values()), "{:+.1f}"),
                figures([math.degrees(angle) for angle in sample.q], "{:.1f}"),
                _decimal(sample.condition),
            )
            for sample in measured
        ],
    )
