"""Calibration of a camera by pictures of the board: lens, pose, and how sure both are.

All views are fitted at once (`views_fit`) to where the board's markers are seen.  One picture is
enough to begin with; the covariance says what is still open.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from laptop.see.markers.board import BAR, Board
from laptop.see.markers.finders.board import BoardView
from laptop.see.table.camera_model import CameraModel
from laptop.see.table.views_fit import (
    MIN_SIGMA,
    USUAL_FIELD,
    Unknowns,
    huber_weights,
    refine,
    with_prior_focal,
)
from shared.arm_description import ArmError

MIN_MARKERS = 4
"""Least number of markers in a usable picture."""
MIN_SIDE = 14.0
"""Least side of a marker that is placed well, px."""
MAX_TILT = math.radians(75)
"""Greatest tilt of the camera's axis from straight down, rad; beyond, the board is seen too flat.
"""
MIN_FOCAL_TILT = math.radians(6)
"""Tilt below which no view tells anything of the focal length, rad."""
BAR_LIMITS = (50.0, 200.0)
"""Least and greatest length of the bar that is believed, mm."""
MAX_RMS = 1.0
"""Greatest RMS residual of a flat board of these markers, px."""
OUTLIER_MEDIANS, OUTLIER_PX = 8.0, 1.0
"""Residual of a marker that is no part of the board: in medians, and in px; both hold."""
MAX_LEFT_OUT = 0.25
"""Greatest share of such markers; above, nothing is believed."""
SAME_VIEW_SHIFT = 0.05
"""Displacement of a marker's corners, relative to its side, below which two views are one."""
MIN_ZOOM, MIN_ZOOM_SIGMAS, MIN_ZOOM_F = 0.03, 5.0, 20.0
"""Limits beyond which two views have not one focal length: relative difference, sigmas, and R. A.
Fisher's F of the residuals with one length for each view."""
MAX_BLUR = 1.5
"""Sigma of the edges above which a picture is called blurred, px."""


class BadCalibration(ArmError, ValueError):
    """Pictures from which no camera can be had."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera's calibration, as fitted to views.

    camera   the model; its board is that of the last view
    board    which one was seen
    bar      length of its bar that was reckoned with, mm; None: as printed, not measured
    markers  that were seen in each view
    rms      distance between what is seen and what the model says, px
    rms_mm   the same on the table, in the last view
    blur     of the last view's edges, px
    left_out number of markers that were seen where none of the board can be
    alike    number of pictures that were not reckoned with, as others show the same view
    """

    camera: CameraModel
    board: Board
    bar: float | None
    markers: tuple[int, ...]
    rms: float
    rms_mm: float
    blur: float
    left_out: int = 0
    alike: int = 0

    @property
    def scale(self) -> float:
        """Size of the print: 1 if it is true."""
        return (self.bar or 10 * BAR) / (10 * BAR)

    @property
    def focal_sigma(self) -> float:
        """Standard deviation of the focal length, as a share of it."""
        return float(np.sqrt(self.camera.covariance[0, 0]) / self.camera.lens[0])

    def point_sigma(self, height: float = 0.0) -> float:
        """Return the greatest standard deviation of a point over the free middle of the board, cm.

        Args:
            height: over the table, cm.
        """
        w, h = (side / 2 for side in self.board.middle)
        grid = np.stack(np.meshgrid(np.linspace(-w, w, 5), np.linspace(-h, h, 5)), -1).reshape(
            -1, 2
        )
        pixels = self.camera.project(np.column_stack([grid, np.full(len(grid), height)]))
        placed = self.camera.placed(pixels, height)
        sigmas = np.sqrt(np.trace(placed.covariance, axis1=1, axis2=2))
        return float(np.max(sigmas[np.isfinite(sigmas)])) if np.isfinite(sigmas).any() else math.nan


