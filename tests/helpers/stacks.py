"""What hangs tells where: of each process that a test has to kill the stacks of all threads.

Python writes them to its standard error as it ends by SIGABRT, if PYTHONFAULTHANDLER is set when it
starts; so do the processes that it has started.
"""

import faulthandler
import glob
import os
import signal
import subprocess
import sys
import time

LEAST = 100.0
"""Whoever was waited for so long hangs, s."""

LAST_WORDS = 30.0
"""Time to write the stacks, s."""

_Popen = subprocess.Popen


class Popen(_Popen):
    """A process that, waited for long, is ended by SIGABRT, and so is all that it has started."""

    def wait(self, timeout=None):
        """As ever."""
        try:
            return super().wait(timeout)
        except subprocess.TimeoutExpired:
            if timeout >= LEAST:
                abort(self.pid)
            raise

    def communicate(self, input=None, timeout=None):
        """As ever; what one that hangs has written, its stacks among it, is shown."""
        try:
            return super().communicate(input, timeout)
        except subprocess.TimeoutExpired:
            if timeout >= LEAST:
                abort(self.pid)
                for words in super().communicate(timeout=LAST_WORDS):
                    text = words.decode("utf-8", "replace") if isinstance(words, bytes) else words
                    print(text or "", file=sys.stderr)
            raise


def install():
    """Let all processes that are started from now on tell, and those that they start."""
    os.environ["PYTHONFAULTHANDLER"] = "1"
    subprocess.Popen = Popen


def show():
    """Show the stacks of this process, and let all that it has started show theirs, and end.

    But for multiprocessing's own, which later tests need.
    """
    faulthandler.dump_traceback(file=2)
    for pid in below(os.getpid(), b"multiprocessing"):
        _abort(pid)


def abort(pid):
    """End a process, and the Python processes that it has started, by SIGABRT; they first."""
    for each in below(pid):
        _abort(each)
    deadline = time.monotonic() + LAST_WORDS
    while below(pid) and time.monotonic() < deadline:  # they write
        time.sleep(0.05)
    _abort(pid)


def _abort(pid):
    try:
        os.kill(pid, signal.SIGABRT)
    except OSError:  # it has just ended
        return


def below(pid, but=None):
    """The numbers of the Python processes that a process has started, and those that they have.

    Args:
        but: in the command line of those that are left out, with all below them.
    """
    started = {}
    for file in glob.glob("/proc/[0-9]*/stat"):  # where there is no /proc, none is found
        try:
            with open(file, encoding="utf-8", errors="replace") as stat:
                number, rest = stat.read().split(" ", 1)
            with open(file[: -len("stat")] + "cmdline", "rb") as words:
                line = words.read()
        except OSError:  # it has just ended
            continue
        state, parent = rest.rpartition(")")[2].split()[:2]
        if state == "Z":  # it has ended, and nobody has asked how
            continue
        if but is None or but not in line:
            is_python = b"python" in os.path.basename(line.split(b"\0")[0])
            started.setdefault(int(parent), []).append((int(number), is_python))
    found, parents = [], [pid]
    while parents:
        for number, is_python in started.get(parents.pop(), ()):
            parents.append(number)
            if is_python:
                found.append(number)
    return found
