"""Learning of lines and curves by a camera, in trials, by arms that are not as described.

Each seed draws an arm, planar or geared in turn, and its errors: links, zero, backlash, load.  A
camera that knows the table sees its marker.  No file gives the arm its errors.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from laptop.bench import ilc_bounds, ilc_drawings
from laptop.bench.bench import BenchRecord, BenchTable, flat, silenced
from laptop.bench.ilc_drawings import DrawingResult
from laptop.bench.ilc_rig import AgeingRig, IlcCase
from laptop.drawing.artwork import Artwork
from laptop.drawing.lines import in_place, line_through
from laptop.drawing.options import DrawingOptions
from laptop.drawing.planning import Learned
from laptop.drawing.preparing import DrawingPlan, prepare
from laptop.emulator.device.plant_constants import CPU
from laptop.measure.ilc.trials import DrawingLearner, run_trials
from laptop.measure.run_data import RunData
from laptop.record.figures.line_accuracy import distances
from shared.arm_description import Arm, ArmError

BOUNDS, DRAWINGS = "bounds", "drawings"
"""Words for what is measured beside the paths."""

ARMS = ("planar", "geared")

TRIALS = 3
"""Number of trials of a path."""

REPEATED_DRAWINGS = 5
"""Number of drawings, without and with the learned offsets, of an arm as described."""

LINES = {
    "line 1": ((10, 0), (5, 10)),
    "line 2": ((15, 0), (0, 15)),
    "line 3": ((12, 15), (0, 15)),
}
"""Lines of a usual lab report, cm; the last comes near to full reach."""

CURVES = ("circle", "wave")
"""Names of the curves."""

Inks = list[np.ndarray]
"""Inks of some drawings, (n, 2) each, cm."""


@dataclass(frozen=True)
class IlcResult:
    """The result of a case.

    greatest_mm  greatest distance of the true ink from its path, after 0, 1, ... trials
    end_mm       greater distance of the ink's two ends from the path's
    rms_mm       of the ink from its path
    seen_mm      rms of the error seen by the camera, in each trial
    learned_deg  greatest offset of a joint in the end
    repeats_mm   greatest distance between two drawings with the final offsets
    means_mm     of an arm as described: mean greatest distance of some drawings without the
                 offsets, and with them; () where nothing was learned, so that nothing differs
    why          why it ended before all were done; or the error
    failed       whether it ended by an error
    """

    case: IlcCase
    greatest_mm: tuple[float, ...] = ()
    end_mm: tuple[float, ...] = ()
    rms_mm: tuple[float, ...] = ()
    seen_mm: tuple[float, ...] = ()
    learned_deg: float = math.nan
    repeats_mm: float = math.nan
    means_mm: tuple[float, ...] = ()
    why: str = ""
    failed: bool = False


def cases(
    seeds: range, arms: Sequence[str] = ARMS, rendered: int = 5, cpu: float = CPU
) -> list[IlcCase]:
    """Return every path by every seed's arm as built, and by one that is as described.

    Args:
        seeds: of the arms.
        arms: their descriptions, in turn.
        rendered: number of seeds whose arms as built are seen in rendered pictures.
        cpu: slowness of their bricks.
    """
    return [
        IlcCase(seed, arms[k % len(arms)], path, wrong, wrong and k < rendered, cpu)
        for k, seed in enumerate(seeds)
        for wrong in (True, False)
        for path in (*LINES, *CURVES)
    ]


def artwork_of(path: str) -> Artwork:
    """Return a path of this bench, in the arm's frame."""
    if path in LINES:
        return line_through(LINES[path])
    angle = np.linspace(0, 2 * np.pi, 121)
    if path == "circle":
        points = np.stack([11 + 3 * np.cos(angle), 4 + 3 * np.sin(angle)], axis=1)
    else:
        points = np.stack([6 + 8 * angle / angle[-1], 4 + 2 * np.sin(angle)], axis=1)
    return Artwork(path, (points,), ("",))


def plan_of(arm: Arm, path: str) -> DrawingPlan:
    """Plan a path in its place."""
    artwork = artwork_of(path)
    return prepare(artwork, arm, in_place(artwork, DrawingOptions()))


def _drawn(plan: DrawingPlan, offsets: list[list[Learned]], rig: AgeingRig, times: int) -> Inks:
    """Draw it a number of times with these offsets; return the inks."""
    inks = []
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "drawing.job"
        plan.write_job(job, offsets)
        for _ in range(times):
            rig.measure(job, dry=False)
            inks.append(rig.ink())
    return inks


