"""`python -m laptop demo`: everything at once, on this machine alone, and whether it truly worked.

Separate processes in real time: the tracker on rendered frames, of one camera or, for an arm in
space, of two; and one after the other the unmodified programs of the brick, which reach it by TCP
on loopback.  First the driver draws its lines, then the servo brings the tip to three goals, each
from where the arm was left.  Beside it the method of the report goes to the first goal, in virtual
time.

What the brick claims decides nothing: every goal is judged by the true pose of the emulated arm.
"""

from __future__ import annotations

import csv
import http.client
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
import urllib.parse
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from laptop import report
from laptop.reporting.line_accuracy import pen_down_runs
from laptop.simulator.clocks import UPTIME
from laptop.simulator.live import Follower
from laptop.simulator.pace import BUSY, Pace, PacedClock, in_words
from laptop.simulator.scene import Scene, cameras, read_scene
from laptop.simulator.session import AFTER
from laptop.simulator.world import BUSY as TOO_BUSY
from laptop.tracking.watching import undisturbed
from shared.arm_description import Arm, ArmError, find_arm, read_arm

Told = TypeVar("Told")

LAPTOP = (sys.executable, "-m", "laptop")
ROOT = Path(__file__).resolve().parent.parent
DRIVER = ROOT / "robot" / "driver.py"
SERVO = ROOT / "robot" / "visual_servoing.py"

GOALS = 3
TOLERANCE = 5.0
"""What the servo stops at if nothing is said, px."""
REPORT_BUDGET = 180.0
"""What the report's method may take, virtual s."""

READY, DRAWN, SERVOED, COMPARED, ENDED = 300.0, 600.0, 600.0, 600.0, 60.0
"""Deadlines that only a hang reaches, s: for the tracker and its page; on the emulated clock, for
the lines and for one goal; for the comparison, and for what is told to end."""
SLOWEST = 10.0
"""After as many times longer the emulated clock itself has stopped."""

APART = 150.0
"""Least distance of a goal from the others, and from where the driver leaves the tip, px; of two
cameras as one distance in four rows."""
DIFFERENT = 0.7
"""Least distance between the goals' postures, rad."""
MARGIN = 45.0
"""Of goals from the picture's edge, px."""
SHARE = 0.85
"""Of the joint limits that postures are drawn from."""
ROUND = 5.0
"""Greatest condition number of the true image Jacobian at a goal: no singular posture is near."""
PLAIN = 0.9
"""What can be seen of a marker that nothing hides but what holds it."""
CLEAR = 0.85
"""As much where the tip stands to be looked at: the stand of a goal before it hides more."""
GLIMPSE, GLIMPSES = 0.6, 7
"""So much of the tip's marker is seen at so many places on its way to each goal."""
EXPLORED = 0.2
"""Around a start it is seen, too, with each joint turned by so much, rad: the servo explores."""
LOW = 2.5
"""Least height of the tip, where it has a choice, cm."""
TRIES, SETS = 300, 20
"""Postures that are drawn for one set of goals, and sets."""
NEWTON = 12
"""Iterations."""


class Stand(NamedTuple):
    """How an arm of one kind of chain is shown.

    words   of every scene's text
    usual   of seed 0
    views   per camera (its prefix in the text) ranges of tilt, azimuth and roll, deg, for others
    left    where the driver's lines end, cm
    bent    a posture that is bent one way, rad; the other way it is its negative
    """

    words: dict[str, str]
    usual: dict[str, str]
    views: dict[str, tuple[tuple[float, float], ...]]
    left: tuple[float, ...]
    bent: tuple[float, ...]


