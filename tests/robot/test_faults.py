"""Whatever goes wrong ends with every motor stopped, one clear line and a status that is not 0.

Each case runs driver.py as a program on the emulated brick; what stopped and what moved is read
from the emulated plant.
"""

import io
import math
import os
import signal
import sys
from collections import namedtuple

import pytest
from one_run import one_run
from refusals import in_one_line
from rig import DRIVER, Shell, from_line

from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.faults import Fault
from shared.arm_description import find_arm, read_arm

LINE = ("line", "15,0", "0,15")
HOME = ("home", "--seek")
GEARED = ("--arm", "geared")
STEPS = ("--method", "steps")


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    """Build a Shell; its arm is looked up in the words of the command line."""

    def build(args=(), **options):
        options.setdefault("arm", "geared" if "geared" in args else "planar")
        return Shell(tmp_path, monkeypatch, capsys, **options)

    return build


UNDISTURBED = {}


@pytest.fixture
def moment(tmp_path_factory, monkeypatch, capsys):
    """When (s) a run that nothing disturbs has got somewhere; see Shell.when."""

    def look_up(args, part, share=0.5):
        if args not in UNDISTURBED:
            folder = tmp_path_factory.mktemp("undisturbed")
            arm = "geared" if "geared" in args else "planar"
            with monkeypatch.context() as patch:  # the state of the test's own Shell comes back
                UNDISTURBED[args] = Shell(folder, patch, capsys, arm=arm)
                assert UNDISTURBED[args].run(*args).status == 0
        return UNDISTURBED[args].when(part, share)

    return look_up


# What goes wrong: brick -> None, to happen at a time


def unplug(port):
    return lambda brick: brick.unplug(port)


def jam(port):
    return lambda brick: brick.jam(port)


def kill_encoder(port):
    return lambda brick: brick.kill_encoder(port)


def push(port):
    return lambda brick: brick.push(port)


def slow(cost):
    return lambda brick: setattr(brick.sysfs, "access_cost", cost)


# A row: args, what happens, at what share of which part, what the line on stderr says.
Case = namedtuple("Case", "args fault part share says")


def case(name, *row):
    return pytest.param(Case(*row), id=name)


JOINTS = (("A", "the shoulder"), ("B", "the elbow"))
FAULTS = (
    ("unplugged", unplug, "{} motor at port {} no longer answers"),
    ("stalled", jam, "{} (port {})"),
    ("dead encoder", kill_encoder, "{} (port {})"),
)
PEN_PUSHED = "the pen (port C) was turned away by "
PEN_GONE = "the pen motor at port C no longer answers"

WHILE_IT_RUNS = [
    case(
        f"{what} {port}, {how}",
        LINE + more,
        fault(port),
        "ink",
        share,
        says.format(name, port),
    )
    for how, more, share in (
        ("smooth", (), 0.4),
        ("steps", STEPS, 0.25),
        ("geared", GEARED, 0.3),
    )
    for port, name in JOINTS
    for what, fault, says in FAULTS
] + [
    case(
        "unplugged A on the way",
        LINE,
        unplug("A"),
        "way",
        0.3,
        FAULTS[0][2].format(*JOINTS[0][::-1]),
    ),
    case(
        "unplugged B on the way",
        LINE,
        unplug("B"),
        "way",
        0.3,
        FAULTS[0][2].format(*JOINTS[1][::-1]),
    ),
    case("unplugged pen on the way", LINE, unplug("C"), "way", 0.3, PEN_GONE),
    case("unplugged pen in mid-line", LINE, unplug("C"), "ink", 0.4, PEN_GONE),
    case("unplugged pen, steps", LINE + STEPS, unplug("C"), "ink", 0.4, PEN_GONE),
    case("unplugged pen as it drops", LINE, unplug("C"), "drop", 0.3, PEN_GONE),
    case("jammed pen", LINE, jam("C"), "drop", 0.0, "the pen (port C)"),
    case("dead encoder of the pen", LINE, kill_encoder("C"), "drop", 0.0, "the pen (port C)"),
    case("pushed pen on the way", LINE, push("C"), "way", 0.3, PEN_PUSHED),
    case("pushed pen in mid-line", LINE, push("C"), "ink", 0.4, PEN_PUSHED),
    case("pushed pen, steps", LINE + STEPS, push("C"), "ink", 0.4, PEN_PUSHED),
    case("stalled on the way", LINE, jam("B"), "way", 0.15, "the elbow (port B)"),
    case("dead encoder on the way", LINE, kill_encoder("B"), "way", 0.15, "the elbow (port B)"),
    case("unplugged in homing", HOME, unplug("B"), "run", 0.1, "the elbow motor at port B"),
    case("idle one unplugged in homing", HOME, unplug("A"), "run", 0.1, "port A"),
    case("slow brick, 25 ms", LINE, slow(0.025), "ink", 0.4, "a control tick took"),
    case("slow brick, 50 ms", LINE, slow(0.05), "ink", 0.4, "a control tick took"),
]


