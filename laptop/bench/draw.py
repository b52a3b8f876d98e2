"""Drawing of lines: smooth ones beside steps, timed steps and the encoders' floor.

The *floor* of a line is the deviation of a perfect controller that knows each joint to half an
encoder count: half a count at every joint in the worst signs, mapped through the Jacobian onto the
line's normal, at its largest along the line.

In space the question is the effect of gravity, and the driver's answer to it.  It feeds the weight
forward, and counts on it to press the backlash to one side, the *preload*.
"""

from __future__ import annotations

import itertools
import math
import random
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from laptop.bench import timed_steps
from laptop.bench.bench import BenchRecord, BenchTable, grouped, percentile, seeds_of
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.masses import weighed
from laptop.emulator.device.plant_constants import CPU, read_plant
from laptop.emulator.rig import Rig
from laptop.record.figures import line_accuracy
from robot.drawing_commands import LINES
from robot.motion import kinematics, paths, trajectory
from shared.arm_description import Arm, find_arm, read_arm

if TYPE_CHECKING:
    from laptop.emulator.device.plant_constants import PlantConstants

Point = tuple[float, float]
Line = tuple[tuple[float, ...], tuple[float, ...]]
Row = tuple[str, ...]

METHODS = {"planar": ("smooth", "steps", *timed_steps.LAWS), "geared": ("smooth", "steps")}
"""Methods for each arm in the plane; timed steps are for direct drive, as in their program."""

CONDITIONS = (
    ("backlash 0", "backlash=0", 0.0),
    ("backlash 2", "backlash=2", 2.0),
    ("backlash 3", "backlash=3", 3.0),
    ("3 described as 2", "backlash=3", 2.0),
)
"""Name, true plant, and the backlash (deg) in the arm's description."""

RANDOM_PLANTS = ("random plants", "backlash=2,seed={}", 2.0)
"""The same of plants that are drawn with a seed."""

ELBOW_DOWN = ", elbow down"
"""Words for a posture with the classic program's elbow."""


class Weight(NamedTuple):
    """Gravity on an arm in space, and the driver's knowledge of it.

    labels: on feedforward and preload, for the table.
    plant: text of the constants that differ.
    known: class Gravity, arm and plant -> the driver's model of gravity.
    """

    labels: tuple[str, str] = ("fed forward", "counted on")
    plant: str = ""
    known: Callable[[Any, Arm, PlantConstants], Any] = lambda gravity, arm, plant: gravity(arm)


WEIGHTS = {
    "felt": Weight(),
    "no preload": Weight(
        ("fed forward", "not counted on"), known=lambda g, arm, plant: g(arm, preloads=False)
    ),
    "not fed forward": Weight(
        ("not fed forward", "counted on"), known=lambda g, arm, plant: g(arm, known=False)
    ),
    "off": Weight(("off", "-"), "gravity=0", lambda g, arm, plant: g(arm, g=0.0)),
    "measured": Weight(
        ("fed forward", "counted on, measured"),
        known=lambda g, arm, plant: g(weighed(arm, plant)),
    ),
}
"""Weights by name."""

EVERY_JOINT = "every joint"
"""Word for backlash at all joints."""


@dataclass(frozen=True)
class DrawCase:
    """One line to draw: which arm, how, on which plant, and the backlash (deg) described.

    `at` names the joint with the described backlash, or EVERY_JOINT; `weight` is a key of WEIGHTS.
    `elbow` is "up" or "down", the arm's own if None.
    """

    arm: str
    method: str
    condition: str
    plant: str
    described: float
    line: Line
    name: str
    at: str = EVERY_JOINT
    weight: str = "felt"
    cpu: float = CPU
    elbow: str | None = None


@dataclass(frozen=True)
class DrawResult:
    """One line drawn: mm, s; `error` is the reason why it was not.

    `short` is the missing length along the line, negative where it was drawn past its end.
    """

    arm: str
    method: str
    condition: str
    line: str
    floor: float
    greatest: float
    rms: float
    end: float
    short: float
    seconds: float
    accesses: int
    error: str


