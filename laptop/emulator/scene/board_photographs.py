"""Photographs of the printed board through lenses that bend it.

The page that is printed is the texture; every pixel is many rays, each undone by OpenCV's own
undistortion and met with the plane.  None of it goes through the calibration's code.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from laptop.emulator.scene.optics import to_linear
from laptop.emulator.scene.sensor import Development
from laptop.see.markers.board import BOARDS
from laptop.see.markers.board_sheet import write_board

RAYS = 4
"""Rays a pixel and axis."""
PER_CM = 100.0
"""Points of the page's texture a centimetre."""
DEGREE, FIXED_POINT_STEPS = 20, 100
"""Of the polynomials between rays, and to find those between them."""
BEND_STEPS = 4
"""To meet a bent sheet with each ray."""
TABLE = np.array((0.18, 0.24, 0.33), np.float32)
CLOTH = np.array((0.3, 0.1, 0.1), np.float32)
"""Light of table and cloth, B, G, R."""


@dataclass(frozen=True)
class Lens:
    """A lens and its sensor, as OpenCV counts them.

    focal       px, both axes
    centre      principal point, px
    distortion  k1, k2, p1, p2, k3
    size        (width, height), px
    """

    focal: float
    centre: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    size: tuple[int, int] = (640, 480)

    @property
    def matrix(self) -> np.ndarray:
        """The camera's matrix, (3, 3)."""
        return np.array(
            [[self.focal, 0, self.centre[0]], [0, self.focal, self.centre[1]], [0, 0, 1]]
        )


@dataclass(frozen=True)
class Stand:
    """Where a camera stands over a board.

    rotation     (3, 3), board to camera
    translation  (3,), cm
    """

    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def looking(
        cls, distance: float, tilt: float, azimuth: float, roll: float, at: tuple[float, float]
    ) -> Stand:
        """A camera that looks at a place of the board, cm, from a distance, cm; angles in rad."""
        away = np.array(
            [
                math.sin(tilt) * math.cos(azimuth),
                math.sin(tilt) * math.sin(azimuth),
                math.cos(tilt),
            ]
        )
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        down = np.cross(-away, right)
        c, s = math.cos(roll), math.sin(roll)
        rotation = np.array([c * right + s * down, c * down - s * right, -away])
        position = np.array([*at, 0.0]) + distance * away
        return cls(rotation, -rotation @ position)

    def pixels(self, lens: Lens, points: np.ndarray) -> np.ndarray:
        """Where points (n, 3), cm, truly are in the picture: (n, 2), px."""
        x = points @ self.rotation.T + self.translation
        a, b = (x[:, :2] / x[:, 2:]).T
        k1, k2, p1, p2, k3 = lens.distortion
        r2 = a * a + b * b
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
        v = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
        return lens.focal * np.column_stack([u, v]) + lens.centre


def draw_lens(seed: int) -> Lens:
    """Draw a webcam's lens: 43 to 78 degrees wide, off its middle, bent in all of OpenCV's ways."""
    luck = np.random.default_rng([seed, 21])
    width, height = 640, 480
    focal = width / 2 / math.tan(math.radians(luck.uniform(43, 78)) / 2)
    centre = (width - 1) / 2 + luck.uniform(-16, 16), (height - 1) / 2 + luck.uniform(-16, 16)
    k1 = luck.uniform(-0.35, 0.12)
    distortion = (
        k1,
        luck.uniform(0.0, 0.12) - 0.3 * min(k1, 0.0),
        *luck.uniform(-0.0015, 0.0015, 2),
        luck.uniform(-0.03, 0.03),
    )
    return Lens(focal, centre, distortion)


