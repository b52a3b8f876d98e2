"""The style of all figures, and what several of them draw.

Matplotlib's figures are used without pyplot and with the style below, whatever the user's
matplotlibrc says; equal input gives equal bytes.
"""

from __future__ import annotations

import io
import math
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Circle, FancyBboxPatch
from matplotlib.text import Text

WIDTH, HEIGHT, DPI = 1600, 1000, 150
"""px, px, px per inch."""

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
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "text.parse_math": False,
    "xtick.color": "#8a8f94",
    "xtick.labelcolor": QUIET,
    "xtick.labelsize": 8,
    "ytick.color": "#8a8f94",
    "ytick.labelcolor": QUIET,
    "ytick.labelsize": 8,
}

TICKS = (1, 2, 5, 10)

# Where things are, as shares of the figure: left, bottom, width, height.
SHEET = (0.062, 0.135, 0.52, 0.74)
COLUMN = (0.648, 0.095, 0.332, 0.74)

BEAM = 0.8
"""Width of a LEGO beam and distance of its holes, cm."""

BASE = 1.6
"""Half the side of what the arm stands on, cm."""


@contextmanager
def new_figure(height: int = HEIGHT) -> Iterator[Figure]:
    """An empty figure, WIDTH x height px, in the style above; it has to be drawn in the block."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        figure = Figure(figsize=(WIDTH / DPI, height / DPI), dpi=DPI, facecolor="white")
        FigureCanvasAgg(figure)
        yield figure


def png_of(figure: Figure) -> bytes:
    """The figure as a PNG file; a letter that its font lacks is a box, without a word."""
    picture = io.BytesIO()
    with warnings.catch_warnings():
        # Names come from runs and may hold anything; a reader can do nothing about a font.
        warnings.filterwarnings("ignore", r"Glyph \d+")
        figure.savefig(picture, format="png", dpi=DPI, metadata={"Software": None})
    return picture.getvalue()


def draw_arm(axes: Axes, arm: np.ndarray, cm: float, standing: bool) -> None:
    """Beams with their holes from joint to joint, over the base, which from the side is flat."""
    axes.add_patch(
        FancyBboxPatch(
            (-BASE, -BASE / 2 if standing else -BASE),
            2 * BASE,
            BASE / 2 if standing else 2 * BASE,
            f"round,pad=0,rounding_size={0.2 if standing else 0.5}",
            fc="#DDE1E5",
            ec=STEEL,
            lw=0.8,
            zorder=1,
        )
    )
    for k, (a, b) in enumerate(zip(arm, arm[1:], strict=False)):
        z = 2 + 0.1 * k
        for colour, width in ((ARM_EDGE, BEAM * cm + 1.4), (ARM, BEAM * cm)):
            axes.plot(*np.array([a, b]).T, color=colour, lw=width, solid_capstyle="round", zorder=z)
        holes = max(1, round(math.dist(a, b) / BEAM))
        for j in range(1, holes):
            place = a + (b - a) * j / holes
            axes.add_patch(Circle(place, 0.22, fc=HOLE, ec=ARM_EDGE, lw=0.5, zorder=z))
    for k, place in enumerate(arm):
        tip = k == len(arm) - 1
        radius = 0.2 if tip else 0.36
        axes.add_patch(
            Circle(place, radius, fc=INK if tip else STEEL, ec="white", lw=0.9, zorder=3)
        )


# Text that nobody knows beforehand


def write_title(figure: Figure, title: str, notes: str) -> None:
    """The title on one line, smaller on two where it must be; the notes on what that leaves."""
    title, notes = _printable(title), _printable(notes)
    artist = figure.text(SHEET[0], 0.975, "", va="top", size=13.5, color=INK, weight="bold")
    if not _fit(artist, title, lines=1):
        artist.set_fontsize(10)
        _fit(artist, title, lines=2)
    two = "\n" in artist.get_text()
    artist = figure.text(SHEET[0], 0.918 if two else 0.935, "", va="top", size=8.5, color=QUIET)
    _fit(artist, notes, lines=1 if two else 2)


def _fit(artist: Text, text: str, lines: int) -> bool:
    """Wrap `text` to the width of the picture; whether all of it found room."""
    width = (COLUMN[0] + COLUMN[2] - SHEET[0]) * WIDTH
    for characters in range(200, 9, -2):
        artist.set_text(textwrap.fill(text, characters, max_lines=lines, placeholder=" …"))
        if artist.get_window_extent().width <= width:
            break
    return "".join(artist.get_text().split()) == "".join(text.split())


def _printable(text: str) -> str:
    """The text with a question mark for what the typeface does not have."""
    known = get_font(findfont(FontProperties(family=STYLE["font.family"]))).get_charmap()
    return "".join(c if ord(c) in known or c.isspace() else "?" for c in text)
