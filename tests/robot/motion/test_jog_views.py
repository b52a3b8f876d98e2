"""What the places of two markers tell of a jog, by numbers worked out by hand.

The picture has 10 px/cm, y upwards; the planar arm's links are 11.3 and 9.5 cm.
"""

import cmath
import math

import pytest
from refusals import refused
from rig import described

from robot.motion import jog_views, mounting
from robot.motion.jog_views import Jog, NotSeen, View, check_size, lever, place, recognised
from robot.motion.mounting import NotMounted, Observed

TIP, ELBOW, LEFT, DOUBT = 208 + 0j, 113 + 0j, 80j, 0.5
"""Tip and elbow of the stretched arm, the marker 8 cm to the left of its axle, px."""

TURN = math.radians(8)


def turned(about, degrees, tip=TIP):
    """The tip, px, turned about a point of the picture by an angle, deg."""
    return about + (tip - about) * cmath.rect(1.0, math.radians(degrees))


def jog(about, degrees, base=LEFT, turn=TURN, mirrored=False, came_by=None):
    """The Jog of a motor that turns by `turn`, as its joint would, and the tip by so many deg."""
    there = turned(about, degrees)
    back = TIP if came_by is None else turned(about, degrees - came_by)
    flip = complex.conjugate if mirrored else complex
    return Jog(*[View(flip(tip), flip(base), DOUBT) for tip in (TIP, there, back)] + [-turn])


def arm(name="planar", gears=(1, 1)):
    """An arm without play."""
    one = described(name, backlash=0)
    joints = [j._replace(gear=float(gear)) for j, gear in zip(one.joints, gears)]
    return one._replace(joints=tuple(joints))


def test_a_place_points_upwards():
    assert place((3, 4)) == 3 - 4j


@pytest.mark.parametrize(("side", "sign"), [(60, 1), (-60, -1)])
def test_a_lever_is_that_of_the_chord_over_the_way_to_its_middle(side, sign):
    # An equilateral triangle: the chord's middle is cos(30 deg) of the way to its ends.
    views = [
        View(100 + 0j, 0j, DOUBT),
        View(turned(0, side, 100), 0j, DOUBT),
        View(100, 0j, DOUBT),
    ]
    found = lever(Jog(*views + [-math.radians(60)]), 0.0)
    assert found == pytest.approx(sign * 2 / math.sqrt(3))


def test_play_is_taken_from_the_way_back():
    # The motor comes back by 8 deg, of which 2 are play: the tip by 6.
    found = lever(jog(0, 7, base=0j, came_by=6), math.radians(2))
    assert found == pytest.approx(1.0, abs=0.002)  # 1 / cos(3 deg)


def test_the_marker_on_the_left_turns_the_lever_to_the_left():
    # atan(8 / 20.8) = 21 deg, and cos(21 deg) = 0.933
    found = lever(jog(0, 8), 0.0)
    assert math.degrees(cmath.phase(found)) == pytest.approx(21.0, abs=1.5)
    assert abs(found) == pytest.approx(0.933, abs=0.03)
    assert lever(jog(0, 8, mirrored=True), 0.0) == pytest.approx(-found.conjugate())


def test_no_motion_is_no_lever():
    assert lever(jog(0, 0.1), 0.0) is None  # 0.36 px, and 1 px may be chance


