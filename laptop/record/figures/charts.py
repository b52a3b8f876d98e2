"""Charts of a run of the servo: a camera's picture with paths in it, curves in time.

These are parts that go on axes, in the style of `line_plot`; the reports make figures of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from laptop.record.figures.sheet import BAND, BAND_TEXT, INK, JOINTS, REACH_EDGE, TICKS

GOAL_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of goals and of the paths to them."""
MIN_ERROR_SHOWN = 0.3
"""Least error on the logarithmic axis, px: smaller ones are drawn there."""

NUMBER_FORMAT = FuncFormatter(lambda value, _: f"{value:g}")
"""Format of numbers along an axis."""


def head(axes: Axes, title: str) -> None:
    """Write a title over the left end of the axes."""
    axes.set_title(title, loc="left", size=9.5, color=INK, weight="bold", pad=8)


def name_curves(axes: Axes) -> None:
    """Draw a legend in the line of the title."""
    if not axes.get_legend_handles_labels()[0]:
        return
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=4,
        borderaxespad=0.3,
        columnspacing=1.2,
        handlelength=1.2,
    )


def draw_legend(figure: Figure, handles: Sequence[tuple[Any, str]], height: float) -> None:
    """Draw the legend in one line; `height` as a share of the figure's."""
    figure.legend(
        *zip(*handles, strict=True),
        loc="center",
        bbox_to_anchor=(0.5, height),
        ncols=len(handles),
        columnspacing=1.4,
        handlelength=1.7,
    )


def badge(colour: str, size: float = 8.0) -> dict[str, Any]:
    """Return the style of a goal's number."""
    return {
        "size": size,
        "color": "white",
        "weight": "bold",
        "ha": "center",
        "va": "center",
        "zorder": 9,
        "bbox": {"boxstyle": "circle,pad=0.25", "fc": colour, "ec": "white", "lw": 1.2},
    }


# In a camera's picture


def show_picture(axes: Axes, image: np.ndarray | None, width: int, height: int) -> None:
    """Show a picture (BGR, or None), enlarged; the axes are its pixels, width x height."""
    axes.set_axis_off()
    if image is not None:
        # Pixel centres are at integers, before and after the view enlarged the picture.
        frame = (-0.5, width - 0.5, height - 0.5, -0.5)
        axes.imshow(image[:, :, ::-1], extent=frame, interpolation="antialiased", aspect="auto")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))


def name_camera(axes: Axes, name: str, height: int) -> None:
    """Write the camera's name into the lower left corner of its picture."""
    shade = [effects.withStroke(linewidth=2.5, foreground=INK)]
    style: dict[str, Any] = {"size": 9.5, "color": "white", "weight": "bold", "zorder": 9}
    axes.text(9, height - 12, f"camera {name}", path_effects=shade, **style)


def draw_path(axes: Axes, path: np.ndarray, samples: np.ndarray, colour: str) -> None:
    """Draw a path of the tip, from a ring at its start.

    Args:
        axes: of two or three coordinates.
        path: points (n, coordinates).
        samples: points (n, coordinates) at which the servo stopped to look.
        colour: of both.
    """
    halo = [effects.withStroke(linewidth=4.5, foreground="white")]
    dots: dict[str, Any] = {"ls": "", "marker": "o", "color": colour}
    axes.plot(*path.T, color=colour, lw=2.4, zorder=4, path_effects=halo, solid_capstyle="round")
    axes.plot(*samples.T, ms=4.5, mec="white", mew=0.9, zorder=5, **dots)
    axes.plot(*path[:1].T, ms=9, mfc="white", mec=colour, mew=2.2, zorder=6, **dots)


