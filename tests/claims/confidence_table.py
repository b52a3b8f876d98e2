"""Figures of confidence against error: tables and JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from laptop.bench.bench import grouped
from laptop.bench.track_score import CLAIM_CONFIDENCE, SURE_CONFIDENCE
from tests.claims.position_claims import Claim

Row = tuple[str, ...]
HEADINGS: Row = (
    "of", "what happens", "positions asked for", "of >= 0.5", "of >= 0.9", "of >= 0.9 too far off",
    "of >= 0.5 wrong", "sharp, whole: >= 0.9", "median px", "p98 px",
)  # fmt: skip
LEGEND = "too far off: by more than r/10 + 1 px; wrong: by more than r/2, or nothing is there"
ALL = "all"
SHARES = ((0.0, 0.2), (0.2, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.01))
"""Confidences, from and to below, by which lies are counted."""


def table(claims: Sequence[Claim]) -> list[Row]:
    """One row per condition, and one for each part as a whole."""
    groups = grouped(claims, lambda one: (one.part, one.condition))
    groups |= grouped(claims, lambda one: (one.part, ALL))
    rows = [_row(*key, group) for key, group in groups.items()]
    return sorted(rows, key=lambda row: row[0], reverse=True)


def _row(part: str, condition: str, claims: Sequence[Claim]) -> Row:
    sure = [one for one in claims if one.confidence >= SURE_CONFIDENCE]
    claimed = [one for one in claims if one.confidence >= CLAIM_CONFIDENCE]
    clear = [one for one in claims if one.clear]
    errors = sorted(one.error for one in sure if math.isfinite(one.error))
    return (
        part,
        condition,
        str(len(claims)),
        str(len(claimed)),
        str(len(sure)),
        _percent(sum(one.is_off for one in sure), len(sure)),
        _percent(sum(one.is_wrong for one in claimed), len(claimed)),
        _percent(sum(one.confidence >= SURE_CONFIDENCE for one in clear), len(clear)),
        f"{errors[len(errors) // 2]:.2f}" if errors else "-",
        f"{errors[int(0.98 * (len(errors) - 1))]:.2f}" if errors else "-",
    )


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} % ({part})" if whole else "-"


def lies(claims: Iterable[Claim]) -> list[Row]:
    """By part and confidence: positions, and the shares too far off and wrong."""
    rows: list[Row] = []
    claims = [one for one in claims if one.confidence > 0]
    for part in dict.fromkeys(one.part for one in claims):
        for low, high in SHARES:
            some = [c for c in claims if c.part == part and low <= c.confidence < high]
            off, wrong = sum(c.is_off for c in some), sum(c.is_wrong for c in some)
            rows.append(
                (
                    part,
                    f"{low:.1f} to {min(1.0, high):.1f}",
                    str(len(some)),
                    _percent(off, len(some)),
                    _percent(wrong, len(some)),
                )
            )
    return rows


LIES_HEADINGS: Row = ("of", "confidence", "positions", "too far off", "wrong")


def figures(claims: Iterable[Claim]) -> list[dict[str, Any]]:
    """All claims, for `--json`; an infinite error is null."""
    return [
        {**asdict(one), "error": one.error if math.isfinite(one.error) else None} for one in claims
    ]
