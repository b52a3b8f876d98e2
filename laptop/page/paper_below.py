"""The paper below the plane in which an arm's marker rides, in the picture of an unknown camera.

Where the marker is seen at places of one plane tells the camera's pose, if its lens is known.  It
is not; but the more askew the camera looks, the more these places tell of the lens, too, and of the
rest it is known what cameras are like (`laptop.see.table.views_fit`).  The covariance says how sure
the paper's place is then.  Pure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.table.camera_model import CameraModel, per_cm, projected
from laptop.see.table.moves_fit import FOCAL_SHARES
from laptop.see.table.views_fit import USUAL_FIELD, Unknowns, refine

MIN_PLACES = 12
"""Fewest places from which their misfit can be judged."""
MAX_RMS = 5.0
"""Greatest residual, px (RMS); beyond it no camera sees the places so."""
HEIGHT_SIGMA = 0.1
"""Standard deviation of a height that somebody has measured with a ruler, cm."""
REFIT_GROWTH = 1.15
"""Growth of the number of places, a factor, after which the camera is fitted anew."""
MAX_FIT_PLACES = 120
"""Greatest number of places in a fit: more tell nothing new."""


class _PlaneObservations(NamedTuple):
    pixels: np.ndarray
    size: tuple[int, int]


class PaperBelow:
    """Learns a camera's pose and lens by places of a marker in one plane.

    Attributes:
        camera: in the frame of that plane, cm; None: it is not known.
    """

    def __init__(self) -> None:
        self.camera: CameraModel | None = None
        self._fitted = 0

    def learn(self, points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]) -> None:
        """Set all places so far; they are fitted when there are enough new ones.

        Args:
            points: of the marker in its plane, (n, 2), cm.
            pixels: where they are seen, (n, 2).
            size: of the picture, (width, height), px.
        """
        if len(points) < max(MIN_PLACES, REFIT_GROWTH * self._fitted):
            return
        self._fitted = len(points)
        if len(points) > MAX_FIT_PLACES:
            chosen = np.linspace(0, len(points) - 1, MAX_FIT_PLACES).astype(int)
            points, pixels = points[chosen], pixels[chosen]
        before = self.camera
        if before and (near := _fitted(points, pixels, size, _state(before))):
            self.camera = near[1]
        else:
            self.camera = plane_camera(points, pixels, size)

    def forget(self) -> None:
        """Reset."""
        self.camera, self._fitted = None, 0

    def paper(self, height: float, points: np.ndarray) -> tuple[np.ndarray, float] | None:
        """Return the paper's homography, cm to px, and how unsure it is, mm; None: not known.

        Args:
            height: of the marker over the paper, cm.
            points: places (n, 2), cm, about which it is to hold.
        """
        if self.camera is None:
            return None
        low, high = points.min(axis=0), points.max(axis=0)
        grid = np.stack(np.meshgrid(*np.linspace(low, high, 8).T), -1).reshape(-1, 2)
        on_paper = np.column_stack([grid, np.full(len(grid), -height)])
        seen = self.camera.project(on_paper)
        finite = np.isfinite(seen).all(axis=1)
        if finite.sum() < 8:
            return None
        matrix, _ = cv2.findHomography(grid[finite], seen[finite])
        return matrix, 10 * _parallax_sigma(self.camera, height, points.mean(axis=0))


def _parallax_sigma(camera: CameraModel, height: float, middle: np.ndarray) -> float:
    """Return how unsure it is how far below a place of the marker, (2,), the paper's is seen, cm.

    Where the marker itself is seen is known by the places; this comes on top of it.
    """
    above = np.array([(*middle, 0.0)])
    below = above - (0.0, 0.0, height)
    slopes = [
        projected(p, camera.lens, camera.rotation, camera.translation)[1] for p in (below, above)
    ]
    by_camera = (slopes[0] - slopes[1])[0]
    by_height = per_cm(camera, below)[0, :, 2]
    covariance = by_camera @ camera.covariance @ by_camera.T
    covariance += HEIGHT_SIGMA**2 * np.outer(by_height, by_height)
    scale = float(camera.px_per_cm(middle[None], -height)[0])
    return math.sqrt(max(0.0, float(np.trace(covariance)))) / scale


def plane_camera(
    points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]
) -> CameraModel | None:
    """Return the camera that sees places of one plane, in the plane's frame; None: none does.

    Args:
        points: (n, 2), cm; seen from above x turns to y counter-clockwise.
        pixels: (n, 2).
        size: of the picture, (width, height), px.
    """
    guesses = _guesses(points, pixels, size)
    found = [fit for guess in guesses if (fit := _fitted(points, pixels, size, guess))]
    return min(found, key=lambda fit: fit[0])[1] if found else None


def _state(camera: CameraModel) -> np.ndarray:
    return np.concatenate([camera.lens, camera.rotation, camera.translation])


def _fitted(
    points: np.ndarray, pixels: np.ndarray, size: tuple[int, int], guess: np.ndarray
) -> tuple[float, CameraModel] | None:
    """Return the residual, px (RMS), and the camera above the plane that is near a guess."""
    flat = np.column_stack([points, np.zeros(len(points))])
    try:
        state, off, information = refine(
            [_PlaneObservations(pixels, size)], [flat], guess, Unknowns(1)
        )
        covariance = np.linalg.inv(information)
    except np.linalg.LinAlgError:
        return None
    rms = math.sqrt(float((off**2).sum(axis=1).mean()))
    camera = CameraModel(size, state[:8], state[8:11], state[11:], covariance)
    return (rms, camera) if rms < MAX_RMS and camera.position[2] > 0 else None


def _guesses(points: np.ndarray, pixels: np.ndarray, size: tuple[int, int]) -> list[np.ndarray]:
    """Return initial states (14,): the best one of each of the two pose solutions of a plane."""
    flat = np.column_stack([points, np.zeros(len(points))])
    scored: list[tuple[float, int, np.ndarray]] = []
    for share in FOCAL_SHARES:
        focal = share * max(size) / USUAL_FIELD
        lens = np.array([focal, (size[0] - 1) / 2, (size[1] - 1) / 2, 0, 0, 0, 0, 0])
        matrix = np.array([[focal, 0, lens[1]], [0, focal, lens[2]], [0, 0, 1]])
        _, turns, shifts, errors = cv2.solvePnPGeneric(
            flat, pixels, matrix, None, flags=cv2.SOLVEPNP_IPPE
        )
        for k, (turn, shift, error) in enumerate(zip(turns, shifts, errors, strict=True)):
            state = np.concatenate([lens, turn.ravel(), shift.ravel()])
            if np.isfinite(state).all():
                scored.append((float(error[0]) + 0.3 * abs(math.log(share)), k, state))
    scored.sort(key=lambda one: one[0])
    firsts = [next((s for _, pose, s in scored if pose == k), None) for k in (0, 1)]
    return [state for state in firsts if state is not None]
