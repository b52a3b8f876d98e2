"""Devices as files: what scripts find in /sys/class, read there and write there."""

import errno
import glob
import io
import os
import pathlib

import pytest

from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.peripherals import Peripherals
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.host.runner import run_script
from laptop.emulator.host.sys_class import ATTRIBUTES, ONLY_WRITTEN, SysClass
from laptop.emulator.host.world import World

MOTOR = "/sys/class/tacho-motor/motor9"
LED = "/sys/class/leds/led0:red:brick-status"


@pytest.fixture
def brick():
    return EmulatedBrick(World(), None, extra={"A": "large", "B": "medium"})


@pytest.fixture
def run(tmp_path, capsys, brick):
    """Run source text on a bare brick with two motors: (lines on stdout, stderr)."""

    def run(source):
        script = tmp_path / "mine.py"
        script.write_text("import glob, io, os, pathlib, select, stat, time\n" + source)
        run_script(brick, str(script))
        out, err = capsys.readouterr()
        return out.splitlines(), err

    return run


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("os.listdir('/sys/class/tacho-motor')", ["motor9", "motor10"]),
        ("os.listdir('/sys/class/tacho-motor/')", ["motor9", "motor10"]),
        ("os.listdir('/sys/class/servo-motor')", []),
        ("os.listdir(b'/sys/class/tacho-motor')", [b"motor9", b"motor10"]),
        ("[(e.name, e.path, e.is_dir()) for e in os.scandir(b'/sys/class/power_supply')]",
         [(b"lego-ev3-battery", b"/sys/class/power_supply/lego-ev3-battery", True)]),
        ("os.listdir(None) == os.listdir('.'), len(list(os.scandir(None))) > 0", (True, True)),
        ("'lego-sensor' in os.listdir('/sys/class')", True),
        (f"os.listdir('{MOTOR}/hold_pid')", ["Kd", "Ki", "Kp"]),
        ("glob.glob('/sys/class/tacho-motor/motor*')", [MOTOR, MOTOR[:-1] + "10"]),
        ("glob.glob('/sys/class/*/motor9/add*')", [MOTOR + "/address"]),
        ("[e.name for e in os.scandir('/sys/class/power_supply')]", ["lego-ev3-battery"]),
        ("[e.is_dir() for e in os.scandir('/sys/class/power_supply')]", [True]),
        ("next(os.walk('/sys/class/lego-sensor'))[1]", [f"sensor{k}" for k in range(4)]),
        ("sorted(p.name for p in pathlib.Path('/sys/class/leds').iterdir())[1]", LED[16:]),
        ("[p.name for p in pathlib.Path('/sys/class/tacho-motor').glob('*1*')]", ["motor10"]),
        (f"pathlib.Path('{MOTOR}/address').read_text()", "ev3-ports:outA\n"),
        (f"pathlib.Path('{LED}/brightness').write_text('7')", 1),
        (f"pathlib.Path('{MOTOR}').exists()", True),
        (f"os.path.exists('{MOTOR}'), os.path.exists('{MOTOR}0')", (True, False)),
        (f"os.path.isdir('{MOTOR}'), os.path.isfile('{MOTOR}')", (True, False)),
        (f"os.path.isdir('{MOTOR}/state'), os.path.isfile('{MOTOR}/state')", (False, True)),
        (f"os.path.isfile('{MOTOR}/nothing')", False),
        (f"os.access('{MOTOR}/state', os.R_OK), os.access('{MOTOR}/state', os.W_OK)",
         (True, False)),
        (f"oct(os.stat('{MOTOR}/command').st_mode & 0o777)", "0o220"),
        (f"stat.S_ISDIR(os.stat('{MOTOR}').st_mode)", True),
        (f"open('{MOTOR}/driver_name').read()", "lego-ev3-l-motor\n"),
        (f"open('{MOTOR}/driver_name', 'rb').read()", b"lego-ev3-l-motor\n"),
        (f"open('{MOTOR}/address').readlines()", ["ev3-ports:outA\n"]),
        (f"[line for line in open('{MOTOR}/address')]", ["ev3-ports:outA\n"]),
        (f"list(iter(open('{MOTOR}/address').readline, ''))", ["ev3-ports:outA\n"]),
        (f"io.open('{MOTOR}/hold_pid/Kd').read()", "0\n"),
        (f"open('{MOTOR}/position', 'rb', 0).read(1)", b"0"),
        ("open('/sys/class/power_supply/lego-ev3-battery/voltage_now').read()", "8000000\n"),
        ("open('/sys/class/lego-sensor/sensor1/value0').read()", "0\n"),
        ("open('/sys/class/lego-port/port4/status').read()", "tacho-motor\n"),
        ("os.path.exists(__file__), os.path.basename(__file__) in os.listdir(os.path.dirname("
         "__file__))", (True, True)),
    ],
)  # fmt: skip
def test_what_a_script_finds(run, asked, answer):
    assert run(f"answer = {asked}\nprint(repr(answer))") == ([repr(answer)], "")