STANDS = {
    "planar": Stand({}, {}, {"": ((10, 40), (-60, 60), (-15, 15))}, (0.0, 15.0), (1.0, 1.0)),
    "spatial": Stand(
        # Two pictures at once are more work than one: fewer, and quicker to paint.
        {"fps": "20", "exposure": "0.004", "jpeg": "0"},
        # From above in front, where no link hides the tip, and from the side.
        {"A.tilt": "40", "A.azimuth": "90", "B.tilt": "85", "B.azimuth": "10"},
        {"A.": ((32, 48), (60, 110), (-10, 10)), "B.": ((75, 88), (-10, 35), (-5, 5))},
        (9.0, 4.0, 12.6),
        (0.0, 1.2, -2.0),
    ),
}
"""By the arm's chain."""


class DemoFailed(ArmError):
    """A program of the demo that fails or hangs."""


class TooBusy(DemoFailed):
    """This computer has no time left for the demo."""


@dataclass(frozen=True)
class Orders:
    """What is to be shown.

    out    a folder with the time as its name is made in it
    arm    name or file
    seed   draws camera, table and goals
    servo  the program that servoes
    page, page_host, page_port   whether the tracker serves its page, and where
    open   the page is opened in a browser
    """

    out: Path
    arm: str = "planar"
    seed: int = 0
    servo: Path = SERVO
    page: bool = False
    page_host: str = "127.0.0.1"
    page_port: int | None = None
    open: bool = False


# The scene and the goals


Vector = tuple[float, ...]


class Goal(NamedTuple):
    """Where the tip is to get, and what the servo is told.

    name    for people
    pixels  u and v in the picture of each camera, one after the other, px
    place   of the tip's marker there, cm
    told    what --goal is given, once or camera by camera
    """

    name: str
    pixels: Vector
    place: Vector
    told: tuple[str, ...]


class Views(dict[str, Scene]):
    """What each camera sees of one arm, by the camera's name.

    Args:
        arm: its description.
        text: of the scene.
    """

    def __init__(self, arm: Arm, text: str) -> None:
        names = cameras(arm, text)
        super().__init__({name: Scene(arm, read_scene(text, name)) for name in names})
        self.arm = arm
        self.text = text
        self._first = self[names[0]]

    def centre(self, marker: str, q: Sequence[float] | None = None) -> np.ndarray:
        """Where a marker is (3,), cm, with the joints at q (rad; at home if None)."""
        home = [joint.home for joint in self.arm.joints]
        return self._first.centres(home if q is None else q)[marker]

    def truth(self, q: Sequence[float], marker: str = "effector") -> Vector:
        """Where a marker is in all pictures, px: u and v of each."""
        return tuple(value for scene in self.values() for value in scene.truth(q)[marker])

    def visible(self, q: Sequence[float], marker: str = "effector") -> float:
        """The part of a marker, 0 .. 1, that the camera sees that sees least of it."""
        return min(scene.visible(q)[marker] for scene in self.values())

    def project(self, place: Sequence[float]) -> np.ndarray:
        """Where a place (x, y, z), cm, is in all pictures, px: u and v of each."""
        return np.concatenate([s.project(np.array([place]))[0] for s in self.values()])

    def place_at(self, pixels: Sequence[float], marker: str) -> Vector:
        """The place (x, y, z), cm, that is seen at these pixels.

        In the plane one camera does, which knows how high a marker is; in space it takes two.
        """
        at_home = self.centre(marker)
        known = at_home[len(STANDS[self.arm.chain].left) :]

        def seen(free: Vector) -> np.ndarray:
            return self.project([*free, *known])

        start = self.centre("effector")[: 3 - len(known)] / 2
        return (*map(float, _solve(seen, tuple(start), pixels)), *map(float, known))

    def postures_at(self, place: Sequence[float]) -> list[Vector]:
        """Postures (rad) that have the tip at a place, cm: bent one way and the other."""
        bent = STANDS[self.arm.chain].bent
        bends = [tuple(sign * angle for angle in bent) for sign in (1.0, -1.0)]
        return [_solve(lambda q: self.centre("effector", q)[: len(place)], q, place) for q in bends]

    def way_is_seen(self, start: Sequence[float], end: Sequence[float]) -> bool:
        """Whether the tip is in sight, and above the table, around a posture and on to another."""
        way = np.linspace(start, end, GLIMPSES)
        steps = EXPLORED * np.eye(len(way[0]))
        between = *way[1:-1], *(way[0] + steps), *(way[0] - steps)
        return all(
            self.centre("effector", q)[2] >= LOW and self.visible(q) > least
            for least, places in ((CLEAR, (way[0], way[-1])), (GLIMPSE, between))
            for q in places
        )


