"""Strokes cut where the arm cannot follow."""

import re

import numpy as np
import pytest
from arms import PLANAR

from laptop.drawing import strokes
from laptop.drawing.artwork import stroke_length
from robot.motion import kinematics, trajectory

BOTH = ("up", "down")
ANGLES = np.linspace(np.radians(-120), np.radians(200), 300)
ARC = np.column_stack([14 * np.cos(ANGLES), 14 * np.sin(ANGLES)])


def cut(*lines, postures=BOTH):
    return strokes.cut(PLANAR, tuple(map(np.array, lines)), ("",) * len(lines), 0.0, postures)


def test_what_is_reached_stays_as_it_is():
    line = np.array([(10.0, -3.0), (10.0, 3.0)])
    found = cut(line)
    (stroke,) = found.strokes
    assert (stroke.points == line).all()
    assert stroke.postures == BOTH
    assert found.missed == ()


def test_a_line_is_cut_at_the_rim_and_at_the_hole():
    found = cut([(-30.0, 8.0), (30.0, 8.0)], [(7.0, 0.0), (30.0, 0.0)])
    rim = kinematics.reach(PLANAR)[1]
    ends = [np.hypot(*end) for s in found.strokes for end in (s.points[0], s.points[-1])]
    assert ends == pytest.approx([rim, rim, 7.0, rim], abs=0.02)
    assert {miss.number for miss in found.missed} == {1, 2}
    drawn = sum(stroke_length(s.points) for s in found.strokes)
    assert drawn == pytest.approx(2 * (rim**2 - 64) ** 0.5 + rim - 7, abs=0.05)


def test_what_is_missing_lies_out_of_reach():
    found = cut([(0.0, 0.0), (25.0, 3.0)])
    for miss in found.missed:
        with pytest.raises(kinematics.Unreachable):
            kinematics.inverse(PLANAR, tuple(miss.points[1]))


def test_each_part_can_be_followed_in_each_posture_that_it_names():
    circle = np.linspace(0, 2 * np.pi, 200)
    found = cut(np.column_stack([12 * np.cos(circle), 12 * np.sin(circle)]))
    assert len(found.strokes) > 1
    for stroke in found.strokes:
        points = [tuple(p) for p in stroke.points.tolist()]
        for posture in stroke.postures:
            trajectory.joint_path(PLANAR, points, posture)


def test_a_stroke_that_needs_both_postures_is_drawn_in_parts_that_meet():
    """Of a circle around the base each posture has most, and both together all."""
    found = cut(ARC)
    assert found.missed == ()
    assert found.in_parts == (1,)
    assert {s.postures for s in found.strokes} == {("up",), ("down",)}
    for a, b in zip(found.strokes, found.strokes[1:], strict=False):
        assert a.points[-1] == pytest.approx(b.points[0], abs=0.02)
    drawn = sum(stroke_length(s.points) for s in found.strokes)
    assert drawn == pytest.approx(stroke_length(ARC), abs=0.02)


def test_one_posture_alone_misses_what_the_other_has():
    assert cut(ARC, postures=("up",)).missed


def test_the_refusal_says_which_how_much_and_where():
    lines = [[(10.0, 0.0), (30.0, k)] for k in range(5)]
    found = cut(*lines)
    text = str(strokes.refusal(found.missed, 5))
    assert re.match(r"46\.\d cm of strokes 1, 2, 3 and 2 more \(of 5\) cannot be drawn: \(2", text)
    assert "out of reach" in text
    assert "--clip" in text
    assert "\n" not in text


def test_scraps_of_a_cut_line_are_left_out():
    rim = kinematics.reach(PLANAR)[1]
    assert cut([(rim - 0.03, 0.0), (25.0, 0.0)]).strokes == ()