def stopped(brick, port):
    """Held or braked; a motor that is unplugged coasts, whatever it was."""
    return brick.motors[port].mode in (
        ("coast",) if brick.motors[port].unplugged else ("hold", "brake")
    )


@pytest.mark.short(
    "unplugged A, smooth",
    "stalled B, smooth",
    "dead encoder A, steps",
    "unplugged pen in mid-line",
    "pushed pen in mid-line",
    "jammed pen",
    "dead encoder of the pen",
    "stalled on the way",
    "unplugged in homing",
    "slow brick, 50 ms",
)
@pytest.mark.parametrize("it", WHILE_IT_RUNS)
def test_a_fault_while_it_runs(shell, moment, it):
    t = moment(it.args, it.part, it.share)
    sh = shell(it.args)
    sh.world.at(t, lambda: it.fault(sh.brick))
    shown = sh.run(*it.args)
    assert (shown.status, shown.reason) == (1, "ended")
    assert in_one_line(shown.err, it.says)
    assert max(sh.busy.values()) <= t + 1.0, "still driven"
    assert shown.t <= t + 1.6, "the motors stood, but the program went on"
    assert all(stopped(sh.brick, joint.port) for joint in sh.arm.joints if joint.port in sh.busy)
    assert sh.motion(t + 1.0) < 1.0


@pytest.mark.parametrize(
    ("port", "t", "args", "least", "most"),
    [
        # The shoulder turned to -98 and the elbow by 164 deg when only the gap to the plan told.
        ("A", 3.208, ("polyline", "8,4", "12,4", "12,8"), -55, 40),
        ("B", 2.081, ("rectangle", "8,4", "12,8"), -20, 150),
    ],
)
def test_a_dead_encoder_does_not_run_away(shell, port, t, args, least, most):
    sh = shell(plant="cpu=0")
    sh.world.at(t, lambda: sh.brick.kill_encoder(port))
    shown = sh.run(*args)
    assert shown.status == 1
    assert in_one_line(shown.err, "its encoder is dead")
    turned = [math.degrees(sample.q["AB".index(port)]) for sample in sh.brick.record]
    assert least < min(turned)
    assert max(turned) < most


@pytest.mark.short("0.08")
@pytest.mark.parametrize("share", [0.05, 0.08, 0.2, 0.3])
def test_homing_takes_no_dead_encoder_for_a_stop(shell, moment, share):
    """Nothing tells them apart until the joint is to leave the stop, so that comes at once."""
    t = moment(HOME, "run", share)
    sh = shell()
    sh.world.at(t, lambda: sh.brick.kill_encoder("B"))
    shown = sh.run(*HOME)
    assert shown.status == 1
    assert in_one_line(shown.err, "the elbow (port B) does not turn", "dead")
    assert max(sh.busy.values()) <= t + 0.3, "still driven"
    assert sh.motion(t + 0.4) < 0.5


