"""The results of a demo, read from its raw files and judged; its table and its one sentence."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich import box
from rich.markup import escape as escape_markup
from rich.table import Table

from shared.arm_description import ArmError
from shared.small_files import SpoiltFile, read_text

MAX_TEXT = 20_000_000
"""Bytes of a file of a run."""
GREATEST = 1e12
"""No number that a run measures or counts is greater."""

RESULTS_FILE = "demo.json"
"""File of the results, in the demo's folder."""
TRUE_SHARE = 1.6
"""A goal is reached where the true distance is at most so many tolerances."""


class BadRun(ArmError):
    """A folder that no demo left whole."""


class Log(NamedTuple):
    """Log of the servo: settings, observations, steps, remarks; the verdict if it came."""

    run: dict[str, Any]
    seen: list[dict[str, Any]]
    steps: list[dict[str, Any]]
    notes: list[dict[str, Any]]
    verdict: dict[str, Any] | None


def _text(file: Path) -> str:
    """Return what a run's own file holds.

    Raises:
        OSError, SpoiltFile: it is none, a link, or too large.
    """
    if file.is_symlink():
        raise SpoiltFile("is a link")
    return read_text(str(file), MAX_TEXT)


def _values(text: str, file: Path) -> Any:
    """Return what JSON holds; NaN and Infinity are numbers in it.

    Raises:
        BadRun: a number is greater than GREATEST.
        ValueError, RecursionError: it is no JSON.
    """

    def bounded(read: Callable[[str], float]) -> Callable[[str], float]:
        def number(digits: str) -> float:
            if abs(float(digits)) > GREATEST:
                raise BadRun(f"{file} holds {digits[:20]}, which is beyond all that a run measures")
            return read(digits)

        return number

    return json.loads(text, parse_float=bounded(float), parse_int=bounded(int))


def read_log(file: Path) -> Log:
    """Read a log of JSON lines; what is cut off at its end is left out.

    Raises:
        BadRun: it is none.
    """
    kinds: dict[str, list[dict[str, Any]]] = {}
    try:
        for line in _text(file).split("\n")[:-1]:
            entry = _values(line, file)
            kinds.setdefault(entry["kind"], []).append(entry)
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        raise BadRun(f"{file} is no whole log of visual_servoing.py; do this run again") from None
    runs, verdicts = kinds.get("run", []), kinds.get("verdict", [])
    return Log(
        runs[0] if runs else {},
        kinds.get("seen", []),
        kinds.get("step", []),
        kinds.get("note", []),
        verdicts[-1] if verdicts else None,
    )


class Space(NamedTuple):
    """The way to a goal in space.

    place      x, y, z of the goal, cm
    tips       the same of the true tip, row by row of the path
    mm_per_px  how far apart places there may be that differ by 1 px in the pictures
    """

    place: tuple[float, ...]
    tips: np.ndarray
    mm_per_px: float


@dataclass(frozen=True, eq=False)
class GoalRun:
    """One run of the servo, as it says it was and as it truly was.

    Attributes:
        name: of the goal.
        log: what the servo wrote; it has a verdict.
        goal: where it truly is in the pictures, u and v in each, px.
        path: rows (s since the servo began, u, v in each picture) of the true tip, px.
        miss_mm: at the end, from the true tip to the place that shows at the goal; in the plane at
            the tip's height.
        space: where that was in space; None in the plane.
    """

    name: str
    log: Log
    goal: tuple[float, ...]
    path: np.ndarray
    miss_mm: float
    space: Space | None = None

    @property
    def verdict(self) -> dict[str, Any]:
        """The last line of its log."""
        assert self.log.verdict is not None
        return self.log.verdict

    @property
    def method(self) -> str:
        """Its name on the command line."""
        return str(self.log.run["method"])

    @property
    def tolerance(self) -> float:
        """In px."""
        return float(self.log.run["tolerance"])

    @property
    def errors(self) -> np.ndarray:
        """Rows (s since the servo began, true distance from the goal in px, all pictures')."""
        off = np.linalg.norm(self.path[:, 1:] - self.goal, axis=1)
        return np.column_stack([self.path[:, 0], off])

    @property
    def error(self) -> float:
        """The true distance at the end, px."""
        return float(self.errors[-1, 1])

    @property
    def seconds(self) -> float:
        """From its beginning to its verdict."""
        return float(self.verdict["t"])

    @property
    def claimed(self) -> bool:
        """True if the brick says that it is there."""
        return bool(self.verdict["verdict"] == "converged")

    @property
    def reached(self) -> bool:
        """True if it truly is, whatever the brick says."""
        if self.within_mm is not None:
            return self.miss_mm <= self.within_mm
        return self.error <= TRUE_SHARE * self.tolerance

    @property
    def within_mm(self) -> float | None:
        """Distance that counts as reached in space, mm; None in the plane, where px decide."""
        return self.space and TRUE_SHARE * self.tolerance * self.space.mm_per_px

    @property
    def outcome(self) -> str:
        """Outcome in a few words."""
        if self.reached:
            if self.claimed:
                return "reached"
            return f"reached, though the brick says '{self.verdict['verdict']}'"
        if self.claimed:
            return "not reached, though the brick says so"
        return f"not reached: {self.verdict['verdict']}"

    @property
    def words(self) -> str:
        """The same with figures."""
        return (
            f"{self.outcome}: truly {self.error:.1f} px ({self.miss_mm:.1f} mm) off after "
            f"{self.verdict['moves']} moves, {self.seconds:.1f} s"
        )


