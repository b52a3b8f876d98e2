"""Strokes joined where they meet.  Pure."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from laptop.drawing.strokes import PlacedStroke

MEETING = 0.05
"""Distance up to which two ends meet, cm."""


def merged(strokes: Sequence[PlacedStroke], meeting: float = MEETING) -> list[PlacedStroke]:
    """Return strokes joined where one begins at another's end in the same layer.

    Two are joined only where one posture can draw both.  Where more than two ends meet, the line
    goes on as straight as it can.
    """
    ends = _Ends(strokes, meeting)
    out: list[PlacedStroke] = []
    used = [False] * len(strokes)
    for k, stroke in enumerate(strokes):
        if used[k]:
            continue
        used[k] = True
        parts, postures = [stroke.points], stroke.postures
        for forwards in (True, False):
            while True:
                line = parts[-1] if forwards else parts[0][::-1]
                found = ends.next(line, stroke.layer, postures, used)
                if found is None:
                    break
                j, points = found
                used[j] = True
                postures = tuple(p for p in postures if p in strokes[j].postures)
                parts = [*parts, points] if forwards else [points[::-1], *parts]
        joined = parts[0] if len(parts) == 1 else np.vstack(parts)
        if len(parts) > 1:
            is_distinct = np.hypot(*np.diff(joined, axis=0).T) > 1e-9
            joined = joined[np.append(True, is_distinct)]
        out.append(replace(stroke, points=joined, postures=postures))
    return out


# Where several ends meet, which of them is the line's continuation?  Strokes are the edges of a
# graph and their ends its nodes; a graph with 2 k nodes of odd degree can be drawn with k lines
# (L. Euler, 1736, for k = 1), and C. Hierholzer's algorithm (1873) finds them.  That has the fewest
# pen lifts, but such lines turn into any edge at a crossing, and at each of these corners the arm
# has to stop.  Here each line goes on as straight as it can, with the least |turn|, as a hand would
# draw it: where two lines cross they stay two, and smooth ones stay smooth.  The choice is greedy,
# by the order of the file, so that the same file gives the same lines.  Ends are kept in cells as
# wide as MEETING: whatever is near enough lies in a cell beside or in the same one.
class _Ends:
    """Index of the strokes' ends, by place and direction.

    In each cell the ends are in the order of the directions in which their strokes leave: the best
    is found by bisection, and those that are used are stepped over at once.
    """

    def __init__(self, strokes: Sequence[PlacedStroke], meeting: float) -> None:
        self._strokes, self._meeting = strokes, meeting
        self._size = max(meeting, 1e-9)
        self._cells: dict[tuple[str, int, int], dict[tuple[str, ...], _Cell]] = {}
        found: dict[tuple[str, int, int, tuple[str, ...]], list[_End]] = defaultdict(list)
        for k, stroke in enumerate(strokes):
            for is_tail, line in ((False, stroke.points[:2]), (True, stroke.points[:-3:-1])):
                place = float(line[0, 0]), float(line[0, 1])
                leaves = math.atan2(line[1, 1] - line[0, 1], line[1, 0] - line[0, 0])
                where = stroke.layer, *self._cell(place), stroke.postures
                found[where].append(_End(leaves, k, is_tail, place))
        for (layer, i, j, postures), ends in found.items():
            self._cells.setdefault((layer, i, j), {})[postures] = _Cell(sorted(ends))

    def _cell(self, place: tuple[float, float]) -> tuple[int, int]:
        return math.floor(place[0] / self._size), math.floor(place[1] / self._size)

    def next(
        self, line: np.ndarray, layer: str, postures: tuple[str, ...], used: list[bool]
    ) -> tuple[int, np.ndarray] | None:
        """Return (stroke number, its points from `line` on) of the best continuation, or None."""
        (x, y), (before_x, before_y) = line[-1].tolist(), line[-2].tolist()
        heading = math.atan2(y - before_y, x - before_x)
        i, j = self._cell((x, y))
        best: tuple[float, _End] | None = None
        for across in (i - 1, i, i + 1):
            for along in (j - 1, j, j + 1):
                for shared, cell in self._cells.get((layer, across, along), {}).items():
                    if not set(postures).isdisjoint(shared):
                        for end in cell.nearest(heading, (x, y), self._meeting, used):
                            turn = abs(math.remainder(end.leaves - heading, 2 * math.pi))
                            # (Which of two that are as straight: the first that was drawn.)
                            if best is None or (round(turn, 9), end.stroke) < (
                                round(best[0], 9),
                                best[1].stroke,
                            ):
                                best = turn, end
        if best is None:
            return None
        end = best[1]
        return end.stroke, self._strokes[end.stroke].points[:: -1 if end.is_tail else 1]


class _End(NamedTuple):
    """An end of a stroke: the direction in which the stroke leaves it (rad), and where it is."""

    leaves: float
    stroke: int
    is_tail: bool
    place: tuple[float, float]


class _Cell:
    """Ends in the order of their directions; those that are used are forgotten."""

    def __init__(self, ends: list[_End]) -> None:
        self._ends = ends
        n = len(ends)
        # The next that may be unused, from each on, ahead and behind, round the circle.
        self._further = list(range(n)), list(range(n))

    def nearest(
        self, heading: float, place: tuple[float, float], meeting: float, used: list[bool]
    ) -> Iterator[_End]:
        """Return the free ends next to a direction, one on each side, that are near enough."""
        n = len(self._ends)
        begin = bisect_left(self._ends, heading, key=lambda end: end.leaves)
        for step in (1, -1):
            k, count = (begin if step == 1 else begin - 1) % n, 0
            while count < n:
                free = self._free(k, step, used)
                if free is None:
                    return
                count += (step * (free - k)) % n + 1
                end = self._ends[free]
                if count <= n and math.dist(end.place, place) <= meeting:
                    yield end
                    break
                k = (free + step) % n

    def _free(self, k: int, step: int, used: list[bool]) -> int | None:
        """Return the first free end from place k on; None where all are used."""
        further = self._further[step == 1]
        n = len(further)
        passed = []
        while used[self._ends[k].stroke]:
            passed.append(k)
            after = further[k] if further[k] != k else (k + step) % n
            if len(passed) > n:
                return None
            k = after
        for other in passed:
            further[other] = k
        return k
