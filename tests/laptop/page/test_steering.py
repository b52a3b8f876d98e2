"""Who steers, and when nobody is heard any more."""

import pytest

from laptop.page.silence import Evidence, PageReport, Presence, Sign
from laptop.page.steering import RELEASE_TIMEOUT, Steering


class World:
    t = 50.0


@pytest.fixture
def world():
    return World()


@pytest.fixture
def steering(world):
    return Steering(lambda: world.t)


def test_who_comes_first_steers_and_others_are_told_who(steering):
    assert steering.claim(1, "Chrome on Linux") == ""
    assert steering.claim(2, "") == "browser 1 (Chrome on Linux) steers; press Take over first"
    assert steering.claim(1, "Chrome on Linux") == ""
    assert steering.driver == 1
    assert (steering.name(1), steering.name(2)) == ("browser 1 (Chrome on Linux)", "browser 2")
    assert steering.name(0) == ""


def test_whoever_takes_over_steers_and_who_did_does_no_longer(steering):
    steering.claim(1, "")
    steering.take_over(2, "Safari on iPhone")
    assert steering.claim(1, "") == "browser 2 (Safari on iPhone) steers; press Take over first"
    assert steering.driver == 2


def test_a_browser_that_is_gone_leaves_the_wheel_to_who_orders_next(steering, world):
    steering.claim(1, "")
    world.t += RELEASE_TIMEOUT - 1
    assert steering.claim(2, "") != ""
    steering.on_status({1: world.t})
    world.t += RELEASE_TIMEOUT - 1
    assert steering.claim(2, "") != "", "it was heard meanwhile"
    world.t += 1
    assert steering.claim(2, "") == ""


def test_the_silence_is_that_of_the_page_that_was_heard_last(steering, world):
    assert steering.silence == 0.0, "nobody steers"
    steering.claim(1, "")
    steering.on_status({1: world.t, 2: world.t - 0.5})
    world.t += 3
    assert steering.silence == pytest.approx(3.0)
    steering.on_status({2: world.t - 0.25})
    assert steering.silence == pytest.approx(0.25), "who watches may stop"
    steering.on_status({2: world.t - 9.0})
    assert steering.silence == pytest.approx(0.25), "what is old makes nothing older"
    assert steering.beats == 3


def test_what_was_heard_before_the_tracker_stood_still_does_not_count_as_heard_now(steering, world):
    steering.claim(1, "")
    heard = {1: world.t}
    world.t += 5  # it waits meanwhile to be taken in
    steering.on_status(heard)
    assert steering.silence == pytest.approx(5.0)


def test_what_was_told_in_the_silence_is_evidence_and_what_was_before_is_none(steering, world):
    steering.claim(1, "Safari")
    steering.on_status({1: world.t}, PageReport({1: Sign(Presence.SHOWN)}, late=3.0))
    world.t += 0.5
    steering.on_status({1: world.t - 0.1, 2: world.t - 0.3}, PageReport(waited=0.4))
    world.t += 1.0
    steering.on_status({}, PageReport({1: Sign(Presence.HIDDEN)}, late=0.6))
    world.t += 0.2
    assert steering.evidence() == Evidence(
        "browser 1 (Safari)",
        Sign(Presence.HIDDEN),
        unbeaten=pytest.approx(0.2),
        late=0.6,
        waited=0.4,
    )


def test_while_nobody_was_there_there_is_no_evidence_of_a_browser(steering):
    assert steering.evidence() == Evidence()
