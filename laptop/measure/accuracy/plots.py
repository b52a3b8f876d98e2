"""The page of plots: poses with their circles of repeatability, paths with their tubes."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from laptop.measure.accuracy import criteria
from laptop.measure.accuracy.accuracy_test import AccuracyResult, Attained
from laptop.measure.accuracy.plan import SPEED_SHARES, AccuracyPlan
from laptop.record.figures.charts import head
from laptop.record.figures.sheet import (
    BAND,
    FROM_BEHIND,
    INK,
    JOINTS,
    PEAK,
    REACH_EDGE,
    TICKS,
    WANTED,
    Sheet,
    write_footnote,
    written_figure,
)

PAGE_HEIGHT = 1750
"""Height of the page, px."""
LEFT, RIGHT, TOP = 0.062, 0.98, 0.915
AXIS_MARGIN = 1.15
"""Width of the axes over that of what they show."""
MIN_HALF_WIDTH_MM = 0.2
"""Least half width of a pose's panel, mm."""


def write_accuracy_plot(
    file: str | os.PathLike[str], result: AccuracyResult, title: str, notes: str
) -> None:
    """Write the page as PNG.

    Raises:
        OSError: as the system says it.
    """
    with written_figure(file, title, notes, height=PAGE_HEIGHT) as figure:
        _draw_poses(figure, result)
        _draw_paths(figure, result)


def _draw_poses(figure: Figure, result: AccuracyResult) -> None:
    plan = result.plan
    wide, high, gap = (RIGHT - LEFT) / 3, 0.234, 0.074
    places = [
        (LEFT + column * wide, TOP - high - row * (high + gap), wide - 0.05, high)
        for row in (0, 1)
        for column in range(3)
    ]
    _draw_map(Sheet(figure, places[0], FROM_BEHIND), plan)
    shown = {number: _flat(plan, result.observed[f"P{number}"]) for number in range(1, 6)}
    from_sides = {
        number: [
            _flat(plan, result.observed[name]).mean(axis=0)
            for name in result.observed
            if name.startswith(f"P{number} from")
        ]
        for number in shown
    }
    mm = {one.name: one.mm for one in result.criteria}
    widest = max(
        max(
            float(np.abs(points).max()),
            float(np.abs(points.mean(axis=0)).max()) + mm[f"RP P{number}"],
            *(float(np.abs(mean).max()) for mean in from_sides[number]),
        )
        for number, points in shown.items()
    )
    half = max(MIN_HALF_WIDTH_MM, AXIS_MARGIN * widest)
    for number, points in shown.items():
        axes = figure.add_axes(places[number])
        head(axes, f"P{number}   AP {mm[f'AP P{number}']:.2f} mm,  RP {mm[f'RP P{number}']:.2f} mm")
        _draw_pose(axes, points, from_sides[number], mm[f"RP P{number}"])
        axes.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
        axes.locator_params(nbins=5, steps=TICKS)
        axes.set_xlabel("mm from where it was sent")
    figure.legend(
        *zip(*_pose_legend(figure), strict=True),
        loc="center",
        bbox_to_anchor=(0.52, 0.313),
        ncols=5,
        columnspacing=1.4,
        handlelength=1.7,
    )


def _pose_legend(figure: Figure) -> list[tuple[object, str]]:
    axes = figure.add_axes((0, 0, 0.001, 0.001))
    axes.set_axis_off()
    handles = [
        (axes.plot([], [], "+", color=INK, ms=9, mew=1.4)[0], "commanded"),
        (axes.plot([], [], ".", color=WANTED, alpha=0.6)[0], "attained, a cycle each"),
        (axes.plot([], [], "o", color=PEAK, ms=5)[0], "their barycentre"),
        (axes.plot([], [], "-", color=PEAK, lw=1.2)[0], "RP around it"),
        (axes.plot([], [], "D", color=JOINTS[2], ms=4.5, mfc="white")[0], "from one direction"),
    ]
    return list(handles)


