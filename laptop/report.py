"""The report of a demo: pictures and figures from its raw files, in one self-contained HTML file.

A folder of raw files goes in (see `laptop.demo`, which leaves it), pictures and a page come out.
Pictures are in the style of `laptop.reporting.line_plot`.  The README's one is made of the newest
run by

    from laptop import report
    report.write_overview("runs", "laptop/pictures/servo.jpg")
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from rich import box
from rich.markup import escape as escape_markup
from rich.table import Table

from laptop.reporting.charts import (
    GOALS,
    badge,
    draw_angle,
    draw_error,
    draw_goal,
    draw_legend,
    draw_way,
    frame_angles,
    frame_condition,
    frame_errors,
    name_camera,
    name_curves,
    show_picture,
)
from laptop.reporting.document import cells, document, figures, photograph, section
from laptop.reporting.document import table as html_table
from laptop.reporting.line_plot import (
    INK,
    QUIET,
    REACH,
    REACH_EDGE,
    STEEL,
    TICKS,
    WIDTH,
    new_figure,
    png_of,
)
from shared.arm_description import ArmError

STORY = "demo.json"
"""What the demo did, in its folder."""
PAGE = "report.html"

TRUE_SHARE = 1.6
"""A goal is reached where the true distance is at most so many tolerances."""

RIVAL = "#5b6167"


class BadRun(ArmError):
    """A folder that no demo left whole."""


# What happened


class Log(NamedTuple):
    """What the servo wrote: settings, observations, steps, remarks; the verdict if it came."""

    run: dict[str, Any]
    seen: list[dict[str, Any]]
    steps: list[dict[str, Any]]
    notes: list[dict[str, Any]]
    verdict: dict[str, Any] | None


def read_log(file: Path) -> Log:
    """A log of JSON lines; what is cut off at its end is left out.

    Raises:
        BadRun: it is none.
    """
    kinds: dict[str, list[dict[str, Any]]] = {}
    try:
        for line in file.read_text(encoding="utf-8").split("\n")[:-1]:
            entry = json.loads(line)
            kinds.setdefault(entry["kind"], []).append(entry)
    except (OSError, ValueError, LookupError, TypeError):
        raise BadRun(f"{file} is no log of visual_servoing.py; run the demo again") from None
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
class Approach:
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
        """Whether the brick says that it is there."""
        return bool(self.verdict["verdict"] == "converged")

    @property
    def reached(self) -> bool:
        """Whether it truly is, whatever the brick says."""
        if self.within_mm is not None:
            return self.miss_mm <= self.within_mm
        return self.error <= TRUE_SHARE * self.tolerance

    @property
    def within_mm(self) -> float | None:
        """What counts as reached in space; None in the plane, where px decide."""
        return self.space and TRUE_SHARE * self.tolerance * self.space.mm_per_px

    @property
    def outcome(self) -> str:
        """What came of it, in a few words."""
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
class Run:
    """One demo.

    Attributes:
        folder: its raw files.
        story: what STORY holds.
        approaches: one for each goal, by the default method.
        rival: the first goal by the report's method; None if it did not come to its end.
    """

    folder: Path
    story: dict[str, Any]
    approaches: list[Approach]
    rival: Approach | None

    @property
    def worked(self) -> bool:
        """Whether every line was drawn and every goal truly reached by the default method."""
        return drawn(self.story["lines"]) and all(a.reached for a in self.approaches)


def read_approach(folder: Path, record: dict[str, Any]) -> Approach:
    """What one entry of STORY stands for.

    Raises:
        BadRun: something is missing or cannot be understood.
    """
    try:
        log = read_log(folder / record["log"])
        if log.verdict is None:
            raise BadRun(f"{folder / record['log']} ends without a verdict; run the demo again")
        goal = tuple(map(float, record["goal"]))
        path = np.array(record["path"], dtype=float).reshape(-1, 1 + len(goal))
        space = None
        if "place" in record:
            tips = np.array(record["tips"], dtype=float).reshape(-1, 3)
            space = Space(tuple(record["place"]), tips, float(record["mm_per_px"]))
        return Approach(record["name"], log, goal, path, float(record["miss_mm"]), space)
    except (LookupError, TypeError, ValueError):
        raise BadRun(f"{folder / STORY} is not of a demo; run the demo again") from None


def read_run(folder: Path) -> Run:
    """The demo that left this folder.

    Raises:
        BadRun: something is missing or cannot be understood.
    """
    try:
        story = json.loads((folder / STORY).read_text(encoding="utf-8"))
        approaches = [read_approach(folder, record) for record in story["approaches"]]
        rival = story["rival"] and read_approach(folder, story["rival"])
    except (OSError, LookupError, TypeError, ValueError):
        raise BadRun(f"{folder / STORY} is not of a demo; run the demo again") from None
    return Run(folder, story, approaches, rival or None)


def drawn(lines: Sequence[dict[str, Any] | None]) -> bool:
    """Whether every line was drawn and measured."""
    return bool(lines) and all(line is not None for line in lines)


# In words


def lines_text(lines: Sequence[dict[str, Any] | None]) -> str:
    """How well the lines were drawn."""
    there = [line for line in lines if line]
    if not there:
        return "none of the lines was drawn"
    worst = max(line["greatest_mm"] for line in there)
    count = f"{len(there)} lines" if len(there) == len(lines) else f"{len(there)} of {len(lines)}"
    return f"{count} drawn, at most {worst:.1f} mm off"


def headline(run: Run) -> str:
    """What came of it, in one sentence."""
    there = [a for a in run.approaches if a.reached]
    lines = lines_text(run.story["lines"])
    if run.worked:
        worst = f"{max(a.error for a in there):.1f} px"
        if _in_space(run):
            worst = f"{max(a.miss_mm for a in there):.1f} mm in space ({worst} in the pictures)"
        return (
            f"{lines[0].upper()}{lines[1:]}; all {_number(len(there))} goals truly reached, "
            f"to {worst} or better."
        )
    missed = [f"{a.name} was {a.outcome}" for a in run.approaches if not a.reached]
    if not drawn(run.story["lines"]):
        missed.insert(0, lines)
    return f"Not everything worked: {'; '.join(missed)}."


def _in_space(run: Run) -> bool:
    return any(approach.space for approach in run.approaches)


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


def _rows(run: Run) -> list[tuple[str, ...]]:
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
        for a in [*run.approaches, *([run.rival] if run.rival else [])]
    ]


def table(run: Run) -> Table:
    """The outcome, for a terminal."""
    shown = Table(*HEADINGS, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for number, column in enumerate(shown.columns):
        column.no_wrap = True
        column.justify = "right" if 3 <= number < 8 else "left"
    for number, row in enumerate(_rows(run)):
        if number == len(run.approaches):
            shown.add_section()
        yes = row[-1] == "yes"
        shown.add_row(*map(escape_markup, row[:-1]), f"[{'green' if yes else 'red'}]{row[-1]}[/]")
    return shown


# Pictures


def draw_camera(run: Run) -> bytes:
    """Every camera's last picture with the true way of the tip, as PNG."""
    count = len(run.story["cameras"])
    width, height = run.story["size"]
    tall = round(WIDTH / count * height / width) + 90
    with new_figure(tall) as figure:
        for view in range(count):
            box = (view / count, 90 / tall, 1 / count, 1 - 90 / tall)
            _draw_camera(figure.add_axes(box), run, view)
        _draw_legend(figure, run, 42 / tall, {"goal, tolerance": {"marker": "+", "ms": 11}})
        return png_of(figure)


