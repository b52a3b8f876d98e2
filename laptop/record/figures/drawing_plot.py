"""A whole drawing after a run: the true ink against the strokes that were wished, in mm.

Rows of a record are those of `line_accuracy`.  A *chain* is the strokes from pen down to pen up,
 (n, 2) or (n, 3), cm, each of which begins where the one before ends.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.record.figures.line_accuracy import (
    INK_SPACING,
    distances,
    pen_down_runs,
    place,
    refined,
)
from laptop.record.figures.sheet import (
    DESIRED_LINE,
    FROM_BEHIND,
    TALL_HEIGHT,
    WIDE,
    Sheet,
    written_figure,
)

DESIRED_STEP_RATIO = 5
"""Spacing of points on a wished path, times the ink's."""

STANDING_SPEED = 0.2
"""Speed of the tip below which it stands, cm/s."""

MAX_COLOUR_MM = 3.0
"""Deviation from which on the colour stays the same, mm: more than half a LEGO stud."""

MARGIN_SHARE = 0.06
"""Margin around a drawing, as a share of its size."""


@dataclass(frozen=True, eq=False)
class DrawingAccuracy:
    """A drawing's ink against its strokes.

    Attributes:
        greatest_mm: greatest distance of the ink from its wished path.
        rms_mm: the same as root mean square over the ink's length.
        missed_mm: greatest distance of a wished path from the ink.
        ink_cm: length of the ink.
        pen_up_cm: length of the tip's path with the pen up, from the first stroke to the last.
        chains: number of wished chains.
        inks: number of drawn ones.
        standing_s: longest time for which the tip stood with the pen down, s.
        points: of the ink, (n, 2), cm.
        off_mm: distance of each, mm.
    """

    greatest_mm: float
    rms_mm: float
    missed_mm: float
    ink_cm: float
    pen_up_cm: float
    chains: int
    inks: int
    standing_s: float
    points: np.ndarray
    off_mm: np.ndarray

    def as_dict(self) -> dict[str, float | int | None]:
        """Return all numbers, for JSON; None where there is no ink."""
        return {
            name: _for_json(value)
            for name, value in vars(self).items()
            if name not in ("points", "off_mm")
        }


def compare(rows: Sequence[Any], chains: Sequence[Sequence[np.ndarray]]) -> DrawingAccuracy:
    """Compare the ink in a record with the chains that were wished, in their order.

    Where as many were drawn, each ink belongs to its chain; else to whichever lies nearest.
    """
    runs = pen_down_runs(rows)
    inks = [refined(np.array([place(row) for row in run], float)) for run in runs]
    paths = [np.concatenate(chain) for chain in chains]
    if len(inks) == len(paths):
        own = [[k] for k in range(len(inks))]
    else:
        own = [list(range(len(paths)))] * len(inks)
    off = [10 * _nearest(ink, [paths[n] for n in ns]) for ink, ns in zip(inks, own, strict=True)]
    own_inks = own if len(inks) == len(paths) else [list(range(len(inks)))] * len(paths)
    missed = [
        10 * _nearest(refined(path)[::DESIRED_STEP_RATIO], [inks[n] for n in ns]).max()
        for path, ns in zip(paths, own_inks, strict=True)
        if ns
    ]
    steps = [np.linalg.norm(np.diff(ink, axis=0), axis=1).sum() for ink in inks]
    every = np.concatenate(off) if off else np.zeros(0)
    return DrawingAccuracy(
        float(every.max()) if len(every) else float("nan"),
        float(np.sqrt((every**2).mean())) if len(every) else float("nan"),
        float(max(missed)) if missed else float("nan"),
        float(sum(steps)),
        _pen_up(rows),
        len(chains),
        len(inks),
        max((standing(run) for run in runs), default=0.0),
        np.concatenate(inks)[:, :2] if inks else np.zeros((0, 2)),
        every,
    )


def _for_json(value: float | int) -> float | int | None:
    """Return a number for JSON, which has no NaN: None in its place."""
    if isinstance(value, int):
        return value
    return round(float(value), 3) if np.isfinite(value) else None


def _nearest(points: np.ndarray, paths: Sequence[np.ndarray]) -> np.ndarray:
    """Return the distance of each point from the nearest of the paths, cm."""
    return np.min([distances(points, path) for path in paths], axis=0)


def _pen_up(rows: Sequence[Any]) -> float:
    """Return the length of the tip's path with the pen up, from first ink to last, cm."""
    pen = np.array([bool(row.pen) for row in rows])
    if not pen.any():
        return 0.0
    first, last = np.flatnonzero(pen)[[0, -1]]
    tip = np.array([place(row) for row in rows[first : last + 1]], float)
    steps = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    return float(steps[~pen[first:last]].sum())


def standing(run: Sequence[Any]) -> float:
    """Return the longest time for which the tip stands in one ink, s."""
    t = np.array([row.t for row in run])
    tip = np.array([place(row) for row in run], float)
    if len(t) < 2:
        return 0.0
    slow = np.linalg.norm(np.diff(tip, axis=0), axis=1) < STANDING_SPEED * np.diff(t)
    longest, since = 0.0, t[0]
    for k, stands in enumerate(slow):
        since = since if stands else t[k + 1]
        longest = max(longest, t[k + 1] - since)
    return float(longest)


def write_drawing_plot(
    file: str | os.PathLike[str],
    rows: Sequence[Any],
    chains: Sequence[Sequence[np.ndarray]],
    accuracy: DrawingAccuracy,
    title: str,
    notes: str,
) -> None:
    """Write the picture as PNG: the wished paths, and over them the ink, coloured by its distance.

    The view is from behind the arm: x upwards, y to the left.

    Raises:
        OSError: as the system says it.
    """
    desired = [np.concatenate(chain) for chain in chains]
    with written_figure(file, title, notes, height=TALL_HEIGHT) as figure:
        sheet = Sheet(figure, WIDE, FROM_BEHIND)
        sheet.lines(desired, "wished", **DESIRED_LINE)
        sheet.travel(rows)
        segments = np.stack([accuracy.points[:-1], accuracy.points[1:]], axis=1)
        # A longer segment leads from one ink to the next.
        near = np.linalg.norm(np.diff(accuracy.points, axis=0), axis=1) < 3 * INK_SPACING
        ink = sheet.coloured(
            segments[near], accuracy.off_mm[1:][near], MAX_COLOUR_MM, cmap="turbo", lw=1.4, zorder=5
        )
        points = sheet.seen(np.concatenate(desired))
        sheet.show(points, MARGIN_SHARE * max(float(np.ptp(points, axis=0).max()), 1.0))
        sheet.legend()
        caption = "distance of the true ink from what was wished, mm"
        sheet.colour_scale(ink, caption, extend="max")
