"""Photographs of the printed board through lenses that bend it.

The printed page is the texture.  Every pixel is the mean of many rays; each goes back through the
lens and meets the plane of the sheet.  None of it goes through the calibration's code.

The lens is OpenCV's (Brown, 1966, with the tangential terms p1, p2): with a = x/z, b = y/z and
r^2 = a^2 + b^2,

    u = f (a (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 a b + p2 (r^2 + 2 a^2)) + cu,   v likewise.

Rays need its inverse, which has no closed form.  `cv2.undistortPoints` alone is too rough: it stops
after a few steps.  So its rays are refined by the fixed point ray += (pixel - project(ray)) / f,
for a grid of Chebyshev nodes; polynomials through these give all other rays.
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

RAYS_PER_PIXEL = 4
"""Number of rays per pixel and axis."""
POINTS_PER_CM = 100.0
"""Resolution of the page's texture, points per cm."""
POLYNOMIAL_DEGREE, FIXED_POINT_STEPS = 20, 100
"""Degree of the polynomials between rays; number of steps that refine the rays at their nodes."""
BEND_STEPS = 4
"""Number of steps in which a ray meets a bent sheet."""
TABLE_LIGHT = np.array((0.18, 0.24, 0.33), np.float32)
"""Light of the table, B, G, R."""
CLOTH_LIGHT = np.array((0.3, 0.1, 0.1), np.float32)
"""Light of the cloth, B, G, R."""


@dataclass(frozen=True)
class Lens:
    """A lens and its sensor, in OpenCV's convention.

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
        """Camera matrix, (3, 3), px."""
        return np.array(
            [[self.focal, 0, self.centre[0]], [0, self.focal, self.centre[1]], [0, 0, 1]]
        )


@dataclass(frozen=True)
class CameraPose:
    """The pose of a camera over a board.

    rotation     (3, 3), board to camera
    translation  (3,), cm
    """

    rotation: np.ndarray
    translation: np.ndarray

    @classmethod
    def looking(
        cls, distance: float, tilt: float, azimuth: float, roll: float, at: tuple[float, float]
    ) -> CameraPose:
        """Return a camera that looks at a place of the board from a distance, cm; angles in rad."""
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
        """Return the true places of points (n, 3), cm, in the picture: (n, 2), px."""
        x = points @ self.rotation.T + self.translation
        a, b = (x[:, :2] / x[:, 2:]).T
        k1, k2, p1, p2, k3 = lens.distortion
        r2 = a * a + b * b
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        u = a * radial + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
        v = b * radial + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
        return lens.focal * np.column_stack([u, v]) + lens.centre


def draw_lens(seed: int) -> Lens:
    """Draw a webcam's lens: 43 to 78 degrees wide, off its middle, with OpenCV's distortion."""
    rng = np.random.default_rng([seed, 21])
    width, height = 640, 480
    focal = width / 2 / math.tan(math.radians(rng.uniform(43, 78)) / 2)
    centre = (width - 1) / 2 + rng.uniform(-16, 16), (height - 1) / 2 + rng.uniform(-16, 16)
    k1 = rng.uniform(-0.35, 0.12)
    distortion = (
        k1,
        rng.uniform(0.0, 0.12) - 0.3 * min(k1, 0.0),
        *rng.uniform(-0.0015, 0.0015, 2),
        rng.uniform(-0.03, 0.03),
    )
    return Lens(focal, centre, distortion)


@lru_cache(maxsize=2)
def page(paper: str) -> np.ndarray:
    """Return the printed page, light (height, width), POINTS_PER_CM points a centimetre."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "board.png"
        write_board(file, paper)
        drawn = np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE))
    board = BOARDS[paper]
    size = round(board.width * POINTS_PER_CM), round(board.height * POINTS_PER_CM)
    small = cv2.resize(drawn, size, interpolation=cv2.INTER_AREA)
    return np.asarray(0.03 + 0.8 * to_linear(small), np.float32)


