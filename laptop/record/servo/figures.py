"""The figures of servo runs, as PNG: one set for a log, for the page and for a demo."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from laptop.record.figures.charts import (
    GOAL_COLOURS,
    badge,
    draw_angle,
    draw_error,
    draw_goal,
    draw_legend,
    draw_path,
    frame_angles,
    frame_condition,
    frame_errors,
    head,
    name_camera,
    name_curves,
    show_picture,
)
from laptop.record.figures.sheet import (
    BAND,
    INK,
    JOINTS,
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
from laptop.record.servo.servo_run import ServoRun

BASELINE_COLOUR = "#5b6167"
"""Colour of the baseline."""
MAX_NUMBERED = 9
"""Greatest number of goals that are numbered."""
MAX_PANELS = 4
"""Greatest number of runs with a panel each."""
MIN_PICTURE_HEIGHT, MAX_PICTURE_HEIGHT = 420, 900
"""Least and greatest height of a camera's picture in a figure, px."""


class Scenery(NamedTuple):
    """The surroundings of the runs.

    images  by camera, its last picture (BGR); one that has none is left out
    size    of pictures without an image, px; None: as far as the paths go
    ink     lines drawn before in space: points (n, 3 + 2 * cameras) of each line, cm and px
    """

    images: Mapping[str, np.ndarray] = {}
    size: tuple[int, int] | None = None
    ink: Sequence[np.ndarray] = ()


CAMERA_CAPTION = (
    "What the cameras saw: the last picture of each, where there is one, with the way of the tip. "
    "A ring is where it started, dots where the servo stopped to look, a cross the goal with its "
    "circle of tolerance. Nothing about camera or arm was calibrated: the first short moves show "
    "how the picture answers to each joint, every later one corrects that."
)
SPACE_CAPTION = (
    "The way in space, as the emulator knows it: the servo saw nothing but the pictures. The rings "
    "round the goals are what counts as reached."
)
ERROR_CAPTION = (
    "The distance from the goal in time, on a logarithmic scale; dots are what the servo measured, "
    "the shaded band is the tolerance. Flat pieces are rests, to look."
)
BASELINE_CAPTION = (
    " On the right one goal by both methods, from the same start: the lab report's method looks "
    "for two seconds at every step of at most ten degrees, so its time runs far longer."
)
JOINT_CAPTION = (
    "Joint angles as the encoders have them, with dots where the servo decided on a step; and how "
    "well the estimated image Jacobian could be inverted: 1 means that the picture answers alike "
    "to every motion of the joints. Where it peaks, a small error of the estimate becomes a large "
    "one of the step."
)


def draw(
    runs: Sequence[ServoRun], scenery: Scenery, baseline: ServoRun | None = None
) -> list[tuple[str, str, bytes]]:
    """Return (name, caption, PNG) of each figure for which there is something to draw.

    It is slow, and only one thread at a time may call it: matplotlib's style is global.

    Args:
        runs: one after another.
        scenery: their surroundings.
        baseline: one of the goals by another method, for comparison.
    """
    drawn: list[tuple[str, str, bytes | None]] = [
        ("cameras", CAMERA_CAPTION, draw_cameras(runs, scenery, baseline)),
        ("space", SPACE_CAPTION, draw_space(runs, scenery, baseline)),
        (
            "errors",
            ERROR_CAPTION + (BASELINE_CAPTION if baseline else ""),
            draw_errors(runs, baseline),
        ),
        ("joints", JOINT_CAPTION, draw_joints(runs, baseline)),
    ]
    return [(name, caption, picture) for name, caption, picture in drawn if picture]


def draw_cameras(
    runs: Sequence[ServoRun], scenery: Scenery, baseline: ServoRun | None = None
) -> bytes | None:
    """Draw the tip's paths into the picture of each camera, as PNG; None if there is none."""
    names = sorted({*scenery.images, *(camera for run in runs for camera in run.paths)})
    if not names:
        return None
    count = len(names)
    frames = {name: _frame(name, runs, scenery) for name in names}
    high = max(WIDTH / count * (f[3] - f[1]) / (f[2] - f[0]) for f in frames.values())
    tall = round(min(max(high, MIN_PICTURE_HEIGHT), MAX_PICTURE_HEIGHT)) + 90
    with new_figure(tall) as figure:
        for k, name in enumerate(names):
            bare = name not in scenery.images  # its axes have numbers, which need room
            left, foot, over = (0.055, 130, 20) if bare else (0, 90, 0)
            box = (k / count + left, foot / tall, 1 / count - 1.2 * left)
            axes = figure.add_axes((*box, 1 - (foot + over) / tall))
            _draw_camera(axes, name, runs, scenery, baseline, frames[name], count > 1)
        _draw_legend(figure, runs, baseline, scenery, 42 / tall)
        return png_of(figure)


