"""The sheet: the table or a plane in space, in cm of equal scales, with its drawings.

Here are the style and the texts of all figures, too.  Matplotlib's figures are used without pyplot
and with the style below, whatever the user's matplotlibrc says; equal input gives equal bytes.
"""

from __future__ import annotations

import io
import math
import os
import textwrap
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Circle, FancyBboxPatch, PathPatch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator

from laptop.record.figures.line_accuracy import place

WIDTH, HEIGHT, DPI = 1600, 1000, 150
"""Width and height of a figure, px, and its resolution, px per inch."""

# Okabe and Ito's colours, which colour-blind people tell apart, and greys.
INK, WANTED, PEAK, BAND = "#1a1a1a", "#0072B2", "#D55E00", "#E69F00"
BAND_TEXT = "#9A6A00"
JOINTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
ARM, ARM_EDGE, HOLE, STEEL = "#F5D76E", "#B8962E", "#FFF6D6", "#8a8f94"
REACH, REACH_EDGE, TRAVEL, QUIET = "#F0F3F6", "#D3DAE1", "#9AA3AB", "#5b6167"

STYLE: dict[Any, Any] = {
    "agg.path.chunksize": 10000,
    "axes.edgecolor": "#8a8f94",
    "axes.labelcolor": QUIET,
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.unicode_minus": True,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 8.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "text.parse_math": False,
    "xtick.color": "#8a8f94",
    "xtick.labelcolor": QUIET,
    "xtick.labelsize": 8,
    "ytick.color": "#8a8f94",
    "ytick.labelcolor": QUIET,
    "ytick.labelsize": 8,
}

TICKS = (1, 2, 5, 10)
"""Steps between ticks, times a power of 10."""

# Boxes are shares of the figure: left, bottom, width, height.
SHEET, COLUMN = (0.062, 0.135, 0.52, 0.74), (0.648, 0.095, 0.332, 0.74)
"""Box of a sheet, and beside it of a column of graphs."""
WIDE, SCALE_BOX, TALL_HEIGHT = (0.062, 0.125, 0.77, 0.74), (0.86, 0.125, 0.018, 0.6), 1200
"""Box of a sheet in a tall figure, of its colour scale, and that figure's height, px."""

FROM_BEHIND = "-yx"
"""View of a sheet from behind the arm: x up, y to the left."""
LABELS = {"x": "x, cm (forward)", "y": "y, cm (to the left)", "z": "z, cm (up)"}
MIN_TICK_DISTANCE = 55
"""Least distance from one number along the axes to the next, px."""

INK_LINE: dict[str, Any] = {"color": INK, "lw": 2.0, "zorder": 5, "solid_capstyle": "round"}
WANTED_LINE: dict[str, Any] = {"color": WANTED, "lw": 1.1, "zorder": 6}
DESIRED_LINE: dict[str, Any] = {"color": TRAVEL, "lw": 3.2, "alpha": 0.5, "zorder": 2}
"""Style of a wished path under a coloured ink."""
TRAVEL_LINE: dict[str, Any] = {"color": TRAVEL, "lw": 0.8, "ls": (0, (2, 2)), "zorder": 4}

BEAM_WIDTH = 0.8
"""Width of a LEGO beam, and distance between its holes, cm."""

HALF_BASE = 1.6
"""Half the side of the arm's base, cm."""


