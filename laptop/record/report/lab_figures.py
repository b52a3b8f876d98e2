"""Figures that a report draws itself, from the columns of raw data.

Slow, and to be called by one thread at a time: matplotlib's style is everybody's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from laptop.record.figures.charts import (
    GOALS,
    draw_angle,
    draw_error,
    draw_goal,
    draw_way,
    frame_angles,
    frame_condition,
    frame_errors,
    head,
    name_curves,
)
from laptop.record.figures.sheet import INK, REACH_EDGE, TRAVEL, new_figure, png_of

LEFT, RIGHT = (0.065, 0.13, 0.42, 0.74), (0.56, 0.13, 0.42, 0.74)
"""Places of two panels, as shares of a figure."""
DOTS: dict[str, Any] = {"ls": "", "marker": "o", "ms": 5, "mfc": INK, "mec": "white", "mew": 0.9}
"""Style of where a servo stopped to look."""
MAX_POINTS = 4000
"""A curve is thinned to about so many points."""


def draw_trace(columns: Mapping[str, np.ndarray]) -> bytes | None:
    """Draw the tip's way and the joints in time, as PNG; None if nothing of it is there.

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


def draw_ways(
    ways: Mapping[str, np.ndarray],
    goals: Mapping[str, tuple[float, float]],
    looks: Mapping[str, np.ndarray],
    tolerance: float | None,
) -> bytes | None:
    """Draw the tip's way in each camera's picture, as PNG; None if nothing was seen.

    Args:
        ways: by camera, places (n, 2), px, that were seen.
        goals: by camera, px.
        looks: by camera, places (n, 2), px, where the servo looked.
        tolerance: px.
    """
    if not ways:
        return None
    with new_figure(760) as figure:
        for k, camera in enumerate(sorted(ways)):
            share = 1 / len(ways)
            axes = figure.add_axes((k * share + 0.08, 0.11, share - 0.1, 0.78))
            head(axes, f"Picture of camera {camera}")
            none = np.zeros((0, 2))
            draw_way(axes, ways[camera], none, GOALS[0])
            axes.plot(*looks.get(camera, none).T, zorder=6, **DOTS)
            if camera in goals:
                draw_goal(axes, *goals[camera], tolerance, GOALS[1], "", len(ways) > 1)
            axes.set(xlabel="u  px", ylabel="v  px", aspect="equal", adjustable="datalim")
            axes.grid(color=REACH_EDGE, lw=0.5)
            axes.invert_yaxis()  # v counts downwards
        return png_of(figure)


def draw_servo(
    errors: np.ndarray,
    looks: np.ndarray,
    joints: Mapping[str, np.ndarray],
    condition: np.ndarray,
    tolerance: float | None,
) -> bytes | None:
    """Draw error, joints and condition in time, as PNG; None if there is none of them.

    Args:
        errors: rows (s, px) of what was seen.
        looks: the same of what the servo measured.
        joints: by name, rows (s, rad).
        condition: rows (s, condition number of the image Jacobian).
        tolerance: px.
    """
    if not (len(errors) or any(len(rows) for rows in joints.values())):
        return None
    with new_figure(1150) as figure:
        top, high = 0.56, 0.36
        axes = figure.add_axes((LEFT[0], top, 0.915, high))
        every = np.concatenate([errors[:, 1:].ravel(), looks[:, 1:].ravel(), [10.0]])
        frame_errors(axes, float(every.max()), tolerance, "Distance from the goal", 0.012)
        axes.set_ylabel("distance  px")
        if len(errors):
            draw_error(axes, errors[:, 0], errors[:, 1], np.zeros((0, 2)), GOALS[0], "")
        axes.plot(*looks.T, zorder=6, **DOTS)
        axes = figure.add_axes((LEFT[0], 0.075, LEFT[2], high))
        frame_angles(axes, "Joint angles")
        axes.set_ylabel("degrees")
        for k, (name, rows) in enumerate(joints.items()):
            draw_angle(axes, k, name, [(float(t), float(q)) for t, q in rows], [])
        name_curves(axes)
        axes = figure.add_axes((RIGHT[0], 0.075, RIGHT[2], high))
        condition = condition[condition[:, 1] >= 1]  # no matrix has a smaller one
        if len(condition):
            axes.plot(
                *condition.T, color=GOALS[0], lw=1.4, marker="o", ms=4, drawstyle="steps-post"
            )
        frame_condition(axes, max(10.0, float(condition[:, 1:].max(initial=0.0))))
        axes.set_xlabel("s")
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
            axes.plot(*_thin(places).T, ".-", color=GOALS[k % len(GOALS)], lw=0.8, ms=3, label=name)
        axes.set(xlabel="u  px", ylabel="v  px", aspect="equal", adjustable="datalim")
        head(axes, "Where the markers were seen")
        axes.grid(color=REACH_EDGE, lw=0.5)
        axes.invert_yaxis()
        name_curves(axes)
        return png_of(figure)


def _thin(values: np.ndarray) -> np.ndarray:
    return values[:: max(1, math.ceil(len(values) / MAX_POINTS))]
