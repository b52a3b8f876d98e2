"""Faults, measured: each kind by name, and dead encoders, stalls, pulled cables at random moments.

One seed is one task on one arm: a drawing, a servo run or homing, by the brick's own scripts on a
scattered plant.  It runs once undisturbed, then with one fault after another.  The undisturbed run
tells what a healthy arm would have done: its encoders' counts, angles and speeds.
"""

from __future__ import annotations

import bisect
import contextlib
import io
import math
import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, NamedTuple

from laptop.bench import workers
from laptop.bench.draw import random_line
from laptop.bench.servo_setups import PinholeCamera, PinholeCameras, apart
from laptop.simulator.device.brick import EmulatedBrick
from laptop.simulator.device.plant_constants import CPU, read_plant
from laptop.simulator.scene.scene_constants import read_scene
from laptop.simulator.session import Fault
from laptop.simulator.session import run as run_session
from laptop.simulator.virtual_tracker import VirtualTracker
from robot import driver, visual_servoing
from robot.motion import kinematics, paths, trajectory
from shared.arm_description import Arm, find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
COMMANDS = ("draw", "servo", "home")
KINDS = ("dead-encoder", "stall", "unplug")
FAULTS_PER_SEED = 5

NAMED_AT = 0.5
"""Share of an undisturbed run's motion at which a named fault comes."""

NAMED = (
    ("unplug", "A"), ("unplug", "B"), ("stall", "A"), ("stall", "B"), ("dead-encoder", "A"),
    ("dead-encoder", "B"), ("slow-sysfs", 0.05), ("freeze", None), ("kill", None), ("int", None),
    ("term", None), ("hup", None),
)  # fmt: skip
"""Kinds and what they strike, for every command."""

NAMED_OF = {
    "draw": (("unplug", "C"), ("stall", "C"), ("dead-encoder", "C"), ("push", "C")),
    "servo": (("frozen-picture", None),),
    "home": (),
}
"""And for one of them."""

HEADINGS = (
    "arm", "command", "fault", "runs", "ended well", "at rest, s p50/max", "late",
    "beyond the plan", "too far", "beyond a limit", "past it", "speed - allowed", "too fast",
)  # fmt: skip
LEGEND = (
    "at rest: from when a healthy joint would have counted twice (late: over 0.3 s); degrees "
    "beyond the plan (too far: over 10) and a limit (past it: over 3); deg/s above the greater of "
    "1.2 times the planned speed and 20 above it"
)
NAMED_HEADINGS = ("command", "fault", "at, s", "at rest after, s", "status", "what it says")

REST_GOAL = 0.3
"""Longest time until all joints rest, from when a healthy joint would have counted twice, s."""

TURN_GOAL, LIMIT_GOAL = 10.0, 3.0
"""Greatest angles beyond the plan, and beyond a limit, degrees."""

SPEED_SHARE, SPEED_EXCESS = 1.2, 20.0
"""Greatest speed: the greater of so many times the planned one, and of so much above it, deg/s."""

RESTING = 2.0
"""Speed below which a joint rests, deg/s."""

SPEED_TIME = 0.02
"""Speeds are means over this time, s."""

PLAN_TIME = 0.2
"""What the plan was so long before and after counts as planned, s."""

NOISE = 0.5
"""Of a marker's place, px."""

PEN_LEAD = 0.2
"""The pen's motor sets out so long before it touches the paper, s."""


class Task(NamedTuple):
    """Task of one seed: an arm's name, a command, and the script with its words and start."""

    arm: str
    command: str
    script: str
    words: tuple[str, ...]
    start: str
    plant: str
    cameras: dict[str, str]
    seed: int


@dataclass(frozen=True)
class FaultResult:
    """One fault in one task: degrees, deg/s, s.

    Attributes:
        noticed: whether the program ended by it; else it ended well all the same.
        rest: from when a healthy joint would have counted twice until all rest; None where it
            would not have.
        beyond: greatest angle beyond what was planned.
        over: greatest angle beyond a joint's limit.
        speed, allowed: greatest speed, and how fast it may be.
        text: last line on stderr.
    """

    arm: str
    command: str
    kind: str
    what: str
    t: float
    seed: int
    noticed: bool
    rest: float | None
    beyond: float
    over: float
    speed: float
    allowed: float
    status: int
    text: str

    @property
    def misses(self) -> tuple[str, ...]:
        """Goals that do not hold."""
        if not self.noticed:
            return ()
        return tuple(
            name
            for name, missed in (
                ("time", self.rest is not None and self.rest > REST_GOAL),
                ("angle", self.beyond > TURN_GOAL),
                ("limit", self.over > LIMIT_GOAL),
                ("speed", self.speed > self.allowed),
            )
            if missed
        )


