"""Whole drawings: their order beside vpype's, their estimate beside the run, their ink."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from laptop.bench import draw as lines
from laptop.bench import plot_drawings
from laptop.bench.bench import BenchRecord, BenchTable, silenced
from laptop.drawing import planning, preparing, sources, strokes
from laptop.drawing.artwork import Artwork
from laptop.drawing.gallery_files import gallery
from laptop.drawing.options import DrawingOptions
from laptop.emulator.rig import Rig
from laptop.record.figures import drawing_plot
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

ARMS = ("planar", "geared", "spatial")

DRAWING_TIMEOUT = 24 * 3600.0
"""Longest time of a drawing on the emulated brick, s."""

VPYPE_ARGS = ("read", "--no-crop", "-", "linemerge", "linesort", "write", "--format", "svg", "-")
"""Arguments of vpype for a drawing on its standard input."""

VPYPE_TIMEOUT = 300.0
"""Longest time of vpype, s."""


@dataclass(frozen=True)
class PlotCase:
    """A drawing, given by its name or file, and the arm that draws it."""

    drawing: str
    arm: str
    pictures: str | None = None


@dataclass(frozen=True)
class PlotResult:
    """One drawing drawn.

    Attributes:
        drawing, arm: their names.
        strokes, points: numbers of them in the drawing, within the arm's reach.
        drawn_strokes, drawn_points: numbers of drawn ones.
        before_cm: pen-up path in the drawing's own order.
        vpype_cm: the same after vpype's `linemerge linesort`; None where that is not installed.
        vpype_strokes: number of strokes after that.
        ours_cm: pen-up path as it is planned.
        true_cm: true pen-up path of the tip, which takes up backlash from behind.
        ink_cm: length of the ink.
        estimated_s, drawn_s: time on the brick, estimated and true.
        greatest_mm, rms_mm, missed_mm: see laptop.record.figures.drawing_plot.DrawingAccuracy.
        floor_mm: half an encoder count at every joint, at its largest along the drawing.
        standing_s: longest time for which the tip stood with the pen down.
        prepared_s: time of the preparation on this computer.
        error: reason why it was not drawn, or "".
    """

    drawing: str
    arm: str
    strokes: int = 0
    points: int = 0
    drawn_strokes: int = 0
    drawn_points: int = 0
    before_cm: float = math.nan
    vpype_cm: float | None = None
    vpype_strokes: int | None = None
    ours_cm: float = math.nan
    true_cm: float = math.nan
    ink_cm: float = math.nan
    estimated_s: float = math.nan
    drawn_s: float = math.nan
    greatest_mm: float = math.nan
    rms_mm: float = math.nan
    missed_mm: float = math.nan
    floor_mm: float = math.nan
    standing_s: float = math.nan
    prepared_s: float = math.nan
    error: str = ""


def cases(files: Sequence[str], arms: Sequence[str], pictures: str | None) -> list[PlotCase]:
    """Return every drawing by every arm; ten drawings if no file is given."""
    drawings = files or (*gallery(), *plot_drawings.NAMES)
    return [PlotCase(drawing, arm, pictures) for drawing, arm in product(drawings, arms)]


def artwork_of(drawing: str) -> Artwork:
    """Return a drawing of the bench, of the gallery or of a file."""
    if drawing in plot_drawings.NAMES:
        return plot_drawings.artwork(drawing)
    return sources.read_source(drawing)


def draw(case: PlotCase) -> PlotResult:
    """Draw one case on the emulated brick, at the brick's pace."""
    arm = read_arm(find_arm(case.arm))
    artwork = artwork_of(case.drawing)
    began = time.perf_counter()
    plan = preparing.prepare(artwork, arm, DrawingOptions(clip=True))
    prepared = time.perf_counter() - began
    placed = strokes.cut(
        *(arm, plan.placement.strokes, artwork.layers, plan.options.height),
        plan.options.postures(arm),
    )
    vpype = by_vpype([stroke.points for stroke in placed.strokes])
    with tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "drawing.job")
        plan.write_job(file)
        with silenced(), Rig(arm) as rig:
            done = rig.job(file, timeout=DRAWING_TIMEOUT)
    chains = planning.merged_strokes(plan.strokes, arm, plan.options.height)
    accuracy = drawing_plot.compare(done.record, chains)
    if case.pictures:
        name = f"{Path(case.drawing).stem}-{case.arm}"
        drawing_plot.write_drawing_plot(
            Path(case.pictures) / f"{name}.png",
            done.record,
            chains,
            accuracy,
            f"{artwork.name}, {arm.name}",
            f"greatest {accuracy.greatest_mm:.2f} mm, rms {accuracy.rms_mm:.2f} mm",
        )
    return PlotResult(
        case.drawing,
        case.arm,
        plan.before.strokes,
        plan.before.points,
        plan.after.strokes,
        plan.after.points,
        plan.before.pen_up_cm,
        vpype and vpype[0],
        vpype and vpype[1],
        plan.after.pen_up_cm,
        accuracy.pen_up_cm,
        accuracy.ink_cm,
        plan.estimate.seconds,
        done.outcome.t,
        accuracy.greatest_mm,
        accuracy.rms_mm,
        accuracy.missed_mm,
        floor(plan),
        accuracy.standing_s,
        prepared,
        "" if done.outcome.status == 0 else done.outcome.reason,
    )