@pytest.mark.short("SIGINT", "SIGTERM", "SIGHUP", "homing")
@pytest.mark.parametrize(
    ("name", "args", "part"),
    [
        ("SIGINT", LINE, "ink"),
        ("SIGTERM", LINE, "ink"),
        ("SIGHUP", LINE, "ink"),
        ("SIGINT", LINE, "way"),
        ("SIGHUP", LINE + STEPS, "ink"),
        ("SIGTERM", LINE + GEARED, "ink"),
        ("SIGINT", HOME, "run"),
    ],
    ids=["SIGINT", "SIGTERM", "SIGHUP", "on the way", "steps", "geared", "homing"],
)
def test_a_signal_stops_at_once(shell, moment, name, args, part):
    number = getattr(signal, name)
    t = moment(args, part, 0.3)
    sh = shell(args)
    shown = sh.run(*args, signals=[(t, number)])
    assert (shown.status, shown.reason) == (128 + number, "ended")
    assert in_one_line(shown.err, "stopped by " + name)
    assert max(sh.busy.values()) <= t + 0.1
    assert all(stopped(sh.brick, port) for port in sh.busy)
    assert sh.motion(t + 0.3) < 1.0


def test_after_a_signal_the_arm_is_parked_and_the_next_program_goes_on(shell, moment):
    sh = shell()
    sh.run(*LINE, signals=[(moment(LINE, "ink"), signal.SIGTERM)])
    assert sh.on_file()["parked"] is not None
    assert sh.run("line", "10,0", "5,10").status == 0


@pytest.mark.short("stopping")
@pytest.mark.parametrize("later", [0.004, 0.05], ids=["stopping", "parking"])
def test_a_second_signal_does_not_disturb_the_stopping(shell, moment, later):
    t = moment(LINE, "ink")
    sh = shell()
    shown = sh.run(*LINE, signals=[(t, signal.SIGINT), (t + later, signal.SIGTERM)])
    assert shown.status == 130
    assert in_one_line(shown.err, "SIGINT")
    assert all(stopped(sh.brick, port) for port in "AB")
    assert sh.on_file()["parked"] is not None


@pytest.mark.short("in mid-line-freeze_at", "steps-kill_at", "homing-freeze_at")
@pytest.mark.parametrize("how", ["freeze_at", "kill_at"])
@pytest.mark.parametrize(
    ("args", "part", "share"),
    [
        (LINE, "ink", 0.4),
        (LINE, "way", 0.15),
        (LINE + GEARED, "ink", 0.4),
        (HOME, "run", 0.1),
        (LINE + STEPS, "ink", 0.4),
        (("line", "5,10", "10,0") + STEPS, "way", 0.2),
        (("line", "5,10", "10,0") + GEARED + STEPS, "way", 0.2),
    ],
    ids=[
        "in mid-line",
        "on the way",
        "geared",
        "homing",
        "steps",
        "steps, on the way",
        "geared steps, on the way",
    ],
)
def test_a_frozen_or_killed_program_leaves_no_joint_driven(shell, moment, args, part, share, how):
    t = moment(args, part, share)
    sh = shell(args)
    shown = sh.run(*args, **{how: t})
    assert (shown.status, shown.reason) == {
        "freeze_at": (124, "frozen"),
        "kill_at": (137, "killed"),
    }[how]
    assert in_one_line(shown.err, "as ordered")
    assert max(sh.busy.values()) <= t + 0.3, "still driven"
    assert sh.motion(t + 0.6) < 1.0
    assert all(stopped(sh.brick, port) for port in sh.busy)


def test_after_a_kill_the_arm_does_not_draw_until_homed(shell, moment):
    sh = shell()
    sh.run(*LINE, kill_at=moment(LINE, "ink"))
    before = len(sh.writes)
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "without parking", "home")
    assert len(sh.writes) == before


