"""Scripts as classes write them, one kind for each sensor and each way to drive, as they are.

What they print is worked out by hand from the values that they are given, and from the wheels'
5.6 cm on a track of 12 cm.
"""

import math

import pytest
from places import SCRIPTS

from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.sensor_environment import line_distance
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.device.wheels import read_wheels
from laptop.emulator.rig import Plugs, Rig

WHEELS = "left=B,right=C"
TANK = {"B": "large", "C": "large"}

RUNS = [
    ("sensor1_touch.py", {"presses": ["touch@1", "touch@2+0.7"]}),
    (
        "sensor2_colours.py",
        {
            "extra": {"A": "large", "D": "medium"},
            "sensors": [
                "in3=color:white:red@2:white@3:blue@4:white@4.5:red@5:none@6:green@6.5,ambient=12"
            ],
        },
    ),
    (
        "sensor3_sonar_parking.py",
        {"wheels": WHEELS + ",heading=0", "sensors": ["in3=ultrasonic:wall,x=60,heard=1"]},
    ),
    ("sensor4_gyro_square.py", {"wheels": WHEELS, "sensors": ["in2=gyro:robot"]}),
    (
        "sensor5_remote.py",
        {
            "wheels": WHEELS,
            "sensors": [
                "in4=infrared,buttons=none:top_left@1:none@2:top_left+top_right@3:none@4"
                ":bottom_right@5:none@6:beacon@7"
            ],
        },
    ),
    (
        "sensor6_beacon.py",
        {
            "wheels": WHEELS,
            "sensors": ["in4=infrared:44,2.heading=20:-20@2:0@3,2.beacon=-1:40@1:5@4"],
        },
    ),
    (
        "sensor7_nxt.py",
        {
            "sensors": [
                "in1=light:40,ambient=21", "in2=sound:10:80@5,low=30", "in3=nxt-ultrasonic:33.4"
            ]
        },
    ),
    ("move1_tank.py", {"wheels": WHEELS, "extra": {"A": "medium", "D": "medium"}}),
    ("move2_steering.py", {"wheels": WHEELS}),
    ("move3_joystick.py", {"wheels": WHEELS}),
    ("move4_differential.py", {"wheels": WHEELS}),
    ("move5_line.py", {"wheels": WHEELS, "sensors": ["in1=color:line,y=-1"]}),
    (
        "move6_control.py",
        {
            "args": ["tank"],
            "wheels": WHEELS,
            "sensors": ["in4=infrared,buttons=top_left:none@2:bottom_right@3"],
        },
    ),
    (
        "move6_control.py",
        {
            "args": ["balancer"],
            "extra": {"A": "large", "D": "large"},
            "sensors": ["in2=gyro"],
            "presses": ["touch@3"],
        },
    ),
]  # fmt: skip

IDS = [" ".join([name[:-3], *options.get("args", ())]) for name, options in RUNS]

DONE = {}


@pytest.fixture
def run(capsys):
    """Run one of RUNS, by its id; its lines, each as a list of words, and the brick."""

    def run(which, again=False, **changed):
        key = which, repr(changed)
        if again or key not in DONE:
            name, options = RUNS[IDS.index(which)]
            options = dict(options, **changed)
            wheels = read_wheels(options["wheels"]) if "wheels" in options else None
            extra = dict(TANK if wheels else {}, **options.get("extra", {}))
            orders = read_sensors(options.get("sensors", ()))
            presses = [read_press(press) for press in options.get("presses", ())]
            with Rig(None, plugs=Plugs(extra, sensors=orders, wheels=wheels)) as rig:
                run = rig.run(
                    SCRIPTS / name, *options.get("args", ()), presses=presses, timeout=100
                )
            outcome, brick = run.outcome, rig.brick
            out, err = capsys.readouterr()
            assert (outcome.status, outcome.reason, err) == (0, "ended", "")
            assert brick.driven() == []
            DONE[key] = [line.split() for line in out.splitlines()], brick
        return DONE[key]

    return run


def place(brick):
    """Where the robot is, cm, and where it looks, deg."""
    x, y, _ = brick.plant.tip()
    return x, y, math.degrees(brick.plant.heading)


@pytest.mark.short(every=5)
@pytest.mark.parametrize("which", IDS)
def test_a_script_repeats_exactly(run, which):
    lines, brick = run(which)
    same, other = run(which, again=True)
    assert lines == same
    assert brick.record == other.record


def test_touch(run):
    assert run("sensor1_touch")[0] == [["bumps", "2"], ["longest", "0.7"]]


def test_colours(run):
    lines, brick = run("sensor2_colours")
    assert lines[0] == ["white", "85", "(255,", "255,", "255)", "12"]
    assert lines[1:3] == [["Red", "Blue", "Red", "Green"], ["thrown", "2"]]
    # Green sends back 10, 35 and 15 %; its hue is (2 + (15 - 10) / (35 - 10)) / 6 of a round.
    assert lines[3] == ["raw", "(35,", "122,", "52)", "hsv", "0.37"]
    assert math.degrees(brick.plant.drives["D"].angle) == pytest.approx(180, abs=5)


def test_sonar_parking(run):
    lines, brick = run("sensor3_sonar_parking")
    assert lines[0] == ["inches", "23.6"]  # 60 cm / 2.54
    assert float(lines[1][1]) == pytest.approx(10, abs=0.5)
    x, y, heading = place(brick)
    assert (x, y) == pytest.approx((60 - float(lines[1][1]), 0), abs=0.15)
    assert heading == pytest.approx(0, abs=1)
    assert lines[2] == ["heard", "True"]


