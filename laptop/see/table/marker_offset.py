"""Offset of the marker from the pen, found by touching printed crosses.

The pen is set on six to nine crosses of the board.  Each time three things are known: where the
cross is on the board, where the joints have the pen in the arm's own frame, and at which pixel the
marker is seen.  From these follow how the arm stands on the board, at which height the marker
rides, and where it sits on the last link.

In the plane a link's frame has x along the link and y to its left.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from laptop.see.table.camera_model import CameraModel
from laptop.see.table.plane_motion import nearest_motion, rotation
from shared.arm_description import ArmError

MIN_TOUCHES = 6
"""Least number of touches: of four none is redundant, so that no slip would be seen."""
PLACING_SIGMA = 0.03
"""Sigma with which a hand sets a pen on a cross, cm."""
JOINTS_SIGMA = 0.05
"""Sigma with which the joints tell where that is, cm: backlash, and a degree's fraction."""
PIXEL_SIGMA = 0.1
"""Sigma of a marker in the picture, px."""
USUAL_HEIGHT, HEIGHT_SPREAD = 2.5, 3.0
"""Prior of a marker's height over the paper: mean and sigma, cm."""
GIVEN_HEIGHT_SPREAD = 0.05
"""Sigma of a height that was measured, cm."""
SCALE_SPREAD = 0.05
"""Sigma of the ratio of print to links."""
CHANCE_SIGMAS = 3.0
"""Number of standard deviations up to which a difference is chance."""
REPORTED_SCALE_ERROR = 0.007
"""Relative disagreement in scale from which it is reported."""
UNSURE_OFFSET = 0.1
"""Standard deviation of the offset above which it is called unsure, cm."""


class BadTouches(ArmError, ValueError):
    """Touches from which no offset can be had."""


class Touch(NamedTuple):
    """One touch of a cross with the pen.

    cross    where it is on the board, (x, y), cm
    tip      where the joints have the pen, (x, y) in the arm's frame, cm
    heading  of the last link in the arm's frame, rad
    pixel    of the marker's centre, (u, v), px
    """

    cross: tuple[float, float]
    tip: tuple[float, float]
    heading: float
    pixel: tuple[float, float]


@dataclass(frozen=True, eq=False)
class MarkerFit:
    """The marker's offset, and the arm's pose on the board.

    offset   from the pen's tip, in the last link's frame, (2,), cm
    height   over the paper, cm
    turn     of the arm's x from the board's, rad
    base     the arm's origin on the board, (2,), cm
    scale    the crosses' distances over those that the joints have
    covariance  (7, 7), of turn, base, scale, offset, height
    rms_mm   what is left over between marker and cross, mm
    """

    offset: np.ndarray
    height: float
    turn: float
    base: np.ndarray
    scale: float
    covariance: np.ndarray
    rms_mm: float

    @property
    def offset_sigma(self) -> float:
        """Standard deviation of the offset, the larger one of its two directions, cm."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[4:6, 4:6])[-1]))

    @property
    def height_sigma(self) -> float:
        """Standard deviation of the height, cm."""
        return float(np.sqrt(self.covariance[6, 6]))

    def pen(self, camera: CameraModel, pixels: np.ndarray, headings: np.ndarray) -> np.ndarray:
        """Return the pen's place on the board, (n, 2), cm, from the marker's pixels.

        Args:
            camera: the one that sees it.
            pixels: (n, 2).
            headings: of the last link in the arm's frame, rad, (n,).
        """
        marker = camera.to_table(pixels, self.height)
        return np.asarray(marker - turned(self.turn + np.asarray(headings), self.offset))

    def on_board(self, tips: np.ndarray) -> np.ndarray:
        """Return points of the arm's frame, (n, 2), cm, on the board."""
        return self.base + self.scale * np.asarray(tips) @ rotation(self.turn).T

    def notes(self) -> list[str]:
        """Return notes for people, one a line."""
        x, y = 10 * self.offset
        lines = [
            f"the marker sits {x:.1f} mm along the last link from the pen and {y:.1f} mm to its "
            f"left, to {10 * self.offset_sigma:.1f} mm (sigma): marker_offset = "
            f"{self.offset[0]:.2f} {self.offset[1]:.2f}",
            f"it rides {10 * self.height:.1f} mm over the paper, to "
            f"{10 * self.height_sigma:.1f} mm",
        ]
        off, sigma = self.scale - 1, math.sqrt(self.covariance[3, 3])
        if abs(off) > max(REPORTED_SCALE_ERROR, CHANCE_SIGMAS * sigma):
            nearer = "nearer together" if off > 0 else "farther apart"
            lines.append(
                f"by the arm's measure the crosses are {100 * abs(1 / self.scale - 1):.1f} % "
                f"{nearer} than the board says: a bar of {100 / self.scale:.1f} mm would explain "
                "it (measure it, --bar), or links that are not as the arm's file says"
            )
        if self.offset_sigma > UNSURE_OFFSET:
            lines.append(
                "the last link pointed much the same way at all crosses: "
                "touch crosses that lie around the arm"
            )
        return lines


