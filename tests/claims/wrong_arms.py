"""Arms that are built otherwise than their file says: what is said of them, and how far they turn.

Each seed draws an arm and what is wrong with it. Mounted the other way round or swapped, it is
looked at by `driver.py check`; without stops, or with touch sensors, it is homed from where
somebody put it. As many right arms must pass. Angles are the true ones of the emulated links, as
trace.csv has them.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import math
import os
import random
import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, seeds_of
from laptop.emulator.brick_home import UNCHECKED
from laptop.emulator.device.brick import EmulatedBrick
from laptop.emulator.device.plant_constants import CPU
from laptop.emulator.onlooker import Onlooker
from laptop.emulator.rig import Rig
from laptop.emulator.simulation_result import SimulationResult
from shared.arm_description import SEEK_BEYOND, Arm, find_arm, read_arm
from tests.claims.limits_passed import beyond_limits

WRONG, RIGHT = ("reversed", "swapped", "no stops", "touch"), "right"
"""Kinds of arms; the seeds take the wrong ones in turn."""

MOST_TURNED = 15.0
"""Angle that nothing may turn before what is wrong is named, deg."""

PUT_WITHIN, STOPS_PUT_WITHIN = 8.0, 14.0
"""How exactly somebody puts a joint at home, deg: for touch sensors or for no stops, for stops."""

ZERO_WITHIN = 3.0
"""A zero is right that ends a joint so near to its home, deg: play, and what it settles within."""

HEADINGS = (
    "seed", "arm", "what is wrong", "status", "turned, deg", "beyond a limit, deg\ncounted / truly",
    "as it should be", "what is said",
)  # fmt: skip


@dataclass(frozen=True)
class WrongArmCase:
    """One arm: what it was drawn by, its kind, and how slowly its brick computes."""

    seed: int
    kind: str
    cpu: float = CPU


@dataclass(frozen=True)
class WrongArmResult:
    """What became of one arm.

    Attributes:
        wrong: what is wrong, in words.
        turned: greatest angle by which a joint ever was from where it stood, deg; in `check`.
        beyond: how far beyond its limits a joint was, deg, counted from where it was put as home.
        truly: the same by its true angle.
        said: last line on stdout or stderr.
        good: whether all is as it should be.
    """

    seed: int
    arm: str
    kind: str
    wrong: str
    status: int
    turned: float
    beyond: float
    truly: float
    said: str
    good: bool


def cases(seeds: range, cpu: float = CPU) -> list[WrongArmCase]:
    """List the cases of these seeds: the wrong arms, then the right ones."""
    wrong = [WrongArmCase(seed, WRONG[seed % len(WRONG)], cpu) for seed in seeds]
    return wrong + [WrongArmCase(seed, RIGHT, cpu) for seed in seeds]


def run_case(case: WrongArmCase) -> WrongArmResult:
    """Draw one arm, and check or home it."""
    draw = random.Random(f"{case.kind}/{case.seed}")
    mounted = case.kind in ("reversed", "swapped")
    name = draw.choice(("planar", "geared", "spatial") if mounted else ("planar", "geared"))
    with tempfile.TemporaryDirectory() as folder:
        arm, built, wrong = _drawn(case.kind, draw, name, Path(folder))
        if mounted:
            return _checked(case, arm, built, wrong)
        put = STOPS_PUT_WITHIN if case.kind == RIGHT else PUT_WITHIN
        start = [draw.uniform(-put, put) for _ in arm.joints]
        homed = _homed(case, arm, built, wrong, start)
        if case.kind == RIGHT:
            passed = _checked(case, arm, built, wrong)
            if not passed.good:
                return passed
        return homed


def _drawn(kind: str, draw: random.Random, name: str, folder: Path) -> tuple[Arm, Arm, str]:
    """An arm as its file has it, the same as it was built, and what is wrong, in words."""
    arm = read_arm(find_arm(name))
    lines: list[dict[str, str]] = [{} for _ in arm.joints]
    if kind == RIGHT:
        lines = [{"find_home": "both"} for _ in arm.joints]
    elif kind == "no stops":
        lines = [{"find_home": draw.choice(("both", "lower", "upper"))} for _ in arm.joints]
    elif kind == "touch":
        for k, joint in enumerate(arm.joints):
            end, sign = draw.choice(((joint.lower, -1), (joint.upper, 1)))
            at = math.degrees(end) + sign * draw.uniform(0, 5)
            lines[k] = {"find_home": f"touch in{k + 1}\ntouch_at = {at:.1f}"}
    arm = _written(arm, lines, folder)
    joints = list(arm.joints)
    some = [k for k in range(len(joints)) if draw.random() < 0.5] or [draw.randrange(len(joints))]
    words = []
    if kind == "swapped":
        ports = [joint.port for joint in joints]
        mixed = draw.choice([p for p in itertools.permutations(ports) if list(p) != ports])
        joints = [joint._replace(port=port) for joint, port in zip(joints, mixed, strict=True)]
        words.append(f"cables {''.join(ports)} at {''.join(mixed)}")
        some = [k for k in some if draw.random() < 0.5]
    if kind in ("reversed", "swapped") and some:
        for k in some:
            joints[k] = joints[k]._replace(direction=-joints[k].direction)
        words.append(" and ".join(joints[k].name for k in some) + " the other way round")
    if kind == "no stops":
        for k in some:
            joints[k] = joints[k]._replace(stop_lower=None, stop_upper=None)
        words.append("no stops at " + " and ".join(joints[k].name for k in some))
    if kind == "touch":
        joints = [joint._replace(stop_lower=None, stop_upper=None) for joint in joints]
        words.append("no stops, touch sensors")
        if draw.random() < 0.5:
            joints[some[0]] = joints[some[0]]._replace(touch_port=None)
            words.append(f"that of the {joints[some[0]].name} never closes")
    return arm, arm._replace(joints=tuple(joints)), ", ".join(words) or "nothing"


def _written(arm: Arm, lines: Sequence[dict[str, str]], folder: Path) -> Arm:
    """The arm of a file of one's own with other values of these keys, joint by joint."""
    text = Path(arm.file).read_text()
    for joint, values in zip(arm.joints, lines, strict=True):
        head, body = text.split(f"[{joint.name}]")
        for key, value in values.items():
            body = re.sub(rf"(?m)^{key} =.*$", f"{key} = {value}", body, count=1)
        text = f"{head}[{joint.name}]{body}"
    file = folder / os.path.basename(arm.file)
    file.write_text(text)
    return read_arm(str(file))


