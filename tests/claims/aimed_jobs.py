"""Jobs with the right checksum that aim at what an arm may not do: refused, or drawn within bounds.

What counts is what the true joints did: how far beyond a limit, and how fast.
"""

from __future__ import annotations

import copy
import math
import os
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, seeds_of, silenced
from laptop.emulator.rig import Rig
from robot.jobs.checking import check_strokes
from robot.motion import paths, trajectory
from shared.arm_description import Arm, find_arm, read_arm
from shared.job import BadJob, Job, Stroke, header_of, write_job
from tests.claims.limits_passed import beyond_limits

SECONDS = 60.0
"""What each job says that it takes."""
TIMEOUT = 300.0
"""A job may take so long on the emulated brick, s."""
WINDOW = 0.05
"""Speeds are those over so long a time, s."""

Cubic = list[float]
Pose = list[float]


@dataclass(frozen=True)
class AimedJob:
    """One case."""

    seed: int
    arm: str


@dataclass(frozen=True)
class AimedResult:
    """What became of a job.

    Attributes:
        seed, arm: of the case.
        kind: what it aims at, a key of KINDS.
        refused: what was said of it before anything moved, or "".
        ended: why it was not drawn to its end, or "".
        beyond_deg: how far the true joints were beyond a limit, at the most; negative within.
        speed: greatest true speed of a joint, in what its arm file gives it.
    """

    seed: int
    arm: str
    kind: str
    refused: str = ""
    ended: str = ""
    beyond_deg: float = -math.inf
    speed: float = 0.0


def draw_it(case: AimedJob) -> AimedResult:
    """Make one job; draw it if it is not refused."""
    draw = random.Random(case.seed)
    arm = read_arm(find_arm(case.arm))
    kinds = [kind for kind in KINDS if kind != "into the table" or len(arm.joints) == 3]
    kind = draw.choice(kinds)
    strokes = KINDS[kind](draw, arm)
    with tempfile.TemporaryDirectory() as home:
        file = os.path.join(home, "aimed.job")
        write_job(file, header_of(arm, "aimed", arm.speed, strokes, 0.0, SECONDS), strokes)
        try:
            for _ in check_strokes(Job(file, arm), arm):
                pass
        except BadJob as why:
            return AimedResult(case.seed, case.arm, kind, refused=str(why).partition(": ")[2])
        with silenced(), Rig(arm, state_folder=home) as rig:
            done = rig.job(file, timeout=TIMEOUT)
    return AimedResult(
        case.seed, case.arm, kind,
        ended="" if done.outcome.status == 0 else str(done.outcome.reason),
        beyond_deg=beyond_limits(arm, (row.q for row in done.record)),
        speed=_speed(done.record, arm),
    )  # fmt: skip


def _speed(record: Sequence[Any], arm: Arm) -> float:
    """Return the greatest speed of a joint over a WINDOW, in its greatest."""
    fastest, last = 0.0, record[0]
    for row in record:
        if row.t - last.t < WINDOW:
            continue
        for a, b, joint in zip(last.q, row.q, arm.joints, strict=True):
            fastest = max(fastest, abs(b - a) / (row.t - last.t) / joint.max_speed)
        last = row
    return fastest


# ---- what they aim at


def _pose(draw: random.Random, arm: Arm) -> Pose:
    return [
        draw.uniform(0.9 * joint.lower + 0.1 * joint.upper, 0.1 * joint.lower + 0.9 * joint.upper)
        for joint in arm.joints
    ]


def _ease(a: float, b: float) -> Cubic:
    """From one angle to another over 1 cm, standing at both ends."""
    return [a, 0.0, 3 * (b - a), 2 * (a - b)]


def _stroke(
    times: list[float], motions: list[tuple[float, float, list[Cubic]]], offsets: Any = ()
) -> Stroke:
    """Return a Stroke of one piece: per segment the tip's v and a, and the joints' cubics."""
    segments = [(v, a, cubics, None) for v, a, cubics in motions]
    v, a, cubics = motions[-1]
    dt = times[-1] - times[-2]
    s = dt * (v + 0.5 * a * dt)
    end = [c0 + s * (c1 + s * (c2 + s * c3)) for c0, c1, c2, c3 in cubics]
    return Stroke("", abs(s), 0.0, [(times, segments, end)], list(offsets))


def _from_rest(cubics: list[Cubic], seconds: float) -> Stroke:
    """Return a Stroke along 1 cm of these, which speeds up and slows down."""
    a = 4 / seconds**2
    later = [
        [c0 + (c1 + (c2 + c3 / 2) / 2) / 2, c1 + c2 + 0.75 * c3, c2 + 1.5 * c3, c3]
        for c0, c1, c2, c3 in cubics
    ]
    times = [0.0, seconds / 2, seconds]
    return _stroke(times, [(0.0, a, cubics), (2 / seconds, -a, later)])


