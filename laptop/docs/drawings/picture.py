"""The look of the drawings: size, letters, labels and arrows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from laptop.record.figures.sheet import new_figure

WIDTH, HEIGHT, DPI = 900, 560, 110
"""Size of a drawing, px, and its resolution, px per inch."""

SIZES: dict[Any, Any] = {
    "font.size": 17,
    "axes.labelsize": 18,
    "xtick.labelsize": 17,
    "ytick.labelsize": 17,
    "axes.linewidth": 1.2,
    "lines.linewidth": 3.5,
}
"""Sizes of letters and lines, points."""

LABEL_SIZE = 21
"""Size of labels, points."""


@contextmanager
def picture(file: Path, height: int = HEIGHT) -> Iterator[Figure]:
    """Provide an empty drawing of this height, px, and write it after the block."""
    with new_figure() as figure:
        matplotlib.rcParams.update(SIZES)
        figure.set_dpi(DPI)
        figure.set_size_inches(WIDTH / DPI, height / DPI)
        yield figure
        figure.savefig(file, format="png", dpi=DPI, metadata={"Software": None})


def label(axes: Axes, place: ArrayLike, text: str, colour: str, **style: Any) -> None:
    """Write a text at a place of the axes, in its middle if no style says otherwise."""
    x, y = np.asarray(place)
    known = {"ha": "center", "va": "center_baseline", "size": LABEL_SIZE, "zorder": 8}
    axes.text(x, y, text, color=colour, **{**known, **style})


def arrow(axes: Axes, start: ArrayLike, end: ArrayLike, colour: str) -> None:
    """Draw an arrow between two places of the axes."""
    style = {"arrowstyle": "-|>,head_width=0.4,head_length=0.8", "lw": 4, "color": colour}
    axes.annotate(
        "",
        tuple(np.asarray(end)),
        tuple(np.asarray(start)),
        arrowprops={**style, "shrinkA": 0, "shrinkB": 0},
        zorder=6,
    )
