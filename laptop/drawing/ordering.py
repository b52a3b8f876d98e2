"""Strokes joined where they meet, and put into an order with little way between them.  Pure.

The order begins as that of the nearest neighbour and is improved by turning parts of it round
(2-opt) and moving short parts elsewhere (Or-opt), with every stroke free to be drawn from either
end, and a closed one from any of its points.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from laptop.drawing.strokes import PlacedStroke

MEETING = 0.02
"""Ends so near to one another meet, cm."""

LONGEST_MOVED = 3
"""Or-opt moves so many strokes at once, at the most."""

MOST_TRIED = 60_000_000
"""So many changes of the order are tried, at the most: it is the same on every computer."""

LEAST_GAIN = 1e-6
"""A change that saves less is none, cm."""

POSTURE_WAY = 6.0
"""A change of posture takes as long as a way of so much, cm."""


def merged(strokes: Sequence[PlacedStroke], meeting: float = MEETING) -> list[PlacedStroke]:
    """Strokes of which one begins where another of its layer ends, made one.

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
            while not _is_closed(parts, meeting):
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
            apart = np.hypot(*np.diff(joined, axis=0).T) > 1e-9
            joined = joined[np.append(True, apart)]
        out.append(replace(stroke, points=joined, postures=postures))
    return out


def _is_closed(parts: list[np.ndarray], meeting: float) -> bool:
    return bool(np.hypot(*(parts[-1][-1] - parts[0][0])) <= meeting) and (
        len(parts) > 1 or len(parts[0]) > 2
    )


class _Ends:
    """Finds ends of strokes by place."""

    def __init__(self, strokes: Sequence[PlacedStroke], meeting: float) -> None:
        self._strokes, self._meeting = strokes, meeting
        self._cells: dict[tuple[str, int, int], list[tuple[int, bool]]] = defaultdict(list)
        for k, stroke in enumerate(strokes):
            for reverse, p in ((False, stroke.points[0]), (True, stroke.points[-1])):
                self._cells[(stroke.layer, *self._cell(p))].append((k, reverse))

    def _cell(self, p: np.ndarray) -> tuple[int, int]:
        size = max(self._meeting, 1e-9)
        return math.floor(p[0] / size), math.floor(p[1] / size)

    def next(
        self, line: np.ndarray, layer: str, postures: tuple[str, ...], used: list[bool]
    ) -> tuple[int, np.ndarray] | None:
        """(which stroke, its points from where `line` ends) that goes on best, or None."""
        p, (x, y) = line[-1], self._cell(line[-1])
        best, least = None, math.inf
        for i in (x - 1, x, x + 1):
            for j in (y - 1, y, y + 1):
                for k, reverse in self._cells.get((layer, i, j), ()):
                    if used[k] or not set(postures) & set(self._strokes[k].postures):
                        continue
                    points = self._strokes[k].points[:: -1 if reverse else 1]
                    if math.hypot(*(points[0] - p)) > self._meeting:
                        continue
                    a, b = p - line[-2], points[1] - points[0]
                    turn = abs(math.atan2(a[0] * b[1] - a[1] * b[0], a @ b))
                    if turn < least - 1e-9:
                        best, least = (k, points), turn
        return best


def ordered(
    strokes: Sequence[PlacedStroke], start: np.ndarray, most_tried: int = MOST_TRIED
) -> list[PlacedStroke]:
    """Strokes in an order, and turned round, so that the ways between them are short.

    Layers stay in their order.

    Args:
        strokes: of any layers.
        start: place of the tip before, (2,), cm.
        most_tried: changes of the order that are tried.
    """
    layers = dict.fromkeys(stroke.layer for stroke in strokes)
    out: list[PlacedStroke] = []
    for layer in layers:
        own = [stroke for stroke in strokes if stroke.layer == layer]
        share = max(1, most_tried * len(own) // len(strokes))
        for stroke in _layer_in_order(own, start, share):
            out.append(stroke)
            start = stroke.points[-1]
    return out


def pen_up_way(strokes: Sequence[PlacedStroke]) -> float:
    """Length of the ways between strokes, cm."""
    ends = np.array([(a.points[-1], b.points[0]) for a, b in zip(strokes, strokes[1:])])
    return float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum()) if len(ends) else 0.0


def _layer_in_order(
    strokes: Sequence[PlacedStroke], start: np.ndarray, most_tried: int
) -> list[PlacedStroke]:
    heads, tails = _ends_of(strokes)
    begin = np.append(start, 0.0)
    order, reverse = _nearest_neighbours(heads, tails, begin)
    tour = _Tour(heads, tails, order, reverse, begin)
    tour.improve(most_tried)
    out = [
        strokes[k].turned_round() if turned else strokes[k]
        for k, turned in zip(tour.order, tour.reverse, strict=True)
    ]
    return _closed_from_best(out, start)


def _ends_of(strokes: Sequence[PlacedStroke]) -> tuple[np.ndarray, np.ndarray]:
    """First and last points (n, 3) each; the third number keeps postures apart, cm."""
    # One that any posture can draw lies with those that only the preferred one can.
    other = [stroke.postures[0] for stroke in strokes]
    base = max(set(other), key=lambda posture: (other.count(posture), posture))
    apart = np.array([0.0 if base in stroke.postures else POSTURE_WAY for stroke in strokes])
    heads = np.array([stroke.points[0] for stroke in strokes])
    tails = np.array([stroke.points[-1] for stroke in strokes])
    return np.column_stack([heads, apart]), np.column_stack([tails, apart])


