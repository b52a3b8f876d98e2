"""A drawing that is paused, slowed, aborted, stopped or killed at random times, and gone on with.

What counts is the true ink of all runs together: how far apart the parts are where the pen was
lifted, whether anything is left out or drawn twice, how long the pen stands on the paper.
"""

from __future__ import annotations

import math
import os
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, seeds_of, silenced
from laptop.drawing import planning, preparing, sources
from laptop.drawing.options import DrawingOptions
from laptop.emulator.faults import Fault
from laptop.emulator.rig import Rig
from laptop.record.figures.drawing_plot import standing
from laptop.record.figures.line_accuracy import distances, pen_down_runs, place, refined
from shared.arm_description import find_arm, read_arm
from shared.state import JOB_ORDERS_FILE

DRAWING, SIZE = "house", 9.0
"""What is drawn, and its width, cm."""

ENDS = ("none", "abort", "term", "kill")
"""What ends the first run: nothing, an order, a signal, or the battery."""

TIMEOUT = 7200.0
"""A drawing may take so long on the emulated brick, s."""

LONGEST_LIFT = 1.0
"""Ink that ends within this time of an order to pause was ended by it, s."""

PAUSES = 2
PAUSE_TIME = 0.5, 3.0
"""From an order to pause to the one that resumes, s."""


@dataclass(frozen=True)
class Interruption:
    """One case."""

    seed: int
    arm: str


@dataclass(frozen=True)
class InterruptionResult:
    """One drawing, interrupted.

    Attributes:
        seed, arm: of the case.
        end: what ended the first run, one of ENDS.
        gaps_mm: from where the ink of a pause ends to where it goes on.
        lift_s: times from an order to pause to the pen's being off the paper.
        missed_mm: greatest distance of what was wished from the ink of all runs.
        greatest_mm: and of the ink from what was wished.
        extra_cm: ink beyond the length of what was wished.
        stroke_cm: length of the stroke that was under way when the first run ended; 0 for none.
        standing_s: longest time for which the tip stood with the pen down, up to a signal or an
            empty battery, which leave the pen where it is.
        error: why the drawing was not ended; or "".
    """

    seed: int
    arm: str
    end: str
    gaps_mm: list[float] = field(default_factory=list)
    lift_s: list[float] = field(default_factory=list)
    missed_mm: float = math.nan
    greatest_mm: float = math.nan
    extra_cm: float = math.nan
    stroke_cm: float = 0.0
    standing_s: float = math.nan
    error: str = ""


def interrupt(case: Interruption) -> InterruptionResult:
    """Draw one case."""
    draw = random.Random(case.seed)
    arm = read_arm(find_arm(case.arm))
    plan = preparing.prepare(sources.read_source(DRAWING), arm, DrawingOptions(size=(SIZE, None)))
    chains = planning.merged_strokes(plan.strokes, arm, 0.0)
    seconds = plan.estimate.seconds
    end = ENDS[case.seed % len(ENDS)]
    over = draw.uniform(0.2, 0.9) * seconds if end != "none" else math.inf
    pauses = sorted(draw.uniform(2.0, min(over, seconds) - 6.0) for _ in range(PAUSES))
    pauses = [t for t, after in zip(pauses, [*pauses[1:], math.inf], strict=True) if after - t > 6]
    with tempfile.TemporaryDirectory() as home:
        file = os.path.join(home, "house.job")
        plan.write_job(file)
        meanwhile: list[tuple[float, Callable[[], None]]] = []
        for t in pauses:
            meanwhile.append((t, partial(_order, home, "pause")))
            meanwhile.append((t + draw.uniform(*PAUSE_TIME), partial(_order, home, "resume")))
        if end == "abort":
            meanwhile.append((over, partial(_order, home, "abort")))
        faults = [Fault(end, None, over)] if end in ("term", "kill") else []
        with Rig(arm, state_folder=home) as rig:
            first = _quiet(rig, file, faults=faults, meanwhile=meanwhile)
        records = [first.record]
        last = first
        if end != "none":
            q = first.record[-1].q
            start = ",".join(
                f"{math.degrees(min(max(a, j.lower), j.upper)):.9f}"
                for a, j in zip(q, arm.joints, strict=True)
            )
            with Rig(arm, start=start, state_folder=home) as rig:
                last = _quiet(rig, file, "--resume")
            records.append(last.record)
    return _judged(case, end, records, chains, pauses, over, last.outcome)


def _quiet(rig: Rig, *words: str, **options: Any) -> Any:
    """Let a job be drawn, and nobody hear it."""
    with silenced():
        return rig.job(*words, timeout=TIMEOUT, **options)


def _order(home: str, line: str) -> None:
    with open(os.path.join(home, JOB_ORDERS_FILE), "a") as file:
        file.write(line + "\n")