def draw_space(run: Run) -> bytes | None:
    """The true way of the tip in space, seen askew, from above and from the side, as PNG."""
    if not _in_space(run):
        return None
    with new_figure(1000) as figure:
        _draw_space(figure.add_axes((-0.02, 0.05, 0.6, 0.95), **ASKEW), run)
        for names, bottom in (("xy", 0.595), ("xz", 0.125)):
            _draw_side(figure.add_axes((0.62, bottom, 0.365, 0.365)), run, names)
        marks = {"goal": {"marker": "o", "ms": 11, "mfc": "white"}, "base": BASE}
        _draw_legend(figure, run, 0.035, marks)
        return png_of(figure)


def draw_lines(run: Run) -> bytes | None:
    """The lines, as `simulate` has drawn them, as PNG."""
    return _left(run.folder / "drawing" / "picture.png")


def draw_lines_from_the_side(run: Run) -> bytes | None:
    """The same from the side; None in the plane."""
    return _left(run.folder / "drawing" / "picture-side.png")


def _left(file: Path) -> bytes | None:
    return file.read_bytes() if file.exists() else None


def draw_errors(run: Run) -> bytes:
    """The distance from the goal in time, as PNG."""
    with new_figure(700) as figure:
        _draw_errors(figure, run, (0.065, 0.12, 0.43, 0.76), (0.56, 0.12, 0.42, 0.76))
        return png_of(figure)


