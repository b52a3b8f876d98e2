"""Calibration of arms that are not as they are described: found values beside the true ones.

Links are off by up to 5 %, zeros by up to 1.5 degrees, the backlash is anything from 0 to 4 degrees
and described as 2, the marker sits up to 5 mm beside the pen.  A camera stands anywhere sensible
over the board and sees the marker to 1 px; a ruler has its height to 0.5 mm, a hand lays the board
along the arm to 0.3 degrees and sets the pen on six crosses to 0.3 mm.  Each arm's motors are drawn
with its seed, and the brick computes as slowly as it does.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, silenced
from laptop.emulator.device.plant_constants import at_port, read_plant
from laptop.emulator.rig import Rig
from laptop.measure.arm.arm_model import ArmModel, CameraPrior, MeasuredByHand
from laptop.measure.arm.arm_result import measured, write_measured
from laptop.measure.arm.calibrating import identify
from laptop.measure.arm.emulated_table import EmulatedTable, camera_over
from laptop.measure.emulated_rig import EmulatedRig
from laptop.record.figures import line_accuracy
from robot.drawing_commands import LINES
from shared.arm_description import Arm, ArmError, Joint, find_arm, read_arm
from shared.ini import with_values

if TYPE_CHECKING:
    from laptop.emulator.device.plant_constants import PlantConstants

MAX_LINK_ERROR, MAX_ZERO_ERROR, BACKLASH_RANGE, MAX_MARKER_OFFSET = 0.05, 1.5, (0.0, 4.0), 0.5
"""Greatest errors of the description: of links, a share; of zeros, deg; the range of the true
backlash, deg; the greatest offset of the marker from the pen, cm."""
NOISE_PX, TOUCHED_CROSSES = 1.0, 6
"""Sigma of a seen place, px, and number of crosses that a hand sets the pen on."""
HEIGHT_SIGMA, TURN_SIGMA = 0.05, math.radians(0.3)
"""Sigma of the measured height, cm, and of the board's direction, rad."""
UNITS = {"link": ("%", 0.3), "zero": ("deg", 0.3), "backlash": ("deg", 0.3), "marker": ("mm", 0.5)}
"""Unit of a number's error, and the wanted bound of that, by kind of number."""


@dataclass(frozen=True)
class CalibrateCase:
    """One arm, drawn with a seed."""

    seed: int
    arm: str = "planar"


@dataclass(frozen=True)
class CalibrateResult:
    """The result of one arm.

    seed     of the arm
    refused  why nothing was found, or ""
    errors   found less true, by the number's name: links in %, angles in deg, offsets in mm
    sigmas   stated sigmas of these
    poses, minutes  on the brick
    lines    greatest deviation of the three lines, mm: as described, as calibrated, with the truth
    """

    seed: int
    refused: str = ""
    errors: dict[str, float] = field(default_factory=dict)
    sigmas: dict[str, float] = field(default_factory=dict)
    poses: int = 0
    minutes: float = math.nan
    lines: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, eq=False)
class DrawnArm:
    """An arm drawn with a seed.

    described, built  as its file has it, and as it truly is
    zeros  true angles where the zero is believed, rad
    table  camera, board and hand
    height of the marker as a ruler has it, cm
    """

    described: Arm
    built: Arm
    zeros: tuple[float, ...]
    table: EmulatedTable
    height: float

    def plant(self, seed: int, zeros: Sequence[float]) -> PlantConstants:
        """Return the constants of its motors, with these errors of the zeros, rad."""
        ports = {
            joint.port: {"zero_error": math.degrees(zero)}
            for joint, zero in zip(self.described.joints, zeros, strict=True)
        }
        return read_plant(f"cpu=1,seed={seed}", {"ports": ports})


