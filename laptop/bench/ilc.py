"""Learning of lines and curves by a camera, in trials, by arms that are not as described.

Each seed draws an arm, planar or geared in turn, and its errors: links, zero, backlash, load.  A
camera that knows the table sees its marker.  No file gives the arm its errors.
"""

from __future__ import annotations

import math
import random
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, silenced
from laptop.drawing.artwork import Artwork
from laptop.drawing.lines import in_place, line_through
from laptop.drawing.options import DrawingOptions
from laptop.drawing.planning import Learned
from laptop.drawing.preparing import DrawingPlan, prepare
from laptop.emulator.device.plant_constants import CPU
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.emulated_rig import EmulatedRig, RenderedRig
from laptop.measure.ilc.emulated_view import view_of
from laptop.measure.ilc.trials import DrawingLearner, run_trials
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import RunData
from laptop.record.figures.line_accuracy import distances, pen_down_runs, place, refined
from shared.arm_description import Arm, ArmError, find_arm, read_arm

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

MAX_LINK_ERROR, MAX_ZERO_ERROR, MAX_BACKLASH, MAX_LOAD = 0.05, 1.5, 3.0, 0.015
"""Greatest errors: share of a link, of the zero, deg, backlash, deg, load, Nm at every joint."""

VOLTAGE_RANGE = 7.85, 7.95
"""Range of the motors' voltage, V, drawn anew for each drawing."""

NOISE_PX, FPS = 0.5, 20.0
"""Sigma of a seen place, px, and rate, Hz, of the ideal camera."""

Inks = list[np.ndarray]
"""Inks of some drawings, (n, 2) each, cm."""


@dataclass(frozen=True)
class IlcCase:
    """One arm that draws one path.

    seed, arm, path  names of them
    wrong            whether it is built otherwise than described
    rendered         whether the real tracker gets rendered pictures
    cpu              slowness of its brick
    """

    seed: int
    arm: str
    path: str
    wrong: bool = True
    rendered: bool = False
    cpu: float = CPU


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


class AgeingRig:
    """An emulated arm with another battery voltage for each drawing.

    Args:
        case: which arm.

    Attributes:
        arm: as it is described.
        view: of its camera.
        rig: EmulatedRig of the last drawing.
        rendered: whether pictures are rendered for the real tracker.
        plant: text of its plant's constants, errors included.
    """

    rig: EmulatedRig

    def __init__(self, case: IlcCase) -> None:
        self.arm: Arm = read_arm(find_arm(case.arm))
        rng = random.Random(f"{case.arm}/{case.seed}")
        self.plant = f"seed={case.seed},cpu={case.cpu:g}"
        self._built = self.arm
        if case.wrong:
            links = [
                joint.link * (1 + rng.uniform(-1, 1) * MAX_LINK_ERROR) for joint in self.arm.joints
            ]
            joints = zip(self.arm.joints, links, strict=True)
            self._built = self.arm._replace(
                joints=tuple(joint._replace(link=link) for joint, link in joints)
            )
            self.plant += (
                f",backlash={rng.uniform(0, MAX_BACKLASH):.3f}"
                f",zero_error={rng.uniform(-1, 1) * MAX_ZERO_ERROR:.3f}"
                f",load={rng.uniform(-1, 1) * MAX_LOAD:.4f}"
            )
        self._battery = random.Random(f"battery/{case.arm}/{case.seed}/{case.path}")
        self.rendered = case.rendered
        self._scene = Scene(self._built, read_scene(f"fps={FPS:g},seed={case.seed}"))
        self.view: TipView = view_of(self._scene, self.arm)

    def measure(self, job: Path, dry: bool = True) -> RunData:
        """Measure a job's run, as MeasuringRig.measure."""
        plant = f"{self.plant},voltage={self._battery.uniform(*VOLTAGE_RANGE):.3f}"
        seed = self._battery.randrange(2**31)
        if self.rendered:
            self.rig = RenderedRig(self.arm, {"A": self._scene}, self._built, plant, seed)
        else:
            height = self._scene.constants["marker_height"]
            camera = {"A": self._scene}
            self.rig = EmulatedRig(
                self.arm, self._built, plant, camera, height, NOISE_PX, FPS, seed
            )
        return self.rig.measure(job, dry)

    def ink(self) -> np.ndarray:
        """Return the true ink of the last drawing, (n, 2), cm."""
        (strokes,) = pen_down_runs(self.rig.last.record)
        return np.asarray(refined(np.array([place(row) for row in strokes], float))[:, :2])


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


BENCH = BenchRecord(
    "drawing",
    lambda it: cases(it.seeds, cpu=it.cpu),
    run_case,
    lambda results, it: [
        BenchTable("Drawn by sight: mm, after 0 to 3 rehearsals", HEADINGS, table(results), 3)
    ],
)
