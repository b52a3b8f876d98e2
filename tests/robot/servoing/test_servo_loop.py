"""The loop of visual servoing between a scripted arm, scripted cameras and a servo that notes."""

import math
from types import SimpleNamespace

import pytest

from robot.servoing.decision import Decision
from robot.servoing.joint_history import JointHistory
from robot.servoing.loop import VisualServoing
from robot.servoing.measurement import Measurement
from robot.servoing.rows import Rows
from robot.servoing.run_reporter import RunReporter
from shared.messages import Observation

DEG = math.radians(1)
TICK = 0.02
FRAMES = 1 / 30
START, THERE, BOUND = (0.0, 0.0), (20 * DEG, 0.0), (-50 * DEG, 30 * DEG)


class World:
    """A clock, an arm that goes a scripted way, and cameras that see its joints as pixels.

    Args:
        way: from the time since a chase began (s) to q (rad); None: the chase is over.
        cameras: names.
    """

    def __init__(self, path, cameras="A"):
        self.t, self.path, self.cameras, self.q = 100.0, path, cameras, START
        self.description = SimpleNamespace(
            joints=[SimpleNamespace(max_speed=1.0, backlash=0.0)] * 2
        )
        self.linked, self.refused, self.late = True, False, {}
        self._sent = self.t

    def now(self):
        return self.t

    # The arm

    def angles(self):
        return self.q

    def chase(self, steer, speed, within, spare):
        began = self.t
        while self.path(self.t - began) is not None:
            self.q = self.path(self.t - began)
            steer(self.t, self.q)
            spare(self.t + TICK)
            self.t += TICK

    # The tracker

    def poll(self, timeout):
        """Each camera's frame, taken just now, if one is due; else it waits for it."""
        due = self._sent + FRAMES
        if due > self.t + timeout:
            self.t += timeout
            return {}
        self.t = self._sent = max(self.t, due)
        tip = (*(1000 * angle for angle in self.q), 1.0)
        seen = {"effector": tip, "goal": (500.0, 500.0, 1.0)}
        return {name: Observation(0, name, self.t, seen) for name in self.cameras}

    def commands(self):
        return []

    def report(self, q, **more):
        pass


class NotingServo:
    """One move, then the end; to learn from a frame takes it as long as three frames."""

    using = J = detour_pose = None

    def __init__(self, world):
        self.world, self.cameras, self.estimator = world, tuple(world.cameras), self
        self.rows, self.sigma = Rows("stereo", 2), 1.0
        self.measured, self.learned = [], []

    def suffices(self, cameras):
        return len(cameras) == len(self.cameras)

    def prepare(self, q, frames):
        return None

    def observe_in_motion(self, camera, q, s):
        pass

    def learn_shape(self, camera, q, s):
        self.learned.append(camera)
        self.world.t += 3 * FRAMES
        yield

    def measurements(self, frames):
        if min(map(len, frames.values())) < 6:
            return None
        self.measured.append(dict(frames))
        return [Measurement(c, f[-1][1], f[-1][2], 1.0, len(f)) for c, f in frames.items()]

    def decide(self, q, measurements, chase):
        if len(self.measured) > 1:
            return Decision("end", None, "converged", "")
        return Decision("move", THERE, None, "")


class NotingStream:
    """It has something to do after each frame, and aims where it went anyway."""

    def begin(self, q, detour_pose=None, explore_from=None):
        assert explore_from is None
        self.began, self.news = (q, detour_pose), False

    def see(self, frame, goal):
        self.news = True

    def reaim(self):
        if self.news:
            self.news = False
            yield

    def is_late(self, t):
        return False

    def aim(self, t, q, follow):
        return THERE


def servo(path, cameras="A", detour_pose=None):
    """(servo, stream) after a run of one chase that goes a way."""
    world, stream = World(path, cameras), NotingStream()
    noting = NotingServo(world)
    noting.detour_pose = detour_pose
    reporter = RunReporter(say=lambda line: None)
    loop = VisualServoing(world, world, world, noting, stream=stream, reporter=reporter)
    assert loop.run().word == "converged"
    return noting, stream


def swing(t):
    """There in 1 s."""
    return (min(t, 1.0) * THERE[0], 0.0) if t < 1.5 else None


@pytest.mark.parametrize("off", [0.6, -0.4])
def test_what_was_seen_before_the_last_small_move_is_not_of_the_arm_as_it_stands(off):
    """An arm that lands may stand near its end for a while, and then go the last bit."""

    def path(t):
        return swing(t) if t < 1.4 else THERE if t < 1.5 else (THERE[0] + off * DEG, 0.0)

    noting, _ = servo(lambda t: path(t) if t < 1.6 else None)
    end = 1000 * (THERE[0] + off * DEG)
    assert {round(s[0], 6) for _, s, _ in noting.measured[-1]["A"]} == {round(end, 6)}


def test_what_was_seen_since_the_arm_stands_is_not_waited_for_again():
    noting, _ = servo(swing)
    ((first, *_), *_) = noting.measured[-1]["A"]
    assert 101.0 < first < 101.5, "the arm stood from 1 s on, and the chase took 1.5"


@pytest.mark.parametrize("cameras", ["AB", "ABC"])
def test_in_a_chase_it_learns_from_each_camera_in_its_turn(cameras):
    noting, _ = servo(swing, cameras)
    times = [noting.learned.count(name) for name in cameras]
    assert max(times) - min(times) <= 1 < min(times)


@pytest.mark.parametrize("detour_pose", [None, BOUND])
def test_a_chase_for_another_posture_seeks_its_aim_there(detour_pose):
    _, stream = servo(swing, detour_pose=detour_pose)
    assert stream.began == (THERE, detour_pose)


def test_the_history_knows_since_when_joints_stand():
    history = JointHistory()
    for k, angle in enumerate((0.0, 5.0, 9.0, 9.9, 10.1, 10.0, 10.0)):
        history.add(0.1 * k, (3.0, angle))
    assert history.still_since(0.2) == pytest.approx(0.3)
    assert history.still_since(0.05) == pytest.approx(0.5)
    assert history.still_since(20.0) == 0.0
