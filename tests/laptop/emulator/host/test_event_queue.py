"""The order of events, and those that are cancelled."""

import math

import pytest

from laptop.emulator.host.event_queue import EventQueue


@pytest.fixture
def queue():
    return EventQueue()


def taken(queue):
    """All that is in a queue, in its order."""
    return [queue.pop().what for _ in range(len(queue))]


def test_what_is_due_first_comes_first_and_of_one_time_what_was_added_first(queue):
    for t, what in ((2.0, "late"), (1.0, "early"), (2.0, "later"), (1.0, "second")):
        queue.add(t, what)
    assert queue.first_t == 1.0
    assert taken(queue) == ["early", "second", "late", "later"]


def test_an_empty_queue_is_never_due(queue):
    assert (queue.first_t, queue.first, queue.has_pending()) == (math.inf, None, False)


def test_what_is_cancelled_leaves_its_place(queue):
    queue.add(1.0, "first").what = None
    queue.add(2.0, "second")
    assert (queue.first_t, queue.has_pending(), len(queue)) == (1.0, True, 2)
    queue.drop_cancelled()
    assert (queue.first_t, queue.first.what) == (2.0, "second")


def test_a_queue_of_cancelled_events_has_none_pending(queue):
    queue.add(1.0, "only").what = None
    assert (len(queue), queue.has_pending()) == (1, False)
    queue.drop_cancelled()
    assert len(queue) == 0
