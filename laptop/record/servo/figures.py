"""The figures of a demo's report, as PNG, in the style of `laptop.record.figures.sheet`.

The README's pictures are made of the newest run by

    from laptop.record.servo import figures
    figures.write_overview("runs", "laptop/pictures/servo.jpg")
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from laptop.record.figures.charts import (
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
    head,
    name_camera,
    name_curves,
    show_picture,
)
from laptop.record.figures.document import photograph
from laptop.record.figures.sheet import (
    INK,
    QUIET,
    REACH,
    REACH_EDGE,
    STEEL,
    TICKS,
    WIDTH,
    Sheet,
    new_figure,
    png_of,
)
from laptop.record.servo.results import (
    RESULTS_FILE,
    DemoResult,
    GoalRun,
    in_space,
    looks_of,
    read_run,
)

BASELINE_COLOUR = "#5b6167"


def draw_camera(run: DemoResult) -> bytes:
    """Every camera's last picture with the true way of the tip, as PNG."""
    count = len(run.results["cameras"])
    width, height = run.results["size"]
    tall = round(WIDTH / count * height / width) + 90
    with new_figure(tall) as figure:
        for view in range(count):
            box = (view / count, 90 / tall, 1 / count, 1 - 90 / tall)
            _draw_camera(figure.add_axes(box), run, view)
        _draw_legend(figure, run, 42 / tall, {"goal, tolerance": {"marker": "+", "ms": 11}})
        return png_of(figure)


def draw_space(run: DemoResult) -> bytes | None:
    """The true way of the tip in space, seen askew, from above and from the side, as PNG."""
    if not in_space(run):
        return None
    with new_figure(1000) as figure:
        _draw_space(figure.add_axes((-0.02, 0.05, 0.6, 0.95), **ASKEW), run)
        for names, bottom in (("xy", 0.59), ("xz", 0.125)):
            _draw_side(Sheet(figure, (0.62, bottom, 0.365, 0.365), names), run, names)
        marks = {"goal": {"marker": "o", "ms": 11, "mfc": "white"}, "base": BASE}
        _draw_legend(figure, run, 0.035, marks)
        return png_of(figure)


def draw_lines(run: DemoResult) -> bytes | None:
    """The lines, as `simulate` has drawn them, as PNG."""
    return _left(run.folder / "drawing" / "picture.png")


def draw_lines_from_the_side(run: DemoResult) -> bytes | None:
    """The same from the side; None in the plane."""
    return _left(run.folder / "drawing" / "picture-side.png")


def _left(file: Path) -> bytes | None:
    return file.read_bytes() if file.exists() else None


def draw_errors(run: DemoResult) -> bytes:
    """The distance from the goal in time, as PNG."""
    with new_figure(700) as figure:
        _draw_errors(figure, run, (0.065, 0.12, 0.43, 0.76), (0.56, 0.12, 0.42, 0.76))
        return png_of(figure)


def draw_condition(run: DemoResult) -> bytes:
    """The condition of the image Jacobian, move by move, as PNG."""
    with new_figure(620) as figure:
        _draw_condition(figure.add_axes((0.065, 0.14, 0.915, 0.74)), run)
        return png_of(figure)


def draw_joints(run: DemoResult) -> bytes:
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
    if not (place / RESULTS_FILE).exists():
        place = max((there.parent for there in place.glob(f"*/{RESULTS_FILE}")), default=place)
    run = read_run(place)
    with new_figure(1040 if in_space(run) else 690) as figure:
        if in_space(run):
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


def _draw_camera(axes: Axes, run: DemoResult, view: int = 0) -> None:
    """One camera's last picture, and what truly went on in it."""
    names = run.results["cameras"]
    several = len(names) > 1
    file = run.folder / (f"camera-{names[view]}.png" if several else "camera.png")
    data = cv2.imread(str(file)) if file.is_file() else None
    width, height = run.results["size"]
    show_picture(axes, data, width, height)
    columns = slice(2 * view, 2 * view + 2)
    inks = [np.array(stroke)[:, 3:][:, columns] for stroke in run.results["ink"]]
    _draw_ways(
        axes,
        run,
        inks,
        lambda goal_run: (goal_run.path[:, 1:][:, columns], looks_of(goal_run, names[view])),
    )
    for number, (goal_run, colour) in enumerate(zip(run.goal_runs, GOALS, strict=False), 1):
        x, y = goal_run.goal[columns]
        draw_goal(axes, x, y, goal_run.tolerance, colour, str(number), several)
    if several:
        name_camera(axes, names[view], height)


