"""The clock of an emulated world in real time, on a wall's clock that is turned, or real."""

import os
import signal
import subprocess
import sys

import pytest
from odd_files import ODD
from places import ROOT

from laptop.emulator import pace
from laptop.emulator.pace import MAX_CATCH_UP, PacedClock, PaceMeter


class Wall:
    """Stands for `time`; sleeping takes what it should, and whatever else happens meanwhile."""

    def __init__(self):
        self.t = 1000.0
        self.meanwhile = []

    def monotonic(self):
        return self.t

    def sleep(self, seconds):
        self.t += seconds
        if self.meanwhile:
            self.meanwhile.pop(0)()


@pytest.fixture
def wall(monkeypatch):
    wall = Wall()
    monkeypatch.setattr(pace, "wall", wall)
    return wall


@pytest.fixture
def clock(tmp_path, wall):
    clock = PacedClock(str(tmp_path))
    yield clock
    clock.close()


def test_with_nobody_to_wait_for_it_goes_as_the_wall_does(clock, wall):
    start = clock.now()
    wall.t += 3.0
    assert clock.now() - start == pytest.approx(3.0)
    clock.sleep_until(start + 4.0)
    assert wall.t == pytest.approx(1004.0)


@pytest.mark.parametrize("kind", sorted(ODD))
def test_whatever_has_become_of_its_file_there_is_a_clock(tmp_path, wall, kind):
    ODD[kind][0](str(tmp_path / pace.FILE))
    clock = PacedClock(str(tmp_path))
    start = clock.now()
    wall.t += 3.0
    assert clock.now() - start == pytest.approx(3.0)
    clock.close()


def test_no_promise_is_overtaken_and_a_short_delay_is_caught_up_with(clock, wall):
    start = clock.now()
    member = clock.join("brick")
    assert clock.now() == start
    member.promise(start + 0.1)
    wall.t += MAX_CATCH_UP
    assert clock.now() == start + 0.1
    member.promise(start + 9.0)
    assert clock.now() == pytest.approx(start + MAX_CATCH_UP), "as if nothing had been late"
    member.leave()


def test_a_long_delay_is_lost_for_all(clock, wall):
    start = clock.now()
    member = clock.join("brick")
    member.promise(start + 0.1)
    wall.t += 60.0
    assert clock.now() == start + 0.1
    member.promise(start + 100.0)
    assert clock.now() == pytest.approx(start + 0.1 + MAX_CATCH_UP)
    wall.t += 1.0
    assert clock.now() == pytest.approx(start + 1.1 + MAX_CATCH_UP)
    member.leave()


def test_it_waits_for_the_latest_and_says_for_whom(clock, wall):
    start = clock.now()
    members = [clock.join(name) for name in ("brick", "synthetic A", "synthetic B")]
    for member, after in zip(members, (0.3, 0.1, 0.2)):
        member.promise(start + after)
    assert clock.latest == ""
    wall.t += 0.2
    assert (clock.now(), clock.latest) == (
        start + 0.1,
        f"synthetic A (process {os.getpid()})",
    )
    members[1].leave()
    assert clock.now() == start + 0.2
    for member in members:
        member.leave()
    assert clock.latest == ""


def test_an_earlier_promise_is_kept(clock, wall):
    member = clock.join("brick")
    member.promise(wall.t + 1.0)
    member.promise(wall.t + 0.5)
    wall.t += 0.9
    assert clock.now() == pytest.approx(1000.9)
    member.leave()


def test_who_sleeps_until_a_late_member_has_come_looks_again_and_again(clock, wall):
    start = clock.now()
    member = clock.join("brick")
    wall.meanwhile = [lambda: None] * 50 + [lambda: member.promise(start + 5.0)]
    clock.sleep_until(start + 0.02)
    assert start + 0.02 <= clock.now() < start + 0.1
    assert wall.meanwhile == []
    member.leave()


def test_all_clocks_of_a_folder_are_one(clock, wall, tmp_path):
    other = PacedClock(str(tmp_path))
    member = other.join("brick")
    wall.t += 1.0
    assert clock.now() == other.now() == 1000.0
    member.leave()
    other.close()
    assert clock.now() == pytest.approx(1000.0 + MAX_CATCH_UP), "it is open still"


def test_time_that_was_lost_by_a_world_is_not_the_next_one_s(clock, wall):
    for _ in range(2):
        member = clock.join("brick")
        assert clock.now() == pytest.approx(wall.t)
        wall.t += 60.0
        clock.now()
        member.leave()


def test_there_is_room_for_so_many_and_others_are_not_waited_for(clock, wall):
    members = [clock.join("brick") for _ in range(pace.MAX_MEMBERS + 2)]
    for member in members[: pace.MAX_MEMBERS]:
        member.promise(wall.t + 10.0)
    wall.t += 5.0
    assert clock.now() == pytest.approx(wall.t)
    for member in members:
        member.promise(wall.t + 9.0)
        member.leave()


def test_a_folder_that_cannot_be_written_costs_only_the_others(tmp_path, wall):
    (tmp_path / "file").write_text("")
    clock = PacedClock(str(tmp_path / "file" / "state"))
    member = clock.join("brick")
    wall.t += 1.0
    assert clock.now() == 1000.0
    member.leave()
    clock.close()


def test_a_file_of_something_else_is_replaced(tmp_path, wall):
    (tmp_path / pace.FILE).write_bytes(b"something else")
    clock = PacedClock(str(tmp_path))
    assert clock.now() == 1000.0
    clock.close()


def test_the_pace_is_told_over_the_last_seconds_and_over_all(clock, wall):
    speed, member = PaceMeter(clock), clock.join("brick")
    for _ in range(100):
        member.promise(wall.t + 9.0)
        assert speed.sample() == pytest.approx(1.0)
        wall.t += 0.1
    member.leave()
    member = clock.join("brick")
    for _ in range(100):
        member.promise(clock.now() + 0.06)
        wall.t += 0.1
        speed.sample()
    assert speed.sample() == pytest.approx(0.6, abs=0.05)
    assert speed.mean == pytest.approx(0.8, abs=0.05)
    assert pace.in_words(speed.sample()) == "this computer is busy: running at 0.6 x"
    member.leave()


def test_of_a_time_in_which_nobody_looked_little_is_known(clock, wall):
    speed, member = PaceMeter(clock, window=10.0), clock.join("brick")
    speed.sample()
    wall.t += 3600.0
    for _ in range(20):
        member.promise(clock.now() + 1.0)
        speed.sample()
        wall.t += 1.0
    assert speed.sample() > 0.9
    member.leave()


CHILD = """
import sys, time
sys.path.insert(0, {root!r})
from laptop.emulator.pace import PacedClock
member = PacedClock({folder!r}).join("a brick")
print("joined", flush=True)
sys.stdin.read()
"""


@pytest.mark.long
def test_who_lives_is_waited_for_and_who_is_killed_is_not(tmp_path):
    clock = PacedClock(str(tmp_path))
    code = CHILD.format(root=str(ROOT), folder=str(tmp_path))
    child = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    try:
        assert child.stdout.readline() == b"joined\n"
        held = clock.now()
        until = pace.wall.monotonic() + 3 * MAX_CATCH_UP
        while pace.wall.monotonic() < until:
            assert clock.now() == held
        assert clock.latest == f"a brick (process {child.pid})"
        os.kill(child.pid, signal.SIGKILL)
        clock.sleep_until(held + 0.01)
    finally:
        child.kill()
        child.wait()
        child.stdin.close()
        child.stdout.close()
    assert clock.latest == ""
    clock.close()
