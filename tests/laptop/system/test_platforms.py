"""What systems have each in its own way: locks, and what becomes of processes."""

import errno
import os
import signal
import subprocess
import sys

import pytest
from places import ROOT
from systems import lacking
from waiting import until

from laptop.emulator.pace import PacedClock
from laptop.system import platforms


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="only Linux tells that one is stopped")
def test_a_process_is_stopped_from_sigstop_to_sigcont():
    child = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        assert not platforms.is_stopped(child.pid)
        child.send_signal(signal.SIGSTOP)
        until(lambda: platforms.is_stopped(child.pid), "the stop")
        child.send_signal(signal.SIGCONT)
        until(lambda: not platforms.is_stopped(child.pid), "the end of it")
    finally:
        child.kill()
        child.wait()
    assert not platforms.is_stopped(child.pid), "there is none"


def test_a_file_is_locked_for_others_until_it_is_closed(tmp_path):
    ours, other = (platforms.open_to_share(tmp_path / "file") for _ in range(2))
    assert not platforms.is_locked(other)
    assert platforms.lock(ours)
    assert platforms.is_locked(other)
    assert not platforms.lock(other)
    os.close(ours)
    assert not platforms.is_locked(other)
    os.close(other)


@pytest.fixture
def no_locks(monkeypatch):
    """Files lie where none can be locked, as on some networks."""

    def refuse(*args):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(platforms.fcntl, "flock", refuse)
    monkeypatch.setattr(platforms.fcntl, "lockf", refuse)


def test_where_nothing_can_be_locked_nothing_is_taken_for_locked_by_us(tmp_path, no_locks):
    descriptor = platforms.open_to_share(tmp_path / "file")
    for lock in (platforms.lock, lambda it: platforms.lock_byte(it, 0, wait=True)):
        with pytest.raises(OSError, match="locks"):
            lock(descriptor)
    assert platforms.is_locked(descriptor)
    os.close(descriptor)


def test_where_nothing_can_be_locked_a_world_has_a_clock_of_its_own(tmp_path, no_locks):
    clock = PacedClock(str(tmp_path))
    assert clock._file.descriptor is None
    member = clock.join("brick")
    member.promise(clock.now() + 10)
    clock.sleep_until(clock.now() + 0.01)
    member.leave()
    clock.close()


def test_results_go_into_another_user_s_folder_that_is_open_to_us(tmp_path, monkeypatch):
    owner = os.stat(tmp_path).st_uid
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    descriptor = platforms.open_folder(tmp_path)
    assert platforms.lock(descriptor)
    os.close(descriptor)


ANOTHER = """
import sys
from laptop.system import platforms
from laptop.emulator.pace import PacedClock
descriptor = platforms.open_to_share(sys.argv[1])
print(*[int(platforms.lock_byte(descriptor, k)) for k in (0, 1)])
"""


@pytest.mark.parametrize("lacks", [None, "windows"])
def test_bytes_are_locked_for_other_processes_one_by_one(tmp_path, lacks):
    path = tmp_path / "file"
    descriptor = platforms.open_to_share(path)
    environment = lacking(lacks) if lacks else {**os.environ, "PYTHONPATH": str(ROOT)}

    def other():
        words = [sys.executable, "-c", ANOTHER, str(path)]
        return subprocess.run(words, env=environment, capture_output=True, text=True).stdout

    assert other() == "1 1\n"
    assert platforms.lock_byte(descriptor, 1, wait=True)
    assert other() == "1 0\n"
    platforms.unlock_byte(descriptor, 1)
    assert other() == "1 1\n"
    os.close(descriptor)
