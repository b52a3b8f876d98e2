"""Radians at the joint and counts of the emulated motor, through the unmodified library."""

import math

import pytest
from refusals import refused
from rig import Rig, described, switched_on

from robot.ev3.motors import DEAD_MAN, JointMotor, MotorNotFound

# Both signs and both gears; the emulated joint is built to match.
TRAINS = [(1, 1), (1, -1), (5, 1), (5, -1), (0.5, -1)]
TRAIN = pytest.mark.parametrize(("gear", "direction"), TRAINS)


@pytest.fixture
def rig(tmp_path):
    rig = Rig(tmp_path)
    with rig.brick.sysfs.installed():
        yield rig


@pytest.fixture
def shoulder(tmp_path):
    """Build a shoulder without play: (rig, its motor)."""
    installed = []

    def build(gear=1, direction=1, plant=""):
        arm = described("planar", 0, gear=float(gear), direction=direction)
        rig = Rig(tmp_path, arm, plant)
        installed.append(rig.brick.sysfs.installed())
        installed[-1].__enter__()
        return rig, JointMotor("shoulder", "A", "large", float(gear), direction)

    yield build
    for context in installed:
        context.__exit__(None, None, None)


def turn_by_hand(rig, port, angle):
    """Put the rotor (and its link) at `angle`, rad at the joint."""
    drive = rig.brick.plant.drives[port]
    drive.angle = drive.link.angle = angle
    rig.brick.motors[port].encoder.update(rig.world.now(), drive.shaft)


def written(rig, attribute, port="A"):
    return [text for _, at, what, text in rig.writes if (at, what) == (port, attribute)]


def commanded(rig, port="A"):
    """The set-point that each run-timed takes up, deg/s: one that stays is not written again."""
    out, speed = [], None
    for _, at, what, text in rig.writes:
        if (at, what) == (port, "speed_sp"):
            speed = int(text)
        elif (at, what, text) == (port, "command", "run-timed"):
            out.append(speed)
    return out


@TRAIN
def test_a_difference_in_counts(shoulder, gear, direction):
    rig, motor = shoulder(gear, direction)
    assert motor.in_counts(2 * math.pi) == pytest.approx(360 * gear * direction)
    assert motor.resolution == pytest.approx(math.radians(1) / gear)


@TRAIN
def test_the_angle_is_known_to_half_a_count_wherever_the_rotor_stands(shoulder, gear, direction):
    rig, motor = shoulder(gear, direction)
    for k in range(-60, 61):
        true = math.radians(0.37 * k) / gear
        turn_by_hand(rig, "A", true)
        low, high = motor.bounds()
        assert low - 1e-9 <= true <= high + 1e-9
        assert motor.angle() == pytest.approx((low + high) / 2)
        # Around 0 the driver's truncation makes one reading of two half counts more.
        width = 1.5 if motor.counts() == 0 else 1.0
        assert high - low == pytest.approx(width * motor.resolution)


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.4, 0.5])
def test_wherever_the_edges_lie_the_bounds_are_off_by_a_quarter_count_at_most(shoulder, phase):
    rig, motor = shoulder(plant=f"phase={phase}")
    for k in range(-50, 51):
        true = math.radians(0.23 * k)
        turn_by_hand(rig, "A", true)
        low, high = motor.bounds()
        quarter = 0.2501 * motor.resolution
        assert low - quarter <= true <= high + quarter


@TRAIN
def test_it_goes_where_it_is_sent(shoulder, gear, direction):
    rig, motor = shoulder(gear, direction)
    motor.zero = 30.0 * gear  # where the encoder would read at joint angle 0
    target = motor.go(math.radians(25), math.radians(60))
    assert target == int(round(30 * gear + 25 * gear * direction))
    rig.world.sleep(1.5)
    turned = math.degrees(rig.q[0])
    assert turned == pytest.approx(25 + 30 * direction, abs=2.0 / gear + 0.5)
    assert motor.angle() == pytest.approx(math.radians(25), abs=math.radians(2.0 / gear))
    assert rig.brick.motors["A"].mode == "hold"


@TRAIN
def test_a_positive_speed_turns_the_joint_in_the_positive_direction(shoulder, gear, direction):
    rig, motor = shoulder(gear, direction)
    motor.engage(0.14)
    for _ in range(50):
        motor.drive(4.0)
        rig.world.sleep(0.02)
    assert rig.q[0] > math.radians(10)