def _move(q: Pose, end: Pose, seconds: float) -> Stroke:
    return _from_rest([_ease(a, b) for a, b in zip(q, end, strict=True)], seconds)


def _good(draw: random.Random, arm: Arm) -> Stroke:
    q = _pose(draw, arm)
    return _move(q, [angle + math.radians(draw.uniform(-8, 8)) for angle in q], 2.0)


def _one_joint(draw: random.Random, arm: Arm, cubic: Callable[[float], Cubic]) -> list[Cubic]:
    """Return cubics of which one joint's is `cubic(its limit)`, and the others stand."""
    cubics = [[q, 0.0, 0.0, 0.0] for q in _pose(draw, arm)]
    j = draw.randrange(len(arm.joints))
    joint = arm.joints[j]
    cubics[j] = cubic(draw.choice([joint.lower, joint.upper]))
    return cubics


def _beyond(draw: random.Random, arm: Arm) -> list[Stroke]:
    """Both ends are within a limit, and the middle is about at it."""
    over = math.radians(draw.choice([draw.uniform(-3, 1), draw.uniform(-1, 60)]))

    def bulge(limit: float) -> Cubic:
        inwards = -math.copysign(1.0, limit)
        depth = math.radians(20)
        # A parabola over 1 cm: 20 degrees within at its ends, `over` beyond in the middle.
        rise = -inwards * (over + depth)
        return [limit + inwards * depth, 4 * rise, -4 * rise, 0.0]

    return [_from_rest(_one_joint(draw, arm, bulge), draw.uniform(1.5, 9.0))]


def _fast(draw: random.Random, arm: Arm) -> list[Stroke]:
    """At both ends it stands, and is too fast, or all but, in the middle."""
    q = _pose(draw, arm)
    j = draw.randrange(len(arm.joints))
    end = list(q)
    joint = arm.joints[j]
    end[j] = draw.uniform(joint.lower, joint.upper)
    share = draw.choice([draw.uniform(0.8, 1.2), draw.uniform(1.0, 20.0)])
    # (In the middle it is three times as fast as on the average.)
    seconds = 3.0 * abs(end[j] - q[j]) / (share * joint.max_speed)
    return [_move(q, end, max(seconds, 1e-3))]


def _backwards(draw: random.Random, arm: Arm) -> list[Stroke]:
    """It runs backwards first, out of the limits."""
    v, seconds = -(10 ** draw.uniform(-4, 1.3)), draw.uniform(1.0, 10.0)
    a = 2 * (1.0 - v * seconds) / seconds**2
    slope = math.radians(draw.uniform(1, 20))

    def away(limit: float) -> Cubic:
        return [limit - math.copysign(math.radians(15), limit), -math.copysign(slope, limit), 0, 0]

    return [_stroke([0.0, seconds], [(v, a, _one_joint(draw, arm, away))])]


def _back_at_its_end(draw: random.Random, arm: Arm) -> list[Stroke]:
    """It turns back at its end, having been beyond a limit."""
    v, seconds = draw.uniform(0.1, 10.0), draw.uniform(0.5, 5.0)
    a = -(v + 10 ** draw.uniform(-6, 0)) / seconds
    s = seconds * (v + 0.5 * a * seconds)
    if s <= 0:
        a, s = -v / seconds, 0.5 * v * seconds
    far = v * v / (-2 * a)
    over = math.radians(draw.choice([draw.uniform(-3, 1), draw.uniform(-1, 30)]))

    def up_to(limit: float) -> Cubic:
        sign = math.copysign(1.0, limit)
        return [limit + sign * (over - math.radians(20)), sign * math.radians(20) / far, 0, 0]

    cubics = _one_joint(draw, arm, up_to)
    # Before that it speeds up along as much, straight on.
    before = [[c0 - far * c1, c1, 0.0, 0.0] for c0, c1, _, _ in cubics]
    times = [0.0, 2 * far / v, 2 * far / v + seconds]
    return [_stroke(times, [(0.0, v * v / (2 * far), before), (v, a, cubics)])]


def _staircase(draw: random.Random, arm: Arm) -> list[Stroke]:
    """Each segment stands, and begins a little beside the end of the one before."""
    q, step = _pose(draw, arm), 10 ** draw.uniform(-8, -2)
    j, period = draw.randrange(len(q)), draw.uniform(0.001, 0.05)
    motions = []
    for k in range(draw.randrange(2, 200)):
        pose = list(q)
        pose[j] += k * step
        motions.append((1.0, 0.0, [[angle, 0.0, 0.0, 0.0] for angle in pose]))
    return [_stroke([period * k for k in range(len(motions) + 1)], motions)]