def _draw_ways(
    axes: Axes,
    run: DemoResult,
    inks: Sequence[np.ndarray],
    seen: Callable[[GoalRun], tuple[np.ndarray, np.ndarray]],
) -> None:
    """The ways of the tip.

    Args:
        axes: of two or three coordinates.
        run: the demo.
        inks: the lines drawn before, points (n, coordinates) of each.
        seen: of an goal_run, points (n, coordinates) of its way and of where it looked.
    """
    for ink in inks:
        axes.plot(*ink.T, color=QUIET, lw=1.6, zorder=2, solid_capstyle="round")
    if run.baseline:
        axes.plot(*seen(run.baseline)[0].T, color=INK, lw=1.4, ls=(0, (1, 1.6)), zorder=3)
    for goal_run, colour in zip(run.goal_runs, GOALS, strict=False):
        draw_way(axes, *seen(goal_run), colour)


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
"""Mark of the arm's base."""


def _draw_space(axes: Any, run: DemoResult) -> None:
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
    ends = [np.array([goal_run.space.place]) for goal_run in run.goal_runs if goal_run.space]
    for end, colour in zip(ends, GOALS, strict=False):
        foot = np.concatenate([end, end * (1, 1, 0)])
        axes.plot(*foot.T, color=colour, lw=0.9, ls=(0, (2, 2)), zorder=1)
        axes.plot(*foot[1:].T, "x", color=colour, ms=4, zorder=1)
    _draw_ways(axes, run, _inks(run), _in_cm)
    for number, (end, colour) in enumerate(zip(ends, GOALS, strict=False), 1):
        axes.plot(*end.T, "o", ms=8.5, mfc=colour, mec="white", mew=1.2, zorder=7)
        axes.text(*(end[0] + (0, 0, 0.075 * high[2])), str(number), **badge(colour))


def _draw_side(sheet: Sheet, run: DemoResult, names: str) -> None:
    """The ways from one side, which shows two coordinates."""
    axes = sheet.axes
    sheet.show(sheet.seen(_extent(run)), room=0.0)
    axes.plot([0], [0], **BASE)
    head(axes, "From above" if names == "xy" else "From the side")

    def seen(goal_run: GoalRun) -> tuple[np.ndarray, np.ndarray]:
        way, looks = _in_cm(goal_run)
        return sheet.seen(way), sheet.seen(looks)

    _draw_ways(axes, run, [sheet.seen(ink) for ink in _inks(run)], seen)
    for number, (goal_run, colour) in enumerate(zip(run.goal_runs, GOALS, strict=False), 1):
        if goal_run.space and goal_run.within_mm:
            x, y = sheet.seen([goal_run.space.place])[0]
            for ink, wide in (("white", 3.6), (colour, 1.8)):
                ring = Circle(
                    (x, y), goal_run.within_mm / 10, fill=False, ec=ink, lw=wide, zorder=7
                )
                axes.add_patch(ring)
            offset: dict[str, Any] = {"xytext": (13, 11), "textcoords": "offset points"}
            axes.annotate(str(number), (x, y), **offset, **badge(colour))


def _inks(run: DemoResult) -> list[np.ndarray]:
    """The lines drawn in space, points (n, 3) of each, cm."""
    return [np.array(stroke)[:, :3] for stroke in run.results["ink"]]


def _in_cm(goal_run: GoalRun) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a run to a goal in space, cm: its way, and where it looked."""
    assert goal_run.space
    tips, t = goal_run.space.tips, goal_run.path[:, 0]
    times = [step["t"] for step in goal_run.log.steps]
    return tips, np.column_stack([np.interp(times, t, values) for values in tips.T])


def _extent(run: DemoResult) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,), cm, of a box on the table that holds all ways, and the arm's base."""
    everybody = [*run.goal_runs, *([run.baseline] if run.baseline else [])]
    ways = [goal_run.space.tips for goal_run in everybody if goal_run.space]
    points = np.concatenate([np.zeros((1, 3)), *ways, *_inks(run)])
    return np.floor(points.min(axis=0) - (2, 2, 0)), np.ceil(points.max(axis=0) + 2)


def _draw_legend(
    figure: Figure, run: DemoResult, height: float, others: dict[str, dict[str, Any]]
) -> None:
    """Draw the legend in one line; `others` are marks of one picture alone, by their names."""
    axes = figure.add_axes((0, 0, 1, 1), zorder=-1)
    axes.set_axis_off()
    handles = [
        (axes.plot([], [], color=colour, lw=2.4)[0], f"to {goal_run.name}")
        for goal_run, colour in zip(run.goal_runs, GOALS, strict=False)
    ]
    if run.baseline:
        line = axes.plot([], [], color=INK, lw=1.4, ls=(0, (1, 1.6)))[0]
        handles.append((line, f"to {run.baseline.name}, the report's method"))
    if run.results["ink"]:
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


