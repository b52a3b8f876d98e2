"""`python -m laptop simulate`: what it leaves, what it passes on, and what it refuses."""

import contextlib
import fcntl
import math
import os
import re
import resource
import select
import subprocess
import sys
import tempfile
import termios
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from csv_rows import rows_in
from own_python import python
from places import ROOT
from refusals import in_one_line
from run_json import run_in

from laptop.cli.main import laptop
from laptop.emulator import brick_home
from laptop.emulator.faults import InvalidSimulationOption
from laptop.record.figures import line_plot as picture
from laptop.record.figures.line_accuracy import measure
from shared.arm_description import find_arm, read_arm

DRIVER = str(ROOT / "robot" / "driver.py")
BENCH = str(ROOT / "robot" / "bench_brick.py")
LINE = ["line", "10,0", "5,10"]


@pytest.fixture
def simulate(tmp_path, monkeypatch):
    """Run `simulate WORDS`; the result of click, with the folder of the output.

    Its picture is empty unless it is wanted: to draw it takes longer than all the rest. It ends
    with a status, or with any if that is None.
    """

    def run(*args, out=tmp_path / "out", with_picture=False, status=0):
        with monkeypatch.context() as patch:
            if not with_picture:
                patch.setattr(picture, "write_line_plot", lambda file, *_: Path(file).touch())
            result = CliRunner().invoke(laptop, ["simulate", "--out", str(out), *map(str, args)])
        assert result.exception is None or isinstance(result.exception, SystemExit), (
            result.exception
        )
        assert status in (None, result.exit_code), result.output
        result.out = out
        return result

    return run


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    """The result of drawing LINE, with its picture, for all tests that only look at it."""
    out = tmp_path_factory.mktemp("line")
    result = CliRunner().invoke(laptop, ["simulate", "--out", str(out), DRIVER, *LINE])
    result.out = out
    return result


@pytest.fixture
def script(tmp_path):
    def write(source):
        path = tmp_path / "mine.py"
        path.write_text(source)
        return path

    return write


def rows(out):
    return rows_in(out / "trace.csv")


def process(*args, **options):
    """The same as a process of its own."""
    return python("-m", "laptop", "simulate", *args, **options)


# What it leaves


def test_a_line_leaves_trace_picture_and_summary(line):
    result = line
    assert result.exit_code == 0, result.output
    assert sorted(os.listdir(result.out)) == ["picture.png", "run.json", "trace.csv"]

    header = (result.out / "trace.csv").read_bytes().split(b"\n")[0]
    assert header == b"t,q1,q2,x,y,pen"
    trace = rows(result.out)
    times = [float(row["t"]) for row in trace]
    assert times == sorted(times)
    assert times[0] == 0
    assert len(times) >= 100 * (times[-1] - times[0])
    assert max(b - a for a, b in zip(times, times[1:])) <= 0.0101
    assert {row["pen"] for row in trace} == {"0", "1"}
    for row in trace[::50]:  # the true tip belongs to the true angles
        a, b = float(row["q1"]), float(row["q2"])
        assert float(row["x"]) == pytest.approx(
            11.3 * math.cos(a) + 9.5 * math.cos(a + b), abs=1e-4
        )
        assert float(row["y"]) == pytest.approx(
            11.3 * math.sin(a) + 9.5 * math.sin(a + b), abs=1e-4
        )

    png = (result.out / "picture.png").read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = (int.from_bytes(png[k : k + 4], "big") for k in (16, 20))
    assert min(width, height) >= 400

    summary = run_in(result.out)
    assert (summary["kind"], summary["what"]) == ("drawing", " ".join(["driver.py", *LINE]))
    assert [joint["link_cm"] for joint in summary["arm"]["joints"]] == [11.3, 9.5]
    assert summary["built"] is None  # as described
    assert summary["arm"]["name"] == "planar"
    assert "camera" not in summary
    assert summary["status"] == 0
    assert summary["reason"] == "ended"
    assert summary["accesses"] > 500
    assert 2 < summary["seconds"] < times[-1] + 0.01
    assert set(summary["motors"]) == {"A", "B", "C", "D"}
    assert not any(motor["driven"] for motor in summary["motors"].values())

    (path,) = summary["paths"]
    down = [row for row in trace if row["pen"] == "1"]
    ink = [(float(row["x"]), float(row["y"])) for row in down]
    assert path["length cm"] == pytest.approx(math.hypot(5, 10), abs=1e-3)
    assert path["end off mm"] == pytest.approx(10 * math.dist(ink[-1], (5, 10)), abs=0.01)
    off = max(abs((x - 10) * 10 + y * 5) / math.hypot(5, 10) for x, y in ink)
    assert path["greatest mm"] == pytest.approx(10 * off, abs=0.3)
    assert path["time s"] == pytest.approx(float(down[-1]["t"]) - float(down[0]["t"]), abs=0.02)
    for figure in (f"{path['greatest mm']:.2f} mm", "path 1", "status 0", "picture.png"):
        assert figure in result.output


def test_the_geared_arm_and_a_plant_are_what_was_asked_for(simulate):
    result = simulate("--arm", "geared", "--plant", "backlash=1,seed=7", DRIVER, *LINE)
    summary = run_in(result.out)
    assert (summary["arm"]["name"], summary["plant"]) == ("geared", "backlash=1,seed=7")
    assert summary["paths"][0]["greatest mm"] < 1.5
    assert summary["seconds"] > 5


@pytest.mark.long
def test_the_plant_makes_a_difference(simulate, tmp_path):
    traces = [
        (
            simulate("--plant", plant, DRIVER, "home", "--seek", out=tmp_path / plant).out
            / "trace.csv"
        ).read_bytes()
        for plant in ("seed=1", "seed=2")
    ]
    assert traces[0] != traces[1]


@pytest.mark.long
def test_two_processes_give_the_same_bytes(tmp_path):
    args = ["--plant", "seed=11,load=-0.01..0.01", DRIVER, "polyline", "12,5", "11,6", "10,5"]
    out = []
    for seed in ("1", "4242"):
        env = dict(os.environ, PYTHONHASHSEED=seed)
        done = process("--out", tmp_path / seed, *args, env=env)
        assert done.returncode == 0, done.stderr
        out.append(done.stdout.splitlines())
    assert (tmp_path / "1/trace.csv").read_bytes() == (tmp_path / "4242/trace.csv").read_bytes()
    summaries = [run_in(tmp_path / seed) for seed in ("1", "4242")]
    assert summaries[0] == summaries[1]


