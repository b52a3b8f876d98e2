"""Sensors that see the emulated world: the arm's true tip, and the true turning of a link."""

import math

import pytest

from laptop.emulator.device.sensor_orders import BadSensor, read_sensors
from laptop.emulator.rig import Plugs, Rig
from shared.arm_description import find_arm, read_arm

HEAD = "from ev3dev2.motor import *\nfrom ev3dev2.sensor.lego import *\nimport time\n"


@pytest.fixture
def run(tmp_path, capsys):
    """Run source text on an arm that starts at angles in deg; what it printed, and the brick."""

    def run(arm, angles, orders, source):
        start = [math.radians(angle) for angle in angles]
        sensors = read_sensors(orders.split())
        script = tmp_path / "script.py"
        script.write_text(HEAD + source)
        with Rig(arm, plant="cpu=0", start=start, plugs=Plugs(sensors=sensors)) as rig:
            outcome = rig.run(script).outcome
        out, err = capsys.readouterr()
        assert (outcome.status, err) == (0, "")
        return [float(word) for word in out.split()], rig.brick

    return run


def test_ultrasonic_sees_the_tip(run):
    """Of a planar arm with links of 11.3 and 9.5 cm, from (20, 10)."""
    (distance,), _ = run(
        "planar",
        (30, 45),
        "in2=ultrasonic:tip,x=20,y=10",
        "print(UltrasonicSensor().distance_centimeters)\n",
    )
    x = 11.3 * math.cos(math.radians(30)) + 9.5 * math.cos(math.radians(75))
    y = 11.3 * math.sin(math.radians(30)) + 9.5 * math.sin(math.radians(75))
    assert distance == pytest.approx(math.hypot(x - 20, y - 10), abs=0.051)


def test_ultrasonic_sees_the_tip_in_space(run):
    """From straight below the tip of an arm that is stretched out: its height above the table."""
    arm = read_arm(find_arm("spatial"))
    base, shoulder, elbow = arm.joints
    reach = shoulder.link + elbow.link
    (distance,), brick = run(
        "spatial",
        (0, 0, 0),
        f"in2=ultrasonic:tip,x={reach}",
        "print(UltrasonicSensor().distance_centimeters)\n",
    )
    assert distance == pytest.approx(base.link, abs=0.2)  # it sags a little within its play


def test_gyro_sits_on_a_link(run):
    """That of the forearm turns with both joints, clockwise where they go counter-clockwise."""
    numbers, brick = run(
        "planar",
        (0, 0),
        "in1=gyro:shoulder in2=gyro:elbow",
        "one, two = GyroSensor('in1'), GyroSensor('in2')\n"
        "a, b = LargeMotor('outA'), LargeMotor('outB')\n"
        "a.on_for_degrees(20, 90)\ntime.sleep(1)\nb.on_for_degrees(20, 60)\ntime.sleep(1)\n"
        "print(one.angle, two.angle, one.rate, two.rate)\n",
    )
    q1, q2 = (math.degrees(angle) for angle in brick.plant.q)
    assert abs(q1) > 20
    assert abs(q2) > 20
    assert numbers[0] == pytest.approx(-q1, abs=0.51)
    assert numbers[1] == pytest.approx(-q1 - q2, abs=0.51)
    assert numbers[2:] == [0, 0]


def test_gyro_rate_is_that_of_the_link(run):
    """Its mean while the base turns, against the angle between."""
    numbers, _ = run(
        "spatial",
        (0, 30, -30),
        "in1=gyro:base",
        "g = GyroSensor()\ng.angle_and_rate\nm = LargeMotor('outA')\nm.on(20)\ntime.sleep(0.3)\n"
        "first, start, rates = g.value(0), time.time(), []\n"
        "while time.time() < start + 0.5: rates.append(g.value(1))\n"
        "took = time.time() - start\nprint(g.value(0) - first, took * sum(rates) / len(rates))\n"
        "m.off()\n",
    )
    assert abs(numbers[0]) > 20
    assert numbers[1] == pytest.approx(numbers[0], abs=1.5)


@pytest.mark.parametrize("word", ["wall", "nonsense"])
def test_what_is_not_there_is_refused(run, word):
    order = "in1=ultrasonic:wall" if word == "wall" else "in1=gyro:base"
    with pytest.raises(BadSensor, match="elbow"):
        run("planar", (0, 0), order, "")