@dataclass(frozen=True, eq=False)
class DemoResult:
    """One demo.

    Attributes:
        folder: its raw files.
        results: what RESULTS_FILE holds.
        goal_runs: one for each goal, by the default method.
        baseline: the first goal by the report's method; None if it did not come to its end.
    """

    folder: Path
    results: dict[str, Any]
    goal_runs: list[GoalRun]
    baseline: GoalRun | None

    @property
    def worked(self) -> bool:
        """True if every line was drawn and every goal truly reached by the default method."""
        return drawn(self.results["lines"]) and all(a.reached for a in self.goal_runs)


def read_goal_run(folder: Path, record: dict[str, Any]) -> GoalRun:
    """Read the run that one entry of RESULTS_FILE stands for.

    Raises:
        BadRun: something is missing or cannot be understood.
    """
    try:
        if os.path.basename(record["log"]) != record["log"]:
            raise BadRun(f"{folder / RESULTS_FILE} names a log in another folder")
        log = read_log(folder / record["log"])
        if log.verdict is None:
            raise BadRun(f"{folder / record['log']} ends without a verdict; run the demo again")
        goal = tuple(map(float, record["goal"]))
        path = np.array(record["path"], dtype=float).reshape(-1, 1 + len(goal))
        space = None
        if "place" in record:
            tips = np.array(record["tips"], dtype=float).reshape(-1, 3)
            space = Space(tuple(record["place"]), tips, float(record["mm_per_px"]))
        return GoalRun(record["name"], log, goal, path, float(record["miss_mm"]), space)
    except (LookupError, TypeError, ValueError):
        raise BadRun(f"{folder / RESULTS_FILE} is not of a demo; run the demo again") from None


def read_run(folder: Path) -> DemoResult:
    """Read the results of the demo that left this folder.

    Raises:
        BadRun: something is missing or cannot be understood.
    """
    try:
        results = _values(_text(folder / RESULTS_FILE), folder / RESULTS_FILE)
        goal_runs = [read_goal_run(folder, record) for record in results["approaches"]]
        baseline = results["rival"] and read_goal_run(folder, results["rival"])
    except (OSError, LookupError, TypeError, ValueError, RecursionError):
        raise BadRun(f"{folder / RESULTS_FILE} is not of a demo; run the demo again") from None
    return DemoResult(folder, results, goal_runs, baseline or None)


def drawn(lines: Sequence[dict[str, Any] | None]) -> bool:
    """Return True if every line was drawn and measured."""
    return bool(lines) and all(line is not None for line in lines)


def lines_text(lines: Sequence[dict[str, Any] | None]) -> str:
    """Sentence on the lines: their number and greatest deviation, mm."""
    there = [line for line in lines if line]
    if not there:
        return "none of the lines was drawn"
    worst = max(line["greatest_mm"] for line in there)
    count = f"{len(there)} lines" if len(there) == len(lines) else f"{len(there)} of {len(lines)}"
    return f"{count} drawn, at most {worst:.1f} mm off"


def headline(run: DemoResult) -> str:
    """Outcome in one sentence."""
    there = [a for a in run.goal_runs if a.reached]
    lines = lines_text(run.results["lines"])
    if run.worked:
        worst = f"{max(a.error for a in there):.1f} px"
        if in_space(run):
            worst = f"{max(a.miss_mm for a in there):.1f} mm in space ({worst} in the pictures)"
        return (
            f"{lines[0].upper()}{lines[1:]}; all {_number(len(there))} goals truly reached, "
            f"to {worst} or better."
        )
    missed = [f"{a.name} was {a.outcome}" for a in run.goal_runs if not a.reached]
    if not drawn(run.results["lines"]):
        missed.insert(0, lines)
    return f"Not everything worked: {'; '.join(missed)}."


def in_space(run: DemoResult) -> bool:
    """Return True if the tip went through space, and not in a plane."""
    return any(goal_run.space for goal_run in run.goal_runs)


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


def table_rows(run: DemoResult) -> list[tuple[str, ...]]:
    """The cells of the table, a row for each run."""
    return [
        (
            a.name,
            a.method,
            str(a.verdict["verdict"]),
            "" if a.verdict.get("error") is None else f"{a.verdict['error']:.1f}",
            f"{a.error:.1f}",
            f"{a.miss_mm:.1f}",
            str(a.verdict["moves"]),
            f"{a.seconds:.1f}",
            "yes" if a.reached else "no",
        )
        for a in [*run.goal_runs, *([run.baseline] if run.baseline else [])]
    ]


def table(run: DemoResult) -> Table:
    """The outcome, for a terminal."""
    shown = Table(*HEADINGS, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for number, column in enumerate(shown.columns):
        column.no_wrap = True
        column.justify = "right" if 3 <= number < 8 else "left"
    for number, row in enumerate(table_rows(run)):
        if number == len(run.goal_runs):
            shown.add_section()
        yes = row[-1] == "yes"
        shown.add_row(*map(escape_markup, row[:-1]), f"[{'green' if yes else 'red'}]{row[-1]}[/]")
    return shown


def looks_of(goal_run: GoalRun, camera: str) -> np.ndarray:
    """Places (n, 2), px, of the tip in a camera's picture where the servo stopped to look."""
    names = [f"{camera}.u", f"{camera}.v"]
    seen = [dict(zip(step["rows"], step["s"] or (), strict=False)) for step in goal_run.log.steps]
    return np.array([[s[name] for name in names] for s in seen if s.keys() >= set(names)]).reshape(
        -1, 2
    )
