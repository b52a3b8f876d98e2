"""What markers are called, and what they look like, in words."""

import pytest

from laptop.page.marker_text import describe_marker, marker_title
from laptop.see.markers.markers import Color, Marker


def test_who_names_a_marker_finds_it_by_that_name():
    assert [marker_title(name) for name in ("effector", "goal", "lid")] == [
        *("tip's marker", "goal marker", "lid")
    ]


@pytest.mark.parametrize(("hue", "word"), [(0, "red"), (352, "red"), (118, "green"), (230, "blue")])
def test_a_colour_has_the_name_of_the_nearest_one(hue, word):
    assert describe_marker(Marker("lid", "ball", Color(hue, 0.8, 0.7))) == f"{word} ball"


def test_a_code_has_its_number():
    assert describe_marker(Marker("lid", "aruco", id=7)) == "aruco:7"