def _nearest_neighbours(
    heads: np.ndarray, tails: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    n = len(heads)
    ends = np.vstack([heads, tails])
    left = np.arange(2 * n)  # ends of strokes that are not drawn yet
    drawn = np.zeros(2 * n, bool)
    order, reverse = np.empty(n, int), np.empty(n, bool)
    here = start
    points = ends.copy()
    for k in range(n):
        off = points - here
        distance = np.einsum("ij,ij->i", off, off)
        distance[drawn[left]] = np.inf
        end = int(left[np.argmin(distance)])
        stroke, turned = end % n, end >= n
        order[k], reverse[k] = stroke, turned
        here = heads[stroke] if turned else tails[stroke]
        drawn[stroke] = drawn[stroke + n] = True
        if k % 64 == 63:
            left = left[~drawn[left]]
            points = ends[left]
    return order, reverse


class _Tour:
    """An order of strokes that can be improved.

    Attributes:
        order: numbers of strokes.
        reverse: whether each is drawn from its end.
    """

    def __init__(
        self,
        heads: np.ndarray,
        tails: np.ndarray,
        order: np.ndarray,
        reverse: np.ndarray,
        start: np.ndarray,
    ) -> None:
        self.order, self.reverse = order, reverse
        turned = reverse[:, None]
        # A stroke without length stands for where the arm comes from.
        self._in = np.vstack([start, np.where(turned, tails[order], heads[order])])
        self._out = np.vstack([start, np.where(turned, heads[order], tails[order])])
        self._tried = 0

    def improve(self, most_tried: int) -> None:
        """Change the order until nothing more is gained, or so many changes were tried."""
        while self._turn_parts(most_tried) + self._move_parts(most_tried) > LEAST_GAIN:
            pass

    def _turn_parts(self, most_tried: int) -> float:
        """2-opt, each part that begins at i by the best end j: what it gained, cm."""
        n, gained = len(self._in), 0.0
        for i in range(1, n):
            if self._tried > most_tried:
                break
            self._tried += n - i
            came = self._out[i - 1]
            # from i - 1 to i and j to j + 1 becomes: from i - 1 to j, and i to j + 1
            ends, nexts = self._out[i:], self._in[i + 1 :]
            before = _length(came - self._in[i]) + np.append(_lengths(ends[:-1] - nexts), 0.0)
            after = _lengths(ends - came) + np.append(_lengths(nexts - self._in[i]), 0.0)
            gains = before - after
            j = i + int(np.argmax(gains))
            if gains[j - i] > LEAST_GAIN:
                gained += float(gains[j - i])
                self._reverse(i, j)
        return gained

    def _move_parts(self, most_tried: int) -> float:
        """Or-opt, each short part to its best place: what it gained, cm."""
        gained = 0.0
        for length in range(1, LONGEST_MOVED + 1):
            i = 1
            while i + length <= len(self._in) and self._tried <= most_tried:
                gained += self._move(i, i + length)
                i += 1
        return gained

    def _move(self, i: int, j: int) -> float:
        """Move the strokes i to j - 1 where they fit best."""
        n = len(self._in)
        self._tried += n
        rest_in, rest_out = np.delete(self._in, slice(i, j), 0), np.delete(
            self._out, slice(i, j), 0
        )
        head, tail = self._in[i], self._out[j - 1]
        saved = _length(self._out[i - 1] - head)
        if j < n:
            saved += _length(tail - self._in[j]) - _length(self._out[i - 1] - self._in[j])
        # behind the k-th of the rest
        gaps = np.append(_lengths(rest_out[:-1] - rest_in[1:]), 0.0)
        from_head, from_tail = _lengths(rest_out - head), _lengths(rest_out - tail)
        to_head = np.append(_lengths(rest_in[1:] - head), 0.0)
        to_tail = np.append(_lengths(rest_in[1:] - tail), 0.0)
        straight, turned = from_head + to_tail - gaps, from_tail + to_head - gaps
        cost = np.minimum(straight, turned)
        k = int(np.argmin(cost))
        gain = saved - float(cost[k])
        if gain <= LEAST_GAIN:
            return 0.0
        part = np.arange(i, j)
        rest = np.delete(np.arange(n), part)
        back = bool(turned[k] < straight[k])
        self._take(np.concatenate([rest[: k + 1], part, rest[k + 1 :]]))
        if back:
            self._reverse(k + 1, k + j - i)
        return gain

    def _take(self, places: np.ndarray) -> None:
        self._in, self._out = self._in[places], self._out[places]
        self.order = self.order[places[1:] - 1]
        self.reverse = self.reverse[places[1:] - 1]

    def _reverse(self, i: int, j: int) -> None:
        part = slice(i, j + 1)
        ins = self._in[part][::-1].copy()
        self._in[part] = self._out[part][::-1]
        self._out[part] = ins
        own = slice(i - 1, j)
        self.order[own] = self.order[own][::-1].copy()
        self.reverse[own] = ~self.reverse[own][::-1]


def _lengths(ways: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ij,ij->i", ways, ways))


def _length(way: np.ndarray) -> float:
    return math.sqrt(float(way @ way))


def _closed_from_best(strokes: list[PlacedStroke], start: np.ndarray) -> list[PlacedStroke]:
    """The same, closed strokes begun where that saves most of the ways to and from them."""
    out: list[PlacedStroke] = []
    for k, stroke in enumerate(strokes):
        points = stroke.points
        if len(points) > 3 and np.hypot(*(points[0] - points[-1])) <= 1e-6:
            cost = np.hypot(*(points - start).T)
            if k + 1 < len(strokes):
                cost += np.hypot(*(points - strokes[k + 1].points[0]).T)
            first = int(np.argmin(cost[:-1]))
            if cost[first] < cost[0] - LEAST_GAIN:
                points = np.vstack([points[first:-1], points[: first + 1]])
                stroke = replace(stroke, points=points)
        start = points[-1]
        out.append(stroke)
    return out