@pytest.mark.parametrize(
    ("done", "error"),
    [
        (f"open('{MOTOR[:-1]}0/position')", "FileNotFoundError(2,"),
        ("open('/sys/class/nowhere/x', 'w')", "FileNotFoundError(2,"),
        ("os.listdir('/sys/class/nowhere')", "FileNotFoundError(2,"),
        ("os.stat('/sys/class/nowhere')", "FileNotFoundError(2,"),
        (f"open('{MOTOR}')", "IsADirectoryError(21,"),
        (f"os.listdir('{MOTOR}/state')", "NotADirectoryError(20,"),
        (f"open('{MOTOR}/state', 'w')", "PermissionError(13,"),
        (f"open('{MOTOR}/command')", "PermissionError(13,"),
        (f"open('{MOTOR}/position').write('1')", "UnsupportedOperation("),
        (f"open('{MOTOR}/position', 'w').read()", "UnsupportedOperation("),
        (f"f = open('{MOTOR}/speed_sp', 'w'); f.write('fast'); f.flush()", "OSError(22,"),
    ],
)
def test_what_cannot_be_is_the_error_of_the_brick(run, done, error):
    out, _ = run(f"try: {done}\nexcept Exception as error: print(repr(error))\n")
    assert out[0].startswith(error)


@pytest.mark.parametrize(
    ("read", "accesses"),
    [("f.read()", 1), ("f.readline()", 1), ("list(f)", 1), ("f.read(); f.seek(0); f.read()", 2)],
)
def test_an_access_is_counted_for_each_read_from_the_beginning(run, brick, read, accesses):
    assert run(f"with open('{MOTOR}/state') as f: {read}\n")[1] == ""
    assert brick.sysfs.accesses == accesses


def test_a_motor_turns_that_is_told_by_files(run, brick):
    source = (
        "for name, text in ('speed_sp', '300'), ('position_sp', '180'), ('stop_action', 'hold'), "
        f"('command', 'run-to-rel-pos'):\n    with open('{MOTOR}/' + name, 'w') as f:\n"
        "        f.write(text)\n"
        f"f = open('{MOTOR}/position')\nfirst = int(f.read())\ntime.sleep(2)\nf.seek(0)\n"
        f"print(first, f.read().strip(), open('{MOTOR}/state').read().strip())\n"
    )
    first, then, state = run(source)[0][0].split()
    assert (abs(int(first)) < 10, state) == (True, "holding")
    assert int(then) == pytest.approx(180, abs=2)


def test_what_is_written_is_told_when_it_is_flushed_and_no_later_than_at_the_end(run, brick):
    source = (
        f"f = open('{LED}/brightness', 'w')\nf.write('9')\n"
        f"print(open('{LED}/brightness').read().strip())\nf.flush()\n"
        f"print(open('{LED}/brightness').read().strip())\n"
        f"g = open('{MOTOR}/duty_cycle_sp', 'w')\ng.write('30')\n"
    )
    assert run(source)[0] == ["0", "9"]
    assert brick.motors["A"].read("duty_cycle_sp") == "30"


