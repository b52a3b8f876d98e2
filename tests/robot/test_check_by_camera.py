"""`driver.py check --camera`: what a camera sees corrects the arm's file, and nobody is asked.

The arm is built otherwise than its file; the camera sees where its tip truly is. Nobody is at the
keyboard, unless a test says so.
"""

import io
import math
import os
import signal

import pytest
from refusals import in_one_line
from rig import DRIVER, degrees
from servo_rig import Camera, SpaceCamera, Watched

from laptop.simulator.host.runner import run_script
from laptop.simulator.onlooker import Onlooker
from robot.motion.mounting import JOG
from shared.arm_description import find_arm, read_arm

MOST = 10.0
"""Angle that nothing may turn, deg."""

LEFT_OF_AXLE = 0.0, 8.0


class FromAbove:
    """A camera that looks straight down, its picture perhaps mirrored."""

    def __init__(self, mirrored=False, scale=12.0):
        self._sign, self._scale = -1 if mirrored else 1, scale

    def pixel(self, p):
        return 320 + self._sign * self._scale * (p[0] - 8), 300 - self._scale * p[1]


class Looked(Watched):
    """An arm of which nobody has looked which motor is where, under a camera.

    Attributes:
        told: the arm as its file describes it.
    """

    def check(self, *words, typed="", tracker=True, **options):
        """Run `driver.py check --camera WORDS`; (status, lines on stdout, stderr)."""
        self._capsys.readouterr()
        outcome = run_script(self.brick, DRIVER, ("check", "--camera", *words), **options)
        out, err = self._capsys.readouterr()
        return outcome.status, out, err

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
        told = read_arm(find_arm(arm))
        joints = [
            joint._replace(port=port, direction=-joint.direction if k in reverse else joint.direction)
            for k, (joint, port) in enumerate(zip(told.joints, ports or [j.port for j in told.joints]))
        ]
        options.setdefault("goal", LEFT_OF_AXLE)
        options.setdefault("homed", False)
        w = Looked(
            tmp_path / "state", monkeypatch, capsys, arm=told._replace(joints=tuple(joints)),
            checked=False, **options,
        )  # fmt: skip
        monkeypatch.setenv("BRICKSERVO_ARM", told.file if os.path.sep in arm else arm)
        monkeypatch.setattr("sys.stdin", io.StringIO())
        w.told = told
        return w

    (tmp_path / "state").mkdir()
    return build


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
    print(out, err, w.world.t)
    assert (status, err) == (0, "")
    assert all(words in out for words in says)
    assert ("written to" in out) == bool(says)
    assert 3 < w.turned() < MOST
    found = read_arm(find_arm(name))
    assert [(j.port, j.direction) for j in found.joints] == [
        (j.port, j.direction) for j in w.arm.joints
    ]
    assert not w.brick.driven()
