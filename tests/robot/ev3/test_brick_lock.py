"""One program at a time moves the motors, with real processes: who holds it, taken over, freed."""

import contextlib
import math
import os
import re
import signal
import subprocess
import sys
import time

import pytest
from lock_holder import LockHolders
from places import ROOT
from refusals import refused
from waiting import PATIENCE

from robot.ev3 import brick_lock
from robot.ev3.brick_lock import BrickInUse, BrickLock

STOPS_ITSELF = "def end(*_): raise SystemExit(143)\nsignal.signal(signal.SIGTERM, end)"
IGNORES = (
    "signal.signal(signal.SIGTERM, signal.SIG_IGN); signal.signal(signal.SIGINT, lambda *_: 0)"
)


class Clock:
    """Time that passes when it is slept, with what happens after each sleep."""

    def __init__(self, then=lambda: None):
        self.t = 0.0
        self.then = then

    def now(self):
        return self.t

    def sleep(self, seconds):
        self.t += seconds
        self.then()


HEARS_CTRL_C = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
"""Also where these tests run in the background, and Ctrl-C is ignored from the start."""


@pytest.fixture(autouse=True)
def given_back():
    yield
    brick_lock.release()


@pytest.fixture
def folder(tmp_path):
    """A folder of motors."""
    (tmp_path / "tacho-motor").mkdir()
    return str(tmp_path / "tacho-motor")


@pytest.fixture
def other(tmp_path, folder):
    """Starts other programs that have the lock."""
    with LockHolders(tmp_path, folder) as holders:
        yield holders.begin


def test_a_program_may_take_it_again_and_again(folder):
    BrickLock(folder).acquire()
    BrickLock(folder).acquire()
    BrickLock(folder).take_over(Clock())
    assert BrickLock(folder).holder() is None
    assert os.listdir(folder) == [], "nothing is written there"


def is_its_age(text, began):
    """Whether a text tells how long a program has run that was begun then, by time.monotonic()."""
    seconds = int(re.search(r"running for (\d+) s\b", text).group(1))
    return 0 <= seconds <= math.ceil(time.monotonic() - began)


def test_a_second_program_is_told_who_has_it(folder, other):
    began = time.monotonic()
    first = other()
    with pytest.raises(BrickInUse) as error:
        BrickLock(folder).acquire("; or so")
    assert refused(error, "other.py", str(first.pid), "running for ", "kill", "; or so")
    assert is_its_age(str(error.value), began)
    holder = BrickLock(folder).holder()
    assert holder[:2] == ("other.py", first.pid)
    with pytest.raises(BrickInUse):
        BrickLock(folder).check_free()


def test_bricks_are_apart(folder, other, tmp_path):
    other()
    (tmp_path / "another").mkdir()
    BrickLock(str(tmp_path / "another")).acquire()
    BrickLock(str(tmp_path / "another")).check_free()


def test_death_frees_it(folder, other):
    first = other()
    first.kill()
    first.wait(PATIENCE)
    BrickLock(folder).check_free()
    BrickLock(folder).acquire()


def reaping(process):
    """A clock in whose naps the other program may end."""

    def nap():
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)

    return Clock(nap)


@pytest.mark.parametrize(
    ("before", "statuses"),
    [(STOPS_ITSELF, [143]), (HEARS_CTRL_C, [-signal.SIGINT, 1])],  # 1 before Python 3.8
    ids=["SIGTERM", "Ctrl-C"],
)
def test_who_is_asked_stops_in_its_own_way(folder, other, before, statuses):
    began = time.monotonic()
    first, lines = other(before), []
    BrickLock(folder).take_over(reaping(first), lines.append)
    assert first.wait(PATIENCE) in statuses
    assert first.stdout.read() == "parked\n"
    (line,) = lines
    assert re.sub(r"\d+ s\b", "N s", line) == (
        f"asking other.py (process {first.pid}, running for N s) to stop"
    )
    assert is_its_age(line, began)
    BrickLock(folder).acquire()