@pytest.mark.short("killed")
@pytest.mark.parametrize(
    "end",
    [
        lambda sh, t: sh.run(*HOME, signals=[(t, signal.SIGINT)]),
        lambda sh, t: sh.run(*HOME, kill_at=t),
        lambda sh, t: sh.world.at(t, lambda: sh.brick.unplug("B")) and sh.run(*HOME),
    ],
    ids=["interrupted", "killed", "unplugged"],
)
def test_after_an_unfinished_homing_no_older_zero_is_believed(shell, moment, end):
    """A motor plugged in again counts from 0, where it may just have been parked."""
    sh = shell()
    end(sh, moment(HOME, "run", 0.5))
    assert not os.path.exists(sh.state.file) or sh.on_file()["parked"] is None


# What else may be why a motor is not where it should be


WEAK = "voltage={},emf_constant=1.6"  # geared, it would have to turn faster than it then can


@pytest.mark.parametrize(
    ("plant", "fault", "says", "not_said"),
    [
        (WEAK.format(4.5), None, ["turns, but too slowly", "battery is flat, 4.5 V"], "blocked"),
        (WEAK.format(4.5), jam("B"), ["is blocked", "and the battery is flat, 4.5 V"], "slowly"),
        (WEAK.format(4.5), kill_encoder("B"), ["encoder is dead", "and the battery is"], "slowly"),
        ("", jam("B"), ["is blocked, overloaded or its encoder is dead"], "battery"),
        (WEAK.format(4.5), unplug("B"), ["no longer answers"], "battery"),
        (WEAK.format(4.5) + ",access=0.05", None, ["the brick is too slow"], "battery"),
    ],
    ids=["flat", "flat and blocked", "flat and blind", "blocked", "unplugged", "slow"],
)
def test_a_flat_battery_is_told_from_all_else(shell, plant, fault, says, not_said):
    sh = shell(GEARED, plant=plant)
    if fault:
        sh.world.at(0.9, lambda: fault(sh.brick))
    shown = sh.run("--arm", "geared", "move", "-6,9")
    assert shown.status == 1
    assert in_one_line(shown.err, *says)
    assert not_said not in shown.err
    assert not sh.brick.driven()


