"""Whether a signal has stopped a process."""

import os
import signal
import subprocess
import sys

import pytest
from waiting import until

from laptop.tracking.process_signals import is_stopped


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