def described(name: str, backlash: float, at: str = EVERY_JOINT) -> Arm:
    """Return the arm of that name, described with `backlash` degrees at every joint, or at one."""
    arm = read_arm(find_arm(name))
    joints = tuple(
        joint._replace(backlash=math.radians(backlash) if at in (joint.name, EVERY_JOINT) else 0.0)
        for joint in arm.joints
    )
    return arm._replace(joints=joints)


def floor(arm: Arm, line: Line) -> float:
    """Return the line's floor, mm (see the module's docstring)."""
    direction = np.subtract(*line) / math.dist(*line)
    errors = half_counts(arm)
    joints = trajectory.joint_path(arm, paths.spread(line), arm.elbow)
    return 10 * max(
        deviation_across(direction, np.array(kinematics.jacobian(arm, q)), errors) for q in joints
    )


def half_counts(arm: Arm) -> np.ndarray:
    """Return half a count at every joint with all signs, one a column, rad."""
    halves = [math.radians(0.5) / joint.gear for joint in arm.joints]
    return np.array(list(itertools.product(*((-half, half) for half in halves)))).T


def deviation_across(direction: np.ndarray, jacobian: np.ndarray, errors: np.ndarray) -> float:
    """Return the greatest deviation, cm, across a unit direction, by errors (joints, n), rad."""
    across = np.eye(len(direction)) - np.outer(direction, direction)
    return float(np.linalg.norm(across @ jacobian @ errors, axis=0).max())


def random_line(arm: Arm, seed: int) -> Line:
    """Return a reachable line of at least 4 cm."""
    draw = random.Random(seed)
    reach, size = sum(joint.link for joint in arm.joints), kinematics.coordinates(arm)
    while True:
        a, b = (tuple(draw.uniform(-reach, reach) for _ in range(size)) for _ in range(2))
        if math.dist(a, b) < 4:
            continue
        try:
            for end in a, b:  # most do not even begin or end within reach
                kinematics.branches(arm, end)
            trajectory.joint_path(arm, paths.spread((a, b)), arm.elbow)
        except kinematics.Unreachable:
            continue
        return a, b


def cases(seeds: range) -> Iterator[DrawCase]:
    """Yield every line under every condition, random ones also on their seed's random plant."""
    for arm_name in METHODS:
        arm = read_arm(find_arm(arm_name))
        own = LINES[kinematics.coordinates(arm)]
        lines = [(f"line {n}", line) for n, line in enumerate(own, 1)]
        random_lines = [("random", random_line(arm, seed)) for seed in seeds]
        for method in METHODS[arm_name]:
            for condition, plant, backlash in CONDITIONS:
                for name, line in lines + random_lines:
                    yield DrawCase(arm_name, method, condition, plant, backlash, line, name)
            condition, plant, backlash = RANDOM_PLANTS
            for k, seed in enumerate(seeds):
                for name, line in [*lines, random_lines[k]]:
                    yield DrawCase(
                        arm_name, method, condition, plant.format(seed), backlash, line, name
                    )
    yield from _elbow_down(seeds)


def _elbow_down(seeds: range) -> Iterator[DrawCase]:
    """Yield the three lines as the classic program draws them, by every method of its arm."""
    nominal, plant, backlash = CONDITIONS[1]
    plants = [
        (nominal, plant),
        *((RANDOM_PLANTS[0], RANDOM_PLANTS[1].format(seed)) for seed in seeds),
    ]
    for method in METHODS["planar"]:
        for condition, plant in plants:
            for n, line in enumerate(LINES[2], 1):
                label, name = condition + ELBOW_DOWN, f"line {n}"
                yield DrawCase("planar", method, label, plant, backlash, line, name, elbow="down")


class _CountingClock:
    """The world's clock, with a count of accesses per control tick.

    Args:
        brick: whose accesses are counted.
        clock: the program's.
    """

    def __init__(self, brick: EmulatedBrick, clock: Any) -> None:
        self._brick, self._clock = brick, clock
        self._last = 0
        self._made: list[tuple[float, int]] = []
        self.now = clock.now

    def sleep(self, seconds: float) -> None:
        made = self._brick.sysfs.accesses
        self._made.append((self._brick.world.now(), made - self._last))
        self._clock.sleep(seconds)
        self._last = made

    def usual(self) -> int:
        """Return the accesses of the median tick with the pen down."""
        inked = [sample.t for sample in self._brick.record if sample.pen]
        ticks = [made for t, made in self._made if inked and inked[0] <= t <= inked[-1]]
        return int(np.median(ticks)) if ticks else 0


