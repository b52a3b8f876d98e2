"""The results of a demo, judged by the truth: its table, its one sentence, its record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rich import box
from rich.markup import escape as escape_markup
from rich.table import Table

from laptop.measure.demo.goals import GOALS
from laptop.measure.demo.processes import log_name
from laptop.record.drawing_tables import PATHS
from laptop.record.names import RUN, TRACE
from laptop.record.run import SERVO, Cell, Ending, Run, RunFile, RunTable, settings
from laptop.record.run_folder import FIGURES, PICTURE, SIDE_PICTURE
from laptop.record.servo.figures import Scenery
from laptop.record.servo.servo_files import Files, add_servo
from laptop.record.servo.servo_run import MAX_TRUE_TOLERANCES, ServoRun

TRACKER, DRAWING, BASELINE = "tracker", "three lines", "report's method"
"""Stages, beside the goals'."""
GOAL_NAMES = tuple(f"goal {number}" for number in range(1, GOALS + 1))
DRAWING_FOLDER, BASELINE_FOLDER = "drawing", "report-method"
"""Folders of these, in the demo's; a goal's is named after it."""


@dataclass(eq=False)
class DemoResult:
    """One demo.

    Attributes:
        runs: one for each goal, by the default method, with the truth.
        baseline: the first goal by the lab report's method; None if it did not come to its end.
        trouble: why there is none, or "".
        lines: the table of the lines.
        ink: what was drawn in space: points (n, 3 + 2 * cameras) of each line, cm and px.
        cameras, size: their names, and the size of their pictures, px.
        set_up: brick, camera and scene by their names.
        timing: what it took, by name with its unit.
    """

    runs: list[ServoRun] = field(default_factory=list)
    baseline: ServoRun | None = None
    trouble: str = ""
    lines: RunTable | None = None
    ink: list[np.ndarray] = field(default_factory=list)
    cameras: str = "A"
    size: tuple[int, int] = (640, 480)
    set_up: dict[str, Any] = field(default_factory=dict)
    timing: dict[str, float] = field(default_factory=dict)

    @property
    def paths(self) -> list[dict[str, Cell]]:
        """The lines' figures, by heading; values of one that was not drawn are None."""
        reported = Run(kind=SERVO, what="", ending=Ending(0, ""), tables=[self.lines or _NO_LINES])
        return reported.rows(PATHS)

    @property
    def worked(self) -> bool:
        """True if every line was drawn and every goal truly reached by the default method."""
        return drawn(self.paths) and all(run.reached for run in self.runs)


_NO_LINES = RunTable(PATHS, "", [], [])


def drawn(lines: Sequence[Mapping[str, Cell]]) -> bool:
    """Return True if every line was drawn and measured."""
    return bool(lines) and all(line["greatest mm"] is not None for line in lines)


def lines_text(lines: Sequence[Mapping[str, Cell]]) -> str:
    """Sentence on the lines: their number and greatest deviation, mm."""
    off = [float(off) for line in lines if (off := line["greatest mm"]) is not None]
    if not off:
        return "none of the lines was drawn"
    count = f"{len(off)} lines" if len(off) == len(lines) else f"{len(off)} of {len(lines)}"
    return f"{count} drawn, at most {max(off):.1f} mm off"


def headline(demo: DemoResult) -> str:
    """Outcome in one sentence."""
    reached = [run for run in demo.runs if run.reached]
    lines = lines_text(demo.paths)
    if demo.worked:
        worst = f"{max(run.true_error or 0.0 for run in reached):.1f} px"
        if any(run.within_mm for run in reached):
            miss = max(run.truth.miss_mm or 0.0 for run in reached if run.truth)
            worst = f"{miss:.1f} mm in space ({worst} in the pictures)"
        return (
            f"{lines[0].upper()}{lines[1:]}; all {_number(len(reached))} goals truly reached, "
            f"to {worst} or better."
        )
    missed = [f"{run.name} was {run.outcome}" for run in demo.runs if not run.reached]
    if not drawn(demo.paths):
        missed.insert(0, lines)
    return f"Not everything worked: {'; '.join(missed)}."


def _number(count: int) -> str:
    words = ("no", "one", "two", "three", "four", "five", "six")
    return words[count] if count < len(words) else str(count)


HEADINGS = (
    "goal",
    "method",
    "brick says",
    "claimed\npx",
    "true\npx",
    "true\nmm",
    "moves",
    "s",
    "reached",
)


