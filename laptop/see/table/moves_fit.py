"""A camera that does not see the board, and the arm's pose on it, by the tip's own moves.

The joints tell where the tip's marker is in space, the camera tells its pixel.  Enough places, not
in one plane, give the camera's pose and lens; where a camera that knows the board sees them, too,
they give how the arm stands on the board, and so both cameras are in one frame.  Pure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from laptop.see.table.camera_model import CameraModel
from laptop.see.table.plane_motion import PlaneMotion, nearest_motion, rotation
from laptop.see.table.views_fit import USUAL_FIELD, Unknowns, refine
from shared.arm_description import ArmError

MIN_PLACES = 12
"""Least number of places: fewer do not tell how well they fit."""
MIN_THICKNESS = 1.0
"""Least RMS distance of the places from their common plane, cm: of a flatter cloud lens and
distance cannot be separated."""
MIN_EXTENT = 0.06
"""Least RMS width of the places in the picture, as a share of the picture's."""
MIN_SPREAD = 2.0
"""Least RMS distance of the places from their middle on the table, cm."""
FOCAL_SHARES = (0.5, 0.7, 1.0, 1.4, 2.0)
"""Focal lengths that are tried, relative to a usual camera's."""
OUTLIER_PX = 12.0
"""Residual above which a detection is taken for something else, px."""
MAX_OUTLIER_SHARE = 0.3
"""Greatest share of such detections; above, nothing is believed."""
MAX_RMS = 5.0
"""Greatest RMS residual of joints and camera that belong together, px."""
WEIGHT_PASSES = 6
"""Number of fits, each with the weights that the last one's residuals give (P. J. Huber, 1964)."""


class BadMoves(ArmError, ValueError):
    """Moves of the tip from which no camera, or no place of the arm, can be had."""


class _Observations(NamedTuple):
    pixels: np.ndarray
    size: tuple[int, int]


@dataclass(frozen=True, eq=False)
class MovesFit:
    """A camera by the tip's moves.

    camera  the model, in the frame of the points
    places  number of places that it rests on
    rms     distance between what is seen and what the model says, px
    rms_mm  the same across the line of sight, at the tip
    """

    camera: CameraModel
    places: int
    rms: float
    rms_mm: float


@dataclass(frozen=True, eq=False)
class ArmPoseFit:
    """The arm's pose on the board, by the tip's moves.

    turn   of the arm's x from the board's, rad
    base   the arm's origin on the board, (3,), cm
    rms    distance between what is seen and what follows from it, px
    """

    turn: float
    base: np.ndarray
    rms: float

    def on_board(self, points: np.ndarray) -> np.ndarray:
        """Return points of the arm's frame, (n, 3), cm, in the board's."""
        return np.asarray(points @ rotation(self.turn, 3).T + self.base)


def fit_moves(points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]) -> MovesFit:
    """Find a camera by where it sees the tip's marker.

    Args:
        points: places of the marker, (n, 3), cm.
        pixels: of it, (n, 2).
        size: of the picture, (width, height), px.

    Raises:
        BadMoves: too few places, too near one plane, or they do not fit.
    """
    points, pixels = np.asarray(points, float), np.asarray(pixels, float)
    check_moves(points, pixels, size)
    guess = _first_guess(points, pixels, size)
    for _ in range(2):  # the second time without what is something else
        state, off, information = refine(
            [_Observations(pixels, size)], [points], guess, Unknowns(1)
        )
        near = np.linalg.norm(off, axis=1) < OUTLIER_PX
        if (
            near.all()
            or near.sum() < (1 - MAX_OUTLIER_SHARE) * len(near)
            or near.sum() < MIN_PLACES
        ):
            break
        points, pixels, guess = points[near], pixels[near], state
    distances = np.linalg.norm(off, axis=1)
    rms = math.sqrt(float((distances**2).mean()))
    if not rms < MAX_RMS:
        raise BadMoves(
            f"what joints and camera say of the tip differs by {rms:.0f} px (RMS): is it the arm "
            "of this file, with its zero found, and does the camera stand still?"
        )
    camera = CameraModel(size, state[:8], state[8:11], state[11:], np.linalg.inv(information))
    depth = points @ camera.turned[2] + camera.translation[2]
    off_mm = 10 * distances * depth / state[0]
    return MovesFit(camera, len(points), rms, math.sqrt(float((off_mm**2).mean())))


def check_moves(points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]) -> None:
    """Raise BadMoves if places (n, 3), cm, or their pixels (n, 2) tell too little of a camera."""
    if not (np.isfinite(points).all() and np.isfinite(pixels).all()):
        raise BadMoves("a place of the tip is no number: let it move about anew")
    if len(points) < MIN_PLACES:
        raise BadMoves(
            f"the tip was seen at {len(points)} place{'s' * (len(points) != 1)} so far; "
            f"{MIN_PLACES} are the least: let it move about"
        )
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / math.sqrt(len(points))
    if spread[2] < MIN_THICKNESS:
        raise BadMoves(
            f"the places of the tip lie within {10 * spread[2]:.0f} mm of one plane (RMS), which "
            "does not tell lens from distance: let it go up and down, too"
        )
    across = np.linalg.svd(pixels - pixels.mean(axis=0), compute_uv=False)[1]
    if across / math.sqrt(len(pixels)) < MIN_EXTENT * min(size) / 2:
        raise BadMoves(
            "the tip was seen in a small part of the picture only: let it move farther about"
        )