def draw_condition(run: Run) -> bytes:
    """The condition of the image Jacobian, move by move, as PNG."""
    with new_figure(620) as figure:
        _draw_condition(figure.add_axes((0.065, 0.14, 0.915, 0.74)), run)
        return png_of(figure)


def draw_joints(run: Run) -> bytes:
    """The joints in time, a panel for each goal, as PNG."""
    with new_figure(620) as figure:
        _draw_joints(figure, run)
        return png_of(figure)


def write_overview(folder: str, file: str) -> None:
    """The camera's picture and the errors side by side, as JPEG, for a README.

    Args:
        folder: of a demo, or the one that holds those of all demos: then the newest.
        file: where to.

    Raises:
        BadRun: there is no whole demo.
    """
    place = Path(folder)
    if not (place / STORY).exists():
        place = max((there.parent for there in place.glob(f"*/{STORY}")), default=place)
    run = read_run(place)
    with new_figure(1040 if _in_space(run) else 690) as figure:
        if _in_space(run):
            for view in range(2):
                _draw_camera(figure.add_axes((0.345 * view, 0.605, 0.3425, 0.395)), run, view)
            _draw_space(figure.add_axes((0.68, 0.555, 0.32, 0.445), **ASKEW), run)
            boxes = (0.055, 0.073, 0.425, 0.41), (0.555, 0.073, 0.425, 0.41)
        else:
            _draw_camera(figure.add_axes((0, 0, 920 / WIDTH, 1)), run)
            boxes = (0.635, 0.605, 0.355, 0.325), (0.635, 0.105, 0.355, 0.325)
        _draw_errors(figure, run, *boxes)
        picture = png_of(figure)
    Path(file).write_bytes(photograph(picture, 82))


def _draw_camera(axes: Axes, run: Run, view: int = 0) -> None:
    """One camera's last picture, and what truly went on in it."""
    names = run.story["cameras"]
    several = len(names) > 1
    data = cv2.imread(str(run.folder / (f"camera-{names[view]}.png" if several else "camera.png")))
    width, height = run.story["size"]
    show_picture(axes, data, width, height)
    columns = slice(2 * view, 2 * view + 2)
    inks = [np.array(stroke)[:, 3:][:, columns] for stroke in run.story["ink"]]
    _draw_ways(
        axes,
        run,
        inks,
        lambda approach: (approach.path[:, 1:][:, columns], _looks(approach, names[view])),
    )
    for number, (approach, colour) in enumerate(zip(run.approaches, GOALS, strict=False), 1):
        x, y = approach.goal[columns]
        draw_goal(axes, x, y, approach.tolerance, colour, str(number), several)
    if several:
        name_camera(axes, names[view], height)


def _looks(approach: Approach, camera: str) -> np.ndarray:
    """Where the servo saw the tip in a camera's picture (n, 2) as it stopped to look, px."""
    names = [f"{camera}.u", f"{camera}.v"]
    seen = [dict(zip(step["rows"], step["s"] or (), strict=False)) for step in approach.log.steps]
    return np.array([[s[name] for name in names] for s in seen if s.keys() >= set(names)]).reshape(
        -1, 2
    )