def scene_text(chain: str, seed: int, place: Sequence[float] = ()) -> str:
    """Cameras somewhere around the table, drawn from the seed; 0 is the usual ones."""
    draw = random.Random(f"camera {seed}")
    stand = STANDS[chain]
    words = {"seed": f"{seed}", **stand.words, **({} if seed else stand.usual)}
    for camera, ranges in stand.views.items() if seed else ():
        for key, bounds in zip(("tilt", "azimuth", "roll"), ranges, strict=True):
            words[camera + key] = f"{draw.uniform(*bounds):.0f}"
    words.update(
        (key, f"{value:.2f}")
        for key, value in zip(("goal_x", "goal_y", "goal_z"), place, strict=False)
    )
    return ",".join(f"{key}={value}" for key, value in words.items())


def choose_goals(arm: Arm, seed: int) -> tuple[str, list[Goal]]:
    """The scene's text, and the goals: its marker, and pixels of every camera.

    They are where the tip is seen in postures inside the joint limits, away from singular ones, and
    apart from one another and from where the driver leaves the tip: all can be reached, and the tip
    is seen on a way there.

    Raises:
        DemoFailed: this arm has no such postures.
    """
    bare = Views(arm, scene_text(arm.chain, seed))
    resting = bare.postures_at(STANDS[arm.chain].left)
    draw = random.Random(f"goals {seed}")
    for _ in range(SETS):
        chosen = _choose_postures(bare, resting, draw)
        if len(chosen) < GOALS:
            continue
        pixels = [bare.truth(q) for q in chosen]
        size = len(STANDS[arm.chain].left)
        text = scene_text(arm.chain, seed, bare.place_at(pixels[0], "goal")[:size])
        views = Views(arm, text)
        ways = zip([resting[0], *chosen], chosen, strict=False)
        if all(views.visible(q, "goal") > PLAIN for q in resting) and all(
            views.way_is_seen(*way) for way in ways
        ):
            marker = views.truth(resting[0], "goal")
            told = [("marker",), *(_told(views, there) for there in pixels[1:])]
            ends = [marker, *(_read(words) for words in told[1:])]
            return text, [
                Goal(f"goal {number}", end, views.place_at(end, "effector"), words)
                for number, (end, words) in enumerate(zip(ends, told, strict=True), 1)
            ]
    raise DemoFailed(
        f"seed {seed} gives no {GOALS} goals that this arm can reach; try another --seed"
    )


def _told(views: Views, pixels: Vector) -> tuple[str, ...]:
    """A goal in words: a pixel, or one of each camera."""
    pairs = zip(views, pixels[::2], pixels[1::2], strict=True)
    return tuple(f"{f'{name}:' * (len(views) > 1)}{u:.1f},{v:.1f}" for name, u, v in pairs)


def _read(told: Sequence[str]) -> Vector:
    """The pixels of such words."""
    return tuple(float(part) for words in told for part in words.split(":")[-1].split(","))


