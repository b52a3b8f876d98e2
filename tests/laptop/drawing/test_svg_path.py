"""The data of paths: what the grammar of SVG allows, and what comes before a fault."""

import numpy as np
import pytest

from laptop.drawing.curves import Straight
from laptop.drawing.svg_path import BadShape, path_pieces, polyline_pieces


def corners(piece):
    """The points of straight lines; the ends of a curve."""
    return piece.points if isinstance(piece, Straight) else piece.at(np.array([0.0, 1.0]))


def ends(subpaths):
    """Where each subpath begins, and where its pieces end."""
    found = []
    for pieces in subpaths:
        points = np.vstack([corners(pieces[0])[:1], *(corners(piece)[1:] for piece in pieces)])
        found.append([tuple(map(float, np.round(point, 6))) for point in points])
    return found


@pytest.mark.parametrize(
    ("data", "points"),
    [
        ("M0 0L10 0", [[(0, 0), (10, 0)]]),
        ("M0,0 10,0 10,10", [[(0, 0), (10, 0), (10, 10)]]),  # lines after a move
        ("m1 1 2 0 0 2", [[(1, 1), (3, 1), (3, 3)]]),
        ("M1.5.5L-1-1", [[(1.5, 0.5), (-1, -1)]]),  # numbers need nothing between them
        ("M1e1 0L1E-1,0", [[(10, 0), (0.1, 0)]]),
        ("M 0 0 H 5 V 6 h -5 z", [[(0, 0), (5, 0), (5, 6), (0, 6), (0, 0)]]),
        ("M0 0H1 2 3", [[(0, 0), (1, 0), (2, 0), (3, 0)]]),
        ("M1 1L2 2zL5 5", [[(1, 1), (2, 2), (1, 1)], [(1, 1), (5, 5)]]),  # on from where it began
        ("M1 1m2 2l1 0", [[(3, 3), (4, 3)]]),
        ("M0 0l1 0m1 1l1 0", [[(0, 0), (1, 0)], [(2, 1), (3, 1)]]),
        ("M0 0 C1 1 2 1 3 0 S5 -1 6 0", [[(0, 0), (3, 0), (6, 0)]]),
        ("M0 0 Q1 1 2 0 T4 0", [[(0, 0), (2, 0), (4, 0)]]),
        ("M0 0a5 5 0 0110 0", [[(0, 0), (10, 0)]]),  # the flags glued to what follows
        ("M0 0A0 5 0 0 1 10 0", [[(0, 0), (10, 0)]]),  # no radius: a line
        ("M007 .5L5. 1", [[(7, 0.5), (5, 1)]]),
        ("  M0 0\n\tL1 0  ", [[(0, 0), (1, 0)]]),
    ],
)
def test_the_grammar_of_paths(data, points):
    assert ends(path_pieces(data, 100)) == points


@pytest.mark.parametrize(
    ("data", "points"),
    [
        ("L1 1", []),  # it begins with a move
        ("3 3 M1 1L2 2", []),
        ("H5", []),
        ("nan", []),
        ("M0 0L1 0L2", [[(0, 0), (1, 0)]]),
        ("M0 0L1 0 2 0 3", [[(0, 0), (1, 0), (2, 0)]]),
        ("M0 0L1 0X9 9", [[(0, 0), (1, 0)]]),
        ("M0 0L1 0L2 nan", [[(0, 0), (1, 0)]]),
        ("M0 0L1 0a5 5 0 2 1 10 0", [[(0, 0), (1, 0)]]),  # a flag is 0 or 1
        ("M0 0L1 0z9", [[(0, 0), (1, 0), (0, 0)]]),
    ],
)
def test_what_comes_before_a_fault_is_kept(data, points):
    with pytest.raises(BadShape) as told:
        path_pieces(data, 100)
    assert ends(told.value.before) == points
    assert not told.value.is_too_long


@pytest.mark.parametrize("data", ["M0 0" + "L1 1" * 100, "M0 0L" + "1 1 " * 101, "M0 0" * 101])
def test_a_path_of_too_many_segments_is_told(data):
    with pytest.raises(BadShape) as told:
        path_pieces(data, 100)
    assert told.value.is_too_long


def test_smooth_curves_mirror_the_handle_only_of_their_own_kind():
    """T after C starts at its own point, so it is a line to its end; after Q it is mirrored."""
    after_curve = path_pieces("M0 0C0 9 3 9 3 0T6 0", 9)[0][1]
    after_quadratic = path_pieces("M0 0Q1.5 9 3 0T6 0", 9)[0][1]
    middle = np.array([0.5])
    assert after_curve.at(middle)[0][1] == pytest.approx(0.0)
    assert after_quadratic.at(middle)[0][1] == pytest.approx(-4.5)


@pytest.mark.parametrize(
    ("points", "is_closed", "found"),
    [
        ("0,0 1,0 1,1", False, [[(0, 0), (1, 0), (1, 1)]]),
        ("0,0 1,0 1,1", True, [[(0, 0), (1, 0), (1, 1), (0, 0)]]),
        ("0 0-1-1", False, [[(0, 0), (-1, -1)]]),
        ("", False, []),
    ],
)
def test_lists_of_points(points, is_closed, found):
    assert ends(polyline_pieces(points, is_closed, 10)) == found


@pytest.mark.parametrize("points", ["0,0 1,0 2", "0,0 1,0 x,1 5,5"])
def test_a_list_of_points_is_drawn_to_its_fault(points):
    with pytest.raises(BadShape) as told:
        polyline_pieces(points, False, 10)
    assert ends(told.value.before) == [[(0, 0), (1, 0)]]
