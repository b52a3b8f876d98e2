"""Two cameras before the tip of an arm in space, whose truth is known."""

import math

import numpy as np
import pytest
from arms import PLANAR, SPATIAL
from board_views import pixels, stand, view

from laptop.see.camera.frames import Frame
from laptop.see.serve.joint_track import marker_place
from laptop.see.table.camera_fit import calibrate
from laptop.see.table.two_cameras import MOVED_PLACES, TwoCameras

ABOVE, ASKEW, BESIDE = stand(62, 15, 200, 3), stand(58, 45, 80), stand(60, 80, 60)
IMAGE = np.zeros((480, 640, 3), np.uint8)
BASE = np.array([-9.0, 1.0, 0.0])
"""Where the arm stands on the board, turned as that is."""


class FakeWatch:
    """A camera's watch of the board; None: it does not see it."""

    def __init__(self, where=None):
        self.calibration = None
        if where:
            held = stand(50, 35, 20), stand(50, 35, 140)
            self.calibration = calibrate([view(one) for one in (*held, where)])
        self.version, self.why = int(where is not None), ""


class SpaceCell:
    """Two cameras, 15 pictures a second but not at once, and a brick that tells its joints."""

    def __init__(self, one, other, arm=SPATIAL, sees=(True, True), linked=True):
        self.where = {"A": one, "B": other}
        self.watches = {
            name: FakeWatch(where if seen else None)
            for (name, where), seen in zip(self.where.items(), sees, strict=True)
        }
        self.lines, self.reported, self.linked, self.arm = [], None, linked, arm
        self.cameras = TwoCameras(self.watches, arm, lambda: self.reported, self.lines.append)
        self.t, self.index, self.pairs = 10.0, {"A": 0, "B": 0}, []

    def q(self, t):
        """Slowly to and fro with all joints."""
        if self.arm is PLANAR:
            return 0.7 * math.sin(0.31 * t), 1.2 + 0.6 * math.sin(0.47 * t)
        return (
            0.7 * math.sin(0.31 * t),
            0.75 + 0.35 * math.sin(0.47 * t),
            -1.3 + 0.5 * math.sin(0.73 * t),
        )

    def point(self, t):
        """Where the marker is on the board, (3,), cm."""
        return np.array((*marker_place(self.arm, self.q(t)), 0.0)[:3]) + BASE

    def run(self, seconds, confidence=0.9):
        """Let so much time pass."""
        for _ in range(round(15 * seconds)):
            for name, late in (("A", 0.0), ("B", 0.013)):
                t = self.t + late
                ((u, v),) = pixels(self.where[name], [self.point(t)])
                frame = Frame(self.index[name], t, IMAGE)
                self.index[name] += 1
                self.pairs += self.cameras.see(name, frame, {"effector": (u, v, confidence)})
            if self.linked and self.index["A"] % 3 == 0:
                self.reported = self.t - 0.004, self.q(self.t - 0.004)
            self.t += 1 / 15

    def off(self):
        """Distances of what was told from the truth, mm."""
        return 10 * np.array([math.dist(p.place[:3], self.point(p.t)) for p in self.pairs])


def test_two_cameras_that_see_the_board_tell_where_in_space_the_tip_is():
    cell = SpaceCell(ABOVE, ASKEW, linked=False)
    cell.run(4.0)
    assert len(cell.pairs) > 55
    assert [p.frame for p in cell.pairs] == sorted({p.frame for p in cell.pairs})
    assert {p.cameras for p in cell.pairs} == {"A+B"}
    assert np.quantile(cell.off(), 0.95) < 0.5, "mm, though B's pictures are 13 ms later"
    assert max(p.gap for p in cell.pairs) < 0.05
    (line,) = cell.cameras.lines()
    x, y, z = cell.pairs[-1].place[:3]
    assert line.startswith(f"A+B: effector at {x:.2f},{y:.2f},{z:.2f} cm, the lines of sight miss")


def test_what_is_doubtful_or_seen_by_one_is_not_placed():
    cell = SpaceCell(ABOVE, ASKEW, linked=False)
    cell.run(1.0, confidence=0.3)
    assert cell.pairs == []
    assert cell.cameras.lines() == []


def test_a_camera_that_is_not_where_it_was_tells_nothing():
    cell = SpaceCell(ABOVE, ASKEW, linked=False)
    cell.run(0.5)
    cell.watches["B"].why = "camera or board has moved"
    count = len(cell.pairs)
    cell.run(0.5)
    assert len(cell.pairs) == count
    assert cell.cameras.lines() == ["no places in space: where camera B stands is not known yet"], (
        "nor is what was before shown any more"
    )
    cell.watches["B"].why = ""
    cell.run(0.5)
    assert len(cell.pairs) > count + 4


@pytest.mark.long
def test_a_camera_that_sees_no_board_is_known_by_the_tips_own_moves():
    cell = SpaceCell(ABOVE, BESIDE, sees=(True, False))
    cell.run(2.0)
    assert cell.pairs == []
    assert cell.cameras.camera("B") is None
    cell.run(40.0)
    assert cell.cameras.camera("B")
    known = [line for line in cell.lines if "by the tip's own moves it stands" in line]
    assert len(known) == 1
    assert len(cell.lines) <= 3
    assert "camera B does not see the board: by the tip's own moves it stands 1" in known[0]
    cell.pairs.clear()
    cell.run(10.0)
    assert np.median(cell.off()) < 0.5
    assert np.quantile(cell.off(), 0.95) < 1.0


@pytest.mark.long
def test_when_that_camera_is_moved_it_is_learned_anew():
    cell = SpaceCell(ABOVE, BESIDE, sees=(True, False))
    cell.run(40.0)
    assert cell.cameras.camera("B")
    cell.where["B"] = stand(60, 70, 75)
    cell.run(0.21 * MOVED_PLACES + 0.5)
    assert cell.lines[-1].startswith("camera B has moved") or "not known yet" in cell.lines[-1]
    assert any(line.startswith("camera B has moved") for line in cell.lines)
    assert cell.cameras.camera("B") is None
    cell.run(40.0)
    cell.pairs.clear()
    cell.run(5.0)
    assert np.median(cell.off()) < 0.5


@pytest.mark.long
def test_when_the_camera_over_the_board_was_moved_both_are_learned_anew():
    cell = SpaceCell(ABOVE, BESIDE, sees=(True, False))
    cell.run(40.0)
    cell.watches["A"].version = 2
    cell.run(1.0)
    assert cell.cameras.camera("B") is None


def test_moves_in_one_plane_are_refused_and_that_is_said_once():
    cell = SpaceCell(ABOVE, BESIDE, arm=PLANAR, sees=(True, False))
    cell.run(30.0)
    assert cell.cameras.camera("B") is None
    assert len(cell.lines) == 1
    assert "camera B does not see the board, and is not known yet: the places" in cell.lines[0]
    assert "one plane" in cell.lines[0]


@pytest.mark.parametrize("arm", [None, SPATIAL])
def test_without_a_brick_or_a_known_arm_nothing_is_learned(arm):
    cell = SpaceCell(ABOVE, BESIDE, sees=(True, False), linked=arm is None)
    cell.cameras._arm = arm
    cell.run(15.0)
    assert cell.cameras.camera("B") is None
    assert cell.lines == []
    (line,) = cell.cameras.lines()
    assert "where camera B stands is not known yet" in line