def _learned(draw: random.Random, arm: Arm) -> list[Stroke]:
    """What was learned of it leads beyond a limit, or too fast."""
    strokes = [_good(draw, arm), _beyond(draw, arm)[0]]
    for k, stroke in enumerate(strokes):
        length = sum(
            (t_end - t) * (v + 0.5 * a * (t_end - t))
            for times, segments, _ in stroke.pieces
            for t, t_end, (v, a, _, _) in zip(times, times[1:], segments, strict=False)
        )
        size = math.radians(10 ** draw.uniform(-1, 1.5))
        ways = [length * n / 4 for n in range(5)]
        own = [[draw.uniform(-size, size) for _ in ways] for _ in arm.joints]
        strokes[k] = stroke._replace(offsets=[(ways, own)])
    return strokes


def _later(draw: random.Random, arm: Arm) -> list[Stroke]:
    """The first strokes are good; one that comes later is not."""
    bad = draw.choice([_beyond, _fast, _backwards, _back_at_its_end])
    return [_good(draw, arm) for _ in range(draw.randrange(1, 4))] + bad(draw, arm)


def _table(draw: random.Random, arm: Arm) -> list[Stroke]:
    """Within all limits the tip goes to the table, and into it."""
    base, shoulder, _ = arm.joints
    turn, lift = draw.uniform(base.lower, base.upper), shoulder.lower + math.radians(1)
    down = math.radians(draw.uniform(-90, -50)) - lift
    return [_move([turn, 0.8, -1.0], [turn, lift, down], draw.uniform(3.0, 8.0))]


def _changed(draw: random.Random, arm: Arm) -> list[Stroke]:
    """Numbers of a job that was planned are changed."""
    reach = sum(joint.link for joint in arm.joints[-2:])
    x, y = 0.6 * reach, 0.2 * reach
    points = [(x, -y), (x, y), (0.8 * x, y)]
    if len(arm.joints) == 3:
        points = [(*p, 0.0) for p in points]  # type: ignore[misc]
    plans = trajectory.plan(arm, paths.polyline(points))
    pieces = copy.deepcopy([plan.numbers() for plan in plans])
    for _ in range(draw.randrange(1, 4)):
        times, segments, end = draw.choice(pieces)
        k = draw.randrange(len(segments))
        v, a, cubics, across = segments[k]
        what = draw.randrange(5)
        factor = draw.choice(
            [draw.uniform(0.5, 2.0), draw.uniform(-3, 3), 10 ** draw.uniform(0, 9)]
        )
        if what == 0:
            times[k + 1 :] = [t * factor for t in times[k + 1 :]]
        elif what == 1:
            v *= factor
        elif what == 2:
            a *= factor
        elif what == 3:
            draw.choice(cubics)[draw.randrange(4)] *= factor
        else:
            end[draw.randrange(len(end))] *= factor
        segments[k] = (v, a, cubics, across)
    return [Stroke("", 5.0, 0.0, pieces)]


KINDS: dict[str, Callable[[random.Random, Arm], list[Stroke]]] = {
    "beyond within a piece": _beyond,
    "too fast within a piece": _fast,
    "backwards first": _backwards,
    "backwards at its end": _back_at_its_end,
    "by many small jumps": _staircase,
    "by what was learned": _learned,
    "in a later stroke": _later,
    "changed numbers": _changed,
    "into the table": _table,
}
"""What jobs aim at."""


HEADINGS = (
    "aims", "arm", "jobs", "refused", "drawn", "ended on the way", "beyond a limit, deg",
    "joint's speed of its greatest",
)  # fmt: skip


def table(results: Sequence[AimedResult]) -> list[list[str]]:
    """Return one row per kind and arm: of those drawn the worst."""
    rows = []
    for kind in KINDS:
        for arm in dict.fromkeys(one.arm for one in results):
            group = [one for one in results if (one.kind, one.arm) == (kind, arm)]
            if not group:
                continue
            moved = [one for one in group if not one.refused]
            rows.append(
                [
                    kind,
                    arm,
                    str(len(group)),
                    str(len(group) - len(moved)),
                    str(sum(not one.ended for one in moved)),
                    str(sum(bool(one.ended) for one in moved)),
                    f"{max(one.beyond_deg for one in moved):+.1f}" if moved else "-",
                    f"{max(one.speed for one in moved):.2f}" if moved else "-",
                ]
            )
    return rows


def _cases(it: Any) -> list[AimedJob]:
    arms = it.arms or ("planar", "geared", "spatial")
    return [AimedJob(seed, arms[k % len(arms)]) for k, seed in enumerate(it.seeds)]


BENCH = BenchRecord(
    "aiming",
    _cases,
    draw_it,
    lambda results, it: [
        BenchTable(f"Jobs with the right checksum, {seeds_of(it)}", HEADINGS, table(results), 1)
    ],
    chunk=8,
)
