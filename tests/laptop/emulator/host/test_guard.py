"""Scripts that hang where no Python of theirs is run: in C, and in a call to the system."""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import pytest
from places import ROOT
from waiting import PATIENCE

from laptop.emulator.host import guard, guard_process
from laptop.emulator.host.guard import guarded
from laptop.system import platforms

PROGRAM = """
import builtins, functools, os, signal, sys
from laptop.emulator.host import guard
from laptop.emulator.host.watchdog import Watchdog
from laptop.emulator.rig import Rig
from laptop.cli import start as program

patience, hearing = map(float, sys.argv[1:3])
guard.PATIENCE, guard.SIGNAL_TIMEOUT, Watchdog.HEARING_TIMEOUT = 2 * patience, hearing, hearing
run = Rig.run
Rig.run = lambda *args, **options: run(*args, patience=patience, **options)
sys.argv[1:3] = []
builtins.begun = functools.partial(os.write, 1, b"begun\\n")  # no print: that hears signals
program.run()
"""

SUM = "sum(range(10**12))\n"
PATTERN = "import re; re.match('(a+)+$', 'a' * 60 + 'b')\n"
LOOP = "for i in range(10**12): pass\n"
READ = "import os; os.read(os.pipe()[0], 1)\n"
CALL = "import socket; s = socket.socket(); s.bind(('127.0.0.1', 0)); s.listen(1); s.accept()\n"

LEFT = 3600.0
"""A patience that no test comes to the end of, s."""


@pytest.fixture
def hanging(tmp_path):
    """Begin to simulate a script that hangs; a Popen, once that has begun to."""
    started = []

    def begin(source, patience, hearing=0.3, options=()):
        script = tmp_path / "mine.py"
        script.write_text("begun()\n" + source)
        args = ["simulate", "--arm", "none", "--out", str(tmp_path / "out"), *options, str(script)]
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(patience), str(hearing), *args],
            cwd=ROOT,
            env={**os.environ, "BRICKSERVO_STATE": str(tmp_path / "state")},
            start_new_session=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stdout.readline() == "begun\n"
        return process

    yield begin
    for process in started:
        process.kill()
        process.communicate()


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="there are no groups of processes")
@pytest.mark.short(every=5)
@pytest.mark.parametrize(
    ("source", "status", "message"),
    [
        (SUM, -signal.SIGKILL, "simulate: mine.py: it did not hear SIGINT inside one call of a"),
        (LOOP, 130, "simulate: mine.py: ended at 0.000 s by a signal that it did not hear"),
        (PATTERN, -signal.SIGKILL, "simulate: mine.py: it did not hear SIGINT inside one call"),
        (READ, 130, "simulate: mine.py: ended at 0.000 s by a signal that it did not hear"),
        (CALL, 130, "simulate: mine.py: ended at 0.000 s by a signal that it did not hear"),
    ],
    ids=["C", "loop", "pattern", "read", "call"],
)
def test_one_ctrl_c_ends_a_script_that_hangs(hanging, source, status, message):
    process = hanging(source, LEFT)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert err.startswith(message)
    assert err.count("\n") == 1
    assert process.returncode == status


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("source", "status", "message"),
    [
        (SUM, -signal.SIGKILL, "simulate: mine.py: it computed for [0-9]+ s inside one call of a"),
        (LOOP, 124, "simulate: mine.py: at 0.000 s it computed for 0.5 s without looking at the"),
        (READ, 124, "simulate: mine.py: at 0.000 s it waited for something outside the emulated"),
    ],
    ids=["C", "loop", "read"],
)
def test_a_script_that_hangs_is_ended_and_told_why(hanging, source, status, message):
    process = hanging(source, 0.5, options=("--timeout", "1"))
    _, err = process.communicate(timeout=PATIENCE)
    assert re.match(message, err)
    assert err.count("\n") == 1
    assert process.returncode == status


@pytest.mark.skipif(not hasattr(signal, "pthread_sigmask"), reason="no signals can be blocked")
def test_ctrl_c_does_not_reach_the_guard_even_before_it_ignores_it(tmp_path, monkeypatch):
    (tmp_path / "first.py").write_text(
        "import signal, sys\n"
        "blocked = signal.pthread_sigmask(signal.SIG_BLOCK, [])\n"
        f"open({str(tmp_path / 'blocked')!r}, 'w').write(' '.join(map(str, map(int, blocked))))\n"
        "sys.stdin.read()\n"
    )
    monkeypatch.setattr(guard_process, "__file__", str(tmp_path / "first.py"))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with guarded("mine.py"):
        assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before, "of ours, none is"
    blocked = {int(number) for number in (tmp_path / "blocked").read_text().split()}
    assert blocked - before == set(platforms.ENDING) - before


@pytest.mark.long
def test_who_lets_go_of_the_interpreter_is_left_alone(monkeypatch):
    monkeypatch.setattr(guard, "PATIENCE", 0.5)
    before = threading.active_count()
    with guarded("mine.py"):
        end = time.process_time() + 1.5
        while time.process_time() < end:
            pass
    assert threading.active_count() == before


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells")
def test_time_spent_is_that_of_the_process_alone():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        deadline = time.monotonic() + 1
        while time.monotonic() < deadline:  # this one computes, the other waits
            pass
        assert guard_process.spent(process.pid) < 0.9
        assert guard_process.spent(os.getpid()) > 0.1
    finally:
        process.communicate()
