"""The test of `accuracy` on emulated arms: by camera, beside the truth."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable, flat
from laptop.measure.accuracy.emulated import PIXEL_NOISE, measure_emulated
from laptop.measure.accuracy.plan import plan_accuracy
from shared.arm_description import ArmError, find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
CYCLES = 30
"""Default number of cycles of a test."""
MAX_RELATIVE_ERROR = 0.1
"""Greatest error of a well measured criterion, as a share of its true value."""


@dataclass(frozen=True)
class AccuracyCase:
    """An arm, the cycles of its test, the noise of its cameras (px), and a seed.

    The seed draws the plant (its frictions, its voltage), the cameras, their places, their noise.
    """

    arm: str
    cycles: int = CYCLES
    noise: float = PIXEL_NOISE
    seed: int = 1000


@dataclass(frozen=True)
class AccuracyFigure:
    """A criterion by camera beside the truth, mm; u is its stated standard uncertainty."""

    arm: str
    seed: int
    name: str
    camera: float
    u: float
    truth: float

    @property
    def off(self) -> float:
        """Error of the camera, as a share of the truth."""
        return self.camera / self.truth - 1 if self.truth else math.inf

    @property
    def is_within(self) -> bool:
        """Whether the truth lies within the expanded uncertainty (k = 2)."""
        return abs(self.camera - self.truth) <= 2 * self.u


@dataclass(frozen=True)
class AccuracyRun:
    """All criteria of a case; or none, and why the arm did not end the test."""

    case: AccuracyCase
    figures: list[AccuracyFigure]
    why: str = ""


def run_case(case: AccuracyCase) -> AccuracyRun:
    """Run one case: all criteria, by camera and in truth.

    Raises:
        ArmError: the arm has no room for the test.
    """
    plan = plan_accuracy(read_arm(find_arm(case.arm)), case.cycles)
    plant = f"cpu=1,seed={case.seed}"
    try:
        result, true = measure_emulated(plan, None, plant, case.noise, case.seed)
    except ArmError as error:
        return AccuracyRun(case, [], str(error))
    return AccuracyRun(
        case,
        [
            AccuracyFigure(plan.arm.name, case.seed, one.name, one.mm, one.u_mm, true[one.name])
            for one in result.criteria
        ],
    )


HEADINGS = ("arm", "seed", "criterion", "camera mm", "U mm", "truth mm", "off by", "within U")
LEGEND = "by camera beside the truth; U: expanded uncertainty by the camera (k = 2), as it tells"


def table(figures: Sequence[AccuracyFigure]) -> list[list[str]]:
    """Return one row per arm and criterion."""
    return [
        [
            one.arm,
            str(one.seed),
            one.name,
            f"{one.camera:.3f}",
            f"{2 * one.u:.3f}",
            f"{one.truth:.3f}",
            f"{100 * one.off:+.1f} %",
            "yes" if one.is_within else "no",
        ]
        for one in figures
    ]


def verdict(result: AccuracyRun) -> str:
    """Return a line: how many are measured well, and how often U holds the truth."""
    figures = result.figures
    if result.why:
        return f"the test was not ended: {result.why}"
    near = sum(abs(one.off) <= MAX_RELATIVE_ERROR for one in figures)
    within = sum(one.is_within for one in figures)
    either = sum(one.is_within or abs(one.off) <= MAX_RELATIVE_ERROR for one in figures)
    return (
        f"{near} of {len(figures)} within {100 * MAX_RELATIVE_ERROR:.0f} % of the truth; "
        f"of {within} the truth lies within U, of {either} one of both"
    )


def _cases(it: Any) -> list[AccuracyCase]:
    for arm in it.arms:
        read_arm(find_arm(arm))
    return [
        AccuracyCase(arm, it.cycles, it.noise, seed) for arm in it.arms or ARMS for seed in it.seeds
    ]


def _shown(results: list[AccuracyRun], it: Any) -> Iterator[BenchTable | str]:
    title = f"Accuracy and repeatability; {LEGEND}"
    yield BenchTable(title, HEADINGS, table(_figures(results)), 2)
    yield from (f"{one.case.arm}, seed {one.case.seed}: {verdict(one)}" for one in results)


def _figures(results: Sequence[AccuracyRun]) -> list[AccuracyFigure]:
    return flat(one.figures for one in results)


BENCH = BenchRecord(
    "measuring",
    _cases,
    run_case,
    _shown,
    figures=lambda results: [{**asdict(one), "off": one.off} for one in _figures(results)],
    holds=lambda results: not any(one.why for one in results),
)