def draw_arm(case: CalibrateCase) -> DrawnArm:
    """Draw an arm, and the camera over it."""
    rng = np.random.default_rng([case.seed, 20])
    described = read_arm(find_arm(case.arm))
    joints, zeros = [], []
    for joint in described.joints:
        joints.append(
            joint._replace(
                link=joint.link * (1 + rng.uniform(-MAX_LINK_ERROR, MAX_LINK_ERROR)),
                backlash=math.radians(rng.uniform(*BACKLASH_RANGE)),
            )
        )
        zeros.append(math.radians(rng.uniform(-MAX_ZERO_ERROR, MAX_ZERO_ERROR)))
    along, aside = map(float, rng.uniform(-MAX_MARKER_OFFSET, MAX_MARKER_OFFSET, 2))
    built = described._replace(joints=tuple(joints), marker_offset=(along, aside))
    focal = 640 / 2 / math.tan(math.radians(rng.uniform(50, 75)) / 2)
    camera = camera_over(
        focal,
        (-8.0 + rng.uniform(-2, 2), rng.uniform(-2, 2)),
        focal * rng.uniform(44, 54) / 640,
        rng.uniform(0.05, 0.5),
        rng.uniform(0, 2 * math.pi),
        math.pi / 2 * rng.integers(4) + rng.uniform(-0.2, 0.2),
        distortion=(rng.uniform(-0.2, 0.05), 0.0, 0.0, 0.0, 0.0),
    )
    base = (-12.5 + float(rng.uniform(-1, 1)), float(rng.uniform(-2, 2)))
    height = float(rng.uniform(1.0, 4.0))
    turn = TURN_SIGMA * float(rng.standard_normal())
    table = EmulatedTable(built, camera, base, turn, height)
    stated = height + HEIGHT_SIGMA * float(rng.standard_normal())
    return DrawnArm(described, built, tuple(zeros), table, stated)


def calibrated(case: CalibrateCase) -> CalibrateResult:
    """Calibrate one arm, and draw lines before and after."""
    drawn = draw_arm(case)
    rng = np.random.default_rng([case.seed, 21])
    rig = EmulatedRig(
        drawn.described,
        drawn.built,
        drawn.plant(case.seed, drawn.zeros),
        {"A": drawn.table},
        drawn.table.height,
        NOISE_PX,
        seed=case.seed,
    )
    try:
        camera = drawn.table.calibrated(rng, 100.0).camera
        touches = drawn.table.touches(TOUCHED_CROSSES, rng, NOISE_PX)
        known = MeasuredByHand(drawn.height, 0, MAX_MARKER_OFFSET / math.sqrt(3))
        model = ArmModel(drawn.described, {"A": CameraPrior.of(camera)}, known)
        found = identify(rig, model, touches)
    except ArmError as error:
        return CalibrateResult(case.seed, str(error))
    fit = found.fit
    truth = {
        "marker.along": drawn.built.marker_offset[0],
        "marker.aside": drawn.built.marker_offset[1],
    }
    plant = drawn.plant(case.seed, drawn.zeros)
    for joint, zero in zip(drawn.built.joints, drawn.zeros, strict=True):
        truth[f"{joint.name}.link"] = joint.link
        truth[f"{joint.name}.zero"] = zero - _phase(joint, plant)
        truth[f"{joint.name}.backlash"] = joint.backlash
    errors, sigmas = {}, {}
    for name, true in truth.items():
        unit = _unit(name, true)
        errors[name] = unit * (fit.value(name) - true)
        sigmas[name] = unit * fit.sigma(name)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "planar.ini"
        write_measured(fit, measured(fit), date(2000, 1, 1), file)
        left = [
            zero - fit.value(f"{joint.name}.zero")
            for joint, zero in zip(drawn.built.joints, drawn.zeros, strict=True)
        ]
        after = _lines(read_arm(str(file)), drawn, case.seed, left)
        true_file = Path(folder) / "true" / "planar.ini"
        true_file.parent.mkdir()
        true_file.write_text(_true_text(drawn))
        truly = _lines(read_arm(str(true_file)), drawn, case.seed, [0.0] * len(left))
    before = _lines(drawn.described, drawn, case.seed, drawn.zeros)
    return CalibrateResult(
        case.seed, "", errors, sigmas, len(found.poses), found.seconds / 60, (before, after, truly)
    )


def _phase(joint: Joint, plant: PlantConstants) -> float:
    """Return the mean error of a joint's angle by the unknown phase of its encoder, rad.

    The brick takes a shaft's start for the middle between two encoder edges, though it is anywhere
    between them.  No calibration can find that part of the zero.
    """
    return joint.direction / joint.gear * math.radians(at_port(plant, joint.port)["phase"] - 0.25)


