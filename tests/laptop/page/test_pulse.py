"""The pulse: who is heard, and how old what a page has seen may be."""

import asyncio
import math

import pytest

from laptop.page import pulse as pulses
from laptop.page.pulse import Pulse
from laptop.page.rpc import RpcError


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


def made(heard, sent):
    async def hear(browsers):
        heard.append(dict(browsers))

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
    pulse.take_echo("page", 100.0)
    beat(pulse, clock, 1)
    assert heard[1] == {3: 100.0}


def test_what_a_page_has_seen_is_as_old_as_the_beat_that_it_sent_back_last(clock):
    pulse = made([], [])
    pulse.join("page", 1)
    pulse.take_echo("page", 100.0)
    clock[0] = 110.0  # the page's process stood still, and now reads what has waited for it
    assert pulse.age("page") == pytest.approx(10.0)
    pulse.take_echo("page", 109.9)
    assert pulse.age("page") == pytest.approx(0.1)
    pulse.join("page", 1)  # cut off meanwhile: what it had seen before does not count
    assert pulse.age("page") == math.inf


@pytest.mark.parametrize("nonsense", [None, "1", [1], math.nan, math.inf])
def test_an_echo_of_nothing_is_none(clock, nonsense):
    pulse = made([], [])
    pulse.join("page", 1)
    pulse.take_echo("page", nonsense)
    assert pulse.age("page") == math.inf
    pulse.take_echo("page", 1e9)
    assert pulse.age("page") == 0.0, "nothing is from the future"
    pulse.take_echo("a stranger", 100.0)
    assert pulse.age("a stranger") == math.inf


def test_of_two_pages_of_one_browser_the_one_counts_that_was_heard_later(clock):
    heard = []
    pulse = made(heard, [])
    for page, t in (("a", 98.0), ("b", 99.5), ("c", 90.0)):
        pulse.join(page, 1)
        pulse.take_echo(page, t)
    pulse.leave("b")
    beat(pulse, clock, 1)
    assert heard == [{1: 98.0}]


def test_without_an_answer_of_the_tracker_nobody_gets_a_beat(clock):
    sent = []

    async def hear(browsers):
        raise RpcError("KeyError")

    async def send(page, t):
        sent.append(page)

    pulse = Pulse(hear, send)
    pulse.join("page", 1)
    beat(pulse, clock, 3)
    assert sent == []
