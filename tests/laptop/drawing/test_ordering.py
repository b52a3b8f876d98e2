"""Order: nothing lost, and little way between strokes."""

import cProfile
import itertools
import math
import pstats

import numpy as np
import pytest

from laptop.drawing import merging, ordering
from laptop.drawing.strokes import PlacedStroke

HERE = np.zeros(2)


def stroke(*points, layer="", postures=("up", "down")):
    return PlacedStroke(np.array(points, float), layer, 1, postures)


def scattered(n, seed=1, size=20.0):
    dice = np.random.default_rng(seed)
    starts = dice.uniform(0, size, (n, 2))
    return [stroke(a, a + d) for a, d in zip(starts, dice.normal(0, 1, (n, 2)), strict=True)]


def segments(strokes):
    """All of what is drawn, whichever way."""
    return sorted(
        tuple(sorted((tuple(a), tuple(b))))
        for s in strokes
        for a, b in itertools.pairwise(s.points.round(9).tolist())
    )


def test_lines_that_meet_become_one_whichever_way_they_go():
    found = merging.merged([
        stroke((0, 0), (1, 0)), stroke((2, 1), (1, 1)), stroke((1, 0), (1, 1)),
        stroke((5, 5), (6, 6)),
    ])  # fmt: skip
    assert [s.points.tolist() for s in found] == [
        [[0, 0], [1, 0], [1, 1], [2, 1]],
        [[5, 5], [6, 6]],
    ]


def test_a_line_goes_on_as_straight_as_it_can():
    cross = [stroke((0, 0), (1, 0)), stroke((1, 0), (1, 1)), stroke((1, 0), (2, 0.1))]
    assert merging.merged(cross)[0].points[-1].tolist() == [2, 0.1]


def test_what_only_nearly_meets_is_joined_within_the_tolerance():
    near, far = stroke((1.04, 0), (2, 0)), stroke((1.06, 0), (2, 0))
    assert len(merging.merged([stroke((0, 0), (1, 0)), near])) == 1
    assert len(merging.merged([stroke((0, 0), (1, 0)), far])) == 2


def test_layers_and_postures_are_not_joined():
    a = stroke((0, 0), (1, 0), postures=("up",))
    assert len(merging.merged([a, stroke((1, 0), (2, 0), postures=("down",))])) == 2
    assert len(merging.merged([a, stroke((1, 0), (2, 0), layer="red")])) == 2
    (joined,) = merging.merged([a, stroke((1, 0), (2, 0))])
    assert joined.postures == ("up",)


def joined_by_looking_everywhere(strokes):
    """How lines are joined, found by looking at every end each time: tuples of (number, turned)."""
    unused = dict(enumerate(strokes))
    found = []
    while unused:
        number = next(iter(unused))
        first = unused.pop(number)
        line, postures = [(number, False)], set(first.postures)
        for ahead in (True, False):
            tip = first.points if ahead else first.points[::-1]
            while True:
                best = []
                for k, other in unused.items():
                    for turned in (False, True):
                        points = other.points[:: -1 if turned else 1]
                        a, b = tip[-1] - tip[-2], points[1] - points[0]
                        turn = abs(np.angle(complex(*b) / complex(*a)))
                        meets = np.hypot(*(points[0] - tip[-1])) <= merging.MEETING
                        if meets and other.layer == first.layer and postures & set(other.postures):
                            best.append((round(turn, 9), k, turned))
                if not best:
                    break
                _, k, turned = min(best)
                tip = unused[k].points[:: -1 if turned else 1]
                postures &= set(unused.pop(k).postures)
                line = [*line, (k, turned)] if ahead else [(k, not turned), *line]
        found.append(line)
    return found


@pytest.mark.parametrize("seed", range(8))
def test_lines_are_joined_as_by_looking_everywhere(seed):
    dice = np.random.default_rng(seed)
    hubs = dice.uniform(0, 4, (6, 2))
    strokes = []
    for _ in range(60):
        a, b = (hubs[k] + dice.normal(0, 0.02, 2) for k in dice.choice(6, 2, replace=False))
        postures = [("up",), ("down",), ("up", "down")][dice.integers(3)]
        strokes.append(stroke(a, b, layer="ab"[dice.integers(2)], postures=postures))
    wanted = [
        [strokes[k].points[:: -1 if turned else 1].tolist() for k, turned in line]
        for line in joined_by_looking_everywhere(strokes)
    ]
    found = merging.merged(strokes)
    assert [s.points.tolist() for s in found] == [sum(line, []) for line in wanted]


