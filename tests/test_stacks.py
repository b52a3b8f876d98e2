"""What hangs in a test tells where it does."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import stacks
from waiting import PATIENCE, until

HANGS = """
import subprocess, sys, threading, time

def waits_for_ever():
    print("ready", flush=True)
    time.sleep(1000)

def waits_in_a_thread():
    time.sleep(1000)

threading.Thread(target=waits_in_a_thread, daemon=True).start()
if len(sys.argv) == 1:
    child = subprocess.Popen([sys.executable, "-c", HANGS, "child"], stdout=subprocess.PIPE)
    child.stdout.readline()
waits_for_ever()
"""
HANGS = HANGS.replace("HANGS", repr(HANGS.replace("waits_", "child_waits_")))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it is found by Linux's /proc")
@pytest.mark.parametrize("by", ["communicate", "wait"])
def test_whatever_hangs_shows_the_stacks_of_its_threads_and_children(monkeypatch, capfd, by):
    monkeypatch.setattr(stacks, "LEAST", 0.1)
    process = subprocess.Popen([sys.executable, "-c", HANGS], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    with pytest.raises(subprocess.TimeoutExpired):
        getattr(process, by)(timeout=0.1)
    assert process.wait(100) < 0
    process.stdout.close()
    told = capfd.readouterr().err
    for name in ("waits_for_ever", "waits_in_a_thread"):
        assert f" in {name}\n" in told
        assert f" in child_{name}\n" in told


ENDS = """
import multiprocessing, subprocess, sys
sys.path.insert(0, sys.argv[1])
import stacks

def where_it_waits():
    stacks.show()

stacks.install()
context = multiprocessing.get_context("forkserver")
ours, theirs = context.Pipe()
helper = context.Process(target=theirs.recv)
helper.start()
child = subprocess.Popen([sys.executable, "-c", HANGS, "child"], stdout=subprocess.PIPE)
child.stdout.readline()
where_it_waits()
child.wait()
ours.send("end")
helper.join()
print("goes on", helper.exitcode)
""".replace("HANGS", repr(HANGS))


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it is found by Linux's /proc")
def test_who_waits_for_what_never_comes_shows_its_own_and_goes_on():
    helpers = os.path.dirname(stacks.__file__)
    process = subprocess.Popen(
        [sys.executable, "-c", ENDS, helpers], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    out, errors = (text.decode() for text in process.communicate(timeout=PATIENCE))
    assert (process.returncode, out.strip()) == (0, "goes on 0"), errors
    for name in ("where_it_waits", "waits_for_ever", "waits_in_a_thread"):
        assert f" in {name}\n" in errors


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it is found by Linux's /proc")
def test_a_program_among_python_s_files_is_none_of_python(tmp_path):
    folder = tmp_path / "lib" / "python3" / "site-packages"
    folder.mkdir(parents=True)
    shutil.copy(shutil.which("sleep"), folder / "driver")
    driver = subprocess.Popen([folder / "driver", "1000"])
    python = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        for process in (driver, python):  # it has no words yet when Popen returns
            words = Path(f"/proc/{process.pid}/cmdline")
            until(words.read_bytes, "its words")
        assert python.pid in stacks.below(os.getpid())
        assert driver.pid not in stacks.below(os.getpid())
    finally:
        for process in (driver, python):
            process.kill()
            process.communicate()
