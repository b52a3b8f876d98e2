"""The page, measured: whether it matters to tracker and arm how many look, and how late they see.

In real time, with real browsers: the tracker on rendered frames, a client that listens as a brick
does, then the unmodified servo on the emulated brick, judged by the true pose.  The same seeds
without a page are the reference.  A picture cannot be on a page before the camera has taken it and
the tracker has looked at it: that is the limit, the age at the brick.
"""

from __future__ import annotations

import csv
import math
import os
import shutil
import signal
import statistics
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, grouped, seeds_of, spread
from laptop.emulator.brick_home import AFTER
from laptop.emulator.bundled_scripts import SERVO
from laptop.emulator.device.plant_constants import CPU
from laptop.emulator.pace import PacedClock
from laptop.emulator.scene.camera_rig import CameraRig
from laptop.measure.demo.goals import DEMO_SETUPS, Goal, choose_goals, postures_at, servo_args
from laptop.measure.demo.processes import (
    SERVO_TIMEOUT,
    ChildProcess,
    ProcessGroup,
    wait_for_link,
    wait_for_page,
)
from laptop.measure.demo.truth import run_of_goal
from laptop.system import platforms
from robot.clock import Clock
from robot.tracker_address import Memory
from robot.tracking import TrackingClient
from shared.arm_description import Arm, ArmError, find_arm, read_arm
from shared.pairing import read_code
from shared.state import ARM, STATE

FPS = 30.0
WARM_UP_TIME, LISTENING_TIME = 4.0, 10.0
"""A page is left alone, then for so long frames and pictures are counted, s."""
LAUNCH_TIMEOUT = 300_000.0
"""A browser that has not started by then never will, ms."""
SIZE = {"width": 1440, "height": 1000}
"""Size of a browser's window, px."""

COLLECT = """() => {
  window.drawn = [];
  const image = document.querySelector('.picture img');
  image.addEventListener('load', () => {
    const source = image.src;
    requestAnimationFrame(() => requestAnimationFrame(
      () => window.drawn.push([Date.now() / 1000, source])));
  });
}"""
"""Notes when which picture was on the screen: two frames of the screen after it was loaded."""


class NoBrowser(ArmError):
    """There is nothing to look at a page with."""


@dataclass(frozen=True)
class Viewers:
    """Number of open pages; their browser may be frozen while all else goes on."""

    pages: int
    frozen: bool = False

    def __str__(self) -> str:
        return f"{self.pages}, frozen" if self.frozen else str(self.pages)


CASES = (Viewers(0), Viewers(1), Viewers(5), Viewers(1, frozen=True))


@dataclass(frozen=True)
class GoalAttempt:
    """One run of the servo: whether it truly got there, in how many moves and s, px off; why."""

    reached: bool
    moves: int
    seconds: float
    error: float
    words: str


@dataclass(frozen=True)
class PageResult:
    """One seed with so many pages.

    rate     frames per second that came in
    ages     of the frames, from their capture to the brick's side, s
    shown    pictures per second on one page
    behind   of those, from their capture until they were on the screen, s
    runs     per goal
    pace     of the emulated world, in s per s of the wall's clock
    """

    looking: Viewers
    seed: int
    rate: float
    ages: list[float]
    shown: float
    behind: list[float]
    runs: list[GoalAttempt]
    pace: float


@contextmanager
def browser() -> Iterator[Any]:
    """A real one, without a window.

    Raises:
        NoBrowser: playwright or chromium is not installed, or processes cannot be stopped here.
    """
    if not platforms.STOPS_PROCESSES:
        raise NoBrowser(
            "pages are measured on Linux and macOS only: there a process can be stopped"
        )
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        raise NoBrowser("there is no chromium to open the pages; install it, e.g. by apt")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        raise NoBrowser(
            "playwright, which opens the pages, is not installed; write uv run --group browser ..."
        ) from None
    with sync_playwright() as playwright:
        words = ["--no-sandbox"] if platforms.is_root() else []
        made = playwright.chromium.launch(executable_path=found, args=words, timeout=LAUNCH_TIMEOUT)
        yield made
        made.close()