@contextmanager
def new_figure(height: int = HEIGHT) -> Iterator[Figure]:
    """Provide an empty figure, WIDTH x height px, in the style above, to be drawn in the block."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        figure = Figure(figsize=(WIDTH / DPI, height / DPI), dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)
        yield figure


@contextmanager
def written_figure(
    file: str | os.PathLike[str], title: str, *notes: str, height: int = HEIGHT
) -> Iterator[Figure]:
    """Provide a figure under its title and notes, to be drawn in the block; write it as PNG after.

    Raises:
        OSError: as the system says it; the file may then be there in part.
    """
    with new_figure(height) as figure:
        write_title(figure, title, *notes)
        yield figure
        png = png_of(figure)
    with open(file, "wb") as out:
        out.write(png)


def png_of(figure: Figure) -> bytes:
    """Return the figure as a PNG file; a letter that its font lacks is a box, without a warning."""
    picture = io.BytesIO()
    with warnings.catch_warnings():
        # Names come from runs and may hold anything; a reader can do nothing about a font.
        warnings.filterwarnings("ignore", r"Glyph \d+")
        figure.savefig(picture, format="png", dpi=DPI, metadata={"Software": None})
    return picture.getvalue()


class Sheet:
    """Axes with equal scales in cm, with lines and the arm on them.

    Points are in the arm's frame, (n, 2) or (n, 3), cm, unless noted otherwise.

    Attributes:
        axes: for parts of one figure alone; they have the points that `seen` gives.
        cm: points of type per cm, once `show` was called.
    """

    def __init__(
        self, figure: Figure, box: tuple[float, float, float, float], view: str = "xy"
    ) -> None:
        """Lay a sheet into a box (shares of the figure: left, bottom, width, height).

        Args:
            figure: that the sheet is a part of.
            box: its place.
            view: axes to the right and up: "xy" from above, "xz" or "yz" from the side,
                FROM_BEHIND.
        """
        mirrored, across, up = view.startswith("-"), view[-2], view[-1]
        self._figure, self._stands = figure, up == "z"
        self._columns, self._signs = ["xyz".index(across), "xyz".index(up)], (1 - 2 * mirrored, 1)
        self.cm = 1.0
        self.axes = figure.add_axes(box)
        self.axes.set(xlabel=LABELS[across], ylabel=LABELS[up])
        self.axes.spines[:].set(visible=True, color=REACH_EDGE)
        self.axes.set_axisbelow(True)
        self.axes.grid(color="black", alpha=0.06)
        if mirrored:
            self.axes.xaxis.set_major_formatter(
                FuncFormatter(lambda value, _: f"{0 - value:g}".replace("-", "\N{MINUS SIGN}"))
            )

    def seen(self, points: Any) -> np.ndarray:
        """Return points on the sheet, (n, 2), cm to the right and up."""
        points = np.asarray(points, float)
        return points[:, self._columns] * self._signs if len(points) else np.zeros((0, 2))

    def show(self, points: np.ndarray, room: Any = 1.0, least: float = 1.0) -> None:
        """Set limits that show points, fill the box and make the scales equal.

        Args:
            points: of the sheet, (n, 2).
            room: margin around them, cm; or ((left, bottom), (right, top)).
            least: least length of a side, cm.
        """
        before, after = np.broadcast_to(room, (2, 2))
        lower, upper = points.min(axis=0) - before, points.max(axis=0) + after
        box = np.array(self.axes.bbox.size)
        span = max(least / box.min(), *((upper - lower) / box)) * box
        left, bottom = (lower + upper - span) / 2
        self.axes.set(xlim=(left, left + span[0]), ylim=(bottom, bottom + span[1]))
        numbers = MaxNLocator(max(3, int(box.max() / MIN_TICK_DISTANCE)), steps=TICKS)
        step = np.diff(numbers.tick_values(0.0, span.max()))[0]
        self.axes.xaxis.set_major_locator(MultipleLocator(step))
        self.axes.yaxis.set_major_locator(MultipleLocator(step))
        self.cm = float(box[0] / self._figure.dpi * 72 / span[0])

    def lines(self, paths: Iterable[Any], label: str | None = None, **style: Any) -> None:
        """Draw paths alike, and a dot where one is only a point; the legend has one of them."""
        for path in paths:
            points = self.seen(path)
            self.axes.plot(*points.T, label=label, marker=dot(points), **style)
            label = None

    def coloured(
        self, paths: Iterable[Any], values: np.ndarray, most: float, **style: Any
    ) -> LineCollection:
        """Draw paths, each in the colour of its value between 0 and the most."""
        lines = LineCollection([self.seen(path) for path in paths], array=values, **style)
        lines.set_clim(0.0, most)
        self.axes.add_collection(lines)
        return lines

    def travel(self, rows: Sequence[Any]) -> None:
        """Draw the path of a record's tip with the pen up."""
        pen = np.array([bool(row.pen) for row in rows])
        if not pen.all():
            path = np.where(pen[:, None], np.nan, [place(row) for row in rows])
            self.lines([path], "pen up", **TRAVEL_LINE)

    def reach(self, outlines: Sequence[np.ndarray], label: str) -> None:
        """Shade the area within outlines of the sheet (n, 2); those of holes turn the other way."""
        rings = [np.concatenate([outline, outline[:1]]) for outline in outlines]
        path = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        self.axes.add_patch(PathPatch(path, fc=REACH, ec=REACH_EDGE, label=label, zorder=0))
        self.axes.add_patch(PathPatch(path, fill=False, ec=REACH_EDGE, zorder=1.5))  # over a paper

    def arm(self, skeleton: Any, label: str | None = None, pale: float = 0.0) -> None:
        """Draw beams with holes from joint to joint, over the base; limits must have been set.

        Args:
            skeleton: the base, every joint and the tip; may be empty, then there is the base alone.
            label: in the legend, or None.
            pale: share of white in all colours, 0 to 1.
        """

        def of(*colours: str) -> list[Any]:
            return [tuple(1 - (1 - np.array(to_rgb(one))) * (1 - pale)) for one in colours]

        fill, edge, hole, steel, ink, base = of(ARM, ARM_EDGE, HOLE, STEEL, INK, "#DDE1E5")
        height, round_by = (HALF_BASE / 2, 0.2) if self._stands else (2 * HALF_BASE, 0.5)
        self.axes.add_patch(
            FancyBboxPatch(
                (-HALF_BASE, -HALF_BASE / 2 if self._stands else -HALF_BASE), 2 * HALF_BASE, height,
                f"round,pad=0,rounding_size={round_by}", fc=base, ec=steel, lw=0.8, zorder=1.7,
            )
        )  # fmt: skip
        joints = self.seen(skeleton)
        for k, (a, b) in enumerate(zip(joints, joints[1:], strict=False)):
            draw_beam(self.axes, a, b, BEAM_WIDTH, self.cm, (fill, edge, hole), 2 + 0.1 * k)
        for k, joint in enumerate(joints):
            radius, colour = (0.2, ink) if k == len(joints) - 1 else (0.36, steel)
            self.axes.add_patch(Circle(joint, radius, fc=colour, ec="white", lw=0.9, zorder=3))
        if label and len(joints):
            self.axes.plot([], [], color=fill, lw=6, solid_capstyle="round", label=label)

    def legend(self) -> None:
        """Draw the legend in one line below the axes."""
        handles, labels = self.axes.get_legend_handles_labels()
        left, bottom, right, _ = self.axes.get_position().extents
        self._figure.legend(
            handles, labels, loc="center", ncols=len(handles), columnspacing=1.6, handlelength=1.6,
            bbox_to_anchor=((left + right) / 2, bottom - 83 / self._figure.bbox.height),
        )  # fmt: skip

    def colour_scale(self, lines: LineCollection, label: str, **options: Any) -> Colorbar:
        """Draw the colour scale; the options are the colour bar's."""
        bar = self._figure.colorbar(lines, cax=self._figure.add_axes(SCALE_BOX), **options)
        bar.set_label(label)
        return bar


