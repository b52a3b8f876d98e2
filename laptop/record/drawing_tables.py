"""The accuracy of a drawing, as tables of its run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from laptop.record.run import RunTable, table

if TYPE_CHECKING:  # matplotlib is slow to import
    from laptop.record.figures.drawing_plot import DrawingAccuracy
    from laptop.record.figures.line_accuracy import Measure

PATHS, DRAWINGS = "paths", "drawings"
"""Names of the tables."""
_DIGITS = 3
"""Number of decimals of a value."""


def paths_table(arm: str, measures: Sequence[Measure | None]) -> RunTable:
    """Return each path that was wanted against its ink; a row without figures was not drawn."""
    figures = {
        "length cm": "length_cm",
        "time s": "seconds",
        "greatest mm": "greatest_mm",
        "rms mm": "rms_mm",
        "start off mm": "start_mm",
        "end off mm": "end_mm",
        "missed mm": "missed_mm",
        "ink cm": "ink_cm",
        "floor mm": "floor_mm",
    }
    caption = "Drawn paths: the ink against the path that was wanted"
    rows = [
        [arm, k, *(_rounded(measure, name) for name in figures.values())]
        for k, measure in enumerate(measures, 1)
    ]
    return table(PATHS, caption, ["arm", "path", *figures], rows, compared=True)


def drawing_table(
    arm: str, name: str, accuracy: DrawingAccuracy, seconds: Mapping[str, float]
) -> RunTable:
    """Return a drawing's ink against what was wished, in a row.

    Args:
        arm: its name.
        name: of the drawing.
        accuracy: of its ink.
        seconds: times by heading, s: taken, estimated.
    """
    values: dict[str, object] = {
        "arm": arm,
        "drawing": name,
        "strokes drawn": f"{accuracy.inks} of {accuracy.chains}",
        "ink cm": _rounded(accuracy, "ink_cm"),
        **{heading: round(value, 2) for heading, value in seconds.items()},
        "greatest mm": _rounded(accuracy, "greatest_mm"),
        "rms mm": _rounded(accuracy, "rms_mm"),
        "missed mm": _rounded(accuracy, "missed_mm"),
    }
    caption = "Drawings: the ink against what was wished"
    return table(DRAWINGS, caption, [*values], [[*values.values()]], compared=True)


def _rounded(measure: object | None, name: str) -> float | None:
    value = getattr(measure, name, None)
    return None if value is None else round(float(value), _DIGITS)
