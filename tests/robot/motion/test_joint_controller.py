"""The controller of one joint, on a motor written down in ten lines: first order, with friction."""

import math

import pytest
from plain_motor import COUNT, TICK, Motor, steady, swing

from robot.motion.control_loop import ControlLoop
from robot.motion.joint_controller import GAINS, LEAD, JointController
from robot.motion.motor_model import STIFFNESS


def follow(motor, path, seconds, gear=1.0, on_tick=lambda t, controller: None):
    """Control at 50 Hz as the arm does; the true errors, deg, tick by tick."""
    unit = math.radians(1) / gear
    controller = JointController(gear, GAINS["large"])
    errors = []
    for k in range(int(seconds / TICK)):
        t = k * TICK
        controller.observe(t, *[angle * unit for angle in motor.bounds()])
        on_tick(t, controller)
        here = path(t)
        ahead, sooner = path(t + LEAD), path(t + LEAD - TICK)
        error = here[0] * unit - controller.angle
        acceleration = (ahead[1] - sooner[1]) / TICK * unit
        w = controller.command(error, ahead[1] * unit, acceleration)
        errors.append(here[0] - motor.angle)
        motor.run(w / unit, TICK)
    return errors


@pytest.mark.parametrize("friction", [1.0, 4.0, 8.0, 12.0])
@pytest.mark.parametrize("speed", [15, 60, -60, 150])
def test_it_learns_a_friction_that_is_not_the_one_it_guessed(friction, speed):
    errors = follow(Motor(friction), steady(speed), 3.0)
    late = errors[-50:]
    assert abs(sum(late) / len(late)) < 0.5 * COUNT
    assert max(map(abs, late)) < COUNT


@pytest.mark.parametrize("load", [-8.0, 5.0, 10.0])
def test_it_learns_a_constant_load(load):
    late = follow(Motor(load=load), steady(40), 4.0)[-50:]
    assert abs(sum(late) / len(late)) < 0.6 * COUNT


@pytest.mark.parametrize("changes", [(7.3, 0.077), (10.9, 0.115), (7.3, 0.115), (10.9, 0.077)])
def test_a_motor_20_percent_off_is_followed(changes):
    motor = Motor(5.0, 0.0, *changes)
    late = follow(motor, swing(30, 3.0), 9.0)[150:]
    assert max(map(abs, late)) < 2 * COUNT


def test_at_the_end_it_rests_within_a_count():
    def path(t):
        x = min(t / 1.0, 1.0)
        return 0.3 + 40 * x * x * (3 - 2 * x), 240 * x * (1 - x)

    motor = Motor(7.0)
    errors = follow(motor, path, 2.0)
    assert max(map(abs, errors[-20:])) < COUNT
    assert abs(motor.speed) < 10


@pytest.mark.parametrize("friction", [1.0, 10.0])
def test_what_it_observes_is_what_the_encoder_allows(friction):
    motor = Motor(friction)
    seen = []

    def on_tick(t, controller):
        low, high = (math.radians(angle) for angle in motor.bounds())
        assert low - 1e-12 <= controller.angle <= high + 1e-12
        seen.append(math.degrees(controller.angle) - motor.angle)

    follow(motor, swing(20, 2.0), 6.0, on_tick=on_tick)
    late = seen[150:]
    rms = math.sqrt(sum(e * e for e in late) / len(late))
    assert rms < 0.4 * COUNT


def test_between_two_counts_it_goes_on_with_the_motor():
    """At 10 deg/s a count lasts 0.1 s; the observed angle moves meanwhile."""
    seen = []
    follow(Motor(), steady(10), 3.0, on_tick=lambda t, f: seen.append(math.degrees(f.angle)))
    late = [b - a for a, b in zip(seen[-100:], seen[-99:])]
    assert sum(step > 0.05 for step in late) > 60


@pytest.mark.parametrize("gear", [0.2, 3.0, 5.0, 40.0])
def test_behind_a_gear_everything_is_smaller_by_the_gear(gear):
    plain = follow(Motor(6.0), swing(20, 2.0), 2.0)
    geared = follow(Motor(6.0), swing(20, 2.0), 2.0, gear=gear)
    assert geared == pytest.approx(plain, abs=1e-6)


