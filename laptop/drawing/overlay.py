"""Wish and truth of a drawing, one over the other: the ink of a run beside what was to be drawn.

Pure but for the picture's file.  Rows of a record are those of laptop.reporting.line_accuracy.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from laptop.drawing import preview, preview_png, reach
from laptop.drawing.artwork import BadArtwork
from laptop.drawing.preparing import DrawingPlan
from laptop.reporting.line_accuracy import pen_down_runs
from laptop.reporting.line_plot import new_figure, png_of

SPACING = 0.02
"""Points of the wish from which the nearest is sought, cm apart."""

KD_TREE = 4
"""FLANN's number for one tree that is searched exactly."""

WISH, INK = "#7FB3D9", "#CC4778"


class NoInk(BadArtwork):
    """A run that has drawn nothing."""


@dataclass(frozen=True)
class Truth:
    """What a run drew, in numbers.

    estimated_s  how long it was to take, s
    drawn_s      from the first to the last point of ink, s
    greatest_mm  greatest distance of the ink from the nearest line of the wish
    rms_mm       the same as root mean square over the ink's length
    missed_mm    greatest distance of the wish, where it can be reached, from the ink
    ink_cm       length of the ink
    pen_up_cm    length of the ways between its lines
    strokes      lines of ink
    """

    estimated_s: float
    drawn_s: float
    greatest_mm: float
    rms_mm: float
    missed_mm: float
    ink_cm: float
    pen_up_cm: float
    strokes: int

    def as_dict(self) -> dict[str, float | int]:
        """For JSON, to a micrometre."""
        return {name: round(value, 4) for name, value in asdict(self).items()}


def overlay(plan: DrawingPlan, rows: Sequence[Any], file: str | os.PathLike[str]) -> Truth:
    """Measure the ink of a run against its plan, and write the picture of both as PNG.

    Raises:
        NoInk: nothing was drawn.
        OSError: as the system says it.
    """
    inks = ink_lines(rows)
    truth, deviations = measure(plan, rows, inks)
    Path(file).write_bytes(_picture(plan, inks, truth, deviations))
    return truth


def ink_lines(rows: Sequence[Any]) -> list[np.ndarray]:
    """Lines of ink (n, 2), cm, each from pen down to pen up.

    Raises:
        NoInk: there is none.
    """
    inks = [np.array([(row.x, row.y) for row in run], float) for run in pen_down_runs(rows)]
    inks = [ink for ink in inks if len(ink) > 1]
    if not inks:
        raise NoInk("the run has drawn nothing: there is nothing to compare")
    return inks


def measure(
    plan: DrawingPlan, rows: Sequence[Any], inks: list[np.ndarray]
) -> tuple[Truth, list[np.ndarray]]:
    """(Truth, deviation in mm at each point of each line of ink)."""
    wish = [stroke.placed.points for stroke in plan.strokes]
    lines = list(plan.placement.strokes)
    off = 10 * distances(np.vstack(inks), lines)
    missed, _ = reach.densified(wish, 2 * SPACING)
    steps = [np.hypot(*np.diff(ink, axis=0).T) for ink in inks]
    weights = np.concatenate([np.append(step, 0) + np.append(0, step) for step in steps]) + 1e-9
    ends = list(zip(inks, inks[1:], strict=False))
    times = [row.t for row in rows if row.pen]
    truth = Truth(
        plan.estimate.seconds,
        float(times[-1] - times[0]),
        float(off.max()),
        float(np.sqrt(np.average(off**2, weights=weights))),
        10 * float(distances(missed, inks).max()),
        float(sum(step.sum() for step in steps)),
        float(sum(np.hypot(*(b[0] - a[-1])) for a, b in ends)),
        len(inks),
    )
    return truth, np.split(off, np.cumsum([len(ink) for ink in inks])[:-1])


def distances(points: np.ndarray, lines: Sequence[np.ndarray]) -> np.ndarray:
    """Distance of each point (n, 2) from the nearest of lines (m, 2), cm: (n,)."""
    dense, number = reach.densified(lines, SPACING)
    index = cv2.flann.Index(dense.astype(np.float32), {"algorithm": KD_TREE, "leaf_max_size": 16})
    found, _ = index.knnSearch(points.astype(np.float32), 1, params={"checks": -1})
    near = found[:, 0]
    least = np.hypot(*(points - dense[near]).T)
    for step in (-1, 1):  # to the parts of its line on both sides of the nearest point
        other = np.clip(near + step, 0, len(dense) - 1)
        other = np.where(number[other] == number[near], other, near)
        way = dense[other] - dense[near]
        square = np.maximum(np.einsum("ij,ij->i", way, way), 1e-18)
        share = np.clip(np.einsum("ij,ij->i", points - dense[near], way) / square, 0, 1)
        foot = dense[near] + share[:, None] * way
        least = np.minimum(least, np.hypot(*(points - foot).T))
    return np.asarray(least)


def _picture(
    plan: DrawingPlan, inks: list[np.ndarray], truth: Truth, deviations: list[np.ndarray]
) -> bytes:
    scene = preview.scene(plan)
    lines = (
        f"greatest deviation {truth.greatest_mm:.2f} mm, rms {truth.rms_mm:.2f} mm; "
        f"{truth.ink_cm:.0f} cm of ink in {truth.strokes} line{'s' * (truth.strokes != 1)}, "
        f"{truth.pen_up_cm:.0f} cm with the pen up",
        f"drawn in {preview.minutes(truth.drawn_s)}; estimated for all of it: "
        f"{preview.minutes(truth.estimated_s)}; the {plan.arm.name} arm at {plan.speed:g} cm/s",
    )
    with new_figure(preview_png.HEIGHT) as figure:
        preview_png.write_words(figure, scene.title, lines)
        axes = figure.add_axes(preview_png.SHEET)
        _draw_both(axes, plan, inks, deviations, truth.greatest_mm)
        colours = ScalarMappable(Normalize(0, truth.greatest_mm), "plasma_r")
        bar = figure.colorbar(colours, cax=figure.add_axes(preview_png.BAR))
        bar.set_label("deviation of the ink, mm")
        figure.legend(loc="upper left", bbox_to_anchor=preview_png.LEGEND, fontsize=9)
        return png_of(figure)


def _draw_both(
    axes: Axes,
    plan: DrawingPlan,
    inks: list[np.ndarray],
    deviations: list[np.ndarray],
    greatest: float,
) -> None:
    wish = [preview.seen_from_behind(stroke) for stroke in plan.placement.strokes]
    axes.add_collection(LineCollection(wish, colors=WISH, linewidths=3.5, label="wish"))
    seen = [preview.seen_from_behind(ink) for ink in inks]
    parts = np.concatenate([np.stack([ink[:-1], ink[1:]], axis=1) for ink in seen])
    drawn = LineCollection(list(parts), cmap="plasma_r", linewidths=1.0)
    drawn.set_norm(Normalize(0, greatest))
    drawn.set_array(np.concatenate([(off[:-1] + off[1:]) / 2 for off in deviations]))
    axes.add_collection(drawn)
    axes.plot([], [], color=INK, linewidth=1.0, label="ink")
    everything = np.vstack([*wish, *seen])
    low, high = everything.min(axis=0) - 0.5, everything.max(axis=0) + 0.5
    preview_png.set_table(axes, low, high)
