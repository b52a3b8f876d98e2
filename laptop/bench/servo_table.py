"""Figures of the servoing bench: rates with their intervals, percentiles, ratios to a bound.

The bound is who knows the goal's joint angles, or else who knows the true Jacobian.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from laptop.bench import servo, servo_scenarios
from laptop.bench.bench import (
    BadBench,
    BenchRecord,
    BenchTable,
    MachineLine,
    flat,
    grouped,
    percentile,
    seeds_of,
    spread,
)
from laptop.bench.servo import ServoCase, ServoResult
from laptop.bench.servo_cost import step_cost
from laptop.bench.servo_phases import PHASES


def wilson(successes: int, n: int) -> tuple[float, float]:
    """Return the 95 % interval of a share, 0 .. 1 (E. B. Wilson 1927)."""
    z = 1.959964
    share, spread = successes / n, z * z / n
    middle = (share + spread / 2) / (1 + spread)
    half = math.sqrt(spread * (share * (1 - share) + spread / 4)) / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


Row = tuple[str, ...]
HEADINGS: Row = (
    "arm", "scene", "method", "mode", "success %", "Wilson 95 %", "false", "moves", "looks",
    "frames", "time s", "error px", "mm", "x moves", "x time", "x error",
)  # fmt: skip
MOVING_HEADINGS: Row = (
    "arm", "scene", "method", "mode", "to the end %", "Wilson 95 %", "rms px", "frames", "x rms",
)  # fmt: skip
LEGEND = (
    "p50/p95 (or p50) of all runs, failures at the full budget; mm: true distance of those that"
    " say converged; x: times the clairvoyant's, or the oracle's where there is none"
)
PHASES_HEADINGS: Row = ("arm", "scene", "method", "mode", *PHASES)
PHASES_TITLE = "where the seconds of the runs that succeeded go, mean, s"


def _grouped(results: Sequence[ServoResult]) -> dict[tuple[str, str, str], list[ServoResult]]:
    groups = grouped(results, lambda r: (r.arm, r.scene, r.method))
    # A condition's methods stand together.
    seen = {key[:2]: k for k, key in enumerate(groups)}
    return dict(sorted(groups.items(), key=lambda item: seen[item[0][:2]]))


def table(results: Sequence[ServoResult]) -> list[Row]:
    """Return one row per arm, condition and method; failures count as the budget."""
    groups = _grouped(results)
    moving = any(r.rms is not None for r in results)
    rows: list[Row] = []
    for key, group in groups.items():
        best_known = groups.get((*key[:2], servo_scenarios.CLAIRVOYANT))
        bound = best_known or groups.get((*key[:2], servo_scenarios.ORACLE))
        mode = group[0].mode
        successes = sum(r.success for r in group)
        low, high = wilson(successes, len(group))
        share = f"{100 * successes / len(group):.1f}", f"{100 * low:.1f}..{100 * high:.1f}"

        def both(field: str, digits: int, group: list[ServoResult] = group) -> str:
            values = (getattr(r, field) for r in group)
            return spread([x for x in values if x is not None], digits)

        def ratio(
            field: str,
            *quantiles: int,
            group: list[ServoResult] = group,
            bound: list[ServoResult] | None = bound,
        ) -> str:
            if not bound:
                return "-"
            own, best = ([getattr(r, field) for r in some] for some in (group, bound))
            pairs = ((percentile(own, q), percentile(best, q)) for q in quantiles)
            return "/".join(f"{a / b:.2f}" if b else "-" for a, b in pairs)

        frames_used, measured = (
            spread([getattr(r, field) for r in group], 0, 50)
            for field in ("frames", "measurements")
        )
        if moving:
            rows.append((*key, mode, *share, both("rms", 1), frames_used, ratio("rms", 50, 95)))
            continue
        claimed = [r for r in group if r.claimed]
        missed = [r for r in claimed if r.miss is not None]
        miss = both("miss", 1, missed) if missed else "-"
        false = f"{sum(not r.success for r in claimed)}"
        rows.append(
            (
                *key, mode, *share, false, both("moves", 0), measured, frames_used,
                both("seconds", 1), both("error", 1), miss, ratio("moves", 50, 95),
                ratio("seconds", 50, 95), ratio("error", 50),
            )
        )  # fmt: skip
    return rows


def phases_table(results: Sequence[ServoResult]) -> list[Row]:
    """Return the mean seconds of each phase of those that succeeded, by the rows of `table`."""
    rows: list[Row] = []
    for key, group in _grouped(results).items():
        runs = [r.phases for r in group if r.success]
        means = (sum(run[phase] for run in runs) / len(runs) for phase in PHASES if runs)
        rows.append((*key, group[0].mode, *([f"{x:.2f}" for x in means] or "-" * len(PHASES))))
    return rows


def failures(results: Sequence[ServoResult]) -> list[str]:
    """Return a line per row with failures: the verdicts, numbers aside, and how often each."""
    lines = []
    for key, group in _grouped(results).items():
        verdicts = Counter(
            "false claim" if r.claimed else re.sub(r"-?\d[\d.]*", "N", r.verdict)
            for r in group
            if not r.success
        )
        if verdicts:
            reasons = ", ".join(f"{n} x {verdict}" for verdict, n in verdicts.most_common())
            lines.append(f"{'; '.join(key)}: {reasons}")
    return lines


def _cases(it: Any) -> list[ServoCase]:
    if it.scene == "moving" and "spatial" in it.arms:
        raise BadBench(
            "--scene moving: its goals run round in the plane; take another with --arm spatial"
        )
    if it.scene == "moving" and it.mode == "look":
        raise BadBench(
            "--mode look: a goal that moves is followed in the mode stream only; take that"
        )
    if it.rendered and it.scene not in servo_scenarios.RENDERED:
        raise BadBench(
            f"--scene {it.scene} is made of points with noise; with --rendered take one of "
            f"{', '.join(servo_scenarios.RENDERED)}"
        )
    arms = it.arms or servo_scenarios.ARMS
    return servo.cases(it.seeds, it.scene, arms, it.methods, it.rendered, it.rows, it.cpu, it.mode)


def _shown(results: list[ServoResult], it: Any) -> Iterator[BenchTable | str]:
    headings = MOVING_HEADINGS if it.scene == "moving" else HEADINGS
    title = f"{seeds_of(it)}, cpu={it.cpu:g}, figures from the emulator; {LEGEND}"
    yield BenchTable(title, headings, table(results), 2)
    if it.scene != "moving":
        yield BenchTable(PHASES_TITLE, PHASES_HEADINGS, phases_table(results), 2)
    yield from failures(results)
    yield MachineLine(step_cost((it.arms or servo_scenarios.ARMS)[0]))


BENCH = BenchRecord("servoing", _cases, servo.run_case, _shown, gather=flat)
