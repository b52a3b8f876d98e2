"""`python -m laptop demo`: everything at once, on this machine alone, and whether it truly worked.

Separate processes in real time: the tracker on rendered frames, and one after the other the
unmodified programs of the brick, which reach it by TCP on loopback.  First the driver draws its
lines, then the servo brings the tip to three goals, each from where the arm was left.  Beside it
the method of the report goes to the first goal, in virtual time.

What the brick claims decides nothing: every goal is judged by the true pose of the emulated arm.
"""

from __future__ import annotations

import csv
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from laptop import report
from laptop.simulator.clocks import UPTIME
from laptop.simulator.scene import Scene, read_scene
from shared.arm_description import Arm, ArmError, find_arm, read_arm

LAPTOP = (sys.executable, "-m", "laptop")
ROOT = Path(__file__).resolve().parent.parent
DRIVER = ROOT / "robot" / "driver.py"
SERVO = ROOT / "robot" / "visual_servoing.py"

GOALS = 3
TOLERANCE = 5.0
"""What the servo stops at if nothing is said, px."""
REPORT_BUDGET = 180.0
"""What the report's method may take, virtual s."""

READY, DRAWN, SERVOED, ENDED = 30.0, 120.0, 90.0, 10.0
"""Deadlines, s: for the tracker to listen, for the lines, for one goal, for what is told to end."""
COMPARED = 80.0
"""So long after the beginning of the demo nobody waits for the comparison any more, s."""

APART = 150.0
"""Least distance of a goal from the others, and from where the driver leaves the tip, px."""
DIFFERENT = 0.7
"""Least distance between the goals' postures, rad."""
MARGIN = 45.0
"""Of goals from the picture's edge, px."""
SHARE = 0.85
"""Of the joint limits that postures are drawn from."""
ROUND = 5.0
"""Greatest condition number of the true image Jacobian at a goal: no singular posture is near."""
PLAIN = 0.99
"""What can be seen of a marker that nothing hides."""
LAST_POINT = (0.0, 15.0)
"""Where the driver's lines end, cm."""
TRIES = 300
NEWTON = 12
"""Iterations."""


class DemoFailed(ArmError):
    """A program of the demo that fails or hangs."""


@dataclass(frozen=True)
class Orders:
    """What is to be shown.

    out    a folder with the time as its name is made in it
    arm    name or file
    seed   draws camera, table and goals
    servo  the program that servoes
    """

    out: Path
    arm: str = "planar"
    seed: int = 0
    servo: Path = SERVO


# The scene and the goals


Vector = tuple[float, ...]


class Goal(NamedTuple):
    """Where the tip is to get in the picture (px), and what the servo is told."""

    name: str
    pixel: tuple[float, float]
    told: str


def scene_text(seed: int, place: tuple[float, ...] = ()) -> str:
    """A camera somewhere above the table, drawn from the seed; 0 is the usual one."""
    draw = random.Random(f"camera {seed}")
    words = {"seed": f"{seed}"}
    if seed:
        words["tilt"] = f"{draw.uniform(10, 40):.0f}"
        words["azimuth"] = f"{draw.uniform(-60, 60):.0f}"
        words["roll"] = f"{draw.uniform(-15, 15):.0f}"
    if place:
        words["goal_x"], words["goal_y"] = (f"{value:.2f}" for value in place)
    return ",".join(f"{key}={value}" for key, value in words.items())


def choose_goals(arm: Arm, seed: int) -> tuple[str, list[Goal]]:
    """The scene's text, and the goals: its marker, and pixels.

    They are where the tip is seen in postures inside the joint limits, away from singular ones, and
    apart from one another and from where the driver leaves the tip: all can be reached.

    Raises:
        DemoFailed: this arm has no such postures.
    """
    bare = Scene(arm, read_scene(scene_text(seed)))
    resting = _postures_at(bare, LAST_POINT)
    draw = random.Random(f"goals {seed}")
    for _ in range(TRIES):
        chosen = _choose_postures(bare, resting, draw)
        if len(chosen) < GOALS:
            continue
        pixels = [bare.truth(q)["effector"] for q in chosen]
        text = scene_text(seed, place_at(bare, pixels[0], _height(bare, "goal")))
        scene = Scene(arm, read_scene(text))
        if all(scene.visible(q)["goal"] > PLAIN for q in resting):
            first = Goal("goal 1", scene.truth(chosen[0])["goal"], "marker")
            told = [f"{u:.1f},{v:.1f}" for u, v in pixels[1:]]
            return text, [first, *(_fixed_goal(k, words) for k, words in enumerate(told, 2))]
    raise DemoFailed(
        f"seed {seed} gives no {GOALS} goals that this arm can reach; try another --seed"
    )


