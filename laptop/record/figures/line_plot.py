"""The picture of a run: the ink, the arm, and the deviation magnified beside it.

Only the layout is computed here; numbers come from `line_accuracy`.
"""

import math
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from laptop.record.figures.line_accuracy import Measure, Points, pen_down_runs, place
from laptop.record.figures.sheet import (
    BAND,
    BAND_TEXT,
    COLUMN,
    HALF_BASE,
    INK,
    INK_LINE,
    JOINTS,
    PEAK,
    QUIET,
    SHEET,
    TICKS,
    WANTED,
    WANTED_LINE,
    Sheet,
    dot,
    write_footnote,
    written_figure,
)

MAX_PANELS = 6
"""Greatest number of deviations that are shown below one another."""


class FinalPose(NamedTuple):
    """The pose in which the arm is drawn.

    skeleton  the base, every joint and the tip, cm; may be empty
    reach     least and greatest distance of the tip from the base, cm
    """

    skeleton: Points
    reach: tuple[float, float]


def write_line_plot(
    file: str | os.PathLike[str],
    rows: Sequence[Any],
    wanted: Sequence[Points],
    measures: Sequence[Measure | None],
    arm: FinalPose,
    title: str,
    notes: str = "",
    axes: str = "xy",
) -> None:
    """Write the picture of a run as PNG, 1600 x 1000 px.

    Args:
        file: where to.
        rows: the record, see `laptop.record.figures.line_accuracy`.
        wanted: the paths that were to be drawn, cm; may be empty.
        measures: one for each of them, from `line_accuracy.measure`; a `floor_mm` is shown.
        arm: in its final pose.
        title: one line, or two.
        notes: a line of small print under it.
        axes: "xy" for the view from above, "xz" or "yz" from the side.

    Raises:
        OSError: as the system says it; the file may then be there in part.
        ValueError: as many measures as wanted paths are needed.
    """
    if len(wanted) != len(measures):
        raise ValueError(f"{len(measures)} measures for {len(wanted)} wanted paths")
    with written_figure(file, title, notes) as figure:
        _draw_sheet(figure, rows, wanted, arm, axes)
        _draw_column(figure, rows, wanted, measures)


# The sheet, on the left


def _draw_sheet(
    figure: Figure,
    rows: Sequence[Any],
    wanted: Sequence[Points],
    arm: FinalPose,
    view: str,
) -> None:
    skeleton, reach = arm
    sheet = Sheet(figure, SHEET, view)
    axes = sheet.axes
    inks = [[place(row) for row in run] for run in pen_down_runs(rows)]
    tip = [] if inks else [place(row) for row in rows]
    badges = _badge_places([sheet.seen(path) for path in wanted])
    points = [sheet.seen(line) for line in (*wanted, *inks, skeleton, tip)]
    points += [
        np.reshape(badges, (-1, 2)),
        np.array([(-HALF_BASE, -HALF_BASE), (HALF_BASE, HALF_BASE)]),
    ]
    if len(np.concatenate(points)) == 2:  # nothing but the base
        points.append(np.array([(-reach[1], -reach[1]), reach[1:] * 2]))
    sheet.show(np.concatenate(points), ((1.0, 2.0), (1.0, 1.0)), 12.0)

    hole, shoulder = reach[0], (0.0, 0.0)
    if len(skeleton) and len(skeleton[0]) == 3:  # in space it stands on the base
        shoulder = (0.0, skeleton[1][2]) if view[1] == "z" else shoulder
        hole = hole if view[1] == "z" else 0.0
    sheet.lines(wanted, "wanted", **WANTED_LINE)
    sheet.lines(inks, "ink", **INK_LINE)
    sheet.travel(rows)
    sheet.arm(skeleton, "arm at the end")
    turn = np.linspace(0, math.tau, 241)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    sheet.reach(
        [shoulder + reach[1] * circle, shoulder + hole * circle[::-1]], "reach of the links"
    )
    for number, point in enumerate(badges, 1):
        _badge(axes, point, number, small=len(badges) > 9)
    _draw_scale(axes)
    if not inks:
        label = "no ink: the pen never touched the paper" if len(tip) else "no record"
        x, y = axes.get_xlim()[0] + 0.5, axes.get_ylim()[0] + 0.6
        axes.text(x, y, label, size=9.5, color=INK, weight="bold", zorder=9)
    sheet.legend()
    write_footnote(figure, "Ink and arm: the TRUE tip and links of the emulated arm.")


