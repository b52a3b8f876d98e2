"""The test of `accuracy` on emulated arms: by camera, beside the truth.

Cameras are calibrated by photographs of the printed board, with all errors that this leaves; they
see the arm through the lens that they truly have.  The truth is the emulator's own record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from laptop.bench.bench import BenchRecord, BenchTable, flat
from laptop.bench.camera_renders import Lens, Stand, draw_lens, photograph
from laptop.measure.accuracy import measurement
from laptop.measure.accuracy.measurement import AccuracyResult
from laptop.measure.accuracy.plan import AccuracyPlan, PlannedWay, plan_accuracy
from laptop.measure.accuracy.sighting import ArmOnBoard, ArmSighting, BadSighting, Places
from laptop.measure.accuracy.truth import in_nearest_frame, true_places
from laptop.measure.emulated_rig import EmulatedRig
from laptop.measure.measured_run import MeasuredRun
from laptop.see.markers.finders.board import find_board
from laptop.see.table.camera_fit import calibrate
from robot.motion import kinematics
from shared.arm_description import Arm, find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
CYCLES = 30
NOISE = 0.03
"""Of a marker in one picture, px, as the tracker has it in rendered pictures."""
FPS = 30.0
"""Pictures a second, as webcams give them."""
SHARE = 0.1
"""A criterion is told well if it is off by no more of its true value."""
DISTANCE = {2: 48.0, 3: 62.0}
"""Of the cameras from the test's cube, by the arm's coordinates, cm."""
TILTS = {2: ((20.0, 180.0),), 3: ((30.0, 200.0), (50.0, 80.0))}
"""Of the cameras, and whence they look, degrees."""
MARKER_HEIGHT = {2: 2.5, 3: 0.0}
"""Of the marker over the tip, cm."""
FOCAL = 600.0
"""Of a camera that stands at just that distance, px; longer ones stand farther off."""
HELD = tuple((tilt, turn) for tilt in (35.0, 20.0) for turn in (60.0, 180.0, 300.0)) + ((0.0, 0.0),)
"""How the board is held for each photograph, tilt and turn, degrees; at last it lies."""
STEEP = 55.0
"""A board that would be seen tilted by more is held towards the camera, degrees."""
SHOWN = 0.5
"""Share of the board's markers below which a photograph is not used."""
BAR = 100.0
"""Of the board, measured, mm."""


@dataclass(frozen=True)
class AccuracyCase:
    """An arm, the cycles of its test, the noise of its cameras (px), and a seed.

    The seed draws the plant (its frictions, its voltage), the cameras, their places, their noise.
    """

    arm: str
    cycles: int = CYCLES
    noise: float = NOISE
    seed: int = 1000


@dataclass(frozen=True)
class AccuracyFigure:
    """A criterion by camera beside the truth, mm; u is its standard uncertainty as it is told."""

    arm: str
    seed: int
    name: str
    camera: float
    u: float
    truth: float

    @property
    def off(self) -> float:
        """How far the camera is off, as a share of the truth."""
        return self.camera / self.truth - 1 if self.truth else math.inf

    @property
    def is_within(self) -> bool:
        """Whether the truth lies within the expanded uncertainty (k = 2)."""
        return abs(self.camera - self.truth) <= 2 * self.u