def _choose_postures(views: Views, resting: Sequence[Vector], draw: random.Random) -> list[Vector]:
    """Postures (rad) for the goals; fewer than GOALS if it found no more."""
    chosen: list[Vector] = []
    taken = [views.truth(q) for q in resting[:1]]
    for _ in range(TRIES):
        q = tuple(draw.uniform(SHARE * j.lower, SHARE * j.upper) for j in views.arm.joints)
        seen = views.truth(q)
        if (
            _inside(views, seen)
            and views.centre("effector", q)[2] >= LOW
            and all(math.dist(seen, other) >= APART for other in taken)
            and all(math.dist(q, other) >= DIFFERENT for other in chosen)
            and np.linalg.cond(_slope(views.truth, q)) <= ROUND
            and views.visible(q) > PLAIN
            and views.way_is_seen([*resting[:1], *chosen][-1], q)
        ):
            chosen.append(q)
            taken.append(seen)
            if len(chosen) == GOALS:
                break
    return chosen


def _inside(views: Views, pixels: Vector) -> bool:
    """Whether pixels are in their pictures, away from the edges."""
    sizes = [size for scene in views.values() for size in scene.camera.size]
    return all(MARGIN < x < size - MARGIN for x, size in zip(pixels, sizes, strict=True))


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
        surroundings: what it is told by environment variables.
        told: called with every line, in another thread.
    """

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        log: Path,
        surroundings: dict[str, str],
        told: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.name = name
        self.log = log
        self.lines: deque[str] = deque(maxlen=50)
        self._told = told
        self._process = subprocess.Popen(
            [*LAPTOP, *words],
            cwd=ROOT,
            env={**os.environ, **surroundings, "PYTHONUNBUFFERED": "1"},
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
        kind = TooBusy if self._process.poll() == TOO_BUSY else DemoFailed
        return kind(f"{self.name} failed: {last.removeprefix('laptop: ')}; see {self.log}")

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
        with self.log.open("a", encoding="utf-8") as log, suppress(ValueError):
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
        surroundings: of all.
    """

    def __init__(self, folder: Path, surroundings: dict[str, str]) -> None:
        self._folder = folder
        self._surroundings = surroundings
        self._programs: list[Program] = []
        # A signal interrupts the main thread alone: what has been started is always on the list.
        # (The executor knows only threads that were not interrupted as they began: this one.)
        self._starter = ThreadPoolExecutor(1)
        self._starter.submit(int).result()

    def start(
        self, name: str, words: Sequence[str], told: Callable[[str], None] = lambda line: None
    ) -> Program:
        """Start one."""
        log = self._folder / f"{re.sub('[^a-z0-9]+', '-', name)}.txt"

        def make() -> Program:
            self._programs.append(Program(name, words, log, self._surroundings, told))
            return self._programs[-1]

        return self._starter.submit(make).result()

    def close(self) -> None:
        """End all of them; nothing disturbs that."""
        with undisturbed():
            self._starter.shutdown()
            for program in self._programs:
                program.interrupt()
            deadline = time.monotonic() + ENDED
            for program in self._programs:
                program.end(deadline)


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


TELL_PACE = 10.0
"""Between two lines about a computer that is busy, s."""


class Progress:
    """All stages, on a terminal as they go, elsewhere a line as each is over.

    Args:
        console: where to.
        names: of the stages.
    """

    def __init__(self, console: Console, names: Sequence[str]) -> None:
        self._console = console
        self._told = -math.inf
        self.stages = {name: Stage(name) for name in names}
        self.pace = 1.0

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
        if self.pace < BUSY:
            table.add_row("[yellow]![/]", "", "", Text(in_words(self.pace), style="yellow"))
        return table

    def say(self, line: str) -> None:
        """A line of its own, above all."""
        self._console.print(line, soft_wrap=True, highlight=False, markup=False)

    def keep(self, pace: float) -> None:
        """So fast the emulated clock goes of late, as laptop.simulator.pace has it."""
        self.pace = pace
        now = time.monotonic()
        if pace < BUSY and not self._console.is_terminal and now - self._told > TELL_PACE:
            self._told = now
            self.say(in_words(pace))

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
            self.say(f"{name}: {text} ({stage.seconds})")


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
        clock = PacedClock(state)
        stack.callback(clock.close)
        # The cameras show this arm from the start, before it moves.
        crew = Crew(
            folder, {"BRICKSERVO_STATE": state, "BRICKSERVO_ARM": os.path.abspath(arm.file)}
        )
        stack.enter_context(_ending_on_signals())
        stack.callback(crew.close)
        stack.enter_context(progress.shown())
        show = Show(arm, orders, folder, crew, progress, clock, Follower(state))
        stack.callback(show.close)
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
    took = (
        f"{time.monotonic() - began:.0f} s, the emulated brick with cpu={show.story['cpu']:g}, "
        f"its clock at {show.story['pace']:.2f} x"
    )
    ink = f", first ink after {show.story['first_ink']:.1f} s" if "first_ink" in show.story else ""
    console.print(f"{took}{ink}; {shown}", soft_wrap=True, highlight=False, markup=False)
    return (0 if run.worked else 1), page


