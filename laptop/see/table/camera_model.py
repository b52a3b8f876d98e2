"""One camera over a table: cm to px and back, and how sure that is.

The world is the board's: cm, x and y on the table, z up from it.  The lens is OpenCV's: a focal
length, a principal point, and the distortion of D. C. Brown (1966), radial and decentering.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

LENS = ("focal", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Names of the lens's parameters, in their order: px, px, px, and OpenCV's distortion."""
HORIZON = math.radians(2)
"""Angle between a line of sight and the table below which it counts as missing it, rad."""
MIN_CROSSING = 1e-6
"""Squared sine of the angle below which two lines of sight are parallel."""
NEWTON_STEPS = 4
MAX_STEP = 0.5
"""Greatest step of an undistortion iteration, as a tangent."""
MAX_REDISTORTION_ERROR = 0.05
"""Greatest error with which a pixel must be found again, px; beyond, the lens has no such pixel."""


class Placed(NamedTuple):
    """A place on a plane over the table, and how sure it is.

    xy          (n, 2), cm; nan where the line of sight does not meet the plane
    covariance  (n, 2, 2), cm^2
    """

    xy: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class CameraModel:
    """A camera's lens and pose, with their covariance.

    size        of the picture, (width, height), px
    lens        (8,), see LENS
    rotation    (3,), rotation vector from the board to the camera, rad
    translation (3,), the board's origin seen from the camera, cm
    covariance  (14, 14), of lens, rotation and translation
    """

    size: tuple[int, int]
    lens: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray
    covariance: np.ndarray

    @property
    def matrix(self) -> np.ndarray:
        """The camera's matrix, (3, 3)."""
        focal, cx, cy = self.lens[:3]
        return np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1]])

    @property
    def distortion(self) -> np.ndarray:
        """OpenCV's k1, k2, p1, p2, k3."""
        return np.asarray(self.lens[3:])

    @property
    def turned(self) -> np.ndarray:
        """Rotation (3, 3) from the board to the camera."""
        return np.asarray(cv2.Rodrigues(self.rotation)[0])

    @property
    def position(self) -> np.ndarray:
        """The camera's position, (3,), cm."""
        return np.asarray(-self.turned.T @ self.translation)

    @property
    def tilt(self) -> float:
        """Angle between its axis and straight down, rad."""
        return math.acos(float(np.clip(-self.turned[2, 2], -1, 1)))

    def project(self, points: np.ndarray) -> np.ndarray:
        """Project points (n, 3), cm, into the picture: (n, 2), px; nan behind the camera."""
        pixels, _ = projected(np.asarray(points, float), self.lens, self.rotation, self.translation)
        behind = points @ self.turned[2] + self.translation[2] <= 0
        pixels[behind] = np.nan
        return pixels

    def to_table(self, pixels: np.ndarray, height: float | np.ndarray = 0.0) -> np.ndarray:
        """Return the places, (n, 2), cm, at which pixels' (n, 2) lines of sight reach a height, cm.

        nan where one does not come down to that height, or where the lens has no such pixel.
        """
        rays = self.sight_lines(pixels)
        with np.errstate(divide="ignore", invalid="ignore"):
            ray_lengths = (height - self.position[2]) / rays[:, 2]
            places = self.position[:2] + ray_lengths[:, None] * rays[:, :2]
            level = ~(np.abs(rays[:, 2]) > math.sin(HORIZON))
            places[level | ~(ray_lengths > 0)] = np.nan
        return np.asarray(places)

    def placed(
        self,
        pixels: np.ndarray,
        height: float = 0.0,
        pixel_sigma: float = 0.0,
        height_sigma: float = 0.0,
    ) -> Placed:
        """Return `to_table` with the covariance that follows from the calibration's.

        Args:
            pixels: (n, 2).
            height: cm.
            pixel_sigma: of the pixels themselves, per axis.
            height_sigma: cm.
        """
        pixels = np.asarray(pixels, float).reshape(-1, 2)
        xy = self.to_table(pixels, height)
        covariance = np.full((len(xy), 2, 2), np.nan)
        finite = np.isfinite(xy).all(axis=1)
        if finite.any():
            points = np.column_stack([xy[finite], np.full(finite.sum(), height)])
            _, slopes = projected(points, self.lens, self.rotation, self.translation)
            across = per_cm(self, points)
            # uv(X, c) stays, so dX = -(duv/dX)^-1 duv/dc dc: of numbers c, and of the height.
            back = np.linalg.inv(across[:, :, :2])
            own = back @ slopes
            up = back @ across[:, :, 2:]
            covariance[finite] = (
                own @ self.covariance @ own.transpose(0, 2, 1)
                + pixel_sigma**2 * back @ back.transpose(0, 2, 1)
                + height_sigma**2 * up @ up.transpose(0, 2, 1)
            )
        return Placed(xy, covariance)

    def px_per_cm(self, xy: np.ndarray, height: float = 0.0) -> np.ndarray:
        """Return the picture's scale at places (n, 2), cm: the mean over all directions, (n,)."""
        points = np.column_stack([xy, np.full(len(xy), height)])
        return np.asarray(np.sqrt(np.abs(np.linalg.det(per_cm(self, points)[:, :, :2]))))

    def sight_lines(self, pixels: np.ndarray) -> np.ndarray:
        """Return the viewing directions (n, 3) of pixels (n, 2), unit vectors in the board's frame.

        nan where the lens has no such pixel.
        """
        pixels = np.asarray(pixels, float).reshape(-1, 2)
        usable = np.where(np.isfinite(pixels), pixels, self.lens[1:3])
        if not len(usable):
            return np.empty((0, 3))
        rays = np.ones((len(usable), 3))
        first = cv2.undistortPoints(usable[:, None], self.matrix, self.distortion)
        rays[:, :2] = first[:, 0]
        # OpenCV's own iteration stops early; Newton's goes on from there.
        for _ in range(NEWTON_STEPS):
            again, slopes = projected(rays, self.lens, np.zeros(3), np.zeros(3))
            by_ray = slopes[..., 11:13]
            by_ray[np.abs(np.linalg.det(by_ray)) < 1e-6] = np.eye(2) * self.lens[0]
            steps = np.linalg.solve(by_ray, (usable - again)[..., None])[..., 0]
            rays[:, :2] += np.clip(steps, -MAX_STEP, MAX_STEP)
        again, _ = projected(rays, self.lens, np.zeros(3), np.zeros(3))
        missed = ~(np.abs(again - pixels).max(axis=1) < MAX_REDISTORTION_ERROR)
        rays[missed] = np.nan
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True) @ self.turned)


