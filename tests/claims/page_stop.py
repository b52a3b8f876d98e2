"""STOP on the page, measured: from the press in a real browser until the true arm stands still.

Tracker, page, browser and emulated brick run in real time.  A run is ordered on the page; in the
middle of a motion STOP is pressed.  The true pose tells when the arm stands.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from laptop.bench.bench import BadBench, BenchRecord, BenchTable, grouped, spread
from shared.arm_description import ArmError
from tests.claims.page import browser
from tests.claims.page_rig import (
    NOTE_PRESS,
    ArmSample,
    ArmWatch,
    aim_and_start,
    page_rig,
    point_at_stop,
    press_stop,
    standing,
    wait_for_motion,
)

SETTLING_TIME = 1.5
"""It is looked at for so long after a press, s."""


@dataclass(frozen=True)
class StopTime:
    """One press.

    load     number of busy processes beside it
    seconds  from the press to standstill, s on the wall's clock
    world    the same, s on the clock of the emulated world, which waits for whoever is late
    """

    load: int
    seconds: float
    world: float


def run(count: int, load: int) -> Iterator[StopTime]:
    """Press STOP so many times, with so many busy processes.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails, or the arm does not move.
    """
    with browser() as made, page_rig() as rig:
        page = rig.open(made, NOTE_PRESS)
        with _busy(load):
            done = 0
            for attempt in range(10 * count):
                if done == count:
                    break
                goal = rig.goals[attempt % len(rig.goals)]
                if (pressed := _press(page, rig.watch, goal, load)) is not None:
                    done += 1
                    yield pressed
        if done < count:
            raise ArmError(f"STOP was pressed in the middle of {done} motions, not {count}")


def _press(page: Any, watch: ArmWatch, goal: tuple[float, float], load: int) -> StopTime | None:
    """Order a run and stop it; None if the arm did not move, or had come to rest by then."""
    aim_and_start(page, goal)
    point_at_stop(page)
    if not wait_for_motion(page, watch):
        return None
    pressed = press_stop(page)
    page.wait_for_timeout(1000 * SETTLING_TIME)
    return standstill(list(watch.poses), pressed, load)


def standstill(poses: Sequence[ArmSample], pressed: float, load: int) -> StopTime | None:
    """Return how long after a press (s) the arm stood; None if it stood then already.

    Args:
        poses: as ArmWatch has them.
        pressed: s on the wall's clock.
        load: number of busy processes.
    """
    stood = standing(poses, pressed)
    return stood and StopTime(load, *stood)


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """So many processes do nothing but compute meanwhile."""
    made = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in made:
            process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(5)


HEADINGS = (
    "busy processes", "presses", "to standstill, s\np50/p95/at most",
    "on the emulated clock, s\np50/p95/at most",
)  # fmt: skip


def table(results: list[StopTime]) -> list[list[str]]:
    """A row for each load."""
    rows = []
    for load, group in grouped(results, lambda one: one.load).items():
        wall, world = [one.seconds for one in group], [one.world for one in group]
        figures = (spread(times, 3, 50, 95, 100) for times in (wall, world))
        rows.append([str(load), str(len(group)), *figures])
    return rows


def _cases(it: Any) -> list[int]:
    try:
        return [int(load) for load in it.busy.split(",") for _ in range(it.count)]
    except ValueError:
        raise BadBench(f"busy '{it.busy}': write whole numbers, e.g. 0,8") from None


def _in_turn(loads: Sequence[int]) -> Iterator[StopTime]:
    for load, group in grouped(loads, lambda load: load).items():
        yield from run(len(group), load)


BENCH = BenchRecord(
    "stopping",
    _cases,
    None,
    lambda results, it: [
        BenchTable(
            f"STOP on the page; camera, brick and browser on one machine, {os.cpu_count()} cores; "
            "figures from the emulator, in real time",
            HEADINGS,
            table(results),
        )
    ],
    in_turn=_in_turn,
)