Frame = tuple[float, float, float, float]


def _frame(name: str, runs: Sequence[ServoRun], scenery: Scenery) -> Frame:
    """Return left, top, right, bottom of the shown part of a picture, px."""
    if name in scenery.images:
        height, width = scenery.images[name].shape[:2]
        return (0, 0, width, height)
    if scenery.size:
        return (0, 0, *scenery.size)
    places = [run.paths[name][:, 1:] for run in runs if name in run.paths]
    places += [np.array([run.goals[name]]) for run in runs if name in run.goals]
    points = np.concatenate(places)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return (0, 0, 640, 480)
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, max(40.0, 0.6 * float((high - low).max()))
    return (
        *(float(middle[0] - 4 / 3 * half), float(middle[1] - half)),
        *(float(middle[0] + 4 / 3 * half), float(middle[1] + half)),
    )


def _draw_camera(
    axes: Axes,
    name: str,
    runs: Sequence[ServoRun],
    scenery: Scenery,
    baseline: ServoRun | None,
    frame: Frame,
    small: bool,
) -> None:
    left, top, right, bottom = frame
    image = scenery.images.get(name)
    show_picture(axes, image, round(right - left), round(bottom - top))
    axes.set(xlim=(left - 0.5, right - 0.5), ylim=(bottom - 0.5, top - 0.5), aspect="equal")
    if image is None:
        axes.set_axis_on()
        axes.grid(color=REACH_EDGE, lw=0.5)
        axes.set(xlabel="u  px", ylabel="v  px")
    column = 3 + 2 * (sorted(scenery.images).index(name) if name in scenery.images else 0)
    inks = [stroke[:, column : column + 2] for stroke in scenery.ink]
    _draw_paths(axes, runs, baseline, inks, lambda run: _in_picture(run, name))
    for number, (run, colour) in enumerate(_coloured(runs), 1):
        if name in run.goals:
            shown = str(number) if 1 < len(runs) <= MAX_NUMBERED else ""
            draw_goal(axes, *run.goals[name], run.tolerance, colour, shown, small)
    if small:
        name_camera(axes, name, round(bottom - top))


def _in_picture(run: ServoRun, camera: str) -> tuple[np.ndarray, np.ndarray]:
    path = run.paths.get(camera, np.zeros((0, 3)))[:, 1:]
    return path, run.samples.get(camera, np.zeros((0, 2)))


def _coloured(runs: Sequence[ServoRun]) -> list[tuple[ServoRun, str]]:
    return [(run, GOAL_COLOURS[k % len(GOAL_COLOURS)]) for k, run in enumerate(runs)]


def _draw_paths(
    axes: Axes,
    runs: Sequence[ServoRun],
    baseline: ServoRun | None,
    inks: Sequence[np.ndarray],
    seen: Callable[[ServoRun], tuple[np.ndarray, np.ndarray]],
) -> None:
    """Draw the paths of the tip.

    Args:
        axes: of two or three coordinates.
        runs: one after another.
        baseline: one of the goals by another method.
        inks: the lines drawn before, points (n, coordinates) of each.
        seen: of a run, points (n, coordinates) of its path and of its samples.
    """
    for ink in inks:
        axes.plot(*ink.T, color=QUIET, lw=1.6, zorder=2, solid_capstyle="round")
    if baseline:
        axes.plot(*seen(baseline)[0].T, color=INK, lw=1.4, ls=(0, (1, 1.6)), zorder=3)
    for run, colour in _coloured(runs):
        path, samples = seen(run)
        if len(path):
            draw_path(axes, path, samples, colour)