def _performed(
    case: WrongArmCase,
    arm: Arm,
    built: Arm,
    words: Sequence[str],
    start: str,
    typed: Callable[[EmulatedBrick], object],
) -> tuple[SimulationResult, list[str]]:
    """Run `driver.py WORDS` with somebody at the keyboard; and the lines that it has said."""
    said = io.StringIO()
    plant = f"seed={case.seed},cpu={case.cpu:g}"
    with (
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
        Rig(arm, built, plant, start=start) as rig,
    ):
        result = rig.run("driver.py", *words, keyboard=typed)
    return result, said.getvalue().splitlines()


def _checked(case: WrongArmCase, arm: Arm, built: Arm, wrong: str) -> WrongArmResult:
    """Let `driver.py check` look at an arm."""
    run, lines = _performed(case, arm, built, ["check"], UNCHECKED, Onlooker)
    found = read_arm(arm.file)
    corrected = [(j.port, j.direction) for j in found.joints] == [
        (j.port, j.direction) for j in built.joints
    ]
    named = [line for line in lines if " written to " in line]
    turned = _farthest(run)
    good = (
        run.outcome.status == 0
        and corrected
        and turned <= MOST_TURNED
        and bool(named) == (case.kind != RIGHT)
    )
    beyond = _beyond(arm, run, counted=True), _beyond(built, run, counted=False)
    said = (named or lines or [""])[-1].partition(" written to ")[0]
    return WrongArmResult(
        case.seed, arm.name, case.kind, wrong, run.outcome.status, turned, *beyond, said, good
    )