def _draw_ways(
    axes: Axes,
    run: Run,
    inks: Sequence[np.ndarray],
    seen: Callable[[Approach], tuple[np.ndarray, np.ndarray]],
) -> None:
    """The ways of the tip.

    Args:
        axes: of two or three coordinates.
        run: the demo.
        inks: the lines drawn before, points (n, coordinates) of each.
        seen: of an approach, points (n, coordinates) of its way and of where it looked.
    """
    for ink in inks:
        axes.plot(*ink.T, color=QUIET, lw=1.6, zorder=2, solid_capstyle="round")
    if run.rival:
        axes.plot(*seen(run.rival)[0].T, color=INK, lw=1.4, ls=(0, (1, 1.6)), zorder=3)
    for approach, colour in zip(run.approaches, GOALS, strict=False):
        draw_way(axes, *seen(approach), colour)


ASKEW: dict[str, Any] = {
    "projection": "3d",
    "computed_zorder": False,
    "elev": 20,
    "azim": -62,
    "proj_type": "ortho",
}
"""Axes in space, and from where they are seen."""
BASE: dict[str, Any] = {
    "ls": "",
    "marker": "s",
    "ms": 8,
    "color": STEEL,
    "mec": "white",
    "zorder": 1,
}
"""Where the arm stands."""


def _draw_space(axes: Any, run: Run) -> None:
    """The ways in space, on axes in ASKEW."""
    low, high = _extent(run)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(0, high[2]))
    axes.set_box_aspect(high - low)
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", strict=True):
        axis.set_pane_color(REACH if name == "z" else "white")
        axis.line.set_color(REACH_EDGE)
        axis._axinfo["grid"].update(color=REACH_EDGE, linewidth=0.5)
        axis.set_label_text(f"{name}  cm")
        axis.labelpad = -4
    axes.tick_params(pad=-3)
    axes.plot([0], [0], [0], **BASE)
    axes.locator_params(nbins=5, steps=TICKS)
    ends = [np.array([approach.space.place]) for approach in run.approaches if approach.space]
    for end, colour in zip(ends, GOALS, strict=False):
        foot = np.concatenate([end, end * (1, 1, 0)])
        axes.plot(*foot.T, color=colour, lw=0.9, ls=(0, (2, 2)), zorder=1)
        axes.plot(*foot[1:].T, "x", color=colour, ms=4, zorder=1)
    _draw_ways(axes, run, _inks(run), _in_cm)
    for number, (end, colour) in enumerate(zip(ends, GOALS, strict=False), 1):
        axes.plot(*end.T, "o", ms=8.5, mfc=colour, mec="white", mew=1.2, zorder=7)
        axes.text(*(end[0] + (0, 0, 0.075 * high[2])), str(number), **badge(colour))


def _draw_side(axes: Axes, run: Run, names: str) -> None:
    """The ways from one side, which shows two coordinates."""
    view = ["xyz".index(name) for name in names]
    low, high = (corner[view] for corner in _extent(run))
    middle, sides = (low + high) / 2, axes.bbox.size
    half = max((high - low) / sides) * sides / 2  # equal scales
    axes.set(
        xlim=(middle[0] - half[0], middle[0] + half[0]),
        ylim=(middle[1] - half[1], middle[1] + half[1]),
    )
    axes.plot([0], [0], **BASE)
    axes.grid(color=REACH_EDGE, lw=0.5)
    axes.set_axisbelow(True)
    title = "From above" if names == "xy" else "From the side"
    axes.set_title(title, loc="left", size=9.5, color=INK, weight="bold", pad=6)
    axes.set(xlabel=f"{names[0]}  cm", ylabel=f"{names[1]}  cm")
    axes.locator_params(nbins=7, steps=TICKS)

    def seen(approach: Approach) -> tuple[np.ndarray, np.ndarray]:
        way, looks = _in_cm(approach)
        return way[:, view], looks[:, view]

    _draw_ways(axes, run, [ink[:, view] for ink in _inks(run)], seen)
    for number, (approach, colour) in enumerate(zip(run.approaches, GOALS, strict=False), 1):
        if approach.space and approach.within_mm:
            x, y = np.array(approach.space.place)[view]
            for ink, wide in (("white", 3.6), (colour, 1.8)):
                ring = Circle(
                    (x, y), approach.within_mm / 10, fill=False, ec=ink, lw=wide, zorder=7
                )
                axes.add_patch(ring)
            offset: dict[str, Any] = {"xytext": (13, 11), "textcoords": "offset points"}
            axes.annotate(str(number), (x, y), **offset, **badge(colour))