def calls_of(act):
    """How many functions are called, of Python and of C."""
    profile = cProfile.Profile()
    profile.runcall(act)
    return pstats.Stats(profile).total_calls


@pytest.mark.long
def test_spokes_that_meet_in_a_point_cost_no_more_than_n_log_n():
    def spokes(n):
        angles = np.linspace(0, 2 * np.pi, n, endpoint=False)
        return [stroke((0, 0), (100 * np.cos(a), 100 * np.sin(a))) for a in angles]

    few, many = spokes(200), spokes(3200)
    growth = calls_of(lambda: merging.merged(many)) / calls_of(lambda: merging.merged(few))
    assert growth < 16 * 1.6  # by n log n; by n squared it would be 256
    assert len(merging.merged(many)) == 1600


def test_the_nearest_is_found_as_by_looking_everywhere():
    strokes = scattered(300)
    heads, tails = (np.array([s.points[k] for s in strokes]) for k in (0, -1))
    heads, tails = (np.column_stack([ends, np.zeros(300)]) for ends in (heads, tails))
    order, reverse = ordering._nearest_neighbours(heads, tails, np.zeros(3))
    here, left = np.zeros(3), list(range(300))
    for k, turned in zip(order, reverse, strict=True):
        off = [min(math.dist(here, heads[j]), math.dist(here, tails[j])) for j in left]
        assert left[int(np.argmin(off))] == k
        assert turned == (math.dist(here, tails[k]) < math.dist(here, heads[k]))
        left.remove(k)
        here = heads[k] if turned else tails[k]


def test_the_order_loses_nothing():
    lines = scattered(60)
    assert segments(ordering.ordered(lines, HERE)) == segments(lines)


def test_the_order_is_the_best_there_is_where_all_can_be_tried():
    lines = scattered(5, seed=4)

    def way(order):
        best = np.inf
        for turned in itertools.product((False, True), repeat=len(order)):
            laid = [s.turned_round() if t else s for s, t in zip(order, turned, strict=True)]
            best = min(best, ordering.pen_up_length(laid))
        return best

    least = min(way(order) for order in itertools.permutations(lines))
    assert ordering.pen_up_length(ordering.ordered(lines, HERE)) == pytest.approx(least)


def greedy_way(lines):
    """The nearest end next, each stroke from either of its ends: what plotters' tools do."""
    left, here, way = list(lines), None, 0.0
    while left:
        options = [
            (0.0 if here is None else np.hypot(*(s.points[k] - here)), i, k)
            for i, s in enumerate(left)
            for k in (0, -1)
        ]
        least, i, k = min(options)
        way += least
        here = left.pop(i).points[-1 - k]
    return way


@pytest.mark.parametrize("seed", [1, 2])
def test_the_way_is_much_shorter_than_by_the_nearest_neighbour(seed):
    lines = scattered(60, seed)
    assert ordering.pen_up_length(ordering.ordered(lines, HERE)) < 0.82 * greedy_way(lines)


def test_it_is_the_same_every_time():
    lines = scattered(25)
    first, second = (ordering.ordered(lines, HERE) for _ in range(2))
    assert all((a.points == b.points).all() for a, b in zip(first, second, strict=True))


def test_layers_keep_their_order():
    lines = [stroke((k, 0), (k, 1), layer="ba"[k % 2]) for k in range(8)]
    assert [s.layer for s in ordering.ordered(lines, HERE)] == ["b"] * 4 + ["a"] * 4


def test_postures_are_changed_seldom():
    lines = [stroke((k, 0), (k, 1), postures=(("up",), ("down",))[k % 2]) for k in range(10)]
    changes = [s.postures for s in ordering.ordered(lines, HERE)]
    assert sum(a != b for a, b in itertools.pairwise(changes)) == 1


def test_a_closed_stroke_begins_where_the_way_is_short():
    t = np.linspace(0, 2 * np.pi, 41)
    circle = np.column_stack([np.cos(t), np.sin(t)])
    circle[-1] = circle[0]
    lines = [stroke(*(circle + (3 * k, 0))) for k in range(4)]
    found = ordering.ordered(lines, np.array([-5.0, 0.0]))
    # From the first one's near side to the last one's; from where they begin it would be 9.
    assert ordering.pen_up_length(found) == pytest.approx(7)
    assert segments(found) == segments(lines)


def test_a_single_stroke_and_none_are_in_order():
    assert ordering.pen_up_length([]) == 0
    (only,) = ordering.ordered([stroke((3, 0), (1, 0))], HERE)
    assert only.points[0].tolist() == [1, 0]  # from its end that is nearer
