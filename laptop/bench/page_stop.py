"""STOP on the page, measured: from the press in a real browser until the true arm stands still.

Tracker, page, browser and emulated brick run in real time.  A run is ordered on the page; in the
middle of a motion STOP is pressed.  The true pose tells when the arm stands.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.bench.page import browser
from laptop.bench.page_rig import (
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
from shared.arm_description import ArmError

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
    for load in dict.fromkeys(one.load for one in results):
        of_it = [one for one in results if one.load == load]
        wall, world = [one.seconds for one in of_it], [one.world for one in of_it]
        rows.append([str(load), str(len(of_it)), _spread(wall), _spread(world)])
    return rows


def _spread(values: list[float]) -> str:
    half, most = np.percentile(values, (50, 95), method="higher")
    return f"{half:.3f}/{most:.3f}/{max(values):.3f}"
