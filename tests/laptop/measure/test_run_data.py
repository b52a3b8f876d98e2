"""Where the arm stood, and where the camera saw it then."""

import numpy as np
import pytest

from laptop.measure.run_data import BadMeasurement, RunData, Sights
from shared.job_log import LogRow

Q = (0.1, 0.2)


def run_of(pixels, rows):
    """A run of 2 s, a picture every 0.1 s."""
    t = np.arange(len(pixels)) * 0.1
    return RunData(rows, 1.0, {"A": Sights(t, np.array(pixels, float))})


def test_a_rest_is_looked_at_in_its_second_half():
    moving = [(10.0 * k, 0.0) for k in range(15)]
    standing = [(300.0, 40.0 + 0.1 * (k % 3)) for k in range(5)]
    rests = run_of(moving + standing, [LogRow(1, 1.0, 1.92, True, Q)]).rests()
    assert rests.stroke.tolist() == [1]
    assert rests.q.tolist() == [list(Q)]
    assert rests.seen.tolist() == [5]
    assert rests.pixel[0] == pytest.approx((300.0, 40.1))
    # The median absolute deviation of 0, 0.1, 0.2, 0, 0.1 is 0.1; across nothing moves.
    assert rests.sigma[0] == pytest.approx(0.14826 / np.sqrt(2))


def test_one_picture_far_off_changes_nothing():
    pixels = [(300.0, 40.0)] * 18 + [(700.0, 0.0), (300.0, 40.0)]
    rests = run_of(pixels, [LogRow(1, 1.0, 1.9, True, Q)]).rests()
    assert rests.pixel[0].tolist() == [300.0, 40.0]


def test_a_marker_that_is_out_of_sight_is_told():
    pixels = [(np.nan, np.nan)] * 10 + [(1.0, 2.0)] * 10
    rows = [LogRow(1, 0.5, 0.9, True, Q), LogRow(2, 1.0, 1.9, True, Q)]
    rests = run_of(pixels, rows).rests()
    assert rests.seen.tolist() == [0, 5]
    assert np.isnan(rests.pixel[0]).all()
    assert np.isnan(rests.sigma[0])
    assert rests.pixel[1].tolist() == [1.0, 2.0]


def test_a_run_without_rests_says_what_to_do():
    with pytest.raises(BadMeasurement, match="no rest of the arm; put today's program on it"):
        run_of([(0, 0)], [LogRow(1, 0.0, 0.0, False, Q)]).rests()


def test_what_was_logged_in_motion_comes_apart_from_the_rests():
    rows = [LogRow(1, 0.5, 10.0, False, Q), LogRow(1, 1.0, 11.0, True, Q)]
    plan, t, q = run_of([(0, 0)], rows).motors()
    assert (plan.tolist(), t.tolist(), q.tolist()) == ([0.5], [10.0], [list(Q)])
