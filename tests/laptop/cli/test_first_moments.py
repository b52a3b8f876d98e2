"""A command while it still imports: Ctrl-C ends it at once, and silently; how numpy computes."""

import os
import signal
import subprocess
import sys

import pytest
from places import ROOT

LAPTOP = ["-m", "laptop"]
SLOW = "print('importing', flush=True)\nimport time\ntime.sleep(60)\n"


@pytest.mark.short("click--m laptop --help", "contextlib-robot/driver.py inverse 10,5")
@pytest.mark.parametrize(
    ("module", "args"),
    [
        ("click", [*LAPTOP, "--help"]),
        ("numpy", [*LAPTOP, "simulate", "--out", "{out}", "robot/driver.py", "where"]),
        ("cv2", [*LAPTOP, "track", "--camera", "synthetic"]),
        ("cv2", [*LAPTOP, "demo", "--out", "{out}"]),
        ("numpy", [*LAPTOP, "bench", "servo"]),
        ("numpy", [*LAPTOP, "bench", "draw"]),
        ("contextlib", ["robot/driver.py", "inverse", "10,5"]),
        ("contextlib", ["robot/visual_servoing.py"]),
        ("contextlib", ["robot/tracking_client.py"]),
        ("contextlib", ["robot/bench_brick.py"]),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value[:3]),
)
def test_ctrl_c_while_importing_is_silent(tmp_path, module, args):
    slow = tmp_path / "modules"
    slow.mkdir()
    (slow / f"{module}.py").write_text(SLOW)
    process = subprocess.Popen(
        [sys.executable, *(word.format(out=tmp_path / "out") for word in args)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(slow), "BRICKSERVO_STATE": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "importing\n"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert (out, err) == ("", "")
    assert process.returncode == -signal.SIGINT  # which a shell has as 130


@pytest.mark.parametrize(("own", "there"), [(None, "1"), ("4", "4")])
def test_linear_algebra_takes_one_thread_unless_somebody_wants_more(tmp_path, own, there):
    (tmp_path / "numpy.py").write_text(
        "import os\nprint(os.environ['OPENBLAS_NUM_THREADS'], flush=True)\nos._exit(0)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "BRICKSERVO_STATE": str(tmp_path)}
    environment.pop("OPENBLAS_NUM_THREADS", None)
    if own:
        environment["OPENBLAS_NUM_THREADS"] = own
    done = subprocess.run(
        [sys.executable, *LAPTOP, "bench", "servo"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == (there + "\n", "")