def draw_goal(
    axes: Axes, x: float, y: float, tolerance: float | None, colour: str, number: str, small: bool
) -> None:
    """Draw a goal in a picture, with its circle of tolerance if that is known.

    Args:
        axes: of the picture.
        x: place of the goal, px.
        y: the same, downwards.
        tolerance: px, or None.
        colour: of the goal.
        number: written beside it, or "".
        small: whether the picture is one of several.
    """
    spread = 1.4 if small else 1.0
    for ink, wide in (("white", 4.2 / spread), (colour, 2.0 / spread)):
        if tolerance:
            axes.add_patch(Circle((x, y), tolerance, fill=False, ec=ink, lw=wide, zorder=7))
        for dx, dy in ((11, 0), (0, 11)):
            axes.plot([x - dx, x + dx], [y - dy, y + dy], color=ink, lw=wide - 0.6, zorder=7)
    if number:
        axes.text(x + 17 * spread, y + 15 * spread, number, **badge(colour, 11 / spread))


# Curves


def frame_errors(axes: Axes, most: float, tolerance: float | None, title: str, free: float) -> None:
    """Set axes up for errors in time.

    Args:
        axes: to be set up.
        most: the greatest error, px; 0 where there is none.
        tolerance: px, or None.
        title: over the axes.
        free: where along the axis no curve crosses the tolerance, 0 to 1.
    """
    axes.set_yscale("log")
    axes.set_ylim(MIN_ERROR_SHOWN, max(most, 2 * MIN_ERROR_SHOWN) * 1.6)
    axes.yaxis.set_major_formatter(NUMBER_FORMAT)
    axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
    axes.set_axisbelow(True)
    head(axes, title)
    axes.set_xlabel("s")
    axes.locator_params(axis="x", nbins=7, steps=TICKS)
    if tolerance is None:
        return
    axes.axhspan(MIN_ERROR_SHOWN, tolerance, color=BAND, alpha=0.16, lw=0)
    axes.text(
        free,
        tolerance * 0.93,
        f"tolerance {tolerance:g} px",
        transform=axes.get_yaxis_transform(),
        va="top",
        size=8,
        color=BAND_TEXT,
    )


def draw_error(
    axes: Axes, t: np.ndarray, error: np.ndarray, samples: np.ndarray, colour: str, label: str
) -> None:
    """Draw a curve of errors in time, to a dot at its end.

    Args:
        axes: from `frame_errors`.
        t: times (n,), s.
        error: (n,), px.
        samples: rows (s, px) of the servo's own measurements.
        colour: of the curve.
        label: of it in the legend.
    """
    error = np.maximum(error, MIN_ERROR_SHOWN)
    axes.plot(t, error, color=colour, lw=1.7, label=label)
    axes.plot(t[-1], error[-1], "o", color=colour, ms=5.5, mec="white", mew=0.9, clip_on=False)
    if len(samples):
        x, y = samples.T
        axes.plot(x, np.maximum(y, MIN_ERROR_SHOWN), ".", color=colour, ms=4, alpha=0.55)


def frame_condition(axes: Axes, greatest: float) -> None:
    """Set axes up for condition numbers up to the greatest."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(NUMBER_FORMAT)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
    axes.set_axisbelow(True)
    axes.set_ylim(1, min(greatest, 1e4) * 1.3)
    head(axes, "Condition number of the image Jacobian (1 is best)")
    axes.set_ylabel("condition")


def frame_angles(axes: Axes, title: str) -> None:
    """Set axes up for joint angles in time."""
    head(axes, title)
    axes.set_xlabel("s")
    axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
    axes.locator_params(nbins=6, steps=TICKS)


def draw_angle(
    axes: Axes,
    joint: int,
    name: str,
    seen: Sequence[tuple[float, float]],
    measured: Sequence[tuple[float, float]],
) -> None:
    """Draw one joint's angle in time.

    Args:
        axes: from `frame_angles`.
        joint: its number, from 0.
        name: in the legend.
        seen: (s, rad) of the curve.
        measured: (s, rad) where the servo decided on a step.
    """
    colour = JOINTS[joint % len(JOINTS)]
    if seen:
        t, q = np.array(seen).T
        axes.plot(t, np.degrees(q), color=colour, lw=1.6, label=name)
    times, degrees = [t for t, _ in measured], [math.degrees(q) for _, q in measured]
    axes.plot(times, degrees, "o", color=colour, ms=4, mec="white", mew=0.7)
