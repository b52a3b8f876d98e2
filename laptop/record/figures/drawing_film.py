"""A film of a drawing: the emulated arm and its true ink, as they were, in quicker time."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from laptop.record.figures.line_accuracy import pen_down_runs, place
from laptop.record.figures.sheet import (
    DESIRED_LINE,
    DPI,
    FROM_BEHIND,
    INK_LINE,
    Sheet,
    new_figure,
)

Skeleton = Callable[[Sequence[float]], Sequence[Sequence[float]]]

FILM_WIDTH, FILM_HEIGHT = 640, 480
"""Size of the film, px."""
FILM_BOX = (0.01, 0.01, 0.98, 0.98)
"""Box of the sheet, shares of the figure."""
FRAMES, FRAME_MS, LAST_MS = 120, 80, 2000
"""Number of pictures, and how long each stands, and the last one, ms."""
COLOURS = 48
"""Colours of the film."""
ROOM = 1.2
"""Margin around what is seen, cm."""


def write_drawing_film(
    file: str | os.PathLike[str],
    rows: Sequence[Any],
    chains: Sequence[Sequence[np.ndarray]],
    skeleton: Skeleton,
    frames: int = FRAMES,
) -> None:
    """Write a film as GIF, seen from behind the arm: the wished paths, the ink and the arm.

    Args:
        file: where to.
        rows: the record, see `line_accuracy`; not empty.
        chains: of strokes that were wished, as `drawing_plot` takes them.
        skeleton: angles of the joints, rad -> places of the base, the joints and the tip, cm.
        frames: number of pictures, evenly spaced in time.

    Raises:
        OSError: as the system says it; the file may then be there in part.
    """
    times = np.array([row.t for row in rows])
    shown = np.linspace(times[0], times[-1], frames)
    ends = np.searchsorted(times, shown, side="right")
    inks = [(np.array([row.t for row in run]), [place(row) for row in run])
            for run in pen_down_runs(rows)]  # fmt: skip
    points = np.concatenate([*(path for chain in chains for path in chain)])
    arms = [skeleton(rows[end - 1].q) for end in ends]
    seen = [*points, *(joint for arm in arms for joint in arm)]
    pictures = []
    for k, now in enumerate(shown):
        with new_figure() as figure:
            figure.set_size_inches(FILM_WIDTH / DPI, FILM_HEIGHT / DPI)
            sheet = _sheet(figure, seen)
            sheet.lines([np.concatenate(chain) for chain in chains], **DESIRED_LINE)
            drawn = [path[: np.searchsorted(t, now, side="right")] for t, path in inks]
            sheet.lines([path for path in drawn if path], **INK_LINE)
            sheet.arm(arms[k])
            pictures.append(_picture(figure))
    palette = pictures[-1].quantize(COLOURS)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures)
    durations = [FRAME_MS] * len(others) + [LAST_MS]
    first.save(file, format="GIF", save_all=True, append_images=others, duration=durations, loop=0)


def _picture(figure: Figure) -> Image.Image:
    """Return a figure as a picture."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _sheet(figure: Figure, seen: Sequence[Any]) -> Sheet:
    """Return a sheet without numbers along its edges, large enough for these points."""
    sheet = Sheet(figure, FILM_BOX, FROM_BEHIND)
    sheet.show(sheet.seen(seen), ROOM)
    sheet.axes.set(xlabel="", ylabel="")
    sheet.axes.tick_params(length=0, labelbottom=False, labelleft=False)
    return sheet