@pytest.mark.parametrize("args", [("home",), ("check",)])
def test_with_a_flat_battery_nothing_is_begun(shell, args, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n" * 9))
    sh = shell(plant="voltage=5.5")
    shown = sh.run(*args)
    assert shown.status == 1
    assert in_one_line(shown.err, "the battery is flat, 5.5 V; charge it, then start again")
    assert sh.busy == {}


def test_a_motor_that_another_program_left_turned_round_is_as_described_again(shell):
    """Its counts and its speeds would both have the other sign, and nothing would tell."""
    sh = shell()
    sh.brick.motors["A"].write("polarity", "inversed")
    assert sh.run("move", "12,6").status == 0
    assert math.hypot(sh.tip[0] - 12, sh.tip[1] - 6) < 0.6


# A line that went wrong is never reported as drawn


# An encoder that dies within the last counts of a line cannot be told from friction.
@pytest.mark.short("stalled-A-0.4", "dead encoder-B-0.75")
@pytest.mark.parametrize("share", [0.4, 0.6, 0.75])
@pytest.mark.parametrize("port", "AB")
@pytest.mark.parametrize("fault", [jam, kill_encoder], ids=["stalled", "dead encoder"])
def test_status_0_means_that_the_line_was_drawn(shell, moment, fault, port, share):
    """And as soon as it can be seen that something is wrong, all stops."""
    line = ((10, 0), (5, 10))
    args = ("line", "10,0", "5,10")
    t = moment(args, "ink", share)
    sh = shell()
    sh.world.at(t, lambda: fault(port)(sh.brick))
    shown = sh.run(*args)
    ink = sh.ink()[0]
    missed = math.hypot(ink[-1].x - line[1][0], ink[-1].y - line[1][1])
    off = [sample.t for sample in ink if from_line((sample.x, sample.y), line) > 0.3]
    assert shown.status == 1 or (not off and missed < 0.3)
    if off:
        assert max(sh.busy.values()) <= off[0] + 1.0


@pytest.mark.short("A-0.5", "B-0.9")
@pytest.mark.parametrize("share", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("port", "AB")
def test_a_joint_with_a_dead_encoder_does_not_run_away(shell, moment, port, share):
    """Also between two motions, where the joint is only kept in its place or turns a little."""
    args = ("line", "10,0", "5,10")
    sh = shell()
    sh.world.at(moment(args, "way", share), lambda: sh.brick.kill_encoder(port))
    shown = sh.run(*args)
    wanted = [angles["AB".index(port)] for angles in (s.q for s in UNDISTURBED[args].brick.record)]
    really = [angles["AB".index(port)] for angles in (s.q for s in sh.brick.record)]
    beyond = max(max(really) - max(wanted), min(wanted) - min(really))
    assert shown.status == 1
    assert math.degrees(beyond) < 90


# Refused before anything moves


def _edited(old, new):
    return lambda text: text.replace(old, new, 1)


REFUSED = [
    ("out of reach", ("line", "10,0", "30,0"), "out of reach"),
    ("through the hole", ("line", "5,10", "-5,-9"), "limit"),  # the elbow's limits are met first
    ("out of the hole", ("line", "1,0", "5,10"), "in the hole in the middle"),
    ("past a limit", ("line", "0,-15", "-10,-15"), "limit"),
    ("past a limit, one elbow", ("line", "5,-15", "12,-14", "--elbow", "up"), "shoulder"),
    ("a leap", ("line", "-10,12", "-15,5", "--elbow", "down"), "swing"),
    ("NaN", ("line", "nan,0", "5,10"), "finite"),
    ("infinite", ("line", "10,0", "inf,1"), "finite"),
    ("a move out of reach", ("move", "0,30"), "out of reach"),
    ("a circle out of reach", ("circle", "15,0", "--radius", "8"), "out of reach"),
    ("an arc out of reach", ("arc", "10,0", "15,10", "25,0"), "out of reach"),
    ("a polyline's last corner", ("polyline", "10,0", "12,4", "2,2", "0,1"), "limit"),
    ("steps out of reach", ("line", "10,0", "30,0", "--method", "steps"), "out of reach"),
]


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("args", "says"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED]
)
def test_what_cannot_be_drawn_is_refused_before_anything_moves(shell, args, says):
    sh = shell()
    shown = sh.run(*args)
    assert shown.status in (1, 2)
    assert in_one_line(shown.err, says)
    assert sh.writes == []
    assert sh.brick.driven() == []


ARM_FILES = [
    ("no number", _edited("link = 11.3", "link = eleven"), ("[shoulder]", "link")),
    ("NaN", _edited("link = 11.3", "link = nan"), ("[shoulder]", "link")),
    ("negative gear", _edited("gear = 1", "gear = -1"), ("[shoulder]", "gear")),
    ("limits exchanged", _edited("lower = -90", "lower = 175"), ("[shoulder]", "lower")),
    ("no section", _edited("[elbow]", "[ellbow]"), ("[ellbow]",)),
    ("not an INI file", lambda text: "this is a poem\n", ("line 1",)),
    ("empty", lambda text: "", ("[arm]",)),
]


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("edit", "says"), [row[1:] for row in ARM_FILES], ids=[row[0] for row in ARM_FILES]
)
def test_a_malformed_arm_file_is_refused(shell, tmp_path, edit, says):
    with open(find_arm("planar")) as file:
        text = file.read()
    path = str(tmp_path / "mine.ini")
    with open(path, "w") as file:
        file.write(edit(text))
    sh = shell()
    shown = sh.run(*LINE + ("--arm", path))
    assert shown.status == 1
    assert in_one_line(shown.err, "mine.ini", *says)
    assert sh.writes == []


