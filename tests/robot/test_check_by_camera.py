"""`driver.py check --camera`: what a camera sees corrects the arm's file, and nobody is asked.

The arm is built otherwise than its file; the camera sees where its tip truly is. Nobody is at the
keyboard, unless a test says so.
"""

import contextlib
import io
import math
import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT
from refusals import in_one_line
from rig import DRIVER, degrees
from servo_rig import Camera, SpaceCamera, Watched

from laptop.emulator.onlooker import Onlooker
from laptop.emulator.virtual_tracker import HOST
from shared.arm_description import find_arm, read_arm
from shared.messages import Stop

MOST = 10.0
"""Angle that nothing may turn, deg."""

LEFT_OF_AXLE = 0.0, 8.0


class FromAbove:
    """A camera that looks straight down, its picture perhaps mirrored."""

    def __init__(self, mirrored=False, scale=12.0):
        self._sign, self.scale = -1 if mirrored else 1, scale

    def pixel(self, p):
        return 320 + self._sign * self.scale * (p[0] - 8), 300 - self.scale * p[1]


class Looked(Watched):
    """An arm of which nobody has looked which motor is where, under a camera."""

    def check(self, *args, **options):
        """Run `driver.py check --camera WORDS`; (status, what it wrote to stdout, to stderr)."""
        outcome, out, err = self.type(DRIVER, "check", "--camera", *args, **options)
        return outcome.status, out, err

    def at_a_jog(self, act):
        """Have `act()` done early in the first jog; `struck` says when, s."""

        def look():
            if self.brick.driven() and self.turned() > 0.3:
                self.struck = self.world.t
                act()
            else:
                self.world.at(self.world.t + 0.005, look)

        self.world.at(0.5, look)

    def turned(self):
        """Greatest true angle, deg, by which a joint ever was from where it stood."""
        first = self.brick.record[0].q
        return max(
            abs(math.degrees(a - b)) for one in self.brick.record for a, b in zip(one.q, first)
        )


@pytest.fixture
def looked(tmp_path, monkeypatch, capsys):
    """Build a Looked whose arm is `built` otherwise than the file that the program reads."""

    def build(arm="planar", ports=None, reverse=(), **options):
        reported = read_arm(find_arm(arm))
        joints = [
            joint._replace(
                port=port, direction=-joint.direction if k in reverse else joint.direction
            )
            for k, (joint, port) in enumerate(
                zip(reported.joints, ports or [j.port for j in reported.joints])
            )
        ]
        options.setdefault("goal", LEFT_OF_AXLE)
        options.setdefault("homed", False)
        w = Looked(
            tmp_path / "state", monkeypatch, capsys, arm=reported,
            built=reported._replace(joints=tuple(joints)), checked=False, **options,
        )  # fmt: skip
        monkeypatch.setenv("BRICKSERVO_ARM", reported.file if os.path.sep in arm else arm)
        monkeypatch.setattr("sys.stdin", io.StringIO())
        at_the_end.callback(w.tracker.close)
        return w

    (tmp_path / "state").mkdir()
    with contextlib.ExitStack() as at_the_end:
        yield build


WRONG = [
    ("planar", None, (), []),
    ("planar", None, (0,), ["the shoulder turns the other way round"]),
    ("planar", None, (1,), ["the elbow turns the other way round"]),
    ("planar", None, (0, 1), ["the shoulder turns", "the elbow turns"]),
    ("planar", "BA", (), ["shoulder and elbow are swapped"]),
    ("planar", "BA", (0, 1), ["are swapped", "the shoulder turns", "the elbow turns"]),
    ("geared", "BA", (0,), ["shoulder and elbow are swapped", "the shoulder turns the other way"]),
]


@pytest.mark.short(every=2)
@pytest.mark.parametrize(("name", "ports", "reverse", "says"), WRONG)
def test_the_camera_alone_finds_what_is_mounted_otherwise(looked, name, ports, reverse, says):
    w = looked(name, ports, reverse)
    status, out, err = w.check()
    assert (status, err) == (0, "")
    assert all(text in out for text in says)
    assert ("written to" in out) == bool(says)
    assert 3 < w.turned() < MOST
    found = read_arm(find_arm(name))
    assert [(j.port, j.direction) for j in found.joints] == [
        (j.port, j.direction) for j in w.built.joints
    ]
    assert not w.brick.driven()


def test_a_file_of_ones_own_keeps_its_comments(looked, tmp_path):
    mine = tmp_path / "mine.ini"
    text = Path(find_arm("planar")).read_text()
    mine.write_text(text)
    assert looked(str(mine), "BA", (1,)).check()[0] == 0
    before, after = text.split("\n"), mine.read_text().split("\n")
    assert [(a, b) for a, b in zip(before, after, strict=True) if a != b] == [
        ("port = A            ; of the brick: A, B, C or D",
         "port = B            ; of the brick: A, B, C or D"),
        ("port = B", "port = A"),
        ("direction = 1 ", "direction = -1 "),
    ]  # fmt: skip


