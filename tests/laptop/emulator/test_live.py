"""The pose of an arm in real time, written by one process and followed by another."""

import json
import math
import os
import signal
import subprocess
import sys
import time

import pytest
from odd_files import ODD
from one_run import one_run
from rig import DRIVER, Rig
from waiting import PATIENCE

from laptop.emulator.host.world import World
from laptop.emulator.live import History, PoseReader, PoseWriter, run_files
from laptop.emulator.pace import PacedClock
from laptop.system import platforms
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm
from shared.state import LIVE_FOLDER

ROOT = os.path.dirname(os.path.dirname(DRIVER))
ARM = read_arm(find_arm("planar"))


class Run:
    """An arm that draws, published; in virtual time, so that nothing here waits."""

    def __init__(self, folder, name="drawing.py", arm="planar"):
        self.folder = str(folder)
        self.followers = []
        self.rig = Rig(folder, arm)
        self.publisher = PoseWriter(self.rig.brick, name, self.folder)
        self.rig.world.bodies.append(self.publisher.advance)
        self.rig.world.sleep(0.02)

    @property
    def record(self):
        return self.rig.brick.record

    @property
    def zero(self):
        return self.rig.world.zero

    def draw(self, start, end):
        with self.rig.running():
            self.rig.driver().draw_line(start, end)

    def follower(self):
        follower = PoseReader(self.folder)
        follower.poll()
        self.followers.append(follower)
        return follower

    def close(self):
        self.publisher.close()
        for follower in self.followers:
            follower.close()


@pytest.fixture
def run(tmp_path):
    run = Run(tmp_path)
    yield run
    run.close()


def length(ink):
    return sum(math.hypot(x1 - x0, y1 - y0) for x0, y0, x1, y1 in ink)


# What a follower sees


def test_a_follower_sees_the_true_pose_at_every_time(run):
    follower = run.follower()
    run.draw((10, 0), (5, 10))
    follower.poll()
    for sample in run.record[::7]:
        pose = follower.at(run.zero + sample.t)
        assert pose.q == pytest.approx(sample.q, abs=3e-4)
        assert pose.arm == run.rig.arm


def test_between_two_poses_it_is_in_proportion_and_beyond_the_last_the_last():
    history = History(ARM)
    assert history.at(1.0) is None
    history.append(1.0, (0.0, 0.2), 0)
    history.append(1.1, (0.1, 0.4), 0)
    assert history.at(1.025).q == pytest.approx((0.025, 0.25))
    assert history.at(0.0).q == (0.0, 0.2)
    assert history.at(9.0).q == (0.1, 0.4)


def test_the_ink_is_what_the_pen_drew_and_grows_with_time(run):
    run.draw((10, 0), (5, 10))
    follower = run.follower()
    down = [(s.x, s.y) for s in run.record if s.pen]
    drawn = sum(math.hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(down, down[1:]))
    middle = next(s.t for s in run.record if s.pen) + 1.0
    end = run.record[-1].t
    inks = [length(follower.at(run.zero + t).ink) for t in (0.0, middle, end)]
    assert inks[0] == 0
    assert 1 < inks[1] < inks[2] - 1
    assert inks[2] == pytest.approx(drawn, rel=0.01)
    assert follower.at(run.zero + end).ink[0][:2] == pytest.approx(down[0], abs=0.05)


def test_who_comes_late_sees_the_same_as_who_was_there(run):
    early = run.follower()
    for k in range(3):
        run.rig.world.sleep(0.1)
        if k == 1:
            run.draw((10, 0), (5, 10))
        early.poll()
    late = run.follower()
    assert late.at(run.zero + 1e6) == early.at(run.zero + 1e6)
    assert late.newest == early.newest


def test_in_space_ink_lies_on_the_table_where_the_tip_touches_it():
    arm = read_arm(find_arm("spatial"))
    history = History(arm)
    poses = [(10.0 + 0.05 * k, 2.0, 0.0 if k < 40 else 0.2 * (k - 40)) for k in range(60)]
    for k, p in enumerate(poses):
        history.append(k, kinematics.inverse(arm, p), True)
    ink = history.at(99).ink
    assert ink[0][:2] == pytest.approx((10.0, 2.0))
    assert all(abs(y) == pytest.approx(2.0) for segment in ink for y in segment[1::2])
    assert ink[-1][2] == pytest.approx(poses[42][0], abs=0.01), "0.4 cm up, it still touches"
    assert length(ink) == pytest.approx(2.1, abs=0.01)


def test_lifting_the_pen_leaves_a_gap_in_the_ink():
    history = History(ARM)
    for k, pen in enumerate((1, 1, 0, 1, 1)):
        history.append(k, (0.1 * k, 0.5), pen)
    assert len(history.at(9).ink) == 2


