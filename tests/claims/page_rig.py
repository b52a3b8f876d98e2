"""Tracker, page, browsers and emulated brick in real time, for what is measured in mid-motion.

A run is ordered on the page, as people do it.  The true pose tells when the arm moves and stands.
"""

from __future__ import annotations

import math
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

import numpy as np

from laptop.emulator.bundled_scripts import SERVO
from laptop.emulator.live import PoseReader
from laptop.emulator.pace import PacedClock
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.demo.processes import wait_for_link, wait_for_page
from shared.arm_description import find_arm, read_arm
from tests.claims.page import FPS, SIZE, start_tracker

SAMPLE_PERIOD = 0.004
"""Between two looks at the true pose, s."""
MOVES = math.radians(10)
"""Speed of a joint that is in the middle of a motion, rad/s."""
STANDS = math.radians(0.3)
"""An arm stands once no joint is farther than this from where it ends, rad."""
PATIENCE = 60.0
"""What has not come after so long, s, never does."""
MOTION_TIMEOUT = 15.0
"""An arm that does not move by then, s, is ordered anew: a busy page refuses late orders."""
POSTURES = ((0.9, 0.5), (-0.7, -0.6))
"""Those whose tips are the goals, in turn, rad: far from each other."""

NOTE_PRESS = """addEventListener("pointerdown",
  () => sessionStorage.pressed = (performance.timeOrigin + performance.now()) / 1000, true)"""
"""Notes in the browser when a button is pressed, before anything is done about it."""


class ArmSample(NamedTuple):
    """The true arm at a time: s on the wall's clock and on the emulated world's; joints, rad."""

    t: float
    world: float
    q: tuple[float, ...]


class ArmWatch:
    """Looks at the true arm all the time.

    Attributes:
        poses: the newest last.
    """

    def __init__(self, state: str) -> None:
        self.poses: list[ArmSample] = []
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, args=(state,), daemon=True)
        self._thread.start()

    def _look(self, state: str) -> None:
        clock, reader = PacedClock(state), PoseReader(state)
        while not self._over.wait(SAMPLE_PERIOD):
            reader.poll()
            now = clock.now()
            if pose := reader.at(now):
                self.poses.append(ArmSample(time.time(), now, tuple(pose.q)))
        reader.close()
        clock.close()

    def close(self) -> None:
        """Look no longer."""
        self._over.set()
        self._thread.join()

    def speed(self) -> float:
        """Speed of the fastest joint over the last samples, rad/s; 0 while there are none."""
        if len(self.poses) < 10:
            return 0.0
        (t0, _, q0), (t1, _, q1) = self.poses[-10], self.poses[-1]
        return max(abs(b - a) for a, b in zip(q0, q1, strict=True)) / max(t1 - t0, SAMPLE_PERIOD)


def standing(poses: Sequence[ArmSample], since: float) -> tuple[float, float] | None:
    """Return how long after a time the arm stood: s on the wall's clock, and on the world's.

    None if it stood then already.

    Args:
        poses: as ArmWatch has them.
        since: s on the wall's clock.
    """
    after = [pose for pose in poses if pose.t >= since]
    end = after[-1].q
    moving = [k for k, one in enumerate(after) if max(map(abs, np.subtract(one.q, end))) > STANDS]
    if not moving:
        return None
    stood = after[min(moving[-1] + 1, len(after) - 1)]
    return stood.t - since, stood.world - after[0].world