def draw_beam(
    axes: Axes,
    start: np.ndarray,
    end: np.ndarray,
    pitch: float,
    points: float,
    colours: Sequence[Any],
    zorder: float,
) -> None:
    """Draw a beam from axle to axle.

    Args:
        axes: of any unit of length, with equal scales.
        start: the first axle, (2,), in that unit.
        end: the other one.
        pitch: from hole to hole, which is as wide as the beam, in that unit.
        points: of type per unit.
        colours: of the beam, its edge, its holes.
        zorder: its height.
    """
    fill, edge, hole = colours
    for colour, width in ((edge, pitch * points), (fill, pitch * points - 1.0)):
        axes.plot(
            *np.array([start, end]).T, color=colour, lw=width, solid_capstyle="round", zorder=zorder
        )
    holes = max(1, round(math.dist(start, end) / pitch))
    for centre in np.linspace(start, end, holes + 1):
        axes.add_patch(Circle(centre, 0.29 * pitch, fc=hole, ec=edge, lw=0.4, zorder=zorder))


def dot(points: np.ndarray) -> str | None:
    """Return the marker of a line that is only a point."""
    return "." if np.ptp(points, axis=0).max() < 0.02 else None


# Texts of any length


def write_title(figure: Figure, title: str, *notes: str) -> list[Text]:
    """Write the title, on two lines if one is too short, and the notes below; return those.

    A note has two lines, or one where the title has two.
    """
    height = figure.bbox.height
    artist = figure.text(SHEET[0], 1 - 25 / height, "", va="top", color=INK, weight="bold")
    artist.set_fontsize(13.5)
    if not _fit(artist, title, lines=1):
        artist.set_fontsize(10)
        _fit(artist, title, lines=2)
    two = "\n" in artist.get_text()
    down, artists = 82 if two else 65, []
    for note in notes:
        artist = figure.text(SHEET[0], 1 - down / height, "", va="top", size=8.5, color=QUIET)
        _fit(artist, note, lines=1 if two else 2)
        down += 21 * (1 + artist.get_text().count("\n"))
        artists.append(artist)
    return artists


def write_footnote(figure: Figure, text: str, right: bool = False) -> None:
    """Write small print at the lower edge, on the left or on the right."""
    x, align = (COLUMN[0] + COLUMN[2], "right") if right else (SHEET[0], "left")
    figure.text(x, 18 / figure.bbox.height, text, ha=align, size=8, color=QUIET)


def _fit(artist: Text, text: str, lines: int) -> bool:
    """Wrap `text` to the width of the picture; return whether all of it found room."""
    text = _printable(text)
    width = (COLUMN[0] + COLUMN[2] - SHEET[0]) * WIDTH
    for characters in range(200, 9, -2):
        artist.set_text(textwrap.fill(text, characters, max_lines=lines, placeholder=" …"))
        if artist.get_window_extent().width <= width:
            break
    return "".join(artist.get_text().split()) == "".join(text.split())


def _printable(text: str) -> str:
    """Return the text with a question mark for each letter that the typeface lacks."""
    known = get_font(findfont(FontProperties(family=STYLE["font.family"]))).get_charmap()
    return "".join(c if ord(c) in known or c.isspace() else "?" for c in text)