@pytest.mark.short(every=6)
@pytest.mark.parametrize("seed", range(12))
def test_whatever_the_camera_and_the_play_nothing_wrong_is_written(looked, seed):
    """A slanting camera, a marker not quite in its place, an arm not quite straight."""
    draw = random.Random(seed)
    ports, reverse = draw.choice([None, "BA"]), [k for k in (0, 1) if draw.random() < 0.5]
    camera = Camera(math.radians(draw.uniform(0, 30)), math.radians(draw.uniform(-180, 180)))
    mirrored, pixel = draw.random() < 0.3, camera.pixel
    if mirrored:
        camera.pixel = lambda p: (640 - pixel(p)[0], pixel(p)[1])
    w = looked(
        draw.choice(["planar", "geared"]), ports, reverse, cameras={"A": camera},
        goal=(draw.uniform(-3, 2), draw.uniform(6, 10)), noise=draw.choice([0.1, 0.5, 0.7]),
        plant=f"seed={seed},backlash={draw.uniform(0.5, 3):.1f}",
        start=degrees(draw.uniform(-8, 8), draw.uniform(-8, 8)), seed=seed,
    )  # fmt: skip
    status, out, err = w.check()
    assert (status == 1) == mirrored, err
    if mirrored:
        assert in_one_line(err, "the picture is mirrored")
        assert "written" not in out
    else:
        found = read_arm(find_arm(os.path.basename(w.arm.file)))
        assert [(j.port, j.direction) for j in found.joints] == [
            (j.port, j.direction) for j in w.built.joints
        ]
    assert w.turned() < MOST


def test_pictures_of_a_while_ago_are_not_taken_for_what_a_jog_has_done(looked):
    w = looked(ports="BA", tracker={"latency": 0.8})
    status, out, err = w.check()
    assert (status, err) == (0, "")
    assert "shoulder and elbow are swapped: " in out


# What the picture does not tell


@pytest.mark.short(every=6)
@pytest.mark.parametrize(
    ("camera", "goal", "messages"),
    [
        (FromAbove(mirrored=True), LEFT_OF_AXLE, ["right of the arm", "picture is mirrored"]),
        (FromAbove(), (0.0, -8.0), ["right of the arm", "the marker lies there"]),
        (FromAbove(), (0.0, 0.5), ["in one line", "mirrored"]),
        (FromAbove(), (20.0, 15.0), ["aside of the way", "from the side"]),
        (FromAbove(), (13.0, 4.0), ["times as far", "that lies elsewhere"]),
        (FromAbove(scale=1.5), LEFT_OF_AXLE, ["33 px apart", "bring the camera nearer"]),
    ],
)
@pytest.mark.parametrize("reverse", [(), (0, 1), (1,)])
def test_a_picture_that_would_mislead_changes_nothing(looked, camera, goal, messages, reverse):
    w = looked(reverse=reverse, cameras={"A": camera}, goal=goal, noise=0.2)
    status, out, err = w.check()
    assert status == 1
    assert in_one_line(err, *messages)
    assert "written" not in out
    assert not w.brick.driven()
    assert w.turned() < MOST


def test_a_bent_arm_is_to_be_laid_straight(looked):
    status, _, err = looked(start=degrees(0, 90), cameras={"A": FromAbove()}).check()
    assert status == 1
    assert in_one_line(err, "the arm is bent", "lay the arm straight")


def test_exchanged_markers_are_told(looked):
    w = looked()
    see = w.tracker.see

    def exchanged(*when):
        seen = see(*when)
        return {"effector": seen["goal"], "goal": seen["effector"]}

    w.tracker.see = exchanged
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, "the marker effector stood", "they are exchanged")


def test_a_marker_that_is_on_nothing_that_turns_is_told(looked):
    w = looked()
    see, rng = w.tracker.see, random.Random(1)
    w.tracker.see = lambda *when: dict(
        see(*when), effector=(500 + rng.gauss(0, 0.3), 200 + rng.gauss(0, 0.3), 1.0)
    )
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, "marker effector stood", "on the tip")


def test_a_motor_that_moves_nothing_is_named(looked):
    w = looked()
    w.brick.plant.joints[1].link.half_backlash = math.radians(9)
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, "port B", "nothing moved", "backlash = 2 of [elbow]")


@pytest.mark.parametrize("fault", ["jam", "kill_encoder"])
def test_a_joint_that_does_not_turn_is_named(looked, fault):
    w = looked()
    getattr(w.brick, fault)("B")
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, "elbow (port B)", "check again")
    assert not w.brick.driven()


def test_a_picture_that_moves_at_rest_moves_nothing(looked):
    w = looked(cameras={"A": FromAbove()})

    def shake():
        (camera,) = w.cameras.values()
        w.cameras = {"A": FromAbove(scale=camera.scale + 0.05)}
        w.world.at(w.world.t + 0.2, shake)

    shake()
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, " px ", "though nothing turns")
    assert w.writes == []


