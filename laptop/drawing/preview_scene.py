"""What a preview shows, whatever it is written as."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class PreviewScene:
    """What a preview shows; all points (n, 2) are cm on the picture, x to the right, y up.

    title, lines  what is written over it
    low, high     corners of what is shown
    reach         outlines of what the arm reaches, to be filled by the even-odd rule
    paper         corners of the sheet, or None
    strokes       in order
    colours       of each, "#rrggbb"
    ways          from each stroke to the next
    missed        what cannot be reached
    start         where the pen comes down first, or None
    joints        base, every joint and the tip at home
    scale         colours of the time's scale, from the first to the last
    seconds       that all takes
    """

    title: str
    lines: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    reach: tuple[np.ndarray, ...]
    paper: np.ndarray | None
    strokes: tuple[np.ndarray, ...]
    colours: tuple[str, ...]
    ways: tuple[np.ndarray, ...]
    missed: tuple[np.ndarray, ...]
    start: np.ndarray | None
    joints: np.ndarray
    scale: tuple[str, ...]
    seconds: float
