"""The common form of all that is drawn, whatever it was read from: strokes on a sheet.  Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from shared.arm_description import ArmError

SMOOTH_TURN = 6.0
"""Greatest turn of a curve from point to point, degrees."""

CORNER_TURN = 20.0
"""Turn above which a point is a corner, degrees; what turns less is drawn as a smooth curve."""


DOT = 0.02
"""Length of the dash that a dot becomes (a line without length with round ends), cm, on paper as on
its sheet."""


class BadArtwork(ArmError, ValueError):
    """A file, a text or an option of which no drawing can be made."""


@dataclass(frozen=True)
class Artwork:
    """Strokes to be drawn, on a sheet of their own: cm, x to the right, y upwards.

    name      of it, for people
    strokes   tuple of arrays (n, 2), n >= 2, float64: from pen down to pen up, each a line of
              straight pieces; what is curved turns by at most SMOOTH_TURN a point
    layers    per stroke, the name of its layer ("" where there is none)
    size      (width, height) of its sheet, cm, or None where the source says none; the sheet is
              (0, 0) to size
    left_out  sentences: what of the source is not drawn, and why
    kind      what it was made of: "SVG", "picture", "text", or "" for something else
    colours   of an SVG, per stroke the name of its colour
    """

    name: str
    strokes: tuple[np.ndarray, ...]
    layers: tuple[str, ...]
    size: tuple[float, float] | None = None
    left_out: tuple[str, ...] = ()
    kind: str = ""
    colours: tuple[str, ...] = ()

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and greatest x, y of all strokes, cm: two arrays (2,).

        Raises:
            BadArtwork: There is no stroke.
        """
        return bounds(self.strokes, self.name)

    def points(self) -> int:
        """Return the number of points of all strokes."""
        return sum(len(stroke) for stroke in self.strokes)

    def length(self) -> float:
        """Return the length of all strokes, cm, without the pen-up moves between them."""
        return sum(stroke_length(stroke) for stroke in self.strokes)


def bounds(strokes: Iterable[np.ndarray], name: str = "it") -> tuple[np.ndarray, np.ndarray]:
    """Return the least and greatest x, y of strokes (n, 2): two arrays (2,), in their unit.

    Raises:
        BadArtwork: There is no stroke.
    """
    boxes = [(stroke.min(axis=0), stroke.max(axis=0)) for stroke in strokes]
    if not boxes:
        raise BadArtwork(f"{name}: nothing is to be drawn; give at least one line")
    least, greatest = zip(*boxes, strict=True)
    return np.min(least, axis=0), np.max(greatest, axis=0)


def stroke_length(stroke: np.ndarray) -> float:
    """Return the length of a stroke (n, 2), in its unit."""
    return float(np.hypot(*np.diff(stroke, axis=0).T).sum())


def is_dot(stroke: np.ndarray) -> bool:
    """Return whether a stroke (n, 2), cm, is a dot: a dash no longer than DOT, never scaled."""
    return len(stroke) == 2 and stroke_length(stroke) <= 1.001 * DOT


def turns(stroke: np.ndarray) -> np.ndarray:
    """Return the unsigned turning angles of a stroke (n, 2) at its inner points, rad: (n - 2,).

    Points that follow each other must differ.
    """
    heading = np.unwrap(np.arctan2(*np.diff(stroke, axis=0).T[::-1]))
    return np.abs(np.diff(heading))
