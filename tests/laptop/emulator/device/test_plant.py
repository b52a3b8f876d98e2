"""The physics behind the encoders, against conservation laws and sums done by hand."""

import math
import random

import pytest

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.masses import weighed
from laptop.emulator.device.motor_and_link import Drive, DrivenLink
from laptop.emulator.device.plant import ArmPlant
from laptop.emulator.device.plant_constants import (
    CONSTANTS,
    CPU,
    MOTORS,
    SCATTERED,
    SCATTERED_BY_PORT,
    BadPlant,
    MotorConstants,
    at_port,
    motor_constants,
    read_plant,
)
from laptop.emulator.host.world import World
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

STEP = 0.001
LARGE = MOTORS["large"]
FRICTIONLESS = LARGE._replace(friction=0.0)
HALF_GAP = math.radians(2.0)


def build_drive(
    motor=LARGE, ratio=1.0, gap=2 * HALF_GAP, friction=0.01, stops=(-9.0, 9.0), inertia=0.003
):
    """One joint on 8 V with its link in the middle of the gap."""
    return Drive(motor, 8.0, ratio, DrivenLink(0.0, inertia, friction, gap, *stops))


def bare(motor=LARGE, voltage=8.0):
    return Drive(motor, voltage)


def run(drive, seconds, each=lambda: None):
    for _ in range(int(round(seconds / STEP))):
        drive.step(STEP)
        each()


def kinetic_energy(drive):
    energy = drive.motor.inertia * (drive.ratio * drive.speed) ** 2 / 2
    if drive.link:
        energy += drive.link.inertia * drive.link.speed**2 / 2
    return energy


def gap(drive):
    return drive.angle - drive.link.angle


# The motor


@pytest.mark.parametrize("voltage", [6.5, 8.0, 9.0])
@pytest.mark.parametrize("duty", [1.0, 0.4, -1.0])
@pytest.mark.parametrize("kind", ["large", "medium"])
def test_no_load_speed_is_where_the_current_only_feeds_friction(kind, voltage, duty):
    motor = MOTORS[kind]
    current = motor.friction / motor.torque_constant
    expected = (abs(duty) * voltage - current * motor.resistance) / motor.emf_constant
    drive = bare(motor, voltage)
    drive.duty = duty
    run(drive, 2)
    assert drive.speed == pytest.approx(math.copysign(expected, duty), rel=1e-6)


@pytest.mark.parametrize(
    ("kind", "voltage", "turns_per_minute"),
    [("large", 9.0, 175), ("medium", 9.0, 260)],
    ids=["large", "medium"],
)
def test_no_load_speed_is_that_of_the_published_measurement(kind, voltage, turns_per_minute):
    drive = bare(MOTORS[kind], voltage)
    drive.duty = 1.0
    run(drive, 2)
    assert drive.speed * 60 / (2 * math.pi) == pytest.approx(turns_per_minute, rel=0.01)


def test_speed_rises_with_the_electromechanical_time_constant():
    drive = bare(FRICTIONLESS)
    drive.duty = 1.0
    lag = LARGE.inertia * LARGE.resistance / (LARGE.torque_constant * LARGE.emf_constant)
    run(drive, lag)
    # 8 V / Ke and 1 - 1/e; the step of 1 ms costs a per cent.
    assert drive.speed == pytest.approx(8.0 / LARGE.emf_constant * (1 - math.exp(-1)), rel=0.02)


@pytest.mark.parametrize(
    ("duty", "seconds"),
    [(None, 10 * LARGE.inertia / LARGE.friction), (0.0, None)],
    ids=["coast: friction alone", "brake: much sooner"],
)
def test_coast_and_brake(duty, seconds):
    drive = bare()
    drive.duty = duty
    drive.speed = 10.0
    elapsed = [0.0]

    def clock():
        if drive.speed:
            elapsed[0] += STEP

    run(drive, 3, clock)
    assert drive.speed == 0
    if seconds:
        assert elapsed[0] == pytest.approx(seconds, abs=2 * STEP)
    else:
        # dw/dt = -w/lag - c: t = lag ln(1 + w0 / (c lag)), with c = friction / inertia
        lag = LARGE.inertia * LARGE.resistance / (LARGE.torque_constant * LARGE.emf_constant)
        expected = lag * math.log(1 + 10.0 / (LARGE.friction / LARGE.inertia * lag))
        assert elapsed[0] == pytest.approx(expected, rel=0.05)


