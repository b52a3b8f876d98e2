"""Strokes put into an order with short pen-up moves between them.  Pure.

The order begins as that of the nearest neighbour and is improved by turning parts of it round
(2-opt) and moving short parts elsewhere (Or-opt), with every stroke free to be drawn from either
end, and a closed one from any of its points.
"""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np

from laptop.drawing.strokes import PlacedStroke

LONGEST_MOVED = 8
"""Greatest number of strokes that Or-opt moves at once."""

MAX_TRIED, MAX_TRIED_PER_STROKE = 150_000, 1_500
"""Greatest number of changes of the order that are tried: in all, and for each stroke. They are
counted, not timed, so that the order is the same on every computer."""

NEIGHBOURS = 10
"""Number of nearest ends that are considered for each end."""

KD_TREE = 4
"""FLANN's number for a single k-d tree, searched exactly."""

PARTS_EXCHANGED, EXCHANGED_WITHIN = 4, 30
"""Number of cuts between parts that are exchanged at random, and number of strokes within which the
cuts lie."""

EXCHANGE_COST = 20
"""Cost of a random exchange, in tried changes."""

STARTS, MAX_STROKES_FOR_STARTS = 4, 1500
"""Number of starts from which nearest neighbours are followed, and greatest number of strokes for
which that is done."""

MIN_GAIN = 1e-6
"""Least saving of a change, cm."""

POSTURE_CHANGE_LENGTH = 6.0
"""Length of a pen-up move that takes as long as a change of posture, cm."""