class LensCamera:
    """A camera as it truly is; points are in the arm's frame.

    Args:
        lens, stand: over the board.
        on_board: how the arm stands there.
    """

    def __init__(self, lens: Lens, stand: Stand, on_board: ArmOnBoard) -> None:
        self._lens, self._stand, self._on_board = lens, stand, on_board

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3), cm."""
        c, s = math.cos(self._on_board.turn), math.sin(self._on_board.turn)
        on_board = points.copy()
        on_board[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]]) + self._on_board.base
        return self._stand.pixels(self._lens, on_board)


def look_at_cube(
    arm: Arm, middle: np.ndarray, seed: int
) -> tuple[dict[str, LensCamera], ArmSighting, ArmOnBoard]:
    """Draw cameras that look at the test's cube, and calibrate them by the board that lies there.

    Returns:
        The cameras as they are, what is known of them, and how the arm stands on the board.
    """
    luck = np.random.default_rng([seed, 51])
    turn = math.pi / 2 * luck.integers(4) + math.radians(luck.uniform(-2, 2))
    c, s = math.cos(turn), math.sin(turn)
    # The board's origin lies below the cube's middle.
    base = -np.array([[c, -s], [s, c]]) @ middle[:2]
    on_board = ArmOnBoard(turn, (float(base[0]), float(base[1])))
    d = kinematics.coordinates(arm)
    cameras, models = {}, {}
    for number, (tilt, azimuth) in enumerate(TILTS[d]):
        lens = draw_lens(seed + number)
        azimuth += luck.uniform(-8, 8)
        stands = [
            Stand.looking(
                DISTANCE[d] * lens.focal / FOCAL,
                math.radians(tilt + (more if tilt + more <= STEEP else -more)),
                turn + math.radians(azimuth + aside),
                0.0,
                (0.0, 0.0),
            )
            for more, aside in HELD
        ]
        views = []
        for k, stand in enumerate(stands):
            view = find_board(photograph(lens, stand, seed=[seed, 52, number, k]))
            if view and len(view.numbers) >= SHOWN * len(view.board.numbers):
                views.append(view)
            elif k == len(stands) - 1:
                raise BadSighting(f"seed {seed}: the camera does not see the board; take another")
        cameras["AB"[number]] = LensCamera(lens, stands[-1], on_board)
        models["AB"[number]] = calibrate(views, BAR).camera
    return cameras, ArmSighting(arm, models, MARKER_HEIGHT[d]), on_board


def measure_emulated(
    plan: AccuracyPlan,
    built: Arm | None = None,
    plant: str = "",
    noise: float = NOISE,
    seed: int = 1000,
    fit: bool = False,
    tell: Callable[[str, int, int], None] = lambda part, number, count: None,
) -> tuple[AccuracyResult, dict[str, float]]:
    """Do the test by an emulated arm before emulated cameras.

    Args:
        plan: of the test.
        built: the arm as it is; None: as described.
        plant: text of the plant's constants.
        noise: of the marker in one picture, px.
        seed: of all chance.
        fit: how the arm stands on the board is not known.
        tell: as for `measurement.measure`.

    Returns:
        What the cameras tell, and the true criteria by name, mm; of a stand that was fitted the
        true ones are, too, in the frame that is nearest to the poses.
    """
    arm = plan.arm
    cameras, sighting, on_board = look_at_cube(arm, plan.centre, seed)
    rig = EmulatedRig(arm, built, plant, cameras, sighting.height, noise, FPS, seed)
    truth: list[tuple[PlannedWay, Places]] = []

    def keep(ways: list[PlannedWay], run: MeasuredRun) -> None:
        truth.extend(true_places(rig.last.record, ways, run))

    stand = None if fit else on_board
    result = measurement.measure(rig, plan, sighting, stand, tell, keep)
    if fit:
        truth = in_nearest_frame(truth)
    return result, measurement.plain(plan, measurement.collect(plan, truth))


def run_case(case: AccuracyCase) -> list[AccuracyFigure]:
    """Do one case: all criteria, by camera and in truth.

    Raises:
        ArmError: the arm has no room for the test, or it failed.
    """
    plan = plan_accuracy(read_arm(find_arm(case.arm)), case.cycles)
    result, true = measure_emulated(plan, None, f"cpu=1,seed={case.seed}", case.noise, case.seed)
    return [
        AccuracyFigure(plan.arm.name, case.seed, one.name, one.mm, one.u_mm, true[one.name])
        for one in result.criteria
    ]


HEADINGS = ("arm", "seed", "criterion", "camera mm", "U mm", "truth mm", "off by", "within U")
LEGEND = "by camera beside the truth; U: expanded uncertainty by the camera (k = 2), as it tells"


def table(figures: Sequence[AccuracyFigure]) -> list[list[str]]:
    """One row per arm and criterion."""
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


def verdict(figures: Sequence[AccuracyFigure]) -> str:
    """Say in a line how many are told well, and whether what is told of them is true."""
    near = sum(abs(one.off) <= SHARE for one in figures)
    within = sum(one.is_within for one in figures)
    either = sum(one.is_within or abs(one.off) <= SHARE for one in figures)
    return (
        f"{near} of {len(figures)} within {100 * SHARE:.0f} % of the truth; "
        f"of {within} the truth lies within U, of {either} one of both"
    )


def _cases(it: Any) -> list[AccuracyCase]:
    for arm in it.arms:
        read_arm(find_arm(arm))
    return [
        AccuracyCase(arm, it.cycles, it.noise, seed) for arm in it.arms or ARMS for seed in it.seeds
    ]


def _shown(results: list[list[AccuracyFigure]], it: Any) -> Iterator[BenchTable | str]:
    title = f"Accuracy and repeatability; {LEGEND}"
    yield BenchTable(title, HEADINGS, table(flat(results)), 2)
    yield from (f"{one[0].arm}, seed {one[0].seed}: {verdict(one)}" for one in results)


BENCH = BenchRecord(
    "measuring",
    _cases,
    run_case,
    _shown,
    figures=lambda results: [{**asdict(one), "off": one.off} for one in flat(results)],
)
