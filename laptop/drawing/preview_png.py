"""A preview as PNG, by matplotlib.  Pure."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.ticker import FuncFormatter, MultipleLocator

from laptop.drawing.durations import in_minutes
from laptop.drawing.preview_scene import PreviewScene
from laptop.record.figures.sheet import ARM, ARM_EDGE, REACH, REACH_EDGE, new_figure, png_of

HEIGHT = 1200
"""Of the picture, px."""

SHEET, BAR, LEGEND = (0.06, 0.06, 0.66, 0.8), (0.77, 0.06, 0.018, 0.5), (0.76, 0.86)
"""Where table, time's scale and legend are, as shares of the picture: left, bottom, width, height;
of the legend its upper left corner."""

TICKS = 6
"""Of the time's scale."""

WIDEST_LINE = 130
"""More letters than these take a second line."""


def png_bytes(scene: PreviewScene) -> bytes:
    """The picture of a scene, a PNG file."""
    with new_figure(HEIGHT) as figure:
        write_words(figure, scene.title, scene.lines)
        axes = figure.add_axes(SHEET)
        _draw_table(axes, scene)
        _draw_lines(axes, scene)
        if scene.strokes:
            bar = figure.colorbar(_coloured(scene), cax=figure.add_axes(BAR))
            bar.set_ticks(np.linspace(0, scene.seconds, TICKS).tolist())
            bar.formatter = FuncFormatter(lambda seconds, _: in_minutes(seconds))
            bar.update_ticks()
        figure.legend(loc="upper left", bbox_to_anchor=LEGEND, fontsize=9)
        return png_of(figure)


def write_words(figure: Figure, title: str, lines: Sequence[str]) -> None:
    """Write what stands over a picture."""
    figure.text(0.03, 0.965, title, fontsize=14, fontweight="bold", va="center")
    y = 0.935
    for line in lines:
        colour = "#c00000" if "cannot be reached" in line else "#333333"
        for part in textwrap.wrap(line, WIDEST_LINE):
            figure.text(0.03, y, part, fontsize=9, color=colour, va="center")
            y -= 0.021


def set_table(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """Show the table between two corners of the picture, cm, with the arm's coordinates."""
    axes.set_aspect("equal", anchor="NW")
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("y, cm (to the left)")
    axes.set_ylabel("x, cm (forward)")
    tick = 5 if max(high - low) > 15 else 1
    axes.xaxis.set_major_locator(MultipleLocator(tick))
    axes.yaxis.set_major_locator(MultipleLocator(tick))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{0 - round(value)}"))
    axes.grid(True, color="#000000", alpha=0.06)


def _coloured(scene: PreviewScene):  # type: ignore[no-untyped-def]
    from matplotlib.cm import ScalarMappable

    return ScalarMappable(Normalize(0, scene.seconds), ListedColormap(list(scene.scale)))


def _draw_table(axes: Axes, scene: PreviewScene) -> None:
    set_table(axes, scene.low, scene.high)
    if scene.reach:
        codes, points = [], []
        for outline in scene.reach:
            codes += [Path.MOVETO, *[Path.LINETO] * (len(outline) - 1), Path.CLOSEPOLY]
            points.append(np.vstack([outline, outline[:1]]))
        axes.add_patch(
            PathPatch(
                Path(np.vstack(points), codes),
                facecolor=REACH,
                edgecolor=REACH_EDGE,
                label="within reach",
                zorder=0,
            )
        )
        axes.add_patch(  # seen on the paper, too
            PathPatch(Path(np.vstack(points), codes), fill=False, edgecolor=REACH_EDGE, zorder=1.5)
        )
    if scene.paper is not None:
        axes.add_patch(
            Polygon(scene.paper, facecolor="#fffefa", edgecolor="#777777", label="paper", zorder=1)
        )
    axes.plot(*scene.joints.T, color=ARM, linewidth=9, alpha=0.4, solid_capstyle="round", zorder=2)
    axes.plot(
        *scene.joints[0], "o", color=ARM, markeredgecolor=ARM_EDGE, markersize=13, zorder=3,
        label="the arm, at home",
    )  # fmt: skip


def _draw_lines(axes: Axes, scene: PreviewScene) -> None:
    axes.add_collection(
        LineCollection(
            list(scene.ways), colors="#7d8790", linewidths=0.5, linestyles=(0, (4, 4)),
            label="pen up", zorder=4,
        )
    )  # fmt: skip
    axes.add_collection(
        LineCollection(list(scene.strokes), colors=scene.colours, linewidths=0.9, zorder=5)
    )
    if scene.missed:
        axes.add_collection(
            LineCollection(
                list(scene.missed), colors="#e00000", linewidths=1.8, label="out of reach", zorder=6
            )
        )
    if scene.start is not None:
        axes.plot(
            *scene.start, "o", markerfacecolor="none", markeredgecolor="#009E73",
            markeredgewidth=1.8, markersize=9, linestyle="none", label="start", zorder=7,
        )  # fmt: skip
