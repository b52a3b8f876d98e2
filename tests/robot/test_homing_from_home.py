"""Homing from where somebody has put the arm: its zero is right, and no joint goes far for it."""

import io
import math
import re

import pytest
from one_run import one_run
from places import ROBOT
from refusals import in_one_line
from rig import REPORT_LINES, Shell, degrees, from_line, zero_of

from laptop.emulator.brick_home import read_start
from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.sensor_orders import read_sensors
from laptop.emulator.faults import read_fault
from laptop.emulator.rig import Plugs
from shared.arm_description import SEEK_BEYOND, find_arm, read_arm

DRIVER = str(ROBOT / "driver.py")
MOST = math.degrees(SEEK_BEYOND)


def arm_file(folder, name="planar", **lines):
    """An arm read from a file that has these lines in the section of each joint, or of one."""
    with open(find_arm(name)) as file:
        sections = file.read().split("\n[")
    for k, section in enumerate(sections):
        if not section.startswith(("shoulder", "elbow", "base")):
            continue
        for key, value in lines.items():
            head = [line for line in section.split("\n") if not line.startswith(key + " ")]
            sections[k] = section = "\n".join(head[:1] + [key + " = " + value] + head[1:])
    file = folder / "mine.ini"
    file.write_text("\n[".join(sections))
    return read_arm(str(file))


def changed(arm, k, **fields):
    """The arm with other fields at joint `k`."""
    joints = list(arm.joints)
    joints[k] = joints[k]._replace(**fields)
    return arm._replace(joints=tuple(joints))


@pytest.fixture
def homed(tmp_path, monkeypatch, capsys):
    """Run `driver.py home` where somebody confirms; its Shell, and what was shown."""

    def go(wanted, built=None, put=None, args=("home",), plant="", typed="\n\n"):
        put = put or [math.degrees(joint.home) for joint in wanted.joints]
        sh = Shell(
            tmp_path, monkeypatch, capsys, arm=wanted, built=built, start=degrees(*put),
            homed=False, plant=plant,
        )  # fmt: skip
        monkeypatch.setattr("sys.stdin", io.StringIO(typed))
        return sh, sh.run(*args)

    return go


def beyond(arm, record, truly=False):
    """How far beyond its limits a joint went, deg, counted from where it was put as home."""
    first = [joint.home for joint in arm.joints] if truly else record[0].q
    return math.degrees(
        max(
            max(joint.lower - at, at - joint.upper)
            for sample in record
            for joint, q, q0 in zip(arm.joints, sample.q, first)
            for at in [q - q0 + joint.home]
        )
    )


def off(sh, put):
    """How far the zeros on file are from the true ones, deg at the joint."""
    true, found = zero_of(sh.built, degrees(*put)), sh.on_file()["zero"]
    return max(abs(found[j.port] - true[j.port]) / j.gear for j in sh.built.joints)


@pytest.mark.short("planar-both-put1", "planar-lower-put4", "spatial-seek-put6")
@pytest.mark.parametrize(
    ("name", "method", "put"),
    [
        ("planar", "both", (0, 0)),
        ("planar", "both", (14, -14)),
        ("planar", "both", (-14, 14)),
        ("geared", "both", (-10, 10)),
        ("planar", "lower", (-9, -9)),
        ("planar", "upper", (9, 9)),
        ("spatial", "seek", (0, 45, -60)),
    ],
)
def test_stops_that_are_there_are_found_from_about_home(tmp_path, homed, name, method, put):
    lines = {} if method == "seek" else {"find_home": method}
    arm = arm_file(tmp_path, name, **lines)
    if method == "seek":
        arm = read_arm(find_arm(name))
        with open(arm.file) as file:
            text = file.read().replace("find_home = here\nseek", "find_home")
        (tmp_path / "mine.ini").write_text(text)
        arm = read_arm(str(tmp_path / "mine.ini"))
    sh, shown = homed(arm, put=put)
    assert (shown.status, shown.err) == (0, "")
    assert off(sh, put) < 1.3
    assert beyond(arm, sh.brick.record) < MOST + (0 if put == (0, 0) else 14)
    assert max(abs(q - joint.home) for q, joint in zip(sh.q, arm.joints)) < math.radians(3)


