"""Every sensor through the real library's own classes: values, units, modes and what they cost.

Expected values are computed by hand from what ev3dev documents for its drivers.
"""

import types

import pytest

from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.device.sensor_kinds import BUTTONS, KINDS
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.device.sysfs import Sysfs
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World

COST = 0.001
SWITCH = 0.02

HEAD = (
    "import time\nfrom ev3dev2 import DeviceNotFound\n"
    "from ev3dev2.port import LegoPort\nfrom ev3dev2.sensor import *\n"
    "from ev3dev2.sensor.lego import *\n"
)


@pytest.fixture
def run(tmp_path, capsys):
    """Run source text with sensors; the lines it printed.  It must end well."""

    def run(orders, source, *presses):
        world = World()
        sysfs = Sysfs(world, COST)
        brick = types.SimpleNamespace(world=world, sysfs=sysfs, slowness=0, reset_motors=list)
        devices = Peripherals(world, sysfs, sensors=read_sensors(orders.split()))
        script = tmp_path / "script.py"
        script.write_text(HEAD + source)
        outcome = run_script(
            brick, str(script), peripherals=devices, presses=[read_press(p) for p in presses]
        )
        out, err = capsys.readouterr()
        assert (outcome.status, err) == (0, "")
        run.accesses = sysfs.accesses
        return out.splitlines()

    return run


def test_touch_is_pressed_by_its_values_and_by_a_hand(run):
    lines = run(
        "in1=touch:0:1@1:0@2 in2=nxt-touch",
        "one, two = TouchSensor(INPUT_1), TouchSensor(INPUT_2)\nstart = time.time()\n"
        "def at(t):\n    time.sleep(start + t - time.time())\n"
        "    print(one.is_pressed, two.is_pressed)\n"
        "for t in (0.5, 1.5, 2.5, 3.5): at(t)\n"
        "print(two.driver_name)\n",
        "touch:in2@1.2+0.5",
        "touch@3.4+0.3",
    )
    assert lines == ["0 0", "1 1", "0 0", "1 1", "lego-nxt-touch"]


@pytest.mark.parametrize(
    ("surface", "number", "name"),
    [
        ("none", 0, "NoColor"),
        ("black", 1, "Black"),
        ("blue", 2, "Blue"),
        ("green", 3, "Green"),
        ("yellow", 4, "Yellow"),
        ("red", 5, "Red"),
        ("white", 6, "White"),
        ("brown", 7, "Brown"),
    ],
)
def test_colour_of_every_surface(run, surface, number, name):
    lines = run(f"in3=color:{surface}", "c = ColorSensor()\nprint(c.color, c.color_name)\n")
    assert lines == [f"{number} {name}"]


def test_colour_sensor_has_five_kinds_of_values(run):
    lines = run(
        "in3=color:20,ambient=7,green=40,blue=10",
        "c = ColorSensor(INPUT_3)\n"
        "print(c.reflected_light_intensity, c.units, c.num_values, c.bin_data_format)\n"
        "print(c.ambient_light_intensity, c.mode)\n"
        "print(c.raw, c.value(3), c.num_values, repr(c.units))\n"
        "c.mode = 'REF-RAW'\nprint(c.value(1) - c.value(0), c.num_values)\n"
        "c.calibrate_white()\nprint(c.rgb)\n",
    )
    # 3.5 per percent: 70, 140, 35; the lamp off reads 600.
    assert lines == [
        "20 pct 1 s8",
        "7 COL-AMBIENT",
        "(70, 140, 35) 600 4 ''",
        "70 2",
        "(255, 255, 255)",
    ]


def test_red_light_cannot_tell_red_from_white(run):
    """Reflected light is measured with the red lamp alone."""
    lines = run("in1=color:red:blue@1", "c = ColorSensor()\nprint(c.reflected_light_intensity)\n"
                "time.sleep(1)\nprint(c.reflected_light_intensity)\n")  # fmt: skip
    assert lines == ["65", "8"]


