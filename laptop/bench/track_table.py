"""Figures of the tracking bench, as tables and for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from statistics import median
from typing import Any

from laptop.bench.track_cost import Cost, full_frame_cost
from laptop.bench.track_light import METHODS_IN_LIGHT, OUTLINE
from laptop.bench.track_methods import DOT2, ENCLOSING, HOUGH, LIMIT, MOMENTS, OURS, SPOTS
from laptop.bench.track_rims import MAX_PRECISE_RMS
from laptop.bench.track_score import Score, TrackResult


def gathered(results: Iterable[TrackResult]) -> list[TrackResult]:
    """Return a result per condition, marker and method: scores added, with the last error."""
    sums: dict[tuple[str, str, str, str], TrackResult] = {}
    for r in results:
        key = r.part, r.condition, r.marker, r.method
        if key in sums:
            before = sums[key]
            r = replace(r, score=before.score + r.score, error=r.error or before.error)
        sums[key] = r
    return list(sums.values())


Row = tuple[str, ...]


def _others(results: Iterable[TrackResult]) -> Row:
    """Return the methods beside ours; vpDot2 only where it could be run."""
    has_dot2 = any(r.method == DOT2 and r.score.frames for r in results)
    return (MOMENTS, SPOTS, *([DOT2] if has_dot2 else []), ENCLOSING, HOUGH)


def precision_headings(results: Iterable[TrackResult]) -> Row:
    """Return the headings of `precision_table`."""
    return ("marker", "limit", "ours", "x limit", "bias u", "bias v", *_others(results))


def _found(results: Iterable[TrackResult], part: str) -> dict[tuple[str, str], dict[str, Score]]:
    """Return scores by condition and marker, then by method."""
    found: dict[tuple[str, str], dict[str, Score]] = {}
    for r in results:
        if r.part == part:
            found.setdefault((r.condition, r.marker), {})[r.method] = r.score
    return found


def _px(score: Score | None) -> str:
    """Format the RMS, px, with the share of missed frames."""
    if score is None:
        return "-"
    missed = score.clear - score.measured
    share = f" ({100 * missed / score.clear:.0f} % missed)" if missed else ""
    return f"{score.rms:.3f}{share}" if score.measured else "never found"


def precision_table(results: Sequence[TrackResult]) -> list[Row]:
    """Return one row per appearance."""
    rows: list[Row] = []
    others = _others(results)
    for (appearance, _), scores in _found(results, "precision").items():
        ours, limit = scores[OURS], scores.get(LIMIT, Score())
        u, v = ours.bias
        rest = (_px(scores.get(method)) for method in others)
        rows.append(
            (
                appearance,
                f"{limit.rms:.4f}",
                _px(ours),
                f"{ours.rms / limit.rms:.1f}",
                f"{u:+.3f}",
                f"{v:+.3f}",
                *rest,
            )
        )
    return rows


RIM_HEADINGS: Row = (
    "printed disc", "colours on grounds", "always sure", "and precise", "median rms", "worst rms",
)  # fmt: skip


def rim_table(results: Sequence[TrackResult]) -> list[Row]:
    """Return one row per radius and rim."""
    by_size: dict[str, list[Score]] = {}
    rows: list[Row] = []
    for (condition, _), scores in _found(results, "rims").items():
        by_size.setdefault(condition, []).append(scores[OURS])
    for condition, found in by_size.items():
        reliable = [one for one in found if not one.lost and not one.false]
        precise = sum(one.rms <= MAX_PRECISE_RMS for one in reliable)
        errors = [one.rms for one in found if one.measured]
        rows.append(
            (
                condition,
                str(len(found)),
                str(len(reliable)),
                str(precise),
                f"{median(errors):.3f}" if errors else "-",
                f"{max(errors):.3f}" if errors else "-",
            )
        )
    return rows


LIGHT_HEADINGS: Row = (
    "what changes", "marker", "ours lost %", "ours false %", "ours rms",
    "HSV lost %", "HSV false %", "HSV rms", "outline rms",
)  # fmt: skip


def light_table(results: Sequence[TrackResult]) -> list[Row]:
    """Return one row per condition and marker."""
    rows = []
    for (condition, marker), scores in _found(results, "light").items():
        row = [condition, marker]
        for method in METHODS_IN_LIGHT:
            score = scores.get(method, Score())
            rms = f"{score.rms:.3f}" if score.measured else "-"
            row += [f"{score.lost_percent:.1f}", f"{score.false_percent:.1f}", rms]
        rows.append((*row, f"{scores[OUTLINE].rms:.3f}" if OUTLINE in scores else "-"))
    return rows


COST_HEADINGS: Row = ("640x480, one thread", "us", "p95", "of the full-frame recipe", "seen %")


def cost_table(timed: Sequence[Cost]) -> list[Row]:
    """Return one row per contender."""
    usual = full_frame_cost(timed)
    return [
        (
            cost.method,
            f"{cost.median:.0f}",
            f"{cost.p95:.0f}",
            f"1/{usual / cost.median:.1f}" if cost.median < usual else f"{cost.median / usual:.1f}",
            f"{100 * cost.seen:.0f}",
        )
        for cost in timed
    ]


def errors(results: Iterable[TrackResult]) -> list[str]:
    """Return lines on methods that could not be tried, and why."""
    failed = [r for r in results if r.error]
    without = dict.fromkeys(r.error for r in failed if r.method == DOT2)  # once, not at every look
    return [*(f"{r.condition}: {r.error}" for r in failed if r.method == OURS), *without]


def figures(results: Iterable[TrackResult], timed: Iterable[Cost]) -> dict[str, Any]:
    """Return everything, for `--json`; a missing value is null."""

    def number(x: float) -> float | None:
        return None if math.isnan(x) else x

    return {
        "results": [
            {
                **asdict(r),
                "rms": number(r.score.rms),
                "bias": [number(x) for x in r.score.bias],
                "lost_percent": number(r.score.lost_percent),
                "false_percent": number(r.score.false_percent),
            }
            for r in results
        ],
        "costs": [asdict(cost) for cost in timed],
    }
