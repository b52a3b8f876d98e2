"""The board's pose and its millimetres, from photographs through lenses nobody tuned on.

Every picture is rendered by `camera_renders`, so the truth is known: which place of the table each
pixel shows, on the paper and above it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from laptop.emulator.scene.board_photographs import (
    WEBCAM,
    CameraPose,
    Lens,
    PrintedSheet,
    draw_lens,
    photograph,
)
from laptop.emulator.scene.sensor import Development
from laptop.see.markers.board import BOARDS
from laptop.see.markers.finders.board import BoardView, find_board
from laptop.see.table.camera_fit import BadCalibration, Calibration, calibrate
from laptop.see.table.camera_report import describe, shift_since

HEIGHTS = (0.0, 3.0)
"""Over the table, cm: of the paper, and of a disc."""
POINTS = 300
"""Places on the free middle of the board by which it is judged."""
STRETCH, BEND = 0.002, 0.02
"""Standard deviations of a sheet as paper is: by what share it is printed longer up the page, and
how far it is bent off the table 10 cm from its middle, cm."""
SHOWN = 0.72
"""Share of the picture's width that the board is long."""


@dataclass(frozen=True)
class Condition:
    """What is photographed.

    tilts    of the views, degrees from straight down
    sheet, development  of `photograph`, for the last view
    bar      length that is given, mm
    shown    share of the picture that the board fills
    paper    the sheet is not perfect: by what its print is longer and it is bent, each view draws
    """

    name: str
    tilts: tuple[float, ...] = (30.0,)
    sheet: PrintedSheet = PrintedSheet()
    development: Development = WEBCAM
    bar: float | None = None
    shown: float = SHOWN
    paper: bool = False


CONDITIONS = (
    Condition("straight down, one picture", (3.0,)),
    Condition("straight down to the degree, paper as it is", (0.0,), paper=True),
    Condition("straight down, paper as it is", (3.0,), paper=True),
    Condition("tilted by 10 degrees, paper as it is", (10.0,), paper=True),
    Condition("tilted by 20 degrees, paper as it is", (20.0,), paper=True),
    Condition("tilted by 40 degrees, paper as it is", (40.0,), paper=True),
    Condition("three pictures from straight above, paper as it is", (2.0, 1.0, 0.0), paper=True),
    Condition("three pictures, two tilted, paper as it is", (35.0, 30.0, 3.0), paper=True),
    Condition("tilted by 30 degrees, one picture"),
    Condition("tilted by 55 degrees, one picture", (55.0,)),
    Condition("three pictures, the last one straight down", (35.0, 30.0, 3.0)),
    Condition("half covered", sheet=PrintedSheet(free=(-20, -20, 0, 20))),
    Condition("all but a strip covered", sheet=PrintedSheet(free=(-20, -20, -6.5, 20))),
    Condition("small: half as large in the picture", shown=SHOWN / 2),
    Condition("blurred by 1.8 px", development=Development(1.8, jpeg=90)),
    Condition("noise 8, JPEG 60", development=Development(noise=8.0, jpeg=60)),
    Condition("letter paper", sheet=PrintedSheet("letter")),
    Condition("printed at 97 %, bar measured", sheet=PrintedSheet(scale=0.97), bar=97.0),
    Condition("printed at 97 %, nothing measured", sheet=PrintedSheet(scale=0.97)),
    Condition("blurred by 4 px", development=Development(4.0, jpeg=90)),
    Condition("covered but for one corner", sheet=PrintedSheet(free=(-20, 7.0, -6.5, 20))),
    Condition("from the side, 80 degrees", (80.0,)),
)


def draw_stand(lens: Lens, tilt: float, shown: float, luck: np.random.Generator) -> CameraPose:
    """Draw where a camera stands, tilted by so many degrees."""
    distance = lens.focal * BOARDS["a4"].height / (shown * lens.size[0])
    return CameraPose.looking(
        distance,
        math.radians(tilt),
        luck.uniform(0, 2 * math.pi),
        math.pi / 2 * luck.integers(4) + luck.uniform(-0.3, 0.3),
        tuple(luck.uniform(-1, 1, 2)),
    )