def turned(angles: np.ndarray, vector: Sequence[float] | np.ndarray) -> np.ndarray:
    """Turn a vector (2,) by each of some angles (n,), rad: (n, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    x, y = vector
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def fit_marker(
    camera: CameraModel,
    touches: Sequence[Touch],
    height: float | None = None,
    placing: float = PLACING_SIGMA,
    joints: float = JOINTS_SIGMA,
) -> MarkerFit:
    """Find where the marker sits on the last link.

    Args:
        camera: calibrated by the board on which the crosses are.
        touches: of six crosses or more.
        height: of the marker over the paper, cm, if it was measured; None: it is fitted.
        placing: error with which the pen was set on the crosses, cm.
        joints: error with which the joints tell where that was, cm; of an arm that was led by
            hand most of it is play.

    Raises:
        BadTouches: too few, or one does not fit the others.
    """
    if len(touches) < MIN_TOUCHES:
        raise BadTouches(
            f"{len(touches)} crosses were touched; {MIN_TOUCHES} are the least, 9 are better"
        )
    if len({touch.cross for touch in touches}) < MIN_TOUCHES:
        raise BadTouches(f"touch {MIN_TOUCHES} different crosses, not the same ones again")
    values = np.array([(*t.cross, *t.tip, t.heading, *t.pixel) for t in touches])
    if not np.isfinite(values).all():
        raise BadTouches("a touch holds what is no number: touch all crosses anew")
    problem = _Problem(camera, touches, height, placing, joints)
    state, surprise, information = problem.solve(range(len(touches)))
    # Of each touch 4 numbers; 7 are fitted.
    if surprise.sum() / (4 * len(touches) - 7) > CHANCE_SIGMAS:
        raise problem.outlier(surprise)
    seen = camera.to_table(values[:, 5:], state[6])
    crosses = values[:, :2] + turned(state[0] + values[:, 4], state[4:6])
    rms = 10 * math.sqrt(float(((seen - crosses) ** 2).sum(axis=1).mean()))
    return MarkerFit(
        state[4:6], state[6], state[0], state[1:3], state[3], np.linalg.inv(information), rms
    )


class _Problem:
    """Least squares over turn, base (2), scale, offset (2) and height."""

    def __init__(
        self,
        camera: CameraModel,
        touches: Sequence[Touch],
        height: float | None,
        placing: float,
        joints: float,
    ) -> None:
        self.camera = camera
        self.crosses = np.array([touch.cross for touch in touches])
        self.tips = np.array([touch.tip for touch in touches])
        self.headings = np.array([touch.heading for touch in touches])
        self.pixels = np.array([touch.pixel for touch in touches])
        self.height = USUAL_HEIGHT if height is None else height
        self.spreads = (SCALE_SPREAD, HEIGHT_SPREAD if height is None else GIVEN_HEIGHT_SPREAD)
        # The pen's distance from the cross is in both of a touch's residuals.
        pixel = PIXEL_SIGMA / camera.px_per_cm(self.crosses, self.height)
        if not np.isfinite(camera.to_table(self.pixels, self.height)).all():
            raise BadTouches("a marker was seen where no table is: touch all crosses anew")
        self.whiten = []
        for sigma in pixel:
            covariance = np.array(
                [[placing**2 + joints**2, placing**2], [placing**2, placing**2 + sigma**2]]
            )
            self.whiten.append(np.linalg.inv(np.linalg.cholesky(covariance)))

    def residuals(self, state: np.ndarray, chosen: Sequence[int]) -> np.ndarray:
        """Return the residuals (4 n + 2,) in standard deviations; the last two are the priors'."""
        turn, base, scale, offset, height = state[0], state[1:3], state[3], state[4:6], state[6]
        k = list(chosen)
        tips = base + scale * self.tips[k] @ rotation(turn).T
        by_joints = self.crosses[k] - tips
        marker = self.camera.to_table(self.pixels[k], height)
        by_camera = self.crosses[k] - marker + turned(turn + self.headings[k], offset)
        both = np.stack([by_joints, by_camera], axis=1)
        white = np.array([self.whiten[i] @ pair for i, pair in zip(k, both, strict=True)])
        priors = [(scale - 1) / self.spreads[0], (height - self.height) / self.spreads[1]]
        return np.concatenate([white.ravel(), priors])

    def solve(self, chosen: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Fit to some touches.

        Returns:
            The state (7,), by touch its squared residuals (n,), and the information matrix (7, 7).
        """
        k = list(chosen)
        turn, base = nearest_motion(self.tips[k], self.crosses[k])
        state = np.array([turn, *base, 1.0, 0.0, 0.0, self.height])
        fit = least_squares(self.residuals, state, "3-point", x_scale="jac", xtol=1e-12, args=(k,))
        surprise = (fit.fun[:-2].reshape(len(k), 4) ** 2).sum(axis=1)
        return fit.x, surprise, fit.jac.T @ fit.jac

    def outlier(self, surprise: np.ndarray) -> BadTouches:
        """Return a hint at the outlier among the touches, or that there is none."""
        count = len(self.crosses)
        best, by = math.inf, 0
        for left_out in range(count):
            _, rest, _ = self.solve([k for k in range(count) if k != left_out])
            if rest.sum() < best:
                best, by = float(rest.sum()), left_out
        if best / (4 * (count - 1) - 7) < CHANCE_SIGMAS:
            x, y = self.crosses[by]
            return BadTouches(
                f"the touch of the cross at {x:g}, {y:g} cm does not fit the others: was it this "
                "one, and did the pen stand on it? touch it anew"
            )
        off = math.sqrt(float(surprise.mean()) / 4)
        return BadTouches(
            f"the touches do not fit one another, {off:.0f} times worse than a careful hand: "
            "home the arm, check that camera and board have not moved, and touch all crosses anew"
        )