def test_gyro_square(run):
    lines, brick = run("sensor4_gyro_square")
    assert int(lines[0][1]) == pytest.approx(360, abs=3)
    assert [int(word) for word in lines[1][1:]] == pytest.approx([0, 0], abs=2)
    assert int(lines[2][1]) == pytest.approx(180, abs=3)
    at_end_of_squares = [row for row in brick.record if row.q[-1] < math.radians(90 - 357)][0]
    assert (at_end_of_squares.x, at_end_of_squares.y) == pytest.approx((0, 0), abs=3)
    side = 1.5 * math.pi * 5.6
    assert max(row.x for row in brick.record) == pytest.approx(side, abs=2)


def test_remote_control(run):
    lines, _ = run("sensor5_remote")
    # Two presses of the left wheel, two of the right one, each let go again; of 1 s at 300 deg/s.
    assert lines == [["told", "8"], ["600", "0"]]


def test_beacon(run):
    lines, brick = run("sensor6_beacon")
    assert lines[0] == ["ahead", "44", "on", "channel", "1", "(0,", "None)"]
    assert lines[1] == ["lost", "True", "near", "5", "at", "0"]
    # For 1 s an arc to the right with 210 and 42 deg/s, for 1 s one to the left, 1 s ahead.
    roll = math.pi * 5.6 / 360
    turned = (210 - 42) * roll / 12
    arc = (210 + 42) / 2 * roll * math.sin(turned) / turned
    x, y, heading = place(brick)
    assert heading == pytest.approx(90, abs=2)
    assert max(row.x for row in brick.record) > 0.5
    assert y == pytest.approx(2 * arc + 210 * roll, rel=0.05)


def test_sensors_of_the_nxt(run):
    lines, _ = run("sensor7_nxt")
    assert lines[:2] == [
        ["nxt-analog", "ev3-input-port", f"['{driver}']"]
        for driver in ("lego-nxt-light", "nxt-analog")
    ]
    assert " ".join(lines[2]) == "not before it is told"
    assert lines[3] == ["light", "40.0", "21.0"]
    assert float(lines[4][2].rstrip(",")) == pytest.approx(3.0, abs=0.1)  # 5 s, less two waits
    assert lines[4][3:] == ["quiet", "10.0,", "low", "30.0"]
    assert lines[5] == ["far", "33", "cm"]


def test_tank(run):
    lines, _ = run("move1_tank")
    assert lines[:2] == [["at", "rest", "True", "held", "True"], ["runs", "True"]]
    # 210, 360, 360, 200 deg and then what it rolls on; 180, 180, -360, 200 deg.
    assert [int(word) for word in lines[2]] == pytest.approx([1130 + 22, 200 + 22], abs=15)
    assert lines[3] == ["0", "0"]
    assert [int(word.strip("[,]")) for word in lines[4]] == pytest.approx([180, 180], abs=2)


def test_steering(run):
    lines, _ = run("move2_steering")
    turned = {" ".join(fields[:-2]): [int(word) for word in fields[-2:]] for fields in lines}
    assert turned["straight"] == pytest.approx([720, 720], abs=3)
    assert turned["curve"] == pytest.approx([400, 200], abs=3)  # 25 of 50 to one wheel alone
    assert turned["one wheel"] == pytest.approx([0, 360], abs=3)
    assert turned["on the spot"] == pytest.approx([210, -210], abs=8)
    assert turned["back"] == pytest.approx([-210, 210], abs=8)


def test_joystick(run):
    lines, _ = run("move3_joystick")
    # A quarter ahead and to the left is 35 % of the right wheel, and none of the left.
    assert [[float(word) for word in fields[2:]] for fields in lines] == [
        [50, 50], [50, -50], [-50, -50], [0, 40],
    ]  # fmt: skip


def test_differential(run):
    lines, brick = run("move4_differential")
    at = {fields[0]: [float(word) for word in fields[1:]] for fields in lines}
    assert at["ahead"] == pytest.approx([0, 20, 90], abs=1)
    # A quarter of a circle of 15 cm to the right.
    assert at["arc"][:2] == pytest.approx([15, 35], abs=1)
    assert (at["arc"][2] + 180) % 360 - 180 == pytest.approx(0, abs=3)
    assert at["left"] == pytest.approx([15, 35, 90], abs=3)
    assert at["west"] == pytest.approx([15, 35, 180], abs=3)
    assert at["home"][:2] == pytest.approx([0, 0], abs=2)
    assert place(brick)[:2] == pytest.approx(at["home"][:2], abs=1)


def test_line(run):
    lines, brick = run("move5_line")
    # On the edge of the line the sensor, 8 cm ahead and 1 cm to the right, sees both by halves.
    assert abs(int(lines[0][1]) - 45.5) <= 0.5
    assert lines[1] == ["followed"]
    beside = [
        line_distance(
            row.x + 8 * math.cos(row.q[-1]) + math.sin(row.q[-1]),
            row.y + 8 * math.sin(row.q[-1]) - math.cos(row.q[-1]),
        )
        for row in brick.record
    ]
    assert max(beside) < 2
    assert place(brick)[2] > 90 + 180  # round the first half circle at least


def test_line_is_lost_where_there_is_none(run):
    lines, _ = run("move5_line", sensors=["in1=color:60:90@2"])
    assert lines == [["light", "60"], ["lost"]]


def test_control(run):
    lines, _ = run("move6_control tank")
    # 2 s at 300 deg/s each, the second one backwards.
    assert lines == [["driven", "600", "-600"]]
    lines, _ = run("move6_control balancer")
    # To go ahead it would first lean ahead, and so rolls back: as it cannot lean here, on and on.
    left, right = (int(word) for word in lines[0][1:])
    assert left < -100
    assert left == pytest.approx(right, abs=10)
    assert lines[1] == ["threads", "1"]
