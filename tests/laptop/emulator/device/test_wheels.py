"""A brick without an arm: free motors, a robot on wheels, its gyro, and the ports of its motors."""

import math

import pytest

from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.device.sensor_environment import line_distance, line_points
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.device.wheels import BadWheels, BarePlant, read_wheels
from laptop.emulator.rig import Plugs, Rig

HEAD = "from ev3dev2.motor import *\nfrom ev3dev2.sensor.lego import *\nimport time\n"


@pytest.fixture
def run(tmp_path, capsys):
    """Run source text on a bare brick; the lines it printed, and the brick."""

    def run(source, motors="B=large C=large", wheels="left=B,right=C", sensors="", **options):
        extra = dict(motor.split("=") for motor in motors.split())
        pair = read_wheels(wheels) if wheels else None
        orders = read_sensors(sensors.split())
        script = tmp_path / "script.py"
        script.write_text(HEAD + source)
        plugs = Plugs(extra, sensors=orders, wheels=pair)
        with Rig(None, plant="cpu=0", plugs=plugs) as rig:
            outcome = rig.run(script, **options).outcome
        out, err = capsys.readouterr()
        assert (outcome.status, err) == (0, "")
        return out.splitlines(), rig.brick

    return run


def place(brick):
    """Where the robot is, cm, and where it looks, deg."""
    x, y, _ = brick.plant.tip()
    return x, y, math.degrees(brick.plant.heading)


@pytest.mark.parametrize("kind", ["large", "medium"])
def test_a_free_motor_at_every_port(run, kind):
    motors = " ".join(f"{port}={kind}" for port in "ABCD")
    lines, brick = run(
        "for port in 'ABCD':\n    m = Motor('out' + port)\n    m.on_for_rotations(30, 2)\n"
        "    time.sleep(0.5)\n    print(m.position)\n",
        motors,
        None,
    )
    assert [int(line) for line in lines] == pytest.approx(4 * [720], abs=4)
    assert [math.degrees(q) for q in brick.plant.q] == pytest.approx(4 * [720], abs=5)
    assert {(row.x, row.y, row.pen) for row in brick.record} == {(0.0, 0.0, 0)}


def test_an_arc_ends_where_geometry_says():
    """Wheels of 5 cm radius, 20 cm apart: by 3 and 1 rad on arcs of 20 cm around the middle."""
    plant = BarePlant(read_plant(), read_wheels("left=A,right=B,diameter=10,track=20,heading=0"))
    plant.add_bare_motor("A", "large")
    plant.add_bare_motor("B", "large")
    for k in range(1, 1001):
        plant.drives["A"].angle, plant.drives["B"].angle = 0.001 * k, 0.003 * k
        plant.step(0.001)
    turned = (15 - 5) / 20
    radius = (15 + 5) / 2 / turned
    assert plant.heading == pytest.approx(turned)
    assert plant.tip()[:2] == pytest.approx(
        (radius * math.sin(turned), radius * (1 - math.cos(turned))), abs=1e-5
    )


def test_a_robot_is_heavier_than_a_free_motor(run):
    source = (
        "m = LargeMotor('outB')\nm.run_direct(duty_cycle_sp=80)\n"
        "time.sleep(0.05)\nprint(m.position)\nm.stop()\n"
    )
    free, light, heavy = (
        int(run(source, wheels=wheels)[0][0])
        for wheels in (None, "left=B,right=C,mass=0.3", "left=B,right=C,mass=5")
    )
    assert free > light > heavy > 0


