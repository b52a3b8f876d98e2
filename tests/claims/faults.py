"""Faults, measured: each kind by name, and dead encoders, stalls, pulled cables at random moments.

Each seed's task runs once undisturbed, then with one fault after another.  The undisturbed run
tells what a healthy arm would have done: its encoders' counts, angles and speeds.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, as_dicts, flat, grouped, seeds_of
from laptop.emulator.faults import Fault
from shared.arm_description import find_arm, read_arm
from tests.claims.fault_tasks import ARMS, COMMANDS, Motion, Task, perform, task

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

PAIRED = (*KINDS, "freeze", "kill", "int", "slow-sysfs", "frozen-picture")
"""Kinds that come second in a pair; the first one is of KINDS."""

PAIR_TIME = 0.5
"""They come within so long of one another, s."""

HEADINGS = (
    "arm", "command", "fault", "runs", "ended well", "at rest, s p50/max", "late",
    "beyond the plan", "too far", "beyond a limit", "past it", "speed - allowed", "too fast",
    "told by camera", "wrongly",
)  # fmt: skip
SEEN = {"dead-encoder": " it turn by ", "stall": " it stand: "}
"""What a message says where the camera saw which of the two it is."""

LEGEND = (
    "at rest: from when a healthy joint would have counted twice (late: over 0.3 s); degrees "
    "beyond the plan (too far: over 10) and a limit (past it: over 3); deg/s above the greater of "
    "1.2 times the planned speed and 20 above it; told by camera: whether it is blocked or blind"
)
NAMED_HEADINGS = ("command", "fault", "at, s", "at rest after, s", "status", "what it says")

REST_GOAL = 0.3
"""Longest time until all joints rest, from when a healthy joint would have counted twice, s."""

ENDS = {"freeze": 0.5, "kill": 0.5, "int": 0.5}
"""And from where a program is frozen, killed or interrupted, s."""

TURN_GOAL, LIMIT_GOAL = 10.0, 3.0
"""Greatest angles beyond the plan, and beyond a limit, degrees."""

SPEED_SHARE, SPEED_EXCESS = 1.2, 20.0
"""Greatest speed: the greater of so many times the planned one, and of so much above it, deg/s."""

PLAN_TIME = 0.2
"""What the plan was so long before and after counts as planned, s."""

PEN_LEAD = 0.2
"""The pen's motor sets out so long before it touches the paper, s."""


