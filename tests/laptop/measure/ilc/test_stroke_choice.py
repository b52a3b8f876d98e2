"""Which strokes stand for all: those that lie apart, and go other ways."""

import pytest
from arms import PLANAR as ARM

from laptop.measure.ilc.piece_path import paths_of
from laptop.measure.ilc.stroke_choice import choose
from robot.motion import paths, trajectory


def strokes(lines):
    return [paths_of(ARM, trajectory.plan(ARM, paths.polyline(line))) for line in lines]


def test_one_of_each_heap_is_chosen():
    near = [((12 + d, d), (10 + d, 4 + d)) for d in (0.0, 0.1, 0.2)]
    far = [((5 + d, 14), (2 + d, 12)) for d in (0.0, 0.1)]
    low = [((12, -8 + d), (14, -6 + d)) for d in (0.0, 0.1)]
    chosen = choose(strokes(near + far + low), 3)
    assert [sum(k in heap for k in chosen) for heap in (range(3), range(3, 5), range(5, 7))] == [
        1,
        1,
        1,
    ]


def test_to_and_fro_are_two():
    to, fro = ((12, 0), (10, 4)), ((10, 4), (12, 0))
    chosen = choose(strokes([to, to, fro, to]), 2)
    assert 2 in chosen
    assert len(chosen) == 2


@pytest.mark.parametrize("count", [4, 9])
def test_there_are_no_more_than_there_are(count):
    lines = [((12, k), (10, 3 + k)) for k in range(4)]
    assert choose(strokes(lines), count) == [0, 1, 2, 3]


def test_a_dot_is_not_chosen_before_a_line():
    lines = [((12, 0), (10, 4)), ((3, 15), (3.2, 15)), ((12, -6), (14, -4)), ((13, 0), (11, 4))]
    assert 1 not in choose(strokes(lines), 2)
    assert choose(strokes(lines), 3) == [0, 2, 3]