class Deadline:
    """A time that only a hang reaches.

    Args:
        clock: the emulated one; that it goes slower is no hang.
        limit: s on it; SLOWEST times as much by this computer's clock says that it has stopped.
    """

    def __init__(self, clock: PacedClock, limit: float) -> None:
        self.limit = limit
        self._clock = clock
        self._ends = clock.now() + limit, time.monotonic() + SLOWEST * limit

    @property
    def passed(self) -> bool:
        """Whether it is over."""
        now = self._clock.now(), time.monotonic()
        return any(t > end for t, end in zip(now, self._ends, strict=True))


@dataclass
class Part:
    """What one program does on the emulated brick.

    name     for people
    options  of `simulate`
    home     for its files
    script   with its words
    program  the latest that was started for it
    """

    name: str
    options: Sequence[str]
    home: Path
    script: Sequence[str]
    program: Program


class Show:
    """The course of one demo, up to the end of the last program.

    Args:
        arm: on the emulated brick.
        orders: what is to be shown.
        folder: for the raw files.
        crew: starts the programs.
        progress: tells how it goes.
        clock: of the emulated world.
        follower: sees the emulated arm.
    """

    def __init__(
        self,
        arm: Arm,
        orders: Orders,
        folder: Path,
        crew: Crew,
        progress: Progress,
        clock: PacedClock,
        follower: Follower,
    ) -> None:
        self._arm = arm
        self._orders = orders
        self._folder = folder
        self._crew = crew
        self._progress = progress
        self._clock = clock
        self._pace = Pace(clock)
        self._follower = follower
        self._began = time.monotonic()
        self._played: list[Program] = []
        self._rival: Program | None = None
        self._page: threading.Thread | None = None
        self._over = threading.Event()
        self.story: dict[str, Any] = {
            "arm": arm.name,
            "command": _command(orders),
            "lines": [],
            "ink": [],
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
        stages[DRAWING].begin("starting")
        drawing = self._begin(DRAWING, ["--realtime"], "drawing", [str(DRIVER), "--stay"])
        stages[TRACKER].begin("choosing goals")  # which takes as long as the other's start
        self._set_scene()
        self._tracker = self._track()
        place, code = self._invitation()
        self._progress.finish(TRACKER, True, f"listens at {place}")
        if self._orders.page:
            address = said(self._tracker, read_page)
            self._page = threading.Thread(target=self._show_page, args=(address,), daemon=True)
            self._page.start()
        home = drawing.home
        part = ahead = self._approach(self._goals[0], home, place, code)
        self._wait(drawing, DRAWN)
        summary = json.loads((home / SUMMARY).read_text(encoding="utf-8"))
        if summary["status"]:
            drawing.program.wait(ENDED)
            raise drawing.program.complain()
        self.story["cpu"] = summary["cpu"]
        lines = self.story["lines"] = summary["paths"]
        self.story["ink"] = _ink(self._views, read_trace(home / "trace.csv"))
        self._progress.finish(DRAWING, report.drawn(lines), report.lines_text(lines))

        for goal, following in zip(self._goals, [*self._goals[1:], None], strict=True):
            stages[goal.name].begin("starting")
            if following:
                ahead = self._approach(following, part.home, place, code)
            if self._rival is None:
                self._compare(goal, home)
            self._wait(part, SERVOED)
            record = approach_of(self._views, goal, part.home, part.program)
            self._take(goal.name, record, "approaches")
            part = ahead
        self.story["pace"] = round(self._pace.mean, 3)
        self._conclude_comparison()
        for program in self._played:
            program.wait(DRAWN)  # it may be at its picture
        if self._page:
            self._page.join()

    def close(self) -> None:
        """Look at nothing any more."""
        self._over.set()
        self._follower.close()

    def _set_scene(self) -> None:
        """Choose cameras and goals.

        Raises:
            DemoFailed: this arm and seed have none.
        """
        text, self._goals = choose_goals(self._arm, self._orders.seed)
        self._views = Views(self._arm, text)
        size = list(self._views["A"].camera.size)
        self.story.update(scene=text, cameras="".join(self._views), size=size)

    def _track(self) -> Program:
        return self._crew.start(
            TRACKER,
            ["track", *["--camera", "synthetic"] * len(self._views), *self._page_words()]
            + ["--scene", self.story["scene"], "--host", "127.0.0.1", "--port", "0"]
            + ["--csv", str(self._folder / "track.csv")]
            + ["--picture", str(self._folder / "camera.png")],
        )

    def _invitation(self) -> tuple[str, str]:
        """Where the tracker listens, and its code; one that fails to start is started again."""
        try:
            return said(self._tracker, read_invitation)
        except DemoFailed as trouble:
            if self._tracker.running:
                raise
            self._say_again(trouble)
            self._tracker = self._track()
            return said(self._tracker, read_invitation)

    def _say_again(self, trouble: DemoFailed) -> None:
        self._progress.say(f"{trouble}; trying once more")

    def _page_words(self) -> list[str]:
        """What the tracker is told of the page; it is to bring no brick along."""
        orders = self._orders
        if not orders.page:
            return ["--no-page"]
        words = ["--page", "--no-brick", "--page-host", orders.page_host]
        words += [] if orders.page_port is None else ["--page-port", str(orders.page_port)]
        return words + ["--open"] * orders.open

    def _show_page(self, address: str) -> None:
        """Tell where the page is, as soon as it answers."""
        deadline = time.monotonic() + READY
        while not answers(address):
            if self._over.wait(LOOK) or not self._tracker.running:
                return
            if time.monotonic() > deadline:
                self._progress.say(f"the page does not answer: {address}")
                return
        self._progress.say(f"page: {address}")

    def _begin(self, name: str, options: Sequence[str], folder: str, script: Sequence[str]) -> Part:
        """Start a program on the emulated brick."""
        home = self._folder / folder
        return Part(name, options, home, script, self._simulate(name, options, home, script))

    def _approach(self, goal: Goal, home: Path, place: str, code: str) -> Part:
        """Start a servo ahead of time; it waits for the run that leaves its files in `home`."""
        folder = goal.name.replace(" ", "-")
        words = [str(self._orders.servo), place, "--code", code, *goal_words(goal)]
        words += ["--log", f"{self._folder / folder}.jsonl"]
        return self._begin(goal.name, ["--realtime", _start(home)], folder, words)

    def _simulate(
        self, name: str, options: Sequence[str], home: Path, script: Sequence[str]
    ) -> Program:
        words = ["simulate", *options, "--arm", os.path.abspath(self._arm.file), "--out", str(home)]
        return self._crew.start(name, [*words, *script], self._progress.stages[name].say)

    def _compare(self, goal: Goal, start: Path) -> None:
        """Start the report's method on its way to a goal, from where another run has ended."""
        self._progress.stages[RIVAL].begin("starting")
        home = self._folder / RIVAL_HOME
        self._rival = self._simulate(
            RIVAL,
            ["--scene", self.story["scene"] + RIVAL_SCENE, _start(start)],
            home,
            [str(self._orders.servo), *goal_words(goal), "--method", "report"]
            + ["--budget", f"{REPORT_BUDGET:g}", "--log", f"{home}.jsonl"],
        )
        # What runs in real time goes first.
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, self._rival.pid, RIVAL_NICE)

    def _conclude_comparison(self) -> None:
        """Take its outcome once; whatever becomes of it does no harm to the demo."""
        if self._rival is None or self._progress.stages[RIVAL].took is not None:
            return
        home = self._folder / RIVAL_HOME
        deadline = time.monotonic() + COMPARED
        while self._rival.running and time.monotonic() < deadline:
            time.sleep(LOOK)
        try:
            self._rival.interrupt()
            self._rival.wait(ENDED)
            approach = approach_of(self._views, self._goals[0], home, self._rival)
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

    def _wait(self, part: Part, limit: float) -> None:
        """Until a run's figures are there; its picture may take longer.

        A run that ends without any has failed to start, and is started once more.

        Raises:
            DemoFailed: it takes longer than `limit` s, or failed twice, or the tracker has ended.
        """
        deadline = Deadline(self._clock, limit)
        again = False
        while not (part.home / SUMMARY).exists():
            if not self._tracker.running:
                self._tracker.wait(ENDED)
                raise self._tracker.complain()
            if not part.program.running and not (part.home / SUMMARY).exists():
                part.program.wait(ENDED)
                trouble = part.program.complain()
                if again or isinstance(trouble, TooBusy):
                    raise trouble
                again = True
                self._say_again(trouble)
                part.program = self._simulate(part.name, part.options, part.home, part.script)
            if deadline.passed:
                raise part.program.hangs(limit)
            self._look()
            time.sleep(LOOK)
        self._look()  # at what came in last, too, or was there at once
        self._played.append(part.program)

    def _look(self) -> None:
        """How fast the emulated clock goes, what the arm has drawn, how the comparison does."""
        self._progress.keep(self._pace.look())
        if "first_ink" not in self.story:
            self._follower.poll()
            if self._follower.pen:
                self.story["first_ink"] = round(time.monotonic() - self._began, 2)
        if self._rival and not self._rival.running:
            self._conclude_comparison()


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


