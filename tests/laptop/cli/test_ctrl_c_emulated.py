"""Ctrl-C while the emulated brick works: a command says that it was stopped, and writes nothing."""

import os

import pytest
from own_python import python

PROGRAM = """
import os, signal
from laptop.cli import start as program
from laptop.emulator.rig import Rig

signal.signal(signal.SIGINT, signal.SIG_DFL)  # (a shell's background would have it ignored)
run, send = Rig.run, os.killpg

def interrupted(*args, **options):
    # By the clock of the brick: what the script does then is the same on every computer.
    ctrl_c = (float(os.environ["AT"]), lambda: send(os.getpgrp(), signal.SIGINT))
    return run(*args, **options, meanwhile=[ctrl_c])

Rig.run = interrupted
program.run()
"""
CALIBRATE = ("measure", "arm", "--simulate")
DRAW = ("draw", "--line", "10,0 5,10", "--trials", "3", "--simulate")
TOUCH = ("measure", "pen", "--simulate")
ACCURACY = ("measure", "accuracy", "--simulate", "--cycles", "3")
IMPORTING, AT_WORK = 0.3, 6.0
"""Times of the brick's, s: its program lets signals end it, or it has the arm move or be led."""


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="there are no groups of processes")
@pytest.mark.parametrize("at", [IMPORTING, AT_WORK], ids=["importing", "at work"])
@pytest.mark.parametrize("words", [CALIBRATE, DRAW, TOUCH, ACCURACY], ids=lambda words: words[0])
def test_ctrl_c_on_an_emulated_brick_is_told_in_one_line(tmp_path, words, at):
    env = {**os.environ, "BRICKSERVO_STATE": str(tmp_path / "state"), "AT": str(at)}
    words = *words, "--out", tmp_path / "out"
    done = python("-c", PROGRAM, *words, env=env, start_new_session=True)
    assert done.stderr.strip() == "laptop: stopped"
    assert done.returncode == 130
    files = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert files == []