@dataclass(frozen=True)
class FaultResult:
    """One fault, or a pair, in one task: degrees, deg/s, s.

    Attributes:
        kind, what, t: of each, joined by " + "; when the first came.
        noticed: whether the program ended by it; else it ended well all the same.
        rest: from when a healthy joint would have counted twice until all rest; None where it
            would not have.  late: how much longer that was than it may be.
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
    late: float
    beyond: float
    over: float
    speed: float
    allowed: float
    status: int
    text: str

    @property
    def told(self) -> str | None:
        """Which of the two the camera saw, a blocked joint or a blind one; None: it did not."""
        return next((kind for kind, words in SEEN.items() if words in self.text), None)

    @property
    def misses(self) -> tuple[str, ...]:
        """Goals that do not hold."""
        if not self.noticed:
            return ()
        return tuple(
            name
            for name, missed in (
                ("time", self.late > 0),
                ("angle", self.beyond > TURN_GOAL),
                ("limit", self.over > LIMIT_GOAL),
                ("speed", self.speed > self.allowed),
            )
            if missed
        )


def drawn_faults(it: Task, healthy: Motion) -> list[Fault]:
    """Faults of a task, at random while the arm moves."""
    draw = random.Random(f"{it.seed}/faults")
    ports = [joint.port for joint in read_arm(find_arm(it.arm)).joints]
    moving = healthy.moving()
    return [
        Fault(draw.choice(KINDS), draw.choice(ports), draw.uniform(0, 0.01) + draw.choice(moving))
        for _ in range(FAULTS_PER_SEED)
    ]


def drawn_pairs(it: Task, healthy: Motion) -> list[list[Fault]]:
    """Pairs of faults of a task, at random while the arm moves."""
    draw = random.Random(f"{it.seed}/pairs")
    ports = [joint.port for joint in read_arm(find_arm(it.arm)).joints]
    kinds = [kind for kind in PAIRED if it.cameras or kind != "frozen-picture"]
    moving = healthy.moving()
    pairs = []
    for _ in range(FAULTS_PER_SEED):
        t = draw.uniform(0, 0.01) + draw.choice(moving)
        first = Fault(draw.choice(KINDS), draw.choice(ports), t)
        kind, then = draw.choice(kinds), t + draw.uniform(0, PAIR_TIME)
        what = draw.choice(ports) if kind in KINDS else 0.05 if kind == "slow-sysfs" else None
        pairs.append([first, Fault(kind, what, then)])
    return pairs


def judge(
    it: Task, faults: Sequence[Fault], healthy: Motion, status: int, motion: Motion, text: str
) -> FaultResult:
    """Compare a disturbed run with the undisturbed one; the first of a pair that tells counts."""
    arm = read_arm(find_arm(it.arm))
    begun = faults[0].t
    dues = [
        (healthy.counts_twice(fault.what, fault.t), REST_GOAL)
        if fault.kind in KINDS
        else (fault.t if fault.kind in ENDS else None, ENDS.get(fault.kind, 0.0))
        for fault in faults
    ]
    known = [(due + goal, due) for due, goal in dues if due is not None]
    rest = motion.rests_from()
    planned = healthy.between(begun - PLAN_TIME, max(rest, begun) + PLAN_TIME)
    after = motion.between(begun, math.inf)
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
        it.arm, it.command, " + ".join(fault.kind for fault in faults),
        " + ".join(str(fault.what or "") for fault in faults), begun, it.seed, noticed,
        rest - min(known)[1] if known else None, rest - min(known)[0] if known else 0.0,
        beyond, over, speed, allowed, status, text,
    )  # fmt: skip


def run_case(case: tuple[int, float, bool]) -> list[FaultResult]:
    """Run all faults, or pairs, of one seed; none if the undisturbed run does not end well."""
    seed, cpu, in_pairs = case
    it = task(seed, cpu)
    healthy, status, _ = perform(it)
    if status:
        return []
    results = []
    cases = drawn_pairs(it, healthy) if in_pairs else [[f] for f in drawn_faults(it, healthy)]
    for faults in cases:
        motion, status, text = perform(it, faults)
        results.append(judge(it, faults, healthy, status, motion, text))
    return results


def table(results: Sequence[FaultResult]) -> list[tuple[str, ...]]:
    """Rows of all arms, commands and kinds; of single faults then of each."""
    kinds = sorted({result.kind for result in results})
    single = [result for result in results if result.kind in KINDS]
    groups = {
        **grouped(results, lambda r: ("all", "all", r.kind)),
        **grouped(single, lambda r: (r.arm, r.command, r.kind)),
    }
    order = {key: n for n, key in enumerate(("all", *ARMS, *COMMANDS, *KINDS, *kinds))}
    return [
        (*key, *_row(group))
        for key, group in sorted(groups.items(), key=lambda item: [order[k] for k in item[0]])
    ]


def summary(results: Sequence[FaultResult]) -> str:
    """How many of them miss no goal."""
    well = sum(not result.misses for result in results)
    return f"{well} of {len(results)} miss no goal"


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
        str(sum(result.told is not None for result in struck)),
        str(sum(result.told not in (None, *result.kind.split(" + ")) for result in struck)),
    )


@dataclass(frozen=True)
class NamedResult:
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


def named_table(results: Sequence[NamedResult]) -> list[tuple[str, ...]]:
    """A row for each."""
    return [
        (r.command, r.fault, f"{r.t:.2f}", f"{r.rest:.2f}", str(r.status), reason(r.text))
        for r in results
    ]


def reason(text: str) -> str:
    """What is said, without the script's name."""
    return text.split(": ", 1)[-1]


def _cases(it: Any) -> list[Any]:
    named = [partial(run_named, case) for case in named_cases(it.cpu)]
    random = [partial(run_case, (seed, it.cpu, False)) for seed in it.seeds or ()]
    return [*named, *random, *(partial(run_case, (seed, it.cpu, True)) for seed in it.pairs or ())]


def _run(case: Callable[[], Any]) -> Any:
    return case()


def _gather(results: list[Any], it: Any) -> dict[str, Any]:
    named = len(named_cases(it.cpu))
    random = named + len(it.seeds or ())
    return {
        "named": results[:named],
        "random": flat(results[named:random]),
        "pairs": flat(results[random:]),
    }


def _shown(found: dict[str, Any], it: Any) -> Iterator[BenchTable | str]:
    title = f"planar arm, cpu={it.cpu:g}, in the middle of its motion; figures from the emulator"
    yield BenchTable(title, NAMED_HEADINGS, named_table(found["named"]), 1)
    for seeds, results in ((it.seeds, found["random"]), (it.pairs, found["pairs"])):
        if results:
            title = f"{seeds_of(SimpleNamespace(seeds=seeds))}, cpu={it.cpu:g}; {LEGEND}"
            yield BenchTable(title, HEADINGS, table(results), 2)
            yield summary(results)


BENCH = BenchRecord(
    "faults",
    _cases,
    _run,
    _shown,
    figures=lambda found: {name: as_dicts(results) for name, results in found.items()},
    gather=_gather,
)
