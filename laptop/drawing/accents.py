"""Accents on letters of a font that has none.  Pure.

In the units of Hershey's fonts, in which capitals are 21 high; y upwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

GAP = 3.0
"""Distance between a letter and its accent, in the font's units."""


@dataclass(frozen=True)
class Accent:
    """Strokes around x = 0, y = 0 at the side of the letter; above it, or below."""

    strokes: tuple[tuple[tuple[float, float], ...], ...]
    is_above: bool = True


def ring(x: float, y: float, radius: float, points: int) -> tuple[tuple[float, float], ...]:
    """Return a circle of straight pieces around (x, y)."""
    turns = [2 * math.pi * k / points for k in range(points + 1)]
    return tuple((x + radius * math.cos(a), y + radius * math.sin(a)) for a in turns)


def _dot(x: float) -> tuple[tuple[float, float], ...]:
    return ring(x, 1.0, 0.9, 4)


ACCENTS = {
    "\u0300": Accent((((-2.5, 4.0), (1.5, 0.0)),)),  # grave
    "\u0301": Accent((((2.5, 4.0), (-1.5, 0.0)),)),  # acute
    "\u0302": Accent((((-3.5, 0.0), (0.0, 4.0), (3.5, 0.0)),)),  # circumflex
    "\u0303": Accent((((-4.5, 0.5), (-2.5, 2.3), (0.0, 1.5), (2.5, 0.7), (4.5, 2.5)),)),  # tilde
    "\u0304": Accent((((-4.0, 1.0), (4.0, 1.0)),)),  # macron
    "\u0306": Accent((((-3.5, 3.5), (-2.0, 0.8), (0.0, 0.0), (2.0, 0.8), (3.5, 3.5)),)),  # breve
    "\u0307": Accent((_dot(0.0),)),
    "\u0308": Accent((_dot(-3.5), _dot(3.5))),  # diaeresis
    "\u030a": Accent((ring(0.0, 2.0, 2.2, 16),)),
    "\u030b": Accent((((0.0, 4.0), (-3.0, 0.0)), ((4.5, 4.0), (1.5, 0.0)))),  # double acute
    "\u030c": Accent((((-3.5, 4.0), (0.0, 0.0), (3.5, 4.0)),)),  # caron
    "\u0327": Accent(  # cedilla
        (((0.0, 3.0), (0.0, 1.2), (1.8, 0.4), (2.2, -1.2), (0.8, -2.6), (-1.8, -2.6)),),
        is_above=False,
    ),
    "\u0328": Accent(  # ogonek
        (((2.0, 3.0), (0.3, 1.0), (0.3, -1.2), (1.5, -2.4), (3.2, -2.0)),),
        is_above=False,
    ),
}
"""Accents by combining character, as in Unicode's decompositions."""


def accent_strokes(mark: str, letter: list[np.ndarray]) -> list[np.ndarray]:
    """Return the strokes (n, 2) of an accent of ACCENTS, placed on a letter's strokes."""
    accent = ACCENTS[mark]
    if not letter:
        return []
    points = np.concatenate(letter)
    least, greatest = points.min(axis=0), points.max(axis=0)
    # Below, it hangs at the baseline: what hangs lower by itself has it at its foot
    y = greatest[1] + GAP if accent.is_above else min(least[1], 0.0) - GAP
    place = np.array([(least[0] + greatest[0]) / 2, y])
    return [np.array(stroke) + place for stroke in accent.strokes]
