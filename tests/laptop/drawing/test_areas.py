"""Areas and lines cut at their edges, against areas and lengths worked out by hand."""

import math

import numpy as np
import pytest
import shapely

from laptop.drawing.areas import TooTangled, area_of, cut_at, outlines, widened

SQUARE = np.array([[0, 0], [10, 0], [10, 10], [0, 10]], float)
INNER = 2.0 + 0.5 * SQUARE


@pytest.mark.parametrize(
    ("contours", "is_even_odd", "wanted"),
    [
        ([SQUARE], False, 100),
        ([SQUARE, INNER], False, 100),  # both wind the same way round
        ([SQUARE, INNER[::-1]], False, 75),
        ([SQUARE, INNER], True, 75),
        ([SQUARE, INNER[::-1]], True, 75),
        ([SQUARE, SQUARE + 5], False, 175),
        ([SQUARE, SQUARE + 5], True, 150),
        ([SQUARE, SQUARE + 20], True, 200),
        ([SQUARE[:2]], False, 0),
        ([], False, 0),
    ],
)
def test_what_contours_surround(contours, is_even_odd, wanted):
    assert area_of(contours, is_even_odd).area == pytest.approx(wanted)


def test_a_star_has_its_middle_by_winding_and_not_by_turns():
    corner = np.array([[math.cos(a), math.sin(a)] for a in 0.8 * math.pi * np.arange(5)])
    tip = math.radians(18)
    inner = math.sin(tip) / math.sin(math.radians(126))  # radius of the pentagon in the middle
    whole = 5 * inner * math.sin(math.radians(36))
    pentagon = 2.5 * inner**2 * math.sin(math.radians(72))
    assert area_of([corner], False).area == pytest.approx(whole)
    assert area_of([corner], True).area == pytest.approx(whole - pentagon)


def test_edges_that_cross_very_often_are_not_looked_into():
    zigzag = np.array([[k % 2 * 100.0, k] for k in range(80)])
    with pytest.raises(TooTangled):
        area_of([zigzag, zigzag[:, ::-1]], True)


BOX = shapely.box(0, 0, 5, 20)


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ([(1, 1), (4, 1)], [[(1, 1), (4, 1)]]),
        ([(6, 1), (9, 1)], []),
        ([(1, 1), (9, 1)], [[(1, 1), (5, 1)]]),
        ([(-2, 1), (9, 1)], [[(0, 1), (5, 1)]]),
        ([(1, 1), (9, 1), (9, 2), (1, 2)], [[(1, 1), (5, 1)], [(5, 2), (1, 2)]]),
        # a ring whose begin is inside
        ([(1, 1), (9, 1), (9, 9), (1, 9), (1, 1)], [[(5, 9), (1, 9), (1, 1), (5, 1)]]),
        # one that crosses itself keeps its way
        ([(1, 1), (4, 4), (4, 1), (1, 4), (9, 4)], [[(1, 1), (4, 4), (4, 1), (1, 4), (5, 4)]]),
        ([(5, 1), (5, 4)], [[(5, 1), (5, 4)]]),
    ],
)
def test_lines_are_cut_where_the_area_ends(line, wanted):
    found = cut_at(np.array(line, float), BOX)
    assert len(found) == len(wanted)
    for part, points in zip(found, wanted, strict=True):
        assert part == pytest.approx(np.array(points, float))


def test_a_line_is_cut_out_where_there_is_a_hole():
    ring = area_of([SQUARE, INNER], True)
    parts = cut_at(np.array([[-1, 5], [11, 5]], float), ring)
    assert [part.tolist() for part in parts] == [[[0, 5], [2, 5]], [[7, 5], [10, 5]]]


def test_what_lies_along_an_edge_is_inside_by_rounding_or_not():
    third = shapely.box(0, 0, 1 / 3, 0.1 + 0.2)
    line = np.array([[0.05, 0.30000000000000010], [0.1, 0.30000000000000010]])
    assert len(cut_at(line, widened(third))) == 1


def test_outlines_are_those_of_the_area_and_its_holes():
    found = outlines(area_of([SQUARE, INNER, SQUARE + 20], True))
    lengths = sorted(shapely.LineString(ring).length for ring in found)
    assert lengths == pytest.approx([20, 40, 40])
    assert all((ring[0] == ring[-1]).all() for ring in found)
