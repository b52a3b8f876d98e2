"""A run of a program: whom it wakes when, and how it ends; without a world."""

import pytest

from laptop.emulator.host.event_queue import EventQueue
from laptop.emulator.host.process_exit import ENDLESS, ProcessExit
from laptop.emulator.host.virtual_thread import VirtualThread
from laptop.emulator.host.world_run import WorldRun


@pytest.fixture
def run():
    return WorldRun(limit=10.0)


@pytest.fixture
def threads(run):
    """Two threads of the run, which have not begun."""
    run.alive += [VirtualThread(name, run) for name in ("a", "b")]
    return run.alive


def test_threads_are_woken_by_time_and_each_once(run, threads):
    a, b = threads
    run.wake_at(a, 2.0)
    run.wake_at(b, 1.0)
    assert [run.pop_due(t) for t in (0.5, 1.5, 1.5, 2.0, 3.0)] == [None, b, None, a, None]
    assert (a.entry, b.entry) == (None, None)


def test_a_later_arrangement_takes_the_place_of_an_earlier_one(run, threads):
    a, b = threads
    run.wake_at(a, 1.0)
    run.wake_at(a, 5.0)
    run.wake_at(b, 1.0)
    run.wake_at(b, None)
    assert run.pop_due(4.0) is None
    assert run.pop_due(5.0) is a


def test_the_first_end_stands(run):
    run.end(ProcessExit(3, "ended"))
    run.end(ProcessExit(ENDLESS, "timeout"))
    assert run.exit == ProcessExit(3, "ended")
    assert run.over.is_set()


def test_time_goes_on_for_sleepers_and_for_whom_an_event_may_wake(run, threads):
    a, b = threads
    events = EventQueue()
    assert not run.is_awaited(events)
    event = events.add(1.0, print)
    assert run.is_awaited(events)
    run.detach(b)
    assert not run.is_awaited(events, holder=a)
    run.reattach(b)
    event.what = None
    assert not run.is_awaited(events)
    run.wake_at(b, 1.0)
    assert run.is_awaited(events)