def _fixed_goal(number: int, told: str) -> Goal:
    u, v = (float(part) for part in told.split(","))
    return Goal(f"goal {number}", (u, v), told)


def _choose_postures(scene: Scene, resting: Sequence[Vector], draw: random.Random) -> list[Vector]:
    """Postures (rad) for the goals; fewer than GOALS if it found no more."""
    width, height = scene.camera.size
    chosen: list[Vector] = []
    taken = [scene.truth(q)["effector"] for q in resting[:1]]
    for _ in range(TRIES):
        q = tuple(draw.uniform(SHARE * j.lower, SHARE * j.upper) for j in scene.arm.joints)
        u, v = scene.truth(q)["effector"]
        if (
            MARGIN < u < width - MARGIN
            and MARGIN < v < height - MARGIN
            and all(math.dist((u, v), place) >= APART for place in taken)
            and all(math.dist(q, other) >= DIFFERENT for other in chosen)
            and np.linalg.cond(_slope(lambda q: scene.truth(q)["effector"], q)) <= ROUND
            and scene.visible(q)["effector"] > PLAIN
        ):
            chosen.append(q)
            taken.append((u, v))
            if len(chosen) == GOALS:
                break
    return chosen


def _height(scene: Scene, marker: str) -> float:
    """Of a marker's centre above the table, cm."""
    return float(scene.centres([joint.home for joint in scene.arm.joints])[marker][2])


def place_at(scene: Scene, pixel: Sequence[float], height: float) -> Vector:
    """The place (x, y), cm, at a height (cm) above the table that is seen at a pixel."""

    def seen(place: Vector) -> Any:
        return scene.project(np.array([[*place, height]]))[0]

    tip = scene.centres([joint.home for joint in scene.arm.joints])["effector"]
    return _solve(seen, (tip[0] / 2, tip[1] / 2), pixel)


def _postures_at(scene: Scene, place: Sequence[float]) -> list[Vector]:
    """Postures (rad) that have the tip at a place (x, y), cm: bent one way and the other."""
    bends = [(bend,) * len(scene.arm.joints) for bend in (1.0, -1.0)]
    return [_solve(lambda q: scene.centres(q)["effector"][:2], bend, place) for bend in bends]


def _solve(function: Callable[[Vector], Any], x: Vector, wanted: Sequence[float]) -> Vector:
    """Where a function has a wanted value, from x on; by Newton."""
    for _ in range(NEWTON):
        rest = np.array(wanted) - function(x)
        x = tuple(x + np.linalg.lstsq(_slope(function, x), rest, rcond=None)[0])
    return x


def _slope(function: Callable[[Vector], Any], x: Vector) -> np.ndarray:
    """The Jacobian of a function at x, by central differences."""
    steps = 1e-4 * np.eye(len(x))
    ends = [(function(tuple(x + d)), function(tuple(x - d))) for d in steps]
    return np.stack([np.subtract(*pair) for pair in ends], axis=1) / 2e-4


# Programs