def read_page(line: str) -> str | None:
    """The page's address from what the tracker prints; None of another line."""
    found = re.match(r"page: (http://\S+)", line)
    return found.group(1) if found else None


def answers(address: str) -> bool:
    """Whether a page answers, and be it that nobody is let in."""
    host = urllib.parse.urlsplit(address).netloc
    connection = http.client.HTTPConnection(host, timeout=READY)
    try:
        connection.request("HEAD", "/")
        connection.getresponse()
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()
    return True


def said(tracker: Program, read: Callable[[str], Told | None]) -> Told:
    """What is read from the first line of the tracker that has it."""
    deadline = time.monotonic() + READY
    while time.monotonic() < deadline:
        ended = not tracker.running
        if ended:
            tracker.wait(ENDED)  # until all that it has said is here
        for line in list(tracker.lines):
            told = read(line)
            if told is not None:
                return told
        if ended:
            raise tracker.complain()
        time.sleep(LOOK)
    raise tracker.hangs(READY)


class Row(NamedTuple):
    """One of trace.csv: s, true joint angles (rad), whether the pen was down."""

    t: float
    q: tuple[float, ...]
    pen: bool


def read_trace(file: Path) -> list[Row]:
    """The true motion that `simulate` left.

    Raises:
        DemoFailed: it left none.
    """
    try:
        with file.open(newline="", encoding="ascii") as lines:
            heading, *rows = csv.reader(lines)
            joints = [column for column, name in enumerate(heading) if name.startswith("q")]
            trace = [
                Row(float(row[0]), tuple(float(row[k]) for k in joints), row[-1] == "1")
                for row in rows
            ]
        if trace:
            return trace
        raise ValueError("no row")
    except (OSError, ValueError, IndexError):
        raise DemoFailed(f"{file} cannot be read; is the disk full?") from None