def test_in_virtual_time_nothing_is_told_of_how_fast_this_computer_is(simulate, script):
    result = simulate(script("import time; time.sleep(6)"))
    assert "after 6.00 s on the emulated brick (cpu=1, whose start takes" in result.output
    assert "x real time" not in result.output


@pytest.mark.parametrize(
    ("args", "cpu", "reported"),
    [([], 1, "(cpu=1, whose start takes another "), (["--plant", "cpu=0"], 0, "(cpu=0; ")],
)
def test_how_slowly_the_brick_computes_is_told(simulate, script, args, cpu, reported):
    result = simulate(*args, script("import time; time.sleep(0.1)"))
    summary = run_in(result.out)
    assert reported in result.output
    assert summary["cpu"] == cpu
    assert (summary["start_s"] or 0) > 1 if cpu else summary["start_s"] is None


@pytest.mark.long
def test_a_second_run_replaces_the_first(simulate):
    first = simulate(DRIVER, *LINE, with_picture=True)
    before = {name: (first.out / name).read_bytes() for name in os.listdir(first.out)}
    simulate(DRIVER, "line", "12,0", "9,9", with_picture=True)
    after = {name: (first.out / name).read_bytes() for name in os.listdir(first.out)}
    assert set(after) == set(before)
    assert all(before[name] != after[name] for name in before)


def files_in(out):
    return {name: (out / name).read_bytes() for name in os.listdir(out)}


REFUSED = [
    ([DRIVER, "line", "10,0"], 2),
    ([DRIVER, "line", "10,0", "99,0"], 1),
    (["--start", "lost", DRIVER, *LINE], 1),
    (["--start", "unchecked", DRIVER, "home"], 1),
    (["--arm", "spatial", DRIVER, "line", "10,0,5"], 2),  # whose motors are held
    ([BENCH, "nosuch"], 2),
]


@pytest.mark.parametrize(("args", "status"), REFUSED)
def test_what_is_refused_leaves_the_files_of_the_run_before(simulate, line, args, status):
    before = files_in(line.out)
    result = simulate(*args, out=line.out, status=status)
    assert files_in(line.out) == before
    assert f"no motor was asked to turn: {line.out} keeps the files of the run before" in (
        result.output
    )


def test_where_no_other_run_is_kept_the_files_tell_of_the_refused_one(simulate):
    for args, status in ((["10,0"], 2), (["10,0", "99,0"], 1)):
        result = simulate(DRIVER, "line", *args, status=status)
        summary = run_in(result.out)
        assert (summary["status"], summary["typed"][3:]) == (status, args)
        assert "keeps" not in result.output


@pytest.mark.parametrize(
    "args",
    [
        ["--fault", "stall:A@0", DRIVER, "move", "12,6"],
        ["--fault", "int@0.6", DRIVER, *LINE],
        ["--fault", "unplug:A@0.1", DRIVER, *LINE],
        ["--fault", "kill@0.1", DRIVER, *LINE],
        [DRIVER, "where"],
    ],
)
def test_what_was_not_refused_has_its_files(simulate, args):
    out = simulate(DRIVER, "where").out
    result = simulate(*args, status=None)
    assert run_in(out)["status"] == result.exit_code
    assert "keeps" not in result.output


def test_a_script_that_does_not_draw(simulate, script):
    turn = script(
        "from ev3dev2.motor import LargeMotor\nLargeMotor('outA').on_for_degrees(30, 90)\n"
        "print('hello', __name__)\n"
    )
    result = simulate(turn, with_picture=True)
    assert "hello __main__" in result.output
    summary = run_in(result.out)
    assert summary["paths"] == []
    assert (result.out / "picture.png").stat().st_size > 1000


def test_where_nothing_moves_there_is_no_picture_nor_that_of_an_earlier_run(simulate):
    simulate("--arm", "spatial", "--picture", DRIVER, "where")
    for arm in ("planar", "geared", "spatial"):
        result = simulate("--arm", arm, DRIVER, "where")
        assert result.output.endswith(
            f"{result.out}/trace.csv, run.json; the arm has not moved, so there is no picture\n"
        )
        assert sorted(os.listdir(result.out)) == ["run.json", "trace.csv"]


def test_the_picture_bears_no_folder_of_this_computer(simulate, script, monkeypatch, tmp_path):
    titles = []

    def write(file, *args):
        titles.append(args[4])
        Path(file).touch()

    monkeypatch.setattr(picture, "write_line_plot", write)
    args = ("--picture", script("print('hi')\n"), f"--log={tmp_path}/x y/a.jsonl", "10,0")
    simulate(*args, with_picture=True)
    assert titles == ["mine.py --log=a.jsonl 10,0"]


def test_no_picture_where_none_is_wanted(simulate):
    turn = [DRIVER, "move", "15,5"]
    assert "picture.png" in os.listdir(simulate(*turn).out)
    result = simulate("--no-picture", *turn)
    assert result.output.endswith(f"{result.out}/trace.csv, run.json\n")
    assert sorted(os.listdir(result.out)) == ["run.json", "trace.csv"]


def test_a_picture_where_the_arm_rests_if_it_is_wanted(simulate):
    result = simulate("--picture", DRIVER, "where")
    written = ["picture.png", "run.json", "trace.csv"]
    assert sorted(os.listdir(result.out)) == written
    assert sorted([*run_in(result.out)["files"], "run.json"]) == written
    assert result.output.endswith(f"{result.out}/picture.png, trace.csv, run.json\n")


def test_the_picture_from_the_side_goes_with_the_arm_in_space(simulate):
    result = simulate("--arm", "spatial", "--picture", DRIVER, "where")
    assert {"picture.png", "picture-side.png"} < set(os.listdir(result.out))
    simulate("--picture", DRIVER, "where")
    assert "picture-side.png" not in os.listdir(result.out)


