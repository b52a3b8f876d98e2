"""The picture of a drawing's preview, by matplotlib.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import FuncFormatter

from laptop.drawing import reach
from laptop.drawing.preparing import DrawingPlan
from laptop.drawing.timing import in_minutes
from laptop.record.figures.formulas import svg
from laptop.record.figures.sheet import (
    FROM_BEHIND,
    JOINTS,
    TALL_HEIGHT,
    TRAVEL_LINE,
    WIDE,
    Sheet,
    new_figure,
    png_of,
    write_title,
)
from robot.motion import kinematics

MARGIN = 1.0
"""Margin around all that is shown, cm."""

MISSED_COLOR = "#e00000"
"""Colour of what cannot be reached, and of the text about it."""

TIME_COLORS = ListedColormap(colormaps["plasma"](np.linspace(0, 0.78, 256)))
"""Colours of the strokes from the first to the last, without the map's lightest."""

TICKS = 6
"""Number of ticks of the time scale."""

OUTLINE_PRECISION, OUTLINE_REFINEMENT = 0.02, 4
"""Precision of the reach's outline, cm; and factor by which it is drawn finer than the map, so that
it looks smooth."""


def preview_bytes(plan: DrawingPlan, subtitle: Sequence[str], ending: str) -> bytes:
    """Return a plan's picture as a file, ".svg" or ".png", with lines of text above it."""
    with new_figure(TALL_HEIGHT) as figure:
        draw_preview(figure, plan, subtitle)
        return png_of(figure) if ending == ".png" else svg(figure, transparent=False).encode()


def draw_preview(figure: Figure, plan: DrawingPlan, subtitle: Sequence[str]) -> None:
    """Draw the picture of a plan into an empty figure TALL_HEIGHT px high."""
    for note in write_title(figure, plan.name, *subtitle):
        if "cannot be reached" in note.get_text():
            note.set_color(MISSED_COLOR)
    sheet = Sheet(figure, WIDE, FROM_BEHIND)
    strokes = [stroke.placed.points for stroke in plan.strokes]
    missed = [miss.points for miss in plan.missed]
    outlines = [sheet.seen(outline) for outline in reach_outlines(plan)]
    home = kinematics.joint_positions(plan.arm, [joint.home for joint in plan.arm.joints])
    paper = () if plan.placement.paper is None else plan.placement.paper
    shown = [*outlines, *(sheet.seen(points) for points in (*strokes, *missed, home, paper))]
    sheet.show(np.concatenate(shown), MARGIN)

    sheet.reach(outlines, "within reach")
    if len(paper):
        sheet.axes.add_patch(
            Polygon(sheet.seen(paper), fc="#fffefa", ec="#777777", label="paper", zorder=1)
        )
    sheet.arm(home, "the arm, at home", pale=0.6)
    travels = [np.vstack([a[-1], b[0]]) for a, b in pairwise(strokes) if np.any(a[-1] != b[0])]
    sheet.lines(_at_once(travels), "pen up", **TRAVEL_LINE)
    sheet.lines(_at_once(missed), "out of reach", color=MISSED_COLOR, lw=1.8, zorder=6)
    if strokes:
        drawn = sheet.coloured(
            *(strokes, np.array(plan.estimate.starts), plan.estimate.seconds),
            cmap=TIME_COLORS, lw=0.9, zorder=5,
        )  # fmt: skip
        bar = sheet.colour_scale(drawn, "when it is drawn", format=FuncFormatter(_in_minutes))
        bar.set_ticks(np.linspace(0, plan.estimate.seconds, TICKS).tolist())
        start = sheet.seen(strokes[0][:1])
        sheet.axes.plot(
            *start.T, "o", mfc="none", mec=JOINTS[2], mew=1.8, ms=9, label="start", zorder=7
        )
    sheet.legend()


def _in_minutes(seconds: float, _: int | None) -> str:
    return in_minutes(seconds)


def _at_once(paths: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return paths (n, 2) as one with gaps, for thousands of lines draw slowly; none if none."""
    gap = np.full((1, 2), np.nan)
    return [np.concatenate([part for path in paths for part in (path, gap)])] if paths else []


def reach_outlines(plan: DrawingPlan) -> list[np.ndarray]:
    """Return the outlines (n, 2), cm, of the reach in the allowed postures; holes run backwards."""
    table = reach.reach_map(plan.arm, plan.options.height, plan.options.postures(plan.arm))
    soft = cv2.GaussianBlur((table.cells > 0).astype(np.float32), (0, 0), 1.5)
    finer = (
        np.arange(OUTLINE_REFINEMENT * (len(soft) - 1) + 1, dtype=np.float32) / OUTLINE_REFINEMENT
    )
    x, y = np.meshgrid(finer, finer)
    inner = cv2.remap(soft, x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
    found, _ = cv2.findContours(
        (inner > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE
    )
    cell = reach.CELL_SIZE / OUTLINE_REFINEMENT
    smooth = (cv2.approxPolyDP(one, OUTLINE_PRECISION / cell, True)[:, 0] for one in found)
    return [table.origin + outline * cell for outline in smooth if len(outline) > 2]