class Motion:
    """What truly happened in one run: angles and speeds of links every 5 ms, counts at ports."""

    def __init__(self) -> None:
        self.counted: dict[str, list[tuple[float, int]]] = defaultdict(list)
        self.brick: EmulatedBrick | None = None
        self._before: dict[str, int] = {}

    def watch(self, brick: EmulatedBrick) -> None:
        """Note when each encoder counts from now on."""
        self.brick = brick
        self._before = {port: motor.position for port, motor in brick.motors.items()}
        self.counted.update({port: [(0.0, counts)] for port, counts in self._before.items()})
        brick.world.bodies.append(self._note)

    def _note(self, t: float) -> None:
        assert self.brick is not None
        for port, motor in self.brick.motors.items():
            if motor.position != self._before[port]:
                self._before[port] = motor.position
                self.counted[port].append((t, motor.position))

    def finish(self) -> None:
        """Work out angles (deg) and speeds (deg/s) from the brick's record."""
        assert self.brick is not None
        record = self.brick.record
        self.t = [sample.t for sample in record]
        self.q = [[math.degrees(a) for a in sample.q] for sample in record]
        n = max(1, round(SPEED_TIME / (record[1].t - record[0].t)))
        self.speeds = [
            [abs(a - b) / SPEED_TIME for a, b in zip(q, before, strict=True)]
            for q, before in zip(self.q[n:], self.q, strict=False)
        ]
        self.speeds[:0] = [[0.0] * len(self.q[0])] * n
        self.record, self.brick = record, None

    def between(self, begin: float, end: float) -> slice:
        """Samples between two times, at least one."""
        first = min(bisect.bisect_left(self.t, begin), len(self.t) - 1)
        return slice(first, max(bisect.bisect_right(self.t, end), first + 1))

    def moving(self) -> list[float]:
        """Times at which the arm moves, s."""
        return [t for t, q in zip(self.t, self.speeds, strict=True) if max(q) > RESTING]

    def counts_twice(self, port: str, t: float) -> float | None:
        """When the encoder at a port has counted twice from time `t` on, s; None if never."""
        counted = self.counted[port]
        now = bisect.bisect_right(counted, (t, math.inf))
        before = counted[now - 1][1]
        return next((then for then, counts in counted[now:] if abs(counts - before) >= 2), None)

    def rests_from(self) -> float:
        """Time of the last motion."""
        for t, speeds in zip(reversed(self.t), reversed(self.speeds), strict=True):
            if max(speeds) > RESTING:
                return t
        return 0.0


def _pose(arm: Arm, draw: random.Random) -> tuple[float, ...]:
    """A pose well within the limits, bent, off the table."""
    while True:
        q = tuple(
            draw.uniform(
                0.8 * joint.lower + 0.2 * joint.upper, 0.2 * joint.lower + 0.8 * joint.upper
            )
            for joint in arm.joints
        )
        bent = 20 < abs(math.degrees(q[-1])) < 125
        if bent and (len(q) == 2 or min(p[-1] for p in kinematics.joint_positions(arm, q)[1:]) > 3):
            return q


def _written(points: Sequence[Sequence[float]]) -> tuple[str, ...]:
    return tuple(",".join(f"{x:.2f}" for x in point) for point in points)


def _drawing(arm: Arm, draw: random.Random) -> tuple[str, ...]:
    """Words of a drawing that can be reached: a line, or two of them."""
    while True:
        a, b = random_line(arm, draw.randrange(10**6))
        if draw.random() < 0.5:
            return ("line", *_written((a, b)))
        c = random_line(arm, draw.randrange(10**6))[0]
        try:
            trajectory.plan(arm, paths.polyline([a, b, c]), None, None)
        except kinematics.Unreachable:
            continue
        return ("polyline", *_written((a, b, c)))