def test_the_ways_of_the_older_library_lead_to_the_devices(run):
    source = (
        f"path = '{MOTOR}/state'\nmode = stat.S_IMODE(os.stat(path)[stat.ST_MODE])\n"
        "print(bool(mode & stat.S_IRGRP), bool(mode & stat.S_IWGRP))\n"
        f"command = io.FileIO('{MOTOR}/command', 'w')\nstate = io.FileIO(path, 'r')\n"
        "state.seek(0); print(state.read())\n"
        f"io.FileIO('{MOTOR}/speed_sp', 'r+').write(b'200')\n"
        "poll = select.poll(); poll.register(state, select.POLLPRI)\n"
        "began = time.time(); command.write(b'run-forever')\n"
        "print(len(poll.poll(1000)), time.time() - began < 0.2)\n"
        "state.seek(0); print(state.read().split()[0])\n"
    )
    assert run(source)[0] == ["True False", "b'\\n'", "1 True", "b'running'"]


@pytest.mark.parametrize("opened", [f"open('{MOTOR}/state')", f"open('{MOTOR}/state', 'rb')"])
def test_a_file_of_a_device_is_polled_however_it_was_opened(run, opened):
    source = (
        f"state = {opened}\nstate.read()\n"
        "poll = select.poll(); poll.register(state, select.POLLPRI)\n"
        f"print(len(poll.poll(10)))\nopen('{MOTOR}/command', 'w').write('run-forever')\n"
        "print(len(poll.poll(300)))\npoll.modify(state, select.POLLPRI)\n"
        "print(len(poll.poll(10)))\npoll.unregister(state)\nprint(len(poll.poll(10)))\n"
        "try:\n    poll.unregister(state)\nexcept KeyError:\n    print('gone')\n"
    )
    out, err = run(f"open('{MOTOR}/speed_sp', 'w').write('200')\n" + source)
    assert (out, err) == (["0", "1", "1", "0", "gone"], "")


def test_a_class_may_keep_the_functions_as_it_keeps_those_of_c(run):
    source = (
        "class Keeper:\n    listdir, stat = os.listdir, os.stat\n"
        "    scandir, open = os.scandir, io.open\n"
        f"k = Keeper()\nprint(k.listdir('{MOTOR}/hold_pid'), k.stat('{MOTOR}').st_size)\n"
        f"print(len(list(k.scandir('{MOTOR}/hold_pid'))), k.open('{MOTOR}/speed_sp').read())\n"
    )
    assert run(source)[0][:2] == ["['Kd', 'Ki', 'Kp'] 4096", "3 0"]


def test_every_file_that_is_listed_is_there_and_no_other_is_known(brick):
    devices = Peripherals(brick.world, brick.sysfs, sensors=read_sensors(["in2=gyro"]))
    assert devices
    tree = SysClass(brick.sysfs)
    for kind, text in ATTRIBUTES.items():
        for name in tree.names([kind]):
            for attribute in text.split():
                device = brick.sysfs.open(os.path.join(kind, name), attribute)
                number = 0
                try:
                    device.read()
                except OSError as error:
                    number = error.errno
                there = number in (0, errno.EOPNOTSUPP, errno.ENXIO)
                assert there or attribute in ONLY_WRITTEN, (kind, attribute)
    motor = brick.motors["A"]
    assert {*motor._set, *motor._fixed} <= set(ATTRIBUTES["tacho-motor"].split())


def test_the_host_has_its_own_files_again_after_a_run(run):
    before = os.stat, os.listdir, os.scandir, os.path.exists, io.open, io.FileIO, pathlib, glob
    run("print(pathlib.Path('/sys/class/leds').exists())")
    import glob as now_glob
    import pathlib as now_pathlib

    assert before == (
        os.stat, os.listdir, os.scandir, os.path.exists, io.open, io.FileIO, now_pathlib, now_glob,
    )  # fmt: skip
    with pytest.raises(FileNotFoundError):
        os.stat(MOTOR + "/position")
