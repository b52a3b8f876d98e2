"""The report of a demo: pictures and figures from its raw files, in one HTML file."""

from __future__ import annotations

import math
from pathlib import Path

from laptop.record.figures.document import StepTable, figures, illustration, render_report
from laptop.record.servo.figures import (
    draw_camera,
    draw_condition,
    draw_errors,
    draw_joints,
    draw_lines,
    draw_lines_from_the_side,
    draw_space,
)
from laptop.record.servo.results import (
    HEADINGS,
    RESULTS_FILE,
    TRUE_SHARE,
    BadRun,
    DemoResult,
    GoalRun,
    headline,
    table_rows,
)

PAGE = "report.html"
TEMPLATE = Path(__file__).with_name("templates") / "demo_report.html"
CAPTIONS = (
    (
        "What the camera saw",
        "The last picture of each camera, with the true way of the tip to each goal. "
        "Rings are where it started, dots where the servo stopped to look, crosses the goals, each "
        "with its circle of tolerance. Nothing about camera or arm was calibrated: the first "
        "short moves show how the picture answers to each joint, every later one corrects that. "
        "The grey lines are what the pen drew before.",
        draw_camera,
    ),
    (
        "The way in space",
        "The same in centimetres, as the emulator knows it: the servo saw nothing but the pictures "
        "above. The rings round the goals are what counts as reached.",
        draw_space,
    ),
    (
        "The way to the goal in time",
        "How far the tip truly was from its goal, on a logarithmic scale; dots are what the servo "
        "measured. Flat pieces are rests, to look. On the left every goal; on the right one goal "
        "by both methods, from the same start: the report's method looks for two seconds at every "
        "step of at most ten degrees, so its time runs far longer.",
        draw_errors,
    ),
    (
        "The three lines",
        "Drawn before anything was seen: ink and arm on the left, and on the right how far the ink "
        "is off the wanted line, magnified.",
        draw_lines,
    ),
    (
        "The three lines from the side",
        "The same ink and the same arm.",
        draw_lines_from_the_side,
    ),
    (
        "How well the image Jacobian could be inverted",
        "The condition number of the estimated image Jacobian, step by step: 1 means that the "
        "picture answers alike to every motion of the joints. Where it peaks, some direction "
        "in the picture needs large motions, and a small error of the estimate becomes a large one "
        "of the step.",
        draw_condition,
    ),
    (
        "What the joints did",
        "The joint angles while the servo looked, as the encoders have them; dots are where it "
        "decided on a step.",
        draw_joints,
    ),
)


def write(run: DemoResult) -> Path:
    """Write PAGE into the run's folder; where it is.

    Raises:
        BadRun: it cannot be written.
    """
    page = render_report(
        TEMPLATE,
        title="BrickServo: a demo",
        good=run.worked,
        verdict="It worked." if run.worked else "It did not all work.",
        headline=headline(run),
        facts=_facts(run),
        headings=HEADINGS,
        rows=[(k >= len(run.goal_runs), row) for k, row in enumerate(table_rows(run))],
        note=_note(run),
        illustrations=[
            illustration(heading, caption, picture)
            for heading, caption, draw in CAPTIONS
            if (picture := draw(run))
        ],
        runs=[_steps(a) for a in [*run.goal_runs, *([run.baseline] if run.baseline else [])]],
        command=run.results["command"],
        files=_FILES,
    )
    file = run.folder / PAGE
    try:
        file.write_text(page, encoding="utf-8")
    except OSError as error:
        raise BadRun(f"cannot write {file}: {error.strerror}; make room there") from None
    return file


def _facts(run: DemoResult) -> str:
    facts = [f"arm {run.results['arm']}", f"scene {run.results['scene']}"]
    if run.results.get("seconds"):
        facts.append(f"{run.results['seconds']:.0f} s from start to end")
    if run.results.get("cpu") is not None:
        facts.append(f"the brick computes with cpu={run.results['cpu']:g}")
    if run.results.get("pace"):
        facts.append(f"emulated clock at {run.results['pace']:.2f} x real time")
    return ", ".join(facts)


def _note(run: DemoResult) -> str:
    tolerance = run.goal_runs[0].tolerance if run.goal_runs else 5.0
    within = [a.within_mm for a in run.goal_runs if a.within_mm]
    words = (
        "What the brick claims decides nothing here: the emulator knows where the tip truly is, "
        f"and a goal counts as reached where that is at most {TRUE_SHARE:g} times the tolerance of "
        f"{tolerance:g} px away in the picture"
    )
    if within:
        words += (
            f"s, or rather in space: that is at most {max(within):.0f} mm, in the direction in "
            "which the cameras tell least. A distance in px is that of all cameras together."
        )
    else:
        words += ". Millimetres are measured in the plane in which the marker on the tip moves."
    if run.baseline:
        words += (
            " The last row is the report's own method for comparison, on the same emulated arm "
            "in virtual time; it does not count for the outcome."
        )
    elif run.results.get("trouble"):
        trouble = run.results["trouble"]
        words += f" For comparison there is no run of the report's method: {trouble}."
    return words


def _steps(goal_run: GoalRun) -> StepTable:
    """Return every step of one run."""
    rows = []
    for step in goal_run.log.steps:
        q, wanted = step.get("q") or [], step.get("q_wanted")
        turn = [math.degrees(b - a) for a, b in zip(q, wanted, strict=True)] if wanted else []
        rows.append(
            (
                f"{step['t']:.1f}",
                str(step.get("action") or ""),
                str(step.get("model") or ""),
                figures([step["error"]] if step.get("error") is not None else [], "{:.1f}"),
                figures([math.degrees(a) for a in q], "{:.1f}"),
                figures(turn, "{:+.1f}"),
                str(step.get("frames") or ""),
            )
        )
    return StepTable(
        title=f"{goal_run.name}, {goal_run.method}: {goal_run.words}",
        reason=str(goal_run.verdict.get("reason", "")),
        notes=[(note["t"], str(note["text"])) for note in goal_run.log.notes],
        headings=("s", "action", "model", "off, px", "joints, deg", "turned by, deg", "frames"),
        rows=rows,
    )


_FILES = (
    (RESULTS_FILE, "everything that the figures and pictures here were made of, with the logs"),
    ("goal-1.jsonl, ..., report-method.jsonl", "what the servo saw, decided and did"),
    ("goal-1/trace.csv, ...", "the true motion of the arm"),
    ("drawing/", "the lines: their true ink, their picture, their figures"),
    ("track.csv, camera*.png", "what the tracker found in every picture, and the last one"),
    ("*.txt", "what each program printed"),
)