def _inks(run: Run) -> list[np.ndarray]:
    """The lines drawn in space, points (n, 3) of each, cm."""
    return [np.array(stroke)[:, :3] for stroke in run.story["ink"]]


def _in_cm(approach: Approach) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of an approach in space, cm: its way, and where it looked."""
    assert approach.space
    tips, t = approach.space.tips, approach.path[:, 0]
    times = [step["t"] for step in approach.log.steps]
    return tips, np.column_stack([np.interp(times, t, values) for values in tips.T])


def _extent(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,), cm, of a box on the table that holds all ways, and the arm's base."""
    everybody = [*run.approaches, *([run.rival] if run.rival else [])]
    ways = [approach.space.tips for approach in everybody if approach.space]
    points = np.concatenate([np.zeros((1, 3)), *ways, *_inks(run)])
    return np.floor(points.min(axis=0) - (2, 2, 0)), np.ceil(points.max(axis=0) + 2)


def _draw_legend(
    figure: Figure, run: Run, height: float, others: dict[str, dict[str, Any]]
) -> None:
    """What is what, in one line; `others` are marks of one picture alone, by their names."""
    axes = figure.add_axes((0, 0, 1, 1), zorder=-1)
    axes.set_axis_off()
    handles = [
        (axes.plot([], [], color=colour, lw=2.4)[0], f"to {approach.name}")
        for approach, colour in zip(run.approaches, GOALS, strict=False)
    ]
    if run.rival:
        line = axes.plot([], [], color=INK, lw=1.4, ls=(0, (1, 1.6)))[0]
        handles.append((line, f"to {run.rival.name}, the report's method"))
    if run.story["ink"]:
        handles.append((axes.plot([], [], color=QUIET, lw=1.6)[0], "drawn before"))
    grey: dict[str, Any] = {"ls": "", "color": QUIET}
    handles += [
        (axes.plot([], [], marker="o", ms=8, mfc="white", mew=2, **grey)[0], "start"),
        (axes.plot([], [], marker="o", ms=4.5, **grey)[0], "where it looked"),
    ]
    handles += [
        (axes.plot([], [], **{"mew": 2, **grey, **style})[0], name)
        for name, style in others.items()
    ]
    draw_legend(figure, handles, height)


def _draw_errors(figure: Figure, run: Run, own: Any, both: Any) -> None:
    """Two panels in their boxes: all goals; and one of them by both methods."""
    everybody = [*run.approaches, *([run.rival] if run.rival else [])]
    most = max((float(a.errors[:, 1].max()) for a in everybody), default=100.0)
    axes = figure.add_axes(own)
    _frame_errors(axes, run, most, f"All goals, {_methods(run)}", 0.012)
    for approach, colour in zip(run.approaches, GOALS, strict=False):
        _draw_error(axes, approach, colour, approach.name)
    axes.set_xlim(0, max((a.seconds for a in run.approaches), default=1.0) * 1.05 + 0.3)
    name_curves(axes)
    axes = figure.add_axes(both)
    if run.rival is None:
        axes.set_axis_off()
        words = "the report's method did not come to its end"
        axes.text(0.5, 0.5, words, ha="center", color=QUIET, transform=axes.transAxes)
        return
    same = next(a for a in run.approaches if a.name == run.rival.name)
    _frame_errors(axes, run, most, f"{same.name.capitalize()}, both methods", 0.36)
    _draw_error(axes, run.rival, RIVAL, f"{run.rival.method} {run.rival.seconds:.0f} s")
    colour = GOALS[run.approaches.index(same) % len(GOALS)]
    _draw_error(axes, same, colour, f"{same.method} {same.seconds:.0f} s")
    axes.set_xlim(0, max(same.seconds, run.rival.seconds) * 1.03)
    name_curves(axes)