def test_a_motor_below_its_friction_stands_still_and_above_it_turns():
    drive = bare()
    share = LARGE.friction / (8.0 / LARGE.resistance * LARGE.torque_constant)
    drive.duty = 0.98 * share
    run(drive, 1)
    assert drive.angle == 0
    drive.duty = 1.05 * share
    run(drive, 1)
    assert drive.angle > 0


def test_jammed_bare_motor_does_not_turn():
    drive = bare()
    drive.duty = 1.0
    run(drive, 0.2)
    drive.jammed = True
    before = drive.angle
    run(drive, 0.2)
    assert (drive.angle, drive.speed) == (before, 0)


# Two masses and the gap


@pytest.mark.parametrize("ratio", [1.0, -5.0])
@pytest.mark.parametrize("speeds", [(4.0, 0.0), (4.0, -2.0), (-3.0, 0.5)], ids=str)
def test_impact_across_the_gap_keeps_momentum_and_loses_energy_as_two_lumps_do(ratio, speeds):
    drive = build_drive(FRICTIONLESS, ratio, friction=0.0)
    drive.speed, drive.link.speed = speeds
    m = LARGE.inertia * ratio**2
    together = (m * speeds[0] + 0.003 * speeds[1]) / (m + 0.003)
    lost = m * 0.003 / (m + 0.003) * (speeds[0] - speeds[1]) ** 2 / 2
    before = kinetic_energy(drive)
    run(drive, 0.1)
    assert drive.speed == pytest.approx(together)
    assert drive.link.speed == pytest.approx(together)
    assert before - kinetic_energy(drive) == pytest.approx(lost)


@pytest.mark.parametrize("head_start", [k / 10.0 for k in range(10)])
def test_impact_happens_where_and_when_rotor_and_link_meet(head_start):
    drive = build_drive(FRICTIONLESS, friction=0.0)
    drive.speed, speed = 5.0, 5.0
    drive.angle += head_start * speed * STEP
    path = []
    run(drive, 0.1, lambda: path.append(drive.link.angle))
    # Nothing before the rotor has crossed the half gap, then straight on at the common speed.
    meeting = HALF_GAP / speed - head_start * STEP
    together = LARGE.inertia * speed / (LARGE.inertia + 0.003)
    expected = [max(0.0, (k + 1) * STEP - meeting) * together for k in range(100)]
    assert path == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_without_drive_energy_never_rises_and_the_gap_is_never_exceeded(seed):
    draw = random.Random(seed)
    drive = build_drive(
        ratio=draw.choice([1.0, -5.0, 3.0]),
        gap=draw.choice([0.0, 0.01, 0.1]),
        friction=draw.uniform(0, 0.02),
        stops=(-draw.uniform(0.05, 1), draw.uniform(0.05, 1)),
        inertia=10 ** draw.uniform(-4, -2),
    )
    drive.duty = draw.choice([None, 0.0])
    drive.speed, drive.link.speed = draw.uniform(-8, 8), draw.uniform(-8, 8)
    energy = [kinetic_energy(drive)]

    def check():
        energy.append(kinetic_energy(drive))
        assert energy[-1] <= energy[-2] * (1 + 1e-12)
        assert abs(gap(drive)) <= drive.link.half_backlash + 1e-12
        assert drive.link.lower <= drive.link.angle <= drive.link.upper

    run(drive, 2, check)


@pytest.mark.parametrize("seed", range(8))
def test_whatever_drives_it_the_gap_and_the_stops_hold(seed):
    draw = random.Random(100 + seed)
    drive = build_drive(
        ratio=draw.choice([1.0, -5.0]), gap=draw.choice([0.0, 0.02, 0.1]), stops=(-0.3, 0.4)
    )
    for _ in range(40):
        drive.duty = draw.choice([None, 0.0, draw.uniform(-1, 1)])
        drive.link.load = draw.choice([0.0, draw.uniform(-0.3, 0.3)])
        drive.link.jammed = draw.random() < 0.2

        def check():
            assert abs(gap(drive)) <= drive.link.half_backlash + 1e-12
            assert -0.3 <= drive.link.angle <= 0.4
            # So the shaft cannot wander off behind a stop either.
            assert abs(drive.angle) <= 0.4 + drive.link.half_backlash + 1e-12

        run(drive, draw.uniform(0.01, 0.3), check)


