"""STOP on the page, measured: from the press in a real browser until the true arm stands still.

Tracker, page, browser and emulated brick run in real time.  A run is ordered on the page; in the
middle of a motion STOP is pressed.  The true pose tells when the arm stands.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.bench.page import FPS, SIZE, browser
from laptop.demo.processes import SERVO, ProcessGroup, wait_for_link, wait_for_page
from laptop.simulator.host.pace import PacedClock
from laptop.simulator.live import PoseReader
from laptop.simulator.scene.scene import Scene
from laptop.simulator.scene.scene_constants import read_scene
from shared.arm_description import ArmError, find_arm, read_arm
from shared.state import ARM, STATE

SAMPLE_PERIOD = 0.004
"""Between two looks at the true pose, s."""
MOVES = math.radians(10)
"""Speed of a joint at which STOP is pressed, rad/s: in the middle of a motion."""
STANDS = math.radians(0.3)
"""An arm stands once no joint is farther than this from where it ends, rad."""
SETTLING_TIME = 1.5
"""It is looked at for so long after a press, s."""
PATIENCE = 60.0
"""What has not come after so long, s, never does."""
MOTION_TIMEOUT = 15.0
"""An arm that does not move by then, s, is ordered anew: a busy page refuses late orders."""
GOALS = ((0.9, 0.5), (-0.7, -0.6))
"""Postures whose tips are the goals, in turn, rad: far from each other."""

NOTE_PRESS = """() => addEventListener("pointerdown",
  () => { window.pressed = (performance.timeOrigin + performance.now()) / 1000; }, true)"""
"""Notes when a button is pressed, before anything is done about it."""


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


class _Watch:
    """Looks at the true arm all the time.

    Attributes:
        poses: (s on the wall's clock, s on the world's clock, joints rad), the newest last.
    """

    def __init__(self, state: str) -> None:
        self.poses: list[tuple[float, float, tuple[float, ...]]] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, args=(state,), daemon=True)
        self._thread.start()

    def _look(self, state: str) -> None:
        clock, reader = PacedClock(state), PoseReader(state)
        while not self._over.wait(SAMPLE_PERIOD):
            reader.poll()
            now = clock.now()
            if pose := reader.at(now):
                self.poses.append((time.time(), now, tuple(pose.q)))
        reader.close()
        clock.close()

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def speed(self) -> float:
        """Speed of the fastest joint over the last samples, rad/s; 0 while there are none."""
        if len(self.poses) < 10:
            return 0.0
        (t0, _, q0), (t1, _, q1) = self.poses[-10], self.poses[-1]
        return max(abs(b - a) for a, b in zip(q0, q1, strict=True)) / max(t1 - t0, SAMPLE_PERIOD)


def run(count: int, load: int) -> Iterator[StopTime]:
    """Press STOP so many times, with so many busy processes.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails, or the arm does not move.
    """
    arm = read_arm(find_arm("planar"))
    scene = Scene(arm, read_scene(""))
    goals = [scene.truth(posture)["effector"] for posture in GOALS]
    with ExitStack() as stack:
        made = stack.enter_context(browser())
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="brickservo-bench-"))
        crew = ProcessGroup(Path(folder), {STATE: folder, ARM: arm.file})
        stack.callback(crew.close)
        tracker = crew.start(
            "tracker",
            ["track", "--announce", "--camera", "synthetic", "--scene", f"fps={FPS:g}"]
            + ["--host", "127.0.0.1", "--port", "0", "--page", "--page-port", "0", "--no-brick"],
        )
        place, code = wait_for_link(tracker)
        words = ["simulate", "--realtime", "--timeout", "1e6", "--arm", arm.file]
        crew.start("brick", [*words, str(SERVO), place, "--code", code, "--wait"])
        page = made.new_context(viewport=SIZE).new_page()
        page.set_default_timeout(1000 * PATIENCE)
        page.goto(wait_for_page(tracker))
        page.wait_for_selector("[data-marker=effector]", state="attached")
        page.evaluate(NOTE_PRESS)
        watch = _Watch(folder)
        stack.callback(watch.close)
        with _busy(load):
            done = 0
            for attempt in range(10 * count):
                if done == count:
                    break
                if (pressed := _press(page, watch, goals[attempt % 2], load)) is not None:
                    done += 1
                    yield pressed
        if done < count:
            raise ArmError(f"STOP was pressed in the middle of {done} motions, not {count}")


def _press(page: Any, watch: _Watch, goal: tuple[float, float], load: int) -> StopTime | None:
    """Order a run and stop it; None if the arm did not move, or had come to rest by then."""
    page.wait_for_function(
        "() => [...document.querySelectorAll('.go')].some(b => b.innerText.includes('START') "
        "&& !b.disabled)"
    )
    box = page.locator(".picture img").bounding_box()
    page.mouse.click(
        box["x"] + (goal[0] + 0.5) * box["width"] / 640,
        box["y"] + (goal[1] + 0.5) * box["height"] / 480,
    )
    page.locator("[data-aim]").wait_for(state="attached")
    page.get_by_role("button", name="Start").click()
    button = page.locator(".stop").bounding_box()
    page.mouse.move(button["x"] + button["width"] / 2, button["y"] + button["height"] / 2)
    deadline = time.monotonic() + MOTION_TIMEOUT
    while watch.speed() < MOVES:
        page.wait_for_timeout(5)
        if time.monotonic() > deadline:
            return None
    page.mouse.down()
    page.mouse.up()
    page.wait_for_timeout(1000 * SETTLING_TIME)
    return standstill(list(watch.poses), page.evaluate("window.pressed"), load)


def standstill(
    poses: list[tuple[float, float, tuple[float, ...]]], pressed: float, load: int
) -> StopTime | None:
    """Return how long after a press (s) the arm stood; None if it stood then already.

    Args:
        poses: as _Watch has them.
        pressed: s on the wall's clock.
        load: number of busy processes.
    """
    after = [(t, world, q) for t, world, q in poses if t >= pressed]
    end = after[-1][2]
    moving = [k for k, (_, _, q) in enumerate(after) if max(map(abs, np.subtract(q, end))) > STANDS]
    if not moving:
        return None
    stood, world, _ = after[min(moving[-1] + 1, len(after) - 1)]
    return StopTime(load, stood - pressed, world - after[0][1])


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