def _methods(run: Run) -> str:
    return ", ".join(sorted({approach.method for approach in run.approaches}))


def _frame_errors(axes: Axes, run: Run, most: float, title: str, free: float) -> None:
    """Axes for errors up to `most` px; `free` is where no curve crosses the tolerance."""
    tolerance = run.approaches[0].tolerance if run.approaches else 5.0
    frame_errors(axes, most, tolerance, title, free)
    axes.set_ylabel("true distance from the goal  px")


def _draw_error(axes: Axes, approach: Approach, colour: str, label: str) -> None:
    t, error = approach.errors.T
    now = t <= approach.seconds
    t = np.append(t[now], approach.seconds)
    error = np.append(error[now], np.interp(approach.seconds, *approach.errors.T))
    looks = [(step["t"], step["error"]) for step in approach.log.steps if step.get("error")]
    draw_error(axes, t, error, np.array(looks), colour, label)


def _draw_condition(axes: Axes, run: Run) -> None:
    everybody = list(zip(run.approaches, GOALS, strict=False))
    everybody += [(run.rival, RIVAL)] if run.rival else []
    greatest = 10.0
    for approach, colour in everybody:
        known = [
            (number, step["condition"])
            for number, step in enumerate(approach.log.steps)
            if step.get("condition") is not None
        ]
        rival = approach is run.rival
        label = "the report's method" if rival else approach.name
        ends = (0, (1, 1.6)) if rival else "-"
        x, y = np.array(known, dtype=float).reshape(-1, 2).T
        axes.plot(x, y, color=colour, lw=1.7, ls=ends, marker="o", ms=4, label=label)
        greatest = max(greatest, float(y.max(initial=0.0)))
    frame_condition(axes, greatest)
    axes.set_xlabel("step")
    axes.locator_params(axis="x", nbins=12, steps=TICKS, integer=True)
    name_curves(axes)


def _draw_joints(figure: Figure, run: Run) -> None:
    count = max(1, len(run.approaches))
    wide = 0.925 / count
    first: Axes | None = None
    for number, approach in enumerate(run.approaches):
        box = (0.065 + number * wide, 0.14, wide - 0.025, 0.72)
        axes = figure.add_axes(box, sharey=first)
        first = first or axes
        steps = approach.log.steps
        for joint, name in enumerate(approach.log.run.get("joints", [])):
            seen = [(line["t"], line["q"][joint]) for line in approach.log.seen if line.get("q")]
            measured = [(step["t"], step["q"][joint]) for step in steps]
            draw_angle(axes, joint, name, seen, measured)
        frame_angles(axes, approach.name.capitalize())
        if number:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("joint angles  deg")
        if number == count - 1:
            name_curves(axes)


# The page

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


def write(run: Run) -> Path:
    """Write PAGE into the run's folder; where it is.

    Raises:
        BadRun: it cannot be written.
    """
    sections = []
    for heading, caption, draw in CAPTIONS:
        picture = draw(run)
        if picture:
            sections.append(section(heading, caption, picture))
    page = document(
        "BrickServo: a demo",
        run.worked,
        "It worked." if run.worked else "It did not all work.",
        headline(run),
        _facts(run),
        _table(run),
        _note(run),
        _REST.substitute(
            figures="\n".join(sections),
            moves="\n".join(
                _moves(a) for a in [*run.approaches, *([run.rival] if run.rival else [])]
            ),
            command=escape(str(run.story["command"])),
            files="\n".join(
                f"<li><code>{escape(name)}</code>: {escape(what)}</li>" for name, what in _FILES
            ),
        ),
    )
    file = run.folder / PAGE
    try:
        file.write_text(page, encoding="utf-8")
    except OSError as error:
        raise BadRun(f"cannot write {file}: {error.strerror}; make room there") from None
    return file


