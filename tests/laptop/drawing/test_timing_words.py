"""Times as everything that tells of a drawing says them."""

import pytest

from laptop.drawing.timing import in_minutes


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (-3.0, "0 s"),
        (0, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 0 s"),
        (312, "5 min 12 s"),
        (3599.6, "1 h 0 min"),
        (4830, "1 h 20 min"),
    ],
)
def test_times_are_said_as_people_say_them(seconds, text):
    assert in_minutes(seconds) == text