def start_tracker(
    stack: ExitStack, arm: Arm, *words: str, cameras: int = 1
) -> tuple[Path, ProcessGroup, ChildProcess]:
    """Start a tracker with a page, on synthetic cameras, in a folder of its own.

    Args:
        stack: ends it.
        arm: which is seen.
        words: more of what is typed for it; {folder} is the folder.
        cameras: number of them.

    Returns:
        The folder, what starts more processes there, and the tracker.
    """
    folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="brickservo-claims-"))
    crew = ProcessGroup(Path(folder), {STATE: folder, ARM: arm.file})
    stack.callback(crew.close)
    line = ["track", "--json", *["--camera", "synthetic"] * cameras]
    line += ["--listen-port", "127.0.0.1:0", "--page", "--page-port", "0"]
    line += [word.format(folder=folder) for word in words]
    return Path(folder), crew, crew.start("tracker", line)


def run(cases: Sequence[tuple[int, Viewers]]) -> Iterator[PageResult]:
    """Measure, case by case.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails.
    """
    with browser() as made:
        for seed, looking in cases:
            yield _measure(made, seed, looking)


def _measure(made: Any, seed: int, looking: Viewers) -> PageResult:
    arm = read_arm(find_arm("planar"))
    scene, goals = choose_goals(arm, seed)
    rig = CameraRig(arm, scene)
    with ExitStack() as stack:
        words = ["--scene", f"{scene},fps={FPS:g}", "--to", "{folder}/track.csv", "--no-simulate"]
        folder, crew, tracker = start_tracker(stack, arm, *words)
        place, code = wait_for_link(tracker)
        clock = PacedClock(str(folder))
        stack.callback(clock.close)
        began = clock.now(), time.monotonic()
        pages = _open(made, wait_for_page(tracker), looking.pages, stack)
        time.sleep(WARM_UP_TIME)
        with _frozen(made) if looking.frozen else ExitStack():
            if pages and not looking.frozen:
                pages[0].evaluate(COLLECT)
            rate, ages = _listen(place, code)
            ahead = time.time() - clock.now()
            drawn = pages[0].evaluate("window.drawn") if pages and not looking.frozen else []
            runs = []
            start = f"--start={_where_lines_end(rig)}"
            for number, goal in enumerate(goals, 1):
                home = folder / f"goal-{number}"
                words = ["simulate", "--realtime", start, "--arm", arm.file, "--out", str(home)]
                words += [SERVO, place, *servo_args(goal)]
                servo = crew.start(goal.name, [*words, "--log", f"{home}.jsonl"])
                servo.wait(SERVO_TIMEOUT)
                runs.append(_judged(rig, goal, home, servo))
                start = f"--start={AFTER}{home}"
        pace = (clock.now() - began[0]) / (time.monotonic() - began[1])
        crew.close()
        behind = _behind(folder, drawn, ahead)
        return PageResult(
            looking, seed, rate, ages, len(drawn) / LISTENING_TIME, behind, runs, pace
        )


def _open(made: Any, address: str, count: int, stack: ExitStack) -> list[Any]:
    pages: list[Any] = []
    for _ in range(count):
        # The address lets one browser in; the others come by its cookie.
        known = pages[0].context.storage_state() if pages else None
        context = made.new_context(viewport=SIZE, storage_state=known)
        stack.callback(context.close)
        page = context.new_page()
        page.goto(address)
        page.wait_for_selector("[data-marker=effector]", state="attached")
        pages.append(page)
    return pages


@contextmanager
def _frozen(made: Any) -> Iterator[None]:
    """All of the browser's processes stand still meanwhile."""
    told = made.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    numbers = [process["id"] for process in told["processInfo"]]
    try:
        for number in numbers:
            os.kill(number, signal.SIGSTOP)
        yield
    finally:
        for number in numbers:
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGCONT)


