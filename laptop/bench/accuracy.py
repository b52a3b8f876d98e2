"""The test of `accuracy` on emulated arms: by camera, beside the truth.

Cameras are calibrated by photographs of the printed board, with all errors that this leaves; they
see the arm through the lens that they truly have.  The truth is the emulator's own record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.accuracy import measurement
from laptop.accuracy.plan import PlannedWay, plan_accuracy
from laptop.accuracy.sighting import ArmOnBoard, Places, Sighting
from laptop.bench import workers
from laptop.bench.camera import draw_lens
from laptop.bench.camera_renders import Lens, Stand, photograph
from laptop.calibration.camera_fit import calibrate
from laptop.calibration.camera_model import CameraModel
from laptop.measuring.emulated_rig import EmulatedRig
from laptop.measuring.measured_run import SETTLED, MeasuredRun
from laptop.vision.finders.board import find_board
from robot.motion import kinematics
from shared.arm_description import Arm, find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
CYCLES = 30
NOISE = 0.1
"""Of a marker in one picture, px: three times what the tracker's is."""
SHARE = 0.1
"""A criterion is told well if it is off by no more of its true value."""
DISTANCE = {2: 48.0, 3: 62.0}
"""Of the cameras from the test's cube, by the arm's coordinates, cm."""
TILTS = {2: ((20.0, 180.0),), 3: ((30.0, 200.0), (50.0, 80.0))}
"""Of the cameras, and whence they look, degrees."""
SHOWN = ((0.0, 0.0), (35.0, 60.0))
"""The board is photographed lying, after it was held like this: tilt and turn, degrees."""


@dataclass(frozen=True)
class AccuracyCase:
    """An arm, the cycles of its test, the noise of its cameras (px), and a seed of all chance."""

    arm: str
    cycles: int = CYCLES
    noise: float = NOISE
    seed: int = 1000


@dataclass(frozen=True)
class AccuracyFigure:
    """A criterion by camera beside the truth, mm; u is its standard uncertainty as it is told."""

    arm: str
    name: str
    camera: float
    u: float
    truth: float

    @property
    def off(self) -> float:
        """How far the camera is off, as a share of the truth."""
        return self.camera / self.truth - 1 if self.truth else math.inf


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


def calibrated(
    arm: Arm, middle: np.ndarray, seed: int
) -> tuple[dict[str, LensCamera], dict[str, CameraModel], ArmOnBoard]:
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
        stand = Stand.looking(
            DISTANCE[d] * lens.focal / 600.0,
            math.radians(tilt),
            turn + math.radians(azimuth + luck.uniform(-8, 8)),
            0.0,
            (0.0, 0.0),
        )
        views = []
        for more, aside in SHOWN[::-1]:
            held = Stand.looking(
                DISTANCE[d] * lens.focal / 600.0,
                math.radians(tilt + more),
                turn + math.radians(azimuth + aside),
                0.2,
                (0.0, 0.0),
            )
            shown = stand if not more else held
            view = find_board(photograph(lens, shown, seed=[seed, 52, number, len(views)]))
            assert view is not None, "the camera sees the board by its place"
            views.append(view)
        name = "AB"[number]
        cameras[name] = LensCamera(lens, stand, on_board)
        models[name] = calibrate(views, 100.0).camera
    return cameras, models, on_board


def true_places(
    record: Sequence[Any], ways: Sequence[PlannedWay], run: MeasuredRun
) -> Iterator[tuple[PlannedWay, Places]]:
    """Yield each way with where the tip truly was: at its end at rest, or all along a path.

    Args:
        record: MotionSamples of the run.
        ways: of its job.
        run: whose rows tell when.
    """
    t = np.array([row.t for row in record])
    tips = np.array([(row.x, row.y) if row.z is None else (row.x, row.y, row.z) for row in record])
    rests = {row.stroke: row.t for row in run.rows if row.rest}
    begins: dict[int, float] = {}
    for row in run.rows:
        begins.setdefault(row.stroke, row.t)
    for number, way in enumerate(ways, 1):
        end = rests[number]
        if way.what == "path":
            along = tips[(t >= begins[number]) & (t <= end - run.rest)]
        else:
            along = tips[(t > end - SETTLED * run.rest) & (t <= end)].mean(axis=0)[None]
        n, d = along.shape
        yield way, Places(along, np.zeros((n, d, d)), np.zeros((n, d, 0)))


def run_case(case: AccuracyCase) -> list[AccuracyFigure]:
    """Do one case: all criteria, by camera and in truth.

    Raises:
        ArmError: the arm has no room for the test, or it failed.
    """
    arm = read_arm(find_arm(case.arm))
    plan = plan_accuracy(arm, case.cycles)
    cameras, models, on_board = calibrated(arm, plan.centre, case.seed)
    rig = EmulatedRig(arm, None, "cpu=1", cameras, 0.0, case.noise, seed=case.seed)
    truth: list[tuple[PlannedWay, Places]] = []

    def keep(ways: list[PlannedWay], run: MeasuredRun) -> None:
        truth.extend(true_places(rig.last.record, ways, run))

    result = measurement.measure(rig, plan, Sighting(arm, models), on_board, after=keep)
    true = measurement.plain(plan, measurement.collect(plan, truth))
    return [
        AccuracyFigure(arm.name, one.name, one.mm, one.u_mm, true[one.name])
        for one in result.criteria
    ]


def run(
    todo: Sequence[AccuracyCase], executor: Executor | None = None
) -> Iterator[list[AccuracyFigure]]:
    """Yield the results of the cases, in their order."""
    return workers.map_cases(run_case, todo, executor=executor)


HEADINGS = ("arm", "criterion", "camera mm", "u mm", "truth mm", "off by")
LEGEND = "by camera beside the truth; u: standard uncertainty by the camera, as it tells"


def table(figures: Sequence[AccuracyFigure]) -> list[list[str]]:
    """One row per arm and criterion."""
    return [
        [
            one.arm,
            one.name,
            f"{one.camera:.3f}",
            f"{one.u:.3f}",
            f"{one.truth:.3f}",
            f"{100 * one.off:+.1f} %",
        ]
        for one in figures
    ]


def verdict(figures: Sequence[AccuracyFigure]) -> str:
    """Say in a line how many are told well, and whether what is told of them is true."""
    near = sum(abs(one.off) <= SHARE for one in figures)
    within = sum(abs(one.camera - one.truth) <= 2 * one.u for one in figures)
    return (
        f"{near} of {len(figures)} within {100 * SHARE:.0f} % of the truth; "
        f"{within} within two standard uncertainties"
    )


