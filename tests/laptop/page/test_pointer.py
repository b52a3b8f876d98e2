"""Clicks and drags of a pointer."""

from laptop.page.pointer import Pointer


def handled(*events):
    """What comes of pointer events, (kind, u, button, buttons) each."""
    pointer = Pointer()
    done = [pointer.handle("pointer" + kind, (u, 9.0), *keys) for kind, u, *keys in events]
    return [[u for u, _ in points] for points in done if points]


LATE = [("move", 70.0, -1, 0)] * 3


DOWN, UP = ("down", 50.0, 0, 1), ("up", 51.0, 0, 0)


def test_a_pointer_clicks_or_drags():
    assert handled(DOWN, UP) == [[50]]
    assert handled(DOWN, ("move", 60.0, -1, 1), UP) == [[50, 60, 51]]
    assert handled(DOWN, ("move", 52.0, -1, 1), UP) == [[50]], "a hand is not that steady"


def test_moves_from_before_a_click_do_no_harm_if_they_come_late():
    assert handled(DOWN, *LATE, UP) == [[50]]
    assert handled(DOWN, *LATE[:2], ("move", 60.0, -1, 1), *LATE[:2], UP) == [[50, 60, 51]]


def test_what_is_let_go_of_outside_the_picture_or_taken_away_is_no_drag():
    assert handled(DOWN, *LATE, *LATE, UP) == []
    assert handled(DOWN, ("cancel", 60.0, -1, 0), UP) == []
    assert handled(("down", 50.0, 2, 2), ("up", 50.0, 2, 0)) == [], "the other button"