def _badge_places(paths: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return places for the paths' numbers, a little before each start, not on one another."""
    places: list[np.ndarray] = []
    for path in paths:
        ahead = path[np.hypot(*(path - path[0]).T) > 0.3]
        direction = ahead[0] - path[0] if len(ahead) else np.array([1.0, 0.0])
        backwards = math.atan2(-direction[1], -direction[0])
        tries = [
            path[0] + 0.85 * np.array([math.cos(backwards + turn), math.sin(backwards + turn)])
            for turn in (0.0, 1.0, -1.0, 2.0, -2.0)
        ]
        free = [a for a in tries if all(math.dist(a, b) > 0.9 for b in places)]
        places.append((free or tries)[0])
    return places


def _badge(axes: Axes, place: np.ndarray, number: int, small: bool) -> None:
    axes.text(
        float(place[0]),
        float(place[1]),
        str(number),
        size=6.5 if small else 8.5,
        color=WANTED,
        weight="bold",
        ha="center",
        va="center",
        zorder=8,
        bbox={"boxstyle": "circle,pad=0.25", "fc": "white", "ec": WANTED, "lw": 0.8},
    )


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of 5 cm in the free strip at the bottom."""
    right, bottom = axes.get_xlim()[1], axes.get_ylim()[0]
    x, y = right - 5.6, bottom + 0.5
    axes.plot([x, x + 5], [y, y], color=INK, lw=2.2, solid_capstyle="butt", zorder=7)
    for end in (x, x + 5):
        axes.plot([end, end], [y - 0.16, y + 0.16], color=INK, lw=1.0, zorder=7)
    axes.text(x + 2.5, y + 0.15, "5 cm", ha="center", va="bottom", size=8.5, color=INK, zorder=7)


# The column, on the right


def _draw_column(
    figure: Figure,
    rows: Sequence[Any],
    wanted: Sequence[Points],
    measures: Sequence[Measure | None],
) -> None:
    drawn = [(k, m) for k, m in enumerate(measures) if m is not None]
    if not len(wanted):
        _draw_times(figure, rows, "The run in time (no wanted path was told)")
        return
    if not drawn:
        heading = f"None of {len(wanted)} wanted paths was drawn"
        _draw_times(figure, rows, heading if len(wanted) > 1 else "The wanted path was not drawn")
        return
    shown = list(enumerate(measures))
    heading, footnote = "Deviation from the wanted path, mm", ""
    if len(measures) > MAX_PANELS:
        worst = sorted(drawn, key=lambda item: -item[1].greatest_mm)[:MAX_PANELS]
        shown = sorted(worst, key=lambda item: item[0])
        left_out, missing = len(measures) - len(shown), len(measures) - len(drawn)
        heading = f"The {len(shown)} greatest of {len(drawn)} deviations, mm"
        footnote = f"{left_out} more are left out"
        footnote += f", {missing} of them not drawn.  " if missing else ".  "
    extra = len(pen_down_runs(rows)) - len(drawn)
    if extra:
        footnote += f"{extra} stroke{'s' * (extra > 1)} beyond what was wanted."
    _draw_deviations(figure, shown, heading, footnote.strip(), rows)


def _draw_deviations(
    figure: Figure,
    shown: Sequence[tuple[int, Measure | None]],
    heading: str,
    footnote: str,
    rows: Sequence[Any],
) -> None:
    present = [m for _, m in shown if m is not None]
    ends = np.concatenate(
        [[(0.0, 0.0), (max(m.length_cm for m in present), 0.0)]] + [m.lateral for m in present]
    )
    across = [v for m in present for v in (m.floor_mm or 0.02, -(m.floor_mm or 0.02))]
    across += [ends[:, 1].min(), ends[:, 1].max()]
    alone = len(shown) == 1
    boxes = stack(2 if alone else len(shown), gap=0.13 if alone else 0.05)
    _heading(figure, heading)
    axes = None
    for (k, m), box in zip(shown, boxes, strict=False):
        axes = figure.add_axes(box)
        axes.set_xlim(*_widened(ends[:, 0], 0.03))
        axes.set_ylim(*_widened(across, 0.08))
        axes.locator_params(axis="x", nbins=6, steps=TICKS)
        axes.locator_params(axis="y", nbins=6 if len(shown) < 4 else 3, steps=TICKS)
        axes.tick_params(axis="x", labelbottom=False)
        _draw_deviation(axes, k + 1, m)
    assert axes is not None
    axes.tick_params(axis="x", labelbottom=True)
    side = "" if rows[0].z is not None else "   (+ is left of its direction)"
    axes.set_xlabel(f"cm along the path{side}")
    if alone:
        _draw_angles(figure.add_axes(boxes[1]), rows)
    write_footnote(figure, footnote, right=True)


def _draw_deviation(axes: Axes, number: int, m: Measure | None) -> None:
    axes.axhline(0, color=WANTED, lw=1.1)
    if m is None:
        label = "not drawn"
    else:
        along, deviation = m.lateral.T
        if m.floor_mm:
            axes.axhspan(-m.floor_mm, m.floor_mm, color=BAND, alpha=0.2, lw=0)
        axes.plot(along, deviation, color=INK, lw=1.3, marker=dot(m.lateral / 10))
        worst = int(np.argmax(np.abs(deviation)))
        axes.plot(along[worst], deviation[worst], "o", color=PEAK, ms=4, clip_on=False)
        label = f"greatest {_mm(m.greatest_mm)}   RMS {_mm(m.rms_mm)}   end {_mm(m.end_mm)}"
        label += f"   {m.seconds:.1f} s"
        if m.floor_mm:
            axes.set_title(f"floor {_mm(m.floor_mm)}", loc="right", color=BAND_TEXT, size=8, pad=4)
    style: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points"}
    axes.annotate(str(number), (0, 1), (0, 4), color=WANTED, weight="bold", size=8.5, **style)
    axes.annotate(label, (0, 1), (9 + 6 * len(str(number)), 4), color=INK, size=8, **style)


def _mm(value: float) -> str:
    value = round(value, 3)  # as the record has it, of which the terminal tells
    return f"{value:.2f}" if value < 9.995 else f"{value:.1f}"


def _widened(values: Any, share: float) -> tuple[float, float]:
    """Return limits that leave a margin around the values."""
    margin = share * max(float(np.ptp(values)), 0.1)
    return float(np.min(values)) - margin, float(np.max(values)) + margin


def _draw_times(figure: Figure, rows: Sequence[Any], heading: str) -> None:
    _heading(figure, heading)
    panels: list[Callable[[Axes, Sequence[Any]], None]] = [_draw_tip, _draw_angles]
    for draw, box in zip(panels, stack(2, gap=0.11), strict=True):
        draw(figure.add_axes(box), rows)
    figure.align_ylabels()


def _draw_tip(axes: Axes, rows: Sequence[Any]) -> None:
    places = zip(*(place(row) for row in rows), strict=True)
    curves = [(name, list(values)) for name, values in zip("xyz", places, strict=False)]
    draw_in_time(axes, rows, "tip  cm", curves)
    _shade_ink(axes, rows)


def _draw_angles(axes: Axes, rows: Sequence[Any]) -> None:
    angles = zip(*(row.q for row in rows), strict=True)
    curves = [(f"q{k}", [math.degrees(a) for a in angle]) for k, angle in enumerate(angles, 1)]
    draw_in_time(axes, rows, "joint angles  deg", curves)
    _shade_ink(axes, rows)


def draw_in_time(
    axes: Axes, rows: Sequence[Any], label: str, curves: Sequence[tuple[str, list[float]]]
) -> None:
    """Draw curves in time, a name and values of each, one per row."""
    axes.set(xlabel="s", ylabel=label)
    if not rows:
        axes.set(xticks=[], yticks=[])
        axes.text(0.5, 0.5, "no record", transform=axes.transAxes, ha="center", color=QUIET)
        return
    t = [row.t for row in rows]
    for k, (name, values) in enumerate(curves):
        axes.plot(t, values, color=JOINTS[k % len(JOINTS)], lw=1.4, label=name)
    axes.margins(x=0.01, y=0.12)
    axes.locator_params(nbins=6, steps=TICKS)
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(curves), borderaxespad=0)


def _shade_ink(axes: Axes, rows: Sequence[Any]) -> None:
    for run in pen_down_runs(rows):
        axes.axvspan(run[0].t, run[-1].t, color=INK, alpha=0.07, lw=0)


def _heading(figure: Figure, text: str) -> None:
    left, bottom, _, height = COLUMN
    figure.text(left, bottom + height + 0.043, text, size=9.5, color=INK, weight="bold")


def stack(n: int, gap: float) -> list[tuple[float, float, float, float]]:
    """Return boxes of n axes below one another, the first on top; `gap` is for texts above each."""
    left, bottom, width, height = COLUMN
    each = (height + gap) / n
    return [(left, bottom + (n - 1 - k) * each, width, each - gap) for k in range(n)]
