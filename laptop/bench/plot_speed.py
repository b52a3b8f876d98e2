"""Time to read and order large drawings, beside vpype's.

Each is a fresh process that reads an SVG and puts its strokes into order; the CPU time of the
whole process counts, imports included.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable
from laptop.drawing import merging, ordering, sources
from laptop.drawing.strokes import PlacedStroke
from laptop.emulator.bundled_scripts import REPO_ROOT

TIMED_PROGRAM = (
    f"import sys; sys.path[0] = {REPO_ROOT!r}; from laptop.bench.plot_speed import main; main()"
)
"""Program of the timed process, whose argument is the file."""

CPU_TIME_STEP = 0.01
"""Resolution of CPU times, s."""


def _scattered(strokes: int, points: int) -> list[np.ndarray]:
    rng = np.random.default_rng(strokes + points)
    steps = rng.normal(0, 0.2 / math.sqrt(points), (strokes, points, 2))
    return list(rng.uniform(-8, 8, (strokes, 1, 2)) + np.cumsum(steps, 1))


def _spokes(count: int) -> list[np.ndarray]:
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return [np.array([(0.0, 0.0), (8 * math.cos(a), 8 * math.sin(a))]) for a in angles]


SIZES: dict[str, Callable[[], list[np.ndarray]]] = {
    "2,000 strokes": lambda: _scattered(2_000, 2),
    "20,000 strokes": lambda: _scattered(20_000, 2),
    "90,000 strokes": lambda: _scattered(90_000, 2),
    "300 strokes of 340 points": lambda: _scattered(300, 340),
    "one stroke of 100,000 points": lambda: _scattered(1, 100_000),
    "10,000 spokes": lambda: _spokes(10_000),
}


@dataclass(frozen=True)
class Speed:
    """The speed of one drawing: CPU seconds, and the pen-up path of the order, cm."""

    drawing: str
    ours_s: float
    ours_cm: float
    ours_strokes: int
    vpype_s: float | None = None
    vpype_cm: float | None = None
    vpype_strokes: int | None = None


def measure(drawing: str) -> Speed:
    """Read and order one of SIZES, and let vpype do so where it is installed."""
    from laptop.bench.plot import VPYPE_ARGS, path_and_count, svg_of  # not when timed

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "it.svg")
        file.write_text(svg_of(SIZES[drawing]()), encoding="utf-8")
        args = [sys.executable, "-c", TIMED_PROGRAM, str(file)]
        took, out = _timed(args)
        path, count = json.loads(out)
        vpype = shutil.which("vpype")
        if vpype is None:
            return Speed(drawing, took, path, count)
        vpype_args = list(VPYPE_ARGS)
        vpype_args[vpype_args.index("-")] = str(file)
        vpype_took, out = _timed([vpype, *vpype_args])
        return Speed(drawing, took, path, count, vpype_took, *path_and_count(out))


def _timed(args: Sequence[str]) -> tuple[float, str]:
    """Return the CPU seconds of a program, and its output."""
    before = os.times()
    done = subprocess.run(args, capture_output=True, text=True, check=True)
    after = os.times()
    took = after.children_user - before.children_user
    return took + after.children_system - before.children_system, done.stdout


HEADINGS = "drawing", "ours s", "vpype s", "times", "ours cm (strokes)", "vpype cm (strokes)"


def table(results: Sequence[Speed]) -> list[list[str]]:
    """Return one row per drawing."""
    return [
        [
            one.drawing,
            f"{one.ours_s:.1f}",
            "-" if one.vpype_s is None else f"{one.vpype_s:.1f}",
            "-" if one.vpype_s is None else f"{one.ours_s / max(one.vpype_s, CPU_TIME_STEP):.2f}",
            f"{one.ours_cm:.0f} ({one.ours_strokes})",
            "-" if one.vpype_cm is None else f"{one.vpype_cm:.0f} ({one.vpype_strokes})",
        ]
        for one in results
    ]


def _cases(it: Any) -> list[str]:
    return list(SIZES)


BENCH = BenchRecord(
    "ordering",
    _cases,
    None,
    lambda results, it: [
        BenchTable(
            "CPU seconds to read and order, on this machine",
            HEADINGS,
            table(results),
            of_this_machine=True,
        )
    ],
    in_turn=lambda cases: map(measure, cases),  # nothing else is to use the caches
)


def main() -> None:
    """Read and order a file, and print the pen-up path (cm) and the number of strokes."""
    artwork = sources.read_source(sys.argv[1])
    placed = [PlacedStroke(points, "", 1, ("up",)) for points in artwork.strokes]
    inked = ordering.ordered(merging.merged(placed), np.zeros(2))
    print(json.dumps([ordering.pen_up_length(inked), len(inked)]))