def _drawn(case: DrawCase) -> tuple[Rig, int, str]:
    """Draw a line with the real driver; return the rig, accesses per tick, and the error or ""."""
    arm = described(case.arm, case.described, case.at)
    arm = arm._replace(elbow=case.elbow or arm.elbow)
    weight = WEIGHTS[case.weight]
    plant = read_plant(",".join(filter(None, (case.plant, weight.plant, f"cpu={case.cpu}"))))
    error = ""
    with Rig(arm, plant=plant) as rig, rig.program() as program:
        clock = _CountingClock(rig.brick, program.clock)
        zero = program["robot.motion.zero"].Zero(arm, rig.state_folder)
        gravity = weight.known(program["robot.motion.gravity"].Gravity, arm, plant)
        robot = program["robot.motion.arm"].RobotArm(
            arm, clock, zero, gravity=gravity, say=lambda line: None
        )
        try:
            robot.load_zero()
            driver = program["robot.driver"].Driver(robot, elbow=arm.elbow, say=lambda line: None)
            if case.method in timed_steps.LAWS:
                law = timed_steps.LAWS[case.method]
                timed_steps.draw_line(program, driver, *case.line, law)
            else:
                driver.draw_line(*case.line, method=case.method)
            robot.park()
        except Exception as problem:  # a crash is a result here, and must not end the bench
            error = f"{type(problem).__name__}: {problem}"
    return rig, clock.usual(), error


def draw(case: DrawCase) -> DrawResult:
    """Draw one line on the emulated brick, and measure the true ink."""
    rig, accesses, error = _drawn(case)
    assert rig.built is not None, "`_drawn` gives a rig with an arm"
    measure = line_accuracy.measure(rig.record, [case.line])[0]
    return DrawResult(
        case.arm,
        case.method,
        case.condition,
        case.name,
        floor(rig.built, case.line),
        measure.greatest_mm if measure else math.nan,
        measure.rms_mm if measure else math.nan,
        measure.end_mm if measure else math.nan,
        10 * (measure.length_cm - measure.lateral[-1][0]) if measure else math.nan,
        measure.seconds if measure else math.nan,
        accesses,
        error,
    )


HEADINGS: Row = (
    "arm", "method", "plant", "line", "floor mm", "greatest mm", "in floors", "rms mm",
    "rms in floors", "end mm", "end in floors", "short mm", "time s", "accesses/tick", "failed",
)  # fmt: skip


def table(results: list[DrawResult]) -> list[Row]:
    """Return one row per arm, method, plant and line; many lines as their median and p95."""
    rows = []
    groups = grouped(results, lambda r: (r.arm, r.method, r.condition, r.line))
    for key, group in groups.items():
        quantiles = [("", 50)] if len(group) == 1 else [(" p50", 50), (" p95", 95)]
        for suffix, q in quantiles:
            name = f"{len(group)} x {key[3]}{suffix}" if suffix else key[3]
            failed = sum(1 for r in group if r.error)
            rows.append((*key[:3], name, *_figures(group, q), f"{failed}"))
    return rows


def _figures(group: list[DrawResult], q: int) -> Row:
    """Return the group's percentiles; a line that was not drawn is infinitely far off."""
    out = [f"{percentile([r.floor for r in group], q):.2f}"]
    for field in ("greatest", "rms", "end"):
        values = [math.inf if r.error else getattr(r, field) for r in group]
        ratios = [value / r.floor for value, r in zip(values, group, strict=True)]
        out += [f"{percentile(values, q):.2f}", f"{percentile(ratios, q):.2f}"]
    out = ["failed" if figure == "inf" else figure for figure in out]
    short, seconds, accesses = (
        f"{percentile([getattr(r, field) for r in group], q):.{digits}f}"
        for field, digits in (("short", 1), ("seconds", 1), ("accesses", 0))
    )
    return (*out, short, seconds, accesses)


def failures(results: list[DrawResult]) -> dict[str, int]:
    """Return the reasons why lines were not drawn, numbers aside, and how often each came."""
    reasons = (
        f"{r.arm}, {r.method}, {r.condition}: {re.sub('-?[0-9.]+ ', 'N ', r.error)}"
        for r in results
        if r.error
    )
    return dict(Counter(reasons))