@TRAIN
@pytest.mark.parametrize("speed", [0.0112, -0.333, 1.2345])
def test_what_rounding_takes_away_is_carried_over(shoulder, gear, direction, speed):
    """Whole counts per second only: their mean is the speed wanted."""
    rig, motor = shoulder(gear, direction)
    motor.engage(0.14)
    for _ in range(200):
        motor.drive(speed)
    set_points = commanded(rig)
    assert len(set_points) == 200
    mean = sum(set_points) / 200.0
    assert mean == pytest.approx(motor.in_counts(speed), abs=1.01 / 200)
    assert max(set_points) - min(set_points) <= 1


@TRAIN
def test_no_speed_is_too_much_for_the_driver(shoulder, gear, direction):
    rig, motor = shoulder(gear, direction)
    motor.engage(0.14)
    for speed in (1e3, -1e3, 1050 / 57.29577 / gear, 1e9):
        motor.drive(speed)
        motor.go(0.3, speed)
    assert max(abs(int(text)) for text in written(rig, "speed_sp")) == 1050
    # What could not be had is not owed later.
    motor.engage(0.14)
    motor.drive(1e9)
    motor.drive(0.0)
    assert abs(int(written(rig, "speed_sp")[-1])) <= 1


@pytest.mark.parametrize(("falls", "mode"), [(False, "brake"), (True, "hold")])
def test_a_set_point_that_is_not_renewed_ends_by_itself(shoulder, falls, mode):
    rig, motor = shoulder()
    motor.falls = falls
    motor.engage(0.14)
    for _ in range(10):
        motor.drive(2.0)
        rig.world.sleep(0.02)
    assert rig.brick.driven() == ["A"]
    rig.world.sleep(DEAD_MAN)
    assert DEAD_MAN <= 0.3
    assert rig.brick.motors["A"].mode == mode


def test_one_that_is_blocked_is_not_driven_on_by_a_program_that_is_gone(shoulder):
    rig, motor = shoulder()
    rig.brick.jam("A")
    motor.engage(0.14)
    for _ in range(20):
        motor.drive(9.0)
        rig.world.sleep(0.02)
    assert rig.brick.plant.drives["A"].duty == pytest.approx(0.7, abs=0.3)
    rig.world.sleep(0.3)
    assert rig.brick.plant.drives["A"].duty == 0


def test_engaged_the_driver_has_no_integrator_and_disengaged_its_own_again(shoulder):
    rig, motor = shoulder()
    read = rig.brick.motors["A"].read
    before = {name: read(name) for name in ("speed_pid/Kp", "speed_pid/Ki", "hold_pid/Kp")}
    motor.engage(0.14)
    assert (read("speed_pid/Kp"), read("speed_pid/Ki")) == ("1400", "0")
    assert (read("stop_action"), read("time_sp")) == ("brake", "200")
    motor.disengage()
    assert {name: read(name) for name in before} == before
    assert before["speed_pid/Kp"] == "1000"
    assert before["speed_pid/Ki"] == "60"


def test_engaged_twice_costs_nothing(shoulder):
    rig, motor = shoulder()
    motor.disengage()
    motor.engage(0.14)
    accesses = rig.brick.sysfs.accesses
    motor.engage(0.14)
    assert rig.brick.sysfs.accesses == accesses


def test_going_somewhere_is_the_drivers_own_regulation(shoulder):
    rig, motor = shoulder()
    motor.engage(0.14)
    motor.go(1.0, 1.0)
    assert rig.brick.motors["A"].read("speed_pid/Ki") == "60"


@pytest.mark.parametrize("engaged", [False, True])
def test_held_it_resists(shoulder, engaged):
    rig, motor = shoulder()
    if engaged:
        motor.engage(0.14)
        motor.drive(1.0)
        rig.world.sleep(0.1)
    motor.hold()
    assert rig.brick.motors["A"].mode == "hold"
    assert rig.brick.driven() == []


@pytest.mark.parametrize("falls", [False, True])
def test_held_after_it_was_blocked_it_does_not_push_on(shoulder, falls):
    rig, motor = shoulder()
    motor.falls = falls
    rig.brick.jam("A")
    motor.engage(0.14)
    for _ in range(20):
        motor.drive(9.0)
        rig.world.sleep(0.02)
    motor.hold()
    rig.world.sleep(0.5)
    assert rig.brick.motors["A"].mode == "hold"
    assert rig.brick.plant.drives["A"].duty == 0


