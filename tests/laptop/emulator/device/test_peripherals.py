"""The brick's buttons, sensors, lights, sound and screen, through the real library's own code."""

import os
import types
import wave

import pytest

from laptop.emulator.device import peripherals
from laptop.emulator.device.buttons import EV_KEY, BadPress, KeyDevice, Press, read_press
from laptop.emulator.device.sensor_orders import BadSensor, read_sensors
from laptop.emulator.device.sysfs import Sysfs
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.world import World

COST = 0.001


@pytest.fixture
def brick():
    """A brick without motors."""
    world = World()
    sysfs = Sysfs(world, COST)
    return types.SimpleNamespace(world=world, sysfs=sysfs, slowness=0, reset_motors=list)


@pytest.fixture
def devices(brick):
    return peripherals.Peripherals(brick.world, brick.sysfs, voltage=lambda: 7.4)


@pytest.fixture
def run(tmp_path, brick, devices, capsys):
    """Run source text with presses; the lines it printed.  It must end well."""

    def run(source, *presses, **options):
        script = tmp_path / "script.py"
        script.write_text(source)
        outcome = run_script(
            brick,
            str(script),
            peripherals=devices,
            presses=[read_press(p) for p in presses],
            **options,
        )
        out, err = capsys.readouterr()
        assert (outcome.status, err) == (0, "")
        return out.splitlines()

    return run


@pytest.mark.parametrize(
    ("text", "press"),
    [
        ("enter@2.0", Press("enter", 2.0, 0.2)),
        ("back@3", Press("backspace", 3.0, 0.2)),
        ("touch@.5+1.5", Press("touch", 0.5, 1.5)),
        ("touch:in3@4+0.01", Press("touch:in3", 4.0, 0.01)),
    ],
)
def test_read_press(text, press):
    assert read_press(text) == press


@pytest.mark.parametrize(
    "text", ["enter", "enter@", "enter@-1", "ok@2", "enter@nan", "touch:in5@1"]
)
def test_bad_press_is_refused_in_one_line_that_names_it(text):
    with pytest.raises(BadPress) as error:
        read_press(text)
    assert repr(text) in str(error.value)
    assert "\n" not in str(error.value)


BUTTON = "from ev3dev2.button import Button\nimport time\nb = Button()\nt0 = time.time()\n"


def test_buttons_are_seen_while_they_are_down(run):
    lines = run(
        BUTTON + "seen = []\n"
        "while time.time() < t0 + 3:\n"
        "    if not seen or seen[-1][1] != b.buttons_pressed:\n"
        "        seen.append((round(time.time() - t0, 1), b.buttons_pressed))\n"
        "    time.sleep(0.02)\n"
        "for entry in seen: print(*entry)\n",
        "up@1+0.5", "enter@2",
    )  # fmt: skip
    assert lines == ["0.0 []", "1.0 ['up']", "1.5 []", "2.0 ['enter']", "2.2 []"]


@pytest.mark.parametrize("name", ["up", "down", "left", "right", "enter"])
def test_each_button_has_its_property(run, name):
    lines = run(
        BUTTON + "while not b.any(): time.sleep(0.01)\n"
        f"print(b.{name}, b.check_buttons(['{name}']), b.buttons_pressed)\n",
        name + "@0.5",
    )
    assert lines == [f"True True ['{name}']"]


def test_waits_of_the_library(run):
    lines = run(
        BUTTON + "for wait in (lambda: b.wait_for_pressed('enter'),\n"
        "             lambda: b.wait_for_released('enter'),\n"
        "             lambda: b.wait_for_bump(['left', 'right']),\n"
        "             lambda: b.wait_for_pressed(['up'], timeout_ms=500)):\n"
        "    print(wait(), round(time.time() - t0, 1))\n",
        "enter@1+0.4", "left@2+1", "right@2.5+1", "down@6+2",
    )  # fmt: skip
    # The library looks at the clock only when a button moves: its time-out comes at the next event.
    assert lines == ["True 1.0", "True 1.4", "True 3.5", "False 6.0"]


def test_a_press_that_lasted_before_the_wait_began_is_not_an_event(run):
    lines = run(
        BUTTON + "time.sleep(1.5)\nb.wait_for_pressed('enter')\n"
        "print(round(time.time() - t0, 1))\n",
        "enter@1+1", "up@1.8+0.1",
    )  # fmt: skip
    assert lines == ["1.8"]


def test_handlers_are_called_by_process_and_process_forever(run):
    lines = run(
        "import sys\n" + BUTTON + "def left(down): print('left', down)\n"
        "def enter(down): sys.exit()\n"
        "b.on_left = left\nb.on_enter = enter\n"
        "b.on_change = lambda changes: print(changes)\n"
        "b.process()\nb.process_forever()\n",
        "left@1", "enter@2",
    )  # fmt: skip
    assert lines == ["left True", "[('left', True)]", "left False", "[('left', False)]"]