@pytest.mark.short("seek")
@pytest.mark.parametrize("method", ["seek", "both"])
def test_an_arm_at_an_unknown_pose_draws_once_its_stops_are_found(tmp_path, homed, method):
    """Sought from anywhere, or, as the arm's file says, from where somebody has put it."""
    arm = arm_file(tmp_path, find_home="both" if method == "both" else "here")
    lost = [math.degrees(angle) for angle in read_start("lost", arm)[0]]
    assert max(map(abs, lost)) > 30
    put = lost if method == "seek" else (13, -12)
    sh, shown = homed(arm, put=put, args=("home", "--seek") if method == "seek" else ("home",))
    assert (shown.status, shown.err) == (0, "")
    shown = sh.run()
    assert (shown.status, shown.err) == (0, "")
    assert "homing" not in shown.out
    inks = sh.ink()
    assert len(inks) == 3
    for ink, line in zip(inks, REPORT_LINES):
        assert max(from_line((sample.x, sample.y), line) for sample in ink) < 0.8
        for sample, end in ((ink[0], line[0]), (ink[-1], line[1])):
            assert math.hypot(sample.x - end[0], sample.y - end[1]) < 0.8


@pytest.mark.short("both-planar")
@pytest.mark.parametrize("name", ["planar", "geared"])
@pytest.mark.parametrize("method", ["both", "lower", "upper"])
def test_without_stops_no_joint_goes_far(tmp_path, homed, name, method):
    arm = arm_file(tmp_path, name, find_home=method)
    sh, shown = homed(arm, changed(arm, 1, stop_lower=None, stop_upper=None))
    assert shown.status == 1
    assert in_one_line(
        shown.err,
        "the elbow met no",
        "up to 15 deg beyond its limit",
        "find_home = here",
        "in [elbow] of ",
    )
    assert 5 < beyond(arm, sh.brick.record) < MOST
    assert not sh.brick.driven()


@pytest.mark.short("put0-shoulder reversed", "put1-swapped")
@pytest.mark.parametrize(
    ("build", "says"),
    [
        (lambda arm: changed(arm, 0, direction=-1),
         ["the shoulder", "as if it turned the other way round", "direction = -1 in [shoulder]"]),
        (lambda arm: changed(changed(arm, 0, port="B"), 1, port="A"),
         ["the elbow", "they are those of the shoulder", "cables of ports B and A are swapped"]),
        (lambda arm: changed(changed(arm, 0, port="B"), 1, port="A", direction=-1),
         ["the elbow", "cables of ports B and A are swapped"]),
    ],
    ids=["shoulder reversed", "swapped", "swapped and reversed"],
)  # fmt: skip
@pytest.mark.parametrize("put", [(0, 0), (8, -8)])
def test_stops_tell_what_is_mounted_otherwise(tmp_path, homed, build, says, put):
    """Though somebody has said in `check` that all is well."""
    arm = arm_file(tmp_path, find_home="both")
    sh, shown = homed(arm, build(arm), put)
    assert shown.status == 1
    assert in_one_line(shown.err, *says + ["mine.ini"])
    assert beyond(arm, sh.brick.record, truly=True) < MOST


def test_more_play_than_described_is_told(tmp_path, homed):
    arm = arm_file(tmp_path)
    _, shown = homed(arm, plant="backlash=12", args=("home", "--seek"))
    assert in_one_line(shown.err, "its play, which by that is 1", "backlash in [elbow]", "mine.ini")


def test_an_arm_that_is_put_elsewhere_is_to_be_put_nearer(tmp_path, homed):
    arm = arm_file(tmp_path, find_home="both")
    _, shown = homed(arm, put=(0, 40))
    assert in_one_line(shown.err, "the elbow", "put it nearer to home")


# Touch sensors


def with_sensors(folder, name="planar"):
    arm_file(folder, name, stop_lower="none")
    text = (folder / "mine.ini").read_text()
    for joint, port, at in (("shoulder", "in1", "-97"), ("elbow", "in2", "157")):
        head, body = text.split("[" + joint + "]")
        lines = f"find_home = touch {port}\ntouch_at = {at}"
        body = re.sub("find_home.*", lines, body, count=1)
        text = head + "[" + joint + "]" + body
    (folder / "mine.ini").write_text(text)
    return read_arm(str(folder / "mine.ini"))


