"""Drawings of one path, one after another, as an arm learns it: over one another, in mm."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from laptop.record.figures.drawing_plot import compare
from laptop.record.figures.sheet import (
    COLUMN,
    FROM_BEHIND,
    SHEET,
    Sheet,
    written_figure,
)

DESIRED_COLOUR = "#20262c"
"""Colour of the wished path."""

COLOURS = ("#c9463d", "#e8a33d", "#7a9fc4", "#1f6f54")
"""Colours from the first drawing to the last."""

MARGIN_SHARE = 0.08
"""Margin around a drawing, as a share of its size."""


def write_learning_plot(
    file: str | os.PathLike[str],
    drawings: Sequence[tuple[str, Sequence[Any]]],
    chains: Sequence[Sequence[np.ndarray]],
    title: str,
) -> None:
    """Write the picture as PNG: the wished path, the true inks over it, and their deviations.

    Args:
        file: where to.
        drawings: name and rows of the record of each; at least one has ink.
        chains: wished, see `drawing_plot`.
        title: above it.

    Raises:
        OSError: as the system says it.
    """
    every = [(name, compare(rows, chains)) for name, rows in drawings]
    notes = "off at most: " + ", ".join(f"{one.greatest_mm:.1f} mm {name}" for name, one in every)
    picks = np.linspace(0, len(COLOURS) - 1, len(every)).round().astype(int)
    with written_figure(file, title, notes) as figure:
        sheet, graph = Sheet(figure, SHEET, FROM_BEHIND), figure.add_axes(COLUMN)
        for pick, (name, one) in zip(picks, every, strict=True):
            # Where the pen was up between two points there is no ink.
            steps = np.linalg.norm(np.diff(one.points, axis=0), axis=1)
            points = np.insert(one.points, np.flatnonzero(steps > 0.3) + 1, np.nan, axis=0)
            sheet.lines([points], name, color=COLOURS[pick], lw=1.4)
            path = np.concatenate([[0.0], np.cumsum(np.where(steps > 0.3, 0.0, steps))])
            graph.plot(path, one.off_mm, color=COLOURS[pick], lw=1.4)
        sheet.lines(map(np.concatenate, chains), "wished", color=DESIRED_COLOUR, lw=0.8, ls="--")
        inks = sheet.seen(np.concatenate([one.points for _, one in every]))
        sheet.show(inks, MARGIN_SHARE * max(float(np.ptp(inks, axis=0).max()), 1.0))
        sheet.legend()
        graph.set_xlabel("length of the ink, cm")
        graph.set_ylabel("distance of the true ink from what was wished, mm")
        graph.set_ylim(bottom=0)
