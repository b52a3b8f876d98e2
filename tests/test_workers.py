"""The processes of a bench: their results, and that none outlives it."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from laptop.bench import workers

HERE = Path(__file__).parent.parent


def test_results_come_in_the_order_of_the_cases():
    assert list(workers.results(abs, range(-5, 0), chunk=2)) == [5, 4, 3, 2, 1]


def test_what_a_case_raises_is_heard_of():
    with pytest.raises(TypeError):
        list(workers.results(abs, ["none"]))


def children(pid):
    """Processes that descend from one."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            found += [int(child), *children(child)]
    return found


def alive(pid):
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.short("15")
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads Linux's /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_bench_that_is_stopped_leaves_no_process_behind(number):
    bench = "import time; from laptop.bench import workers; list(workers.results(time.sleep, {}))"
    bench = bench.format("[60] * 9")
    process = subprocess.Popen([sys.executable, "-c", bench], cwd=HERE, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    started = []
    while len(started) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
        started = [pid for pid in children(process.pid) if "spawn_main" in command_of(pid)]
    process.send_signal(number)
    assert process.wait(timeout=60) in (128 + number, -number)
    while any(map(alive, started)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert started
    assert not any(map(alive, started))


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:  # it has just ended
        return ""
