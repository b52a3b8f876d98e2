"""A world among those of a paced clock: its time, and that the others wait for it."""

import time

import pytest

from laptop.emulator.host.pacer import Pacer
from laptop.emulator.pace import PacedClock


@pytest.fixture
def clock(tmp_path):
    clock = PacedClock(str(tmp_path))
    yield clock
    clock.close()


def test_its_time_goes_on_from_when_it_joined(clock):
    pacer = Pacer(clock)
    pacer.join(5.0, "a brick")
    pacer.promise(100.0)
    assert 5.0 <= pacer.now() < 50.0
    assert pacer.reached(5.0)
    assert not pacer.reached(90.0)
    pacer.leave()


def test_the_clock_waits_for_it_as_long_as_it_has_joined(clock):
    pacer = Pacer(clock)
    assert not pacer.joined
    pacer.join(0.0, "a brick")
    other = clock.join("another")
    other.promise(clock.now() + 1e3)
    assert pacer.joined
    stands = pacer.now()
    time.sleep(0.02)
    assert pacer.now() == stands
    pacer.leave()
    clock.sleep_until(pacer.zero + stands + 0.01)
    assert not pacer.joined
    other.leave()


def test_who_has_not_joined_promises_nothing(clock):
    pacer = Pacer(clock)
    pacer.promise(-1e9)
    before = clock.now()
    clock.sleep_until(before + 0.01)
    pacer.leave()
