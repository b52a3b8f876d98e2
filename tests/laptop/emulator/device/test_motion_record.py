"""What an emulated arm did, sample by sample."""

import pytest

from laptop.emulator.device.motion_record import MotionRecord


@pytest.mark.parametrize("first", range(7))
def test_what_came_since_grows_no_more(first):
    record = MotionRecord(lambda number: 0.5 * number)
    for x in (1, 1, 2, 2, 2, 3):
        record.append((x,), x, 0, None, 0)
    samples = list(record)
    since = record.since(first)
    record.append((9,), 9, 0, None, 1)
    assert list(since) == samples[first:]
    assert len(since) == 6 - first
    assert [since[k] for k in range(len(since))] == samples[first:]
    assert list(record)[:-1] == samples
