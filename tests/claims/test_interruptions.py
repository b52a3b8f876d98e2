"""The claim of interruptions: what counts as a gap and as left out; one drawing for real."""

from types import SimpleNamespace

import numpy as np
import pytest

from laptop.emulator.device.motion_record import MotionRecord
from tests.claims import interruptions

CHAINS = [[np.array([(10.0, 0.0), (10.0, 4.0)])], [np.array([(12.0, 4.0), (12.0, 0.0)])]]
FINE = SimpleNamespace(status=0, reason="ended")


def record(*ways):
    """Samples every 10 ms on straight ways (start, end, pen), 1 s each."""
    out = MotionRecord(lambda number: 0.01 * number)
    for start, end, pen in ways:
        for k in range(101):
            x, y = np.add(start, np.subtract(end, start) * k / 100)
            out.append((0, 0), float(x), float(y), None, pen)
    return out


def judged(*records, pauses=(), over=float("inf"), end="none", chains=CHAINS):
    case = interruptions.Interruption(1, "planar")
    return interruptions._judged(case, end, list(records), chains, pauses, over, FINE)


def test_a_gap_is_where_one_run_lifts_the_pen_within_a_stroke():
    found = judged(
        record(
            *(((10, 0), (10, 2), 1), ((10, 2), (10, 2), 0), ((10, 2.05), (10, 4), 1)),
            *(((10, 4), (12, 4), 0), ((12, 4), (12, 0), 1), ((12, 0), (12, 0), 0)),
        ),
        pauses=[0.8],
    )
    assert found.gaps_mm == pytest.approx([0.5])
    assert found.lift_s == pytest.approx([0.21])
    assert found.missed_mm < 0.5
    assert found.extra_cm == pytest.approx(-0.05, abs=0.02)


def test_a_stroke_that_is_drawn_anew_after_a_crash_is_told_apart():
    found = judged(
        record(((10, 0), (10, 3), 1)),
        record(((10, 0), (10, 4), 1), ((10, 4), (12, 4), 0), ((12, 4), (12, 0), 1)),
        end="kill",
    )
    assert found.gaps_mm == []
    assert found.extra_cm == pytest.approx(3.0, abs=0.05)
    assert found.stroke_cm == pytest.approx(4.0)


CROSS = [[np.array([(10.0, 0.0), (10.0, 4.0)])], [np.array([(10.2, 2.0), (9.8, 2.0)])]]


def test_ink_that_crosses_the_stroke_before_is_of_the_next_one():
    """Though a little beside it, where the stroke before is nearer."""
    found = judged(
        record(*(((10, 0), (10, 4), 1), ((10, 4), (10.2, 2.3), 0), ((10.2, 2.3), (9.8, 2.3), 1))),
        chains=CROSS,
    )
    assert found.greatest_mm == pytest.approx(3.0, abs=0.1)
    assert found.missed_mm == pytest.approx(2.0, abs=0.1)  # the stroke before is nearest there


def test_an_order_to_pause_was_given_to_the_first_run_alone():
    found = judged(
        record(((10, 0), (10, 1), 1)),
        record(*(((10, 0), (10, 4), 1), ((10, 4), (10.2, 2.3), 0), ((10.2, 2.3), (9.8, 2.3), 1))),
        pauses=[0.9],
        end="kill",
        chains=CROSS,
    )
    assert found.gaps_mm == []


def test_what_no_run_has_drawn_is_left_out():
    found = judged(record(((10, 0), (10, 3), 1)), record(((12, 4), (12, 0), 1)), end="term")
    assert found.missed_mm == pytest.approx(10.0, abs=1.0)


@pytest.mark.parametrize(("end", "stands"), [("term", 0.3), ("kill", 0.3), ("abort", 1.01)])
def test_the_pen_stands_until_a_signal_or_the_battery_ends_the_run(end, stands):
    way = (((10, 0), (10, 3), 1), ((10, 3), (10, 3), 1))
    found = judged(record(*way), record(((10, 0), (10, 4), 1)), over=1.31, end=end)
    assert found.standing_s == pytest.approx(stands, abs=0.02)


def test_the_pen_stands_in_the_run_that_goes_on_at_any_time():
    found = judged(
        record(((10, 0), (10, 3), 1)),
        record(((10, 0), (10, 4), 1), ((10, 4), (10, 4), 1)),
        over=0.5,
        end="term",
    )
    assert found.standing_s == pytest.approx(1.01, abs=0.02)


@pytest.mark.claims
def test_a_drawing_is_interrupted_and_ended():
    for seed in range(1, 4):
        one = interruptions.interrupt(interruptions.Interruption(seed, "planar"))
        assert one.error == ""
        assert max(one.gaps_mm, default=0) <= 1
        assert max(one.lift_s, default=0) <= 0.5
        assert one.standing_s <= 0.5
        assert one.missed_mm < 6