def _servo(arm: Arm, draw: random.Random) -> tuple[tuple[str, ...], str, dict[str, str]]:
    """Words, start and cameras of a servo run whose goal can be reached."""
    while True:
        texts = {"A": f"tilt={draw.uniform(0, 30):.1f},azimuth={draw.uniform(-180, 180):.1f}"}
        if len(arm.joints) == 3:
            texts["B"] = f"tilt={draw.uniform(75, 90):.1f},azimuth={draw.uniform(-180, 180):.1f}"
        cameras = _cameras(arm, texts)
        start, goal = _pose(arm, draw), _pose(arm, draw)
        if not (cameras.shows(start) and cameras.shows(goal)):
            continue
        if apart(cameras(start), cameras(goal)) < 80:
            continue
        words = [f"--mode={draw.choice(('look', 'stream'))}"]
        for name, (u, v) in cameras(goal).items():
            words += ["--goal", f"{name}:{u:.0f},{v:.0f}"]
        return tuple(words), ",".join(f"{math.degrees(a):.2f}" for a in start), texts


def _cameras(arm: Arm, texts: dict[str, str]) -> PinholeCameras:
    return PinholeCameras(
        {name: PinholeCamera(arm, read_scene(text, name)) for name, text in texts.items()}
    )


def task(seed: int, cpu: float) -> Task:
    """The task of a seed."""
    draw = random.Random(f"faults/{seed}")
    name = ARMS[seed % len(ARMS)]
    command = COMMANDS[seed // len(ARMS) % len(COMMANDS)]
    arm = read_arm(find_arm(name))
    plant = f"seed={seed},cpu={cpu:g}"
    if command == "servo":
        words, start, cameras = _servo(arm, draw)
        return Task(name, command, visual_servoing.__file__, words, start, plant, cameras, seed)
    words = _drawing(arm, draw) if command == "draw" else ("home",)
    start = "lost" if command == "home" else "home"
    return Task(name, command, driver.__file__, words, start, plant, {}, seed)


def perform(it: Task, faults: Sequence[Fault] = ()) -> tuple[Motion, int, str]:
    """Run a task: what happened, exit status, last line on stderr."""
    arm = read_arm(find_arm(it.arm))
    motion = Motion()

    @contextlib.contextmanager
    def watched(brick: EmulatedBrick) -> Iterator[VirtualTracker | None]:
        motion.watch(brick)
        if not it.cameras:
            yield None
            return
        cameras = _cameras(arm, it.cameras)
        noise = random.Random(f"{it.seed}/noise")

        def see(name: str, index: int, t: float) -> dict[str, Any]:
            u, v = cameras[name](brick.plant.q)
            return {"effector": (u + noise.gauss(0, NOISE), v + noise.gauss(0, NOISE), 1.0)}

        with VirtualTracker(brick.world, see, cameras=tuple(cameras), seed=it.seed) as tracker:
            yield tracker

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        result = run_session(
            arm, it.script, it.words, read_plant(it.plant), it.start, faults, watched=watched
        )
    motion.finish()
    lines = err.getvalue().strip().splitlines()
    return motion, result.outcome.status, lines[-1] if lines else ""


def drawn_faults(it: Task, healthy: Motion) -> list[Fault]:
    """Faults of a task, at random while the arm moves."""
    draw = random.Random(f"{it.seed}/faults")
    ports = [joint.port for joint in read_arm(find_arm(it.arm)).joints]
    moving = healthy.moving()
    return [
        Fault(draw.choice(KINDS), draw.choice(ports), draw.uniform(0, 0.01) + draw.choice(moving))
        for _ in range(FAULTS_PER_SEED)
    ]


def judge(
    it: Task, fault: Fault, healthy: Motion, status: int, motion: Motion, text: str
) -> FaultResult:
    """Compare a disturbed run with the undisturbed one."""
    arm = read_arm(find_arm(it.arm))
    due = healthy.counts_twice(fault.what, fault.t)
    rest = motion.rests_from()
    planned = healthy.between(fault.t - PLAN_TIME, max(rest, fault.t) + PLAN_TIME)
    after = motion.between(fault.t, math.inf)
    noticed = status != 0
    beyond = over = speed = allowed = 0.0
    if noticed:
        worst = -math.inf
        for k, joint in enumerate(arm.joints):
            angles = [q[k] for q in motion.q[after]]
            plan = [q[k] for q in healthy.q[planned]]
            beyond = max(beyond, max(angles) - max(plan), min(plan) - min(angles))
            over = max(
                over,
                max(angles) - math.degrees(joint.upper),
                math.degrees(joint.lower) - min(angles),
            )
            fastest = max(s[k] for s in motion.speeds[after])
            wanted = max(s[k] for s in healthy.speeds[planned])
            may = max(SPEED_SHARE * wanted, wanted + SPEED_EXCESS)
            if fastest - may > worst:
                worst, speed, allowed = fastest - may, fastest, may
    if it.command == "home":
        over = 0.0  # the stops are what it looks for, and nothing gets past them
    return FaultResult(
        it.arm, it.command, fault.kind, fault.what or "", fault.t, it.seed, noticed,
        None if due is None else rest - due, beyond, over, speed, allowed, status, text,
    )  # fmt: skip


def run_case(case: tuple[int, float]) -> list[FaultResult]:
    """Run all faults of one seed; none if the undisturbed run does not end well."""
    it = task(*case)
    healthy, status, _ = perform(it)
    if status:
        return []
    results = []
    for fault in drawn_faults(it, healthy):
        motion, status, text = perform(it, [fault])
        results.append(judge(it, fault, healthy, status, motion, text))
    return results


def run(
    seeds: range, cpu: float = CPU, executor: Executor | None = None
) -> Iterator[list[FaultResult]]:
    """Yield the results of all seeds in their order."""
    return workers.map_cases(run_case, [(seed, cpu) for seed in seeds], executor=executor)


def table(results: Sequence[FaultResult]) -> list[tuple[str, ...]]:
    """Rows of all arms, commands and kinds, then of each."""
    groups = defaultdict(list)
    for result in results:
        groups[result.arm, result.command, result.kind].append(result)
        groups["all", "all", result.kind].append(result)
    order = {key: n for n, key in enumerate(("all", *ARMS, *COMMANDS, *KINDS))}
    return [
        (*key, *_row(group))
        for key, group in sorted(groups.items(), key=lambda item: [order[k] for k in item[0]])
    ]


def _row(group: Sequence[FaultResult]) -> tuple[str, ...]:
    struck = [result for result in group if result.noticed]
    rests = sorted(result.rest for result in struck if result.rest is not None)

    def most(values: Sequence[float], unit: str = "") -> str:
        return f"{max(values):.1f}{unit}" if values else "-"

    def missing(goal: str) -> str:
        return str(sum(goal in result.misses for result in struck))

    return (
        str(len(group)),
        str(len(group) - len(struck)),
        f"{rests[len(rests) // 2]:.2f}/{rests[-1]:.2f}" if rests else "-",
        missing("time"),
        most([result.beyond for result in struck]),
        missing("angle"),
        most([result.over for result in struck]),
        missing("limit"),
        most([result.speed - result.allowed for result in struck]),
        missing("speed"),
    )


class NamedResult(NamedTuple):
    """One named fault: when it came and after how long all joints rested, s; what was said."""

    command: str
    fault: str
    t: float
    rest: float
    status: int
    text: str


def named_cases(cpu: float) -> list[tuple[int, str, Any, float]]:
    """(seed of a task of the planar arm, kind, what, slowness) of all faults."""
    return [
        (len(ARMS) * n, kind, what, cpu)
        for n, command in enumerate(COMMANDS)
        for kind, what in NAMED + NAMED_OF[command]
    ]


def run_named(case: tuple[int, str, Any, float]) -> NamedResult:
    """Let one fault strike in the middle of a task's motion."""
    seed, kind, what, cpu = case
    it = task(seed, cpu)
    healthy, _, _ = perform(it)
    moving = healthy.moving()
    if what == "C" and kind != "push":  # the pen, when it is lowered next
        moving = [next(sample.t for sample in healthy.record if sample.pen) - PEN_LEAD]
    fault = Fault(kind, what, moving[int(NAMED_AT * len(moving))])
    motion, status, text = perform(it, [fault])
    shown = kind if what is None else f"{kind}:{what}"
    rest = max(0.0, motion.rests_from() - fault.t)
    return NamedResult(it.command, shown, fault.t, rest, status, text)


def run_all_named(cpu: float = CPU, executor: Executor | None = None) -> Iterator[NamedResult]:
    """Yield the results of all named faults in their order."""
    return workers.map_cases(run_named, named_cases(cpu), executor=executor)


def named_table(results: Sequence[NamedResult]) -> list[tuple[str, ...]]:
    """A row for each."""
    return [
        (
            r.command,
            r.fault,
            f"{r.t:.2f}",
            f"{r.rest:.2f}",
            str(r.status),
            r.text.split(": ", 1)[-1],
        )
        for r in results
    ]


def _reason(text: str) -> str:
    """What is said, without the script's name."""
    return text.split(": ", 1)[-1]