def calibrate(views: Sequence[BoardView], bar: float | None = None) -> Calibration:
    """Fit a camera to views of the board; the last one says where the table is.

    Args:
        views: of one camera, each of a board that lay flat; from one up.
        bar: length of the printed bar as measured, mm; None: not measured, taken for 100.

    Raises:
        BadCalibration: too little is seen, or it does not fit a flat board.
    """
    _check(views, bar)
    pictures = len(views)
    views = _different(views)
    scale = (bar or 10 * BAR) / (10 * BAR)
    state, off, covariance = _fit(views, scale)
    inlier_views = _without_outliers(views, off)
    count = sum(len(view.numbers) for view in views)
    left_out = count - sum(len(view.numbers) for view in inlier_views)
    few = left_out > MAX_LEFT_OUT * count or min(len(v.numbers) for v in inlier_views) < MIN_MARKERS
    if left_out and not few:
        state, off, covariance = _fit(inlier_views, scale)
    _check_zoom(views if few else inlier_views, scale, state, off)
    rms = math.sqrt((off**2).sum(axis=1).mean())
    if few or not rms < MAX_RMS:
        raise BadCalibration(
            f"what is seen does not fit a flat board: {left_out} of {count} markers are far off, "
            f"{rms:.1f} px RMS; lay it flat, let nothing else show its markers, and take pictures "
            "of one camera and one zoom"
        )
    pose = Unknowns(len(views), sheet=True).pose(-1)
    own = [*range(8), *range(pose.start, pose.stop)]
    covariance = covariance[np.ix_(own, own)]
    turn, shift = np.split(state[pose], 2)
    camera = CameraModel(views[0].size, state[:8], turn, shift, covariance)
    if camera.tilt > MAX_TILT:
        raise BadCalibration(
            f"the camera looks at the board too flatly, {math.degrees(camera.tilt):.0f} degrees "
            f"from straight down; up to {math.degrees(MAX_TILT):.0f} it can be measured by"
        )
    last = inlier_views[-1]
    missed = camera.to_table(last.pixels) - scale * last.points[:, :2]
    rms_mm = 10 * math.sqrt(float((missed**2).sum(axis=1).mean()))
    markers = tuple(len(view.numbers) for view in inlier_views)
    alike = pictures - len(views)
    return Calibration(camera, last.board, bar, markers, rms, rms_mm, last.blur, left_out, alike)


def _different(views: Sequence[BoardView]) -> list[BoardView]:
    """Return the views without those that a later one repeats.

    A copy tells nothing that its original does not, and would make all seem surer than it is.
    """
    distinct: list[BoardView] = []
    for view in reversed(views):
        if not any(_alike(view, other) for other in distinct):
            distinct.append(view)
    return distinct[::-1]


def _alike(one: BoardView, other: BoardView) -> bool:
    """Return whether most markers are in the same places of two pictures."""
    common, in_one, in_other = np.intersect1d(one.numbers, other.numbers, return_indices=True)
    if one.board != other.board or 2 * len(common) < max(len(one.numbers), len(other.numbers)):
        return False
    off = one.pixels.reshape(-1, 4, 2)[in_one] - other.pixels.reshape(-1, 4, 2)[in_other]
    limit = SAME_VIEW_SHIFT * min(one.side, other.side)
    return bool(np.median(np.linalg.norm(off, axis=2)) < limit)


