"""The end of a command's process: threads that nobody can end are not torn out of what they do."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numbered_frames import write_film
from own_python import python
from places import ROOT
from run_json import run_in

PROGRAM = """
import atexit, sys, threading
import laptop.cli.main as commands
from laptop.cli.start import run

def main():
    {work}
    print("done")
    {end}

commands.main = main
atexit.register(print, "the interpreter ends")
run()
"""
HUNG = "threading.Thread(target=threading.Event().wait, daemon=True).start()"
BUSY = "threading.Timer(0.2, print, ['later']).start()"


@pytest.mark.long
@pytest.mark.parametrize("end", ["return 3", "sys.exit(3)"])
@pytest.mark.parametrize(
    ("work", "printed"),
    [
        ("pass", "done\nthe interpreter ends\n"),
        (BUSY, "done\nlater\nthe interpreter ends\n"),
        (HUNG, "done\n"),
    ],
    ids=["alone", "busy", "hung"],
)
def test_the_interpreter_does_not_end_under_a_thread_that_goes_on(work, printed, end):
    done = python("-c", PROGRAM.format(work=work, end=end))
    assert (done.returncode, done.stderr) == (3, "")
    assert done.stdout == printed


@pytest.mark.short(every=2)
@pytest.mark.skipif(os.name == "nt", reason="there no process begins with closed streams")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_closed_stream_neither_ends_a_command_nor_becomes_one_of_its_files(closed, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("import sys\nprint('said')\nsys.stderr.write('told\\n')\ninput()\n")
    args = [sys.executable, "-m", "laptop", "simulate", "--out", tmp_path / "out", script]
    line = f'exec "$@" {closed}'
    done = subprocess.run(
        ["sh", "-c", line, "sh", *args],
        cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr  # of the script, for there is nothing to read
    assert ("said" in done.stdout) == (" >" not in f" {closed}")
    assert "laptop" not in done.stderr
    assert "EOFError" in done.stderr or "2>&-" in closed
    assert run_in(tmp_path / "out")["status"] == 1


TELLING = """
import sys, threading
from laptop.cli import start as program

def tell(status):
    print(*(thread.name for thread in threading.enumerate()), file=sys.stderr, sep="\\n")

program._leave_threads = tell
program.run()
"""


@pytest.mark.long
@pytest.mark.parametrize("page", ["--page-port=0", "--no-page"])
def test_a_tracker_ends_its_threads(tmp_path, page):
    """But for who starts the page's process: that may take longer than it is waited for."""
    film = write_film(tmp_path / "film.avi", [np.full((120, 160, 3), 130, np.uint8)])
    args = ["track", "--camera", str(film), "--listen-port", "127.0.0.1:0", page]
    done = python("-c", TELLING, *args, env={**os.environ, "BRICKSERVO_STATE": str(tmp_path)})
    first, *others = done.stderr.splitlines()
    assert (done.returncode, first) == (0, "MainThread")
    if "page watcher" in others:
        others = [
            name for name in others if name != "page watcher" and "(serve_requests)" not in name
        ]
    assert others == []