def test_poses_of_long_ago_are_forgotten_but_not_the_ink():
    history = History(ARM, window=10.0)
    for k in range(1000):
        history.append(0.1 * k, (math.sin(0.1 * k), 0.5), 1)
    assert len(history._times) < 300
    assert len(history.at(99.9).ink) > 900


def test_a_resting_arm_writes_two_lines_a_second(run):
    before = os.path.getsize(run.publisher.path)
    run.rig.world.sleep(20)
    assert (os.path.getsize(run.publisher.path) - before) / 20 < 2.5 * 30
    assert run.follower().newest - run.zero > run.rig.world.now() - 0.6


def test_a_rest_is_not_smeared_into_the_motion_after_it(run):
    run.rig.world.sleep(0.35)
    run.draw((10, 0), (5, 10))
    follower = run.follower()
    for sample in run.record:
        if sample.t < 0.6:
            assert follower.at(run.zero + sample.t).q == pytest.approx(sample.q, abs=3e-4)


# Whether the run lives


def test_without_a_run_there_is_nothing_to_see(tmp_path):
    follower = PoseReader(str(tmp_path / "nowhere"))
    follower.poll()
    assert (follower.header, follower.alive, follower.newest, follower.at(0)) == (
        None,
        False,
        None,
        None,
    )


def test_the_end_of_a_run_is_seen_and_its_last_pose_stays(run):
    follower = run.follower()
    run.draw((10, 0), (5, 10))
    assert follower.alive
    run.publisher.close()
    follower.poll()
    assert not follower.alive
    assert follower.at(run.zero + 1e6).q == pytest.approx(run.rig.q, abs=1e-5)
    assert not os.path.exists(run.publisher.path)
    assert run.follower().header is None


def test_the_paper_stays_from_run_to_run_but_not_for_another_arm(run, tmp_path):
    run.draw((10, 0), (5, 10))
    follower = run.follower()
    drawn = follower.at(run.zero + 1e6).ink
    assert length(drawn) > 10
    run.publisher.close()
    for arm, paper in (("planar", drawn), ("geared", [])):
        newer = Run(tmp_path, arm + ".py", arm)
        follower.poll()
        newer.close()
        assert follower.header["script"] == arm + ".py"
        assert follower.at(newer.zero).ink == paper


def test_a_newer_run_is_followed_and_the_older_one_leaves_it_alone(run, tmp_path):
    run.draw((10, 0), (5, 10))
    follower = run.follower()
    newer = Run(tmp_path, "newer.py")
    newer.draw((10, 0), (5, 10))
    follower.poll()
    assert follower.header["script"] == "newer.py"
    run.publisher.close()
    follower.poll()
    assert follower.alive
    assert os.path.exists(newer.publisher.path)
    newer.publisher.close()


def test_a_newer_run_that_only_looks_leaves_the_older_one_in_sight(run, tmp_path):
    run.draw((10, 0), (5, 10))
    follower = run.follower()
    newer = Run(tmp_path, "looks.py")
    newer.rig.world.sleep(2.0)
    follower.poll()
    assert (follower.header["script"], follower.alive) == ("drawing.py", True)
    run.publisher.close()
    newer.rig.world.sleep(1.0)
    follower.poll()
    assert follower.header["script"] == "looks.py", "nobody else is there any more"
    newer.publisher.close()


def test_what_a_killed_process_left_is_not_followed(run, tmp_path):
    with open(run.publisher.path, "rb") as file:
        left = file.read()
    run.publisher.close()
    with open(run.publisher.path, "wb") as file:
        file.write(left)
    follower = run.follower()
    assert follower.header is None
    assert "its program is gone" in follower.refused
    newer = Run(tmp_path, "newer.py")
    follower.poll()
    assert follower.header["script"] == "newer.py"
    assert follower.refused == ""
    assert run_files(str(tmp_path / LIVE_FOLDER)) == [newer.publisher.path], "it was swept"
    newer.publisher.close()


def test_where_an_open_file_cannot_be_removed_it_is_swept_by_a_later_run(
    run, tmp_path, monkeypatch
):
    names = {}

    def remove(path):  # as Windows does while any program has it open
        if path in names:
            raise PermissionError(13, "in use", path)
        return real(path)

    real = os.remove
    monkeypatch.setattr(os, "remove", remove)
    names[run.publisher.path] = follower = run.follower()
    run.publisher.close()
    follower.poll()
    assert not follower.alive
    newer = Run(tmp_path, "newer.py")
    follower.poll()
    assert (follower.header["script"], follower.alive) == ("newer.py", True)
    assert len(run_files(str(tmp_path / LIVE_FOLDER))) == 2
    names.clear()
    newest = Run(tmp_path, "newest.py")
    newest.draw((10, 0), (5, 10))
    follower.poll()
    assert follower.header["script"] == "newest.py"
    files = [newest.publisher.path, newer.publisher.path]
    assert run_files(str(tmp_path / LIVE_FOLDER)) == files
    newest.close()
    newer.close()