def ordered(
    strokes: Sequence[PlacedStroke], start: np.ndarray, most_tried: int = MAX_TRIED
) -> list[PlacedStroke]:
    """Return strokes reordered and reversed so that the pen-up moves between them are short.

    Layers stay in their order.

    Args:
        strokes: of any layers.
        start: place of the tip before, (2,), cm.
        most_tried: changes of the order that are tried.
    """
    layers = dict.fromkeys(stroke.layer for stroke in strokes)
    result: list[PlacedStroke] = []
    for layer in layers:
        own = [stroke for stroke in strokes if stroke.layer == layer]
        share = min(MAX_TRIED_PER_STROKE * len(own), most_tried * len(own) // len(strokes) + 1)
        for stroke in _layer_in_order(own, start, share):
            result.append(stroke)
            start = stroke.points[-1]
    return result


def pen_up_length(strokes: Sequence[PlacedStroke]) -> float:
    """Return the length of the pen-up moves between strokes, cm."""
    ends = np.array([(a.points[-1], b.points[0]) for a, b in pairwise(strokes)])
    return float(np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum()) if len(ends) else 0.0


def _layer_in_order(
    strokes: Sequence[PlacedStroke], start: np.ndarray, most_tried: int
) -> list[PlacedStroke]:
    heads, tails = _ends_of(strokes)
    begin = np.append(start, 0.0)
    # (As they came, they may lie in a good order already.)
    as_given = _Tour(heads, tails, np.arange(len(heads)), np.zeros(len(heads), bool))
    tours: list[_Tour] = []
    for first in (begin, *heads[: STARTS - 1]):
        found = [_Tour(heads, tails, *_nearest_neighbours(heads, tails, first))]
        if not tours and as_given.length() < found[0].length():
            found.insert(0, as_given)
        for tour in found:
            most_tried -= tour.shorten(most_tried)
        tours += found
        if most_tried <= 0 or len(heads) > MAX_STROKES_FOR_STARTS:
            break
    tour = min(tours, key=_Tour.length)
    tour.improve(most_tried)
    if math.dist(start, tour.end(-1)) < math.dist(start, tour.end(0)):
        tour.turn_round()
    out = [
        strokes[k].turned_round() if turned else strokes[k]
        for k, turned in zip(tour.order, tour.reverse, strict=True)
    ]
    return _closed_from_best(out, start)


def _ends_of(strokes: Sequence[PlacedStroke]) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last points (n, 3), cm; the third number is the posture's distance."""
    # One that any posture can draw lies with those that only the preferred one can.
    other = [stroke.postures[0] for stroke in strokes]
    base = max(set(other), key=lambda posture: (other.count(posture), posture))
    posture_offset = np.array(
        [0.0 if base in stroke.postures else POSTURE_CHANGE_LENGTH for stroke in strokes]
    )
    heads = np.array([stroke.points[0] for stroke in strokes])
    tails = np.array([stroke.points[-1] for stroke in strokes])
    return np.column_stack([heads, posture_offset]), np.column_stack([tails, posture_offset])


def _nearest_neighbours(
    heads: np.ndarray, tails: np.ndarray, start: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    n = len(heads)
    ends = np.vstack([heads, tails])
    order, reverse = np.empty(n, int), np.empty(n, bool)
    drawn = np.zeros(2 * n, bool)
    left = np.arange(2 * n)  # ends in the tree
    tree = _tree(ends)
    at, undrawn = start, 2 * n
    for k in range(n):
        if undrawn < len(left) // 2:
            left = left[~drawn[left]]
            tree = _tree(ends[left])
        end = _first_undrawn(tree, at, left, drawn)
        stroke, turned = end % n, end >= n
        order[k], reverse[k] = stroke, turned
        at = heads[stroke] if turned else tails[stroke]
        drawn[stroke] = drawn[stroke + n] = True
        undrawn -= 2
    return order, reverse


def _first_undrawn(
    tree: cv2.flann.Index, at: np.ndarray, left: np.ndarray, drawn: np.ndarray
) -> int:
    """Return the nearest end of a stroke that is not drawn yet; of equals the first."""
    count = 4
    while True:
        found, squares = _nearest(tree, at[None], min(count, len(left)))
        ends = left[found[0]]
        free = np.flatnonzero(~drawn[ends])
        if len(free):
            return int(ends[free][squares[0, free] <= squares[0, free[0]]].min())
        count *= 4


# The order is a travelling salesman's path: as many stops as strokes, each of which may be drawn
# from either end.  Begun with the nearest neighbour, it is improved by two kinds of changes:
#     2-opt (G. A. Croes, 1958): cut two moves, and reverse what is between them;
#     Or-opt (I. Or, 1976): move a few strokes elsewhere, reversed or not.
# Only changes are tried whose new move from an end is shorter than the old one, for every change
# that gains has such an end, and it leads to one of a few near neighbours.  Where none gains any
# more, parts that follow one another are exchanged (`improve`) and the rest settles anew.
# S. Lin and B. W. Kernighan's deeper exchanges (1973) come nearer to the shortest path, by some per
# cent, with much more code.
class _Tour:
    """An order of strokes that can be improved; where it begins and ends is free.

    Args:
        heads, tails: first and last points of the strokes, (n, 3).
        order: numbers of strokes.
        reverse: whether each is drawn from its end.
    """

    def __init__(
        self, heads: np.ndarray, tails: np.ndarray, order: np.ndarray, reverse: np.ndarray
    ) -> None:
        self.order: list[int] = order.tolist()
        self._n = len(order)
        # End e of stroke s is s (its head) or s + n (its tail).
        self._ends: list[tuple[float, ...]] = [tuple(p) for p in np.vstack([heads, tails]).tolist()]
        self._near = _neighbours(np.vstack([heads, tails]))
        self._in = [0] * self._n
        for stroke, turned in zip(self.order, reverse.tolist(), strict=True):
            self._in[stroke] = stroke + self._n if turned else stroke
        self._place = [0] * self._n
        for k, stroke in enumerate(self.order):
            self._place[stroke] = k

    @property
    def reverse(self) -> list[bool]:
        """In the order: whether each stroke is drawn from its end."""
        return [self._in[stroke] >= self._n for stroke in self.order]

    def shorten(self, most_tried: int) -> int:
        """Change the order until no single change gains; return the number of changes tried."""
        self._left = most_tried
        self._settle(self.order)
        return most_tried - self._left

    def improve(self, most_tried: int) -> None:
        """Shorten a tour in which no single change does, until so many changes were tried.

        Three short parts that follow one another are exchanged at random and what comes of it is
        improved; it is undone if it did not help (iterated local search; the "double bridge" of
        Martin, Otto and Felten 1991).
        """
        self._left = most_tried
        rng = random.Random(self._n)
        while self._left > 0 and self._n > PARTS_EXCHANGED:
            order, ends = self.order[:], self._in[:]
            before = self.length()
            cuts = sorted(rng.sample(range(min(self._n, EXCHANGED_WITHIN) + 1), PARTS_EXCHANGED))
            offset = rng.randrange(self._n - cuts[-1] + 1)
            a, b, c, d = (cut + offset for cut in cuts)
            self._write(a, self.order[c:d] + self.order[b:c] + self.order[a:b])
            self._settle(self._at(a - 1, a, a + d - c - 1, a + d - c, d - b + a, d - 1, d))
            self._left -= EXCHANGE_COST
            if self.length() > before - MIN_GAIN:
                self.order, self._in = order, ends
                for k, stroke in enumerate(order):
                    self._place[stroke] = k

    def length(self) -> float:
        """Return the length of all pen-up moves, cm."""
        return sum(
            math.dist(self._ends[self._out_of(a)], self._ends[self._in[b]])
            for a, b in pairwise(self.order)
        )

    def _settle(self, strokes: list[int]) -> None:
        """Improve the order around these strokes until nothing more is gained."""
        waiting = deque(strokes)
        queued = set(strokes)
        while waiting and self._left > 0:
            stroke = waiting.popleft()
            queued.discard(stroke)
            for other in self._improve_at(stroke):
                if other not in queued:
                    queued.add(other)
                    waiting.append(other)

    def end(self, k: int) -> tuple[float, ...]:
        """Return the tour's first (k = 0) or last (-1) end: x, y, cm."""
        stroke = self.order[k]
        return self._ends[self._in[stroke] if k == 0 else self._out_of(stroke)][:2]

    def turn_round(self) -> None:
        """Draw it all from its end."""
        self._write(0, self._flipped(self.order))

    def _out_of(self, stroke: int) -> int:
        end = self._in[stroke]
        return end - self._n if end >= self._n else end + self._n

    def _distance(self, before: int | None, after: int | None) -> float:
        """Return the distance between two ends, cm; 0 beyond the tour's first and last."""
        if before is None or after is None:
            return 0.0
        return math.dist(self._ends[before], self._ends[after])

    def _in_at(self, k: int) -> int | None:
        return self._in[self.order[k]] if 0 <= k < self._n else None

    def _out_at(self, k: int) -> int | None:
        return self._out_of(self.order[k]) if 0 <= k < self._n else None

    def _improve_at(self, stroke: int) -> list[int]:
        """Do the first change found that shortens a move from or to a stroke: whom it concerned."""
        n, i = self._n, self._place[stroke]
        for ahead in (True, False):
            own = self._out_of(stroke) if ahead else self._in[stroke]
            gap = i if ahead else i - 1  # the move is from place gap to the next
            other = self._in_at(i + 1) if ahead else self._out_at(i - 1)
            current = self._distance(own, other)
            for end in self._near[own]:
                near = end - n if end >= n else end
                if near == stroke:
                    continue
                distance = math.dist(self._ends[own], self._ends[end])
                if distance >= current - MIN_GAIN or other is None:
                    break
                is_in = end == self._in[near]
                j = self._place[near]
                if is_in != ahead and self._turned(gap, j if ahead else j - 1, current - distance):
                    return [stroke, near, *self._at(gap, gap + 1, j - 1, j, j + 1)]
                if self._moved(gap, j, is_in, ahead, current - distance):
                    j = self._place[near]
                    return [stroke, near, *self._at(gap, gap + 1, j - 3, j - 1, j + 1, j + 3)]
        return []

    def _at(self, *places: int) -> list[int]:
        return [self.order[k] for k in places if 0 <= k < self._n]

    def _turned(self, gap: int, other_gap: int, saved: float) -> bool:
        """Apply 2-opt: reverse what is between two gaps, if that gains."""
        first, last = min(gap, other_gap), max(gap, other_gap)
        self._left -= 1
        # One of the two new moves is known; the other joins what is left.
        ahead = self._distance(self._out_at(first), self._out_at(last))
        behind = self._distance(self._in_at(first + 1), self._in_at(last + 1))
        gain = (
            self._distance(self._out_at(first), self._in_at(first + 1))
            + self._distance(self._out_at(last), self._in_at(last + 1))
            - ahead
            - behind
        )
        if gain <= MIN_GAIN or first == last:
            return False
        self._write(first + 1, self._flipped(self.order[first + 1 : last + 1]))
        return True

    def _moved(self, gap: int, j: int, is_in: bool, ahead: bool, saved: float) -> bool:
        """Apply Or-opt: move a short part so that its end at place j meets the gap, if it gains.

        Args:
            gap: number of the gap in the tour.
            j: place in the tour of the end that is moved there.
            is_in: whether that end is where the part begins, else where it ends.
            ahead: whether the end comes next after the gap, else right before its other side.
            saved: what it saves on that side, cm.
        """
        n = self._n
        for length in range(1, LONGEST_MOVED + 1):
            first, last = (j, j + length - 1) if is_in else (j - length + 1, j)
            if first < 0 or last >= n or first - 1 <= gap <= last:
                break
            self._left -= 1
            far = self._out_at(last) if is_in else self._in_at(first)
            beyond = self._in_at(gap + 1) if ahead else self._out_at(gap)
            taken = self._distance(self._out_at(first - 1), self._in_at(first)) + self._distance(
                self._out_at(last), self._in_at(last + 1)
            )
            closed = self._distance(self._out_at(first - 1), self._in_at(last + 1))
            if saved + taken - closed - self._distance(far, beyond) <= MIN_GAIN:
                continue
            part = self.order[first : last + 1]
            if is_in != ahead:
                part = self._flipped(part)
            if gap < first:
                self._write(gap + 1, part + self.order[gap + 1 : first])
            else:
                self._write(first, self.order[last + 1 : gap + 1] + part)
            return True
        return False

    def _flipped(self, part: list[int]) -> list[int]:
        for stroke in part:
            self._in[stroke] = self._out_of(stroke)
        return part[::-1]

    def _write(self, first: int, part: list[int]) -> None:
        self.order[first : first + len(part)] = part
        for k, stroke in enumerate(part, first):
            self._place[stroke] = k


def _neighbours(ends: np.ndarray) -> list[list[int]]:
    """Return the NEIGHBOURS nearest other ends of each end, the nearest first."""
    found, _ = _nearest(_tree(ends), ends, min(NEIGHBOURS + 2, len(ends)))
    return [[e for e in row if e != k] for k, row in enumerate(found.tolist())]


def _tree(places: np.ndarray) -> cv2.flann.Index:
    return cv2.flann.Index(places.astype(np.float32), {"algorithm": KD_TREE, "leaf_max_size": 16})


def _nearest(tree: cv2.flann.Index, places: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest ends in the tree for each place, and their squared distances."""
    return tree.knnSearch(places.astype(np.float32), k, params={"checks": -1})


def _closed_from_best(strokes: list[PlacedStroke], start: np.ndarray) -> list[PlacedStroke]:
    """Return the strokes, closed ones begun where that saves most of the moves to and from them."""
    out: list[PlacedStroke] = []
    for k, stroke in enumerate(strokes):
        points = stroke.points
        if len(points) > 3 and np.hypot(*(points[0] - points[-1])) <= 1e-6:
            cost = np.hypot(*(points - start).T)
            if k + 1 < len(strokes):
                cost += np.hypot(*(points - strokes[k + 1].points[0]).T)
            first = int(np.argmin(cost[:-1]))
            if cost[first] < cost[0] - MIN_GAIN:
                points = np.vstack([points[first:-1], points[: first + 1]])
                stroke = replace(stroke, points=points)
        start = points[-1]
        out.append(stroke)
    return out
