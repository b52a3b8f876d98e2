"""The picture of a run without an arm: the way of a robot on wheels, and how it went in time."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes

from laptop.record.figures.sheet import (
    COLUMN,
    HEIGHT,
    INK,
    QUIET,
    SHEET,
    TRAVEL,
    WANTED,
    WIDTH,
    new_figure,
    png_of,
)

LEAST_SPAN = 20.0
"""Least width and height of what is shown, cm."""


def write_robot_plot(
    file: str | os.PathLike[str],
    rows: Sequence[Any],
    title: str,
    line: Sequence[Sequence[float]] = (),
) -> None:
    """Write the picture of a robot's run as PNG, 1600 x 1000 px.

    Args:
        file: where to.
        rows: the record, see `line_accuracy`; the last of the angles is where the robot looks, rad,
            counter-clockwise from x.
        title: one line.
        line: points (x, y) of the line on the floor, cm; none if there is none.

    Raises:
        OSError: as the system says it; the file may then be there in part.
    """
    with new_figure() as figure:
        figure.text(SHEET[0], 0.975, title, va="top", size=11, color=INK, weight="bold")
        note = "The TRUE way of the emulated robot: the middle between its wheels."
        figure.text(SHEET[0], 0.018, note, size=8, color=QUIET)
        _draw_way(figure.add_axes(SHEET), rows, line)
        left, bottom, width, height = COLUMN
        upper = figure.add_axes((left, bottom + 0.55 * height, width, 0.45 * height))
        lower = figure.add_axes((left, bottom, width, 0.4 * height))
        places = [("x", [row.x for row in rows]), ("y", [row.y for row in rows])]
        _draw_in_time(upper, rows, "place  cm", places)
        headings = [("heading", [math.degrees(row.q[-1]) for row in rows])]
        _draw_in_time(lower, rows, "heading  deg", headings)
        picture = png_of(figure)
    Path(file).write_bytes(picture)


def _draw_way(axes: Axes, rows: Sequence[Any], line: Sequence[Sequence[float]]) -> None:
    xs, ys = [row.x for row in rows], [row.y for row in rows]
    if len(line):
        axes.plot(*zip(*line, strict=True), color=TRAVEL, lw=6, zorder=0, label="line on the floor")
    axes.plot(xs, ys, color=INK, lw=2.0, solid_capstyle="round", label="way")
    axes.plot(xs[0], ys[0], "o", color=WANTED, ms=7, label="start")
    wide = xs + [x for x, _ in line]
    high = ys + [y for _, y in line]
    span = max(LEAST_SPAN, max(wide) - min(wide), max(high) - min(high))
    middle = (max(wide) + min(wide)) / 2, (max(high) + min(high)) / 2
    half = 0.6 * span * (SHEET[2] * WIDTH) / (SHEET[3] * HEIGHT)  # so that scales are equal
    axes.set(
        xlim=(middle[0] - half, middle[0] + half),
        ylim=(middle[1] - 0.6 * span, middle[1] + 0.6 * span),
        xlabel="x  cm",
        ylabel="y  cm",
    )
    heading, length = rows[-1].q[-1], 0.06 * span
    axes.annotate(
        "",
        (xs[-1] + length * math.cos(heading), ys[-1] + length * math.sin(heading)),
        (xs[-1], ys[-1]),
        arrowprops={"arrowstyle": "-|>", "color": WANTED, "lw": 2},
        zorder=5,
    )
    axes.plot([], [], color=WANTED, lw=2, label="where it looks at the end")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)


def _draw_in_time(
    axes: Axes, rows: Sequence[Any], label: str, curves: Sequence[tuple[str, list[float]]]
) -> None:
    colours = (WANTED, INK)
    for (name, values), colour in zip(curves, colours, strict=False):
        axes.plot([row.t for row in rows], values, color=colour, lw=1.4, label=name)
    axes.set(xlabel="s", ylabel=label)
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(curves), borderaxespad=0)