def _fit(views: Sequence[BoardView], scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit all views: the state, the residuals (n, 2), px, and the state's covariance."""
    points = [scale * view.points for view in views]
    unknowns = Unknowns(len(views), sheet=True)
    state = np.zeros(unknowns.count)
    guess = _first_guess(views, points)
    state[: len(guess)] = guess
    state, off, information = refine(views, points, state, unknowns)
    covariance = np.linalg.inv(information)
    tilts = [_tilt(state[unknowns.pose(k)][:3]) for k in range(len(views))]
    # Tilted by so little, a board looks like one that is printed a little askew: by its square a
    # tilt shortens, and what is linear at the best fit is so nowhere else.
    if max(tilts) < MIN_FOCAL_TILT:
        covariance = with_prior_focal(covariance, state)
    return state, off, covariance


def _tilt(turn: np.ndarray) -> float:
    """Return the angle between a view's axis and straight down, rad, from its rotation (3,)."""
    return math.acos(float(np.clip(-cv2.Rodrigues(turn)[0][2, 2], -1, 1)))


def _check_zoom(
    views: Sequence[BoardView], scale: float, state: np.ndarray, off: np.ndarray
) -> None:
    """Refuse views that one focal length for each of them fits far better than one for all.

    Args:
        views: of the board.
        scale: of the print.
        state: of the fit with one focal length.
        off: what that leaves over, (m, 2), px.
    """
    count = len(views)
    if count < 2:
        return
    points = [scale * view.points for view in views]
    unknowns = Unknowns(count, sheet=True, zooms=True)
    start = np.concatenate([state, np.zeros(count - 1)])
    own, left, information = refine(views, points, start, unknowns)
    before, after = (float((huber_weights(each) * each**2).sum()) for each in (off, left))
    free = max(left.size - len(own), left.size // 4)
    gain = (before - after) / (count - 1) / (after / free + MIN_SIGMA**2)
    zooms = np.append(own[unknowns.zoom], 0.0)
    covariance = np.zeros((count, count))
    covariance[:-1, :-1] = np.linalg.inv(information)[unknowns.zoom, unknowns.zoom]
    variances = np.diag(covariance)
    sigmas = np.sqrt(np.maximum(variances[:, None] + variances - 2 * covariance, 0.0))
    differences = np.abs(zooms[:, None] - zooms)
    if gain > MIN_ZOOM_F and (differences > np.maximum(MIN_ZOOM, MIN_ZOOM_SIGMAS * sigmas)).any():
        focals = own[0] * np.exp(zooms)
        raise BadCalibration(
            f"the pictures fit with a focal length each, from {focals.min():.0f} to "
            f"{focals.max():.0f} px, and not with one: the zoom or the focus was changed between "
            "them, or they were cropped or squeezed; leave all as it is, and take them anew"
        )


def _without_outliers(views: Sequence[BoardView], off: np.ndarray) -> list[BoardView]:
    """Return the views without the markers that are far off, (n, 2) px."""
    distances = np.linalg.norm(off, axis=1).reshape(-1, 4).max(axis=1)
    limit = max(OUTLIER_MEDIANS * float(np.median(distances)), OUTLIER_PX)
    ends = np.cumsum([len(view.numbers) for view in views])[:-1]
    inlier_views = []
    for view, near in zip(views, np.split(distances <= limit, ends), strict=True):
        corners = np.repeat(near, 4)
        inlier_views.append(
            replace(
                view,
                numbers=view.numbers[near],
                points=view.points[corners],
                pixels=view.pixels[corners],
            )
        )
    return inlier_views


def check_bar(bar: float | None) -> None:
    """Raise BadCalibration if a bar cannot be so long, mm; None: it was not measured."""
    if bar is not None and not BAR_LIMITS[0] <= bar <= BAR_LIMITS[1]:
        raise BadCalibration(
            f"bar {bar:g} mm: it is 100 mm long on paper; give its length as measured, "
            f"from {BAR_LIMITS[0]:g} to {BAR_LIMITS[1]:g}"
        )


def _check(views: Sequence[BoardView], bar: float | None) -> None:
    if not views:
        raise BadCalibration("no marker of the board is seen; show it whole, sharp and lit")
    check_bar(bar)
    if len({view.size for view in views}) > 1:
        sizes = ", ".join(sorted({f"{w}x{h}" for w, h in (view.size for view in views)}))
        if len({frozenset(view.size) for view in views}) == 1:
            raise BadCalibration(
                f"pictures of {sizes}: some are turned on their side; hold the camera alike for all"
            )
        raise BadCalibration(f"pictures of {sizes}: take all of one camera at one size")
    for view in views:
        count, every = len(view.numbers), len(view.board.numbers)
        if count < MIN_MARKERS:
            blurred = f" and blurred, by {view.blur:.1f} px" if view.blur > MAX_BLUR else ""
            raise BadCalibration(
                f"only {count} of the board's {every} markers are seen{blurred}; "
                f"{MIN_MARKERS} are the least: show more of it, sharp and lit"
            )
        if view.side < MIN_SIDE:
            raise BadCalibration(
                f"the board is too small in the picture: its markers are {view.side:.0f} px wide, "
                f"{MIN_SIDE:g} are the least; bring it nearer or take a larger picture"
            )
        if _on_a_line(view.points[:, :2]):
            raise BadCalibration(
                f"the {count} markers that are seen lie in one row, which does not tell how the "
                "board is turned; show one beside the row"
            )


def _on_a_line(xy: np.ndarray) -> bool:
    """Return whether points (n, 2), cm, lie within a marker's width of one line."""
    spread = np.linalg.svd(xy - xy.mean(axis=0), compute_uv=False)
    return bool(spread[1] / math.sqrt(len(xy)) < 1.0)


def _first_guess(views: Sequence[BoardView], points: Sequence[np.ndarray]) -> np.ndarray:
    """Return the state (8 + 6 n,): a lens without distortion, each view's rotation and shift."""
    width, height = views[0].size
    states, scores = [], []
    for share in (0.5, 0.7, 1.0, 1.4, 2.0):
        focal = share * max(width, height) / USUAL_FIELD
        lens = np.array([focal, (width - 1) / 2, (height - 1) / 2, 0, 0, 0, 0, 0])
        matrix = np.array([[focal, 0, lens[1]], [0, focal, lens[2]], [0, 0, 1]])
        state, score = [lens], 0.0
        for view, own in zip(views, points, strict=True):
            found, turns, shifts, errors = cv2.solvePnPGeneric(
                own[:, None], view.pixels[:, None], matrix, None, flags=cv2.SOLVEPNP_IPPE
            )
            if not found or not np.isfinite([*turns[0], *shifts[0]]).all():
                raise BadCalibration(
                    "what is seen does not fit a flat board: all of it in one place; show it anew"
                )
            state += [turns[0].ravel(), shifts[0].ravel()]
            score += float(np.ravel(errors)[0]) ** 2
        states.append(np.concatenate(state))
        # Views from straight above fit with all of them alike: then it is the usual one.
        scores.append(score / len(views) + 0.01 * math.log(share) ** 2)
    return states[int(np.argmin(scores))]