class Program:
    """A command of ours in a process of its own; its lines are read while it runs.

    Args:
        name: for people.
        words: after `python -m laptop`.
        log: where its lines go.
        state: its BRICKSERVO_STATE.
        told: called with every line, in another thread.
    """

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        log: Path,
        state: Path,
        told: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.name = name
        self.log = log
        self.lines: deque[str] = deque(maxlen=50)
        self._told = told
        surroundings = {**os.environ, "BRICKSERVO_STATE": str(state), "PYTHONUNBUFFERED": "1"}
        self._process = subprocess.Popen(
            [*LAPTOP, *words],
            cwd=ROOT,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            # Ctrl-C comes to the demo alone: it knows in which order to end what it has started.
            start_new_session=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def wait(self, limit: float) -> int:
        """Its exit status.

        Args:
            limit: s.

        Raises:
            DemoFailed: it takes longer.
        """
        try:
            status = self._process.wait(limit)
        except subprocess.TimeoutExpired:
            raise self.hangs(limit) from None
        self._reader.join(ENDED)
        return status

    def hangs(self, limit: float) -> DemoFailed:
        """What to say when it was not done after `limit` s."""
        return DemoFailed(f"{self.name} hangs: not done after {limit:g} s; see {self.log}")

    def complain(self) -> DemoFailed:
        """What to say when it has failed."""
        said = [line for line in self.lines if re.match(r"(laptop|simulate|\w+\.py): ", line)]
        last = (said or list(self.lines) or ["it said nothing"])[-1]
        return DemoFailed(f"{self.name} failed: {last.removeprefix('laptop: ')}; see {self.log}")

    def interrupt(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        if self.running:
            self._process.send_signal(signal.SIGINT)

    def end(self, deadline: float) -> None:
        """See to it that it has ended by a time on time.monotonic (s), whatever it does."""
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            with suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
            self._process.wait()
        self._reader.join(ENDED)
        if self._process.stdout:
            self._process.stdout.close()

    def _read(self) -> None:
        assert self._process.stdout
        with self.log.open("w", encoding="utf-8") as log, suppress(ValueError):
            for line in self._process.stdout:
                log.write(line)
                log.flush()
                if line.strip():
                    self.lines.append(line.strip())
                    self._told(line.strip())


class Crew:
    """The programs of one demo; none outlives it.

    Args:
        folder: for what they say.
        state: BRICKSERVO_STATE of all.
    """

    def __init__(self, folder: Path, state: Path) -> None:
        self._folder = folder
        self._state = state
        self._programs: list[Program] = []
        # A signal interrupts the main thread alone: what has been started is always on the list.
        self._starter = ThreadPoolExecutor(1)

    def start(
        self, name: str, words: Sequence[str], told: Callable[[str], None] = lambda line: None
    ) -> Program:
        """Start one."""
        log = self._folder / f"{re.sub('[^a-z0-9]+', '-', name)}.txt"

        def make() -> Program:
            self._programs.append(Program(name, words, log, self._state, told))
            return self._programs[-1]

        return self._starter.submit(make).result()

    def close(self) -> None:
        """End all of them; nothing disturbs that."""
        before = {number: signal.signal(number, signal.SIG_IGN) for number in _SIGNALS}
        try:
            self._starter.shutdown()
            for program in self._programs:
                program.interrupt()
            deadline = time.monotonic() + ENDED
            for program in self._programs:
                program.end(deadline)
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def _ending_on_signals() -> Iterator[None]:
    """SIGTERM and SIGHUP end the demo as Ctrl-C does, in order."""

    def obey(number: int, frame: object) -> None:
        print(f"laptop: stopped by {signal.Signals(number).name}", file=sys.stderr)
        raise SystemExit(128 + number)

    others = [number for number in _SIGNALS if number != signal.SIGINT]
    before = {number: signal.signal(number, obey) for number in others}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


# What is seen meanwhile


class Stage:
    """One thing that the demo does, and how it is going."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.text = ""
        self.mark = " "
        self.began: float | None = None
        self.took: float | None = None
        self.spinner = Spinner("dots", style="cyan")

    def begin(self, text: str = "") -> None:
        """From now on it runs."""
        self.began, self.text = time.monotonic(), text

    def say(self, text: str) -> None:
        """How it is going."""
        if self.took is None:
            self.text = text

    def finish(self, well: bool, text: str) -> None:
        """It is over."""
        self.took = time.monotonic() - (self.began or time.monotonic())
        self.text = text
        self.mark = "[green]✓[/]" if well else "[red]✗[/]"

    @property
    def seconds(self) -> str:
        """For how long it has been going on."""
        if self.began is None:
            return ""
        return f"{self.took if self.took is not None else time.monotonic() - self.began:.1f} s"


class Progress:
    """All stages, on a terminal as they go, elsewhere a line as each is over.

    Args:
        console: where to.
        names: of the stages.
    """

    def __init__(self, console: Console, names: Sequence[str]) -> None:
        self._console = console
        self.stages = {name: Stage(name) for name in names}

    def __rich__(self) -> Table:
        """As a table that is drawn anew all the time."""
        table = Table.grid(padding=(0, 2))
        for stage in self.stages.values():
            running = stage.began is not None and stage.took is None
            table.add_row(
                stage.spinner if running else stage.mark,
                Text(stage.name, style="" if stage.began else "dim"),
                Text(stage.seconds, justify="right"),
                Text(stage.text, no_wrap=True, overflow="ellipsis", style="" if running else "dim"),
            )
        return table

    @contextmanager
    def shown(self) -> Iterator[None]:
        """While the block runs."""
        if not self._console.is_terminal:
            yield
            return
        with Live(self, console=self._console, refresh_per_second=10):
            yield

    def finish(self, name: str, well: bool, text: str) -> None:
        """A stage is over."""
        stage = self.stages[name]
        stage.finish(well, text)
        if not self._console.is_terminal:
            self._console.print(
                f"{name}: {text} ({stage.seconds})", soft_wrap=True, highlight=False, markup=False
            )


# The demo


TRACKER, DRAWING, RIVAL, REPORT = "tracker", "three lines", "report's method", "report"


def run(orders: Orders, console: Console) -> tuple[int, Path]:
    """Show it all; the exit status, 0 if it truly worked, and the report.

    Raises:
        ArmError: one line that says what has failed; every program has ended then.
    """
    arm = read_arm(find_arm(orders.arm))
    began = time.monotonic()
    folder = _new_folder(orders.out)
    progress = Progress(
        console, [TRACKER, DRAWING, *(f"goal {k + 1}" for k in range(GOALS)), RIVAL, REPORT]
    )
    with ExitStack() as stack:
        state = stack.enter_context(tempfile.TemporaryDirectory(prefix="brickservo-demo-"))
        crew = Crew(folder, Path(state))
        stack.enter_context(_ending_on_signals())
        stack.callback(crew.close)
        stack.enter_context(progress.shown())
        show = Show(arm, orders, folder, crew, progress)
        show.play()
        progress.stages[REPORT].begin("drawing the pictures")
        crew.close()  # the tracker leaves its picture when it ends
        show.story["seconds"] = time.monotonic() - began
        text = json.dumps(show.story, indent=1) + "\n"
        (folder / report.STORY).write_text(text, encoding="utf-8")
        run = report.read_run(folder)
        page = report.write(run)
        shown = os.path.relpath(page)
        shown = str(page) if shown.startswith("..") else shown
        progress.finish(REPORT, True, shown)
    console.print(report.table(run))
    console.print(report.headline(run), soft_wrap=True, highlight=False, markup=False)
    console.print(
        f"{time.monotonic() - began:.0f} s; {shown}", soft_wrap=True, highlight=False, markup=False
    )
    return (0 if run.worked else 1), page


class Show:
    """The course of one demo, up to the end of the last program.

    Args:
        arm: on the emulated brick.
        orders: what is to be shown.
        folder: for the raw files.
        crew: starts the programs.
        progress: tells how it goes.
    """

    def __init__(
        self, arm: Arm, orders: Orders, folder: Path, crew: Crew, progress: Progress
    ) -> None:
        self._arm = arm
        self._orders = orders
        self._folder = folder
        self._crew = crew
        self._progress = progress
        if arm.chain != "planar":
            raise DemoFailed(
                f"{arm.name} is an arm in space, and the demo is of arms in the plane;"
                " take --arm planar or geared"
            )
        text, self._goals = choose_goals(arm, orders.seed)
        self._scene = Scene(arm, read_scene(text))
        self._began = time.monotonic()
        self._played: list[Program] = []
        self._rival: Program | None = None
        self.story: dict[str, Any] = {
            "arm": arm.name,
            "scene": text,
            "size": list(self._scene.camera.size),
            "command": _command(orders),
            "lines": [],
            "approaches": [],
            "rival": None,
            "trouble": "",
        }

    def play(self) -> None:
        """All of it; `story` is then what report.read_run reads.

        Raises:
            DemoFailed: a program failed or hangs.
        """
        stages = self._progress.stages
        stages[TRACKER].begin("starting")
        tracker = self._crew.start(
            TRACKER,
            ["track", "--no-page", "--camera", "synthetic", "--scene", self.story["scene"]]
            + ["--host", "127.0.0.1", "--port", "0", "--csv", str(self._folder / "track.csv")]
            + ["--picture", str(self._folder / "camera.png")],
        )
        home = self._folder / "drawing"
        stages[DRAWING].begin("starting")
        drawing = self._simulate(DRAWING, ["--realtime"], home, [str(DRIVER)])
        place, code = _invited(tracker)
        self._progress.finish(TRACKER, True, f"listens at {place}")
        self._wait(drawing, tracker, home, DRAWN)
        summary = json.loads((home / SUMMARY).read_text(encoding="utf-8"))
        if summary["status"]:
            drawing.wait(ENDED)
            raise drawing.complain()
        lines = self.story["lines"] = summary["paths"]
        self._progress.finish(DRAWING, report.drawn(lines), report.lines_text(lines))

        for goal in self._goals:
            start = _start_words(self._arm, home)
            home = self._folder / goal.name.replace(" ", "-")
            stages[goal.name].begin("starting")
            program = self._simulate(
                goal.name,
                ["--realtime", start],
                home,
                [str(self._orders.servo), place, "--code", code, f"--goal={goal.told}"]
                + ["--log", f"{home}.jsonl"],
            )
            if self._rival is None:
                self._compare(goal, start)
            self._wait(program, tracker, home, SERVOED)
            self._take(goal.name, _approach(self._scene, goal, home, program), "approaches")
        self._conclude_comparison()
        for program in self._played:
            program.wait(ENDED)  # it may be at its picture

    def _simulate(
        self, name: str, options: Sequence[str], home: Path, script: Sequence[str]
    ) -> Program:
        words = ["simulate", *options, "--arm", os.path.abspath(self._arm.file), "--out", str(home)]
        return self._crew.start(name, [*words, *script], self._progress.stages[name].say)

    def _compare(self, goal: Goal, start: str) -> None:
        """Start the report's method on its way to a goal."""
        self._progress.stages[RIVAL].begin("starting")
        home = self._folder / RIVAL_HOME
        self._rival = self._simulate(
            RIVAL,
            ["--scene", self.story["scene"], start],
            home,
            [str(self._orders.servo), f"--goal={goal.told}", "--method", "report"]
            + ["--budget", f"{REPORT_BUDGET:g}", "--log", f"{home}.jsonl"],
        )
        # What runs in real time goes first.
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self._rival.pid, 10)

    def _conclude_comparison(self) -> None:
        """Take its outcome once; whatever becomes of it does no harm to the demo."""
        if self._rival is None or self._progress.stages[RIVAL].took is not None:
            return
        home = self._folder / RIVAL_HOME
        while self._rival.running and time.monotonic() < self._began + COMPARED:
            time.sleep(LOOK)
        try:
            self._rival.interrupt()
            self._rival.wait(ENDED)
            approach = _approach(self._scene, self._goals[0], home, self._rival)
            self._take(RIVAL, approach, "rival")
        except DemoFailed as trouble:
            self.story["trouble"] = str(trouble)
            self._progress.finish(RIVAL, False, str(trouble))

    def _take(self, stage: str, record: dict[str, Any], part: str) -> None:
        """Add an approach to the story, and say how it went."""
        if part == "rival":
            self.story[part] = record
        else:
            self.story[part].append(record)
        told = report.read_approach(self._folder, record)
        self._progress.finish(stage, told.reached, told.words)

    def _wait(self, program: Program, tracker: Program, home: Path, limit: float) -> None:
        """Until a run's figures are there, or it has ended; its picture may take longer.

        Raises:
            DemoFailed: it takes longer than `limit` s, or the tracker has ended.
        """
        deadline = time.monotonic() + limit
        while program.running and not (home / SUMMARY).exists():
            if not tracker.running:
                tracker.wait(ENDED)
                raise tracker.complain()
            if self._rival and not self._rival.running:
                self._conclude_comparison()
            if time.monotonic() > deadline:
                raise program.hangs(limit)
            time.sleep(LOOK)
        if not (home / SUMMARY).exists():
            program.wait(ENDED)
            raise program.complain()
        self._played.append(program)


def _command(orders: Orders) -> str:
    words = ["python -m laptop demo"]
    words += [f"--arm {orders.arm}"] * (orders.arm != "planar")
    words += [f"--seed {orders.seed}"] * (orders.seed != 0)
    return " ".join(words)


def _new_folder(out: Path) -> Path:
    """A folder with the time as its name.

    Raises:
        DemoFailed: it cannot be made.
    """
    name = time.strftime("%Y-%m-%d-%H%M%S")
    try:
        for attempt in range(1, 100):
            folder = (out / (name if attempt == 1 else f"{name}-{attempt}")).resolve()
            with suppress(FileExistsError):
                folder.parent.mkdir(parents=True, exist_ok=True)
                folder.mkdir()
                return folder
    except OSError as error:
        raise DemoFailed(
            f"cannot write to {out}: {error.strerror}; choose another folder with --out"
        ) from None
    raise DemoFailed(f"too many runs of this second in {out}; choose another folder with --out")


def read_invitation(line: str) -> tuple[str, str] | None:
    """HOST:PORT and the pairing code from what the tracker prints; None of another line."""
    found = re.search(r"robot/\w+\.py (\d+(?:\.\d+){3}:\d+) --code (\S+)", line)
    return (found.group(1), found.group(2)) if found else None


def _invited(tracker: Program) -> tuple[str, str]:
    deadline = time.monotonic() + READY
    while time.monotonic() < deadline:
        for line in list(tracker.lines):
            invitation = read_invitation(line)
            if invitation:
                return invitation
        if not tracker.running:
            tracker.wait(ENDED)
            raise tracker.complain()
        time.sleep(LOOK)
    raise tracker.hangs(READY)


class Row(NamedTuple):
    """One of trace.csv: s, true joint angles (rad)."""

    t: float
    q: tuple[float, ...]


def read_trace(file: Path) -> list[Row]:
    """The true motion that `simulate` left.

    Raises:
        DemoFailed: it left none.
    """
    try:
        with file.open(newline="", encoding="ascii") as lines:
            heading, *rows = csv.reader(lines)
            joints = [column for column, name in enumerate(heading) if name.startswith("q")]
            trace = [Row(float(row[0]), tuple(float(row[k]) for k in joints)) for row in rows]
        if trace:
            return trace
        raise ValueError("no row")
    except (OSError, ValueError, IndexError):
        raise DemoFailed(f"{file} cannot be read; is the disk full?") from None


def _start_words(arm: Arm, home: Path) -> str:
    """Where a run left the arm, for the next one; within what is allowed."""
    q = read_trace(home / "trace.csv")[-1].q
    angles = [
        math.degrees(min(max(a, j.lower), j.upper)) for a, j in zip(q, arm.joints, strict=True)
    ]
    return "--start=" + ",".join(f"{angle:.4f}" for angle in angles)


def _approach(scene: Scene, goal: Goal, home: Path, program: Program) -> dict[str, Any]:
    """One run of the servo as it truly was; what report.read_approach reads.

    Raises:
        DemoFailed: it ended without a verdict.
    """
    log = home.with_suffix(".jsonl")
    notes = report.read_log(log) if log.exists() else report.Log({}, [], [], [], None)
    if notes.verdict is None:
        program.wait(ENDED)
        raise program.complain()
    rows = read_trace(home / "trace.csv")
    zero = notes.run["clock"] - UPTIME
    height = _height(scene, "effector")
    tip = scene.centres(rows[-1].q)["effector"][:2]
    return {
        "name": goal.name,
        "log": log.name,
        "goal": [round(value, 3) for value in goal.pixel],
        "path": [[round(t - zero, 3), round(u, 2), round(v, 2)] for t, u, v in _path(scene, rows)],
        "miss_mm": round(10 * math.dist(tip, place_at(scene, goal.pixel, height)), 3),
    }


LOOK = 0.05
"""Between two looks at whether a program has ended, s."""
SUMMARY = "summary.json"
"""What `simulate` leaves, behind trace.csv."""
RIVAL_HOME = "report-method"

FINEST = 0.2
"""Of the true path, points so far apart are kept, px."""
STILL = 1e-4
"""Joints that moved less than this have not moved, rad."""
REST = 0.05
"""After so long a rest it is kept when it ended, s."""


def _path(scene: Scene, rows: Sequence[Row]) -> Iterator[tuple[float, float, float]]:
    """When (s) the tip truly was where in the picture (px); what lies between is straight."""
    kept = rows[0]
    place = scene.truth(kept.q)["effector"]
    yield kept.t, *place
    for before, row in zip(rows, rows[1:], strict=False):
        if row is not rows[-1] and max(map(abs, np.subtract(row.q, kept.q))) < STILL:
            continue
        here = scene.truth(row.q)["effector"]
        if row is rows[-1] or math.dist(here, place) > FINEST:
            if before.t - kept.t > REST:
                yield before.t, *place
            yield row.t, *here
            kept, place = row, here