class PageRig:
    """Tracker and brick in a folder of their own, from which all of it is ended.

    Args:
        stack: ends it.

    Attributes:
        tracker, brick: their processes.
        watch: of the true arm.
        goals: (u, v) px, to be aimed at in turn.
    """

    def __init__(self, stack: ExitStack) -> None:
        arm = read_arm(find_arm("planar"))
        scene = Scene(arm, read_scene(""))
        self.goals = [scene.truth(posture)["effector"] for posture in POSTURES]
        words = ["--scene", f"fps={FPS:g}", "--no-simulate"]
        folder, crew, self.tracker = start_tracker(stack, arm, *words)
        place, _ = wait_for_link(self.tracker)
        words = ["simulate", "--realtime", "--timeout", "1e6", "--arm", arm.file]
        words += ["--out", str(folder / "brick")]
        self.brick = crew.start("brick", [*words, SERVO, place, "--wait"])
        self._addresses = self._new_addresses()
        self.watch = ArmWatch(str(folder))
        stack.callback(self.watch.close)

    def open(self, made: Any, script: str = "", **options: Any) -> Any:
        """Open the page in a browser as somebody new; return playwright's page.

        Args:
            made: the browser.
            script: runs in the page before anything of its own.
            options: of playwright's context.
        """
        context = made.new_context(viewport=SIZE, **options)
        page = context.new_page()
        page.set_default_timeout(1000 * PATIENCE)
        if script:
            page.add_init_script(script)
        page.goto(next(self._addresses))
        page.wait_for_selector("[data-marker=effector]", state="attached")
        return page

    def _new_addresses(self) -> Iterator[str]:
        """Yield addresses: each lets one browser in, then the tracker tells another."""
        address = wait_for_page(self.tracker)
        while True:
            yield (used := address)
            deadline = time.monotonic() + PATIENCE
            while address == used:
                if time.monotonic() > deadline:
                    raise self.tracker.hangs(PATIENCE)
                time.sleep(0.05)
                address = [event["url"] for event in list(self.tracker.events) if "url" in event][
                    -1
                ]


def start_button(page: Any) -> Any:
    """Return the button that orders a run, which is found while one can be ordered."""
    return page.locator(".go:enabled", has_text="Start")


def on_page(picture: Any, u: float, v: float) -> tuple[float, float]:
    """Return where a pixel of a picture of 640 x 480 is on the page, px."""
    box = picture.bounding_box()
    return box["x"] + (u + 0.5) * box["width"] / 640, box["y"] + (v + 0.5) * box["height"] / 480


def aim_and_start(page: Any, goal: tuple[float, float]) -> None:
    """Order a run to a goal, (u, v) px, with the mouse."""
    start_button(page).wait_for()
    where = on_page(page.locator(".picture img"), *goal)
    aim = page.locator("[data-aim]")
    deadline = time.monotonic() + PATIENCE
    page.mouse.click(*where)
    while not aim.count() and time.monotonic() < deadline:
        page.wait_for_timeout(1000)
        if not aim.count():
            page.mouse.click(*where)  # a busy page has refused it as late
    page.get_by_role("button", name="Start").click()


def point_at_stop(page: Any) -> None:
    """Move the mouse on STOP."""
    button = page.locator(".stop").bounding_box()
    page.mouse.move(button["x"] + button["width"] / 2, button["y"] + button["height"] / 2)


def press_stop(page: Any) -> float:
    """Press STOP, on which the mouse is; return when it was pressed, s on the wall's clock.

    Args:
        page: has NOTE_PRESS.
    """
    page.mouse.down()
    page.mouse.up()
    return float(page.evaluate("sessionStorage.pressed"))


def wait_for_motion(page: Any, watch: ArmWatch) -> bool:
    """Wait until the arm is in the middle of a motion; False if it does not move."""
    deadline = time.monotonic() + MOTION_TIMEOUT
    while watch.speed() < MOVES:
        page.wait_for_timeout(5)
        if time.monotonic() > deadline:
            return False
    return True


@contextmanager
def page_rig() -> Iterator[PageRig]:
    """Provide a rig.

    Raises:
        ArmError: a program fails.
    """
    with ExitStack() as stack:
        yield PageRig(stack)


def page_processes(tracker: int) -> list[int]:
    """Return the processes of a tracker's page: nicer than it, and not started by itself.

    Args:
        tracker: number of its process.
    """
    rows = subprocess.run(["ps", "-eo", "pid=,ppid=,ni="], capture_output=True, text=True)
    words = [line.split() for line in rows.stdout.splitlines()]
    # (What is scheduled otherwise has "-" for its niceness.)
    listed = [[int(word) for word in row] for row in words if row[2].lstrip("-").isdigit()]
    own = next((nice for pid, _, nice in listed if pid == tracker), 0)
    children = {pid for pid, parent, _ in listed if parent == tracker}
    return [pid for pid, parent, nice in listed if parent in children and nice > own]
