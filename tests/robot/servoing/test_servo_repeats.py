"""Pictures that come again with new times: the arm stands within 0.3 s, and the verdict says why.

Each case runs visual_servoing.py as a program on the emulated brick. When a picture could first be
known for a repeated one, and what stood when, is read from the emulated plant.
"""

import math
from functools import partial

import pytest
from servo_rig import Camera

FROZEN = "picture frozen"

WOULD_SHOW = math.radians(1.0)
"""A joint that has turned by more must be seen to have, rad."""
NOTICED, NOTICED_QUIET = 0.35, 0.5
"""From then on until no motor is driven, s: 0.3 and what a busy brick is late; of a camera without
noise once a joint is beyond its play."""
NOTICED_LOOP = {"the last 8 in a loop": 1.2, "the last 30 in a loop": 1.6}
"""The same of a loop: in motion the brick looks at some pictures only, and must come upon one that
it has looked at before, which may take it a round and more: where it looks at every third one of
30, it looks at the same third in each round, or at another; where at every fifth one of 8, at eight
before one comes again."""
COMES_TO_REST = 0.2
"""And until no link turns any more, s."""


def turned_from(w, t):
    """When a link was first WOULD_SHOW from where it truly was at t (s); None: never."""
    there = next(m.q for m in w.moments if m.t >= t)
    for m in w.moments:
        if m.t >= t and max(abs(a - b) for a, b in zip(m.q, there, strict=True)) > WOULD_SHOW:
            return m.t
    return None


def driven_after(w, t):
    """For how long after t (s) some motor was driven."""
    return max([m.t - t for m in w.moments if m.t >= t and m.driven], default=0.0)


def noted(shown, text):
    return any(text in line["text"] for line in shown.log if line["kind"] == "note")


def held_since(w, since, until=math.inf, noticed=NOTICED):
    """Whether the arm was held in time, and stood from then on."""
    moved = turned_from(w, since)
    assert moved is not None, "nothing moved, so nothing was tried"
    during = [m for m in w.moments if moved + noticed < m.t < until]
    assert not any(m.driven for m in during), driven_after(w, moved)
    return w.stands(moved + noticed + COMES_TO_REST, until)


FAULTS = {
    "frozen": lambda pictures: pictures.freeze(),
    "the last 8 in a loop": lambda pictures: pictures.freeze(frames=8),
    "the last 30 in a loop": lambda pictures: pictures.freeze(frames=30),
}


@pytest.mark.short("frozen-stream-0.5", "the last 8 in a loop-look-0.5", "frozen-look-0.0")
@pytest.mark.parametrize("noise", [0.5, 0.0])
@pytest.mark.parametrize("mode", ["look", "stream"])
@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_pictures_that_repeat_in_mid_motion_hold_the_arm(watched, fault, mode, noise):
    w = watched(noise=noise)
    w.in_motion(3.0 if mode == "stream" else 4.0, partial(FAULTS[fault], w.tracker.pictures))
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == FROZEN
    assert "the picture of camera A does not change" in shown.err
    assert noted(shown, FROZEN + ": held")
    noticed = NOTICED_LOOP.get(fault, NOTICED if noise else NOTICED_QUIET)
    assert held_since(w, w.struck, noticed=noticed)
    assert 10 < shown.t - w.struck < 12


@pytest.mark.short("look-0.5")
@pytest.mark.parametrize("noise", [0.5, 0.0])
@pytest.mark.parametrize("mode", ["look", "stream"])
def test_a_picture_that_is_frozen_from_the_start_moves_the_arm_once(watched, mode, noise):
    """A still arm is seen rightly on it: that it repeats is known once a joint has turned."""
    w = watched(noise=noise)
    w.world.at(0.2, w.tracker.pictures.freeze)
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == FROZEN
    assert shown.log[-1]["moves"] == 1
    assert held_since(w, 0.2, noticed=NOTICED if noise else NOTICED_QUIET)


@pytest.mark.short("look")
@pytest.mark.parametrize("mode", ["look", "stream"])
def test_once_the_picture_changes_again_it_goes_on(watched, mode):
    w = watched()

    def strike():
        w.tracker.pictures.freeze()
        w.world.at(w.struck + 3.0, w.tracker.pictures.release)

    w.in_motion(3.0 if mode == "stream" else 4.0, strike)
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    assert held_since(w, w.struck, w.struck + 3.0)
    assert noted(shown, "the picture changes again")


def test_the_laptop_is_told_why_the_arm_is_held(watched):
    w = watched()
    w.in_motion(3.0, w.tracker.pictures.freeze)
    shown = w.run()
    held = [status for status in w.statuses if not status.verdict and status.reason]
    assert {status.reason for status in held} == {FROZEN}
    assert w.statuses[-1].verdict == FROZEN == shown.log[-1]["verdict"]


@pytest.mark.long
def test_the_reports_method_is_held_as_well(watched):
    w = watched()
    w.in_motion(6.0, w.tracker.pictures.freeze)
    shown = w.run("--method", "report")
    assert shown.log[-1]["verdict"] == FROZEN
    assert held_since(w, w.struck)


@pytest.mark.parametrize("times", [2, 3])
def test_pictures_that_are_shown_two_or_three_times_each_lead_to_the_goal(watched, times):
    """As from a camera that promises more pictures a second than it takes."""
    w = watched(tracker={"fps": 60.0})
    w.tracker.pictures.repeat(times)
    shown = w.run("--mode", "stream")
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    assert not noted(shown, FROZEN)


@pytest.mark.short("look")
@pytest.mark.parametrize("mode", ["look", "stream"])
def test_a_camera_without_noise_is_not_taken_for_frozen(watched, mode):
    """It sees a still arm in the same picture time and again, and rightly so."""
    w = watched(noise=0.0)
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    assert not noted(shown, FROZEN)


@pytest.mark.short("B-look")
@pytest.mark.parametrize("mode", ["look", "stream"])
@pytest.mark.parametrize("frozen", ["A", "B"])
def test_a_planar_arm_goes_on_with_the_camera_that_is_not_frozen(watched, frozen, mode):
    w = watched(cameras={"A": Camera(), "B": Camera(roll=-0.4)})
    w.in_motion(3.0, partial(w.tracker.pictures.freeze, frozen))
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 8  # one camera measures its own rows, to 5 px; this is of both
    left = "B" if frozen == "A" else "A"
    assert noted(shown, f"camera {frozen}: {FROZEN}; on with {left}")
