"""Where python-ev3dev2 is not installed, every script that needs it says so in one line."""

import os
import subprocess
import sys

import pytest
from places import ROOT

SCRIPTS = (
    "driver.py line 10,0 5,10",
    "driver.py check",
    "driver.py check --camera 127.0.0.1 --code ABCDEFGHJKMN",
    "driver.py home",
    "driver.py where",
    "driver.py touch",
    "visual_servoing.py 127.0.0.1 --code ABCDEFGHJKMN",
    "bench_brick.py planar",
)


@pytest.mark.parametrize("typed", SCRIPTS)
def test_it_is_said_in_one_line_with_what_to_do(tmp_path, typed):
    script, *words = typed.split()
    done = subprocess.run(
        [sys.executable, "-S", os.path.join("robot", script), *words],
        cwd=str(ROOT),
        env=dict(os.environ, PYTHONPATH=str(ROOT), BRICKSERVO_STATE=str(tmp_path)),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert done.returncode == 1
    (line,) = done.stdout.decode().splitlines()
    assert "there is no python-ev3dev2 here; run this on the brick, or emulated" in line
    assert f"simulate robot/{script}" in line.replace(os.sep, "/")
