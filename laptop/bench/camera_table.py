"""The tables of `bench camera`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from laptop.bench.camera import CONDITIONS, HEIGHTS, CameraResult

HEADINGS = (
    "board",
    "markers",
    "refused",
    "RMS, px",
    *(f"{'on the table' if not h else f'{h:g} cm above it'}, mm" for h in HEIGHTS),
    "it says, mm",
    "errors in sigmas",
    "camera off by, mm",
    "focal length",
)
LEGEND = (
    "median / p95 of the worst lens; it says: two sigmas of that lens at the worst place, on the "
    "table / above; errors in sigmas: RMS, on the table / above; all others are medians"
)


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.3f}" if values else "-"


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.square(values).mean()))


def _p95(height: int) -> Callable[[CameraResult], float]:
    """By what a lens is the worst one at a height."""
    return lambda result: result.mm[height][1]


def table(results: Sequence[CameraResult]) -> list[list[str]]:
    """Rows under HEADINGS, one a condition."""
    rows = []
    for condition in CONDITIONS:
        own = [r for r in results if r.condition == condition.name]
        if not own:
            continue
        good = [r for r in own if not r.refused]
        seen = sorted(r.markers for r in own)
        count = f"{seen[0]} to {seen[-1]}" if seen[0] != seen[-1] else str(seen[0])
        row = [condition.name, count, f"{len(own) - len(good)} of {len(own)}"]
        if not good:
            rows.append([*row, *["-"] * (len(HEADINGS) - len(row))])
            continue
        heights = range(len(HEIGHTS))
        rows.append(
            [
                *row,
                _median([r.rms for r in good]),
                *(
                    f"{_median([r.mm[k][0] for r in good])} / {max(r.mm[k][1] for r in good):.3f}"
                    for k in heights
                ),
                " / ".join(f"{2 * max(good, key=_p95(k)).sigma[k]:.3f}" for k in heights),
                " / ".join(f"{_rms([r.in_sigmas[k] for r in good]):.2f}" for k in heights),
                _median([r.position for r in good]),
                f"{100 * float(np.median([abs(r.focal) for r in good])):.2f} %",
            ]
        )
    return rows


def said(results: Sequence[CameraResult]) -> list[str]:
    """Return what is said where something is wrong: by condition, of its first lens."""
    lines: dict[str, list[str]] = {}
    for r in results:
        usual = not r.condition.startswith("printed")
        told = [x for x in r.said if _tells_of_trouble(x) and not (usual and x.startswith("scale"))]
        words = [r.refused] if r.refused else told
        lines.setdefault(r.condition, words)
    return [f"{condition}: {text}" for condition, words in lines.items() for text in words]


def _tells_of_trouble(line: str) -> bool:
    return line.startswith(("scale", "the picture is")) or "covered" in line or "left out" in line


def without_nan(told: Any) -> Any:
    """Return the same for JSON, which has no nan: None in its place."""
    if isinstance(told, dict):
        return {key: without_nan(value) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [without_nan(value) for value in told]
    return None if isinstance(told, float) and math.isnan(told) else told