def test_who_does_not_stop_is_named_at_the_deadline(folder, other):
    first, clock = other(IGNORES), Clock()
    with pytest.raises(BrickInUse) as error:
        BrickLock(folder).take_over(clock, lambda line: None)
    assert refused(error, "other.py", "has not in 15 s", f"kill -9 {first.pid}")
    assert brick_lock.TAKE_TIMEOUT <= clock.t < brick_lock.TAKE_TIMEOUT + 1
    assert first.poll() is None


def test_who_has_ended_meanwhile_is_not_signalled(folder, other, monkeypatch):
    """Its number may be another process's by then."""
    first, signalled, kill = other(), [], os.kill
    monkeypatch.setattr(os, "kill", lambda pid, number: signalled.append(pid))

    def ends(line):
        kill(first.pid, signal.SIGKILL)
        first.wait(PATIENCE)

    BrickLock(folder).take_over(Clock(), ends)
    assert signalled == []


def test_a_process_that_only_has_its_number_is_not_signalled(folder, other, monkeypatch):
    first, signalled = other(), []
    monkeypatch.setattr(os, "kill", lambda pid, number: signalled.append(pid))
    real = brick_lock._holder
    began = []

    def holder(pid):
        began.append(pid)
        return real(pid)._replace(begun=len(began))

    monkeypatch.setattr(brick_lock, "_holder", holder)
    with pytest.raises(BrickInUse):
        BrickLock(folder).take_over(Clock(), lambda line: None)
    assert signalled == []
    assert first.poll() is None


def test_only_the_first_is_asked(folder, other, monkeypatch):
    """Whoever is faster when it ends is not sent away: two would take it from each other."""
    first, then = other(STOPS_ITSELF), []

    def nap():
        if not then:
            first.wait(PATIENCE)
            then.append(other(STOPS_ITSELF))

    with pytest.raises(BrickInUse) as error:
        BrickLock(folder).take_over(Clock(nap), lambda line: None)
    assert refused(error, str(then[0].pid))
    assert then[0].poll() is None


@pytest.mark.skipif(os.geteuid() != 0, reason="needs another user")
def test_another_users_program_is_named_and_left_alone(folder, other, tmp_path):
    first = other()
    code = (
        f"import sys, os; sys.path.insert(0, {str(ROOT)!r})\n"
        "from robot.ev3.brick_lock import BrickLock\n"
        "from robot.clock import Clock\n"
        "import _signal, fcntl; os.setuid(65534)\n"
        f"BrickLock({folder!r}).take_over(Clock())"
    )
    for part in (tmp_path, *list(tmp_path.parents)[:-2]):
        if "pytest" in str(part):
            os.chmod(str(part), 0o755)
    shown = subprocess.run(
        [sys.executable, "-c", code],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        universal_newlines=True,  # noqa: UP021 - `text` came with 3.7
        timeout=PATIENCE,
    )
    assert f"other.py (process {first.pid}," in shown.stderr
    assert "another user's" in shown.stderr
    assert first.poll() is None


def test_a_file_may_stand_for_the_motors(folder, other, tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_LOCK", str(tmp_path / "stands-for-it"))
    other()
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "of another user"))
    with pytest.raises(BrickInUse):
        BrickLock(folder).acquire()
    monkeypatch.setenv("BRICKSERVO_LOCK", str(tmp_path / "stands-for-another"))
    BrickLock(folder).acquire()


def test_where_the_system_has_no_locks_nothing_is_locked(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    BrickLock(folder).acquire()
    BrickLock(folder).take_over(Clock())


@pytest.mark.parametrize(
    ("args", "name"),
    [
        (["python3", "robot/driver.py", "line", ""], "driver.py"),
        (["/usr/bin/python3", "-m", "robot.driver", "home", ""], "robot.driver"),
        (["python", "-m", "laptop", "simulate", "robot/driver.py", "home", ""], "driver.py"),
        (["/usr/bin/python3", ""], "python3"),
    ],
)
def test_a_program_is_named_as_people_call_it(args, name):
    assert brick_lock._script(args) == name


def test_how_long_is_said_in_a_fitting_unit():
    assert [brick_lock._span(s) for s in (0.4, 119, 120, 7199, 7300)] == [
        "0 s", "119 s", "2 min", "119 min", "2 h",
    ]  # fmt: skip