def _listen(place: str, code: str) -> tuple[float, list[float]]:
    """Frames per second, and their ages (s), as a brick gets them."""
    host, _, port = place.rpartition(":")
    with tempfile.TemporaryDirectory() as folder:
        memory = Memory(folder)
        clock = Clock()
        client = TrackingClient(
            host, int(port), read_code(code), clock, memory=memory, say=lambda line: None
        )
        try:
            while not client.poll(0.05):
                pass
            ages = []
            began = clock.now()
            while clock.now() - began < LISTENING_TIME:
                for seen in client.poll(0.05).values():
                    ages.append(clock.now() - seen.t)
        finally:
            client.close("measured")
    return len(ages) / LISTENING_TIME, ages


def _behind(folder: Path, drawn: Sequence[tuple[float, str]], ahead: float) -> list[float]:
    """Ages of the pictures when they were on the screen, s.

    Args:
        ahead: by so much the browser's clock is ahead of the frames', s.
    """
    with (folder / "track.csv").open(newline="") as file:
        taken = {row["frame"]: float(row["t"]) for row in csv.DictReader(file)}
    pictures = ((when, source.rpartition("/")[2].partition(".")[0]) for when, source in drawn)
    return [when - ahead - taken[index] for when, index in pictures if index in taken]


def _where_lines_end(rig: CameraRig) -> str:
    """The posture from which all goals are chosen to be in sight, degrees."""
    (posture, *_) = postures_at(rig, DEMO_SETUPS["planar"].end_of_lines)
    return ",".join(f"{math.degrees(angle):.4f}" for angle in posture)


def _judged(rig: CameraRig, goal: Goal, home: Path, servo: ChildProcess) -> GoalAttempt:
    told = run_of_goal(rig, goal, home, servo)
    words = f"{goal.name}: {told.summary}; {told.reason or 'no reason told'}"
    seconds, off = told.seconds or 0.0, told.true_error or 0.0
    return GoalAttempt(told.reached, told.moves, seconds, off, words)


HEADINGS = (
    "pages", "frames/s\nat the brick", "age there, ms\np50/p95", "pictures/s\non a page",
    "behind camera, ms\np50/p95", "goals truly\nreached", "moves\np50/p95", "time s\np50/p95",
    "truly off, px\np50/p95", "pace",
)  # fmt: skip


def table(results: Sequence[PageResult]) -> list[list[str]]:
    """A row for each number of pages."""
    rows = []
    for looking, of_it in grouped(results, lambda result: result.looking).items():
        runs = [one for result in of_it for one in result.runs]
        reached = [one for one in runs if one.reached]
        behind = [1000 * t for result in of_it for t in result.behind]
        seen = looking.pages and not looking.frozen
        rows.append(
            [
                str(looking),
                f"{statistics.mean(result.rate for result in of_it):.1f}",
                _spread([1000 * t for result in of_it for t in result.ages], 0),
                f"{statistics.mean(result.shown for result in of_it):.1f}" if seen else "",
                _spread(behind, 0),
                f"{len(reached)} of {len(runs)}",
                _spread([one.moves for one in reached], 0),
                _spread([one.seconds for one in reached], 1),
                _spread([one.error for one in reached], 1),
                f"{statistics.mean(result.pace for result in of_it):.2f}",
            ]
        )
    return rows


def failures(results: Sequence[PageResult]) -> list[str]:
    """A line for each goal that was not reached, and why."""
    return [
        f"pages {result.looking}, seed {result.seed}, {run.words}"
        for result in results
        for run in result.runs
        if not run.reached
    ]


def _spread(values: Sequence[float], digits: int) -> str:
    return spread(values, digits) if values else ""


def _cases(it: Any) -> list[tuple[int, Viewers]]:
    """Seed by seed, in turn, so that a machine that slows down hits all alike."""
    count = len(CASES)
    return [(seed, CASES[(k + n) % count]) for k, seed in enumerate(it.seeds) for n in range(count)]


def _shown(results: Sequence[PageResult], it: Any) -> Iterator[BenchTable | str]:
    title = (
        f"{seeds_of(it)}, cpu={CPU:g}; camera, brick and browsers on one machine, "
        f"{os.cpu_count()} cores; figures from the emulator, in real time"
    )
    yield BenchTable(title, HEADINGS, table(results))
    yield from failures(results)


BENCH = BenchRecord("looking", _cases, None, _shown, in_turn=run)