def _homed(
    case: WrongArmCase, arm: Arm, built: Arm, wrong: str, put: Sequence[float]
) -> WrongArmResult:
    """Let `driver.py home` find the zero of an arm that somebody has put so far (deg) off home."""
    start = ",".join(
        f"{math.degrees(joint.home) + off:.2f}" for joint, off in zip(arm.joints, put, strict=True)
    )
    run, lines = _performed(case, arm, built, ["home"], start, lambda brick: io.StringIO("\n"))
    off = max(
        math.degrees(abs(q - joint.home))
        for q, joint in zip(run.record[-1].q, arm.joints, strict=True)
    )
    beyond, truly = _beyond(arm, run, counted=True), _beyond(built, run, counted=False)
    found = run.outcome.status == 0
    good = beyond <= math.degrees(SEEK_BEYOND) and not any(
        motor["driven"] for motor in run.motors.values()
    )
    if found:
        good = good and off <= ZERO_WITHIN
    else:
        wanted = {"no stops": "met no ", "touch": "did not meet its touch sensor"}
        good = good and case.kind in wanted and wanted[case.kind] in lines[-1]
    good = good and found == (case.kind == RIGHT or (case.kind == "touch" and "never" not in wrong))
    return WrongArmResult(
        case.seed, arm.name, case.kind, wrong, run.outcome.status, _farthest(run), beyond, truly,
        re.sub(r"/\S+/", "", lines[-1]), good,
    )  # fmt: skip


def _farthest(run: SimulationResult) -> float:
    first = run.record[0].q
    return max(
        math.degrees(abs(q - before))
        for sample in run.record
        for q, before in zip(sample.q, first, strict=True)
    )


def _beyond(arm: Arm, run: SimulationResult, counted: bool) -> float:
    """How far beyond its limits a joint was, deg; counted from where it was put as home, or not."""
    first = run.record[0].q
    moved = [joint.home - q if counted else 0.0 for joint, q in zip(arm.joints, first, strict=True)]
    return beyond_limits(
        arm, ([q + by for q, by in zip(sample.q, moved, strict=True)] for sample in run.record)
    )


def table(results: Sequence[WrongArmResult]) -> list[list[str]]:
    """Rows below HEADINGS."""
    return [
        [
            str(r.seed), r.arm, r.wrong, str(r.status), f"{r.turned:.1f}",
            "none" if max(r.beyond, r.truly) < 0 else f"{r.beyond:.1f} / {r.truly:.1f}",
            "yes" if r.good else "NO", r.said,
        ]
        for r in results
    ]  # fmt: skip


def summary(results: Sequence[WrongArmResult]) -> str:
    """One line: how many are as they should be, and the greatest angles."""
    mounted = [r for r in results if r.kind in ("reversed", "swapped")]
    sought = [r for r in results if r.kind in ("no stops", "touch")]
    right = [r for r in results if r.kind == RIGHT]
    parts = [
        f"{sum(r.good for r in group)} of {len(group)} {what}"
        for group, what in (
            (mounted, "reversed or swapped named in time"),
            (sought, "without stops or with sensors within bounds"),
            (right, "right ones passed"),
        )
        if group
    ]
    if mounted:
        parts.append(f"turned by {max(r.turned for r in mounted):.1f} deg at most")
    if sought:
        parts.append(f"{max(r.beyond for r in sought):.1f} deg beyond a limit at most")
    return "; ".join(parts)


def _shown(results: Sequence[WrongArmResult], it: Any) -> Iterator[BenchTable | str]:
    title = f"{seeds_of(it)}, cpu={it.cpu:g}, figures from the emulator"
    yield BenchTable(title, HEADINGS, table(results))
    yield summary(results)


BENCH = BenchRecord(
    "arms",
    lambda it: cases(it.seeds, it.cpu),
    run_case,
    _shown,
    holds=lambda results: all(result.good for result in results),
)