def test_the_mirror_image_of_a_motion_gets_the_mirror_image_of_the_commands():
    here, there = JointController(1.0, GAINS["large"]), JointController(1.0, GAINS["large"])
    for k in range(100):
        t = k * TICK
        angle = 0.5 * math.sin(3 * t)
        here.observe(t, angle, angle + 0.017)
        there.observe(t, -angle - 0.017, -angle)
        assert there.angle == pytest.approx(-here.angle)
        wanted = (0.01, 1.5 * math.cos(3 * t), -4.5 * math.sin(3 * t))
        assert there.command(*(-x for x in wanted)) == pytest.approx(-here.command(*wanted))


def test_after_a_rest_it_starts_anew_wherever_the_joint_is():
    """Held meanwhile, turned by hand, or given another zero."""
    controller = JointController(1.0, GAINS["large"])
    for k in range(20):
        controller.observe(k * TICK, 0.1 * k, 0.1 * k + 0.017)
        controller.command(0.0, 5.0, 0.0)
    assert controller.speed > 1
    controller.reset()
    controller.observe(20 * TICK, 7.0, 7.1)
    assert controller.angle == pytest.approx(7.05)
    assert controller.speed == 0.0


def test_friction_is_pushed_against_in_the_direction_of_the_motion_only():
    """At rest there is none to overcome: a standing joint must not tremble."""
    controller = JointController(1.0, GAINS["large"])
    controller.observe(0.0, 0.0, 0.0)
    assert controller.command(0.0, 0.0, 0.0) == 0.0
    slow, slower = (controller.command(0.0, math.radians(speed), 0.0) for speed in (1.0, 0.01))
    assert slow > slower > 0


def test_a_weight_that_is_told_is_carried_from_the_start():
    """A weight of 6 % of duty: 0.024 Nm at a large motor."""

    def sunk(reported):
        motor = Motor(load=6.0)
        motor.angle = 0.5
        gains = GAINS["large"]
        controller = JointController(1.0, gains)
        least = 0.0
        for k in range(100):
            controller.observe(k * TICK, *[math.radians(angle) for angle in motor.bounds()])
            controller.carry(-6.0 * gains.torque_per_duty if reported else 0.0)
            error = math.radians(0.5) - controller.angle
            motor.run(math.degrees(controller.command(error, 0.0, 0.0)), TICK)
            least = min(least, motor.angle - 0.5)
        return least

    assert sunk(reported=False) < -0.4
    assert sunk(reported=True) > -0.1


@pytest.mark.parametrize("gear", [1.0, 5.0])
def test_a_weight_is_carried_through_the_gear(gear):
    gains = GAINS["large"]
    controller = JointController(gear, gains)
    controller.observe(0.0, 0.0, 0.0)
    controller.carry(-0.1)
    # What a standing motor pushes with is the stiffness times the set-point, % and deg/s.
    duty = STIFFNESS * math.degrees(controller.command(0.0, 0.0, 0.0)) * gear
    assert duty * gains.torque_per_duty * gear == pytest.approx(0.1)


def test_a_softer_hand_is_as_firm_as_it_gets_from_a_greater_error_on():
    firm = []
    for delay in (0.01, 0.05):
        one = JointController(1.0, GAINS["large"])
        one.delay = delay
        one.observe(0.0, 0.0, 0.0)
        firm.append(one.full_error)
        most, less = (one.command(share * one.full_error, 0.0, 0.0) for share in (1.0, 0.9))
        assert most == one.command(2 * one.full_error, 0.0, 0.0)
        assert less == pytest.approx(0.9 * most)
    assert firm[1] > 1.5 * firm[0]


def test_an_error_along_the_path_counts_four_fifths_of_one_across_it():
    """The path goes up both joints alike: `across` picks out what lies along it."""
    path = (0.5, 0.5), (1.0, 1.0)
    for errors, weighed in (
        ([0.1, 0.1], [0.08, 0.08]),
        ([0.1, -0.1], [0.1, -0.1]),
        ([0.2, 0.0], [0.18, -0.02]),
    ):
        ControlLoop._weigh_along(errors, path)
        assert errors == pytest.approx(weighed)