def floor(plan: preparing.DrawingPlan) -> float:
    """Return the deviation of a perfect controller that knows each joint to half a count, mm.

    Half a count at every joint in the worst signs, mapped through the Jacobian onto the normal of
    the path, at its largest along the drawing.
    """
    errors = lines.half_counts(plan.arm)
    greatest = 0.0
    for stroke in plan.strokes:
        for motion in stroke.motions:
            for t in np.linspace(0.0, motion.duration, 2 * len(motion.numbers()[1]) + 1)[1:-1]:
                jacobian = np.array(kinematics.jacobian(plan.arm, motion.at(t)[0]))
                direction = jacobian @ motion.speeds(t)
                direction /= np.linalg.norm(direction)
                greatest = max(greatest, lines.deviation_across(direction, jacobian, errors))
    return 10 * greatest


def by_vpype(lines: Sequence[np.ndarray]) -> tuple[float, int] | None:
    """Return the pen-up path (cm) and number of strokes after vpype; None without vpype."""
    program = shutil.which("vpype")
    if program is None:
        return None
    done = subprocess.run(
        [program, *VPYPE_ARGS],
        input=svg_of(lines),
        capture_output=True,
        text=True,
        timeout=VPYPE_TIMEOUT,
        check=True,
    )
    return path_and_count(done.stdout)


def path_and_count(svg: str) -> tuple[float, int]:
    """Return the pen-up path (cm) and number of strokes of an SVG."""
    found = sources.read_source(svg.encode(), "vpype").strokes
    return sum(math.dist(a[-1], b[0]) for a, b in pairwise(found)), len(found)


def svg_of(lines: Sequence[np.ndarray]) -> str:
    """Return strokes as an SVG of 60 x 60 cm."""
    text = "".join(
        '<polyline points="{}"/>'.format(" ".join(f"{x + 30:.5f},{y + 30:.5f}" for x, y in line))
        for line in lines
    )
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" width="60cm" height="60cm" viewBox="0 0 60 60" '
        f'fill="none" stroke="black">{text}</svg>'
    )


HEADINGS = (
    "drawing", "arm", "strokes", "points", "pen up cm", "vpype", "ours", "true", "about s",
    "drawn s", "off by", "greatest mm", "rms mm", "left out", "stands s", "failed",
)  # fmt: skip
LEGEND = (
    "strokes and points > as drawn; pen up: as it came, in vpype's order (strokes), in ours, and "
    "truly; mm (in floors)"
)


def table(results: Sequence[PlotResult]) -> list[list[str]]:
    """Return one row per drawing and arm."""
    return [
        [
            Path(r.drawing).stem,
            r.arm,
            f"{r.strokes} > {r.drawn_strokes}",
            f"{r.points} > {r.drawn_points}",
            f"{r.before_cm:.0f}",
            "-" if r.vpype_cm is None else f"{r.vpype_cm:.0f} ({r.vpype_strokes})",
            f"{r.ours_cm:.0f}",
            f"{r.true_cm:.0f}",
            f"{r.estimated_s:.0f}",
            f"{r.drawn_s:.0f}",
            f"{100 * (r.estimated_s / r.drawn_s - 1):+.1f} %",
            f"{r.greatest_mm:.2f} ({r.greatest_mm / r.floor_mm:.1f})",
            f"{r.rms_mm:.2f} ({r.rms_mm / r.floor_mm:.1f})",
            f"{r.missed_mm:.2f}",
            f"{r.standing_s:.2f}",
            r.error,
        ]
        for r in results
    ]


def _cases(it: Any) -> list[PlotCase]:
    for arm in it.arms:
        read_arm(find_arm(arm))
    for file in it.files:
        artwork_of(file)  # before minutes are spent
    return cases(it.files, it.arms or ARMS, it.pictures and str(Path(it.pictures).resolve()))


def _shown(results: list[PlotResult], it: Any) -> Iterator[BenchTable | str]:
    yield BenchTable(f"Drawings; {LEGEND}", HEADINGS, table(results), int(len(it.arms) != 1))
    off = [abs(one.estimated_s / one.drawn_s - 1) for one in results]
    yield (
        f"estimates are off by {100 * max(off):.1f} % at most and by "
        f"{100 * math.fsum(off) / len(off):.1f} % in the mean"
    )


BENCH = BenchRecord(
    "drawing",
    _cases,
    draw,
    _shown,
    figures=lambda results: [
        {key: None if value != value else value for key, value in asdict(one).items()}
        for one in results
    ],
)