def test_ultrasonic_measures_in_two_units_and_listens(run):
    lines = run(
        "in2=ultrasonic:40,heard=1",
        "u = UltrasonicSensor(INPUT_2)\n"
        "print(u.distance_centimeters, u.value(), u.decimals, u.units)\n"
        "print(round(u.distance_inches, 6), u.value(), u.units)\n"
        "print(u.other_sensor_present, u.mode)\nprint(u.distance_centimeters_continuous)\n",
    )
    # 40 cm / 2.54 = 15.748 in, to a tenth.
    assert lines == ["40.0 400 1 cm", "15.7 157 in", "True US-LISTEN", "40.0"]


@pytest.mark.parametrize(
    ("kind", "distance", "cm", "inches"),
    [
        ("ultrasonic", "250", "250.0", "98.4"),
        ("ultrasonic", "251", "255.0", "100.3"),
        ("ultrasonic", "999", "255.0", "100.3"),
        ("nxt-ultrasonic", "40.6", "41", "16.0"),
        ("nxt-ultrasonic", "999", "255", "100.0"),
    ],
)
def test_ultrasonic_ends_where_it_hears_no_echo(run, kind, distance, cm, inches):
    lines = run(
        f"in4={kind}:{distance}",
        "u = Sensor(INPUT_4)\nfor name in ('US-DIST-CM', 'US-DIST-IN'):\n"
        "    u.mode = name\n    print(u.value() / 10 ** u.decimals)\n",
    )
    assert [float(line) for line in lines] == [float(cm), float(inches)]


def test_a_single_measurement_stays(run):
    lines = run(
        "in1=ultrasonic:10..60/5s",
        "u = UltrasonicSensor()\nprint(u.distance_centimeters_ping, u.mode)\ntime.sleep(2)\n"
        "print(u.value(), u.distance_centimeters_ping)\n",
    )
    # 10 cm/s from 10 cm on; some accesses and a change of mode later.
    first, mode = lines[0].split()
    again, second = lines[1].split()
    assert (mode, again) == ("US-SI-CM", str(round(float(first) * 10)))
    assert float(first) == pytest.approx(10.3, abs=0.21)
    assert float(second) == pytest.approx(float(first) + 20.3, abs=0.21)


def test_gyro_turns_with_its_ramp_and_is_reset(run):
    lines = run(
        "in2=gyro:0..90/3s",
        "g = GyroSensor(INPUT_2)\ntime.sleep(1)\nprint(g.angle, g.units)\nprint(g.rate, g.units)\n"
        "print(g.angle)\ntime.sleep(1)\nprint(g.angle_and_rate, g.num_values)\ntime.sleep(0.5)\n"
        "print(g.value(0), g.bin_data('<hh'))\ng.mode = 'GYRO-ANG'\ntime.sleep(0.1)\n"
        "g.reset()\nprint(g.angle)\n",
    )
    # 30 deg/s; what was entered anew counts from there.
    assert lines == ["30 deg", "30 d/s", "0", "(0, 30) 2", "15 (15, 30)", "0"]


@pytest.mark.parametrize("again", ["GYRO-ANG", "GYRO-RATE"])
def test_a_gyro_whose_mode_is_written_again_keeps_its_angle_where_it_is_the_same(run, again):
    lines = run(
        "in2=gyro:0..90/3s",
        "g = GyroSensor(INPUT_2)\ng.mode = 'GYRO-ANG'\ntime.sleep(1)\n"
        f"g.mode = '{again}'\ng.mode = 'GYRO-ANG'\nprint(g.angle)\n",
    )
    # 30 deg/s since 20 ms before the second, and some accesses.
    assert 30 <= int(lines[0]) <= 33 if again == "GYRO-ANG" else int(lines[0]) <= 1


def test_gyro_drift_is_integrated(run):
    lines = run(
        "in2=gyro,rate=2:-3@4",
        "g = GyroSensor()\nprint(g.rate)\ng.angle\nstart = time.time()\ntime.sleep(3)\n"
        "print(g.angle)\ntime.sleep(2)\nprint(g.angle, g.rate)\n",
    )
    # 2 deg/s up to 4 s and -3 deg/s from there, since some 0.05 s: 6, then 2 x 3.95 - 3 x 1.05.
    assert lines == ["2", "6", "5 -3"]


