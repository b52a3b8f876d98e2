"""The pulse: who is heard, and how old what a page has seen may be."""

import asyncio
import math

import pytest

from laptop.page import pulse as pulses
from laptop.page.pulse import MAX_TABS, Pulse
from laptop.page.rpc import RpcError
from laptop.page.silence import Presence, Sign


class Enough(Exception):
    """The test has seen what it wants."""


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(pulses.time, "monotonic", lambda: now[0])
    return now


def beat(pulse, clock, rounds, answer=lambda page, t: None, wait=pulses.BEAT_PERIOD):
    """Let it beat so many times; each page answers as told."""

    async def sleep(seconds):
        nonlocal rounds
        rounds -= 1
        clock[0] += wait
        if not rounds:
            raise Enough

    async def run():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pulses.asyncio, "sleep", sleep)
            await pulse.run()

    with pytest.raises(Enough):
        asyncio.run(run())


def made(heard, sent, reports=None):
    async def hear(browsers, report):
        heard.append(dict(browsers))
        if reports is not None:
            reports.append(report)

    async def send(page, t):
        sent.append((page, t))

    return Pulse(hear, send)


def test_a_page_is_heard_once_it_has_sent_a_beat_back(clock):
    heard, sent = [], []
    pulse = made(heard, sent)
    pulse.join("page", 3)
    assert pulse.age("page") == math.inf
    beat(pulse, clock, 1)
    assert (heard, sent) == ([{}], [("page", 100.0)])
    pulse.on_echo("page", 100.0)
    beat(pulse, clock, 1)
    assert heard[1] == {3: 100.0}


def test_what_a_page_has_seen_is_as_old_as_the_beat_that_it_sent_back_last(clock):
    pulse = made([], [])
    pulse.join("page", 1)
    pulse.on_echo("page", 100.0)
    clock[0] = 110.0  # the page's process stood still, and now reads what has waited for it
    assert pulse.age("page") == pytest.approx(10.0)
    pulse.on_echo("page", 109.9)
    assert pulse.age("page") == pytest.approx(0.1)
    pulse.join("page", 1)  # cut off meanwhile: what it had seen before does not count
    assert pulse.age("page") == math.inf


@pytest.mark.parametrize("nonsense", [None, "1", [1], math.nan, math.inf])
def test_an_echo_of_nothing_is_none(clock, nonsense):
    pulse = made([], [])
    pulse.join("page", 1)
    pulse.on_echo("page", nonsense)
    assert pulse.age("page") == math.inf
    pulse.on_echo("page", 1e9)
    assert pulse.age("page") == 0.0, "nothing is from the future"
    pulse.on_echo("a stranger", 100.0)
    assert pulse.age("a stranger") == math.inf


def test_of_two_pages_of_one_browser_the_one_counts_that_was_heard_later(clock):
    heard = []
    pulse = made(heard, [])
    for page, t in (("a", 98.0), ("b", 99.5), ("c", 90.0)):
        pulse.join(page, 1)
        pulse.on_echo(page, t)
    pulse.leave("b")
    beat(pulse, clock, 1)
    assert heard == [{1: 98.0}]


def test_without_an_answer_of_the_tracker_nobody_gets_a_beat(clock):
    sent = []

    async def hear(browsers, report):
        raise RpcError("KeyError")

    async def send(page, t):
        sent.append(page)

    pulse = Pulse(hear, send)
    pulse.join("page", 1)
    beat(pulse, clock, 3)
    assert sent == []


def presence(pulse, browser=1):
    return pulse.signs()[browser].presence


def test_what_a_page_said_last_is_known_after_it_has_gone():
    pulse = made([], [])
    pulse.join("page", 1, is_local=True)
    assert pulse.signs() == {1: Sign(Presence.SHOWN, True)}
    pulse.on_presence("page", 1, "hidden")
    assert presence(pulse) is Presence.HIDDEN
    pulse.on_presence("page", 1, "visible")
    pulse.leave("page")
    assert presence(pulse) is Presence.BROKEN
    pulse.on_presence("page", 1, "closed")  # which came by another way, and later
    assert presence(pulse) is Presence.CLOSED
    pulse.on_presence("page", 1, "hidden")  # as it closed
    assert presence(pulse) is Presence.CLOSED
    pulse.join("page 2", 1)
    assert presence(pulse) is Presence.CLOSED, "the next one loads, and was not heard yet"
    pulse.on_echo("page 2", 100.0)
    assert presence(pulse) is Presence.SHOWN, "it was only loaded anew"
    pulse.on_presence("page 2", 1, "asleep")
    pulse.leave("page 2")
    assert presence(pulse) is Presence.ASLEEP
    pulse.join("page 2", 1)
    assert presence(pulse) is Presence.SHOWN


def test_of_a_browser_s_pages_the_one_counts_that_is_most_present():
    pulse = made([], [])
    pulse.join("a", 1)
    pulse.join("b", 1)
    pulse.on_presence("a", 1, "closed")
    assert presence(pulse) is Presence.SHOWN
    pulse.on_presence("b", 1, "hidden")
    assert presence(pulse) is Presence.HIDDEN
    pulse.join("a", 1)  # back from where browsers keep pages that were left
    pulse.on_echo("a", 100.0)
    assert presence(pulse) is Presence.SHOWN


@pytest.mark.parametrize(
    ("page", "sender", "word"),
    [("page", 2, "closed"), ("stranger", 1, "closed"), ("page", 1, "nonsense"), ("", 0, "")],
)
def test_a_word_of_nobody_or_of_another_browser_is_none(page, sender, word):
    pulse = made([], [])
    pulse.join("page", 1)
    pulse.on_presence(page, sender, word)
    assert pulse.signs() == {1: Sign(Presence.SHOWN)}


def test_pages_that_have_gone_are_forgotten_at_last():
    pulse = made([], [])
    for number in range(3 * MAX_TABS):
        pulse.join(f"page {number}", number)
        pulse.leave(f"page {number}")
    assert len(pulse.signs()) <= MAX_TABS + 1
    assert 3 * MAX_TABS - 1 in pulse.signs()


def test_how_late_it_was_and_how_long_it_waited_is_told_with_the_next_beat(clock):
    reports = []
    pulse = made([], [], reports)
    beat(pulse, clock, 1, wait=pulses.BEAT_PERIOD)
    beat(pulse, clock, 2, wait=pulses.BEAT_PERIOD + 1.5)
    assert [report.late for report in reports] == [0.0, 0.0, pytest.approx(1.5)]

    async def slow(browsers, report):
        reports.append(report)
        clock[0] += 0.8

    reports.clear()
    beat(Pulse(slow, lambda page, t: None), clock, 2)
    assert [report.waited for report in reports] == [0.0, pytest.approx(0.8)]
    assert reports[1].late == pytest.approx(0.0)