@pytest.mark.parametrize("play", [0.0, HALF_GAP], ids=["no gap", "gap"])
@pytest.mark.parametrize(("duty", "stop"), [(1.0, 0.4), (-1.0, -0.3)], ids=["upper", "lower"])
def test_a_motor_pushing_against_a_stop_stands(play, duty, stop):
    drive = build_drive(gap=2 * play, stops=(-0.3, 0.4))
    drive.duty = duty
    run(drive, 1)
    assert drive.link.angle == stop
    assert gap(drive) == pytest.approx(math.copysign(play, duty))
    assert (drive.speed, drive.link.speed) == (0, 0)


def test_a_rotor_that_was_dragged_into_a_stop_runs_on_through_the_gap():
    drive = build_drive(FRICTIONLESS, friction=0.0, stops=(-9.0, 0.1))
    drive.angle = -HALF_GAP  # the link is ahead and pulls
    drive.speed = drive.link.speed = 3.0
    run(drive, 0.05)
    assert drive.link.angle == 0.1
    assert drive.speed == 3.0
    run(drive, 0.1)
    assert gap(drive) == pytest.approx(HALF_GAP)
    assert drive.speed == 0


@pytest.mark.parametrize(
    ("load", "moves"),
    [(0.9, False), (-0.9, False), (1.1, True), (-1.1, True)],
    ids=["below", "below, back", "above", "above, back"],
)
def test_a_link_in_the_gap_rests_below_its_own_friction(load, moves):
    drive = build_drive(friction=0.01)
    drive.link.load = load * 0.01
    run(drive, 1)
    assert bool(drive.link.angle) is moves
    if moves:
        # It falls to the gap's end, and there both frictions hold it.
        assert -gap(drive) == pytest.approx(math.copysign(HALF_GAP, load))
        assert (drive.speed, drive.link.speed) == (0, 0)


@pytest.mark.parametrize("share", [0.95, 1.05], ids=["below", "above"])
def test_a_link_that_leans_on_the_rotor_rests_below_both_frictions(share):
    drive = build_drive(friction=0.01)
    drive.link.angle = HALF_GAP
    drive.link.load = share * (0.01 + LARGE.friction)
    run(drive, 2)
    assert (drive.angle > 0) is (share > 1)


def test_a_link_runs_on_when_the_rotor_brakes_as_no_play_operator_does():
    # A play operator: the link is where the rotor drags it, and stops when the rotor turns back.
    drive = build_drive(friction=0.001)
    played = [0.0]

    def play_operator():
        played[0] = min(max(played[0], drive.angle - HALF_GAP), drive.angle + HALF_GAP)

    drive.duty = 0.5
    run(drive, 0.5, play_operator)
    assert gap(drive) == pytest.approx(HALF_GAP)
    assert drive.link.angle == pytest.approx(played[0])
    drive.duty = 0.0
    turned = drive.angle
    ahead = [0.0]

    def look():
        play_operator()
        ahead[0] = max(ahead[0], drive.link.angle - played[0])

    run(drive, 0.15, look)
    assert drive.angle > turned
    # It crosses the whole gap on its own: friction of 0.001 Nm takes 0.3 rad/s from it per second.
    assert ahead[0] == pytest.approx(2 * HALF_GAP, rel=0.05)


def test_at_rest_after_a_load_turned_round_link_and_encoder_differ_by_the_backlash():
    drive = build_drive(friction=0.001)
    seen = []
    for load in (0.01, -0.01):
        drive.link.load = load
        run(drive, 1)
        assert (drive.speed, drive.link.speed) == (0, 0)
        seen.append(drive.link.angle - drive.shaft)
    assert seen == pytest.approx([HALF_GAP, -HALF_GAP])


