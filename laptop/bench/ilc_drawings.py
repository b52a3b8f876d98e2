"""A drawing of thirty strokes by arms that are not as described: none, some or all are rehearsed.

The strokes lie as the seeds of a sunflower do (H. Vogel, 1979), each in a direction of its own, so
that all joint angles and directions of the sheet occur.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from laptop.bench.bench import grouped, silenced
from laptop.bench.ilc_rig import AgeingRig, IlcCase
from laptop.drawing.artwork import Artwork
from laptop.drawing.options import DrawingOptions
from laptop.drawing.preparing import DrawingPlan, prepare
from laptop.emulator.device.plant_constants import CPU
from laptop.measure.ilc.sampled_trials import run_sampled_trials
from laptop.measure.ilc.trials import DrawingLearner, merged_numbers
from laptop.measure.run_data import RunData
from laptop.record.figures.line_accuracy import distances, pen_down_runs, place, refined
from shared.arm_description import Arm, ArmError

STROKES, STROKE_LENGTH, RADIUS = 30, 2.6, 6.0
"""Number of strokes, their length and the radius of the sheet of their middles, cm."""

TURN = 2.3
"""Turn from one stroke to the next, golden angles."""

REHEARSED = (0, 6, 12, STROKES)
"""Numbers of strokes that are rehearsed."""

TRIALS = 3
"""Number of trials of them."""

PATH = "sunflower"
"""Name of the drawing."""

HEADINGS = (
    *("arm", "rehearsed", "drawn", "foretold", "greatest, median", "p95", "rms, median", "rms p95"),
    "rehearsals, s",
)


@dataclass(frozen=True)
class DrawingResult:
    """The result of one arm with some of the strokes rehearsed.

    greatest_mm  greatest distance of the true ink from its stroke
    rms_mm       of the whole ink
    seconds      spent on trials, of the brick's time
    kinds        of the arm's errors that foretell the other strokes
    why          the error by which it ended
    failed       whether it ended by one
    """

    case: IlcCase
    rehearsed: int
    greatest_mm: float = math.nan
    rms_mm: float = math.nan
    seconds: float = 0.0
    kinds: tuple[str, ...] = ()
    why: str = ""
    failed: bool = False


def sunflower() -> Artwork:
    """Return the drawing."""
    golden = math.pi * (3 - math.sqrt(5))
    lines = []
    for k in range(STROKES):
        out = RADIUS * math.sqrt((k + 0.5) / STROKES)
        middle = out * np.array([math.cos(k * golden), math.sin(k * golden)])
        half = (
            STROKE_LENGTH / 2 * np.array([math.cos(TURN * k * golden), math.sin(TURN * k * golden)])
        )
        lines.append(np.array([middle - half, middle + half]))
    return Artwork(PATH, tuple(lines), ("",) * STROKES)


def plan_of(arm: Arm) -> DrawingPlan:
    """Plan the drawing; no two of its strokes are joined."""
    return prepare(sunflower(), arm, DrawingOptions(size=(2 * RADIUS + STROKE_LENGTH, None)))


def cases(seeds: range, arms: Sequence[str], cpu: float = CPU) -> list[IlcCase]:
    """Return every arm by every seed, as built."""
    return [IlcCase(seed, arm, PATH, cpu=cpu) for seed in seeds for arm in arms]


class _Timed:
    """A rig that counts the time of its trials."""

    def __init__(self, rig: AgeingRig) -> None:
        self.arm, self.seconds = rig.arm, 0.0
        self._rig = rig

    def measure(self, job: Path, dry: bool = True) -> RunData:
        run = self._rig.measure(job, dry)
        self.seconds += self._rig.rig.last.outcome.t
        return run


def run_case(case: IlcCase) -> list[DrawingResult]:
    """Draw the drawing with none, some and all of its strokes rehearsed."""
    rig = AgeingRig(case)
    plan = plan_of(rig.arm)
    return [_drawn(rig, plan, case, count) for count in REHEARSED]


def _drawn(rig: AgeingRig, plan: DrawingPlan, case: IlcCase, count: int) -> DrawingResult:
    timed = _Timed(rig)
    kinds: tuple[str, ...] = ()
    try:
        with silenced(), tempfile.TemporaryDirectory() as folder:
            offsets = []
            if count:
                learned = run_sampled_trials(plan, timed, rig.view, TRIALS, count)
                offsets, kinds = learned.numbers(), learned.unseen.kinds if learned.unseen else ()
            job = Path(folder) / "drawing.job"
            plan.write_job(job, offsets)
            rig.measure(job, dry=False)
    except ArmError as error:
        return DrawingResult(case, count, why=str(error), failed=True)
    paths = DrawingLearner(plan).paths
    errors = []
    for rows, group in zip(pen_down_runs(rig.rig.last.record), merged_numbers(plan), strict=True):
        ink = refined(np.array([place(row) for row in rows], float))[:, :2]
        desired = np.concatenate([piece.p for k in group for piece in paths[k]])
        errors.append(10 * distances(ink, desired))
    every = np.concatenate(errors)
    rms = float(np.sqrt((every**2).mean()))
    return DrawingResult(case, count, float(every.max()), rms, timed.seconds, kinds)


def table(results: Sequence[DrawingResult]) -> list[list[str]]:
    """Return one row per arm and number of strokes rehearsed: deviations, mm."""
    rows = []
    for (arm, count), every in grouped(
        results, lambda result: (result.case.arm, result.rehearsed)
    ).items():
        drawn = [result for result in every if not result.failed]
        row = [arm, f"{count} of {STROKES}", f"{len(drawn)} of {len(every)}", ""]
        if 0 < count < STROKES:
            row[-1] = f"{sum(bool(result.kinds) for result in drawn)} of {len(drawn)}"
        if drawn:
            for values in ([one.greatest_mm for one in drawn], [one.rms_mm for one in drawn]):
                row += [f"{np.median(values):.2f}", f"{np.percentile(values, 95):.2f}"]
            row.append(f"{np.median([one.seconds for one in drawn]):.0f}")
        rows.append(row + [""] * (len(HEADINGS) - len(row)))
    order = {(arm, f"{n} of {STROKES}"): n for arm in ("planar", "geared") for n in REHEARSED}
    return sorted(rows, key=lambda row: (row[0] != "planar", order[row[0], row[1]]))