def test_the_drift_of_a_gyro_upside_down_is_its_own(run):
    lines = run(
        "in2=gyro:0..90/3s,rate=2,flipped=1",
        "g = GyroSensor()\nprint(g.rate)\ng.angle\ntime.sleep(2)\nprint(g.angle)\n",
    )
    assert lines == ["-28", "-56"]  # it turns by 30 deg/s


def test_gyro_calibration_takes_two_seconds_and_sets_zero(run):
    lines = run(
        "in1=gyro:50,tilt=12..32/10s",
        "g = GyroSensor()\nstart = time.time()\ng.calibrate()\n"
        "print(g.angle, round(time.time() - start, 1))\n"
        "g.tilt_angle\ntime.sleep(5)\nprint(g.tilt_angle, g.tilt_rate)\n",
    )
    assert lines == ["0 2.0", "10 2"]


def test_infrared_sees_beacons_of_four_channels(run):
    lines = run(
        "in4=infrared:35,heading=-10,beacon=60,3.heading=25,3.beacon=0..100/4s",
        "ir = InfraredSensor(INPUT_4)\nprint(ir.proximity, ir.units)\n"
        "print(ir.heading_and_distance(1), ir.heading_and_distance(2), ir.heading(3))\n"
        "time.sleep(2)\nprint(ir.distance(channel=3), ir.num_values)\n"
        "print(list(ir.bin_data('<8b'))[:4])\n",
    )
    assert lines[:2] == ["35 pct", "(-10, 60) (0, None) 25"]
    assert lines[2].split()[0] in ("51", "52", "53")
    assert lines[3] == "[-10, 60, 0, -128]"


@pytest.mark.parametrize("number", range(12))
def test_remote_control_buttons(run, number):
    """The library's own table says what each number means."""
    word = BUTTONS[number]
    lines = run(
        f"in1=infrared,buttons=none:{word}@1,2.buttons={word}",
        "ir = InfraredSensor()\nprint(ir.buttons_pressed(), ir.beacon(channel=1))\ntime.sleep(1)\n"
        "print(sorted(ir.buttons_pressed(1)), ir.buttons_pressed(1) == ir._BUTTON_VALUES["
        f"{number}], ir.buttons_pressed(2) == ir.buttons_pressed(1))\n",
    )
    wanted = [] if word == "none" else sorted(word.split("+"))
    assert lines == ["[] False", f"{wanted} True True"]


@pytest.mark.parametrize(
    ("word", "value"),
    [("none", 384), ("top_left", 287), ("bottom_left", 300), ("top_right", 330),
     ("bottom_right", 390), ("top_left+top_right", 339), ("bottom_left+bottom_right", 428),
     ("beacon", 262)],
)  # fmt: skip
def test_remote_control_as_bits(run, word, value):
    """One of the two values that ev3dev documents for each."""
    both = {384: {262, 270, 384}}.get(value, {value, value - 8})
    (line,) = run(
        f"in1=infrared,buttons={word}",
        "ir = InfraredSensor()\nir.mode = ir.MODE_IR_REM_A\nprint(ir.value())\n",
    )
    assert int(line) in both


def test_infrared_calls_what_waits_for_a_button(run):
    lines = run(
        "in1=infrared,buttons=none:top_left@1:none@1.5",
        "ir = InfraredSensor()\nir.on_channel1_top_left = lambda state: print('left', state)\n"
        "for _ in range(200):\n    ir.process()\n    time.sleep(0.01)\n",
    )
    assert lines == ["left True", "left False"]