def draw_space(
    runs: Sequence[ServoRun], scenery: Scenery, baseline: ServoRun | None = None
) -> bytes | None:
    """Draw the true path in space, seen askew, from above and from the side; None in the plane."""
    if not any(run.truth and run.truth.space for run in runs):
        return None
    inks = [stroke[:, :3] for stroke in scenery.ink]
    with new_figure(1000) as figure:
        _draw_space(figure.add_axes((-0.02, 0.05, 0.6, 0.95), **OBLIQUE), runs, baseline, inks)
        for view, bottom, title in (("xy", 0.59, "From above"), ("xz", 0.125, "From the side")):
            sheet = Sheet(figure, (0.62, bottom, 0.365, 0.365), view)
            _draw_side(sheet, runs, baseline, inks, title)
        marks = {GOAL_MARK: RING_MARK, "base": BASE_MARK}
        _draw_legend(figure, runs, baseline, scenery, 0.035, marks)
        return png_of(figure)


OBLIQUE: dict[str, Any] = {
    "projection": "3d",
    "computed_zorder": False,
    "elev": 20,
    "azim": -62,
    "proj_type": "ortho",
}
"""Axes in space, with their view point."""
GOAL_MARK = "goal, tolerance"
RING_MARK: dict[str, Any] = {"marker": "o", "ms": 11, "mfc": "none", "mew": 2}
"""Mark of a goal that is a ring in space."""
BASE_MARK: dict[str, Any] = {
    "ls": "",
    "marker": "s",
    "ms": 8,
    "color": STEEL,
    "mec": "white",
    "zorder": 1,
}
"""Mark of the arm's base."""


def _draw_space(
    axes: Any,
    runs: Sequence[ServoRun],
    baseline: ServoRun | None,
    inks: Sequence[np.ndarray],
) -> None:
    """Draw the paths in space, on axes in OBLIQUE."""
    low, high = _extent(runs, baseline, inks)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(0, high[2]))
    axes.set_box_aspect(high - low)
    for axis, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), "xyz", strict=True):
        axis.set_pane_color(REACH if name == "z" else "white")
        axis.line.set_color(REACH_EDGE)
        axis._axinfo["grid"].update(color=REACH_EDGE, linewidth=0.5)
        axis.set_label_text(f"{name}  cm")
        axis.labelpad = -4
    axes.tick_params(pad=-3)
    axes.plot([0], [0], [0], **BASE_MARK)
    axes.locator_params(nbins=5, steps=TICKS)
    _draw_paths(axes, runs, baseline, inks, _in_cm)
    for number, (run, colour) in enumerate(_coloured(runs), 1):
        if not (run.truth and run.truth.space):
            continue
        end = np.array([run.truth.space.place])
        foot = np.concatenate([end, end * (1, 1, 0)])
        axes.plot(*foot.T, color=colour, lw=0.9, ls=(0, (2, 2)), zorder=1)
        axes.plot(*foot[1:].T, "x", color=colour, ms=4, zorder=1)
        axes.plot(*end.T, "o", ms=8.5, mfc=colour, mec="white", mew=1.2, zorder=7)
        axes.text(*(end[0] + (0, 0, 0.075 * high[2])), str(number), **badge(colour))


def _draw_side(
    sheet: Sheet,
    runs: Sequence[ServoRun],
    baseline: ServoRun | None,
    inks: Sequence[np.ndarray],
    title: str,
) -> None:
    """Draw the paths from one side, which shows two coordinates."""
    axes = sheet.axes
    sheet.show(sheet.seen(_extent(runs, baseline, inks)), room=0.0)
    axes.plot([0], [0], **BASE_MARK)
    head(axes, title)

    def seen(run: ServoRun) -> tuple[np.ndarray, np.ndarray]:
        path, samples = _in_cm(run)
        return sheet.seen(path), sheet.seen(samples)

    _draw_paths(axes, runs, baseline, [sheet.seen(ink) for ink in inks], seen)
    for number, (run, colour) in enumerate(_coloured(runs), 1):
        if run.truth and run.truth.space and run.within_mm:
            x, y = sheet.seen([run.truth.space.place])[0]
            for ink, wide in (("white", 3.6), (colour, 1.8)):
                axes.add_patch(
                    Circle((x, y), run.within_mm / 10, fill=False, ec=ink, lw=wide, zorder=7)
                )
            offset: dict[str, Any] = {"xytext": (13, 11), "textcoords": "offset points"}
            axes.annotate(str(number), (x, y), **offset, **badge(colour))


