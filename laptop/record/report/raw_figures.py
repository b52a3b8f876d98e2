"""Figures that a report draws itself, from the columns of raw data.

They are slow, and only one thread at a time may draw: matplotlib's style is global.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from laptop.record.figures.charts import (
    GOAL_COLOURS,
    draw_angle,
    frame_angles,
    head,
    name_curves,
)
from laptop.record.figures.sheet import INK, REACH_EDGE, TRAVEL, new_figure, png_of

LEFT, RIGHT = (0.065, 0.13, 0.42, 0.74), (0.56, 0.13, 0.42, 0.74)
"""Places of two panels, as shares of a figure."""
MAX_POINTS = 4000
"""Number of points to which a curve is thinned, about."""


def draw_trace(columns: Mapping[str, np.ndarray]) -> bytes | None:
    """Draw the tip's path and the joints in time, as PNG; None if the columns lack them.

    Args:
        columns: of trace.csv: t (s), q1, ... (rad), x, y (cm), pen (0 or 1).
    """
    if not {"t", "x", "y", "pen"} <= columns.keys():
        return None
    t, x, y, pen = (_thin(columns[name]) for name in ("t", "x", "y", "pen"))
    joints = [name for name in columns if re.fullmatch(r"q\d+", name)]
    if not np.isfinite([t, x, y]).all():
        return None
    with new_figure(700) as figure:
        axes = figure.add_axes(LEFT)
        head(axes, "Way of the tip, from above")
        axes.plot(x, y, color=TRAVEL, lw=0.9, ls=(0, (1, 2)), label="pen up")
        down = np.where(pen > 0, 1.0, np.nan)
        axes.plot(x * down, y * down, color=INK, lw=2.0, label="pen down")
        axes.set(xlabel="x  cm", ylabel="y  cm", aspect="equal", adjustable="datalim")
        axes.grid(color=REACH_EDGE, lw=0.5)
        name_curves(axes)
        axes = figure.add_axes(RIGHT)
        frame_angles(axes, "Joint angles")
        axes.set_ylabel("degrees")
        for k, name in enumerate(joints):
            draw_angle(axes, k, name, list(zip(t, _thin(columns[name]), strict=True)), [])
        name_curves(axes)
        return png_of(figure)


def draw_tracks(tracks: Sequence[tuple[str, np.ndarray]]) -> bytes | None:
    """Draw where markers were seen in the picture, as PNG; None if none was.

    Args:
        tracks: name of each marker, and places (n, 2), px; NaN where it was not seen.
    """
    if not any(np.isfinite(places).all(axis=1).any() for _, places in tracks):
        return None
    with new_figure(820) as figure:
        axes = figure.add_axes((0.2, 0.1, 0.6, 0.8))
        for k, (name, places) in enumerate(tracks):
            colour = GOAL_COLOURS[k % len(GOAL_COLOURS)]
            axes.plot(*_thin(places).T, ".-", color=colour, lw=0.8, ms=3, label=name)
        axes.set(xlabel="u  px", ylabel="v  px", aspect="equal", adjustable="datalim")
        head(axes, "Where the markers were seen")
        axes.grid(color=REACH_EDGE, lw=0.5)
        axes.invert_yaxis()
        name_curves(axes)
        return png_of(figure)


def _thin(values: np.ndarray) -> np.ndarray:
    return values[:: max(1, math.ceil(len(values) / MAX_POINTS))]