def test_sound_and_light_of_the_nxt(run):
    lines = run(
        "in1=sound:12.34,low=9 in2=light:55.5,ambient=21",
        "s, light = SoundSensor(), LightSensor()\n"
        "print(round(s.sound_pressure, 3), round(s.sound_pressure_low, 3), s.decimals)\n"
        "print(light.reflected_light_intensity, light.ambient_light_intensity, light.units)\n",
    )
    assert lines == ["12.3 9.0 1", "55.5 21.0 pct"]


def test_a_mode_gives_no_other_ones_values(run):
    lines = run(
        "in1=gyro:5 in2=color:30",
        "g, c = GyroSensor(), ColorSensor()\n"
        "for sensor, n, mode in ((g, 1, None), (c, 1, None), (c, 4, 'RGB-RAW')):\n"
        "    if mode: sensor.mode = mode\n"
        "    try: print(sensor.value(n))\n"
        "    except OSError as error: print(error.errno)\n"
        "try: c.mode = 'GYRO-ANG'\nexcept ValueError: print('refused')\n"
        "try: c.mode = 'COL-CAL'\nexcept OSError as error: print(type(error).__name__)\n"
        "print(c.mode)\n",
    )
    assert lines == ["6", "6", "6", "refused", "TimeoutError", "RGB-RAW"]


def test_a_change_of_mode_takes_its_time_while_others_run(run):
    lines = run(
        "in2=color",
        "import threading\nc = ColorSensor()\nc.mode\nstart = time.time()\nc.mode = 'COL-COLOR'\n"
        "print(round(time.time() - start, 4))\nstart = time.time()\nc.mode\nc.value()\n"
        "print(round(time.time() - start, 4))\nticks = []\n"
        "def tick():\n    while len(ticks) < 3:\n        time.sleep(0.005)\n"
        "        ticks.append(time.time())\n"
        "t = threading.Thread(target=tick)\nt.start()\nc.mode = 'COL-REFLECT'\n"
        "print(len(ticks))\nt.join()\n",
    )
    assert lines == [str(COST + SWITCH), str(2 * COST), "3"]


@pytest.mark.parametrize("name", sorted(KINDS))
def test_every_mode_of_every_sensor_can_be_read(run, name):
    """By what a mode says of itself; modes that a real sensor does not come back from apart."""
    lines = run(
        f"in3={name}",
        "s = Sensor(INPUT_3)\nprint(s.driver_name, s.address, sorted(s.modes))\n"
        "import os\nfor mode in s.modes:\n    if mode in ('COL-CAL', 'IR-S-ALT', 'IR-CAL'):\n"
        "        continue\n    s.mode = mode\n    s._bin_data_size = None\n"
        "    values = [s.value(n) for n in range(s.num_values)]\n"
        "    size = {'s8': 1, 'u8': 1, 's16': 2, 's32': 4}[s.bin_data_format] * s.num_values\n"
        "    print(mode, s.mode == mode, len(s.bin_data()) == size, s.decimals, s.units)\n",
    )
    kind = KINDS[name]
    driver, address, *_ = lines[0].split()
    assert driver == kind.driver
    assert address == "ev3-ports:in3" + (":i2c1" if kind.connection == "nxt-i2c" else "")
    assert [line.split()[1:3] for line in lines[1:]] == [["True", "True"]] * (len(lines) - 1)
    assert len(lines) - 1 == len([mode for mode in kind.modes if mode.measure])


def test_noise_is_of_the_sigma_said_and_the_same_in_every_run(run):
    source = (
        "u = UltrasonicSensor()\n"
        "for _ in range(2000):\n    print(u.value())\n    time.sleep(0.01)\n"
    )
    values = [int(line) / 10 for line in run("in1=ultrasonic:100,noise=0.5", source)]
    mean = sum(values) / len(values)
    sigma = (sum((value - mean) ** 2 for value in values) / len(values)) ** 0.5
    assert (mean, sigma) == (pytest.approx(100, abs=0.05), pytest.approx(0.5, abs=0.04))
    assert [int(line) / 10 for line in run("in1=ultrasonic:100,noise=0.5", source)] == values
    assert set(run("in1=ultrasonic:100", source)) == {"1000"}


# Ports