def test_each_look_at_the_buttons_is_an_access(run, brick):
    run(BUTTON + "for _ in range(10): b.buttons_pressed\n", aftermath=0)
    assert brick.sysfs.accesses == 10
    assert brick.world.now() == pytest.approx(10 * COST, abs=1e-4)


TOUCH = "from ev3dev2.sensor.lego import TouchSensor\nimport time\nt0 = time.time()\n"


@pytest.mark.parametrize("port", ["", "INPUT_1", "INPUT_4", "'in2'"])
def test_touch_sensor_is_at_every_port(run, port):
    lines = run(
        "from ev3dev2.sensor import INPUT_1, INPUT_4\n" + TOUCH + f"ts = TouchSensor({port})\n"
        + "print(ts.is_pressed, ts.mode)\n"
        "ts.wait_for_bump()\nprint(round(time.time() - t0, 1), ts.is_released)\n"
        "print(ts.wait_for_pressed(timeout_ms=300), round(time.time() - t0, 1))\n",
        "touch@1+0.5",
    )  # fmt: skip
    assert lines == ["0 TOUCH", "1.5 True", "False 1.8"]


def test_one_touch_sensor_can_be_pressed_alone(run):
    lines = run(
        TOUCH + "one, two = TouchSensor('in1'), TouchSensor('in2')\n"
        "time.sleep(1)\nprint(one.is_pressed, two.is_pressed, list(two.bin_data('<i')))\n",
        "touch:in2@0.5+1",
    )
    assert lines == ["0 1 [1]"]


def test_leds_show_colours_with_their_times(run, devices):
    lines = run(
        "from ev3dev2.led import Leds, Led\nimport time\nleds = Leds()\n"
        "leds.set_color('LEFT', 'AMBER', pct=0.5)\ntime.sleep(1)\nleds.all_off()\n"
        "led = Led(name_pattern='led0:red*')\nled.brightness = 9\nled.trigger = 'timer'\n"
        "led.delay_on = 100\nprint(led.brightness, led.delay_on, led.delay_off)\n"
        "try: led.trigger = 'nonsense'\nexcept ValueError: print('refused')\n"
        "leds.reset()\n"
    )
    assert lines == ["9 100 500", "refused"]
    left_red = devices.leds["led0:red:brick-status"]
    # The library's own reading of the trigger is broken; brightness 0 ends the timer.
    assert left_red.read("trigger") == "[none] default-on timer heartbeat"
    assert [value for _, value in left_red.history] == [0, 127, 0, 9, 0]
    assert left_red.history[2][0] - left_red.history[1][0] == pytest.approx(1, abs=0.01)
    assert devices.leds["led0:green:brick-status"].brightness == 255


def test_led_animation_runs_beside_the_program_and_stops(run, devices):
    run(
        "from ev3dev2.led import Leds\nimport time\nleds = Leds()\n"
        "leds.animate_cycle(('RED', 'GREEN'), sleeptime=0.5, duration=None, block=False)\n"
        "time.sleep(2.2)\nleds.animate_stop()\ntime.sleep(2)\n"
    )
    history = devices.leds["led1:red:brick-status"].history
    assert [value for _, value in history] == [0, 255, 0, 255, 0, 255, 0]
    # The library waits for the animation by spinning; it stops at its next step, at 2.5 s.
    assert history[-1][0] < 2.7


def test_battery(run):
    lines = run(
        "from ev3dev2.power import PowerSupply\np = PowerSupply()\n"
        "print(p.measured_volts, p.measured_amps, p.type, p.technology,\n"
        "      p.min_voltage < p.max_voltage)\n"
        "print(open('/sys/class/power_supply/lego-ev3-battery/voltage_now').read().strip())\n"
    )
    assert lines == ["7.4 0.2 Battery Unknown True", "7400000"]


