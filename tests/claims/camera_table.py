"""What is measured of a camera, and its tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from operator import methodcaller
from typing import Any, NamedTuple

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, as_dicts, seeds_of
from tests.claims import camera, camera_touch
from tests.claims.camera import CONDITIONS, HEIGHTS, CameraResult

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


class Seen(NamedTuple):
    """All that is measured of a camera."""

    board: list[CameraResult]
    touches: list[camera_touch.TouchResult]
    moved: list[tuple[str, bool, str]]


def _gather(results: list[CameraResult], it: Any) -> Seen:
    return Seen(results, camera_touch.measure(it.seeds), camera.moves(it.seeds.start))


def _shown(seen: Seen, it: Any) -> Iterator[BenchTable | str]:
    title = f"{seeds_of(it)}, {len(it.seeds)} lenses, rendered"
    yield BenchTable(f"The board; {title}; {LEGEND}", HEADINGS, table(seen.board))
    touches = camera_touch.table(seen.touches)
    title = f"The pen's place by its marker, mm; {title}"
    yield BenchTable(title, camera_touch.HEADINGS, touches)
    yield "What is said:"
    yield from (f"  {line}" for line in said(seen.board))
    yield from (f"  moved: {by}: {words}" for by, _, words in seen.moved)


def _figures(seen: Seen) -> Any:
    told = {name: as_dicts(getattr(seen, name)) for name in ("board", "touches")}
    moved = [{"by": by, "noticed": noticed, "said": words} for by, noticed, words in seen.moved]
    return _without_nan({**told, "moved": moved})


def _without_nan(told: Any) -> Any:
    """Return the same for JSON, which has no nan: None in its place."""
    if isinstance(told, dict):
        return {key: _without_nan(value) for key, value in told.items()}
    if isinstance(told, (list, tuple)):
        return [_without_nan(value) for value in told]
    return None if isinstance(told, float) and math.isnan(told) else told


BENCH = BenchRecord(
    "photographing",
    lambda it: camera.cases(it.seeds),
    methodcaller("run"),
    _shown,
    _figures,
    _gather,
)