def test_a_standing_link_that_is_pushed_past_its_play_takes_the_rotor_along():
    drive = build_drive()
    drive.link.angle = HALF_GAP / 2
    run(drive, 0.1)
    assert (drive.angle, drive.link.angle) == (0, HALF_GAP / 2)
    drive.link.angle = 3 * HALF_GAP
    run(drive, 0.1)
    assert gap(drive) == pytest.approx(-HALF_GAP)


def test_what_begins_beyond_a_stop_is_put_there_at_once():
    drive = build_drive(stops=(0.1, 0.4))
    drive.step(0.001)
    assert drive.link.angle == 0.1


@pytest.mark.parametrize("jammed_at", [0.0, 0.01, -HALF_GAP], ids=str)
def test_a_jammed_link_stays_and_the_rotor_has_the_gap(jammed_at):
    drive = build_drive()
    drive.link.angle = jammed_at
    drive.link.jammed = True
    drive.link.load = 0.05
    drive.link.speed = 1.0
    ends = []
    for duty in (1.0, -1.0):
        drive.duty = duty
        run(drive, 0.5)
        ends.append(drive.angle)
    assert drive.link.angle == jammed_at
    assert ends == pytest.approx([jammed_at + HALF_GAP, jammed_at - HALF_GAP])


def test_gears_trade_speed_for_torque():
    direct, geared = build_drive(friction=0.2), build_drive(ratio=-5.0, friction=0.2)
    for drive, duty in ((direct, 0.5), (geared, -0.5)):
        drive.duty = duty
        run(drive, 2)
    # 0.5 x 8 V stalled: 0.2 Nm, less 0.0165: not enough for 0.2 Nm; behind 5:1 nearly 1 Nm.
    assert direct.link.speed == 0
    torque = (0.2 + 5 * LARGE.friction) / 5
    expected = (4.0 - torque / LARGE.torque_constant * LARGE.resistance) / LARGE.emf_constant / 5
    assert geared.link.speed == pytest.approx(expected, rel=1e-6)
    assert geared.shaft == pytest.approx(-5 * geared.angle)


# The arm


@pytest.fixture(params=["planar", "geared"])
def arm(request):
    return read_arm(find_arm(request.param))


def test_arm_starts_at_rest_in_the_middle_of_its_gaps_and_stays(arm):
    plant = ArmPlant(arm, read_plant(), (0.3, -0.4))
    for _ in range(500):
        plant.step(STEP)
    assert plant.q == (0.3, -0.4)
    assert [drive.shaft for drive in plant.joints] == [0, 0]


@pytest.mark.parametrize(
    ("text", "degrees"), [("", 2.0), ("backlash=3", 3.0), ("backlash=0", 0.0)], ids=str
)
def test_backlash_is_as_described_unless_the_plant_says_otherwise(arm, text, degrees):
    plant = ArmPlant(arm, read_plant(text))
    gaps = [2 * math.degrees(drive.link.half_backlash) for drive in plant.joints]
    assert gaps == pytest.approx([degrees] * 2)


def test_zero_error_turns_the_true_joints_not_the_encoders(arm):
    plant = ArmPlant(arm, read_plant("zero_error=1.5"), (0.3, -0.4))
    assert plant.q == pytest.approx((0.3 + math.radians(1.5), -0.4 + math.radians(1.5)))
    assert [drive.shaft for drive in plant.joints] == [0, 0]


def test_load_pulls_every_joint(arm):
    plant = ArmPlant(arm, read_plant("load=0.2,link_friction=0"))
    before = plant.q
    for _ in range(300):
        plant.step(STEP)
    assert all(after > angle for after, angle in zip(plant.q, before))


def test_paper_drags_at_the_tip_only_where_the_pen_is_down_and_against_its_motion():
    arm = read_arm(find_arm("planar"))
    plant = ArmPlant(arm, read_plant("pen_drag=2"), (0.0, 0.0))
    loads = {}
    for angle in (arm.pen.up, arm.pen.down):
        plant.drives[arm.pen.port].angle = angle
        plant.joints[0].link.speed = 2.0
        plant.step(0.0)
        loads[angle] = [drive.link.load for drive in plant.joints]
    assert loads[arm.pen.up] == [0, 0]
    # Stretched along x: the tip moves along y; 2 N at 20.8 and 9.5 cm.
    assert loads[arm.pen.down] == pytest.approx([-2 * 0.208, -2 * 0.095])