def _draw_errors(figure: Figure, run: DemoResult, own: Any, both: Any) -> None:
    """Two panels in their boxes: all goals; and one of them by both methods."""
    everybody = [*run.goal_runs, *([run.baseline] if run.baseline else [])]
    most = max((float(a.errors[:, 1].max()) for a in everybody), default=100.0)
    axes = figure.add_axes(own)
    _frame_errors(axes, run, most, f"All goals, {_methods(run)}", 0.012)
    for goal_run, colour in zip(run.goal_runs, GOALS, strict=False):
        _draw_error(axes, goal_run, colour, goal_run.name)
    axes.set_xlim(0, max((a.seconds for a in run.goal_runs), default=1.0) * 1.05 + 0.3)
    name_curves(axes)
    axes = figure.add_axes(both)
    if run.baseline is None:
        axes.set_axis_off()
        words = "the report's method did not come to its end"
        axes.text(0.5, 0.5, words, ha="center", color=QUIET, transform=axes.transAxes)
        return
    same = next(a for a in run.goal_runs if a.name == run.baseline.name)
    _frame_errors(axes, run, most, f"{same.name.capitalize()}, both methods", 0.36)
    _draw_error(
        axes, run.baseline, BASELINE_COLOUR, f"{run.baseline.method} {run.baseline.seconds:.0f} s"
    )
    colour = GOALS[run.goal_runs.index(same) % len(GOALS)]
    _draw_error(axes, same, colour, f"{same.method} {same.seconds:.0f} s")
    axes.set_xlim(0, max(same.seconds, run.baseline.seconds) * 1.03)
    name_curves(axes)


def _methods(run: DemoResult) -> str:
    return ", ".join(sorted({goal_run.method for goal_run in run.goal_runs}))


def _frame_errors(axes: Axes, run: DemoResult, most: float, title: str, free: float) -> None:
    """Axes for errors up to `most` px; `free` is where no curve crosses the tolerance."""
    tolerance = run.goal_runs[0].tolerance if run.goal_runs else 5.0
    frame_errors(axes, most, tolerance, title, free)
    axes.set_ylabel("true distance from the goal  px")


def _draw_error(axes: Axes, goal_run: GoalRun, colour: str, label: str) -> None:
    t, error = goal_run.errors.T
    now = t <= goal_run.seconds
    t = np.append(t[now], goal_run.seconds)
    error = np.append(error[now], np.interp(goal_run.seconds, *goal_run.errors.T))
    looks = [(step["t"], step["error"]) for step in goal_run.log.steps if step.get("error")]
    draw_error(axes, t, error, np.array(looks), colour, label)


def _draw_condition(axes: Axes, run: DemoResult) -> None:
    everybody = list(zip(run.goal_runs, GOALS, strict=False))
    everybody += [(run.baseline, BASELINE_COLOUR)] if run.baseline else []
    greatest = 10.0
    for goal_run, colour in everybody:
        known = [
            (number, step["condition"])
            for number, step in enumerate(goal_run.log.steps)
            if step.get("condition") is not None
        ]
        baseline = goal_run is run.baseline
        label = "the report's method" if baseline else goal_run.name
        ends = (0, (1, 1.6)) if baseline else "-"
        x, y = np.array(known, dtype=float).reshape(-1, 2).T
        axes.plot(x, y, color=colour, lw=1.7, ls=ends, marker="o", ms=4, label=label)
        greatest = max(greatest, float(y.max(initial=0.0)))
    frame_condition(axes, greatest)
    axes.set_xlabel("step")
    axes.locator_params(axis="x", nbins=12, steps=TICKS, integer=True)
    name_curves(axes)


def _draw_joints(figure: Figure, run: DemoResult) -> None:
    count = max(1, len(run.goal_runs))
    wide = 0.925 / count
    first: Axes | None = None
    for number, goal_run in enumerate(run.goal_runs):
        box = (0.065 + number * wide, 0.14, wide - 0.025, 0.72)
        axes = figure.add_axes(box, sharey=first)
        first = first or axes
        steps = goal_run.log.steps
        for joint, name in enumerate(goal_run.log.run.get("joints", [])):
            seen = [(line["t"], line["q"][joint]) for line in goal_run.log.seen if line.get("q")]
            measured = [(step["t"], step["q"][joint]) for step in steps]
            draw_angle(axes, joint, name, seen, measured)
        frame_angles(axes, goal_run.name.capitalize())
        if number:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("joint angles  deg")
        if number == count - 1:
            name_curves(axes)