def _facts(run: Run) -> str:
    facts = [f"arm {run.story['arm']}", f"scene {run.story['scene']}"]
    if run.story.get("seconds"):
        facts.append(f"{run.story['seconds']:.0f} s from start to end")
    if run.story.get("cpu") is not None:
        facts.append(f"the brick computes with cpu={run.story['cpu']:g}")
    if run.story.get("pace"):
        facts.append(f"emulated clock at {run.story['pace']:.2f} x real time")
    return ", ".join(facts)


def _note(run: Run) -> str:
    tolerance = run.approaches[0].tolerance if run.approaches else 5.0
    within = [a.within_mm for a in run.approaches if a.within_mm]
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
    if run.rival:
        words += (
            " The last row is the report's own method for comparison, on the same emulated arm "
            "in virtual time; it does not count for the outcome."
        )
    elif run.story.get("trouble"):
        words += f" For comparison there is no run of the report's method: {run.story['trouble']}."
    return words


def _table(run: Run) -> str:
    rows = []
    for number, row in enumerate(_rows(run)):
        kind = ' class="rival"' if number >= len(run.approaches) else ""
        mark = f'<td class="{row[-1]}">{row[-1]}</td>'
        rows.append(f"<tr{kind}>{cells(row[:-1])}{mark}</tr>")
    return html_table(HEADINGS, rows)


def _moves(approach: Approach) -> str:
    """Every step of one run, to be unfolded."""
    rows = []
    for step in approach.log.steps:
        q, wanted = step.get("q") or [], step.get("q_wanted")
        turn = [math.degrees(b - a) for a, b in zip(q, wanted, strict=True)] if wanted else []
        texts = [
            f"{step['t']:.1f}",
            str(step.get("action") or ""),
            str(step.get("model") or ""),
            figures([step["error"]] if step.get("error") is not None else [], "{:.1f}"),
            figures([math.degrees(a) for a in q], "{:.1f}"),
            figures(turn, "{:+.1f}"),
            str(step.get("frames") or ""),
        ]
        rows.append(f"<tr>{cells(texts)}</tr>")
    notes = "".join(
        f"<li>{note['t']:.1f} s: {escape(str(note['text']))}</li>" for note in approach.log.notes
    )
    names = ("s", "action", "model", "off, px", "joints, deg", "turned by, deg", "frames")
    reason = escape(str(approach.verdict.get("reason", "")))
    return (
        f"<details><summary>{escape(approach.name)}, {escape(approach.method)}: "
        f"{escape(approach.words)}</summary><p>{reason}</p>"
        f"{f'<ul>{notes}</ul>' if notes else ''}"
        f'<div class="wide">{html_table(names, rows)}</div></details>'
    )


_FILES = (
    (STORY, "everything that the figures and pictures here were made of, with the logs"),
    ("goal-1.jsonl, ..., report-method.jsonl", "what the servo saw, decided and did"),
    ("goal-1/trace.csv, ...", "the true motion of the arm"),
    ("drawing/", "the lines: their true ink, their picture, their figures"),
    ("track.csv, camera*.png", "what the tracker found in every picture, and the last one"),
    ("*.txt", "what each program printed"),
)

_REST = Template("""$figures
<section><h2>Every step</h2>
$moves
</section>
<section><h2>Once more</h2>
<p>In the checkout, without a brick or a camera:</p>
<pre>$command</pre>
<p class="note">With <code>--seed 7</code> the camera stands elsewhere and the goals are others. The
programs run in real time, so no two runs are alike to the last digit.</p>
<p>Beside this page are the raw files:</p>
<ul class="note">
$files
</ul></section>""")
