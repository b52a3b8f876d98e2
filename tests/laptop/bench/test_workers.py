"""The processes of a bench: their results, and that none outlives it; and those of a cluster."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from places import ROOT
from waiting import PATIENCE, until

from laptop.bench import draw, workers
from laptop.cli import main
from laptop.cli.main import laptop


def test_results_come_in_the_order_of_the_cases():
    assert list(workers.map_cases(abs, range(-5, 0), chunk=2)) == [5, 4, 3, 2, 1]


def test_what_a_case_raises_is_heard_of():
    with pytest.raises(TypeError):
        list(workers.map_cases(abs, ["none"]))


@pytest.mark.parametrize("chunk", [1, 2])
def test_any_executor_does_the_work_one_case_at_a_time(chunk):
    busy = threading.Lock()

    def alone(case):
        assert busy.acquire(blocking=False)
        time.sleep(0.001 * (7 - case))
        busy.release()
        return -case

    with ThreadPoolExecutor(3) as executor:
        found = list(workers.map_cases(alone, range(7), chunk, executor))
    assert found == [0, -1, -2, -3, -4, -5, -6]


def test_what_nobody_waits_for_any_more_is_not_begun():
    begun, go_on = [], threading.Event()

    def work(case):
        begun.append(case)
        assert case == 0 or go_on.wait(PATIENCE)

    with ThreadPoolExecutor(1) as executor:
        results = workers.map_cases(work, range(9), executor=executor)
        next(results)
        results.close()
        go_on.set()
    assert begun in ([0], [0, 1])


SERVO = ("bench", "servo", "--seeds", "1000:1001", "--arm", "planar", "--method", "chain")


def test_a_worker_that_is_killed_is_told_in_a_line(monkeypatch, capsys):
    lost = "a process of this bench was ended from outside, perhaps for want of memory; free some"
    killed = replace(draw.BENCH, in_turn=lambda todo: workers.map_cases(os._exit, [9]))
    monkeypatch.setattr(draw, "BENCH", killed)
    monkeypatch.setattr(sys, "argv", ["laptop", "bench", "draw", "--seeds", "1000:1001"])
    assert main.main() == 1
    assert capsys.readouterr().err.strip().startswith("laptop: " + lost)


@pytest.fixture
def ctrl_c():
    """Ctrl-C is obeyed: where the tests were started in the background it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_work_is_handed_out_waits_until_the_pool_has_started(number, ctrl_c):
    """A pool that is stopped in mid-start fails as it is ended, by another error."""
    whole = []

    class Interrupted(ThreadPoolExecutor):
        def submit(self, *args):
            signal.raise_signal(number)
            whole.append(args)
            return super().submit(*args)

    with Interrupted(1) as executor, pytest.raises((KeyboardInterrupt, SystemExit)):
        list(workers.map_cases(abs, [1, 2], executor=executor))
    assert len(whole) == 2


def test_without_distributed_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = CliRunner().invoke(laptop, [*SERVO, "--cluster", "tcp://127.0.0.1:8786"])
    assert done.exit_code == 1
    assert "distributed is not installed; write uv run --group cluster ..." in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense"])
def test_an_address_where_nobody_answers_is_told_in_a_line(monkeypatch, address):
    pytest.importorskip("distributed", reason="Dask's distributed is not installed")
    monkeypatch.setattr(workers, "ANSWER_TIMEOUT", 0.5)
    done = CliRunner().invoke(laptop, [*SERVO, "--cluster", address])
    assert done.exit_code == 1
    assert f"no scheduler answers at {address}; start one" in done.stderr


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_cluster_gives_the_results_of_this_machine(monkeypatch):
    distributed = pytest.importorskip("distributed", reason="Dask's distributed is not installed")
    monkeypatch.setattr(workers, "ANSWER_TIMEOUT", 1.0)
    cluster = distributed.LocalCluster(
        n_workers=0, processes=False, protocol="tcp://", dashboard_address=None
    )
    words = [*SERVO, "--json", "--cluster", cluster.scheduler_address]
    with cluster:
        none = CliRunner().invoke(laptop, words)
        assert none.exit_code == 1
        assert "has no worker; start some in the checkout" in none.stderr
        cluster.scale(1)
        cluster.wait_for_workers(1, PATIENCE)
        shared = CliRunner().invoke(laptop, words)
    assert shared.exit_code == 0, shared.output
    here = CliRunner().invoke(laptop, words[:-2])
    assert json.loads(shared.stdout) == json.loads(here.stdout)


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
@pytest.mark.skipif(
    not Path("/proc/self/task").exists(),
    reason="only Linux tells a process's children",
)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda n: n.name)
def test_a_bench_that_is_stopped_leaves_no_process_behind(number):
    # (Who runs the tests in a shell's background has all their processes ignore SIGINT.)
    bench = "import signal, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
    bench += "from laptop.bench import workers; list(workers.map_cases(time.sleep, [60] * 9))"
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