SPACE_LINES = ("upright", "level", "slanting", "random")

SPACE_HEADINGS: Row = (
    "2 deg of play at", "gravity", "preload",
    *(heading for line in SPACE_LINES for heading in (line, f"{line} in floors")), "failed",
)  # fmt: skip


def space_cases(seeds: range) -> list[DrawCase]:
    """Return the three lines in space, with backlash at each joint in turn; and random plants."""
    arm = read_arm(find_arm("spatial"))
    own = list(zip(SPACE_LINES, LINES[3], strict=False))

    def under(backlash: float, at: str, weight: str, method: str = "smooth") -> Iterator[DrawCase]:
        where = at if backlash else "none"
        if method == "steps":
            where += ", the report's steps"
        gravity, preload = WEIGHTS[weight].labels
        condition = "; ".join((where, gravity, preload if backlash else "-"))
        for name, line in own:
            yield DrawCase("spatial", method, condition, "", backlash, line, name, at, weight)

    out = [
        case
        for backlash, at in [(0.0, EVERY_JOINT), *((2.0, joint.name) for joint in arm.joints)]
        for weight in ("off", "felt", "not fed forward" if not backlash else "no preload")
        for case in under(backlash, at, weight)
    ]
    for weight in ("off", "felt", "no preload", "not fed forward"):
        out += under(2.0, EVERY_JOINT, weight)
    out += under(2.0, EVERY_JOINT, "felt", "steps")
    for weight in ("felt", "measured", "no preload"):
        condition = "; ".join((f"every joint, {len(seeds)} plants", *WEIGHTS[weight].labels))
        out += [
            DrawCase("spatial", "smooth", condition, f"seed={seed}", 2.0, line, name, weight=weight)
            for seed in seeds
            for name, line in [*own, ("random", random_line(arm, seed))]
        ]
    return out


def space_table(results: list[DrawResult]) -> list[Row]:
    """Return one row per condition, with the greatest deviation of each line; many as p50, p95."""
    rows = []
    for condition, group in grouped(results, lambda r: r.condition).items():
        lines = grouped(group, lambda r: r.line)
        many = max(map(len, lines.values())) > 1
        failed = sum(1 for r in group if r.error)
        parts = condition.split("; ")
        for suffix, q in [(", p50", 50), (", p95", 95)] if many else [("", 50)]:
            figures = [
                _figures(lines[name], q)[1:3] if name in lines else ("", "") for name in SPACE_LINES
            ]
            names = (*parts[:-1], parts[-1] + suffix)
            rows.append((*names, *itertools.chain(*figures), f"{failed}"))
    return rows


def sag(weight: str, cpu: float = CPU) -> float:
    """Return the sag of the level line at its lowest, mm, without backlash, under a `weight`."""
    line = LINES[3][SPACE_LINES.index("level")]
    case = DrawCase("spatial", "smooth", "", "", 0.0, line, "level", weight=weight, cpu=cpu)
    rig, _, _ = _drawn(case)
    heights = [sample.z for sample in rig.record if sample.pen and sample.z is not None]
    return 10 * (line[0][2] - min(heights))


def _shown(results: list[DrawResult], it: Any) -> Iterator[BenchTable | str]:
    title = f"{seeds_of(it)}, cpu={it.cpu:g}, figures from the emulator, mm"
    if it.arm == "spatial":
        title += "; greatest deviations"
        yield BenchTable(title, SPACE_HEADINGS, space_table(results), 1)
        sags = [f"{sag(weight, it.cpu):.2f} mm" for weight in ("not fed forward", "felt", "off")]
        yield (
            "the level line hangs through by {}; with the weight fed forward {}; without "
            "gravity {}".format(*sags)
        )
    else:
        yield BenchTable(title, HEADINGS, table(results), 3)
    yield from (f"{count} x {reason}" for reason, count in failures(results).items())


def _cases(it: Any) -> list[DrawCase]:
    drawings = space_cases if it.arm == "spatial" else cases
    return [replace(case, cpu=it.cpu) for case in drawings(it.seeds)]


BENCH = BenchRecord("drawing", _cases, draw, _shown, chunk=4)
