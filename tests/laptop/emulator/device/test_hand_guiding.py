"""A hand leads the arm: where it says, when it says, and only where the motors coast."""

import math

import numpy as np
import pytest

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.hand_guiding import BadHand, read_hand
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.host.world import World
from shared.arm_description import find_arm, read_arm

PLANAR, GEARED, SPATIAL = (read_arm(find_arm(name)) for name in ("planar", "geared", "spatial"))


def led(text, arm=PLANAR, plant=""):
    """A brick whose arm a hand leads."""
    brick = EmulatedBrick(World(), arm, read_plant(plant))
    brick.guide(read_hand(text))
    return brick


def at(brick, t):
    """The tip at the time t, s."""
    brick.advance(t)
    return brick.plant.tip()[:2]


@pytest.mark.parametrize("arm", [PLANAR, GEARED], ids=["planar", "geared"])
def test_the_tip_is_at_each_place_in_time_and_stays(arm):
    brick = led("10,5@2 12,-3@4", arm)
    assert at(brick, 2.0) == pytest.approx((10, 5), abs=0.01)
    assert at(brick, 2.5) == pytest.approx((10, 5), abs=0.01)
    assert at(brick, 4.0) == pytest.approx((12, -3), abs=0.01)
    assert at(brick, 9.0) == pytest.approx((12, -3), abs=0.01)


@pytest.mark.parametrize("arm", [PLANAR, GEARED], ids=["planar", "geared"])
def test_the_encoders_follow_through_gears_to_half_of_the_play(arm):
    brick = led("10,5@2 12,-3@4 8,8@6", arm)
    before = np.array(brick.plant.q)
    for t in (2.5, 4.5, 7.0):
        brick.advance(t)
        turned = np.array(brick.plant.q) - before
        counts = np.array([brick.motors[joint.port].position for joint in arm.joints])
        ratio = np.array([joint.gear * joint.direction for joint in arm.joints])
        half = np.array([joint.backlash / 2 for joint in arm.joints])
        off = np.radians(counts) / ratio - turned
        assert (abs(off) <= half + np.radians(1.0) / abs(ratio)).all()
        assert abs(counts).max() > 30, "they do follow"


def test_within_its_play_a_link_turns_and_its_encoder_does_not():
    brick = led("20.798,0.05@2", plant="backlash=4")
    brick.advance(3.0)
    assert [brick.motors[port].position for port in "AB"] == [0, 0]
    assert math.hypot(*brick.plant.q) > math.radians(0.5)


def test_motors_that_hold_are_left_alone_and_followed_later():
    brick = led("10,5@2")
    for port in "AB":
        brick.motors[port].write("stop_action", "hold")
        brick.motors[port].write("command", "stop")
    assert at(brick, 3.0) == pytest.approx((20.8, 0), abs=0.1)
    for port in "AB":
        brick.motors[port].write("stop_action", "coast")
        brick.motors[port].write("command", "stop")
    assert at(brick, 4.5) == pytest.approx((10, 5), abs=0.01)


def test_a_jammed_link_stays_jammed():
    brick = led("10,5@2")
    brick.jam("B")
    brick.advance(3.0)
    assert brick.plant.q[1] == 0
    assert brick.plant.q[0] != 0


def test_the_same_hand_gives_the_same_run():
    first, second = (led("10,5@2 12,-3@4", plant="seed=3") for _ in range(2))
    first.advance(5.0)
    second.advance(5.0)
    assert first.record == second.record


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no place; write X,Y@SECONDS"),
        ("10,5", "hand '10,5': write X,Y@SECONDS"),
        ("10@3", "hand '10@3': write X,Y@SECONDS"),
        ("a,b@3", "write X,Y@SECONDS"),
        ("nan,1@3", "write X,Y@SECONDS"),
        ("10,5@inf", "write X,Y@SECONDS"),
        ("10,5@3 12,0@3", "its time must be above 3"),
        ("10,5@-1", "its time must be above 0"),
        ("10,5@2e6", "up to 1e+06 s"),
    ],
)
def test_what_is_no_way_is_refused(text, message):
    with pytest.raises(BadHand) as problem:
        read_hand(text)
    assert message in str(problem.value)


@pytest.mark.parametrize(
    ("text", "arm", "message"),
    [
        ("30,5@3", PLANAR, "hand 30,5@3: .*the links reach"),
        ("10,5@0.2", PLANAR, "hand 10,5@0.2: it cannot be there before 1"),
        ("10,5@3", SPATIAL, "spatial is in space"),
    ],
)
def test_where_it_cannot_lead_it_says_so(text, arm, message):
    with pytest.raises(BadHand, match=message):
        led(text, arm)


def test_a_brick_without_an_arm_has_none_to_lead():
    brick = EmulatedBrick(World(), None, read_plant(""))
    with pytest.raises(BadHand, match="leave --hand out"):
        brick.guide(read_hand("10,5@2"))