def _starting(home: Path) -> float:
    """How long a program took to start, of which the world's clock knows nothing, s.

    Raises:
        DemoFailed: `simulate` has not told.
    """
    try:
        return json.loads((home / SUMMARY).read_text(encoding="utf-8"))["start_s"] or 0.0
    except (OSError, ValueError, KeyError):
        raise DemoFailed(f"{home / SUMMARY} cannot be read; is the disk full?") from None


def _start(home: Path) -> str:
    """Where another run ends, for the next one."""
    return f"--start={AFTER}{home}"


def goal_words(goal: Goal) -> list[str]:
    """What the servo is told of a goal."""
    return [f"--goal={words}" for words in goal.told]


def approach_of(views: Views, goal: Goal, home: Path, program: Program) -> dict[str, Any]:
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
    zero = notes.run["clock"] - UPTIME - _starting(home)
    path = _path(views, rows)
    tip = views.centre("effector", rows[-1].q)
    record = {
        "name": goal.name,
        "log": log.name,
        "goal": [round(value, 3) for value in goal.pixels],
        "path": [
            [round(t - zero, 3), *(round(value, 2) for value in views.truth(q))] for t, q in path
        ],
        "miss_mm": round(10 * math.dist(tip, goal.place), 3),
    }
    if len(views) > 1:
        record["place"] = [round(value, 3) for value in goal.place]
        record["tips"] = [_rounded(views.centre("effector", q)) for _, q in path]
        record["mm_per_px"] = round(_worth(views, goal.place), 4)
    return record