def test_pen_touches_shortly_before_it_is_all_the_way_down_and_follows_a_little():
    arm = read_arm(find_arm("planar"))
    plant = ArmPlant(arm, read_plant())
    seen = []
    for share in (0.0, 0.75, 0.85, 1.0, 0.75, 0.65, 0.75):
        plant.drives[arm.pen.port].angle = arm.pen.up + share * (arm.pen.down - arm.pen.up)
        plant.step(0.0)
        seen.append(plant.pen_down)
    assert seen == [False, False, True, True, True, False, False]


def test_an_arm_without_a_pen_motor_draws_all_the_time():
    assert ArmPlant(read_arm(find_arm("planar"))._replace(pen=None), read_plant()).pen_down


# Gravity


SPATIAL = read_arm(find_arm("spatial"))


def weights(arm, plant):
    """The emulated arm's point masses by hand: (kg, joints up to there, cm along the last link)."""
    upper, fore = (joint.link for joint in arm.joints[1:])
    motors = plant["motor_mass"]
    return [
        (0.001 * plant["upper_arm_mass"], 2, upper / 2),
        (0.076 * motors, 2, 5.5),
        (0.001 * plant["forearm_mass"], 3, fore / 2),
        (0.036 * motors, 3, 5.0),
        (0.001 * plant["tip_mass"], 3, fore),
    ]


def heights(arm, q, plant):
    """Pairs of kg and m above the table."""
    for mass, size, along in weights(arm, plant):
        last = arm.joints[size - 1]._replace(link=along)
        cut = arm._replace(joints=arm.joints[: size - 1] + (last,))
        yield mass, 0.01 * kinematics.forward(cut, q[:size])[2]


@pytest.mark.parametrize("seed", range(6))
def test_links_feel_the_slope_of_the_potential_energy(seed):
    constants = read_plant(f"seed={seed},gravity=9")
    draw = random.Random(seed)
    q = [draw.uniform(joint.lower, joint.upper) for joint in SPATIAL.joints]
    plant = ArmPlant(SPATIAL, constants, q)
    plant.step(0.0)

    def energy(q):
        return sum(9 * mass * height for mass, height in heights(SPATIAL, q, constants))

    for k, drive in enumerate(plant.joints):
        ahead, behind = (q[:k] + [q[k] + e] + q[k + 1 :] for e in (1e-5, -1e-5))
        slope = (energy(ahead) - energy(behind)) / 2e-5
        assert drive.link.load == pytest.approx(-slope, abs=1e-8)
    assert any(abs(drive.link.load) > 1e-3 for drive in plant.joints)


def test_inertias_in_space_are_those_of_the_masses():
    constants = read_plant("base_inertia=0.002,tip_mass=20")
    upper = SPATIAL.joints[1].link
    shoulder = elbow = 0.0
    for mass, size, along in weights(SPATIAL, constants):
        shoulder += mass * (0.01 * (along if size == 2 else upper + along)) ** 2
        elbow += mass * (0.01 * along) ** 2 if size == 3 else 0.0
    plant = ArmPlant(SPATIAL, constants)
    assert [drive.link.inertia for drive in plant.joints] == pytest.approx(
        [0.002 + shoulder, shoulder, elbow]
    )


def test_the_arm_file_in_space_says_what_the_plain_plant_weighs():
    for lines, true in zip(SPATIAL.joints, weighed(SPATIAL, read_plant()).joints):
        assert lines.mass == pytest.approx(true.mass, abs=5e-4)
        assert lines.centre == pytest.approx(true.centre, abs=0.05)
        assert lines.mass == 0 or lines.friction == pytest.approx(true.friction)


def fallen(text, duty, pose=(0.0, 0.0, 0.0)):
    """How far the joints have turned after 2 s at a duty, deg."""
    plant = ArmPlant(SPATIAL, read_plant(text), pose)
    for drive in plant.joints:
        drive.duty = duty
    for _ in range(2000):
        plant.step(STEP)
    return [math.degrees(after - before) for after, before in zip(plant.q, pose)]