@pytest.mark.long
def test_without_a_picture_matplotlib_is_not_imported(tmp_path):
    program = (
        "import sys\n"
        "from laptop.cli.main import laptop\n"
        f"words = ['simulate', '--out', {str(tmp_path)!r}, 'robot/driver.py', 'where']\n"
        "try:\n"
        "    laptop(words)\n"
        "finally:\n"
        "    print({'matplotlib', 'cv2', 'nicegui', 'rich'} & set(sys.modules))\n"
    )
    done = python("-c", program)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("no picture\nset()\n")


# The script's own status and arguments


@pytest.mark.parametrize(
    ("source", "status"),
    [
        ("raise SystemExit(7)", 7),
        ("1 / 0", 1),
        ("import sys; sys.exit(0 if sys.argv[1:] == ['-5,10', '--arm', 'x'] else 9)", 0),
    ],
)
def test_the_exit_status_is_the_scripts(simulate, script, source, status):
    result = simulate(script(source), "-5,10", "--arm", "x", status=status)
    assert run_in(result.out)["status"] == status
    assert (result.out / "trace.csv").exists(), "what happened until then is shown all the same"


def test_a_script_that_is_not_there(simulate):
    result = simulate("nowhere.py", status=2)
    assert "nowhere.py" in result.output


def test_a_script_that_never_ends(simulate, script):
    result = simulate(
        "--timeout", "3", script("import time\nwhile True: time.sleep(0.1)"), status=124
    )
    assert "3 s of virtual time" in result.output


def test_a_button_press(simulate, script):
    source = """
from time import monotonic
from ev3dev2.button import Button
start, button = monotonic(), Button()
while not button.enter:
    if monotonic() - start > 9:
        raise SystemExit("nobody pressed")
print("pressed after %.1f s" % (monotonic() - start))
"""
    result = simulate("--press", "enter@2.0", script(source))
    assert "pressed after 2.0 s" in result.output


def test_a_motor_plugged_in_beside_the_arms(simulate, script):
    source = """
from ev3dev2.motor import MediumMotor, OUTPUT_D, SpeedPercent
motor = MediumMotor(OUTPUT_D)
motor.on_for_rotations(SpeedPercent(30), 1)
print("turned", 350 < motor.position < 380)
"""
    result = simulate("--plug", "D=medium", script(source))
    assert "turned True" in result.output, result.output


def test_a_sensor_with_values_over_time(simulate, script):
    source = """
import time
from ev3dev2.sensor.lego import ColorSensor, UltrasonicSensor
colour, sonar = ColorSensor("in3"), UltrasonicSensor("in2")
print(colour.color_name, int(sonar.distance_centimeters))
time.sleep(2.5)
print(colour.color_name, int(sonar.distance_centimeters))
"""
    orders = ("in2=ultrasonic:12..80/5s", "in3=color:white:black@2")
    result = simulate("--plug", orders[0], "--plug", orders[1], script(source))
    assert result.output.splitlines()[:2] == ["White 12", "Black 46"], result.output
    assert run_in(result.out)["sensors"] == list(orders)


def test_a_sensors_cable_is_pulled(simulate, script):
    source = """
import time
from ev3dev2 import DeviceNotFound
from ev3dev2.sensor.lego import GyroSensor
gyro = GyroSensor("in2")
try:
    while True:
        gyro.angle
        time.sleep(0.1)
except DeviceNotFound:
    print("gone")
"""
    args = ["--plug", "in2=gyro", "--fault", "unplug:in2@2"]
    result = simulate(*args, script(source))
    assert result.output.splitlines()[0] == "gone", result.output
    assert run_in(result.out)["seconds"] == pytest.approx(2.05, abs=0.06)


# The arm's zero


def test_a_lost_arm_draws_only_when_homed(simulate):
    refused = simulate("--start", "lost", DRIVER, *LINE, status=1)
    assert "has not been homed" in refused.output
    trace = rows(refused.out)
    assert trace[0]["q1"] == trace[-1]["q1"] != "0.000000"
    homed = simulate("--start", "lost", DRIVER, "home", "--seek")
    last = rows(homed.out)[-1]
    assert max(abs(float(last["q1"])), abs(float(last["q2"]))) < math.radians(2.5)


@pytest.mark.long
def test_a_lost_arm_that_is_told_nothing_asks_to_be_put_home(simulate):
    result = simulate("--start", "lost", DRIVER, status=1)
    assert "by hand in its home pose" in result.output
    assert "the arm has not moved" in result.output


def test_a_start_by_angles(simulate):
    result = simulate("--start", "30,-45", DRIVER, "where")
    first = rows(result.out)[0]
    assert (float(first["q1"]), float(first["q2"])) == pytest.approx(
        (math.radians(30), math.radians(-45)), abs=1e-5
    )
    assert "30." in result.output or "29." in result.output


# Faults


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("fault", "status", "says"),
    [
        ("unplug:B@3.5", 1, "elbow motor at port B no longer answers"),
        ("term@3.5", 143, "stopped by SIGTERM"),
        ("freeze@3.5", 124, "frozen at 3.500 s"),
        ("kill@3.5", 137, "killed at 3.500 s"),
    ],
)
def test_a_fault_to_order(simulate, fault, status, says):
    result = simulate("--fault", fault, DRIVER, *LINE, status=status)
    assert says in result.output
    assert "STILL DRIVEN" not in result.output
    summary = run_in(result.out)
    assert not any(motor["driven"] for motor in summary["motors"].values())


@pytest.mark.long
def test_a_frozen_picture_holds_the_arm(simulate):
    """It is a rendered one, and the tracker finds the same in it as before."""
    servo = str(ROOT / "robot/visual_servoing.py")
    result = simulate("--scene", "tilt=20", "--fault", "frozen-picture@2", servo, status=1)
    assert "picture frozen: held" in result.output
    assert "camera A" in result.output


def test_what_is_still_driven_is_said(simulate, script):
    source = """
from ev3dev2.motor import LargeMotor, OUTPUT_D
LargeMotor(OUTPUT_D).run_forever(speed_sp=300)
"""
    assert "STILL DRIVEN: D" in simulate(script(source)).output


