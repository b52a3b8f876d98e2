"""Bounds of lines that a camera has taught: each cause is taken away in turn, in the emulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from laptop.bench.bench import grouped
from laptop.bench.ilc_rig import WITHOUT, IlcCase
from laptop.emulator.device.plant_constants import CPU

if TYPE_CHECKING:
    from laptop.bench.ilc import IlcResult

HEADINGS = (
    *("without", "drawn", "greatest, median", "p95", "rms, median"),
    *("two drawings differ by", "less than with all, mean"),
)


def cases(seeds: range, paths: Sequence[str], cpu: float = CPU) -> list[IlcCase]:
    """Return paths by each seed's planar arm as built, with nothing and each cause taken away."""
    return [
        IlcCase(seed, "planar", path, cpu=cpu, without=without)
        for without in WITHOUT
        for seed in seeds
        for path in paths
    ]


def table(results: Sequence[IlcResult]) -> list[list[str]]:
    """Return one row per cause: deviations after the trials, mm."""
    plain = {
        (result.case.seed, result.case.path): result
        for result in results
        if not result.case.without and not result.failed
    }
    rows = []
    for without, every in grouped(results, lambda result: result.case.without).items():
        drawn = [result for result in every if not result.failed]
        row = [without or "nothing", f"{len(drawn)} of {len(every)}"]
        greatest = np.array([result.greatest_mm[-1] for result in drawn])
        if drawn:
            row += [f"{np.median(greatest):.2f}", f"{np.percentile(greatest, 95):.2f}"]
            row.append(f"{np.median([result.rms_mm[-1] for result in drawn]):.2f}")
            row.append(f"{np.median([result.repeats_mm for result in drawn]):.2f}")
        pairs = [
            plain[key].greatest_mm[-1] - result.greatest_mm[-1]
            for result in drawn
            if (key := (result.case.seed, result.case.path)) in plain
        ]
        if without and len(pairs) > 1:
            error = np.std(pairs, ddof=1) / np.sqrt(len(pairs))
            row.append(f"{np.mean(pairs):.2f} +- {error:.2f}")
        rows.append(row + [""] * (len(HEADINGS) - len(row)))
    return rows