def _rounded(values: Sequence[float] | np.ndarray) -> list[float]:
    return [round(float(value), 3) for value in values]


def _worth(views: Views, place: Sequence[float]) -> float:
    """How far apart, mm, places near this one may be that are 1 px apart in the pictures.

    That is in the direction in which the cameras together tell least.
    """
    slope = _slope(views.project, tuple(place))
    return 10 / float(np.linalg.svd(slope, compute_uv=False)[-1])


def _ink(views: Views, rows: Sequence[Row]) -> list[list[list[float]]]:
    """The lines drawn in the air: x, y, z (cm) and the pixels of each camera, point by point.

    In the plane the pictures show the ink itself.
    """
    if len(views) == 1:
        return []
    return [
        [[*_rounded(views.centre("effector", q)), *_rounded(views.truth(q))] for _, q in stroke]
        for stroke in (_path(views, run) for run in pen_down_runs(rows))
    ]


LOOK = 0.05
"""Between two looks at whether a program has ended, s."""
SUMMARY = "summary.json"
"""What `simulate` leaves, behind trace.csv."""
RIVAL_HOME = "report-method"
RIVAL_SCENE, RIVAL_NICE = ",fps=10", 10
"""The report takes 20 pictures in 2 s: no more would be looked at."""

FINEST = 0.2
"""Of the true path, points so far apart are kept, px."""
STILL = 1e-4
"""Joints that moved less than this have not moved, rad."""
REST = 0.05
"""After so long a rest it is kept when it ended, s."""


def _path(views: Views, rows: Sequence[Row]) -> list[tuple[float, Vector]]:
    """When (s) the joints truly were where (rad); in the pictures what lies between is straight."""
    kept = rows[0]
    place = views.truth(kept.q)
    path = [(kept.t, kept.q)]
    for before, row in zip(rows, rows[1:], strict=False):
        if row is not rows[-1] and max(map(abs, np.subtract(row.q, kept.q))) < STILL:
            continue
        here = views.truth(row.q)
        if row is rows[-1] or math.dist(here, place) > FINEST:
            if before.t - kept.t > REST:
                path.append((before.t, kept.q))
            path.append((row.t, row.q))
            kept, place = row, here
    return path
