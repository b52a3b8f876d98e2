"""`driver.py touch` as typed: a hand leads the emulated arm, a press takes its points."""

import json
import math

import pytest
from rig import Shell, degrees

from laptop.emulator.device.buttons import read_press
from laptop.emulator.device.hand_guiding import read_hand
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

PLACES = [(10.0, 5.0), (12.0, 0.0), (12.0, 8.0)]
HAND = "10,5@3 12,0@6 12,8@9"


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    def make(hand="", **others):
        sh = Shell(tmp_path, monkeypatch, capsys, **others)
        if hand:
            sh.brick.guide(read_hand(hand))
        return sh

    return make


def pressed(*texts):
    return [read_press(text) for text in texts]


def modes(sh):
    return [sh.brick.motors[joint.port].mode for joint in sh.arm.joints]


def test_points_their_distance_angle_and_midpoint_are_told(shell):
    sh = shell(HAND)
    presses = pressed("touch:in2@4", "enter@7", "touch:in1@10")
    shown = sh.run("touch", "--points", "3", presses=presses)
    assert (shown.status, shown.err) == (0, "")
    lines = shown.out.splitlines()
    taken = [line for line in lines if line.startswith("point ")]
    assert len(taken) == 3
    for line, place in zip(taken, PLACES):
        message = tuple(float(x) for x in line.split()[2].split(","))
        assert kinematics.distance(message, place) < 0.45, "to what its play leaves open"
    distance = float(lines[-3].split()[1])
    angle = float(lines[-2].split()[1])
    assert distance == pytest.approx(8, abs=0.6)
    assert angle == pytest.approx(math.degrees(math.atan2(2, 5)), abs=4)
    assert modes(sh) == ["hold", "hold"]
    assert sh.on_file()["parked"], "its place is on record for the next program"
    assert sh.tip == pytest.approx(PLACES[-1], abs=0.05)


def test_without_play_they_are_true_to_a_count(shell):
    sh = shell(HAND, arm="geared", plant="backlash=0")
    shown = sh.run(
        "--arm", "geared", "touch", "--json", "--points", "3",
        presses=pressed("touch@4", "touch@7", "touch@10"),
    )  # fmt: skip
    assert shown.status == 0, shown.err
    points = [json.loads(line) for line in shown.out.splitlines()]
    assert [point["p"] for point in points] == [pytest.approx(p, abs=0.05) for p in PLACES]
    ahead = points[0]["t"] - 4  # of the brick's clock
    for point, t in zip(points, (4, 7, 10)):
        assert point["t"] - ahead == pytest.approx(t, abs=0.1)
        q = point["q"]
        x = sum(joint.link * math.cos(sum(q[: k + 1])) for k, joint in enumerate(sh.arm.joints))
        assert x == pytest.approx(point["p"][0], abs=1e-3)
    assert "lead the arm by hand" in shown.err.lower()


def test_an_arm_that_moves_gives_no_point_and_says_so(shell):
    sh = shell("10,5@3 12,0@6")
    shown = sh.run("touch", "--points", "1", presses=pressed("touch@5.6", "touch@8"))
    assert "the arm moves, no point taken:" in shown.out
    assert shown.out.count("point 1:") == 1
    assert (
        "point 1: 11.8" in shown.out or "point 1: 11.9" in shown.out or "point 1: 12" in shown.out
    )


def test_a_button_ends_it(shell):
    sh = shell()
    shown = sh.run("touch", presses=pressed("enter@3", "down@5"))
    assert shown.status == 0
    assert shown.out.count("point") == 2, "the hint, and one point"
    assert modes(sh) == ["hold", "hold"]


@pytest.mark.parametrize(("go", "place"), [("point", (12, 0)), ("midpoint", (11, 2.5))])
def test_then_it_goes_there_after_one_more_press(shell, go, place):
    sh = shell("10,5@3 12,0@6 9,9@9")
    shown = sh.run(
        "touch", "--points", "2", "--go", go, presses=pressed("touch@4", "touch@7", "touch@11")
    )
    assert shown.status == 0, shown.err
    at_press = next(sample for sample in sh.brick.record if sample.t >= 10.9)
    assert kinematics.distance((at_press.x, at_press.y), (12, 0)) < 0.1, "held before the press"
    assert kinematics.distance(sh.tip, place) < 0.6
    assert "take your hands off" in shown.out


def test_the_end_key_leaves_the_going_out(shell):
    sh = shell("10,5@3")
    shown = sh.run("touch", "--points", "1", "--go", "point", presses=pressed("touch@4", "down@6"))
    assert shown.status == 0
    assert "stays here" in shown.out
    assert kinematics.distance(sh.tip, (10, 5)) < 0.1


def test_the_midpoint_of_one_point_is_refused(shell):
    presses = pressed("touch@3", "down@5")
    shown = shell().run("touch", "--go", "midpoint", presses=presses)
    assert shown.status == 1
    assert shown.err == (
        "driver.py: --go midpoint needs 2 points, and there is 1: nothing has moved\n"
    )


def test_the_pen_is_lowered_before_and_lifted_after(shell):
    sh = shell("10,5@4")
    shown = sh.run("touch", "--pen", "down", "--points", "1", presses=pressed("touch@6"))
    assert shown.status == 0, shown.err
    assert any(sample.pen for sample in sh.brick.record if sample.t < 3)
    assert not sh.brick.record[-1].pen


def test_a_signal_stops_it_and_holds_the_arm(shell):
    sh = shell("10,5@3")
    shown = sh.run("touch", signals=[(5.0, 15)])
    assert (shown.status, shown.err) == (143, "driver.py: stopped by SIGTERM\n")
    assert modes(sh) == ["hold", "hold"]
    assert sh.on_file()["parked"]


def test_an_arm_in_space_is_never_let_go(shell):
    sh = shell(arm="spatial")
    shown = sh.run("touch")
    assert shown.status == 1
    assert shown.err.startswith("driver.py: spatial is an arm in space: its motors hold it up")
    assert shown.err.count("\n") == 1
    assert not [text for _, _, name, text in sh.writes if name == "stop_action"]


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--points", "0"), "'0' must be a whole number from 1 to 10000"),
        (("--points", "x"), "'x' must be a whole number"),
        (("--go", "there"), "invalid choice: 'there'"),
        (("--pen", "sideways"), "invalid choice: 'sideways'"),
    ],
)
def test_what_makes_no_sense_is_refused(shell, args, message):
    shown = shell().run("touch", *args)
    assert shown.status == 2
    assert message in shown.err
    assert shown.err.count("\n") == 1


def test_an_arm_whose_zero_is_unknown_is_refused(shell):
    shown = shell(homed=False).run("touch")
    assert shown.status == 1
    assert "has not been homed" in shown.err


def test_a_pulled_cable_is_told(shell):
    sh = shell()
    sh.world.at(4.0, lambda: sh.brick.unplug("B"))
    shown = sh.run("touch")
    assert shown.status == 1
    assert "the elbow motor at port B no longer answers" in shown.err


def test_what_homing_touches_takes_no_point(shell, tmp_path):
    with open(find_arm("planar")) as file:
        text = file.read()
    text = text.replace("find_home = here\n\n#", "find_home = touch in2\ntouch_at = 155\n\n#")
    assert "touch in2" in text
    (tmp_path / "own.ini").write_text(text)
    sh = shell(arm=read_arm(str(tmp_path / "own.ini")), start=degrees(0, 0))
    shown = sh.run("touch", presses=pressed("touch:in2@3", "down@5"))
    assert "in1, in3, in4" in shown.out
    assert "point 1" not in shown.out