def _in_cm(run: ServoRun) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) of a run to a goal in space, cm: its path, and its samples."""
    if not (run.truth and run.truth.space):
        return np.zeros((0, 3)), np.zeros((0, 3))
    tips, t = run.truth.space.tips, run.truth.path[:, 0]
    return tips, np.column_stack([np.interp(run.measured[:, 0], t, axis) for axis in tips.T])


def _extent(
    runs: Sequence[ServoRun], baseline: ServoRun | None, inks: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (3,), cm, of a box on the table that holds all paths and the base."""
    paths = [_in_cm(run)[0] for run in [*runs, *([baseline] if baseline else [])]]
    points = np.concatenate([np.zeros((1, 3)), *paths, *inks])
    return np.floor(points.min(axis=0) - (2, 2, 0)), np.ceil(points.max(axis=0) + 2)


def _draw_legend(
    figure: Figure,
    runs: Sequence[ServoRun],
    baseline: ServoRun | None,
    scenery: Scenery,
    height: float,
    others: Mapping[str, dict[str, Any]] | None = None,
) -> None:
    """Draw the legend in one line; `others` are marks of one picture alone, by their names."""
    axes = figure.add_axes((0, 0, 1, 1), zorder=-1)
    axes.set_axis_off()
    several = 1 < len(runs) <= MAX_PANELS
    handles = [
        (axes.plot([], [], color=colour, lw=2.4)[0], f"to {run.name}" if several else "way")
        for run, colour in _coloured(runs if several else runs[:1])
    ]
    if baseline:
        line = axes.plot([], [], color=INK, lw=1.4, ls=(0, (1, 1.6)))[0]
        handles.append((line, f"to {baseline.name}, method {baseline.method}"))
    if scenery.ink:
        handles.append((axes.plot([], [], color=QUIET, lw=1.6)[0], "drawn before"))
    grey: dict[str, Any] = {"ls": "", "color": QUIET}
    marks: dict[str, dict[str, Any]] = {
        "start": {"marker": "o", "ms": 8, "mfc": "white", "mew": 2},
        "where it looked": {"marker": "o", "ms": 4.5},
        GOAL_MARK: {"marker": "+", "ms": 11, "mew": 2},
        **(others or {}),
    }
    handles += [(axes.plot([], [], **{**grey, **style})[0], name) for name, style in marks.items()]
    draw_legend(figure, handles, height)


LEFT_PANEL, RIGHT_PANEL = (0.065, 0.12, 0.42, 0.76), (0.56, 0.12, 0.42, 0.76)
"""Places of two panels, as shares of a figure."""


def draw_errors(runs: Sequence[ServoRun], baseline: ServoRun | None = None) -> bytes | None:
    """Draw the distance from the goal in time, as PNG; None if nothing is known of it.

    Beside it the same for the baseline and the run that it compares with; without a baseline, the
    error in each direction of the pictures.
    """
    all_runs = [*runs, *([baseline] if baseline else [])]
    values = [rows[:, 1] for run in all_runs for rows in (run.errors, run.measured)]
    known = np.concatenate(values) if values else np.zeros(0)
    known = known[np.isfinite(known)]
    if not len(known):
        return None
    most = max(10.0, float(known.max()))
    with new_figure(700) as figure:
        axes = figure.add_axes(LEFT_PANEL)
        method = ", ".join(sorted({run.method for run in runs if run.method}))
        _frame_errors(axes, runs, most, f"Distance{method and f', {method}'}", 0.012)
        for run, colour in _coloured(runs):
            _draw_error(axes, run, colour, run.name if 1 < len(runs) <= MAX_PANELS else "")
        axes.set_xlim(0, _end(runs))
        name_curves(axes)
        axes = figure.add_axes(RIGHT_PANEL)
        if baseline is None:
            _draw_components(axes, runs)
            return png_of(figure)
        same, colour = next(pair for pair in _coloured(runs) if pair[0].name == baseline.name)
        _frame_errors(axes, runs, most, f"{same.name.capitalize()}, both methods", 0.36)
        for run, one in ((baseline, BASELINE_COLOUR), (same, colour)):
            _draw_error(axes, run, one, f"{run.method} {run.seconds or 0:.0f} s")
        axes.set_xlim(0, _end([same, baseline]))
        name_curves(axes)
        return png_of(figure)