def test_coasting_the_arm_drops_braked_it_sinks_and_weightless_it_stays():
    base, shoulder, elbow = fallen("", None)
    assert base == 0
    assert shoulder == pytest.approx(-35), "down to its stop"
    assert elbow == pytest.approx(-1, abs=0.05), (
        "through its play; the motor's friction carries the rest"
    )
    assert -30 < fallen("", 0.0)[1] < -5
    assert fallen("gravity=0", None) == [0, 0, 0]


def test_a_brick_in_space_wakes_up_holding_its_arm():
    brick = EmulatedBrick(World(), SPATIAL)
    assert {brick.motors[port].mode for port in "ABC"} == {"hold"}
    assert brick.motors["B"].read("stop_action") == "coast"
    brick.world.sleep(3)
    sunk = [math.degrees(q - joint.home) for q, joint in zip(brick.plant.q, SPATIAL.joints)]
    assert sunk == pytest.approx([0, -1, -1], abs=0.3), "through the play, and no farther"
    brick.reset_motors()
    brick.world.sleep(3)
    assert math.degrees(brick.plant.q[1]) == pytest.approx(-35)


def test_arms_in_the_plane_weigh_nothing(arm):
    plant = ArmPlant(arm, read_plant("tip_mass=500,motor_mass=3"))
    assert not plant.weighs
    assert [drive.link.inertia for drive in plant.joints] == [0.003, 0.0006]
    assert {motor.mode for motor in EmulatedBrick(World(), arm).motors.values()} == {"coast"}


def test_no_paper_drags_in_the_air():
    plant = ArmPlant(SPATIAL._replace(pen=None), read_plant("pen_drag=2,gravity=0"))
    plant.joints[0].link.speed = 2.0
    plant.step(0.0)
    assert plant.pen_down
    assert [drive.link.load for drive in plant.joints] == [0, 0, 0]


def test_what_weighs_in_space_leaves_the_plants_in_the_plane_as_they_were():
    """Figures of old: the same seed still draws the same plant."""
    plant = read_plant("seed=7")
    assert (plant["voltage"], plant["elbow_inertia"]) == pytest.approx(
        (7.114364686742446, 0.0006362242735295649)
    )
    assert at_port(plant, "B")["rotor_friction"] == pytest.approx(1.0629984981452683)


# The constants


def test_the_plain_plant_is_the_defaults():
    assert read_plant() == {key: CONSTANTS[key].default for key in CONSTANTS}
    assert read_plant()["cpu"] == CPU == 1


@pytest.mark.parametrize(
    "text",
    ["seed=4", "seed=4,spread=0.1", "load=-0.1..0.1,seed=9", "backlash=1..3", "voltage=7.2,seed=1"],
)
def test_random_plants_repeat(text):
    assert read_plant(text) == read_plant(text)


@pytest.mark.short("0.2")
@pytest.mark.parametrize("spread", [0.05, 0.2, 0.5])
def test_a_seed_scatters_within_the_spread_and_fills_it(spread):
    for key in CONSTANTS:
        constant = CONSTANTS[key]
        if key == "seed" or constant.default is None:
            continue
        plants = [read_plant(f"seed={n},spread={spread}") for n in range(200)]
        values = [at_port(plant, "A")[key] for plant in plants]
        if key not in SCATTERED | SCATTERED_BY_PORT:
            assert set(values) == {spread if key == "spread" else constant.default}
            continue
        ratios = [value / constant.default for value in values]
        assert 1 - spread <= min(ratios) < 1 - 0.9 * spread, key
        assert 1 + 0.9 * spread < max(ratios) <= 1 + spread, key


def test_constants_scatter_independently_of_one_another_and_of_what_else_is_given():
    plain, more = (at_port(read_plant(t), "B") for t in ("seed=7", "seed=7,load=0.1,backlash=3"))
    drawn = [k for k in SCATTERED | SCATTERED_BY_PORT if CONSTANTS[k].default]
    ratios = [plain[k] / CONSTANTS[k].default for k in drawn]
    assert len(set(ratios)) == len(ratios)
    assert {k: more[k] for k in more if k not in ("load", "backlash")} == {
        k: plain[k] for k in plain if k not in ("load", "backlash")
    }
    assert (more["load"], more["backlash"]) == (0.1, 3.0)