def test_an_arm_file_that_is_not_there_is_refused(shell):
    sh = shell()
    shown = sh.run(*LINE + ("--arm", "triangular"))
    assert shown.status == 1
    assert in_one_line(shown.err, "triangular", "planar", "geared")


@pytest.mark.parametrize("port", "ABC")
def test_a_missing_motor_is_named_with_what_there_is(shell, port):
    sh = shell()
    sh.brick.unplug(port)
    shown = sh.run(*LINE)
    assert shown.status == 1
    others = ["out" + other for other in "ABC" if other != port]
    assert in_one_line(shown.err, "port " + port, *others)
    assert sh.writes == []


def test_a_brick_without_motors(shell):
    sh = shell()
    for port in "ABC":
        sh.brick.unplug(port)
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "no motor found", "brick")


def test_a_motor_of_the_wrong_kind(shell):
    arm = read_arm(find_arm("planar"))
    swapped = arm._replace(
        pen=arm.pen._replace(port="A"), joints=(arm.joints[0]._replace(port="C"), arm.joints[1])
    )
    sh = shell(arm=swapped)
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "no large motor at port A", "outA (lego-ev3-m-motor)")


@pytest.mark.parametrize(
    "args", [LINE, ("where",), ("move", "10,5"), ("circle", "12,0", "--radius", "2")]
)
def test_an_unhomed_arm_does_not_move(shell, args):
    sh = shell(homed=False)
    shown = sh.run(*args)
    assert shown.status == 1
    assert in_one_line(shown.err, "home")
    assert sh.writes == []


def test_an_arm_turned_by_hand_does_not_draw(shell):
    sh = shell()
    drive = sh.brick.plant.drives["B"]
    drive.angle = drive.link.angle = math.radians(20)
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "motor B", "home")
    assert sh.writes == []


# The disk


def test_a_full_disk_before_the_start_moves_nothing(shell, tmp_path):
    sh = shell()
    os.symlink("/dev/full", str(tmp_path / "planar.json.new"))
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "planar.json", "No space left", "BRICKSERVO_STATE")
    assert sh.brick.driven() == []
    assert sh.busy == {} or set(sh.busy) == {"C"}
    assert sh.motion(0.0) < 0.5
    assert sh.on_file()["parked"] is not None, "the old file is not the worse for it"


def test_a_disk_that_fills_up_in_mid_line(shell, moment, tmp_path):
    sh = shell()
    sh.world.at(
        moment(LINE, "ink"), lambda: os.symlink("/dev/full", str(tmp_path / "planar.json.new"))
    )
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert in_one_line(shown.err, "planar.json", "No space left")
    assert all(stopped(sh.brick, port) for port in "AB")
    assert sh.on_file()["parked"] is None
    assert sh.run(*LINE).status == 1, "where it stands is not on record"


def test_a_full_disk_for_the_announcement_of_the_path(shell, monkeypatch):
    sh = shell()
    monkeypatch.setenv("BRICKSERVO_PLAN", "/dev/full")
    shown = sh.run(*LINE)
    assert shown.status != 0
    assert in_one_line(shown.err, "/dev/full")
    assert all(not motor.driven for motor in sh.brick.motors.values())


def test_a_pipe_for_the_announcement_of_the_path_is_not_waited_for(shell, monkeypatch, tmp_path):
    os.mkfifo(str(tmp_path / "nobody-reads"))
    sh = shell()
    monkeypatch.setenv("BRICKSERVO_PLAN", str(tmp_path / "nobody-reads"))
    shown = sh.run(*LINE)
    assert shown.status != 0
    assert in_one_line(shown.err, "nobody-reads", "BRICKSERVO_PLAN")
    assert all(not motor.driven for motor in sh.brick.motors.values())


# The same faults as people order them