def table(demo: DemoResult) -> Table:
    """Return the outcome, for a terminal."""
    shown = Table(*HEADINGS, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for number, column in enumerate(shown.columns):
        column.no_wrap = True
        column.justify = "right" if 3 <= number < 8 else "left"
    for run in [*demo.runs, *([demo.baseline] if demo.baseline else [])]:
        if run is demo.baseline:
            shown.add_section()
        numbers = (run.error, run.true_error, run.truth and run.truth.miss_mm)
        cells = [run.name, run.method, run.verdict]
        cells += ["" if x is None else f"{x:.1f}" for x in numbers]
        cells += [str(run.moves), f"{run.seconds or 0.0:.1f}"]
        yes = "yes" if run.reached else "no"
        shown.add_row(*map(escape_markup, cells), f"[{'green' if run.reached else 'red'}]{yes}[/]")
    return shown


def record_of(demo: DemoResult, folder: Path) -> tuple[Run, Files]:
    """Return the record of a demo, and what writes its figures.

    Args:
        demo: it has come to its end.
        folder: where the programs have left their files.
    """
    reported = Run(
        kind=SERVO,
        what=f"demo: {'lines' if demo.lines else 'no line'}, then goals by sight",
        ending=Ending(None, headline(demo), demo.timing.get("in all s"), well=demo.worked),
        set_up=demo.set_up,
        tables=[demo.lines] if demo.lines else [],
        notes=[_note(demo)],
    )
    if demo.trouble:
        reported.notes.append(
            f"for comparison there is no run of the lab report's method: {demo.trouble}"
        )
    images = {}
    for name in demo.cameras:
        file = folder / (f"camera-{name}.png" if len(demo.cameras) > 1 else "camera.png")
        image = cv2.imread(str(file)) if file.is_file() else None
        if image is not None:
            images[name] = image
    files = add_servo(reported, demo.runs, Scenery(images, demo.size, demo.ink), demo.baseline)
    reported.tables = [*reported.tables, settings(demo.timing)]
    reported.files = [RunFile(name, holds) for name, holds in _left(folder)]
    return reported, files


def _left(folder: Path) -> list[tuple[str, str]]:
    """Return the names of what the programs have left, and what each holds."""
    return [(name, holds) for name, holds in _LEFT.items() if (folder / name).is_file()]


def _names() -> dict[str, str]:
    """Return all files that programs of a demo may leave, and what each holds."""
    found = {
        "track.csv": "where the tracker saw the markers",
        **{f"camera{name}.png": "" for name in ("", "-A", "-B")},
        **{log_name(stage): "" for stage in (TRACKER, DRAWING, BASELINE, *GOAL_NAMES)},
    }
    folders = [DRAWING_FOLDER, *(name.replace(" ", "-") for name in GOAL_NAMES), BASELINE_FOLDER]
    for folder in folders:
        trace = f"the true motion of the arm: {folder}"
        found |= {f"{folder}.jsonl": "", f"{folder}/{TRACE}": trace, f"{folder}/{RUN}": ""}
        found |= {f"{folder}/{name}": "" for name in (PICTURE, SIDE_PICTURE)}
    return found | {
        f"{DRAWING_FOLDER}/{PICTURE}": (
            "The lines, drawn before anything was seen: ink and arm on the left, and on the right "
            "how far the ink is off the wanted line, magnified."
        ),
        f"{DRAWING_FOLDER}/{SIDE_PICTURE}": "The same lines and the same arm from the side.",
    }


def _note(demo: DemoResult) -> str:
    tolerance = demo.runs[0].tolerance if demo.runs else 5.0
    within = [run.within_mm for run in demo.runs if run.within_mm]
    sentence = (
        "What the brick claims decides nothing here: the emulator knows where the tip truly is, "
        f"and a goal counts as reached where that is at most {MAX_TRUE_TOLERANCES:g} times the "
        f"tolerance of {tolerance:g} px away in the picture"
    )
    if within:
        return sentence + (
            f"s, or rather in space: that is at most {max(within):.0f} mm, in the direction in "
            "which the cameras tell least. A distance in px is that of all cameras together"
        )
    return sentence + ". Millimetres are measured in the plane in which the marker on the tip moves"


_LEFT = _names()
NAMES = (*_LEFT, *FIGURES, *(f"{name.replace(' ', '-')}-true-path.csv" for name in GOAL_NAMES))
NAMES += ("compared-true-path.csv",)
"""All files that a demo may leave besides run.json."""