def run_case(case: IlcCase) -> IlcResult:
    """Draw a path after none, one, ... trials."""
    rig = AgeingRig(case)
    plan = plan_of(rig.arm, case.path)
    desired = np.concatenate([piece.p for stroke in DrawingLearner(plan).paths for piece in stroke])
    inks: list[np.ndarray] = []

    class Watched:
        """A rig that stores the ink of every trial."""

        arm = rig.arm

        def measure(self, job: Path, dry: bool = True) -> RunData:
            run = rig.measure(job, dry)
            inks.append(rig.ink())
            return run

    try:
        with silenced():
            learned = run_trials(plan, Watched(), rig.view, TRIALS)
            rig.rendered = False  # learning is over
            twice = _drawn(plan, learned.numbers(), rig, 2)
            means: tuple[float, ...] = ()
            if not case.wrong and any(piece.greatest for own in learned.offsets for piece in own):
                without = _drawn(plan, [], rig, REPEATED_DRAWINGS)
                learned_inks = twice + _drawn(plan, learned.numbers(), rig, REPEATED_DRAWINGS - 2)
                means = tuple(
                    float(np.mean([10 * distances(ink, desired).max() for ink in every]))
                    for every in (without, learned_inks)
                )
    except ArmError as error:
        return IlcResult(case, why=str(error), failed=True)
    inks.append(twice[0])
    # Where learning ended early, the final offsets count for the rest.
    inks += [twice[1]] * (TRIALS + 1 - len(inks))
    errors = [10 * distances(ink, desired) for ink in inks]
    ends = [
        10 * max(math.dist(ink[0], desired[0]), math.dist(ink[-1], desired[-1])) for ink in inks
    ]
    greatest = max(piece.greatest for stroke in learned.offsets for piece in stroke)
    return IlcResult(
        case,
        tuple(float(error.max()) for error in errors),
        tuple(ends),
        tuple(float(np.sqrt((error**2).mean())) for error in errors),
        tuple(step.rms_mm for step in learned.steps),
        math.degrees(greatest),
        float(10 * distances(twice[0], twice[1]).max()),
        means,
        learned.why,
    )


HEADINGS = (
    *("arm", "path", "built", "drawn", "greatest, median", "p95", "end, median", "repeats"),
    "mean of 5: without, learned",
)


def table(results: Sequence[IlcResult]) -> list[list[str]]:
    """Return one row per arm, path and whether it is as described; after 0, 1, ... trials."""
    groups: dict[tuple[str, bool, str], list[IlcResult]] = {}
    for result in results:
        case = result.case
        kind = "lines" if case.path in LINES else "curves"
        rows = [case.path, f"all {kind}"] + [f"{kind}, rendered"] * case.rendered
        for path in rows:
            groups.setdefault((case.arm, case.wrong, path), []).append(result)
    order = [*LINES, *CURVES, "all lines", "all curves", "lines, rendered", "curves, rendered"]
    keys = sorted(groups, key=lambda key: (-ARMS.index(key[0]), key[1], -order.index(key[2])))
    return [_row(key, groups[key]) for key in reversed(keys)]


def _row(key: tuple[str, bool, str], every: Sequence[IlcResult]) -> list[str]:
    arm, wrong, path = key
    drawn = [result for result in every if not result.failed]
    row = [arm, path, "otherwise" if wrong else "as described", f"{len(drawn)} of {len(every)}"]
    if drawn:
        greatest = np.array([result.greatest_mm for result in drawn])
        ends = np.array([result.end_mm for result in drawn])
        columns = [
            np.median(greatest, axis=0),
            np.percentile(greatest, 95, axis=0),
            np.median(ends, axis=0),
            np.array([np.median([result.repeats_mm for result in drawn])]),
        ]
        means = [result.means_mm for result in drawn if result.means_mm]
        if means:
            columns.append(np.mean(means, axis=0))
        row += [" ".join(f"{value:.2f}" for value in column) for column in columns]
        if means:
            row[-1] += f" ({len(means)} learned)"
    return row + [""] * (len(HEADINGS) - len(row))


def _cases(it: Any) -> list[IlcCase]:
    if it.about == BOUNDS:
        return ilc_bounds.cases(it.seeds, list(LINES), it.cpu)
    if it.about == DRAWINGS:
        return ilc_drawings.cases(it.seeds, ARMS, it.cpu)
    return cases(it.seeds, cpu=it.cpu)


def _work(case: IlcCase) -> Sequence[IlcResult | DrawingResult]:
    return ilc_drawings.run_case(case) if case.path == ilc_drawings.PATH else [run_case(case)]


def _shown(results: Sequence[Any], it: Any) -> list[BenchTable]:
    if it.about == BOUNDS:
        title = f"What bounds lines after {TRIALS} rehearsals: mm, planar arms as built"
        return [BenchTable(title, ilc_bounds.HEADINGS, ilc_bounds.table(results))]
    if it.about == DRAWINGS:
        title = f"Drawings with some strokes rehearsed {ilc_drawings.TRIALS} times: mm"
        return [BenchTable(title, ilc_drawings.HEADINGS, ilc_drawings.table(results), 1)]
    return [BenchTable("Drawn by sight: mm, after 0 to 3 rehearsals", HEADINGS, table(results), 3)]


BENCH = BenchRecord("drawing", _cases, _work, _shown, gather=flat)
