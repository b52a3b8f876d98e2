"""The picture of a run without an arm: the path of a robot on wheels, and its motion in time."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from laptop.record.figures.line_accuracy import place
from laptop.record.figures.line_plot import draw_in_time, stack
from laptop.record.figures.sheet import (
    INK_LINE,
    SHEET,
    TRAVEL,
    WANTED,
    Sheet,
    write_footnote,
    written_figure,
)

MIN_SPAN, MARGIN_SHARE = 24.0, 0.1
"""Least width and height of the view, cm; margin around the path, as a share of its size."""


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
    with written_figure(file, title) as figure:
        write_footnote(figure, "The TRUE way of the emulated robot: the middle between its wheels.")
        _draw_path(Sheet(figure, SHEET), rows, line)
        upper, lower = (figure.add_axes(box) for box in stack(2, gap=0.11))
        draw_in_time(
            *(upper, rows, "place  cm"),
            [("x", [row.x for row in rows]), ("y", [row.y for row in rows])],
        )
        headings = [math.degrees(row.q[-1]) for row in rows]
        draw_in_time(lower, rows, "heading  deg", [("heading", headings)])
        figure.align_ylabels([upper, lower])


def _draw_path(sheet: Sheet, rows: Sequence[Any], line: Sequence[Sequence[float]]) -> None:
    axes, path = sheet.axes, [place(row) for row in rows]
    sheet.lines([line] if len(line) else [], "line on the floor", color=TRAVEL, lw=6, zorder=1)
    sheet.lines([path], "way", **INK_LINE)
    axes.plot(*path[0], "o", color=WANTED, ms=7, zorder=6, label="start")
    points = sheet.seen([*path, *line])
    size = max(MIN_SPAN, float(np.ptp(points, axis=0).max()))
    sheet.show(points, MARGIN_SHARE * size, MIN_SPAN)
    axes.set(xlabel="x, cm", ylabel="y, cm")  # no arm is there for which x were forward
    heading, length = rows[-1].q[-1], 0.06 * size
    tip = np.add(path[-1], (length * math.cos(heading), length * math.sin(heading)))
    arrow = {"arrowstyle": "-|>", "color": WANTED, "lw": 2}
    axes.annotate("", tuple(tip), tuple(points[len(path) - 1]), arrowprops=arrow, zorder=6)
    axes.plot([], [], color=WANTED, lw=2, label="where it looks at the end")
    sheet.legend()
