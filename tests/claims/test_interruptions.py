"""The claim of interruptions: what counts as a gap and as left out; one drawing for real."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.claims import interruptions

CHAINS = [[np.array([(10.0, 0.0), (10.0, 4.0)])], [np.array([(12.0, 4.0), (12.0, 0.0)])]]
FINE = SimpleNamespace(status=0, reason="ended")


def record(*ways):
    """Samples every 10 ms on straight ways (start, end, pen), 1 s each."""
    rows = []
    for start, end, pen in ways:
        for k in range(101):
            x, y = np.add(start, np.subtract(end, start) * k / 100)
            rows.append(SimpleNamespace(t=0.01 * len(rows), q=(0, 0), x=x, y=y, z=None, pen=pen))
    return rows


def judged(*records, pauses=(), over=float("inf"), end="none"):
    case = interruptions.Interruption(1, "planar")
    return interruptions._judged(case, end, list(records), CHAINS, pauses, over, FINE)


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


def test_what_no_run_has_drawn_is_left_out():
    found = judged(record(((10, 0), (10, 3), 1)), record(((12, 4), (12, 0), 1)), end="term")
    assert found.missed_mm == pytest.approx(10.0, abs=1.0)


@pytest.mark.claims
def test_a_drawing_is_interrupted_and_ended():
    for seed in range(1, 4):
        one = interruptions.interrupt(interruptions.Interruption(seed, "planar"))
        assert one.error == ""
        assert max(one.gaps_mm, default=0) <= 1
        assert max(one.lift_s, default=0) <= 0.5
        assert one.standing_s <= 0.5
        assert one.missed_mm < 6