@pytest.mark.parametrize(
    ("moved", "gears", "says"),
    [
        ([(0j, 8), (ELBOW, 8)], (1, 1), [("shoulder", True), ("elbow", True)]),
        ([(0j, -8), (ELBOW, 8)], (1, 1), [("shoulder", False), ("elbow", True)]),
        ([(0j, 8), (ELBOW, -8)], (1, 1), [("shoulder", True), ("elbow", False)]),
        ([(0j, -8), (ELBOW, -8)], (1, 1), [("shoulder", False), ("elbow", False)]),
        ([(ELBOW, 8), (0j, 8)], (1, 1), [("elbow", True), ("shoulder", True)]),
        ([(ELBOW, -8), (0j, 8)], (1, 1), [("elbow", False), ("shoulder", True)]),
        # Behind 3:1 and 1:1 what is turned as a shoulder by 8 deg would turn an elbow by 24.
        ([(0j, 8), (ELBOW, 8)], (3, 1), [("shoulder", True), ("elbow", True)]),
        ([(ELBOW, 24), (0j, 8 / 3)], (3, 1), [("elbow", True), ("shoulder", True)]),
        ([(ELBOW, 8 / 3), (0j, -24)], (1, 3), [("elbow", True), ("shoulder", False)]),
    ],
)
def test_size_and_sense_tell_which_and_which_way(moved, gears, says):
    jogs = [jog(about, degrees) for about, degrees in moved]
    assert recognised(arm(gears=gears), jogs) == ([Observed(*one) for one in says], "")


def test_gears_that_make_both_motors_look_alike_are_left_to_a_person():
    # 20.8 / 9.5 = 2.19: swapped, the motors would move the tip as they do where they belong.
    seen, why = recognised(arm(gears=(2.19, 1)), [jog(0j, 8), jog(ELBOW, 8)])
    assert seen == [None, None]
    assert "2.19 times as they are, and 2.19 times swapped" in why
    assert "cannot tell" in why


def test_motions_in_between_are_left_to_a_person():
    # 0.457 * 17 deg is 0.97 of what the shoulder does by 8.
    seen, why = recognised(arm(), [jog(0j, 8), jog(ELBOW, 17)])
    assert seen == [None, None]
    assert "1.0" in why


def test_motions_that_fit_in_no_order_are_left_to_a_person():
    # 8 deg of 20.8 cm are 5.8 times 3 deg of 9.5 cm, or 5.96 as seen from the marker.
    seen, why = recognised(arm(), [jog(0j, 8), jog(ELBOW, 3)])
    assert seen == [None, None]
    assert "5.96 times" in why


@pytest.mark.parametrize(
    ("base", "mirrored", "message"),
    [
        (LEFT, True, ["right of the arm", "mirrored"]),
        (-LEFT, False, ["right of the arm", "the marker lies there"]),
        (20j, False, ["in one line"]),  # atan(2 / 20.8) = 5.5 deg
        (TIP + 300j, False, ["aside of the way round"]),
        (110 + 40j, False, ["2.2 times as far"]),  # 20.8 / 9.8
    ],
)
def test_a_marker_that_does_not_lie_on_the_left_is_refused(base, mirrored, message):
    jogs = [jog(0j, 8, base, mirrored=mirrored), jog(ELBOW, 8, base, mirrored=mirrored)]
    with pytest.raises(NotSeen) as error:
        recognised(arm(), jogs)
    assert refused(error, *message)


def test_one_that_moves_nothing_is_named_and_all_of_them_are_the_markers_fault():
    with pytest.raises(NotMounted) as error:
        recognised(arm(), [jog(0j, 8), jog(ELBOW, 0)])
    assert refused(error, "port B turned, and nothing moved")
    with pytest.raises(NotSeen) as error:
        recognised(arm(), [jog(0j, 0), jog(ELBOW, 0)])
    assert refused(error, "marker effector stood")


def test_what_moves_nothing_may_be_a_pen_of_the_same_kind_and_is_asked():
    one = arm()
    seen, why = recognised(
        one._replace(pen=one.pen._replace(motor="large")), [jog(0j, 0), jog(ELBOW, 8)]
    )
    assert seen == [None, None]
    assert "when the motor at port A turned: it may be the pen's" in why


def test_a_tip_that_does_not_come_back_is_told():
    # 8 deg of 208 px are 29 px; 3 deg 11 px.
    with pytest.raises(NotSeen) as error:
        recognised(arm(), [jog(0j, 8, came_by=3), jog(ELBOW, 8)])
    assert refused(error, "port A the tip went by 29 px and came back by 11", "slips")


