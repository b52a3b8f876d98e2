"""A program that may move a brick's motors, in a process of its own, until it is told to end."""

import contextlib
import subprocess
import sys

from places import ROOT
from waiting import PATIENCE

SOURCE = """
import sys, signal, time
sys.path.insert(0, {root!r})
from robot.ev3.brick_lock import BrickLock
{before}
BrickLock({path!r}).acquire()
try:
    print("held", flush=True)
    time.sleep({seconds})
finally:
    print("parked", flush=True)
"""
NAME = "other.py"


class LockHolders:
    """Programs that hold the lock of one folder of motors; they end with a `with` block.

    Args:
        script_folder: where their script is written.
        path: the folder, or the file that stands for it.
    """

    def __init__(self, script_folder, path):
        self._script = script_folder / NAME
        self._path = str(path)
        self._made = []

    def __enter__(self):
        return self

    def __exit__(self, *error):
        for process in self._made:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.communicate(timeout=PATIENCE)

    def begin(self, before="", seconds=10 * PATIENCE):
        """Start one that has it; its Popen. `before` is what it does first, in Python."""
        source = SOURCE.format(root=str(ROOT), path=self._path, before=before, seconds=seconds)
        self._script.write_text(source)
        process = subprocess.Popen(
            [sys.executable, str(self._script)], stdout=subprocess.PIPE, universal_newlines=True
        )
        self._made.append(process)
        assert process.stdout.readline() == "held\n"
        return process
