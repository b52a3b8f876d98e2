"""What `bench_brick.py` measures of an emulated brick is what that brick is."""

import io
import json
import math
import os
from contextlib import redirect_stderr, redirect_stdout

import ev3dev2
import pytest
from clocks import FakeClock
from one_run import one_run
from places import ROBOT, ROOT

from laptop.emulator import measured_brick
from laptop.emulator.device.plant_constants import MOTORS, BadPlant, at_port, read_plant
from laptop.emulator.faults import read_fault
from laptop.emulator.rig import Plugs
from robot.benching import laps, measuring, system
from robot.benching.figures import Pass
from robot.benching.figures import figures as figures_of
from shared.arm_description import find_arm, read_arm

SCRIPT = str(ROBOT / "bench_brick.py")

# python-ev3dev2 leaves its files open, and some of them here are real ones.
pytestmark = [pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")]
if hasattr(pytest, "PytestUnraisableExceptionWarning"):  # not the last pytest for Python 3.5
    pytestmark.append(pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"))


class Shown:
    """A run of the script: outcome, motors, record, what it said, its file."""

    def __init__(self, folder, args, arm="planar", plant="", extra=None, script=SCRIPT, **options):
        self.arm = read_arm(find_arm(arm))
        self.file = os.path.join(str(folder), "brick.json")
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            run = one_run(
                self.arm,
                script,
                ["planar", "--json", self.file] + args.split(),
                plant=plant,
                plugs=Plugs(extra),
                **options,
            )
        self.outcome, self.motors, self.record = run.outcome, run.motors, run.record
        self.out, self.err = out.getvalue(), err.getvalue()

    def figures(self):
        with open(self.file) as file:
            return json.load(file)

    def is_refused(self, status, *args):
        assert self.outcome.status == status
        assert self.err.count("\n") == 1
        assert "Traceback" not in self.err
        assert all(word in self.err for word in args), self.err
        assert not any(motor["driven"] for motor in self.motors.values())
        return True


@pytest.fixture
def bench(tmp_path):
    def run(args="", **options):
        return Shown(tmp_path, args, **options)

    return run


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    """A planar arm that is measured, after which another program asks it where it is."""
    folder = tmp_path_factory.mktemp("moved")
    script = folder / "both.py"
    script.write_text(
        "import sys\n"
        f"sys.path.insert(0, {str(ROOT)!r})\n"
        "from robot import bench_brick, driver\n"
        "sys.exit(bench_brick.main() or driver.main(['where']))\n"
    )
    return Shown(folder, "--move", script=str(script))


def within(share, found, true):
    return abs(found - true) <= share * abs(true)


# There and back


@pytest.mark.long
@pytest.mark.parametrize(
    ("arm", "plant"),
    [
        ("planar", "cpu=0"),
        ("planar", "cpu=1.5,access=0.0007,link_friction=0.02,backlash=3,voltage=7.2"),
        ("planar", "cpu=0.7,emf_constant=1.2,rotor_friction=1.5,shoulder_inertia=0.006"),
        ("planar", "cpu=1,rotor_inertia=1.5,rotor_friction=0.6,phase=0.4,elbow_inertia=0.002"),
        ("planar", "cpu=2.5,access=0.002,seed=5,backlash=4"),
        ("geared", "cpu=1.5,access=0.001,link_friction=0.05,backlash=1,emf_constant=0.9"),
        ("geared", "seed=8"),
    ],
    ids=lambda value: value,
)
def test_it_gives_back_the_emulated_bricks_own_constants(bench, arm, plant):
    extra = {"D": "large"}
    run = bench("--move --bare D", arm=arm, plant=plant, extra=extra)
    assert (run.outcome.status, run.err) == (0, "")
    true = read_plant(plant)
    measured = measured_brick.read_constants(run.file, run.arm)
    assert within(0.1, measured["cpu"], true["cpu"])
    assert within(0.1, measured["voltage"], true["voltage"])
    access = {None: 0.00044 * true["cpu"] or 0.001}.get(true["access"], true["access"])
    assert within(0.1, measured["access"], access)
    found = read_plant("", measured)
    nominal = MOTORS["large"]
    inertias = true["shoulder_inertia"], true["elbow_inertia"]
    for joint, inertia in zip(run.arm.joints, inertias):
        its, own = at_port(found, joint.port), at_port(true, joint.port)
        assert within(0.1, its["emf_constant"], own["emf_constant"])
        # What the motor feels, as of one with the nominal torque per volt.
        torque = own["torque_constant"] / own["resistance"]
        friction, its_friction = (
            nominal.friction * of["rotor_friction"] + of["link_friction"] / joint.gear
            for of in (own, its)
        )
        assert within(0.1, its_friction * torque, friction)
        of_link = found[joint.name + "_inertia"]
        its_inertia, all_inertia = (
            nominal.inertia * of["rotor_inertia"] + its_link / joint.gear**2
            for of, its_link in ((its, of_link), (own, inertia))
        )
        assert within(0.1, its_inertia * torque, all_inertia)
        play = true["backlash"] or math.degrees(joint.backlash)
        assert within(0.1, its["backlash"], play)
        if arm == "planar" and true["seed"] is None:  # no motor differs from the bare one
            assert within(0.1, its["link_friction"], own["link_friction"])
            assert within(0.1 if joint.name == "shoulder" else 0.2, of_link, inertia)
    bare, own = at_port(found, "D"), at_port(true, "D")
    torque = own["torque_constant"] / own["resistance"]
    assert within(0.1, bare["emf_constant"], own["emf_constant"])
    assert within(0.1, bare["rotor_friction"] * torque, own["rotor_friction"])
    assert within(0.1, bare["rotor_inertia"] * torque, own["rotor_inertia"])


@pytest.mark.long
def test_full_duty_of_a_bare_motor_is_what_was_published(bench):
    run = bench("--bare D", plant="cpu=0", extra={"D": "medium"})
    (motor,) = run.figures()["motors"].values()
    nominal = MOTORS["medium"]
    volts = 8.0 - nominal.resistance * nominal.friction / nominal.torque_constant
    free = math.degrees(volts / nominal.emf_constant)
    assert within(0.02, motor["no_load_deg_per_s"], free)
    assert within(0.01, motor["brake_from_deg_per_s"], free)
    # The braked motor's own equation, integrated to the standstill.
    rubs = free * (8.0 - volts) / volts
    time = nominal.inertia * nominal.resistance / nominal.torque_constant / nominal.emf_constant
    distance = time * (free - rubs * math.log(1 + free / rubs))
    assert within(0.05, motor["brake_deg"], distance)
    assert within(0.05, motor["brake_time_s"], time)
    assert max(max(map(abs, sample.q)) for sample in run.record) < 1e-9  # the arm stays


@pytest.mark.long
@pytest.mark.parametrize("plant", ["cpu=0", "cpu=1"])
def test_an_arm_in_space_is_measured_off_the_table_and_never_let_go(bench, plant):
    run = bench("--move", arm="spatial", plant=plant)
    assert (run.outcome.status, run.err) == (0, "")
    measured = measured_brick.read_constants(run.file, run.arm)
    for joint in run.arm.joints:
        own = measured["ports"][joint.port]
        friction = 0.0165 * own["rotor_friction"] + own["link_friction"] / joint.gear
        assert within(0.1, friction, 0.0165 + 0.01 / joint.gear)
        assert within(0.1, own["emf_constant"], 1.0)
    assert within(0.1, measured["ports"]["A"]["backlash"], 2.0)
    assert "backlash" not in measured["ports"]["B"]
    motors = run.figures()["motors"]
    assert "brake_deg" in motors["A"]
    assert "brake_deg" not in motors["B"]
    assert min(sample.z for sample in run.record) > 0.5
    for k in (1, 2):
        joint = run.arm.joints[k]
        angles = [sample.q[k] for sample in run.record]
        lower = joint.lower if joint.park_angle is None else min(joint.park_angle, joint.lower)
        assert lower - 0.05 < min(angles)
        assert max(angles) < joint.upper + 0.05
    assert "it takes both stops" in run.out
    assert "is held, not braked" in run.out


# What it does without, and before


def test_nothing_turns_unless_asked(bench):
    run = bench(plant="cpu=1", extra={"D": "large"})
    assert run.outcome.status == 0
    assert run.outcome.t + run.outcome.start < 180
    assert len({sample.q for sample in run.record}) == 1
    assert all(motor["position"] == 0 for motor in run.motors.values())
    figures = run.figures()
    assert (figures["motors"], figures["arm"]) == ({}, None)
    assert (figures["format"], figures["version"]) == (measuring.FORMAT, measuring.VERSION)
    measured = measured_brick.read_constants(run.file, run.arm)
    assert measured["cpu"] == pytest.approx(1.0, rel=0.02)
    assert set(measured) == {"cpu", "access", "ports"}


def test_a_brick_that_computes_in_no_time_is_one(bench):
    assert (
        measured_brick.read_constants(bench(plant="cpu=0").file, read_arm(find_arm("planar")))[
            "cpu"
        ]
        == 0.0
    )


@pytest.mark.long
def test_it_tells_how_long_python_and_imports_take(bench):
    starts = []
    for cpu in (1, 2):
        taken = bench(plant=f"cpu={cpu}").figures()["laps_s"]
        starts.append({name: each[0] for name, each in taken.items() if "start: " in name})
    assert len(starts[0]) == 4
    # Of Python itself: 52 million instructions, of 22.7 ns, and then the script.
    assert 1.18 < starts[0]["start: Python"] < 1.5
    assert 3 < sum(starts[0].values()) < 7
    for name, seconds in starts[0].items():
        assert starts[1][name] == pytest.approx(2 * seconds, abs=0.02)


@pytest.mark.parametrize(
    ("args", "options", "message"),
    [
        ("--move", {"start": "lost"}, ["has not been homed", "home it first"]),
        ("--bare A", {}, ["port A is one of the planar arm's"]),
        ("--bare D", {}, ["no EV3 motor at port D"]),
        ("--json /nowhere/x.json", {}, ["cannot write /nowhere/x.json", "--json"]),
        ("--move --arm nosuch", {}, ["nosuch"]),
    ],
)
def test_what_cannot_be_measured_is_refused_before_anything_moves(bench, args, options, message):
    run = bench(args, **options)
    assert run.is_refused(1, *message)
    assert run.outcome.t < 1
    assert len({sample.q for sample in run.record}) == 1
    assert not os.path.exists(run.file)


# What goes wrong


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("fault", "status", "message"),
    [
        ("int@30", 130, "SIGINT"),
        ("term@60", 143, "SIGTERM"),
        ("dead-encoder:A@30", 1, "shoulder (port A) does not turn"),
        ("hup@112", 129, "SIGHUP"),
        ("stall:A@30", 1, "shoulder (port A) does not turn"),
        ("unplug:B@100", 1, "port B no longer answers"),
        ("dead-encoder:D@134", 1, "port D"),
        ("stall:B@94", 1, "elbow (port B) does not turn"),
        ("unplug:A@30", 1, "port A no longer answers"),
        ("freeze@30", 124, "frozen"),
        ("kill@100", 137, "killed"),
    ],
)
def test_it_always_stops(bench, fault, status, message):
    faults = [read_fault(fault)]
    run = bench("--move --bare D", plant="cpu=0", extra={"D": "large"}, faults=faults)
    assert run.is_refused(status, message)
    at = float(fault.partition("@")[2])
    assert run.outcome.t < at + (0.5 if status != 124 else 0.01)
    late = [sample.q for sample in run.record if sample.t > at + 0.8]
    assert late
    assert max(max(q) - min(q) for q in zip(*late)) < math.radians(1)
    for joint, angles in zip(run.arm.joints, zip(*(sample.q for sample in run.record))):
        if at <= 30:  # before it touches any stop
            assert joint.lower < min(angles)
            assert max(angles) < joint.upper
    assert not os.path.exists(run.file)


@pytest.mark.long
def test_joints_stay_within_their_limits_but_for_their_stops(moved):
    assert moved.outcome.status == 0
    for joint, angles in zip(moved.arm.joints, zip(*(sample.q for sample in moved.record))):
        inside = [a for a in angles if joint.lower <= a <= joint.upper]
        assert len(inside) > 0.9 * len(angles)
        # What lies beyond is a touch: slower than any pass.
        speeds = [
            abs(b - a) / 0.005
            for a, b in zip(angles, angles[1:])
            if not joint.lower - 0.02 <= a <= joint.upper + 0.02
        ]
        assert max(speeds) < math.radians(140)


@pytest.mark.long
def test_afterwards_the_arm_knows_where_it_is(moved):
    assert (moved.outcome.status, moved.err) == (0, "")
    assert "tip at 20.80," in moved.out


# The pieces


class LateClock(FakeClock):
    """Sleeps longer than asked, each time by more."""

    late = 0.0

    def sleep(self, seconds):
        self.late += 1e-4
        self.t += seconds + self.late


def test_jitter_is_how_late_a_sleep_wakes_up():
    taken = laps.Laps()
    system.measure_naps(LateClock(5.0), taken)
    ((name, late),) = taken.taken.items()
    assert "20 ms" in name
    assert late == pytest.approx([1e-4 * n for n in range(1, system.NAPS + 1)])


def test_without_a_motor_there_is_no_access(tmp_path, monkeypatch):
    (tmp_path / "tacho-motor").mkdir()
    monkeypatch.setattr(ev3dev2.Device, "DEVICE_ROOT_PATH", str(tmp_path))
    taken = laps.Laps()
    assert system.measure_accesses(taken) is None
    assert not taken.taken


@pytest.mark.parametrize("text", [None, "1 (python3", "1 (x) R 0"])
def test_where_linux_does_not_tell_the_age_is_unknown(tmp_path, monkeypatch, text):
    file = tmp_path / "stat"
    if text is not None:
        file.write_text(text)
    monkeypatch.setattr(system, "STAT", str(file))
    assert system.age(50.0) is None


def test_figures_of_passes_worked_out_by_hand():
    # 8 V, Ke = 0.5, F = 0.4 V, J = 0.05: at 4 rad/s 2.4 V are 30 %.
    def a_pass(speed, offset):
        duty = (0.5 * speed + 0.4) / 8 * 100
        # Speeding up as fast as 5 rad/s^2: the time is w / 5, half the way of the steady motion.
        time = speed / 5
        extra = (0.05 * 5 - 0.5 * speed / 2) / 8 * 100 * time
        return Pass(speed, duty + offset, 8.0, speed * time / 2, extra, 0.1 * speed)

    pairs = [[a_pass(speed, 3), a_pass(speed, -3)] for speed in (2.0, 4.0)]
    found = figures_of(pairs, "large")
    assert found["emf_volts_s_per_rad"] == pytest.approx(0.5)
    assert found["friction_volts"] == pytest.approx(0.4)
    assert found["friction_duty_percent"] == pytest.approx(5.0)
    assert found["no_load_deg_per_s"] == pytest.approx(math.degrees(7.6 / 0.5), rel=1e-4)
    assert found["inertia_volts_s2_per_rad"] == pytest.approx(0.05)
    assert found["brake_time_s"] == pytest.approx(0.1)
    assert found["brake_deg"] == pytest.approx(math.degrees(0.4), rel=1e-4)


# The file


def figures(**changes):
    """A small file as of a planar arm, the shoulder's motor alone and no bare one."""
    motor = {
        "kind": "large",
        "joint": "shoulder",
        "gear": 1.0,
        "volts": 7.5,
        "emf_volts_s_per_rad": 0.473,
        "friction_volts": 0.53,
        "inertia_volts_s2_per_rad": 0.088,
        "backlash_deg": 2.5,
    }
    pieces = {str(n): [1.02 + n] for n in range(measured_brick.MIN_PIECES)}
    pieces[laps.EMPTY_LAP] = [0.02]
    return dict(
        {
            "format": measuring.FORMAT,
            "version": measuring.VERSION,
            "arm": "planar",
            "laps_s": pieces,
            "access_s": 0.0006,
            "motors": {"A": motor},
        },
        **changes,
    )


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read constants from these figures, or this text; the pieces took a second each at cpu=1."""
    at_pace = {str(n): [0.01 + (n + 1) / 2] for n in range(measured_brick.MIN_PIECES)}
    at_pace[laps.EMPTY_LAP] = [0.01]
    monkeypatch.setattr(measured_brick, "_laps_at_true_pace", lambda: at_pace)

    def call(content):
        file = tmp_path / "brick.json"
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        return measured_brick.read_constants(str(file), read_arm(find_arm("planar")))

    return call


def test_the_link_has_what_the_rotor_has_not(read):
    found = read(figures())
    assert found["cpu"] == pytest.approx(2.0)
    assert (found["access"], found["voltage"]) == (0.0006, 7.5)
    own = found["ports"]["A"]
    assert own["rotor_friction"] == own["rotor_inertia"] == 1.0  # no bare one: nominal
    assert own["link_friction"] == pytest.approx(0.53 * 0.05 - 0.0165)
    assert found["shoulder_inertia"] == pytest.approx(0.088 * 0.05 - 0.0014)
    assert own["backlash"] == 2.5


def test_a_motor_that_is_better_than_nominal_leaves_its_link_nothing(read):
    motor = dict(figures()["motors"]["A"], friction_volts=0.2, inertia_volts_s2_per_rad=0.02)
    found = read(figures(motors={"A": motor}))
    own = found["ports"]["A"]
    assert own["link_friction"] == 0.0
    assert own["rotor_friction"] * 0.0165 == pytest.approx(0.2 * 0.05)
    assert found["shoulder_inertia"] == pytest.approx(1e-5)
    assert own["rotor_inertia"] * 0.0014 == pytest.approx(0.02 * 0.05 - 1e-5)


def test_a_bare_motor_tells_what_is_the_motors(read):
    motors = dict(figures()["motors"])
    motors["D"] = {
        "kind": "large",
        "volts": 8.5,
        "emf_volts_s_per_rad": 0.5,
        "friction_volts": 0.4,
        "inertia_volts_s2_per_rad": 0.03,
    }
    found = read(figures(motors=motors))
    assert found["voltage"] == 8.0
    assert found["ports"]["A"]["rotor_friction"] * 0.0165 == pytest.approx(0.02)
    assert found["ports"]["A"]["link_friction"] == pytest.approx(0.0065)
    assert found["ports"]["D"]["rotor_inertia"] * 0.0014 == pytest.approx(0.0015)
    assert found["shoulder_inertia"] == pytest.approx(0.0044 - 0.0015)


def test_what_the_plant_says_comes_before_what_was_measured(read):
    measured = read(figures())
    plant = read_plant("backlash=4,cpu=0", measured)
    assert (plant["cpu"], plant["voltage"], plant["access"]) == (0.0, 7.5, 0.0006)
    assert at_port(plant, "A")["backlash"] == 4.0
    assert at_port(plant, "A")["link_friction"] == pytest.approx(0.01)
    assert at_port(plant, "B")["link_friction"] == 0.01
    assert at_port(read_plant("", measured), "A")["backlash"] == 2.5
    assert at_port(read_plant("", measured), "B")["backlash"] is None
    scattered = at_port(read_plant("seed=3,spread=0.1", measured), "A")
    assert scattered["rotor_friction"] != 1.0
    assert scattered["rotor_friction"] == pytest.approx(1.0, abs=0.1)


def motor_with(**changes):
    return figures(motors={"A": dict(figures()["motors"]["A"], **changes)})


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "was not written by robot/bench_brick.py"),
        ("[1, 2]", "was not written by"),
        ('{"format": "other"}', "was not written by"),
        (figures(version=2), "is of version 2, and this program reads 1"),
        (figures(laps_s={"0": [0.1], laps.EMPTY_LAP: [0.0]}), "how long 1 known pieces"),
        (figures(laps_s=[]), "0 known pieces"),
        (figures(laps_s=None), "is missing or is not a number"),
        (figures(motors=[]), "is missing or is not a number"),
        (figures(motors={"A": 3}), "is missing or is not a number"),
        (figures(access_s="soon"), "is missing or is not a number"),
        (figures(access_s=0.5), "access = 0.5: must be a number from 0.0 to 0.1 s"),
        (figures(arm="geared"), "was measured on the arm geared, not on planar"),
        (motor_with(kind="huge"), "huge"),
        (motor_with(emf_volts_s_per_rad=5.0), "emf_constant = 10.5"),
        (motor_with(emf_volts_s_per_rad=float("nan")), "emf_constant = nan"),
        (motor_with(volts=99.0), "voltage = 99.0: must be a number from 4.5 to 10.0 V"),
        (motor_with(friction_volts=-1.0), "rotor_friction"),
        (motor_with(backlash_deg=45), "backlash = 45.0"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(read, content, message):
    with pytest.raises(BadPlant) as refusal:
        read(content)
    text = str(refusal.value)
    assert message in text
    assert "brick.json" in text
    assert "\n" not in text


def test_a_file_that_is_not_there_is_refused():
    with pytest.raises(measured_brick.BadConstants, match=r"cannot read /nowhere: No such"):
        measured_brick.read_constants("/nowhere", read_arm(find_arm("planar")))