def _frame_errors(
    axes: Axes, runs: Sequence[ServoRun], most: float, title: str, free: float
) -> None:
    """Set axes up for errors up to `most` px; `free` is where no curve crosses the tolerance."""
    frame_errors(axes, most, runs[0].tolerance if runs else None, title, free)
    true = "true " if any(run.truth for run in runs) else ""
    axes.set_ylabel(f"{true}distance from the goal  px")


def _draw_error(axes: Axes, run: ServoRun, colour: str, label: str) -> None:
    if len(run.errors):
        draw_error(axes, run.errors[:, 0], run.errors[:, 1], run.measured, colour, label)


def _draw_components(axes: Axes, runs: Sequence[ServoRun]) -> None:
    frame_angles(axes, "Tip less goal")
    axes.set_ylabel("px")
    axes.axhline(0, color=REACH_EDGE, lw=1.2)
    if tolerance := runs[0].tolerance:
        axes.axhspan(-tolerance, tolerance, color=BAND, alpha=0.16, lw=0)
    for k, row in enumerate(sorted({row for run in runs for row in run.components})):
        for number, run in enumerate(run for run in runs if row in run.components):
            label = None if number else row
            axes.plot(*run.components[row].T, color=JOINTS[k % len(JOINTS)], lw=1.6, label=label)
    axes.set_xlim(0, _end(runs))
    name_curves(axes)


def draw_joints(runs: Sequence[ServoRun], baseline: ServoRun | None = None) -> bytes | None:
    """Draw the joints in time, and the condition of the image Jacobian; None without joints."""
    if not any(len(rows) for run in runs for rows in run.angles.values()):
        return None
    panels = [[run] for run in runs] if len(runs) <= MAX_PANELS else [list(runs)]
    wide = 0.925 / len(panels)
    with new_figure(1000) as figure:
        first: Axes | None = None
        for number, shown in enumerate(panels):
            box = (0.065 + number * wide, 0.59, wide - 0.025, 0.33)
            axes = figure.add_axes(box, sharey=first)
            first = first or axes
            for run in shown:
                for joint, name in enumerate(run.joints):
                    seen, decided = run.angles.get(name, ()), run.decided.get(name, ())
                    label = name if run is shown[0] else ""
                    draw_angle(axes, joint, label, list(seen), list(decided))
            title = shown[0].name.capitalize() if len(panels) > 1 else "Joint angles"
            frame_angles(axes, title)
            axes.set_ylabel("" if number else "joint angles  deg")
            axes.tick_params(labelleft=not number)
            axes.set_xlim(0, _end(shown))
            if number == len(panels) - 1:
                name_curves(axes)
        _draw_condition(figure.add_axes((0.065, 0.09, 0.915, 0.37)), runs, baseline)
        return png_of(figure)


def _draw_condition(axes: Axes, runs: Sequence[ServoRun], baseline: ServoRun | None) -> None:
    all_runs = _coloured(runs) + ([(baseline, BASELINE_COLOUR)] if baseline else [])
    greatest = 10.0
    for run, colour in all_runs:
        label = f"method {run.method}" if run is baseline else run.name if len(runs) > 1 else ""
        ends: Any = (0, (1, 1.6)) if run is baseline else "-"
        values = run.condition[:, 1]
        axes.plot(values, color=colour, lw=1.7, ls=ends, marker="o", ms=4, label=label)
        greatest = max(greatest, float(values.max(initial=0.0)))
    frame_condition(axes, greatest)
    axes.set_xlabel("step")
    axes.locator_params(axis="x", nbins=12, steps=TICKS, integer=True)
    if len(all_runs) <= MAX_PANELS + 1:
        name_curves(axes)


def _end(runs: Sequence[ServoRun]) -> float:
    """Return the end of the axis of time, s."""
    last = [run.errors[-1, 0] for run in runs if len(run.errors)]
    last += [rows[-1, 0] for run in runs for rows in run.angles.values() if len(rows)]
    return max([1.0, *(t for t in last if np.isfinite(t))]) * 1.02