@lru_cache(maxsize=8)
def _rays(lens: Lens) -> np.ndarray:
    """Return the directions (rows, columns, 2), x and y at z = 1, of all rays of all pixels."""
    at = [(np.arange(n * RAYS_PER_PIXEL) + 0.5) / RAYS_PER_PIXEL - 0.5 for n in lens.size]
    # A lens is smooth: polynomials through a few of its rays give all others to the last digit.
    nodes = np.polynomial.chebyshev.chebpts1(POLYNOMIAL_DEGREE + 1)
    few = [(n * (nodes + 1) - 1) / 2 for n in lens.size]
    grid = np.stack(np.meshgrid(*few), axis=-1).reshape(-1, 2)
    distortion = np.array(lens.distortion)
    rays = cv2.undistortPoints(grid[:, None], lens.matrix, distortion)[:, 0]
    for _ in range(FIXED_POINT_STEPS):
        spatial = np.column_stack([rays, np.ones(len(rays))])
        again, _ = cv2.projectPoints(spatial, np.zeros(3), np.zeros(3), lens.matrix, distortion)
        rays = rays + (grid - again[:, 0]) / lens.focal
    rays = rays.reshape(POLYNOMIAL_DEGREE + 1, POLYNOMIAL_DEGREE + 1, 2)
    through = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, POLYNOMIAL_DEGREE))
    across, down = (
        np.polynomial.chebyshev.chebvander((2 * axis + 1) / n - 1, POLYNOMIAL_DEGREE) @ through
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

    def met(self, camera: CameraPose, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x and y, cm, where rays (..., 2) of a camera at a stand meet the sheet."""
        rotation = camera.rotation.astype(np.float32)
        position = -camera.rotation.T @ camera.translation
        directions = (
            rays[..., 0, None] * rotation[0] + rays[..., 1, None] * rotation[1] + rotation[2]
        )
        above: np.ndarray | float = 0.0
        for _ in range(BEND_STEPS if self.bend else 1):
            depth = (above - position[2]) / np.minimum(directions[..., 2], -1e-4)
            x = (position[0] + depth * directions[..., 0]).astype(np.float32)
            y = (position[1] + depth * directions[..., 1]).astype(np.float32)
            above = self.bend * np.clip(x / 10, -1.1, 1.1) ** 2
        return x, y

    def light(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the light (..., 3) of the sheet, and of the table around it, at places, cm."""
        board, up = BOARDS[self.paper], 1 + self.stretch
        print_x = (x / self.scale + board.width / 2) * POINTS_PER_CM - 0.5
        print_y = (board.height / 2 - y / self.scale / up) * POINTS_PER_CM - 0.5
        grey = cv2.remap(
            page(self.paper), print_x, print_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT,
            borderValue=-1.0,
        )  # fmt: skip
        on_paper = (abs(x) < self.scale * board.width / 2) & (
            abs(y) < self.scale * up * board.height / 2
        )
        light = np.where(on_paper[..., None], np.maximum(grey, 0.03)[..., None], TABLE_LIGHT)
        if self.free is not None:
            x0, y0, x1, y1 = self.free
            light[(x < x0) | (y < y0) | (x > x1) | (y > y1)] = CLOTH_LIGHT
        return light.astype(np.float32)


WEBCAM = Development(jpeg=90)
"""Default development: a webcam's."""


def photograph(
    lens: Lens,
    camera: CameraPose,
    sheet: PrintedSheet = PrintedSheet(),  # noqa: B008 (it does not change)
    development: Development = WEBCAM,
    seed: int | Sequence[int] = 0,
) -> np.ndarray:
    """Return a picture of the board on a table, BGR, uint8.

    Args:
        lens: of the camera.
        camera: its pose over the board.
        sheet: the print of the board on the table.
        development: of the picture.
        seed: of the noise.
    """
    light = sheet.light(*sheet.met(camera, _rays(lens)))
    small = cv2.resize(light, lens.size, interpolation=cv2.INTER_AREA)
    return development.picture(np.asarray(small), seed)
