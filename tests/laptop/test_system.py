"""What systems have each in its own way: locks, and what becomes of processes."""

import os
import signal
import subprocess
import sys

import pytest
from places import ROOT
from systems import lacking
from waiting import until

from laptop import system
from laptop.system import is_stopped


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="only Linux tells so")
def test_a_process_is_stopped_from_sigstop_to_sigcont():
    child = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        assert not is_stopped(child.pid)
        child.send_signal(signal.SIGSTOP)
        until(lambda: is_stopped(child.pid), "the stop")
        child.send_signal(signal.SIGCONT)
        until(lambda: not is_stopped(child.pid), "the end of it")
    finally:
        child.kill()
        child.wait()
    assert not is_stopped(child.pid), "there is none"


def test_a_file_is_locked_for_others_until_it_is_closed(tmp_path):
    ours, other = (system.open_to_share(tmp_path / "file") for _ in range(2))
    assert not system.is_locked(other)
    assert system.lock(ours)
    assert system.is_locked(other)
    assert not system.lock(other)
    os.close(ours)
    assert not system.is_locked(other)
    os.close(other)


ANOTHER = """
import sys
from laptop import system
descriptor = system.open_to_share(sys.argv[1])
print(*[int(system.lock_byte(descriptor, k)) for k in (0, 1)])
"""


@pytest.mark.parametrize("lacks", [None, "windows"])
def test_bytes_are_locked_for_other_processes_one_by_one(tmp_path, lacks):
    path = tmp_path / "file"
    descriptor = system.open_to_share(path)
    environment = lacking(lacks) if lacks else {**os.environ, "PYTHONPATH": str(ROOT)}

    def other():
        words = [sys.executable, "-c", ANOTHER, str(path)]
        return subprocess.run(words, env=environment, capture_output=True, text=True).stdout

    assert other() == "1 1\n"
    assert system.lock_byte(descriptor, 1, wait=True)
    assert other() == "1 0\n"
    system.unlock_byte(descriptor, 1)
    assert other() == "1 1\n"
    os.close(descriptor)