def test_a_camera_that_is_touched_at_a_jog_is_told(looked):
    w = looked(cameras={"A": Camera()})

    def bump():
        w.cameras = {"A": w.cameras["A"].bumped()}

    w.at_a_jog(bump)
    status, out, err = w.check()
    assert status == 1
    assert in_one_line(err, "marker goal moved", "touched")
    assert "written" not in out


# Nothing turns unseen


@pytest.mark.parametrize("hidden", ["effector", "goal"])
def test_a_marker_that_is_not_seen_at_first_moves_nothing(looked, hidden):
    w = looked()
    w.hidden.add(hidden)
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, "marker lost (camera A ", "marker " + hidden)
    assert w.writes == []


LOST = [
    (lambda w: w.hidden.add("effector"), ["marker lost", "marker effector"]),
    (lambda w: w.tracker.silence(), ["while the motor at port", "turned: "]),
    (lambda w: w.tracker.restart(30.0), ["link lost", "127.0.0.1"]),
    (lambda w: w.tracker.pictures.freeze("A"), ["picture", "A"]),
    (lambda w: w.tracker.server.send(Stop("")), ["stopped by the laptop"]),
]


@pytest.mark.short(every=2)
@pytest.mark.parametrize(("act", "messages"), LOST)
def test_what_turns_stops_when_it_is_not_seen(looked, act, messages):
    w = looked()
    w.at_a_jog(lambda: act(w))
    status, out, err = w.check(aftermath=1.0)
    assert status == 1
    assert in_one_line(err, *messages)
    assert w.stands(w.struck + 0.7)
    assert w.turned() < 6.8  # 0.3 s at 15 deg/s, and what comes of stopping; not all of the jog
    assert "written" not in out


@pytest.mark.parametrize(
    ("tracker", "messages"),
    [
        ({"fps": 2.0}, ["camera slow", "only 2 pictures"]),
        ({"latency": 1.5}, ["camera late", "1.5 s late"]),
    ],
)
def test_a_camera_that_is_too_slow_moves_nothing(looked, tracker, messages):
    w = looked(tracker=tracker)
    status, _, err = w.check()
    assert status == 1
    assert in_one_line(err, *messages)
    assert w.writes == []


@pytest.mark.parametrize("t", [2.0, 5.0, 7.5])
def test_a_signal_stops_it(looked, t):
    w = looked()
    status, out, err = w.check(signals=[(t, signal.SIGINT)], aftermath=1.0)
    assert status == 130
    assert in_one_line(err, "stopped by SIGINT")
    assert w.stands(w.world.t - 0.9)
    assert "written" not in out


# What it has to ask


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("ports", "reverse"), [(None, ()), ("ACB", (0,)), ("BAC", (0, 2)), ("CAB", (1,))]
)
def test_of_an_arm_in_space_the_base_is_seen_and_the_rest_is_asked(
    looked, monkeypatch, ports, reverse
):
    w = looked("spatial", ports, reverse, cameras={"A": SpaceCamera(0.0)}, goal=(0.0, 8.0, 12.0))
    monkeypatch.setattr("sys.stdin", Onlooker(w.brick))
    status, out, err = w.check()
    assert (status, err) == (0, "")
    assert out.count("Which part moved?") == 2
    assert "in one upright plane" in out
    found = read_arm(find_arm("spatial"))
    assert [(j.port, j.direction) for j in found.joints] == [
        (j.port, j.direction) for j in w.built.joints
    ]


def test_where_nobody_can_answer_nothing_is_written(looked):
    status, out, err = looked(
        "spatial", reverse=(0,), cameras={"A": SpaceCamera(0.0)}, goal=(0.0, 8.0, 12.0)
    ).check()
    assert status == 1
    assert in_one_line(err, "nobody answers")
    assert "moved the base, right first" in out
    assert "written" not in out


# What is typed


def test_who_is_asked_does_not_wait_for_the_link_to_be_loaded():
    script = "import sys, robot.driver, robot.check_command as c; print(*sys.modules)"
    reported = subprocess.run([sys.executable, "-c", script], cwd=str(ROOT), stdout=subprocess.PIPE)
    loaded = reported.stdout.decode().split()
    assert "robot.motion.mounting" in loaded
    assert [n for n in loaded if "servoing" in n or "track" in n or "jog" in n or "link" in n] == []


@pytest.mark.parametrize("args", [("--code", "ABCD-EFGH-JKMN"), ("192.168.0.5",)])
def test_a_tracker_without_a_camera_is_refused(looked, args):
    w = looked()
    outcome, _, err = w.type(DRIVER, "check", *args)
    assert outcome.status == 2
    assert "add --camera" in err
    assert w.writes == []


def test_a_code_in_place_of_the_host_and_a_wrong_code_are_refused(looked):
    w = looked()
    status, _, err = w.check("ABCD-EFGH-JKMN")
    assert status == 1
    assert in_one_line(err, "reads as a pairing code; leave it out")


def test_another_code_is_refused_by_the_tracker(looked):
    w = looked()
    status, _, err = w.check(f"{HOST}:{w.tracker.port}", "--code", "2222-2222-2222")
    assert status == 1
    assert in_one_line(err, "code")
    assert w.writes == []