def test_what_never_came_is_said_and_is_no_success(simulate, script):
    mine = script("import time; time.sleep(1)")
    faults = ["--fault", "freeze@1.5", "--fault", "unplug:A@0.5", "--fault", "int@300"]
    result = simulate(*faults, "--press", "enter@0.2", "--press", "enter@2", mine, status=3)
    said = [line for line in result.output.splitlines() if "never came" in line]
    assert len(said) == 1
    assert said[0].startswith("laptop: never came: --fault freeze@1.5, --fault int@300, ")
    assert said[0].endswith(
        "--press enter@2; mine.py ended at 1.00 s: give earlier times, or a longer script"
    )
    summary = run_in(result.out)
    assert summary["never_came"] == ["--fault freeze@1.5", "--fault int@300", "--press enter@2"]
    assert summary["status"] == 0


def test_a_failure_of_the_script_counts_more_than_what_never_came(simulate, script):
    result = simulate("--fault", "freeze@1.5", script("raise SystemExit(7)"), status=7)
    assert "never came: --fault freeze@1.5" in result.output


def test_where_all_came_nothing_is_said(simulate, script):
    mine = script("import time; time.sleep(1)")
    result = simulate("--fault", "unplug:A@0.5", "--press", "enter@0.9+5", mine)
    assert "never came" not in result.output
    assert run_in(result.out)["never_came"] == []