def test_two_runs_that_begin_at_once_have_a_file_each(run, tmp_path, monkeypatch):
    """The second sweeps the first one's file in the moment before that is locked."""
    path = str(tmp_path / LIVE_FOLDER / "2.txt")
    lock = platforms.lock

    def swept_first(descriptor):
        if os.path.exists(path):
            monkeypatch.setattr(platforms, "lock", lock)
            os.remove(path)
        return lock(descriptor)

    monkeypatch.setattr(platforms, "lock", swept_first)
    other = Run(tmp_path, "other.py")
    other.draw((10, 0), (5, 10))
    follower = other.follower()
    assert follower.header["script"] == "other.py"
    assert os.path.exists(other.publisher.path)
    other.close()


def test_a_run_that_has_not_begun_its_file_is_waited_for(run, tmp_path):
    path = tmp_path / LIVE_FOLDER / "2.txt"
    follower = run.follower()
    with open(run.publisher.path, "rb") as file:
        begun = file.read()
    with open(str(path), "wb", buffering=0) as file:
        follower.poll()
        assert platforms.lock(file.fileno())
        follower.poll()
        file.write(begun[:20])
        follower.poll()
        assert (follower.header["script"], follower.refused) == ("drawing.py", "")
        file.write(begun[20:].replace(b"drawing.py", b"another.py"))
        follower.poll()
        assert follower.header["script"] == "another.py"


# What a file may look like


def append(run, data):
    with open(run.publisher.path, "ab") as file:
        file.write(data)


def test_half_a_line_waits_for_its_other_half(run):
    follower = run.follower()
    newest = follower.newest
    append(run, b"5.0000 0.25 0.")
    follower.poll()
    assert follower.newest == newest
    append(run, b"50 0\n")
    follower.poll()
    assert follower.newest == pytest.approx(run.zero + 5.0)
    assert follower.at(run.zero + 9).q == (0.25, 0.5)


@pytest.mark.parametrize(
    "line",
    [b"", b"\xff\xfe", b"5.0 0.1 0.2", b"5.0 0.1 0.2 0.3 0", b"5.0 nan 0.2 0", b"inf 1 2 0", b"{}"],
)
def test_a_line_that_is_no_pose_is_left_out(run, line):
    follower = run.follower()
    before = follower.at(run.zero + 9)
    append(run, line + b"\n")
    follower.poll()
    assert follower.at(run.zero + 9) == before
    assert follower.alive


def test_time_does_not_go_back(run):
    follower = run.follower()
    append(run, b"5.0 0.1 0.2 0\n4.0 0.9 0.9 0\n")
    follower.poll()
    assert follower.at(run.zero + 9).q == (0.1, 0.2)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"version": 99}, "version 99"),
        ({"arm": "/nowhere/at/all.ini"}, "no such arm file"),
        ({"zero": float("nan")}, "JSON"),
        ({"zero": "soon"}, "number"),
        ({"pid": None}, "number"),
        ({"pid": True}, "number"),
        ({"zero": 10**400}, "number"),
    ],
)
def test_a_header_that_is_wrong_is_refused_with_a_reason(run, change, word):
    with open(run.publisher.path, "r+b") as file:
        header = json.loads(file.readline().decode())
        header.update(change)
        file.seek(0)
        file.truncate()
        file.write(json.dumps(header).encode() + b"\n")
    follower = run.follower()
    assert follower.header is None
    assert word in follower.refused


@pytest.mark.parametrize("content", [b"[]\n", b"\xff\n", b"null\n", b"{\n"])
def test_a_file_that_is_something_else_is_refused(run, content):
    with open(run.publisher.path, "r+b") as file:
        file.truncate()
        file.write(content)
    follower = run.follower()
    assert follower.header is None
    assert run.publisher.path in follower.refused