def _first_guess(points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return the state (14,): a lens without distortion, rotation and shift."""
    best, least = None, math.inf
    for share in FOCAL_SHARES:
        focal = share * max(size) / USUAL_FIELD
        lens = np.array([focal, (size[0] - 1) / 2, (size[1] - 1) / 2, 0, 0, 0, 0, 0])
        matrix = np.array([[focal, 0, lens[1]], [0, focal, lens[2]], [0, 0, 1]])
        cv2.setRNGSeed(0)  # the same places give the same camera
        found, turn, shift, _ = cv2.solvePnPRansac(
            points, pixels, matrix, None, reprojectionError=OUTLIER_PX, flags=cv2.SOLVEPNP_SQPNP
        )
        if not found or not np.isfinite([*turn, *shift]).all():
            continue
        seen, _ = cv2.projectPoints(points, turn, shift, matrix, None)
        off = np.linalg.norm(seen[:, 0] - pixels, axis=1)
        score = float(np.minimum(off, OUTLIER_PX).mean()) + 0.3 * abs(math.log(share))
        if score < least:
            best, least = np.concatenate([lens, turn.ravel(), shift.ravel()]), score
    if best is None:
        raise BadMoves(
            "what joints and camera say of the tip fits no camera: is it the arm of this file, "
            "with its zero found?"
        )
    return best


def fit_arm_pose(camera: CameraModel, points: np.ndarray, pixels: np.ndarray) -> ArmPoseFit:
    """Fit the arm's pose on the board by which a camera is calibrated.

    Args:
        camera: the one that knows the board.
        points: places of the marker in the arm's frame, (n, 3), cm.
        pixels: where it is seen, (n, 2).

    Raises:
        BadMoves: too few places, too near one another, or they do not fit.
    """
    points, pixels = np.asarray(points, float), np.asarray(pixels, float)
    on_board = camera.to_table(pixels, points[:, 2]) if len(points) else np.empty((0, 2))
    finite = np.isfinite(on_board).all(axis=1) & np.isfinite(points).all(axis=1)
    points, pixels, on_board = points[finite], pixels[finite], on_board[finite]
    if len(points) < MIN_PLACES:
        raise BadMoves(
            f"the tip was seen at {len(points)} place{'s' * (len(points) != 1)} so far; "
            f"{MIN_PLACES} are the least: let it move about"
        )
    if math.sqrt(np.var(points[:, :2], axis=0).sum()) < MIN_SPREAD:
        raise BadMoves("the tip was seen in a small part of its reach: let it move farther about")
    turn, shift = _flat_pose(points[:, :2], on_board)
    state = np.array([turn, *shift, 0.0])
    for _ in range(WEIGHT_PASSES):
        distances = np.linalg.norm(_missed(camera, state, points, pixels), axis=1)
        limit = 3 * max(float(np.median(distances)), 0.05)
        weights = np.sqrt(np.minimum(1.0, limit / np.maximum(distances, 1e-9)))[:, None]
        state = least_squares(
            lambda x, w: (w * _missed(camera, x, points, pixels)).ravel(),
            state,
            method="lm",
            x_scale="jac",
            args=(weights,),
        ).x
    distances = np.linalg.norm(_missed(camera, state, points, pixels), axis=1)
    near = distances < OUTLIER_PX
    rms = math.sqrt(float((distances[near] ** 2).mean())) if near.any() else math.inf
    if near.mean() < 1 - MAX_OUTLIER_SHARE or not rms < MAX_RMS:
        raise BadMoves(
            "what joints and the camera over the board say of the tip differs by "
            f"{float(np.median(distances)):.0f} px: is it the arm of this file, with its zero "
            "found?"
        )
    return ArmPoseFit(float(state[0]), state[1:], rms)


def _missed(
    camera: CameraModel, state: np.ndarray, points: np.ndarray, pixels: np.ndarray
) -> np.ndarray:
    return np.asarray(camera.project(points @ rotation(state[0], 3).T + state[1:]) - pixels)


def _flat_pose(points: np.ndarray, goals: np.ndarray) -> PlaneMotion:
    """Return the motion from points (n, 2) to goals (n, 2), in three rounds.

    Each goes without the pairs that are off by more than three medians of the last one.
    """
    inliers = np.ones(len(points), bool)
    for _ in range(3):
        motion = nearest_motion(points[inliers], goals[inliers])
        off = np.linalg.norm(motion.moved(points) - goals, axis=1)
        inliers = off <= 3 * max(float(np.median(off)), 0.05)
    return motion