def _draw_pose(axes: Axes, points: np.ndarray, from_sides: Sequence[np.ndarray], rp: float) -> None:
    """One pose: points (cycles, 2), mm from the commanded position."""
    mean = points.mean(axis=0)
    axes.axhline(0, color=REACH_EDGE, lw=0.6, zorder=0)
    axes.axvline(0, color=REACH_EDGE, lw=0.6, zorder=0)
    axes.add_patch(Circle((mean[0], mean[1]), rp, fc=BAND, ec="none", alpha=0.14, zorder=1))
    axes.add_patch(Circle((mean[0], mean[1]), rp, fill=False, ec=PEAK, lw=1.2, zorder=2))
    axes.plot([0, mean[0]], [0, mean[1]], color=PEAK, lw=0.9, ls=(0, (3, 2)), zorder=3)
    axes.plot(*points.T, ".", color=WANTED, ms=5, alpha=0.6, mew=0, zorder=4)
    for side in from_sides:
        axes.plot(*side, "D", color=JOINTS[2], ms=4.5, mfc="white", zorder=5)
    axes.plot(*mean, "o", color=PEAK, ms=5, mec="white", mew=0.8, zorder=6)
    axes.plot(0, 0, "+", color=INK, ms=9, mew=1.4, zorder=6)


def _draw_map(sheet: Sheet, plan: AccuracyPlan) -> None:
    """Draw the poses' plane with poses and paths."""
    axes, is_level = sheet.axes, len(plan.centre) == 2
    head(axes, f"The test {'square' if is_level else 'plane'}")
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * plan.sides / 2
    sheet.lines([corners], color=REACH_EDGE, lw=1.2)
    for path, colour in zip(plan.paths.values(), JOINTS, strict=False):
        sheet.lines([(path.points() - plan.centre) @ plan.axes.T], color=colour, lw=1.5)
    poses = sheet.seen((plan.poses - plan.centre) @ plan.axes.T)
    for number, pose in enumerate(poses.tolist(), 1):
        axes.plot(*pose, "o", color=INK, ms=4, zorder=3)
        axes.annotate(f"P{number}", pose, (5, 5), textcoords="offset points", color=INK)
    sheet.show(sheet.seen(corners), 0.06 * plan.sides.max())
    axes.set_xlabel("y from its middle, cm (to the left)")
    axes.set_ylabel("x, cm (forward)" if is_level else "forward and up, cm", labelpad=1)


def _flat(plan: AccuracyPlan, attained: Attained) -> np.ndarray:
    """Return values of a pose from the commanded one, in the poses' plane as the map shows it, mm.

    The camera's noise is taken off, as from the figures.
    """
    values = criteria.without_noise(attained.values, attained.noise)[0] - attained.commanded[0]
    forward, left = (criteria.MM * values @ plan.axes.T).T
    return np.column_stack([-left, forward])


def _draw_paths(figure: Figure, result: AccuracyResult) -> None:
    plan = result.plan
    wide, high = (RIGHT - LEFT) / len(SPEED_SHARES), 0.08
    mm = {one.name: one.mm for one in result.criteria}
    names = {kind: [f"{kind} {100 * share:.0f} %" for share in SPEED_SHARES] for kind in plan.paths}
    for row, kind in enumerate(plan.paths):
        tubes = {name: _tube(result.observed[name]) for name in names[kind]}
        most = max(float((np.abs(mean) + band).max()) for _, mean, band, _ in tubes.values())
        for column, (name, (s, mean, band, runs)) in enumerate(tubes.items()):
            bottom = 0.195 - row * 0.122
            axes = figure.add_axes((LEFT + column * wide, bottom, wide - 0.03, high))
            head(axes, f"{name}   AT {mm[f'AT {name}']:.2f} mm,  RT {mm[f'RT {name}']:.2f} mm")
            axes.axhline(0, color=INK, lw=0.8, zorder=1)
            axes.fill_between(s, mean - band, mean + band, color=BAND, alpha=0.22, lw=0, zorder=0)
            axes.plot(s, runs, color=WANTED, lw=0.5, alpha=0.45, zorder=2)
            axes.plot(s, mean, color=PEAK, lw=1.6, zorder=3)
            axes.set(
                xlim=(0, plan.paths[kind].length), ylim=(-AXIS_MARGIN * most, AXIS_MARGIN * most)
            )
            axes.locator_params(nbins=6, steps=TICKS)
            axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
            axes.set_axisbelow(True)
            if column == 0:
                axes.set_ylabel("mm to the left" if kind == "line" else "mm outwards", labelpad=2)
            if row:
                axes.set_xlabel("cm along the path")
    footnote = (
        "of each path: each cycle (blue), their barycentre (red), and around it its repeatability"
    )
    write_footnote(figure, footnote)


def _tube(attained: Attained) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return (cm along, mean mm, repeatability mm, of each cycle mm) of a path's first axis."""
    values = criteria.without_noise(attained.values, attained.noise)
    first = criteria.MM * values[..., 0]
    return attained.at, first.mean(axis=1), criteria.pose_repeatability(values), first