def test_no_two_motors_of_a_random_plant_are_alike():
    """Equal errors at all joints would bend a line less than unequal ones."""
    arm = read_arm(find_arm("planar"))
    a, b, c = (ArmPlant(arm, read_plant("seed=3")).drives[port].motor for port in "ABC")
    assert all(x != y for x, y in zip(a, b))
    ratio = a.torque_constant / b.torque_constant
    assert 0.8 / 1.2 <= ratio <= 1.2 / 0.8
    brick = EmulatedBrick(World(), arm, read_plant("seed=3"))
    phases = [motor.encoder.phase for motor in brick.motors.values()]
    assert len(set(phases)) == 3
    assert all(0 <= phase <= 0.5 for phase in phases)
    same = ArmPlant(arm, read_plant()).drives
    assert same["A"].motor == same["B"].motor


def test_a_range_is_drawn_within_its_bounds_anew_for_each_seed():
    values = [read_plant(f"load=-0.1..0.3,seed={n}")["load"] for n in range(100)]
    assert -0.1 <= min(values) < -0.06
    assert 0.26 < max(values) <= 0.3
    assert read_plant("seed=3")["voltage"] != read_plant("seed=5")["voltage"]


def test_motor_constants_are_the_nominal_ones_times_the_plants():
    plant = read_plant("torque_constant=1.1,resistance=0.9,rotor_friction=2,rotor_inertia=1.5")
    assert motor_constants("large", plant) == pytest.approx(
        MotorConstants(0.275 * 1.1, 0.473, 5.5 * 0.9, 0.033, 0.0021)
    )


@pytest.mark.parametrize("kind", ["large", "medium"])
@pytest.mark.parametrize("key", ["torque_constant", "emf_constant", "resistance", "rotor_inertia"])
def test_the_step_is_fine_enough_at_the_ends_of_every_range(kind, key):
    others = ["torque_constant=2", "emf_constant=2", "resistance=0.5", "rotor_inertia=0.2"]
    for text in [f"{key}={CONSTANTS[key].allowed[0]}", ",".join(others)]:
        drive = bare(motor_constants(kind, read_plant(text)))
        drive.duty = 1.0
        speeds = []
        run(drive, 3, lambda drive=drive, speeds=speeds: speeds.append(drive.speed))
        assert max(speeds) == pytest.approx(speeds[-1], rel=1e-6)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("volts=7", ["'volts'", "voltage"]),
        ("voltage", ["'voltage'", "voltage=NUMBER"]),
        ("voltage=", ["voltage", "4.5", "10"]),
        ("voltage=x", ["voltage = x", "4.5", "10"]),
        ("voltage=12", ["voltage = 12", "4.5", "10", " V "]),
        ("voltage=nan", ["voltage = nan"]),
        ("voltage=7..12", ["voltage = 12"]),
        ("backlash=-1", ["backlash = -1", "20", "deg"]),
        ("load=inf", ["load = inf", "-0.4", "0.4"]),
        ("load=0..0.1..0.2", ["load", "LOW..HIGH"]),
        ("seed=1..4", ["seed", "1..4", "single value"]),
        ("spread=0.1..0.2", ["spread", "single value"]),
        ("seed=-1", ["seed = -1"]),
        ("backlash=3;load=1", ["backlash", "3;load=1"]),
    ],
    ids=str,
)
def test_a_bad_constant_is_refused_in_one_line(text, named):
    with pytest.raises(BadPlant) as caught:
        read_plant(text)
    assert "\n" not in str(caught.value)
    for pair in named:
        assert pair in str(caught.value)


# The record


def test_record_repeats_bit_for_bit_and_is_dense(arm):
    def record():
        brick = EmulatedBrick(World(), arm, read_plant("seed=3"), (0.2, 0.5))
        for port, speed in (("A", 90), ("B", -70)):
            brick.motors[port].write("speed_sp", str(speed))
            brick.motors[port].write("command", "run-forever")
        brick.world.sleep(1)
        return brick.record

    first = record()
    assert first == record()
    assert first[-1].t == pytest.approx(1.0)
    assert len(first) > 100
    assert first[-1].q != first[0].q