@pytest.mark.short("unplug-", "freeze-")
@pytest.mark.parametrize(
    ("fault", "status"),
    [
        (("unplug", "B"), 1),
        (("stall", "A"), 1),
        (("dead-encoder", "B"), 1),
        (("slow-sysfs", 0.05), 1),
        (("freeze", None), 124),
        (("kill", None), 137),
        (("int", None), 130),
        (("term", None), 143),
        (("hup", None), 129),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_ordered_with_a_session(moment, fault, status, capsys):
    t = moment(LINE, "ink", 0.4)
    out = one_run(read_arm(find_arm("planar")), DRIVER, LINE, faults=[Fault(fault[0], fault[1], t)])
    assert out.outcome.status == status
    assert out.outcome.t <= t + 1.6
    assert in_one_line(capsys.readouterr().err)
    assert not any(motor["driven"] for motor in out.motors.values())


@pytest.mark.short("planar-0.009-0", "planar-0.03-1")
@pytest.mark.parametrize(
    ("name", "cost", "status"),
    [("planar", 0.009, 0), ("planar", 0.03, 1), ("geared", 0.016, 1), ("spatial", 0.016, 1)],
)
def test_a_brick_that_is_slow_to_push_is_not_taken_for_a_blocked_joint(name, cost, status, capsys):
    arm = read_arm(find_arm(name))
    fault = Fault("slow-sysfs", cost, 7.0)
    plant = read_plant("cpu=1,seed=1")
    out = one_run(arm, DRIVER, ["home", "--seek"], plant=plant, start="lost", faults=[fault])
    lines = capsys.readouterr().err
    assert out.outcome.status == status, lines
    assert ("the brick is too slow" in lines) == (status == 1)


@pytest.mark.short("dead encoder")
@pytest.mark.parametrize("fault", [jam, kill_encoder], ids=["stalled", "dead encoder"])
def test_after_a_blind_or_blocked_joint_the_zero_is_in_doubt(shell, moment, fault):
    """Its counts may be worth nothing: the next program must not draw with them."""
    sh = shell()
    sh.world.at(moment(LINE, "ink", 0.4), lambda: fault("B")(sh.brick))
    assert sh.run(*LINE).status == 1
    assert sh.on_file()["parked"] is None


@pytest.mark.long
def test_while_it_homes_and_draws_the_arm_is_not_on_record_as_parked(shell):
    sh = shell(homed=False)
    seen = []
    sh.world.at(1.0, lambda: seen.append(os.path.exists(sh.state.file)))
    outcome = sh.run(kill_at=12.0, presses=[read_press("enter@2")])
    assert outcome.status == 137
    assert seen == [False]
    assert sh.on_file()["parked"] is None


def test_a_terminal_that_has_gone_changes_no_status(shell, moment, monkeypatch):
    """As when the connection of ssh ends: SIGHUP comes, and no last line can be written."""
    sh = shell()

    def gone(text):
        raise OSError(5, "Input/output error")

    def end():
        monkeypatch.setattr(sys.stderr, "write", gone)

    t = moment(LINE, "ink", 0.4)
    sh.world.at(t, end)
    outcome = sh.run(*LINE, signals=[(t, signal.SIGHUP)])
    monkeypatch.undo()
    assert outcome.status == 128 + signal.SIGHUP
    assert sh.brick.driven() == []


@pytest.mark.short("0.8")
@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_reader_that_went_away_ends_in_one_line(shell, moment, share, monkeypatch):
    """As `ssh` without a terminal that was closed: the next print fails."""
    sh = shell()

    def gone(text):
        raise BrokenPipeError(32, "Broken pipe")

    sh.world.at(moment(LINE, "way", share), lambda: monkeypatch.setattr(sys.stdout, "write", gone))
    shown = sh.run(*LINE)
    monkeypatch.undo()
    assert shown.status != 0
    assert "Traceback" not in shown.err
    assert sh.brick.driven() == []
