"""Strokes are cut into smooth pieces at their corners."""

import math

import pytest

from robot.motion import paths


def test_a_stroke_is_cut_at_its_corners_only():
    circle = [(math.cos(k / 10), math.sin(k / 10)) for k in range(30)]
    pieces = paths.pieces_of([(3.0, 0.0)] + circle + [circle[-1], (-3.0, 0.0), (-3.0, 2.0)])
    assert [len(piece) for piece in pieces] == [2, 30, 2, 2]
    assert pieces[1] == tuple(circle)
    assert all(a[-1] == b[0] for a, b in zip(pieces, pieces[1:]))


def test_points_in_one_place_are_no_stroke():
    with pytest.raises(paths.BadPath, match="at least 2 points, not 1"):
        paths.pieces_of([(1, 2), (1, 2)])
