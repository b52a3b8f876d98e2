"""The processes of a bench: their results, and that none outlives it."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT
from waiting import PATIENCE, until

from laptop.bench import workers


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


@pytest.mark.short("SIGTERM")
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads Linux's /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda n: n.name)
def test_a_bench_that_is_stopped_leaves_no_process_behind(number):
    # (Who runs the tests in a shell's background has all their processes ignore SIGINT.)
    bench = "import signal, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
    bench += "from laptop.bench import workers; list(workers.results(time.sleep, [60] * 9))"
    process = subprocess.Popen([sys.executable, "-c", bench], cwd=ROOT, stderr=subprocess.DEVNULL)
    started = until(lambda: two_workers_of(process.pid), "two workers")
    process.send_signal(number)
    assert process.wait(timeout=PATIENCE) in (128 + number, -number)
    until(lambda: not any(map(alive, started)), "the end of the workers")


def two_workers_of(pid):
    """The bench's processes, as soon as there are two or more."""
    found = [child for child in children(pid) if "spawn_main" in command_of(child)]
    return found if len(found) > 1 else []


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:  # it has just ended
        return ""