SOUND = "from ev3dev2.sound import Sound\nimport time\ns = Sound()\nt0 = time.time()\n"


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("call", "seconds"),
    [
        ("s.beep()", 0.2),
        ("s.beep('-l 500 -r 2 -d 100')", 1.1),
        ("s.tone(440, 1500)", 1.5),
        ("s.tone([(392, 350, 100), (440, 250, 0)])", 0.7),
        ("s.play_tone(440, 0.5, delay=0.25)", 0.75),
        ("s.play_note('A4', 0.5)", 0.5),
        ("s.play_song([('C4', 'q'), ('R', 'q'), ('E4', 'h')], delay=0)", 2.0),
        ("s.speak('hello')", 0.2 + 5 / 6.0 * 60 / 130),
        ("s.play_file('one.wav')", 1.0),
        ("s.play_tone(440, 5, play_type=s.PLAY_NO_WAIT_FOR_COMPLETE)", 0.0),
        ("s.play_file('one.wav', play_type=1).wait()", 1.0),
        ("import os; os.system('beep -l 5000 &')", 0.0),
        ("import os; os.system('beep -l 500; beep -l 500')", 1.0),
        (
            "p = s.tone(440, 5000, play_type=1)\nimport threading\n"
            "threading.Timer(1, p.kill).start(); print(p.wait(), end=' ')\n"
            "t0 = t0 + (0 if p.returncode == -9 else 99)",
            1.0,
        ),
        ("p = s.speak('long text', play_type=1); p.kill(); p.wait()", 0.0),
    ],
)
def test_sounds_last_as_long_as_they_would(run, tmp_path, monkeypatch, call, seconds):
    monkeypatch.chdir(tmp_path)
    with wave.open(os.path.join(str(tmp_path), "one.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(1)
        file.setframerate(8000)
        file.writeframes(b"\x80" * 8000)
    lines = run(SOUND + call + "\nprint(time.time() - t0)\n")
    # Starting the players takes some hundredths of a second on top.
    assert seconds <= float(lines[0].split()[-1]) < seconds + 0.3


def test_volume_and_what_was_played_are_remembered(run, devices):
    run(SOUND + "s.set_volume(35)\ns.speak('it is done')\n")
    assert devices.programs.volume == 100
    assert any("espeak" in line and "it is done" in line for _, line in devices.programs.history)


def test_screen_keeps_what_was_drawn(run, devices):
    pytest.importorskip("PIL.Image")
    lines = run(
        "from ev3dev2.display import Display\nimport ev3dev2.fonts as fonts\nd = Display()\n"
        "print(d.shape, d.platform)\n"
        "d.rectangle(False, 10, 20, 29, 29, fill_color='black')\n"
        "d.text_pixels('hello', clear_screen=False, x=50, y=50, font='luBS14')\n"
        "d.text_grid('x', clear_screen=False, x=3, y=10)\nd.update()\n"
    )
    assert lines == ["(178, 128) ev3"]
    screen = devices.screen.pixels()
    assert len(screen) == 178 * 128
    box = [screen[178 * y + x] for y in range(20, 30) for x in range(10, 30)]
    assert set(box) == {0}
    assert screen[0] == 255
    assert any(screen[178 * y + x] < 50 for y in range(50, 70) for x in range(50, 90))


def test_screen_is_none_until_it_is_opened(run, devices):
    run("print()\n")
    assert devices.screen.pixels() is None


def test_console_knows_its_size_by_the_font(run):
    lines = run(
        "from ev3dev2.console import Console\nimport os\n"
        "c = Console()\nprint()\nprint(c.columns, c.rows)\n"
        "c.set_font('Lat15-Terminus16.psf.gz', False)\nprint(c.columns, c.rows)\n"
        "c.text_at('here', 2, 3)\n"
    )
    assert lines[1:3] == ["14 5", "22 8"]
    assert lines[3] == "\x1b[3;2Hhere"


def test_no_program_of_the_laptop_is_started(tmp_path, run):
    marker = tmp_path / "made"
    lines = run(
        "import os, subprocess, sys\nsys.stderr = sys.stdout\n"
        f"print(os.system('tee {marker}') >> 8)\n"
        f"try: subprocess.call(['tee', '{marker}'])\nexcept FileNotFoundError: print('refused')\n"
        "try: os.fork()\nexcept OSError: print('refused')\n"
        "print(subprocess.check_output(['echo', 'hi']), os.popen('stty size').read().strip())\n"
        "print(subprocess.run('exit_or_so', shell=True).returncode)\n"
    )
    assert not marker.exists()
    assert lines == [
        "sh: 1: tee: not found", "127", "refused", "refused", "b'hi\\n' 8 22",
        "sh: 1: exit_or_so: not found", "127",
    ]  # fmt: skip


def test_a_key_device_hears_from_its_opening_to_its_closing(brick, devices):
    woken = []
    devices.buttons.set("up", True)
    keys = KeyDevice(
        brick.sysfs, devices.buttons, types.SimpleNamespace(wake=lambda: woken.append(1))
    )
    assert keys.active_keys() == [103]
    devices.buttons.set("up", False)
    keys.close()
    devices.buttons.set("enter", True)
    assert [(e.code, e.value) for e in keys.read() if e.type == EV_KEY] == [(103, 0)]
    assert keys.read_one() is None
    assert woken


def test_a_sensor_outside_any_scene_has_nothing_to_see(brick):
    orders = read_sensors(["in1=ultrasonic:tip"])
    with pytest.raises(BadSensor, match="no tip for it to see here; write a value"):
        peripherals.Peripherals(brick.world, Sysfs(brick.world, COST), sensors=orders)
