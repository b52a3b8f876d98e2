"""A line through points of the table, where it is to be drawn: it is not placed.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.options import DrawingOptions

ARM_FRAME_ROTATION = 90.0
"""Rotation of a sheet whose x and y are the arm's, degrees."""


def line_through(points: Sequence[tuple[float, float]]) -> Artwork:
    """Return the line from point to point, cm, in the arm's frame.

    Raises:
        BadArtwork: fewer than two points, or two that are one.
    """
    line = np.array(points, float).reshape(-1, 2)
    named = " ".join(f"{x:g},{y:g}" for x, y in points)
    if len(line) < 2 or not np.abs(np.diff(line, axis=0)).max(axis=1).all():
        raise BadArtwork(f"line {named}: give two points or more, each another one, as 10,0 5,10")
    return Artwork(f"line {named}", (line,), ("",))


def in_place(artwork: Artwork, options: DrawingOptions) -> DrawingOptions:
    """Return options by which an artwork of the arm's frame is drawn where and how it is."""
    low, high = artwork.bounds()
    (x, y), (width, height) = (low + high) / 2, high - low
    # (A side that has no length does not count.)
    size = float(width) or 1.0, float(height) or 1.0
    return replace(
        options,
        at=(float(x), float(y)),
        size=size,
        rotate=ARM_FRAME_ROTATION,
        paper=None,
        order=False,
    )