@pytest.mark.short(every=2)
@pytest.mark.parametrize("name", ["planar", "geared"])
def test_touch_sensors_tell_the_zero(tmp_path, name, monkeypatch):
    arm = with_sensors(tmp_path, name=name)
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    out = one_run(arm, DRIVER, ["home"], start="4,-5")
    assert out.outcome.status == 0
    assert beyond(arm, out.record) < MOST
    assert max(abs(angle) for angle in out.record[-1].q) < math.radians(2.5)


@pytest.mark.parametrize(
    ("sensor", "says"),
    [
        (
            {"touch_at": None, "touch_port": None},
            "went 15 deg beyond its limit",
        ),
        ({"touch_port": "in3"}, "did not meet its touch sensor"),
        ({"touch_at": math.radians(-1), "upper": math.radians(-1)}, "is pressed though"),
    ],
    ids=["never closes", "other port", "closed"],
)
def test_a_sensor_that_is_not_as_described(tmp_path, monkeypatch, capsys, sensor, says):
    arm = with_sensors(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    built = changed(arm, 1, stop_upper=None, **sensor)
    out = one_run(arm, DRIVER, ["home"], built=built, start="0,0")
    assert out.outcome.status == 1
    assert in_one_line(capsys.readouterr().err, "in2", says)
    assert beyond(arm, out.record) < MOST


@pytest.mark.parametrize(
    "gone", [{"sensors": ["in2=none"]}, {"sensors": ["in2=gyro"]}, {"faults": ["unplug:in2@1.5"]}]
)
def test_a_sensor_that_is_not_there_or_no_more_is_told_in_one_line(
    tmp_path, monkeypatch, capsys, gone
):
    monkeypatch.setattr("sys.stdin", io.StringIO("\n"))
    out = one_run(
        with_sensors(tmp_path),
        DRIVER,
        ["home"],
        start="0,0",
        plugs=Plugs(sensors=read_sensors(gone.get("sensors", ()))),
        faults=[read_fault(text) for text in gone.get("faults", ())],
    )
    assert out.outcome.status == 1
    assert in_one_line(capsys.readouterr().err, "no touch sensor at in2 for the elbow", "cable")
    assert not any(motor["driven"] for motor in out.motors.values())


# Who puts the arm there


def test_where_to_put_the_arm_is_said_and_waited_for(tmp_path, homed):
    arm = arm_file(tmp_path)
    sh, shown = homed(arm, put=(5, -6))
    assert (shown.status, shown.err) == (0, "")
    assert (
        "to 15 degrees: shoulder 0, elbow 0 deg (stretched straight ahead), the tip at 20.8,0.0 cm."
        in shown.out
    )
    assert sh.motion(0) < 0.5
    assert off(sh, (0, 0)) < 8


@pytest.mark.parametrize("args", [("home",), ()])
def test_where_nobody_confirms_nothing_is_believed(tmp_path, homed, args):
    sh, shown = homed(arm_file(tmp_path), args=args, typed="")
    assert shown.status == 1
    assert in_one_line(shown.err, "nobody answers", "home --here")
    assert not sh.brick.driven()
    assert sh.run("where").status == 1


def test_an_arm_in_space_is_let_go_only_once_somebody_holds_it(tmp_path, homed):
    arm = read_arm(find_arm("spatial"))
    sh, shown = homed(arm, typed="")
    assert in_one_line(shown.err, "nobody answers")
    assert "Take the arm in your hand" in shown.out
    assert sh.motion(0) < 2.5  # the play
    sh, shown = homed(arm)
    assert (shown.status, shown.err) == (0, "")
    assert "shoulder 45, elbow -60 deg, the tip at 17.2,0.0,17.5 cm" in shown.out
    assert {sh.brick.motors[port].mode for port in "ABC"} == {"hold"}


def test_from_the_bricks_menu_a_button_confirms_it(tmp_path, homed, monkeypatch):
    sh, shown = homed(arm_file(tmp_path), typed="")
    shown = sh.run(presses=[read_press("enter@3")], kill_at=8.0)
    assert "Then press CENTRE." in shown.out
    assert sh.busy
    assert min(t for t, _, _, text in sh.writes if text == "run-timed") > 3.0


def test_here_and_seek_exclude_each_other(tmp_path, homed):
    _, shown = homed(arm_file(tmp_path), args=("home", "--here", "--seek"))
    assert shown.status == 2
    assert in_one_line(shown.err, "--here means that nothing is sought")