def test_the_librarys_odometry_agrees_with_the_true_way(run):
    """It starts where MoveDifferential's does: at 0, 0, looking along y."""
    lines, brick = run(
        "from ev3dev2.wheel import Wheel\n"
        "class Mine(Wheel):\n    def __init__(self): Wheel.__init__(self, 56, 22)\n"
        "robot = MoveDifferential(OUTPUT_B, OUTPUT_C, Mine, 120)\nrobot.odometry_start()\n"
        "robot.on_for_distance(SpeedRPM(40), 300)\nrobot.turn_right(SpeedRPM(30), 90)\n"
        "robot.on_arc_left(SpeedRPM(30), 150, 235)\ntime.sleep(0.3)\n"
        "print(robot.x_pos_mm / 10, robot.y_pos_mm / 10, math.degrees(robot.theta))\n"
        "robot.odometry_stop()\n",
    )
    x, y, heading = (float(word) for word in lines[-1].split())
    true = place(brick)
    assert (x, y) == pytest.approx(true[:2], abs=1.0)
    assert (heading - true[2] + 180) % 360 - 180 == pytest.approx(0, abs=3)
    # 30 cm ahead, right about, and a quarter of a circle of 15 cm to the left.
    assert true == pytest.approx((15, 45, 90), abs=2.5)


def test_a_gyro_upside_down_counts_the_other_way(run):
    source = (
        "one, two = GyroSensor('in1'), GyroSensor('in2')\none.angle, two.angle\n"
        "tank = MoveTank(OUTPUT_B, OUTPUT_C)\ntank.on_for_rotations(20, -20, 1)\ntime.sleep(1)\n"
        "print(one.angle, two.angle)\ntank.on(20, -20)\ntime.sleep(0.5)\n"
        "print(one.rate, two.rate)\n"
    )
    lines, _ = run(source, sensors="in1=gyro:robot in2=gyro:robot,flipped=1")
    for line in lines:
        one, two = map(int, line.split())
        assert one > 50
        assert two == pytest.approx(-one, abs=1)


def test_the_gyro_on_the_robot_closes_the_loop(run):
    lines, brick = run(
        "tank = MoveTank(OUTPUT_B, OUTPUT_C)\ntank.gyro = GyroSensor()\ntank.gyro.calibrate()\n"
        "tank.turn_degrees(SpeedPercent(5), 90)\nprint(tank.gyro.angle)\n"
        "tank.turn_left(SpeedPercent(5), 45)\nprint(tank.gyro.angle)\n",
        sensors="in4=gyro:robot",
    )
    assert [int(line) for line in lines] == pytest.approx([90, 45], abs=3)
    assert place(brick)[2] == pytest.approx(90 - 45, abs=4)


def test_the_gyro_keeps_the_robot_on_its_way(run):
    """It is turned off its way first, and told to go where it looked before."""
    lines, brick = run(
        "tank = MoveTank(OUTPUT_B, OUTPUT_C)\ntank.gyro = GyroSensor()\n"
        "tank.on_for_seconds(-10, 10, 0.4)\nprint(tank.gyro.angle)\n"
        "tank.follow_gyro_angle(kp=4, ki=0, kd=1, speed=SpeedPercent(20), target_angle=0,\n"
        "                       follow_for=follow_for_ms, ms=4000)\n",
        sensors="in4=gyro:robot",
    )
    x, y, heading = place(brick)
    assert int(lines[0]) < -15
    assert heading == pytest.approx(90, abs=3)
    assert y > 30


def test_the_robot_stops_before_the_wall(run):
    lines, brick = run(
        "tank, eye = MoveTank(OUTPUT_B, OUTPUT_C), UltrasonicSensor()\ntank.on(20, 20)\n"
        "while eye.distance_centimeters > 15: time.sleep(0.01)\ntank.off()\ntime.sleep(0.5)\n"
        "print(eye.distance_centimeters)\ntank.on_for_rotations(20, -20, 1)\n"
        "print(eye.distance_centimeters)\n",
        wheels="left=B,right=C,heading=0,x=10",
        sensors="in1=ultrasonic:wall,x=60",
    )
    assert float(lines[0]) == pytest.approx(60 - place_at(brick, 3.0), abs=0.11)
    assert 12 < float(lines[0]) <= 15
    assert float(lines[1]) == 255


def place_at(brick, before_end):
    """The robot's x so long before the end, s."""
    end = brick.record[-1].t
    return next(row.x for row in brick.record if row.t >= end - before_end)