def projected(
    points: np.ndarray, lens: np.ndarray, rotation: np.ndarray, translation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return pixels (n, 2) of points (n, 3), and derivatives (n, 2, 14) as in `covariance`."""
    focal, cx, cy = lens[:3]
    matrix = np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1]])
    if not len(points):
        return np.empty((0, 2)), np.empty((0, 2, 14))
    pixels, slopes = cv2.projectPoints(points[:, None], rotation, translation, matrix, lens[3:])
    # OpenCV's order: rotation 3, translation 3, fx, fy, cx, cy, distortion 5.
    slopes = slopes.reshape(-1, 2, slopes.shape[1])
    own = np.concatenate(
        [
            slopes[..., 6:7] + slopes[..., 7:8],
            slopes[..., 8:10],
            slopes[..., 10:15],
            slopes[..., :6],
        ],
        axis=2,
    )
    return pixels[:, 0].copy(), own


def per_cm(camera: CameraModel, points: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, 2, 3) of pixels by points (n, 3), px/cm."""
    _, slopes = projected(points, camera.lens, camera.rotation, camera.translation)
    # A point that moves by d looks like a board that is moved by R d.
    return np.asarray(slopes[..., 11:14] @ camera.turned)


def triangulate(
    one: CameraModel, other: CameraModel, pixels_one: np.ndarray, pixels_other: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3), cm, where two cameras' lines of sight meet, and their gaps (n,), cm.

    The point is in the middle of where the two lines of sight are nearest; the gap (n,) between
    them, cm, tells how far the two are from agreeing.  Of parallel lines they are nan.

    Args:
        one: a camera.
        other: another one, calibrated by the same board.
        pixels_one: (n, 2).
        pixels_other: of the same things, (n, 2).
    """
    a, b = one.sight_lines(pixels_one), other.sight_lines(pixels_other)
    starts = one.position, other.position
    between = starts[1] - starts[0]
    ab = (a * b).sum(axis=1)
    crossing = np.where(1 - ab**2 > MIN_CROSSING, 1 - ab**2, np.nan)
    along_a = (a @ between - ab * (b @ between)) / crossing
    along_b = (ab * (a @ between) - b @ between) / crossing
    on_a = starts[0] + along_a[:, None] * a
    on_b = starts[1] + along_b[:, None] * b
    return (on_a + on_b) / 2, np.linalg.norm(on_a - on_b, axis=1)