def test_what_was_summed_up_while_it_was_driven_does_not_hurl_it(shoulder):
    rig, motor = shoulder()
    motor.engage(0.14)
    for _ in range(100):  # what the motor lags behind is summed up
        motor.drive(1.0)
        rig.world.sleep(0.02)
    motor.go(motor.angle() + 2.0, math.radians(50))
    speeds = []
    for _ in range(250):
        rig.world.sleep(0.002)
        speeds.append(math.degrees(rig.brick.plant.drives["A"].speed))
    assert max(speeds[25:]) < 100


def test_ramps_of_an_earlier_program_delay_no_stop(shoulder):
    rig, before = shoulder()
    before._motor.ramp_up_sp = before._motor.ramp_down_sp = 5000
    motor = JointMotor("shoulder", "A", "large", 1.0, 1)
    motor.engage(0.14)
    for _ in range(20):
        motor.drive(5.0)
        rig.world.sleep(0.02)
    motor.hold()
    assert rig.brick.driven() == []


@pytest.mark.parametrize("stiffness", [0.02, 0.14])
def test_another_stiffness_does_not_let_the_drivers_integrator_in_between(shoulder, stiffness):
    rig, motor = shoulder()
    motor.engage(0.07)
    motor.drive(1.0)
    written_before = len(rig.writes)
    motor.engage(stiffness)
    assert [what for _, _, what, _ in rig.writes[written_before:]] == ["speed_pid/Kp"]
    assert rig.brick.motors["A"].read("speed_pid/Kp") == str(int(10000 * stiffness))


def test_a_tick_takes_three_accesses(shoulder):
    """Two to set and one to read; fewer do not keep the dead-man alive."""
    rig, motor = shoulder()
    motor.counts()
    motor.engage(0.14)
    motor.drive(1.0)
    accesses = rig.brick.sysfs.accesses
    motor.bounds()
    motor.drive(0.7)
    assert rig.brick.sysfs.accesses - accesses <= 3


# Motors that are not there


def test_a_motor_that_is_missing_is_told_with_all_that_is_there(rig):
    with pytest.raises(MotorNotFound) as error:
        JointMotor("third", "D", "large", 1.0, 1)
    assert refused(
        error,
        "no large motor at port D for the third",
        "outA (lego-ev3-l-motor), outB (lego-ev3-l-motor), outC (lego-ev3-m-motor)",
    )


def test_a_motor_of_the_other_kind_is_not_taken(rig):
    with pytest.raises(MotorNotFound) as error:
        JointMotor("shoulder", "C", "large", 1.0, 1)
    assert refused(error, "no large motor at port C", "outC (lego-ev3-m-motor)")


def test_a_brick_without_motors(rig):
    for port in "ABC":
        rig.brick.unplug(port)
    with pytest.raises(MotorNotFound) as error:
        JointMotor("shoulder", "A", "large", 1.0, 1)
    assert refused(error, "no motor found at all", "on the brick", "brickservo simulate")


def test_a_laptop_without_a_brick():
    """Without the emulation there is no such folder either."""
    with pytest.raises(MotorNotFound) as error:
        JointMotor("shoulder", "A", "large", 1.0, 1)
    assert refused(error, "no motor found at all", "on the brick")


@pytest.mark.parametrize(
    "act",
    [
        lambda motor: motor.counts(),
        lambda motor: motor.bounds(),
        lambda motor: motor.angle(),
        lambda motor: motor.drive(1.0),
        lambda motor: motor.go(1.0, 1.0),
        lambda motor: motor.hold(),
        lambda motor: motor.disengage(),
        lambda motor: motor.check_plugged_in(),
    ],
    ids=["counts", "bounds", "angle", "drive", "go", "hold", "disengage", "check"],
)
def test_a_pulled_cable_is_told_whatever_is_asked(shoulder, act):
    rig, motor = shoulder()
    motor.engage(0.14)
    motor.drive(1.0)
    rig.brick.unplug("A")
    with pytest.raises(MotorNotFound) as error:
        act(motor)
    assert refused(error, "shoulder motor at port A", "plug it in")


def test_a_pulled_cable_is_noticed_without_an_access(shoulder):
    rig, motor = shoulder()
    accesses = rig.brick.sysfs.accesses
    motor.check_plugged_in()
    assert rig.brick.sysfs.accesses == accesses


def test_a_motor_whose_device_has_a_number_of_two_digits_is_there(tmp_path):
    """The library's device_index would be its last digit."""
    with switched_on(tmp_path) as rig:
        joints = rig.robot().joints
        assert any(motor.device == "motor10" for motor in joints)
        for motor in joints:
            motor.check_plugged_in()
        rig.brick.unplug("B")
        with pytest.raises(rig.its(MotorNotFound)):
            joints[1].check_plugged_in()
