"""Charts of a run of the servo: a camera's picture with ways in it, curves in time.

The parts that go on axes, in the style of `line_plot`; which figures they make up, and of what, is
the reports' own.
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

GOALS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Colours of goals and of the ways to them."""
LEAST = 0.3
"""Errors below are drawn there: the axis is logarithmic, px."""

NUMBER = FuncFormatter(lambda value, _: f"{value:g}")


def head(axes: Axes, title: str) -> None:
    """A title over the left end of the axes."""
    axes.set_title(title, loc="left", size=9.5, color=INK, weight="bold", pad=8)


def name_curves(axes: Axes) -> None:
    """A legend in the line of the title."""
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
    """A picture (BGR, or None), enlarged; the axes are its pixels, width x height."""
    axes.set_axis_off()
    if image is not None:
        # Pixel centres are at integers, before and after the view enlarged the picture.
        frame = (-0.5, width - 0.5, height - 0.5, -0.5)
        axes.imshow(image[:, :, ::-1], extent=frame, interpolation="antialiased", aspect="auto")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))


def name_camera(axes: Axes, name: str, height: int) -> None:
    """Write the camera's name into the lower left corner of its picture."""
    shade = [effects.withStroke(linewidth=2.5, foreground=INK)]
    words: dict[str, Any] = {"size": 9.5, "color": "white", "weight": "bold", "zorder": 9}
    axes.text(9, height - 12, f"camera {name}", path_effects=shade, **words)


def draw_way(axes: Axes, way: np.ndarray, looks: np.ndarray, colour: str) -> None:
    """A way of the tip, from a ring at its start.

    Args:
        axes: of two or three coordinates.
        way, looks: points (n, coordinates) of the way, and of where the servo looked.
    """
    halo = [effects.withStroke(linewidth=4.5, foreground="white")]
    dots: dict[str, Any] = {"ls": "", "marker": "o", "color": colour}
    axes.plot(*way.T, color=colour, lw=2.4, zorder=4, path_effects=halo, solid_capstyle="round")
    axes.plot(*looks.T, ms=4.5, mec="white", mew=0.9, zorder=5, **dots)
    axes.plot(*way[:1].T, ms=9, mfc="white", mec=colour, mew=2.2, zorder=6, **dots)


def draw_goal(
    axes: Axes, x: float, y: float, tolerance: float | None, colour: str, number: str, small: bool
) -> None:
    """A goal in a picture, px, its circle of tolerance if that is known, and its number or "".

    Args:
        small: the picture is one of several.
    """
    apart = 1.4 if small else 1.0
    for ink, wide in (("white", 4.2 / apart), (colour, 2.0 / apart)):
        if tolerance:
            axes.add_patch(Circle((x, y), tolerance, fill=False, ec=ink, lw=wide, zorder=7))
        for dx, dy in ((11, 0), (0, 11)):
            axes.plot([x - dx, x + dx], [y - dy, y + dy], color=ink, lw=wide - 0.6, zorder=7)
    if number:
        axes.text(x + 17 * apart, y + 15 * apart, number, **badge(colour, 11 / apart))


# Curves


def frame_errors(axes: Axes, most: float, tolerance: float | None, title: str, free: float) -> None:
    """Axes for errors in time.

    Args:
        most: the greatest, px; 0 where there is none.
        tolerance: px, or None.
        free: where along the axis no curve crosses the tolerance, 0 to 1.
    """
    axes.set_yscale("log")
    axes.set_ylim(LEAST, max(most, 2 * LEAST) * 1.6)
    axes.yaxis.set_major_formatter(NUMBER)
    axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
    axes.set_axisbelow(True)
    head(axes, title)
    axes.set_xlabel("s")
    axes.locator_params(axis="x", nbins=7, steps=TICKS)
    if tolerance is None:
        return
    axes.axhspan(LEAST, tolerance, color=BAND, alpha=0.16, lw=0)
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
    axes: Axes, t: np.ndarray, error: np.ndarray, looks: np.ndarray, colour: str, label: str
) -> None:
    """A curve of errors (px) in time (s), to a dot at its end.

    Args:
        looks: rows (s, px) of what the servo measured, where it did.
    """
    error = np.maximum(error, LEAST)
    axes.plot(t, error, color=colour, lw=1.7, label=label)
    axes.plot(t[-1], error[-1], "o", color=colour, ms=5.5, mec="white", mew=0.9, clip_on=False)
    if len(looks):
        x, y = looks.T
        axes.plot(x, np.maximum(y, LEAST), ".", color=colour, ms=4, alpha=0.55)


def frame_condition(axes: Axes, greatest: float) -> None:
    """Axes for condition numbers up to the greatest."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(NUMBER)
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="y", color=REACH_EDGE, lw=0.5)
    axes.set_axisbelow(True)
    axes.set_ylim(1, min(greatest, 1e4) * 1.3)
    head(axes, "Condition number of the image Jacobian (1 is best)")
    axes.set_ylabel("condition")


def frame_angles(axes: Axes, title: str) -> None:
    """Axes for joint angles in time."""
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
    """One joint's angle in time.

    Args:
        joint: its number, from 0.
        seen: (s, rad); measured: the same where the servo decided on a step.
    """
    colour = JOINTS[joint % len(JOINTS)]
    if seen:
        t, q = np.array(seen).T
        axes.plot(t, np.degrees(q), color=colour, lw=1.6, label=name)
    times, degrees = [t for t, _ in measured], [math.degrees(q) for _, q in measured]
    axes.plot(times, degrees, "o", color=colour, ms=4, mec="white", mew=0.7)