@pytest.mark.parametrize("text", ["left=B", "left=B,right=B", "left=E,right=B", "wheel=3",
                                  "left=B,right=C,mass=0"])  # fmt: skip
def test_bad_wheels_are_refused_in_one_line(text):
    with pytest.raises(BadWheels) as refused:
        read_wheels(text)
    assert "\n" not in str(refused.value)


def test_an_outputs_mode_takes_its_motor_away_and_brings_it_back(run):
    lines, _ = run(
        "from ev3dev2 import DeviceNotFound\nfrom ev3dev2.port import LegoPort\n"
        "m = LargeMotor('outB')\nm.on_for_degrees(20, 90)\np, empty = LegoPort('outB'), "
        "LegoPort('outA')\nprint(p.driver_name, p.status, empty.status)\np.mode = 'dc-motor'\n"
        "print(p.mode, p.status)\n"
        "try: LargeMotor('outB')\nexcept DeviceNotFound: print('none')\n"
        "try: m.position\nexcept DeviceNotFound: print('gone')\n"
        "try: p.mode = 'pump'\nexcept ValueError: print('refused')\n"
        "p.mode = 'tacho-motor'\np.set_device = 'lego-ev3-l-motor'\nm = LargeMotor('outB')\n"
        "print(m.position)\nm.on_for_degrees(20, 90)\ntime.sleep(0.5)\nprint(m.position)\n",
        wheels=None,
    )
    *names, position = lines
    assert names == [
        "ev3-output-port tacho-motor no-motor",
        "dc-motor dc-motor",
        "none",
        "gone",
        "refused",
        "0",
    ]
    assert int(position) == pytest.approx(90, abs=2)


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0, 0), 0), ((1, 20), 1), ((-60, -30), 0), ((-30, 60), 0), ((-30, 62), 2), ((-30, 0), 30),
     ((-30 + 21, 30 + 28), 5), ((-3, 30), 3)],
)  # fmt: skip
def test_the_line_is_an_oval(point, distance):
    """Two straights of 60 cm, 60 cm apart, with half circles around (-30, 30) and (-30, -30)."""
    assert line_distance(*point) == pytest.approx(distance)


def test_the_lines_points_lie_on_it():
    points = line_points()
    assert points[0] == points[-1]
    assert max(line_distance(x, y) for x, y in points) < 1e-9
    length = sum(math.hypot(a[0] - b[0], a[1] - b[1]) for a, b in zip(points, points[1:]))
    assert length == pytest.approx(2 * 60 + 2 * math.pi * 30, abs=0.1)


def test_a_colour_sensor_crosses_the_line(run):
    """It turns on the spot, so that the sensor 8 cm ahead of it sweeps over the line."""
    lines, _ = run(
        "cs = ColorSensor()\nseen = [cs.reflected_light_intensity]\n"
        "tank = MoveTank('outB', 'outC')\ntank.on(-5, 5)\n"
        "for _ in range(60):\n    time.sleep(0.02)\n"
        "    seen.append(cs.reflected_light_intensity)\ntank.off()\nprint(*seen)\n"
        "print(cs.color_name)\n",
        sensors="in1=color:line",
    )
    seen = [int(word) for word in lines[0].split()]
    assert (seen[0], seen[-1]) == (6, 85)
    assert seen == sorted(seen)
    assert any(10 < light < 80 for light in seen)
    assert lines[1] == "White"


def test_what_the_library_opens_by_itself_is_the_device(run):
    """As GyroBalancer does, which reads and writes files in the device's folder."""
    lines, _ = run(
        "m = LargeMotor('outB')\nm.run_direct()\n"
        "duty, at = open(m._path + '/duty_cycle_sp', 'w'), open(m._path + '/position', 'rb')\n"
        "duty.truncate(0)\nduty.write('40')\nduty.flush()\ntime.sleep(1)\nat.seek(0)\n"
        "print(int(at.read().decode()) > 100)\nm.stop()\n"
        "try: open(m._path + '9/position')\nexcept FileNotFoundError: print('none')\n",
        wheels=None,
    )
    assert lines == ["True", "none"]