# What the writer may meet


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full to stand for a full disk")
@pytest.mark.parametrize("kind", sorted(ODD))
def test_whatever_lies_where_runs_write_is_said_and_a_run_goes_beside_it(tmp_path, kind):
    (tmp_path / LIVE_FOLDER).mkdir()
    path = str(tmp_path / LIVE_FOLDER / "1.txt")
    ODD[kind][0](path)
    follower = PoseReader(str(tmp_path))
    follower.poll()
    assert follower.header is None
    assert (path in follower.refused) == (kind != "empty")
    new = Run(tmp_path)
    follower.poll()
    assert (follower.header["script"], follower.refused) == ("drawing.py", "")
    new.close()
    follower.close()


def test_a_full_disk_costs_the_live_picture_not_the_run(run, capsys):
    run.publisher._file.close()
    run.publisher._file = os.fdopen(os.open("/dev/full", os.O_WRONLY), "wb", 0)
    run.draw((10, 0), (5, 10))
    assert run.rig.tip == pytest.approx((5, 10), abs=0.3)
    reported = capsys.readouterr().err
    assert reported.count("\n") == 1
    assert "No space left" in reported


def test_a_folder_that_cannot_be_made_costs_the_live_picture_only(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    rig = Rig(tmp_path)
    publisher = PoseWriter(rig.brick, "x.py", str(tmp_path / "file" / "state"))
    rig.world.bodies.append(publisher.advance)
    rig.world.sleep(1)
    publisher.close()
    assert capsys.readouterr().err.count("\n") == 1


# With the runner


def scripted(tmp_path, source, realtime, monkeypatch, timeout=5.0):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    script = tmp_path / "script.py"
    script.write_text(source)
    return one_run(ARM, script, realtime=realtime, timeout=timeout)


WATCHED = """
import os, time
time.sleep(0.05)
state = %r
print(sorted(os.listdir(state)), sorted(name for *_, names in os.walk(state) for name in names))
"""


def test_a_run_in_real_time_is_there_to_follow_until_its_end(tmp_path, monkeypatch, capsys):
    state = tmp_path / "state"
    scripted(tmp_path, WATCHED % str(state), True, monkeypatch)
    assert capsys.readouterr().out == "['clock', 'live'] ['1.txt', 'clock']\n"
    assert sorted(os.listdir(str(state))) == ["clock", "live"]
    assert os.listdir(str(state / "live")) == []


def test_a_run_in_virtual_time_leaves_nothing_to_follow(tmp_path, monkeypatch, capsys):
    (tmp_path / "state").mkdir()
    scripted(tmp_path, WATCHED % str(tmp_path / "state"), False, monkeypatch)
    assert capsys.readouterr().out == "[] []\n"


def test_a_deadlock_is_noticed_in_real_time_too(tmp_path, monkeypatch):
    source = "import threading\nthreading.Event().wait()\n"
    assert scripted(tmp_path, source, True, monkeypatch).outcome.reason == "deadlock"


def test_in_real_time_the_bodies_move_on_while_the_program_sleeps(tmp_path):
    world = World(PacedClock(str(tmp_path)))
    seen = []
    world.bodies.append(seen.append)
    world.sleep(0.1)
    assert seen == pytest.approx([0.005 * k for k in range(1, 21)])


CHILD = """
import sys
sys.path.insert(0, {root!r})
from laptop.emulator.rig import Rig
with Rig(realtime=True) as rig:
    rig.run({script!r}, timeout=60)
"""
MOVER = """
import time
from ev3dev2.motor import LargeMotor, OUTPUT_A
LargeMotor(OUTPUT_A).on_for_degrees(40, 90, block=False)
time.sleep(50)
"""


@pytest.mark.long
def test_another_process_is_followed_while_it_sleeps_and_missed_when_it_is_killed(tmp_path):
    script = tmp_path / "mover.py"
    script.write_text(MOVER)
    code = CHILD.format(root=ROOT, script=str(script))
    reported = dict(os.environ, BRICKSERVO_STATE=str(tmp_path / "state"))
    child = subprocess.Popen([sys.executable, "-c", code], env=reported)
    follower = PoseReader(str(tmp_path / "state"))

    clock = PacedClock(str(tmp_path / "state"))

    def until(condition):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, follower.refused
            assert child.poll() is None or follower.header is not None
            time.sleep(0.005)
            follower.poll()

    try:
        seen = set()

        def moved():
            pose = follower.at(clock.now())
            seen.add(pose and pose.q[0])
            return pose and pose.q[0] > 1.2

        until(moved)
        # Not in one leap: the script sleeps all the time.
        assert len(seen) > 5
        assert follower.header["pid"] == child.pid
        assert abs(follower.newest - clock.now()) < 1.0, "there is a sign of life"
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
        until(lambda: not follower.alive)
        late = PoseReader(str(tmp_path / "state"))
        late.poll()
        assert late.header is None
        assert "gone" in late.refused
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()
        follower.close()
        clock.close()
