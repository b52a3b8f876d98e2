"""Which pictures are gone by, told of joints and places alone."""

import math
from types import SimpleNamespace

import pytest

from robot.servoing.repeated_pictures import MAX_PICTURES, RepeatedPictures
from shared.messages import Observation

DEG = math.radians(1)
STILL = (0.0, 0.0)


class Camera:
    """It sees the tip where joint 1 is, 30 times a second, and what it has seen before."""

    def __init__(self, noise=0.01, name="A", pictures=None):
        joints = [SimpleNamespace(backlash=2 * DEG)] * 2
        self.pictures = pictures or RepeatedPictures(joints)
        self.noise, self.name, self.n, self.seen = noise, name, 0, []

    def show(self, markers, q):
        """Whether it is new, and whether the camera is frozen then."""
        self.n += 1
        seen = Observation(self.n, self.name, self.n / 30, markers)
        return self.pictures.is_new(seen, q), self.name in self.pictures.frozen

    def see(self, q):
        u = 300 + 500 * q[0] + self.noise * self.n
        self.seen.append({"effector": (u, 100.0, 0.9), "goal": (50.0, 60.0, 1.0)})
        return self.show(self.seen[-1], q)

    def look(self, q, pictures=6):
        return [self.see(q) for _ in range(pictures)]


GOOD, REPEATED, FROZEN = (True, False), (False, False), (False, True)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_still_scene_before_a_still_arm_is_identical_by_right(noise):
    camera = Camera(noise)
    assert set(camera.look(STILL, 300)) == {GOOD}


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_camera_whose_tip_moves_is_believed(noise):
    camera = Camera(noise)
    assert set(camera.look(STILL) + [camera.see((k * DEG, 0.0)) for k in range(60)]) == {GOOD}


def test_a_single_repeated_picture_that_was_new_long_ago_tells():
    """A busy brick looks at few of them."""
    camera = Camera()
    camera.look(STILL)
    camera.n += 3
    assert camera.show(camera.seen[-1], (0.5 * DEG, 0.0)) == FROZEN


def test_the_same_picture_of_joints_elsewhere_is_not_believed():
    camera = Camera()
    camera.look(STILL)
    shown = [camera.show(camera.seen[-1], (0.5 * k * DEG, 0.0)) for k in range(1, 6)]
    assert shown == [REPEATED, REPEATED, FROZEN, FROZEN, FROZEN]
    assert camera.pictures.turn("A") == pytest.approx(2.5 * DEG)


def test_one_that_is_far_too_old_is_enough():
    camera = Camera()
    camera.look(STILL)
    assert camera.show(camera.seen[-1], (6 * DEG, 0.0)) == FROZEN


def test_before_a_camera_without_noise_a_joint_may_cross_its_play():
    """The tip stands meanwhile, and so does the picture."""
    camera = Camera(0.0)
    camera.look(STILL)
    assert {camera.show(camera.seen[-1], (0.0, 0.1 * k * DEG)) for k in range(30)} == {GOOD}
    shown = [camera.show(camera.seen[-1], (0.0, 0.1 * k * DEG)) for k in range(31, 60)]
    assert shown[:2] == [REPEATED, REPEATED]
    assert set(shown[3:]) == {FROZEN}


def test_what_was_seen_with_the_arm_where_it_is_again_is_believed():
    camera = Camera(0.0)
    camera.look(STILL)
    camera.look((20 * DEG, 0.0))
    assert set(camera.look(STILL)) == {GOOD}


def test_a_loop_is_noticed_though_some_of_it_was_never_looked_at():
    camera = Camera()
    q = [(k * DEG, 0.0) for k in range(40)]
    for at in q[::3]:
        camera.see(at)
    loop = [{"effector": (300 + k, 100.25, 0.9), "goal": (50.0, 60.0, 1.0)} for k in range(6)]
    loop[::2] = camera.seen[-3:]
    shown = [camera.show(loop[k % 6], (60 * DEG, 0.0)) for k in range(60)]
    assert shown[0] == FROZEN
    assert set(shown[1:]) == {FROZEN}


@pytest.mark.parametrize("times", [2, 3])
def test_pictures_that_are_shown_several_times_each_are_left_out_but_the_first(times):
    camera = Camera()
    camera.look(STILL, 3)
    shown = []
    for k in range(60):  # at 60 deg/s
        if k % times == 0:
            shown.append(camera.see((2 * k * DEG, 0.0)))
        else:
            assert camera.show(camera.seen[-1], (2 * k * DEG, 0.0)) == REPEATED
    assert set(shown) == {GOOD}


def test_a_picture_that_changes_again_is_believed_after_a_while():
    camera = Camera()
    camera.look(STILL)
    assert camera.show(camera.seen[-1], (9 * DEG, 0.0)) == FROZEN
    shown = camera.look((9 * DEG, 0.0), 20)
    assert shown[:8] == [FROZEN] * 8
    assert shown[10:] == [GOOD] * 10


def test_each_camera_is_judged_by_its_own_pictures():
    camera = Camera()
    other = Camera(name="B", pictures=camera.pictures)
    camera.look(STILL)
    other.look(STILL)
    assert camera.show(camera.seen[-1], (9 * DEG, 0.0)) == FROZEN
    assert other.see((9 * DEG, 0.0)) == GOOD
    assert camera.pictures.frozen == {"A"}


def test_without_the_tip_or_the_joints_nothing_is_said():
    camera = Camera()
    camera.look(STILL)
    hidden = dict(camera.seen[-1], effector=None)
    assert [camera.show(hidden, (k * DEG, 0.0)) for k in range(60)] == [GOOD] * 60
    assert camera.show(camera.seen[-1], None) == GOOD


def test_only_so_many_pictures_are_kept():
    camera = Camera()
    for k in range(5 * MAX_PICTURES):
        camera.see((0.1 * k * DEG, 0.0))
    (kept,) = camera.pictures._cameras.values()
    assert len(kept.pictures) == MAX_PICTURES