@pytest.mark.parametrize("kind", ["touch", "gyro", "nxt-ultrasonic"])
def test_a_sensor_without_commands_lists_none_and_takes_none(run, kind):
    lines = run(
        "in1=" + kind,
        "import errno\nsensor = Sensor(INPUT_1)\nprint(sensor.commands)\n"
        "try:\n    sensor.command = 'RESET'\n"
        "except OSError as error:\n    print(errno.errorcode[error.errno])\n"
        "except ValueError as error:\n    print(errno.errorcode[error.__cause__.errno])\n",
    )
    assert lines == ["[]", "EINVAL"]


def test_an_empty_input_has_no_sensor(run):
    lines = run(
        "in1=none in2=none in3=none in4=none",
        "try: TouchSensor()\nexcept DeviceNotFound: print('none')\n"
        "p = LegoPort('in1')\nprint(p.mode, p.status, p.driver_name)\n",
    )
    assert lines == ["none", "auto no-sensor ev3-input-port"]


def test_a_sound_sensor_is_a_voltage_until_the_port_is_told(run):
    lines = run(
        "in1=sound:50",
        "p = LegoPort(INPUT_1)\nprint(p.mode, p.status, sorted(p.modes)[0])\np.mode = 'auto'\n"
        "print(p.status)\ntime.sleep(0.6)\nprint(p.status)\n"
        "v = Sensor(INPUT_1)\nprint(v.driver_name, v.num_values, v.decimals, v.units)\n"
        "try: SoundSensor(INPUT_1)\nexcept DeviceNotFound: print('not yet')\n"
        "p.set_device = 'lego-nxt-sound'\nprint(SoundSensor(INPUT_1).sound_pressure)\n"
        "try: v.value()\nexcept DeviceNotFound: print('gone')\n"
        "p.set_device = 'lego-nxt-light'\n"
        "try: SoundSensor(INPUT_1)\nexcept DeviceNotFound: print('another')\n",
    )
    assert lines == [
        "nxt-analog nxt-analog auto",
        "no-sensor",
        "nxt-analog",
        "nxt-analog 1 3 V",
        "not yet",
        "50.0",
        "gone",
        "another",
    ]


def test_a_light_sensor_of_the_nxt_is_known_by_itself(run):
    lines = run(
        "in1=light:50,ambient=100",
        "p = LegoPort(INPUT_1)\nprint(p.mode, p.status, LightSensor().driver_name)\n"
        "p.mode = 'nxt-analog'\nv = Sensor(INPUT_1)\nprint(v.driver_name, v.value())\n"
        "p.set_device = 'lego-nxt-light'\nprint(LightSensor().ambient_light_intensity)\n"
        "p.mode = 'auto'\ntime.sleep(0.6)\nprint(LightSensor().reflected_light_intensity)\n",
    )
    # ev3dev documents 0.773 V for 100 % of light around.
    assert lines == ["auto nxt-analog lego-nxt-light", "nxt-analog 773", "100.0", "50.0"]


def test_a_ports_mode_takes_a_sensor_away_and_brings_it_back(run):
    lines = run(
        "in2=gyro:20",
        "g = GyroSensor()\np = LegoPort(INPUT_2)\nprint(p.status)\n"
        "try: p.set_device = 'lego-ev3-gyro'\nexcept OSError as error: print(error.errno)\n"
        "try: p.mode = 'dreaming'\nexcept ValueError: print('refused')\n"
        "for mode in ('raw', 'nxt-i2c', 'ev3-uart'):\n    p.mode = mode\n    time.sleep(0.6)\n"
        "    print(p.mode, p.status, len(list(list_sensors(driver_name='lego-ev3-gyro'))))\n"
        "try: g.angle\nexcept DeviceNotFound: print('gone')\nprint(GyroSensor().angle)\n",
    )
    assert lines == ["ev3-uart", "95", "refused", "raw raw 0", "nxt-i2c nxt-i2c 0",
                     "ev3-uart ev3-uart 1", "gone", "0"]  # fmt: skip
