"""Five classic drawings for `bench plot`, made from their rules.

hilbert    Hilbert's curve that fills a square (1891): one stroke, all corners
snowflake  Koch's curve round a triangle (1904)
maze       slanting strokes, each to one side or the other by a die, as one-line programs for home
           computers printed them: many short strokes, some of which meet
tiles      Truchet's tiles as quarter arcs (after Smith 1987): strokes that meet in long curves
stars      stars at random, far from one another in their order: a long path with the pen up
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator

import numpy as np

from laptop.drawing.artwork import Artwork

SIDE = 12.0
"""Side of each drawing, cm."""


def artwork(name: str) -> Artwork:
    """Return the drawing of that name, one of NAMES."""
    lines = tuple(np.array(line, float) for line in _DRAWINGS[name]())
    return Artwork(name, lines, ("",) * len(lines), (SIDE, SIDE), ())


def _hilbert(order: int = 4) -> Iterator[list[tuple[float, float]]]:
    def curve(
        x: float, y: float, ax: float, ay: float, bx: float, by: float, n: int
    ) -> Iterator[tuple[float, float]]:
        if n == 0:
            yield x + (ax + bx) / 2, y + (ay + by) / 2
            return
        ax, ay, bx, by = ax / 2, ay / 2, bx / 2, by / 2
        yield from curve(x, y, bx, by, ax, ay, n - 1)
        yield from curve(x + ax, y + ay, ax, ay, bx, by, n - 1)
        yield from curve(x + ax + bx, y + ay + by, ax, ay, bx, by, n - 1)
        yield from curve(x + ax + 2 * bx, y + ay + 2 * by, -bx, -by, -ax, -ay, n - 1)

    yield list(curve(0.0, 0.0, SIDE, 0.0, 0.0, SIDE, order))


def _snowflake(depth: int = 3) -> Iterator[list[tuple[float, float]]]:
    sixth = complex(math.cos(math.pi / 3), -math.sin(math.pi / 3))

    def edge(a: complex, b: complex, n: int) -> Iterator[complex]:
        if n == 0:
            yield a
            return
        third = (b - a) / 3
        tip = a + third + third * sixth
        for p, q in ((a, a + third), (a + third, tip), (tip, b - third), (b - third, b)):
            yield from edge(p, q, n - 1)

    radius = 0.49 * SIDE
    corners = [
        complex(SIDE / 2, SIDE / 2) + radius * complex(math.cos(angle), math.sin(angle))
        for angle in (math.pi / 2 + 2 * math.pi * k / 3 for k in range(4))
    ]
    points = [p for a, b in zip(corners, corners[1:], strict=False) for p in edge(a, b, depth)]
    yield [(p.real, p.imag) for p in (*points, points[0])]


def _maze(cells: int = 9) -> Iterator[list[tuple[float, float]]]:
    rng, cell = random.Random(1982), SIDE / cells
    for row in range(cells):
        for column in range(cells):
            x, y = cell * column, cell * row
            low, high = (x, x + cell) if rng.random() < 0.5 else (x + cell, x)
            yield [(low, y), (high, y + cell)]


def _tiles(cells: int = 6) -> Iterator[list[tuple[float, float]]]:
    rng, cell = random.Random(1704), SIDE / cells
    quarter = [math.pi / 2 * k / 16 for k in range(17)]
    for row in range(cells):
        for column in range(cells):
            x, y, turned = cell * column, cell * row, rng.random() < 0.5
            for corner, begin in ((0, 0), (1, 2)) if turned else ((2, 1), (3, 3)):
                cx = x + (cell if corner in (1, 2) else 0.0)
                cy = y + (cell if corner in (1, 3) else 0.0)
                yield [
                    (
                        cx + cell / 2 * math.cos(begin * math.pi / 2 + angle),
                        cy + cell / 2 * math.sin(begin * math.pi / 2 + angle),
                    )
                    for angle in quarter
                ]


def _stars(count: int = 24) -> Iterator[list[tuple[float, float]]]:
    rng = random.Random(1054)
    for _ in range(count):
        x, y = (rng.uniform(0.6, SIDE - 0.6) for _ in range(2))
        size, turn = rng.uniform(0.3, 0.6), rng.uniform(0, math.pi)
        yield [
            (
                x + size * math.cos(turn + 4 * math.pi * k / 5),
                y + size * math.sin(turn + 4 * math.pi * k / 5),
            )
            for k in range(6)
        ]


_DRAWINGS: dict[str, Callable[[], Iterator[list[tuple[float, float]]]]] = {
    "hilbert": _hilbert,
    "snowflake": _snowflake,
    "maze": _maze,
    "tiles": _tiles,
    "stars": _stars,
}
NAMES = tuple(_DRAWINGS)
"""Names of the drawings."""
