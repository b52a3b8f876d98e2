"""Stall detection by missing counts: who does not turn is noticed, who is stiff is let be."""

import math

import pytest
from plain_motor import TICK, Motor, steady, swing

from robot.motion.joint_controller import GAINS, LEAD, JointController
from robot.motion.motor_model import MotorModel, StallDetector


def drive(motor, path, seconds, dies_at=math.inf, jams_at=math.inf):
    """Control at 50 Hz; (time at which it is stalled or None, greatest speed since, deg/s)."""
    controller = JointController(1.0, GAINS["large"])
    shown, fastest = None, 0.0
    for k in range(int(seconds / TICK)):
        t = k * TICK
        if t < dies_at or shown is None:
            shown = motor.bounds()
        controller.observe(t, *[math.radians(angle) for angle in shown])
        if controller.stall.stalled:
            return t, fastest
        ahead, sooner = path(t + LEAD), path(t + LEAD - TICK)
        error = math.radians(path(t)[0]) - controller.angle
        acceleration = math.radians(ahead[1] - sooner[1]) / TICK
        w = math.degrees(controller.command(error, math.radians(ahead[1]), acceleration))
        if t < jams_at:
            # The driver sees no speed, either, once its encoder is dead.
            seen = motor.speed if t >= dies_at else 0.0
            motor.run(w + seen, TICK)
        if t >= dies_at:
            fastest = max(fastest, abs(motor.speed))
    return None, fastest


@pytest.mark.parametrize("friction", [2.0, 6.7, 10.0])
@pytest.mark.parametrize("speed", [8, 30, -60, 150])
def test_a_dead_encoder_is_noticed_soon_after_two_counts_are_missing(friction, speed):
    t, fastest = drive(Motor(friction), steady(speed), 5.0, dies_at=2.0)
    assert 2.0 < t < 2.0 + 3 / abs(speed) + 0.22
    assert fastest < abs(speed) + 80


@pytest.mark.parametrize("speed", [8, 30, -60, 150])
def test_a_joint_that_is_blocked_in_motion_is_noticed_as_soon(speed):
    t, _ = drive(Motor(6.7), steady(speed), 5.0, jams_at=2.0)
    assert 2.0 < t < 2.0 + 3 / abs(speed) + 0.22


def test_an_encoder_that_is_dead_from_the_start_is_noticed():
    t, fastest = drive(Motor(6.7), steady(40), 5.0, dies_at=0.0)
    assert t < 0.5
    assert fastest < 120


@pytest.mark.parametrize("friction", [1.0, 4.0, 6.7, 10.0, 13.0])
@pytest.mark.parametrize(
    "path", [steady(5), steady(60), steady(-150), swing(30, 3.0), swing(3, 2.0)]
)
def test_a_joint_that_turns_is_never_called_stalled_however_stiff(friction, path):
    assert drive(Motor(friction), path, 6.0)[0] is None


@pytest.mark.parametrize("load", [-6.0, 6.0])
def test_a_constant_load_is_not_taken_for_a_stall(load):
    assert drive(Motor(5.0, load), swing(30, 3.0), 6.0)[0] is None


def to_rest(way, seconds):
    """A path of `way` deg that ends at rest; the jerk is least."""

    def path(t):
        x = min(max(t / seconds, 0.0), 1.0)
        return 0.3 + way * x**3 * (10 - 15 * x + 6 * x * x), way / seconds * 30 * (x - x * x) ** 2

    return path


@pytest.mark.parametrize("speed_per_duty", [8.6, 11.2, 12.0])
@pytest.mark.parametrize("seconds", [0.6, 0.9, 1.1])
def test_friction_that_a_fast_motion_hid_is_no_stall_at_its_end(speed_per_duty, seconds):
    """Who runs faster by its duty than the model is learned as less stiff, until it stands."""
    motor = Motor(8.3, 0.0, speed_per_duty)
    assert drive(motor, to_rest(210, seconds), seconds + 1.0)[0] is None


@pytest.mark.parametrize("seconds", [0.6, 0.9, 1.1])
def test_who_is_blocked_while_it_slows_down_is_noticed_though_friction_was_hidden(seconds):
    jams_at = 0.7 * seconds
    t, _ = drive(Motor(8.3, 0.0, 11.2), to_rest(210, seconds), seconds + 1.0, jams_at=jams_at)
    assert jams_at < t < jams_at + 0.1


def test_what_stands_unpushed_misses_nothing():
    detector = StallDetector(MotorModel(1.0, GAINS["large"]), 1.0, 0.0, 0.03, 9.0)
    detector.begin(0.0, 0.01, 1.0)
    for _ in range(1000):
        detector.update(TICK, 0.0, 0.017, 0.01, 0.0, 1.5, 1.0, 0.0)
        assert not detector.stalled
    for _ in range(20):
        detector.update(TICK, 0.0, 0.017, 0.01, 0.0, 4.5, 1.0, 0.0)
    assert detector.stalled


def test_a_count_in_either_direction_ends_the_suspicion():
    detector = StallDetector(MotorModel(1.0, GAINS["large"]), 1.0, 0.0, 0.03, 9.0)
    for low in (0.017, -0.017):
        detector.begin(0.0, 0.01, 1.0)
        for _ in range(20):
            detector.update(TICK, 0.0, 0.017, 0.01, 0.0, 4.5, 1.0, 0.0)
        assert detector.stalled
        detector.update(TICK, low, low + 0.017, low, 0.0, 4.5, 1.0, 0.0)
        assert not detector.stalled


@pytest.mark.parametrize(
    ("push", "stalled"),
    [(2.2, True), (-2.2, False), (-3.4, True)],
    ids=["goes on", "turns round", "turns round, and is blocked"],
)
def test_who_turns_round_in_silence_may_be_stiffer_than_who_goes_on(push, stalled):
    count = math.radians(1)
    detector = StallDetector(MotorModel(1.0, GAINS["large"]), 1.0, 0.0, 2 * count, 9.0)
    detector.begin(0.0, 0.5 * count, 1.0)
    for k in range(1, 6):
        detector.update(TICK, k * count, (k + 1) * count, (k + 0.5) * count, 0.1, 1.5, 1.0, 0.0)
    for now in [0.0] * 20 + [push] * 20:
        detector.update(TICK, 5 * count, 6 * count, 5.5 * count, 0.0, now, 1.0, 0.0)
    assert detector.stalled is stalled
