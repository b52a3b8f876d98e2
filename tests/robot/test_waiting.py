"""`visual_servoing.py --wait` does all that the laptop orders, run after run, and does not grow."""

import gc
import os
import signal
import threading

import pytest
from servo_rig import PROGRAM

from laptop.emulator.device.motion_record import MotionRecord
from laptop.emulator.host.runner import run_script
from shared.messages import Start

GOALS = ({"A": (400.0, 200.0)}, {"A": (330.0, 150.0)}, {})
KILL, PID = os.kill, os.getpid()  # a program on the emulated brick has its own


class Orders:
    """A laptop that orders one run after the other, and ends the program after the last.

    Attributes:
        verdicts: of the runs, in order.
        figures: after each run: objects of the program's classes, descriptors, threads, files.
    """

    def __init__(self, w, runs):
        self._w, self._runs = w, runs
        self.verdicts, self.figures = [], []
        w.world.at(1.0, self._look)

    def _look(self):
        w = self._w
        status = w.tracker.server.state().status
        done = len(self.verdicts)
        if status is not None and status.verdict and status.run > done:
            self.verdicts.append(status.verdict)
            self.figures.append(self._count())
            done += 1
        if done == self._runs:
            KILL(PID, signal.SIGTERM)
            return
        if status is not None and status.verdict and status.run == done:
            w.tracker.server.send(Start(goals=GOALS[done % len(GOALS)]))
        w.world.at(w.world.t + 0.2, self._look)

    def _count(self):
        w = self._w
        # What the emulator and the test themselves record.
        w.brick.record = MotionRecord(lambda number: 0.0)
        del w.moments[:-10], w.statuses[:-1], w.writes[:]
        gc.collect()
        tops = [str(type(one).__module__).partition(".")[0] for one in gc.get_objects()]
        return {
            "objects": len(tops),
            "of the program": tops.count("robot") + tops.count("shared"),
            "descriptors": len(os.listdir("/dev/fd")),
            "threads": threading.active_count(),
            "files": len(os.listdir(w.state_folder)),
        }


def obeyed(w, runs, tmp_path):
    """The Orders of so many runs, all obeyed by one program."""
    orders = Orders(w, runs)
    log = str(tmp_path / "log.jsonl")
    outcome = run_script(w.brick, PROGRAM, ["--wait", "--log", log], timeout=1e5)
    assert (outcome.status, outcome.reason) == (143, "ended")
    assert orders.verdicts == ["converged"] * runs
    assert not w.brick.driven()
    return orders


@pytest.mark.long
def test_it_does_one_run_after_the_other_as_ordered(watched, tmp_path, capsys):
    w = watched(plant="cpu=0")
    obeyed(w, 3, tmp_path)
    lines = capsys.readouterr().out.splitlines()
    assert lines.count("waiting for the laptop to say start") == 1
    assert sum(line.startswith("converged") for line in lines) == 3
    assert w.on_file()["parked"], "each run ends with the arm parked"


@pytest.mark.long
def test_it_does_not_grow(watched, tmp_path):
    """Nor does it in 720 runs; these are as many as tell a leak of one object in each."""
    first, last = 10, 60
    figures = obeyed(watched(plant="cpu=0"), last, tmp_path).figures
    for key in figures[0]:
        grown = figures[last - 1][key] - figures[first - 1][key]
        assert grown < (last - first) / 2, (key, [each[key] for each in figures])
