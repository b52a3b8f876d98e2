"""The claim of STOP: when an arm stood, what the table says, and no browser."""

import pytest

from tests.claims import page_stop
from tests.claims.page_rig import ArmSample
from tests.claims.page_stop import StopTime


def poses(angle):
    """A pose each 10 ms from 100 s on, on an emulated clock at half the pace."""
    return [ArmSample(100 + 0.01 * k, 50 + 0.005 * k, (0.2, angle(0.01 * k))) for k in range(200)]


def test_the_time_to_standstill_counts_from_the_press_to_the_last_motion():
    braking = poses(lambda t: min(t, 0.6))
    told = page_stop.standstill(braking, 100.4, 8)
    assert told.load == 8
    assert told.seconds == pytest.approx(0.2, abs=0.02)
    assert told.world == pytest.approx(0.1, abs=0.01)


def test_an_arm_that_stood_already_when_stop_was_pressed_tells_nothing():
    assert page_stop.standstill(poses(lambda t: min(t, 0.3)), 100.4, 0) is None


def test_the_table_has_a_row_for_each_load():
    told = [StopTime(0, 0.1 + 0.01 * k, 0.1) for k in range(20)] + [StopTime(8, 0.4, 0.2)]
    assert page_stop.table(told) == [
        ["0", "20", "0.200/0.290/0.290", "0.100/0.100/0.100"],
        ["8", "1", "0.400/0.400/0.400", "0.200/0.200/0.200"],
    ]