def _unit(name: str, true: float) -> float:
    """Return the factor from a number's own unit to that of UNITS."""
    if name.startswith("marker"):
        return 10.0
    return 100 / true if name.endswith("link") else math.degrees(1)


def _true_text(drawn: DrawnArm) -> str:
    """Return the described arm's file with the true links and backlash."""
    values = {}
    for joint in drawn.built.joints:
        values[joint.name, "link"] = f"{joint.link:.4f}"
        values[joint.name, "backlash"] = f"{math.degrees(joint.backlash):.3f}"
    return str(with_values(Path(drawn.described.file).read_text(), values))


def _lines(arm: Arm, drawn: DrawnArm, seed: int, zeros: Sequence[float]) -> tuple[float, ...]:
    """Draw the three lines; return their greatest deviations, mm, nan for a missing one.

    They are in the shoulder's frame: the arm's pose on the table is no part of them.
    """
    plant = drawn.plant(seed, [0.0, *zeros[1:]])
    with silenced(), Rig(arm, drawn.built, plant) as rig:
        done = rig.run("driver.py", "lines")
    found = line_accuracy.measure(done.record, LINES[2])
    return tuple(math.nan if one is None else one.greatest_mm for one in found)


def of_kind(name: str) -> str:
    """Return the key of UNITS that a number belongs to."""
    return "marker" if name.startswith("marker") else name.rpartition(".")[2]


HEADINGS = (
    "number", "wanted", "rms", "median", "95 %", "worst", "said (median)", "within 1", "within 2"
)  # fmt: skip
LEGEND = "errors against the truth, and of how many the stated uncertainty was true"


def table(results: Sequence[CalibrateResult]) -> list[list[str]]:
    """Return one row per number."""
    done = [one for one in results if not one.refused]
    rows = []
    for name in done[0].errors if done else ():
        unit, wanted = UNITS[of_kind(name)]
        off = np.array([one.errors[name] for one in done])
        stated = np.array([one.sigmas[name] for one in done])
        rows.append(
            [
                name,
                f"{wanted:g} {unit}",
                f"{math.sqrt((off**2).mean()):.3f}",
                *(f"{q:.3f}" for q in np.quantile(np.abs(off), [0.5, 0.95, 1.0])),
                f"{np.median(stated):.3f}",
                *(f"{100 * (np.abs(off) < k * stated).mean():.0f} %" for k in (1, 2)),
            ]
        )
    return rows


def ratios(results: Sequence[CalibrateResult]) -> tuple[float, float]:
    """Return deviations over those with the true numbers, geometric means: before and after."""
    done = np.array([one.lines for one in results if not one.refused])
    if not len(done):
        return math.nan, math.nan
    logs = np.log(done[:, :2] / done[:, 2:])
    with np.errstate(all="ignore"):
        before, after = np.exp(np.nanmean(logs, axis=(0, 2)))
    return float(before), float(after)


def summary(results: Sequence[CalibrateResult]) -> list[str]:
    """Return the lines below the table."""
    done = [one for one in results if not one.refused]
    lines = [f"{len(done)} of {len(results)} arms were calibrated"]
    lines += [f"seed {one.seed} was refused: {one.refused}" for one in results if one.refused]
    if done:
        minutes = [one.minutes for one in done]
        before, after = ratios(done)
        lines.append(
            f"on the brick {np.median(minutes):.1f} minutes, {max(minutes):.1f} at most, "
            f"{np.median([one.poses for one in done]):.0f} poses"
        )
        lines.append(
            "three lines, greatest deviation over that with the true numbers (geometric mean): "
            f"{before:.2f} before, {after:.2f} after"
        )
    return lines


def _shown(results: list[CalibrateResult], it: Any) -> Iterator[BenchTable | str]:
    title = f"Arms of the seeds {it.seeds.start} to {it.seeds.stop - 1}; {LEGEND}"
    yield BenchTable(title, HEADINGS, table(results))
    yield from summary(results)


BENCH = BenchRecord(
    "calibrating", lambda it: list(map(CalibrateCase, it.seeds)), calibrated, _shown
)