@lru_cache(maxsize=2)
def page(paper: str) -> np.ndarray:
    """The printed page, light (height, width), PER_CM points a centimetre."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "board.png"
        write_board(file, paper)
        drawn = np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE))
    board = BOARDS[paper]
    size = round(board.width * PER_CM), round(board.height * PER_CM)
    small = cv2.resize(drawn, size, interpolation=cv2.INTER_AREA)
    return np.asarray(0.03 + 0.8 * to_linear(small), np.float32)


@lru_cache(maxsize=8)
def _rays(lens: Lens) -> np.ndarray:
    """Directions (rows, columns, 2), x and y at z = 1, of all rays of all pixels."""
    at = [(np.arange(n * RAYS) + 0.5) / RAYS - 0.5 for n in lens.size]
    # A lens is smooth: polynomials through a few of its rays give all others to the last digit.
    nodes = np.polynomial.chebyshev.chebpts1(DEGREE + 1)
    few = [(n * (nodes + 1) - 1) / 2 for n in lens.size]
    grid = np.stack(np.meshgrid(*few), axis=-1).reshape(-1, 2)
    distortion = np.array(lens.distortion)
    rays = cv2.undistortPoints(grid[:, None], lens.matrix, distortion)[:, 0]
    for _ in range(FIXED_POINT_STEPS):
        spatial = np.column_stack([rays, np.ones(len(rays))])
        again, _ = cv2.projectPoints(spatial, np.zeros(3), np.zeros(3), lens.matrix, distortion)
        rays = rays + (grid - again[:, 0]) / lens.focal
    rays = rays.reshape(DEGREE + 1, DEGREE + 1, 2)
    through = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, DEGREE))
    across, down = (
        np.polynomial.chebyshev.chebvander((2 * axis + 1) / n - 1, DEGREE) @ through
        for axis, n in zip(at, lens.size, strict=True)
    )
    return np.stack([down @ rays[..., k] @ across.T for k in (0, 1)], axis=-1).astype(np.float32)


@dataclass(frozen=True)
class PrintedSheet:
    """A sheet with the board, as it lies on the table.

    paper    of the board
    scale    of the print: 0.97 for one whose bar is 97 mm long
    stretch  by what share the print is longer up the page
    bend     how far the sheet is off the table 10 cm to the left and right of its middle, cm
    free     all but x0, y0, x1, y1, cm, of the board is under a cloth; None: nothing is
    """

    paper: str = "a4"
    scale: float = 1.0
    stretch: float = 0.0
    bend: float = 0.0
    free: tuple[float, float, float, float] | None = None

    def met(self, stand: Stand, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where rays (..., 2) of a camera at a stand meet the sheet: x and y, cm."""
        rotation = stand.rotation.astype(np.float32)
        position = -stand.rotation.T @ stand.translation
        ways = rays[..., 0, None] * rotation[0] + rays[..., 1, None] * rotation[1] + rotation[2]
        above: np.ndarray | float = 0.0
        for _ in range(BEND_STEPS if self.bend else 1):
            depth = (above - position[2]) / np.minimum(ways[..., 2], -1e-4)
            x = (position[0] + depth * ways[..., 0]).astype(np.float32)
            y = (position[1] + depth * ways[..., 1]).astype(np.float32)
            above = self.bend * np.clip(x / 10, -1.1, 1.1) ** 2
        return x, y

    def light(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Light (..., 3) of the sheet, and of the table around it, at places, cm."""
        board, up = BOARDS[self.paper], 1 + self.stretch
        print_x = (x / self.scale + board.width / 2) * PER_CM - 0.5
        print_y = (board.height / 2 - y / self.scale / up) * PER_CM - 0.5
        grey = cv2.remap(
            page(self.paper), print_x, print_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
            borderValue=-1.0,
        )  # fmt: skip
        on_paper = (abs(x) < self.scale * board.width / 2) & (
            abs(y) < self.scale * up * board.height / 2
        )
        light = np.where(on_paper[..., None], np.maximum(grey, 0.03)[..., None], TABLE)
        if self.free is not None:
            x0, y0, x1, y1 = self.free
            light[(x < x0) | (y < y0) | (x > x1) | (y > y1)] = CLOTH
        return light.astype(np.float32)


WEBCAM = Development(jpeg=90)
"""How a webcam takes a photograph if nothing is said."""


def photograph(
    lens: Lens,
    stand: Stand,
    sheet: PrintedSheet = PrintedSheet(),  # noqa: B008 (it does not change)
    development: Development = WEBCAM,
    seed: int | Sequence[int] = 0,
) -> np.ndarray:
    """A picture of the board on a table, BGR, uint8.

    Args:
        lens: of the camera.
        stand: where that is; its board is as large as it should be.
        sheet: what lies there.
        development: of the picture.
        seed: of the noise.
    """
    light = sheet.light(*sheet.met(stand, _rays(lens)))
    small = cv2.resize(light, lens.size, interpolation=cv2.INTER_AREA)
    return development.picture(np.asarray(small), seed)
