"""The claim of limits: its plants, and what the table says of those whose driver gave up."""

import pytest

from laptop.bench.draw import DrawResult, draw
from tests.claims import limits


def test_a_line_that_was_not_drawn_is_told():
    case, *_ = limits.cases(2.0)
    assert case.cpu == 2.0
    of = (case.arm, case.method, case.condition)
    results = [
        DrawResult(*of, f"line {n}", 2.0, 3.0, 1, 1, 1, 1, 1, error)
        for n, error in ((1, ""), (2, "Stalled"))
    ]
    assert limits.table(results) == [("as described", "1.5", "gave up")]


@pytest.mark.long
def test_lines_as_described_are_about_as_straight_as_the_encoders_let_them_be():
    for case in limits.cases(1.0)[:3]:
        result = draw(case)
        # Each is one luck of many; tests/robot/test_driver.py has what holds for all.
        assert 0.1 < result.greatest / result.floor < 2.0
