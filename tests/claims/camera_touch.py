"""The pen's place from the marker's pixel, after crosses were touched: by how many, how well.

Board, lens and camera are as in `camera`; the marker sits a random few mm beside the pen, at a
random height; the pen is set on each cross to 0.3 mm, and the joints know it to half of that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from laptop.emulator.scene.board_photographs import CameraPose, Lens, draw_lens, photograph
from laptop.see.markers.board import CROSSES
from laptop.see.markers.finders.board import find_board
from laptop.see.table.camera_fit import calibrate
from laptop.see.table.marker_offset import Touch, fit_marker
from laptop.see.table.plane_motion import rotation
from robot.motion import kinematics
from shared.arm_description import Arm, find_arm, read_arm
from tests.claims.camera import SHOWN, draw_stand

COUNTS = {"6": (0, 2, 3, 5, 6, 8), "9": tuple(range(9))}
"""Which crosses are touched."""
PLACED, JOINTS, PIXEL = 0.03, 0.015, 0.03
"""Errors, standard deviations: of the pen on a cross, cm; of the joints, cm; of the marker, px."""
TRIALS, PLACES = 10, 60
"""Arms a lens, and places at which each is judged."""


@dataclass(frozen=True)
class TouchResult:
    """The pen's place by its marker, after so many touches.

    touches  number of crosses, or "none: the paper alone"
    median, p95  distance of the pen from where it is said to be, mm
    offset, height  median errors of what was found, mm
    sigma    what the fit says of the offset, median, mm
    """

    touches: str
    median: float
    p95: float
    offset: float
    height: float
    sigma: float


@dataclass(frozen=True, eq=False)
class TouchRig:
    """An arm beside a board, before a camera.

    turn, base      of the arm on the board, rad and (2,), cm
    offset, height  of the marker, in the last link's frame and over the paper, cm
    """

    arm: Arm
    lens: Lens
    stand: CameraPose
    turn: float
    base: np.ndarray
    offset: np.ndarray
    height: float

    def pose(self, pen: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
        """Tip and heading in the arm's frame with the pen there, and the marker's true pixel."""
        tip = rotation(self.turn).T @ (pen - self.base)
        heading = float(sum(kinematics.inverse(self.arm, tuple(tip))))
        marker = pen + rotation(self.turn + heading) @ self.offset
        place = np.array([[*marker, self.height]])
        return tip, heading, self.stand.pixels(self.lens, place)[0]


def measure(seeds: range) -> list[TouchResult]:
    """Touch crosses with random arms, and look where the pen is said to be elsewhere."""
    arm = read_arm(find_arm("planar"))
    errors: dict[str, list[float]] = {name: [] for name in (*COUNTS, "")}
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in COUNTS}
    for seed in seeds:
        lens = draw_lens(seed)
        luck = np.random.default_rng([seed, 31])
        stand = draw_stand(lens, 25.0, SHOWN, luck)
        view = find_board(photograph(lens, stand, seed=[seed, 32]))
        assert view is not None
        camera = calibrate([view]).camera
        for _ in range(TRIALS):
            offset, height = luck.uniform(-0.5, 0.5, 2), luck.uniform(1.5, 3.5)
            # The arm stands to the left of the board.
            turn, base = luck.uniform(-0.15, 0.15), np.array([-12.0, 0]) + luck.uniform(-1, 1, 2)
            rig = TouchRig(arm, lens, stand, turn, base, offset, height)
            touches = []
            for cross in CROSSES:
                tip, heading, pixel = rig.pose(cross + PLACED * luck.standard_normal(2))
                tip = tip + JOINTS * luck.standard_normal(2)
                pixel = pixel + PIXEL * luck.standard_normal(2)
                touches.append(Touch(tuple(cross), (tip[0], tip[1]), heading, (pixel[0], pixel[1])))
            places = luck.uniform((-5, -7), (5, 7), (PLACES, 2))
            poses = [rig.pose(pen) for pen in places]
            headings = np.array([heading for _, heading, _ in poses])
            pixels = np.array([pixel for _, _, pixel in poses])
            errors[""] += list(10 * np.linalg.norm(camera.to_table(pixels) - places, axis=1))
            for name, chosen in COUNTS.items():
                fit = fit_marker(camera, [touches[k] for k in chosen])
                said = fit.pen(camera, pixels, headings)
                errors[name] += list(10 * np.linalg.norm(said - places, axis=1))
                off = 10 * float(np.linalg.norm(fit.offset - offset))
                found[name].append((off, 10 * abs(fit.height - height), 10 * fit.offset_sigma))
    results = []
    for name, distances in errors.items():
        medians = np.median(found[name], axis=0) if name else np.full(3, math.nan)
        results.append(
            TouchResult(
                name or "none: the paper alone",
                float(np.median(distances)),
                float(np.quantile(distances, 0.95)),
                *map(float, medians),
            )
        )
    return results


HEADINGS = ("crosses touched", "pen, median", "p95", "offset off by", "height off by", "it says")


def table(results: list[TouchResult]) -> list[list[str]]:
    """Rows under HEADINGS, mm."""
    return [
        [
            r.touches,
            *(
                "-" if math.isnan(x) else f"{x:.2f}"
                for x in (r.median, r.p95, r.offset, r.height, r.sigma)
            ),
        ]
        for r in results
    ]
