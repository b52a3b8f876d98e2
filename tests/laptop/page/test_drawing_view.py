"""A drawing over a picture: where it is seen, and where a hand puts it."""

import re

import numpy as np
import pytest

from laptop.page.drawing_snapshots import Deviation, DrawingSnapshot, PlacedDrawing, Placing
from laptop.page.drawing_view import MAX_POINTS, DrawingView, figure, placing_of, thinned
from laptop.page.table_mapping import TableView

# 10 px a cm; x up in the picture, y to the left, as an arm has it that points up.
VIEW = TableView(np.array([[0.0, -10.0, 320.0], [-10.0, 0.0, 400.0], [0.0, 0.0, 1.0]]))
SQUARE = np.array([(10.0, -2), (10, 2), (14, 2), (14, -2), (10, -2)])
PLACED = PlacedDrawing("it", (SQUARE,), (SQUARE + (6, 0),), (12.0, 0.0), (4.0, 4.0), 0.0)


@pytest.fixture
def view():
    view = DrawingView("A")
    view.update(DrawingSnapshot(PLACED, {"A": VIEW}))
    return view


def test_it_is_seen_where_it_will_be_drawn_green_and_red(view):
    svg = view.svg(640, handles=True)
    good = re.search(r'd="([^"]*)"[^>]*data-drawing="good"', svg).group(1)
    assert good == "M340.0 300.0L300.0 300.0L300.0 260.0L340.0 260.0L340.0 300.0"
    assert 'data-drawing="missed"' in svg
    assert svg.count("data-handle") == 5
    assert "data-handle" not in view.svg(640, handles=False)
    assert DrawingView("A").svg(640, True) == ""
    other = DrawingView("B")
    other.update(DrawingSnapshot(PLACED, {"A": VIEW}))
    assert other.svg(640, True) == "", "nobody knows where it would be in that picture"


@pytest.mark.parametrize(
    ("start", "end", "placing"),
    [
        ((320, 280), (350, 260), Placing(14.0, -3.0, 4.0, 0.0)),
        ((300, 260), (280, 240), Placing(12.0, 0.0, 8.0, 0.0)),  # a corner away from the centre
        ((340, 300), (330, 290), Placing(12.0, 0.0, 2.0, 0.0)),
        ((320, 245), (285, 280), Placing(12.0, 0.0, 4.0, 90.0)),  # the handle above
        ((320, 245), (355, 280), Placing(12.0, 0.0, 4.0, -90.0)),
    ],
)
def test_a_hand_moves_scales_and_turns_it(view, start, end, placing):
    assert view.press(start, 640)
    middle = tuple((a + b) / 2 for a, b in zip(start, end, strict=True))
    view.move(middle)
    assert 'data-drawing="moving"' in view.svg(640, True)
    view.move(end)
    assert view.release() == pytest.approx(placing)
    assert 'data-drawing="moving"' in view.svg(640, True), "until the tracker has answered"
    view.update(DrawingSnapshot(PLACED._replace(centre=(14.0, -3.0)), {"A": VIEW}))
    assert 'data-drawing="good"' in view.svg(640, True)


def test_beside_it_there_is_nothing_to_grasp(view):
    assert not view.press((100, 100), 640)
    view.move((200, 200))
    assert view.release() is None


def test_a_press_without_a_move_changes_nothing(view):
    assert view.press((320, 280), 640)
    view.move((320, 280))
    assert view.release() is None
    assert view.moved is None


def test_beyond_the_horizon_it_stays(view):
    askew = TableView(np.array([[0.0, -10, 320], [-10, 0, 400], [-0.02, 0, 1.0]]))
    view.update(DrawingSnapshot(PLACED, {"A": askew}))
    at = askew.to_picture(np.array([PLACED.centre]))[0]
    assert view.press(tuple(at), 640)
    view.move((320.0, 500.0))
    for pixel in ((320.0, 1e5), (320.0, 500.001), (float("nan"), 0.0)):
        view.move(pixel)
    moved = view.release()
    assert moved is None or np.isfinite(moved).all()


def test_what_is_sent_while_a_hand_has_it_waits(view):
    view.press((320, 280), 640)
    view.move((350, 260))
    view.update(DrawingSnapshot(PLACED, {"A": VIEW}))
    assert view.moved is not None
    view.cancel()
    assert view.moved is None
    assert placing_of(PLACED) == Placing(12.0, 0.0, 4.0, 0.0)


def test_what_is_shown_is_bounded():
    dice = np.random.default_rng(1)
    lines = [np.cumsum(dice.normal(0, 0.1, (500, 2)), axis=0) for _ in range(100)]
    (shown,) = thinned([lines])
    assert sum(len(line) for line in shown) <= MAX_POINTS
    assert len(shown) == 100


def test_wish_and_ink_are_shown_over_each_other():
    deviation = Deviation(1.0, 0.5, 5, (SQUARE + 0.1,))
    svg = figure(DrawingSnapshot(PLACED, {}, deviation))
    assert svg.count("<path") == 2
    assert 'data-part="ink"' in svg
    assert "M2.000 -10.000L-2.000 -10.000" in svg, "x is up, y to the left"
    assert figure(DrawingSnapshot(PLACED, {})) == ""
