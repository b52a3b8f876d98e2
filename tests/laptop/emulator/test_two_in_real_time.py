"""Two emulated programs in real time want the one arm that the cameras see."""

import os
import signal
import subprocess
import sys

import pytest
from places import ROBOT, ROOT
from refusals import in_one_line
from run_json import run_in
from waiting import PATIENCE


def simulated(out, *args):
    return [sys.executable, "-m", "laptop", "simulate", "--realtime", "--no-picture", "--out",
            str(out), str(ROBOT / "driver.py"), *args]  # fmt: skip


LONG = ("--speed", "0.1", "polyline", "10,0", "5,10", "10,0", "5,10")
"""Takes five minutes: whatever this computer has to do meanwhile, it does not end by itself."""


@pytest.mark.long
@pytest.mark.parametrize("end", ["taken over", "killed"])
def test_in_real_time_two_programs_share_one_brick(tmp_path, end):
    environment = {**os.environ, "BRICKSERVO_STATE": str(tmp_path), "PYTHONUNBUFFERED": "1"}

    def run(*args):
        return subprocess.run(
            simulated(tmp_path / "second", *args),
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )

    first = subprocess.Popen(
        simulated(tmp_path / "first", *LONG), cwd=ROOT, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert first.stdout.readline().startswith("drawing 1 of 1")
        refused = run("home")
        assert refused.returncode == 1
        assert in_one_line(refused.stderr, f"driver.py: driver.py (process {first.pid},", "--take")
        assert run("where").returncode == 0
        assert first.poll() is None
        if end == "killed":
            first.kill()
            first.wait(PATIENCE)
            taken = run("move", "12,6")
        else:
            taken = run("--take", "move", "12,6")
        assert taken.returncode == 0, taken.stderr
        out, err = first.communicate(timeout=PATIENCE)
    finally:
        first.kill()
        first.communicate(timeout=PATIENCE)
    if end == "taken over":
        assert f"asking driver.py (process {first.pid}," in taken.stdout
        assert first.returncode == 128 + signal.SIGTERM
        assert "stopped by SIGTERM" in err
        summary = run_in(tmp_path / "first")
        assert not any(motor["driven"] for motor in summary["motors"].values())
