"""Exploring while going: all joints in one motion, which goes on to the goal."""

import math

import pytest
from servo_rig import Camera

from robot.servoing.exploration import EXPLORING_STEP
from robot.servoing.runs import make_servo
from robot.servoing.sightings import MarkerFrame
from robot.servoing.stream import Stream
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
START = 0.2, 0.9


def above(q):
    """A camera from above, px."""
    x = sum(j.link * math.cos(a) for j, a in zip(ARM.joints, (q[0], q[0] + q[1])))
    y = sum(j.link * math.sin(a) for j, a in zip(ARM.joints, (q[0], q[0] + q[1])))
    return 300 + 9 * x + 4 * y, 400 + 4 * x - 8 * y


class MirroredCamera(Camera):
    """A camera whose driver shows people a mirror."""

    def pixel(self, p):
        u, v = super().pixel(p)
        return 640 - u, v


@pytest.fixture
def exploring():
    """(servo, stream, goal) of a run that begins to explore."""
    servo, stream = make_servo(ARM, "chain", "stream", 5.0)
    goal = above((0.8, 0.4))
    frames = {"A": [(0.03 * k, above(START), goal) for k in range(6)]}
    decision = servo.decide(START, servo.estimator.measurements(frames))
    assert decision.action == "explore"
    stream.begin(decision.q, None, START)
    return servo, stream, decision.q, goal


def test_every_joint_goes_inward_one_after_the_other(exploring):
    _, stream, inward, _ = exploring
    for a, b, joint in zip(START, inward, ARM.joints):
        assert abs(b - a) == pytest.approx(EXPLORING_STEP)
        middle = (joint.lower + joint.upper) / 2
        assert abs(b - middle) < abs(a - middle)
    assert list(stream.aim(5.0, START)) == [inward[0], START[1]]
    assert list(stream.aim(5.0 + 0.9 * Stream.EXPLORING_DELAY, START)) == [inward[0], START[1]]
    assert list(stream.aim(5.0 + 1.1 * Stream.EXPLORING_DELAY, START)) == list(inward)


def seen_at(servo, stream, t, q, goal):
    """A frame at q, learned and aimed by."""
    frame = MarkerFrame("A", t, tuple(q), above(q), goal)
    stream.see(frame, None)
    for _ in servo.learn_shape("A", q, above(q)):
        pass
    for _ in stream.reaim():
        pass


def test_the_aim_follows_as_soon_as_each_joint_was_seen_to_move(exploring):
    servo, stream, _, goal = exploring
    stream.aim(0.0, START)
    least = Stream.MIN_EXPLORED
    for k, (first, second) in enumerate([(0, 0), (0.5, 0), (1.1, 0), (1.5, 0.4), (1.8, 0.9)]):
        q = START[0] - least * first, START[1] - least * second
        seen_at(servo, stream, 0.1 * k, q, goal)
        assert stream.aim(0.1 * k, q) != pytest.approx((0.8, 0.4), abs=0.3)
    q = START[0] - 2 * least, START[1] - 1.1 * least
    seen_at(servo, stream, 0.6, q, goal)
    seen_at(servo, stream, 0.7, q, goal)
    assert stream.aim(0.7, q) == pytest.approx((0.8, 0.4), abs=0.1)


def test_an_aim_is_late_by_the_frame_that_it_goes_by(exploring):
    servo, stream, _, goal = exploring
    assert not stream.is_late(0.0)
    assert not stream.is_late(0.99 * Stream.AIM_MAX_AGE)
    assert stream.is_late(1.01 * Stream.AIM_MAX_AGE)
    for k in range(3):
        q = [a - k * 1.1 * Stream.MIN_EXPLORED for a in START]
        seen_at(servo, stream, 1.0 + 0.1 * k, q, goal)
    assert not stream.is_late(1.1 + Stream.AIM_MAX_AGE)
    assert stream.is_late(1.3 + Stream.AIM_MAX_AGE)


def test_only_a_servo_that_is_steered_explores_in_motion():
    assert make_servo(ARM, "chain", "stream", 5.0)[0].explores_in_motion
    assert not make_servo(ARM, "chain", "look", 5.0)[0].explores_in_motion
    assert not make_servo(ARM, "kalman", "stream", 5.0)[0].explores_in_motion
    servo, stream = make_servo(ARM, "chain", "stream", 5.0)
    stream.give_up()
    assert not servo.explores_in_motion


@pytest.mark.parametrize("mode", ["look", "stream"])
def test_a_mirrored_picture_leads_to_the_goal_too(watched, mode):
    w = watched(cameras={"A": MirroredCamera()})
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 7


@pytest.mark.parametrize("seed", range(6))
def test_in_a_chase_a_marker_that_no_joint_moves_is_told(watched, seed):
    w = watched()
    w.loosen(seed)
    shown = w.run("--mode", "stream")
    assert shown.log[-1]["verdict"] == "singular"
    assert "not on the tip" in shown.err
    assert w.stands(shown.t + 0.5)


def test_what_lies_at_the_goal_and_is_taken_for_the_tip_is_found_out(watched):
    """In the midst of the exploring chase the tracker takes the goal's place for the tip's."""
    w = watched()
    see = w.tracker.see

    def deceived(*frame):
        seen = see(*frame)
        if w.moved() and seen and seen.get("goal"):
            u, v, _ = seen["goal"]
            seen = dict(seen, effector=(u + 1, v + 1, 1.0))
        return seen

    w.in_motion(0.5, lambda: setattr(w.tracker, "see", deceived), 0)
    shown = w.run("--mode", "stream")
    assert shown.log[-1]["verdict"] == "singular"
