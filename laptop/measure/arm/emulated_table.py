"""A table that is emulated: a camera over a printed board, an arm beside it, and a hand.

It is the truth behind `calibrate --simulate` and its bench; what measures does not know it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from laptop.measure.arm.arm_fit import PLACING_ERROR, TouchSight
from laptop.measure.arm.calibrating import check_board
from laptop.measure.arm.touching import crosses_to_touch
from laptop.measure.emulated_rig import marker_point
from laptop.see.markers.board import BOARDS, Board
from laptop.see.markers.finders.board import BoardView
from laptop.see.table.camera_fit import Calibration, calibrate
from laptop.see.table.camera_model import CameraModel
from robot.motion import kinematics
from shared.arm_description import Arm

CORNER_NOISE = 0.1
"""Error with which a corner of the board is found, px (standard deviation)."""
CORNER_SQUARE_SHARE = 0.5
"""Share of a marker's square whose corners are found."""
BOARD_TILTS = ((math.radians(30), 0.0), (0.0, math.radians(30)))
"""Turns of the board about its x and y in further pictures, rad, before it is laid down."""
TOUCH_PICTURES = 10
"""Number of pictures of the marker while the pen stands on a cross."""


@dataclass(frozen=True, eq=False)
class EmulatedTable:
    """True scene: arm, board and camera.

    arm      as it is built
    camera   over the board
    base     where the arm stands on the board, (x, y), cm
    turn     of its x from the board's, rad
    height   of the marker over the table, cm (in space: over the tip)
    board    which one
    covered  share of the board's markers that something lies on
    print_scale  size of the print
    """

    arm: Arm
    camera: CameraModel
    base: tuple[float, float] = (-12.5, 0.0)
    turn: float = 0.0
    height: float = 2.5
    board: Board = BOARDS["a4"]
    covered: float = 0.0
    print_scale: float = 1.0

    def on_board(self, points: np.ndarray) -> np.ndarray:
        """Points of the arm's frame, (n, 3), cm, on the board."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        flat = np.array(self.base) + points[:, :2] @ np.array([[c, s], [-s, c]])
        return np.column_stack([flat, points[:, 2]])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points of the arm's frame, (n, 3), cm; nan outside the picture."""
        pixels = self.camera.project(self.on_board(np.asarray(points, float)))
        return self._within(pixels)

    def _within(self, pixels: np.ndarray) -> np.ndarray:
        inside = ((pixels >= 0) & (pixels < np.array(self.camera.size))).all(axis=1)
        return np.where(inside[:, None], pixels, np.nan)

    def calibrated(self, rng: np.random.Generator, bar: float | None = None) -> Calibration:
        """Show the board tilted and then as it lies, and calibrate the camera.

        Raises:
            BadCalibration, BadIdentification: too little of it is seen.
        """
        views = [self._view(tilt, rng) for tilt in BOARD_TILTS]
        views.append(self._view((0.0, 0.0), rng, self.covered))
        check_board(views[-1])
        return calibrate(views, bar)

    def _view(
        self, tilt: tuple[float, float], rng: np.random.Generator, covered: float = 0.0
    ) -> BoardView:
        numbers = np.array(self.board.numbers)
        points = np.concatenate([self.board.square(k, CORNER_SQUARE_SHARE) for k in numbers])
        turned = cv2.Rodrigues(np.array([*tilt, 0.0]))[0]
        pixels = self._within(self.camera.project(self.print_scale * points @ turned.T))
        seen = np.isfinite(pixels).reshape(len(numbers), -1).all(axis=1)
        seen &= np.arange(len(numbers)) >= covered * len(numbers)
        corners = np.repeat(seen, 4)
        pixels = pixels[corners] + CORNER_NOISE * rng.standard_normal((corners.sum(), 2))
        quads = pixels.reshape(-1, 4, 2)
        sides = np.linalg.norm(quads[:, 0] - quads[:, 1], axis=1) / CORNER_SQUARE_SHARE
        side = float(np.median(sides)) if len(sides) else 0.0
        return BoardView(
            self.board, numbers[seen], points[corners], pixels, self.camera.size, side, 0.8
        )

    def touches(
        self, count: int, rng: np.random.Generator, noise_px: float = 1.0
    ) -> list[TouchSight]:
        """Let a hand set the pen on so many crosses that lie well, the camera looking each time."""
        crosses = crosses_to_touch(self.base, kinematics.reach(self.arm), count)
        return self.touched(crosses, rng, noise_px)

    def touched(
        self,
        crosses: Sequence[tuple[float, float]],
        rng: np.random.Generator,
        noise_px: float = 1.0,
    ) -> list[TouchSight]:
        """Let a hand set the pen on crosses, cm on the board, the camera looking each time.

        Raises:
            kinematics.Unreachable: the arm does not reach one.
        """
        found = []
        for cross in crosses:
            hand = self.print_scale * np.array(cross) + PLACING_ERROR * rng.standard_normal(2)
            c, s = math.cos(self.turn), math.sin(self.turn)
            point = (hand - self.base) @ np.array([[c, -s], [s, c]])
            elbow = ("up", "down")[int(rng.integers(2))]
            q = kinematics.inverse(with_free_joints(self.arm), tuple(map(float, point)), elbow)
            place = np.array([marker_point(self.arm, q, self.height)])
            samples = self.project(np.repeat(place, TOUCH_PICTURES, axis=0))
            samples = samples + noise_px * rng.standard_normal(samples.shape)
            pixel = np.median(samples, axis=0)
            if np.isfinite(pixel).all():
                sigma = 1.25 * noise_px / math.sqrt(TOUCH_PICTURES)
                found.append(TouchSight(cross, (float(pixel[0]), float(pixel[1])), sigma))
        return found


def rng_of(seed: int) -> np.random.Generator:
    """Return the random numbers of a seed."""
    return np.random.default_rng(seed)


def with_free_joints(arm: Arm) -> Arm:
    """Return the arm without limits: a hand does not ask for them."""
    turn = math.pi
    return arm._replace(
        joints=tuple(joint._replace(lower=-turn, upper=turn) for joint in arm.joints)
    )


def camera_over(
    focal: float,
    at: tuple[float, float],
    distance: float,
    tilt: float,
    azimuth: float,
    roll: float,
    size: tuple[int, int] = (640, 480),
    distortion: tuple[float, ...] = (0.0,) * 5,
) -> CameraModel:
    """Return a camera that looks at a place of the board.

    Args:
        focal: px.
        at: the place, (x, y), cm.
        distance: from there, cm.
        tilt: of its axis from straight down, rad.
        azimuth: to which side it stands, rad.
        roll: about its axis, rad.
        size: of its picture, px.
        distortion: OpenCV's k1, k2, p1, p2, k3.
    """
    sine = math.sin(tilt)
    away = np.array([sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(tilt)])
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    down = np.cross(-away, right)
    c, s = math.cos(roll), math.sin(roll)
    rotation = np.array([c * right + s * down, c * down - s * right, -away])
    position = np.array([*at, 0.0]) + distance * away
    lens = np.array([focal, (size[0] - 1) / 2, (size[1] - 1) / 2, *distortion])
    vector = cv2.Rodrigues(rotation)[0].ravel()
    return CameraModel(size, lens, vector, -rotation @ position, np.zeros((14, 14)))
