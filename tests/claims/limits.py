"""Where straightness ends: the planar arm's three lines on plants farther and farther off."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable
from laptop.bench.draw import DrawCase, DrawResult, draw
from robot.drawing_commands import LINES

LIMITS = (
    ("as described", "backlash=2", 2.0),
    ("6.5 V", "backlash=2,voltage=6.5", 2.0),
    ("9 V", "backlash=2,voltage=9", 2.0),
    ("motor friction twice as high", "backlash=2,rotor_friction=2", 2.0),
    ("5 ms per sysfs access", "backlash=2,access=0.005", 2.0),
    ("encoder edges 1/4 count off", "backlash=2,phase=0.5", 2.0),
    ("the zero 1 degree off", "backlash=2,zero_error=1", 2.0),
    ("no play, described as 2", "backlash=0", 2.0),
    ("0.1 N of pen drag, not 0.04", "backlash=2,pen_drag=0.1", 2.0),
    ("0.02 Nm of load on every joint", "backlash=2,load=0.02", 2.0),
    ("0.05 Nm of load on every joint", "backlash=2,load=0.05", 2.0),
)
"""The difference, the true plant, the backlash (deg) described."""

HEADINGS = ("what is different", "line 1", "line 2", "line 3")


def cases(cpu: float) -> list[DrawCase]:
    """The three lines under conditions that the law was not made for."""
    return [
        DrawCase("planar", "smooth", name, plant, play, line, f"line {n}", cpu=cpu)
        for name, plant, play in LIMITS
        for n, line in enumerate(LINES[2], 1)
    ]


def table(results: list[DrawResult]) -> list[tuple[str, ...]]:
    """One row per condition: the greatest deviation in floors, or that the driver gave up."""
    rows: dict[str, list[str]] = {}
    for r in results:
        shown = "gave up" if r.error else f"{r.greatest / r.floor:.1f}"
        rows.setdefault(r.condition, [r.condition]).append(shown)
    return [tuple(row) for row in rows.values()]


def _shown(results: list[DrawResult], it: Any) -> Iterator[BenchTable]:
    title = f"planar arm, smooth, cpu={it.cpu:g}; greatest deviation in floors, from the emulator"
    yield BenchTable(title, HEADINGS, table(results))


BENCH = BenchRecord("drawing", lambda it: cases(it.cpu), draw, _shown, chunk=4)