@dataclass(frozen=True)
class CameraResult:
    """One calibration beside the truth.

    condition, seed  which
    refused   why there is none, or ""
    markers   seen in the last picture
    rms       what the model misses the board by, px
    mm        errors of places on the table and above it: median and 95th percentile, mm
    sigma     what it says of these at the worst place, mm
    in_sigmas errors of these places, RMS, each in what is said of it
    position  error of the camera's place, mm
    focal     error of the focal length, a share of it
    focal_sigma  what it says of that
    said      what people are told
    """

    condition: str
    seed: int
    refused: str = ""
    markers: int = 0
    rms: float = math.nan
    mm: tuple[tuple[float, float], ...] = ()
    sigma: tuple[float, ...] = ()
    in_sigmas: tuple[float, ...] = ()
    position: float = math.nan
    focal: float = math.nan
    focal_sigma: float = math.nan
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class CameraCase:
    """A condition with the lens of a seed."""

    condition: Condition
    seed: int

    def run(self) -> CameraResult:
        """Photograph, calibrate, and compare."""
        lens, name = draw_lens(self.seed), self.condition.name
        views, stand = self.views(lens)
        markers = len(views[-1].numbers) if views[-1] else 0
        try:
            found = calibrate([view for view in views if view], self.condition.bar)
        except BadCalibration as problem:
            return CameraResult(name, self.seed, str(problem), markers)
        camera = found.camera
        judged = [errors_mm(found, lens, stand, height) for height in HEIGHTS]
        position = -stand.rotation.T @ stand.translation
        return CameraResult(
            name,
            self.seed,
            "",
            markers,
            found.rms,
            tuple((float(np.median(e)), float(np.quantile(e, 0.95))) for e, _ in judged),
            tuple(10 * found.point_sigma(height) for height in HEIGHTS),
            tuple(float(np.sqrt(((e / sigma) ** 2).mean())) for e, sigma in judged),
            10 * float(np.linalg.norm(camera.position - position)),
            float(camera.lens[0] / lens.focal - 1),
            found.focal_sigma,
            tuple(describe(found)),
        )

    def views(self, lens: Lens) -> tuple[list[BoardView | None], CameraPose]:
        """Photograph all views, and return where the last one was taken from."""
        views = []
        stretch = STRETCH * np.random.default_rng([self.seed, 28]).standard_normal()
        for k, tilt in enumerate(self.condition.tilts):
            luck = np.random.default_rng([self.seed, k, 22])
            stand = draw_stand(lens, tilt, self.condition.shown, luck)
            last = k == len(self.condition.tilts) - 1
            sheet = self.condition.sheet if last else PrintedSheet()
            development = self.condition.development if last else WEBCAM
            if self.condition.paper:
                bend = BEND * np.random.default_rng([self.seed, k, 29]).standard_normal()
                sheet = replace(sheet, stretch=stretch, bend=bend)
            seed = [self.seed, k, 23]
            views.append(find_board(photograph(lens, stand, sheet, development, seed)))
        return views, stand


def errors_mm(
    found: Calibration, lens: Lens, stand: CameraPose, height: float
) -> tuple[np.ndarray, np.ndarray]:
    """Distances between where pixels are said to be and where they are, and their sigmas, mm."""
    width, high = BOARDS["a4"].middle
    spread = np.random.default_rng(24).uniform(-0.5, 0.5, (POINTS, 2)) * (width, high)
    points = np.column_stack([spread, np.full(POINTS, height)])
    placed = found.camera.placed(stand.pixels(lens, points), height)
    off = np.linalg.norm(placed.xy - points[:, :2], axis=1)
    return 10 * off, 10 * np.sqrt(np.trace(placed.covariance, axis1=1, axis2=2))


MOVES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "nothing": lambda x: x,
    "the camera, by 0.1 mm": lambda x: x + (0.01, 0, 0),
    "the camera, by 1 mm": lambda x: x + (0.1, 0, 0),
    "the camera, by 10 mm": lambda x: x + (1.0, 0, 0),
}


def moves(seed: int) -> list[tuple[str, bool, str]]:
    """What is said after a camera was moved: by what, whether it is noticed, the words."""
    lens = draw_lens(seed)
    stand = draw_stand(lens, 30.0, SHOWN, np.random.default_rng([seed, 25]))
    before = find_board(photograph(lens, stand, seed=[seed, 26]))
    assert before is not None
    found = calibrate([before])
    told = []
    for k, (name, move) in enumerate(MOVES.items()):
        after = find_board(
            photograph(
                lens, CameraPose(stand.rotation, move(stand.translation)), seed=[seed, k, 27]
            )
        )
        assert after is not None
        shift = shift_since(found, after)
        told.append((name, shift.moved, str(shift)))
    return told


def cases(seeds: range) -> list[CameraCase]:
    """All conditions, each with the lens of every seed."""
    return [CameraCase(condition, seed) for condition in CONDITIONS for seed in seeds]