def _judged(
    case: Interruption,
    end: str,
    records: list[Any],
    chains: Sequence[Sequence[np.ndarray]],
    pauses: Sequence[float],
    over: float,
    outcome: Any,
) -> InterruptionResult:
    runs = [run for record in records for run in pen_down_runs(record)]
    which = [n for n, record in enumerate(records) for _ in pen_down_runs(record)]
    inks = [np.array([place(row) for row in run], float)[:, :2] for run in runs]
    wished = [np.concatenate(chain)[:, :2] for chain in chains]
    paused = [
        not n and any(0 <= run[-1].t - t <= LONGEST_LIFT for t in pauses)  # the first run alone
        for run, n in zip(runs, which, strict=True)
    ]
    of = _chains_of(inks, which, paused, wished)
    gaps = []
    for k in range(len(inks) - 1):
        if paused[k] and of[k] == of[k + 1] and which[k] == which[k + 1]:
            gaps.append(10 * float(np.hypot(*(inks[k + 1][0] - inks[k][-1]))))
    lifts = [_lift(records[0], t) for t in pauses if t < over]
    length = sum(np.hypot(*np.diff(path, axis=0).T).sum() for path in wished)
    ink_cm = sum(np.hypot(*np.diff(ink, axis=0).T).sum() for ink in inks)
    under_way = 0.0
    if len(records) > 1:
        cut = sum(len(pen_down_runs(record)) for record in records[:1])
        if 0 < cut < len(inks) and of[cut - 1] == of[cut]:
            under_way = float(np.hypot(*np.diff(wished[of[cut]], axis=0).T).sum())
    every = [refined(ink) for ink in inks]
    missed = max(
        float(np.min([distances(refined(path)[::5], ink) for ink in every], axis=0).max())
        for path in wished
    )
    off = max(float(distances(ink, wished[n]).max()) for ink, n in zip(every, of, strict=True))
    return InterruptionResult(
        case.seed,
        case.arm,
        end,
        gaps,
        [lift for lift in lifts if lift is not None],
        10 * missed,
        10 * off,
        float(ink_cm - length),
        under_way,
        max((standing(run) for run in _ordered(runs, which, end, over)), default=0.0),
        "" if outcome.status == 0 else outcome.reason,
    )


def _chains_of(
    inks: Sequence[np.ndarray],
    which: Sequence[int],
    paused: Sequence[bool],
    wished: Sequence[np.ndarray],
) -> list[int]:
    """Return the number of the chain that each ink was drawn for.

    In a run every ink is of the next chain. Behind a pause, and where a run resumes, it may be of
    the chain of the one before, too: it is of the nearer one.

    Args:
        inks: points, cm, each n x 2.
        which: number of the run of each.
        paused: whether a pause ended it.
        wished: points of the chains, cm, each n x 2.
    """
    out: list[int] = []
    for k, ink in enumerate(inks):
        thin = ink[:: max(1, len(ink) // 20)]
        if k == 0:
            near = [0]
        elif paused[k - 1] or which[k] != which[k - 1]:
            near = [n for n in (out[-1], out[-1] + 1) if n < len(wished)]
        else:
            near = [min(out[-1] + 1, len(wished) - 1)]
        out.append(min(near, key=lambda n: float(distances(thin, wished[n]).mean())))
    return out


def _ordered(
    runs: Sequence[list[Any]], which: Sequence[int], end: str, over: float
) -> list[list[Any]]:
    """Return the inks without what follows the signal or the empty battery that ends a record.

    Args:
        runs: rows of each ink.
        which: number of the record of each.
        end: what ends the first record, one of ENDS, at the time `over`, s.
    """
    ends = over if end in ("term", "kill") else math.inf
    cut = [[row for row in run if n or row.t <= ends] for run, n in zip(runs, which, strict=True)]
    return [run for run in cut if run]


def _lift(record: Sequence[Any], t: float) -> float | None:
    """Return how long after `t` the pen is off the paper, s; None where it was not on it."""
    later = [row for row in record if row.t >= t]
    if not later or not later[0].pen:
        return None
    return next((row.t - t for row in later if not row.pen), None)


HEADINGS = (
    "arm", "ended by", "drawings", "pauses", "gap mm: greatest", "pen up after s: greatest",
    "left out mm", "off by mm", "extra cm: greatest", "of it the stroke", "stands s", "failed",
)  # fmt: skip


def table(results: Sequence[InterruptionResult]) -> list[list[str]]:
    """One row per arm and end."""
    rows = []
    for arm in dict.fromkeys(one.arm for one in results):
        for end in ENDS:
            group = [one for one in results if (one.arm, one.end) == (arm, end)]
            if not group:
                continue
            gaps = [gap for one in group for gap in one.gaps_mm]
            lifts = [lift for one in group for lift in one.lift_s]
            extra = max(group, key=lambda one: one.extra_cm - one.stroke_cm)
            rows.append(
                [
                    arm,
                    end,
                    str(len(group)),
                    str(len(lifts)),
                    f"{max(gaps):.2f}" if gaps else "-",
                    f"{max(lifts):.2f}" if lifts else "-",
                    f"{max(one.missed_mm for one in group):.2f}",
                    f"{max(one.greatest_mm for one in group):.2f}",
                    f"{extra.extra_cm:.1f}",
                    f"{extra.stroke_cm:.1f}",
                    f"{max(one.standing_s for one in group):.2f}",
                    "; ".join(one.error for one in group if one.error),
                ]
            )
    return rows


def _cases(it: Any) -> list[Interruption]:
    arms = it.arms or ("planar", "geared")
    return [Interruption(seed, arms[k // len(ENDS) % len(arms)]) for k, seed in enumerate(it.seeds)]


BENCH = BenchRecord(
    "interrupting",
    _cases,
    interrupt,
    lambda results, it: [
        BenchTable(f"A house of {SIZE:g} cm, {seeds_of(it)}", HEADINGS, table(results), 1)
    ],
)
