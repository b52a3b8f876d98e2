"""The record of a run: all samples, though of an arm that stands only one is kept."""

import random

import pytest

from laptop.emulator.device.motion_record import MotionRecord, MotionSample


def time_of(number):
    return number * 0.005


@pytest.fixture(params=[1, 2, 3])
def both(request):
    """A record, and the same samples as a list."""
    rng = random.Random(request.param)
    record, samples, place = MotionRecord(time_of), [], ((0.0, 0.0), 1.0, 2.0, None, 0)
    for number in range(300):
        if rng.random() < 0.2:
            place = ((rng.choice([0.0, 1.0]), 0.0), 1.0, 2.0, None, rng.choice([0, 1]))
        record.append(*place)
        samples.append(MotionSample(time_of(number), *place))
    return record, samples


def test_it_reads_as_a_list_of_samples(both):
    record, samples = both
    assert list(record) == samples
    assert len(record) == len(samples)
    assert [record[k] for k in range(-300, 300)] == samples + samples
    for part in (slice(None), slice(7, 90), slice(-5, None), slice(None, None, 8), slice(9, 3)):
        assert record[part] == samples[part]
    assert record[200:20:-3] == samples[200:20:-3]
    for beyond in (300, -301):
        with pytest.raises(IndexError, match="there are 300 samples"):
            record[beyond]


def test_two_are_the_same_where_all_samples_are(both):
    record, samples = both
    other = MotionRecord(time_of)
    for sample in samples:
        assert record != other
        other.append(*sample[1:])
    assert record == other


def test_of_an_arm_that_stands_no_more_is_kept():
    record = MotionRecord(time_of)
    for _ in range(100_000):
        record.append((0.1, 0.2), 1.0, 2.0, None, 0)
    assert len(record) == 100_000
    assert record[-1] == (pytest.approx(499.995), (0.1, 0.2), 1.0, 2.0, None, 0)
    assert len(record._places) == len(record._begins) == 1