@pytest.mark.long
def test_a_servo_that_finds_no_tracker_is_told_how_to_have_one(simulate):
    servo = ROOT / "robot" / "visual_servoing.py"
    reported = "laptop: visual_servoing.py wants a tracker: with --scene '' before it a synthetic"
    assert reported in simulate(servo, "--goal", "400,200", status=1).output
    assert reported not in simulate(servo, "--help").output


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("drivr.py", "did you mean driver.py?"),
        ("my_lap.py", "did you mean my_lab.py?"),
        ("xyzzy.py", "bench_brick.py, driver.py, visual_servoing.py"),
    ],
)
def test_a_script_that_is_not_there_is_answered_with_one_that_is(
    simulate, tmp_path, monkeypatch, name, more
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_lab.py").touch()
    reported = " ".join(simulate(name, status=2).output.split())
    assert f"there is no {name}; " in reported
    assert reported.endswith(more)
    assert not simulate(name, status=2).out.exists()


@pytest.mark.long
def test_two_runs_do_not_write_into_one_folder(tmp_path, script):
    """Else one result is lost. A killed one leaves the folder free."""
    out = tmp_path / "out"
    slow = script("import sys; print('begun', flush=True); sys.stdin.read()")
    args = [sys.executable, "-m", "laptop", "simulate", "--out", str(out), str(slow)]
    first = subprocess.Popen(
        args, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert first.stdout.readline() == "begun\n"
    second = process("--out", out, slow, stdin=subprocess.DEVNULL)
    assert second.returncode == 1
    assert in_one_line(second.stderr, f"{out}", "--out")
    assert not (out / "run.json").exists()
    first.kill()
    first.communicate()
    third = process("--out", out, slow, stdin=subprocess.DEVNULL)
    assert third.returncode == 0, third.stderr
    assert sorted(os.listdir(out)) == ["run.json", "trace.csv"]


# What it refuses, before anything runs


@pytest.mark.parametrize("value", ["nan", "inf", "-1"])
def test_a_number_that_is_none_is_out_of_range(simulate, script, value):
    result = simulate("--timeout", value, script("print('it ran')"), status=2)
    assert "0<x<=1000000.0" in result.output
    assert "it ran" not in result.output


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--plant", "springs=3"], ["springs", "backlash"]),
        (["--plant", "backlash"], ["backlash"]),
        (["--plant", "backlash=wide"], ["backlash", "wide"]),
        (["--plant", "backlash=99"], ["backlash", "99", "20"]),
        (["--plant", "backlash=nan"], ["backlash", "nan"]),
        (["--plant", "backlash=1..2..3"], ["backlash"]),
        (["--fault", "earthquake@2"], ["earthquake", "unplug"]),
        (["--fault", "unplug:A"], ["unplug:A", "@"]),
        (["--fault", "unplug@2"], ["A to D"]),
        (["--fault", "unplug:E@2"], ["A to D", "in1 to in4"]),
        (["--fault", "stall:in1@2"], ["stall", "A to D"]),
        (["--fault", "freeze:A@2"], ["nothing"]),
        (["--fault", "slow-sysfs:very@2"], ["SECONDS"]),
        (["--fault", "frozen-picture:Z@2"], ["A to H"]),
        (["--fault", "frozen-picture@2"], ["no camera watches", "--scene"]),
        (["--scene", "", "--fault", "frozen-picture:B@2"], ["no camera B", "there are A"]),
        (["--fault", "unplug:A@1.2.3"], ["unplug"]),
        (["--fault", "slow-sysfs:nan@1"], ["slow-sysfs:nan@1", "SECONDS from 0 to 10"]),
        (["--fault", "slow-sysfs:-1@1"], ["slow-sysfs:-1@1", "SECONDS from 0 to 10"]),
        (["--fault", "slow-sysfs:1e400@1"], ["SECONDS from 0 to 10"]),
        (["--fault", "term@" + 400 * "9"], ["term@", "1e+06 s"]),
        (["--fault", "freeze@9999"], ["freeze@9999", "--timeout 600"]),
        (["--fault", "unplug:A@31", "--timeout", "30"], ["unplug:A@31", "--timeout 30"]),
        (["--press", "enter@inf"], ["enter@inf", "BUTTON@SECONDS"]),
        (["--press", "enter@" + 400 * "9"], ["enter@", "1e+06 s"]),
        (["--press", "enter@1+" + 400 * "9"], ["enter@", "1e+06 s"]),
        (["--press", "enter@601"], ["enter@601", "--timeout 600"]),
        (["--press", "\x1b[31menter@1"], ["enter@1"]),
        (["--plug", "E=large"], ["E=large"]),
        (["--plug", "D=huge"], ["D=huge"]),
        (["--plug", "D=huge:-9..9"], ["D=huge:-9..9", ":LOW..HIGH"]),
        *(
            (["--plug", "D=large:" + stops], ["D=large:" + stops, "starts at 0 deg", "-90..40"])
            for stops in ("", "9", "5..40", "-40..-5", "0..0", "40..-90", "-1e9..9", "a..b", "..9")
        ),
        (
            ["--arm", "none", "--wheels", "left=A,right=B", "--plug", "A=large:-9..9"],
            ["port A turns a wheel", "leave :-9..9 out"],
        ),
        (["--plug", "C=large"], ["C=large", "its pen", "--arm none"]),
        (["--plug", "A=large"], ["A=large", "its shoulder", "--arm none"]),
        (["--arm", "none", "--plug", "A=large", "--plug", "A=medium"], ["A=medium", "twice"]),
        (["--wheels", "left=B,right=C"], ["left=B,right=C", "--arm none"]),
        (["--arm", "none", "--wheels", "left=B"], ["left=B", "right=PORT"]),
        (["--arm", "none", "--wheels", "left=B,right=B"], ["two ports"]),
        (["--arm", "none", "--wheels", "left=B,right=C,track=0"], ["track = 0", "2 to 60 cm"]),
        (["--arm", "none", "--start", "lost"], ["start 'lost'", "no arm"]),
        (["--arm", "none", "--scene", ""], ["--scene", "none"]),
        (["--arm", "none", "--fault", "stall:A@1"], ["port A", "--plug"]),
        (["--arm", "none", "--plug", "in1=ultrasonic:tip"], ["no tip", "neither arm"]),
        (["--arm", "none", "--plug", "in1=gyro:robot"], ["no robot", "neither arm"]),
        (["--plug", "in2=sonar"], ["in2=sonar", "ultrasonic"]),
        (["--plug", "in2=gyro:wrist"], ["angle = wrist"]),
        (["--plug", "in2=gyro:base"], ["no base", "elbow"]),
        (["--plug", "in2=gyro", "--plug", "in2=touch"], ["in2=touch", "has one already"]),
        (["--plug", "in2=gyro", "--press", "touch:in2@1"], ["touch:in2", "in2 gyro"]),
        (["--press", "trigger@2"], ["trigger"]),
        (["--press", "enter"], ["enter"]),
        (["--start", "upside-down"], ["upside-down", "home", "lost"]),
        (["--start", "10"], ["10", "joint"]),
        (["--start", "10,200"], ["10,200", "150"]),
        (["--start", "nan,0"], ["nan"]),
        (["--arm", "triangular"], ["triangular", "planar", "geared"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_a_bad_order_is_refused_in_one_line(simulate, script, args, says):
    result = simulate(*args, script("print('it ran')"), status=None)
    assert result.exit_code in (1, 2)
    assert "it ran" not in result.output
    assert in_one_line(result.output, *says)
    assert not result.out.exists() or os.listdir(result.out) == []


def test_arms_of_ones_own_are_known_on_the_emulated_brick_too(simulate, tmp_path, monkeypatch):
    """Whoever tells the script which arm it is means the same file as on this side."""
    own = tmp_path / "state" / "arms"
    own.mkdir(parents=True)
    text = Path(find_arm("planar")).read_text()
    for name in ("mine", "planar"):
        (own / f"{name}.ini").write_text(text.replace("link = 11.3", "link = 15.5"))
    before = {path: path.read_bytes() for path in own.iterdir()}
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    for name in ("mine", "planar"):
        result = simulate("--arm", name, DRIVER, "--arm", name, "where")
        assert "tip at 25.00,0.00 cm" in result.output
    assert {path: path.read_bytes() for path in own.iterdir()} == before


@pytest.mark.parametrize("args", [["--arm", "{}"], ["--arm={}"]], ids=["apart", "in one"])
def test_an_arm_told_to_the_script_alone_is_not_the_one_on_the_brick(
    simulate, script, tmp_path, args
):
    mine = tmp_path / "my own.ini"
    mine.write_text((ROOT / "shared/arms/geared.ini").read_text())
    args = [word.format(mine) for word in args]
    refused = simulate(script("print('it ran')"), *args, status=1)
    assert "it ran" not in refused.output
    assert in_one_line(refused.output, "carries planar", f"--arm {mine} before")
    simulate("--arm", "planar", script("print('it ran')"), *args)
    simulate(script("print('it ran')"), "--arm", "planar")
    simulate(script("print('it ran')"), "--arm", "left")  # none of ours


def test_a_fault_at_a_port_without_a_motor(simulate, script, tmp_path):
    arm = tmp_path / "penless.ini"
    text = (ROOT / "shared/arms/planar.ini").read_text()
    arm.write_text(text[: text.index("# An arm without a pen")])
    result = simulate("--arm", arm, "--fault", "unplug:C@1", script("print('it ran')"), status=1)
    assert in_one_line(result.output, "port C", "A, B, D")


# Disks


def test_a_folder_that_cannot_be_made(simulate, tmp_path, script):
    (tmp_path / "file").write_text("in the way")
    result = simulate(script("print('it ran')"), out=tmp_path / "file" / "out", status=1)
    assert in_one_line(result.output, "cannot write", "--out")


@pytest.mark.parametrize(
    ("name", "make", "reported"),
    [
        ("picture.png", lambda file: file.write_text("mine"), "is of no run"),
        ("trace.csv", os.mkfifo, "is a pipe, not a file"),
        ("run.json", lambda file: file.mkdir(), "is a folder, not a file"),
        ("trace.csv", lambda file: file.symlink_to("/dev/null"), "is a device, not a file"),
    ],
)
def test_what_is_of_no_run_is_not_written_over(simulate, tmp_path, script, name, make, reported):
    out = tmp_path / "out"
    out.mkdir()
    make(out / name)
    result = simulate(script("print('it ran')"), out=out, status=1)
    assert in_one_line(result.output, name, reported)
    assert "it ran" not in result.output
    assert os.listdir(out) == [name]


def test_a_full_disk_is_refused_before_anything_runs(tmp_path, script):
    """A limit on the size of files stands for it: the first megabyte does not fit."""
    done = process(
        "--out",
        tmp_path / "out",
        script("print('it ran')"),
        # Python would not notice that half of its bytecode is missing.
        env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)),
    )
    assert done.returncode == 1
    assert in_one_line(done.stderr, "cannot write", "--out")
    assert "it ran" not in done.stdout
    assert os.listdir(tmp_path / "out") == []


@pytest.mark.short(every=3)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full to stand for a full disk")
@pytest.mark.parametrize("name", ["trace.csv", "run.json", "picture.png"])
def test_a_disk_that_fills_up_during_the_run(simulate, name, script, monkeypatch):
    source = script("print('it ran')")
    out = simulate("--picture", source).out
    before = {name: (out / name).read_bytes() for name in os.listdir(out)}

    def full(suffix, prefix, folder):
        descriptor, draft = tempfile.mkstemp(suffix, prefix, folder)
        if name.endswith(suffix):
            os.remove(draft)
            os.symlink("/dev/full", draft)
        return descriptor, draft

    monkeypatch.setattr("laptop.system.files.tempfile", SimpleNamespace(mkstemp=full))
    result = simulate("--picture", source, with_picture=True, status=1)
    last = result.stderr if hasattr(result, "stderr") else result.output
    assert in_one_line(last.splitlines()[-1] + "\n", "cannot write", "No space left", "--out")
    assert "Traceback" not in result.output
    assert (out / name).read_bytes() == before[name], "the old file is whole"
    assert sorted(os.listdir(out)) == sorted(before)


# The trace is what is measured


def test_the_figures_can_be_worked_out_from_the_trace(line):
    class Row:
        def __init__(self, row):
            self.t, self.x, self.y = (float(row[key]) for key in ("t", "x", "y"))
            self.z, self.pen = None, int(row["pen"])

    (again,) = measure([Row(row) for row in rows(line.out)], [[(10, 0), (5, 10)]])
    reported = run_in(line.out)["paths"][0]
    assert again.greatest_mm == pytest.approx(reported["greatest mm"], abs=0.01)
    assert again.rms_mm == pytest.approx(reported["rms mm"], abs=0.01)


def test_as_a_process_like_in_the_readme(tmp_path):
    done = process("--out", tmp_path, "robot/driver.py", "line", "10,0", "5,10")
    assert (done.returncode, done.stderr) == (0, "")
    assert "path 1: 11.2 cm" in done.stdout
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_a_path_told_the_wrong_way_is_one_line(simulate, script):
    reported = script(
        "import os\n"
        "with open(os.environ['BRICKSERVO_PLAN'], 'a') as plan:\n"
        "    plan.write('10,0')\n"
    )
    shown = simulate(str(reported), status=1)
    assert in_one_line(shown.stderr, "line 1 of $BRICKSERVO_PLAN")


def test_a_bare_brick_has_the_motors_that_are_plugged_in(simulate, script):
    """Where an arm has its own, nothing else is plugged in; beside them what nobody asked for."""
    listing = script(
        "from ev3dev2.motor import list_motors, LargeMotor\n"
        "print(sorted(motor.address[-1] + motor.driver_name[-7] for motor in list_motors()))\n"
    )
    cases = {
        (): "['Al', 'Bl', 'Cm', 'Dl']",
        ("--plug", "D=medium"): "['Al', 'Bl', 'Cm', 'Dm']",
        ("--arm", "none"): "[]",
        ("--arm", "none", "--plug", "C=large", "--plug", "A=medium"): "['Am', 'Cl']",
        ("--arm", "none", "--wheels", "left=C,right=B", "--plug", "B=medium"): "['Bm', 'Cl']",
    }
    for args, wanted in cases.items():
        result = simulate(*args, listing)
        assert result.output.splitlines()[0] == wanted, args
    turn = script(
        "from ev3dev2.motor import LargeMotor\nm = LargeMotor('outC')\n"
        "m.on_for_degrees(30, 360)\nprint(m.position)\n"
    )
    result = simulate("--arm", "none", "--plug", "C=large", turn)
    assert int(result.output.split()[0]) == pytest.approx(360, abs=8)
    last = rows(result.out)[-1]
    assert math.degrees(float(last["C"])) == pytest.approx(360, abs=8)
    assert set(last) == {"t", "C", "x", "y", "pen"}
    assert "no picture" in result.output


def test_what_is_missing_is_told_with_what_is_there(simulate, script):
    missing = script("from ev3dev2.sensor.lego import GyroSensor\nGyroSensor()\n")
    result = simulate(
        "--arm", "none", "--plug", "B=medium", "--plug", "in2=none", missing, status=1
    )
    assert result.stderr.splitlines()[-1] == (
        "simulate: plugged in: outB lego-ev3-m-motor, in1 lego-ev3-touch, in3 lego-ev3-touch, "
        "in4 lego-ev3-touch; see --plug"
    )
    fine = script("from ev3dev2.sensor.lego import TouchSensor\nTouchSensor('in1')\n")
    assert "plugged in" not in simulate(fine).stderr


def test_a_robot_on_wheels_leaves_its_way(simulate, script):
    """A third of a turn in place, 20 cm on: by the wheels' 5.6 cm on a track of 12 cm."""
    drive = script(
        "from ev3dev2.motor import *\ntank = MoveTank(OUTPUT_B, OUTPUT_C)\n"
        f"tank.on_for_degrees(-20, 20, {120 * 12 / 5.6})\n"
        f"tank.on_for_degrees(20, 20, {360 * 20 / (5.6 * math.pi)})\n"
    )
    result = simulate(
        "--arm", "none", "--wheels", "left=B,right=C", drive, with_picture=True
    )  # fmt: skip
    last = {key: float(value) for key, value in rows(result.out)[-1].items()}
    assert math.degrees(last["heading"]) == pytest.approx(90 + 120, abs=2)
    assert last["x"] == pytest.approx(20 * math.cos(math.radians(210)), abs=0.7)
    assert last["y"] == pytest.approx(20 * math.sin(math.radians(210)), abs=0.7)
    assert (result.out / "picture.png").stat().st_size > 1000


def test_an_arm_without_a_pen_motor_is_not_measured(simulate, tmp_path):
    text = Path(find_arm("planar")).read_text()
    arm = tmp_path / "penless.ini"
    arm.write_text(text[: text.index("# An arm without")])
    result = simulate("--arm", arm, DRIVER, *LINE)
    assert "not measured" in result.output
    assert run_in(result.out)["paths"] == []


# Where another run ended


def leave_a_run(folder, *rows):
    folder.mkdir()
    (folder / "trace.csv").write_text("\n".join(["t,q1,q2,x,y,pen", *rows, ""]))
    (folder / "run.json").write_text("{}")


def test_a_run_goes_on_where_another_has_ended_within_what_is_allowed(tmp_path):
    leave_a_run(tmp_path / "first", "0.0,0,0,1,1,0", "0.1,-3.0,0.5,1,1,0")
    arm = read_arm(find_arm("planar"))
    q, homed = brick_home.read_start(f"after:{tmp_path / 'first'}", arm)
    assert homed
    assert q == pytest.approx((arm.joints[0].lower, 0.5))


def test_the_other_run_is_waited_for(tmp_path, monkeypatch):
    looks = []

    def look(seconds):
        looks.append(seconds)
        if len(looks) == 3:
            leave_a_run(tmp_path / "first", "0.1,0.2,0.3,1,1,0")

    monkeypatch.setattr(brick_home, "time", SimpleNamespace(sleep=look))
    arm = read_arm(find_arm("planar"))
    assert brick_home.read_start(f"after:{tmp_path / 'first'}", arm) == ((0.2, 0.3), True)
    assert len(looks) == 3


@pytest.mark.parametrize("rows", [[], ["0.1,x,0.3,1,1,0"], ["0.1,0.2"]])
def test_a_run_of_nothing_or_of_another_arm_is_refused(tmp_path, rows):
    leave_a_run(tmp_path / "first", *rows)
    refused = r"there is no trace of this arm; give the --out"
    with pytest.raises(InvalidSimulationOption, match=refused):
        brick_home.read_start(f"after:{tmp_path / 'first'}", read_arm(find_arm("planar")))


# A brick that was measured


# python-ev3dev2 leaves its files open, and some of them here are real ones.
@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
def test_a_measured_brick_is_emulated_and_the_plant_overrides(simulate, tmp_path):
    file = tmp_path / "brick.json"
    args = ["--json", file, "planar", "--bare", "D"]
    bench = ["--plant", "cpu=2,access=0.002,rotor_friction=1.4", BENCH, *args]
    simulate(*bench)
    result = simulate("--constants", file, "--plant", "access=0.0005", DRIVER, "where")
    summary = run_in(result.out)
    assert (summary["constants"], summary["plant"]) == (file.name, "access=0.0005")
    assert summary["cpu"] == pytest.approx(2.0, rel=0.02)
    assert summary["measured"].startswith("cpu = 2")
    assert f"as {file} has it: cpu = 2" in result.output
    # Slow as it is, but quick to access.
    slow = simulate("--plant", "cpu=2,access=0.0005", DRIVER, "where")
    reported = run_in(slow.out)
    assert reported["seconds"] == pytest.approx(summary["seconds"], rel=0.02)
    assert "constants" not in reported


@pytest.mark.parametrize("content", [None, "{}", '{"format": "brickservo brick", "version": 1}'])
def test_bad_constants_are_refused_before_anything_runs(simulate, tmp_path, content):
    file = tmp_path / "brick.json"
    if content:
        file.write_text(content)
    result = simulate("--constants", file, DRIVER, *LINE, status=1)
    assert in_one_line(result.output, "Error: ", str(file), "bench_brick.py")
    assert not result.out.exists()


# An arm that is not as described


def built(tmp_path, *changes):
    """The file of a planar arm with some lines of its sections changed."""
    text = Path(find_arm("planar")).read_text()
    for section, line in changes:
        head, body = text.split(f"[{section}]")
        key = line.split("=")[0]
        text = head + f"[{section}]" + re.sub(rf"(?m)^{key}=.*$", line, body, count=1)
    file = tmp_path / "built.ini"
    file.write_text(text)
    return str(file)


@pytest.mark.parametrize(
    ("changes", "truly"),
    [
        ([("shoulder", "direction = -1")], lambda a, b: (-a, b)),
        ([("elbow", "direction = -1")], lambda a, b: (a, -b)),
        ([("shoulder", "port = B"), ("elbow", "port = A")], lambda a, b: (b, a)),
    ],
    ids=["shoulder reversed", "elbow reversed", "swapped"],
)
def test_what_turns_is_the_arm_as_it_was_built(simulate, tmp_path, changes, truly):
    result = simulate("--built", built(tmp_path, *changes), DRIVER, "move", "12,6")
    *_, last = rows(result.out)
    reported = re.search(r"joints at (\S+), (\S+) deg", result.output).groups()
    assert [float(last["q1"]), float(last["q2"])] == pytest.approx(
        [math.radians(angle) for angle in truly(*map(float, reported))], abs=math.radians(2.5)
    )
    assert run_in(result.out)["built"]["name"] == "built"


@pytest.mark.long
def test_a_rendered_camera_finds_what_was_built_otherwise(simulate, tmp_path):
    changes = [("shoulder", "port = B"), ("shoulder", "direction = -1"), ("elbow", "port = A")]
    file, mine = built(tmp_path, *changes), tmp_path / "mine.ini"
    mine.write_text(Path(find_arm("planar")).read_text())
    result = simulate(
        *("--arm", str(mine), "--built", file, "--start", "unchecked", "--no-picture"),
        *("--scene", "goal_x=0,goal_y=8,tilt=20", DRIVER, "check", "--camera"),
    )
    assert "are swapped; the shoulder" in result.output
    for joint, truly in zip(read_arm(str(mine)).joints, read_arm(file).joints, strict=True):
        assert (joint.port, joint.direction) == (truly.port, truly.direction)


def test_an_arm_without_stops_turns_on(simulate, tmp_path):
    file = built(tmp_path, ("elbow", "stop_upper = none"), ("elbow", "find_home = here"))
    result = simulate("--built", file, "--start", "lost", DRIVER, "home", "--seek", status=1)
    assert "the elbow found no stop" in result.stderr
    assert max(float(row["q2"]) for row in rows(result.out)) > math.radians(165)


def test_an_arm_of_another_chain_is_refused(simulate):
    result = simulate("--built", "spatial", DRIVER, "where", status=1)
    assert re.search("spatial .*planar", result.output)


@pytest.mark.short("end")
@pytest.mark.parametrize(
    ("answers", "status", "reported"),
    [
        ([("Enter. ", "\n"), ("again] ", "s"), ("right] ", "l"), ("again] ", "e"),
          ("right] ", "r")], 0, "[elbow] direction = -1"),
        ([("Enter. ", "\n"), ("again] ", "\x04")], 1, "driver.py: nobody answers"),
        ([("Enter. ", "\n"), ("again] ", "\x03")], 130, "driver.py: stopped by SIGINT"),
        ([("Enter. ", "\x03")], 130, "driver.py: stopped by SIGINT"),
    ],
    ids=["answers", "end", "Ctrl-C at a key", "Ctrl-C at a line"],
)  # fmt: skip
def test_somebody_answers_at_a_terminal(tmp_path, answers, status, reported):
    """Keys count at once, and while the script waits for them no emulated time passes."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    args = ["--out", str(tmp_path / "out"), "--no-picture", "--start", "unchecked"]
    child = subprocess.Popen(
        [sys.executable, "-m", "laptop", "simulate", *args, DRIVER, "check"],
        cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )  # fmt: skip
    os.close(theirs)
    said = all_said = b""
    answers = list(answers)
    with contextlib.suppress(OSError):  # the end, on Linux
        while select.select([ours], [], [], 60)[0]:
            said += os.read(ours, 1000)
            if answers and answers[0][0].encode() in said:
                os.write(ours, answers.pop(0)[1].encode())
                all_said, said = all_said + said, b""
    os.close(ours)
    assert child.wait(60) == status
    assert reported in (all_said + said).decode()
    assert run_in(tmp_path / "out")["seconds"] < 10


def test_a_bare_brick_was_not_built_as_an_arm(simulate):
    result = simulate("--arm", "none", "--built", "planar", DRIVER, status=1)
    assert "--built planar is an arm, and --arm none has none; leave one of them out" in (
        result.output
    )


@pytest.mark.parametrize(
    ("source", "written"),
    [
        ("import sys; sys.stdout.write('half')", "half\n"),
        ("print('half', end='')", "half\n"),
        ("import sys; sys.stdout.buffer.write(b'half')", "half\n"),
        ("import sys; sys.stderr.write('half')", "half\n"),
        ("import os; os.system('echo whole')", "whole\n"),
        ("print('whole')", "whole\n"),
        ("", ""),
    ],
)
def test_the_summary_begins_a_line_of_its_own(simulate, script, source, written):
    result = simulate("--arm", "none", script(source))
    assert result.output.startswith(written + "ended, status 0, after ")


def test_what_is_told_of_the_end_begins_a_line_of_its_own(simulate, script):
    source = "import time\nprint('half', end='')\ntime.sleep(9)\n"
    result = simulate("--arm", "none", "--timeout", 1, script(source), status=124)
    assert "half\nsimulate: mine.py: stopped after 1 s" in result.output


def test_the_standard_streams_are_the_own_ones_again_after_a_run(simulate, script):
    before = sys.stdout, sys.stderr
    result = simulate("--arm", "none", script("import sys; print(sys.stdout.isatty(), end='')"))
    assert result.output.startswith("False\nended")
    assert (sys.stdout, sys.stderr) == before


@pytest.mark.parametrize("arm", [("--arm", "none"), ()], ids=["bare", "beside an arm"])
@pytest.mark.parametrize("kind", ["large", "medium"])
def test_a_gripper_homes_against_its_stop(simulate, script, arm, kind):
    """From -90 to 40 deg about where it starts; a free motor would turn on for ever."""
    homing = script(
        "from ev3dev2.motor import Motor\nm = Motor('outD')\nfound = []\n"
        "for speed in -15, 15:\n    m.on(speed)\n    m.wait_until('stalled', 5000)\n"
        "    m.off(brake=False)\n    found.append(m.position)\n"
        "m.on_for_degrees(20, found[0] - found[1] + 30)\n"
        "print(*found, m.position, m.is_stalled)\n"
    )
    result = simulate(*arm, "--plug", f"D={kind}:-90..40", homing)
    lower, upper, inside, stalled = result.output.splitlines()[0].split()
    assert (int(lower), int(upper)) == (pytest.approx(-90, abs=1), pytest.approx(40, abs=1))
    assert (int(inside), stalled) == (pytest.approx(-60, abs=5), "False")
    if arm:
        angles = [math.degrees(float(row["D"])) for row in rows(result.out)]
        assert (min(angles), max(angles)) == (pytest.approx(-90), pytest.approx(40))


# What a servo's log adds


SERVO_WORDS = ("--scene", "tilt=20", "--plant", "cpu=0", "visual_servoing.py", "--goal", "400,200")


@pytest.mark.long
def test_a_servos_log_becomes_its_goal_its_figures_and_the_true_error(simulate, tmp_path):
    result = simulate(*SERVO_WORDS, "--log", tmp_path / "x.jsonl", with_picture=True)
    reported = run_in(result.out)
    (goal,) = reported["goals"]
    assert (reported["kind"], goal["goal"], goal["ended"]) == ("servo", "400, 200", "converged")
    assert goal["truly off px"] == pytest.approx(goal["off, the servo says px"], abs=1.5)
    assert goal["truly off px"] < 8
    assert goal["truly reached"] is True
    names = {"x.jsonl", "cameras.png", "errors.png", "joints.png", "goal-true-path.csv"}
    assert names < set(reported["files"]) <= set(os.listdir(result.out))
    simulate(DRIVER, "where")
    assert not names & set(os.listdir(result.out)), "the earlier run goes with all its files"


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "args",
    ['{"kind":"run"}', '{"kind":"run","method":"chain","tolerance":5,"goal":{"A":"x"}}', "hello"],
)
def test_what_is_no_log_costs_the_figures_and_not_the_run(simulate, script, tmp_path, args):
    source = f"import sys\nopen(sys.argv[2], 'w').write({args!r} + '\\n')\n"
    result = simulate("--scene", "", script(source), "--log", tmp_path / "x.jsonl")
    reported = run_in(result.out)
    assert reported["kind"] == "script"
    assert ("x.jsonl: " in " ".join(reported["notes"])) is (args != "hello")


@pytest.mark.parametrize("name", ["x.jsonl", "goal-true-path.csv"])
def test_where_the_log_would_take_somebodys_file_nothing_runs(simulate, tmp_path, name):
    out = tmp_path / "mine"
    out.mkdir()
    (out / name).write_text("precious")
    result = simulate(*SERVO_WORDS, "--log", tmp_path / "x.jsonl", out=out, status=1)
    assert f"{name} is of no run" in result.output
    assert (out / name).read_text() == "precious"


def test_the_words_of_a_script_are_kept_as_they_were_typed(simulate, script):
    args = ("--out", "foo", "--out=bar", "two words")
    reported = run_in(simulate("--timeout", "3", script("print(1)"), *args).out)
    assert reported["typed"] == ["simulate", "--timeout", "3", "mine.py", *args]