def test_a_pose_that_bends_the_ways_apart_is_told():
    with pytest.raises(NotSeen) as error:
        recognised(arm(), [jog(0j, 8), jog(TIP - 95j, 8)])
    assert refused(error, "deg apart", "lay the arm straight")


# In space


def upright(along):
    """A Jog that moves the tip by so much along its own upright plane, px."""
    views = [View(TIP, LEFT, DOUBT), View(TIP + along, LEFT, DOUBT), View(TIP, LEFT, DOUBT)]
    return Jog(*views + [-TURN])


@pytest.mark.parametrize("place_of_base", [0, 1, 2])
@pytest.mark.parametrize("direction", [1, -1])
def test_in_space_what_goes_round_is_the_base(place_of_base, direction):
    one = arm("spatial", (4, 4, 4))
    jogs = [upright(-12), upright(20)]
    jogs.insert(place_of_base, jog(0j, 8 * direction))
    seen, why = recognised(one, jogs)
    wanted = [None, None, None]
    wanted[place_of_base] = Observed("base", direction > 0)
    assert seen == wanted
    assert "shoulder and elbow move the tip in one upright plane" in why


def test_in_space_the_base_is_known_behind_another_gear():
    # What turned a joint behind 2:1 by 8 deg turns the base behind 8:1 by 2.
    seen, _ = recognised(arm("spatial", (8, 2, 2)), [upright(-3), jog(0j, 2), upright(20)])
    assert seen == [None, Observed("base", True), None]


def test_in_space_no_base_or_two_are_left_to_a_person():
    one = arm("spatial", (4, 4, 4))
    seen, why = recognised(one, [upright(-12), upright(20), upright(8)])
    assert seen == [None] * 3
    assert "none of the motors" in why
    seen, why = recognised(one, [jog(0j, 8), jog(0j, 8), upright(8)])
    assert seen == [None] * 3
    assert "2 motors" in why


def test_in_space_a_mirrored_picture_is_told():
    jogs = [jog(0j, 8, mirrored=True), upright(-12), upright(20)]
    with pytest.raises(NotSeen) as error:
        recognised(arm("spatial", (4, 4, 4)), jogs)
    assert refused(error, "mirrored")


# Before anything moves


def test_a_picture_is_large_enough_where_the_least_jog_is_clear_of_the_noise():
    # 8 deg of 9.5 of 20.8 cm are 0.0638 of the way between the markers; 3 * 2 * 0.5 px are needed.
    one = arm()
    check_size(one, View(48 + 0j, 0j, DOUBT))
    with pytest.raises(NotSeen) as error:
        check_size(one, View(46 + 0j, 0j, DOUBT))
    assert refused(error, "46 px apart", "elbow would move the tip by 2.9 px, and 3.0 are needed")


def test_play_that_takes_the_whole_jog_is_told():
    with pytest.raises(NotSeen) as error:
        check_size(described("planar", backlash=7), View(TIP, LEFT, DOUBT))
    assert refused(error, "backlash = 7", "without --camera")


def test_a_marker_beside_the_arm_that_moves_too_is_told():
    views = [View(TIP, LEFT, DOUBT), View(TIP + 20j, LEFT + 9, DOUBT), View(TIP, LEFT, DOUBT)]
    with pytest.raises(NotSeen) as error:
        jog_views.has_moved(Jog(*views + [-TURN]))
    assert refused(error, "marker goal moved by 9.0 px", "were touched")
    views = [View(TIP, LEFT, DOUBT), View(TIP, LEFT + 9, DOUBT), View(TIP, LEFT, DOUBT)]
    with pytest.raises(NotSeen) as error:
        jog_views.has_moved(Jog(*views + [-TURN]))
    assert refused(error, "exchanged")


def test_a_motor_of_the_pen_at_a_joints_port_is_named():
    one = arm()
    with pytest.raises(NotMounted) as error:
        mounting.as_mounted(one, [Observed(mounting.PEN, True), Observed("elbow", True)])
    assert refused(error, "port A moves the pen", "port C", "exchange their cables")
