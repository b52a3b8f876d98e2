"""What is due when: its order, and what is taken back."""

import math

import pytest

from laptop.emulator.host.agenda import Agenda


@pytest.fixture
def agenda():
    return Agenda()


def taken(agenda):
    """All that is on an agenda, in its order."""
    return [agenda.pop().what for _ in range(len(agenda))]


def test_what_is_due_first_comes_first_and_of_one_time_what_was_added_first(agenda):
    for t, what in ((2.0, "late"), (1.0, "early"), (2.0, "later"), (1.0, "second")):
        agenda.add(t, what)
    assert agenda.first_t == 1.0
    assert taken(agenda) == ["early", "second", "late", "later"]


def test_an_empty_agenda_is_never_due(agenda):
    assert (agenda.first_t, agenda.first, agenda.holds_any()) == (math.inf, None, False)


def test_what_is_taken_back_leaves_its_place(agenda):
    agenda.add(1.0, "first").what = None
    agenda.add(2.0, "second")
    assert (agenda.first_t, agenda.holds_any(), len(agenda)) == (1.0, True, 2)
    agenda.skip_taken_back()
    assert (agenda.first_t, agenda.first.what) == (2.0, "second")


def test_an_agenda_of_what_was_taken_back_holds_nothing(agenda):
    agenda.add(1.0, "only").what = None
    assert (len(agenda), agenda.holds_any()) == (1, False)
    agenda.skip_taken_back()
    assert len(agenda) == 0
