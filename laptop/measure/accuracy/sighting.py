"""From a marker's pixels to the tip's place in the arm's frame, with its uncertainty.

The board lies on the table and so does the arm: between their frames there are a turn and a shift.
Lengths are cm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from laptop.measure.run_data import MAD_TO_SIGMA, MEDIAN_NOISE, SETTLED_SHARE, RunData
from laptop.see.serve.joint_track import marker_shift
from laptop.see.table.camera_model import CameraModel, triangulate
from laptop.see.table.plane_motion import nearest_motion, rotation
from robot.motion import kinematics
from shared.arm_description import Arm, ArmError

PIXEL_STEP, SIGMA_STEP = 0.5, 0.1
"""Steps of numerical derivatives: px, and standard deviations of the calibration."""
MIN_VARIANCE_SHARE = 1e-9
"""Share of the calibration's greatest variance below which one counts as zero."""


class BadSighting(ArmError, ValueError):
    """Error: the cameras do not determine where the tip is."""


class Places(NamedTuple):
    """Places of the tip, in the arm's frame.

    points  (n, d), cm; nan where that is not known
    noise   covariance of each by its own pixels' noise, (n, d, d), cm^2
    common  derivatives by what one run's places have in common, (n, d, c), cm: the calibration's
            errors, as independent standard normal numbers
    """

    points: np.ndarray
    noise: np.ndarray
    common: np.ndarray

    def at(self, chosen: np.ndarray | slice) -> Places:
        """Return some of them."""
        return Places(self.points[chosen], self.noise[chosen], self.common[chosen])

    def mapped(self, matrix: np.ndarray, shift: np.ndarray) -> Places:
        """Return them in another frame: x to matrix x + shift."""
        return Places(
            self.points @ matrix.T + shift,
            matrix @ self.noise @ matrix.T,
            matrix @ self.common,
        )


class SeenMarker(NamedTuple):
    """Places of the marker on the board, and the joints by their encoders, rad, (n, joints)."""

    places: Places
    q: np.ndarray


@dataclass(frozen=True, eq=False)
class BoardArmPose:
    """Pose of the arm on the board: both lie on the table.

    turn  of the arm's x from the board's, rad
    base  the arm's origin on the board, (2,), cm
    """

    turn: float = 0.0
    base: tuple[float, float] = (0.0, 0.0)

    def in_arm(self, places: Places) -> Places:
        """Return places of the board's frame in the arm's."""
        matrix = rotation(-self.turn, places.points.shape[1])
        return places.mapped(matrix, -matrix[:, :2] @ np.array(self.base))


@dataclass(frozen=True, eq=False)
class ArmSighting:
    """Cameras that look at an arm's marker.

    arm      as described; its marker_offset is taken off
    cameras  calibrated, by name: one for an arm in the plane, two for one in space
    height   of the marker over the tip, cm
    """

    arm: Arm
    cameras: Mapping[str, CameraModel]
    height: float = 0.0

    def __post_init__(self) -> None:
        check_cameras(self.arm, len(self.cameras))

    def sigma(self, run: RunData) -> dict[str, float]:
        """Return each camera's noise: standard deviation of one coordinate in one picture, px.

        From how pictures of an arm at rest differ, all rests together.
        """
        return {name: _noise(run, name) for name in self.cameras}

    def at_rest(self, run: RunData, sigma: Mapping[str, float]) -> SeenMarker:
        """Return where the marker was at each rest.

        Args:
            run: of a job with rests.
            sigma: of one picture, by camera, px.
        """
        rests = {name: run.rests(name) for name in self.cameras}
        q = next(iter(rests.values())).q
        spread = {
            name: sigma[name] * np.where(rest.seen > 2, MEDIAN_NOISE, 1.0)
            / np.sqrt(np.maximum(rest.seen, 1))
            for name, rest in rests.items()
        }  # fmt: skip
        pixels = {name: rest.pixel for name, rest in rests.items()}
        return SeenMarker(self._places(pixels, spread), q)

    def along_strokes(self, run: RunData, sigma: Mapping[str, float]) -> list[SeenMarker]:
        """Return where the marker was in each picture along each stroke, the strokes in order.

        Of several cameras, those of the others are taken at the first one's times.
        """
        strokes = sorted({row.stroke for row in run.rows})
        rows = [row for row in run.rows if not row.rest]
        t_log = np.array([row.t for row in rows])
        ends = {row.stroke: row.t - run.rest for row in run.rows if row.rest}
        begins: dict[int, float] = {}
        for row in rows:
            begins.setdefault(row.stroke, row.t)
        first, *others = self.cameras
        found = []
        for stroke in strokes:
            if stroke not in begins or stroke not in ends:
                raise BadSighting(
                    f"the brick has logged nothing along stroke {stroke}; do the run again"
                )
            sights = run.sights[first]
            along = (sights.t >= begins[stroke]) & (sights.t <= ends[stroke])
            t = sights.t[along]
            pixels = {first: sights.pixels[along]}
            for name in others:
                if not len(run.sights[name].t):
                    raise BadSighting(f"camera {name} has not seen the marker; look at its picture")
                pixels[name] = _between(run.sights[name].t, run.sights[name].pixels, t)
            columns = zip(*(row.q for row in rows), strict=True)
            q = np.stack([np.interp(t, t_log, column) for column in columns], axis=1)
            spread = {name: np.full(len(t), sigma[name]) for name in self.cameras}
            found.append(SeenMarker(self._places(pixels, spread), q))
        return found

    def _places(self, pixels: Mapping[str, np.ndarray], sigma: Mapping[str, np.ndarray]) -> Places:
        """Return the marker's places on the board from pixels (n, 2) and their sigma (n,)."""
        cameras, pixels = dict(self.cameras), dict(pixels)
        points = self._marker(cameras, pixels)
        n, d = points.shape
        noise = np.zeros((n, d, d))
        for name, k in [(name, k) for name in cameras for k in (0, 1)]:
            step = PIXEL_STEP * np.eye(2)[k]
            ends = [
                self._marker(cameras, {**pixels, name: pixels[name] + sign * step})
                for sign in (1, -1)
            ]
            by_pixel = (ends[0] - ends[1]) / (2 * PIXEL_STEP) * sigma[name][:, None]
            noise += by_pixel[:, :, None] * by_pixel[:, None, :]
        common = []
        for name, camera in cameras.items():
            for column in _roots(camera.covariance):
                ends = [
                    self._marker({**cameras, name: _moved(camera, s * column)}, pixels)
                    for s in (SIGMA_STEP, -SIGMA_STEP)
                ]
                common.append((ends[0] - ends[1]) / (2 * SIGMA_STEP))
        stack = np.stack(common, axis=-1) if common else np.zeros((n, d, 0))
        return Places(points, noise, stack)

    def _marker(
        self, cameras: Mapping[str, CameraModel], pixels: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """Return where the marker is on the board, (n, d), cm."""
        names = list(cameras)
        if len(names) == 1:
            return cameras[names[0]].to_table(pixels[names[0]], self.height)
        one, other = names
        return triangulate(cameras[one], cameras[other], pixels[one], pixels[other])[0]

    def offsets(self, q: np.ndarray) -> np.ndarray:
        """Return the vector from the tip to its marker in the arm's frame, (n, d), cm."""
        shifts = [marker_shift(self.arm, pose) for pose in q.tolist()]
        return np.array(shifts).reshape(len(q), kinematics.coordinates(self.arm))

    def tip(self, seen: SeenMarker, arm_pose: BoardArmPose) -> Places:
        """Return where the tip was, in the arm's frame."""
        places = arm_pose.in_arm(seen.places)
        return places._replace(points=places.points - self.offsets(seen.q))

    def arm_pose(self, seen: SeenMarker, commanded: np.ndarray) -> BoardArmPose:
        """Find how the arm stands on the board, from where it was sent (n, d), cm.

        The rigid motion by which the marker's places come nearest, after W. Kabsch (1976).  What
        is so fitted accuracy tells no more of.
        """
        finite = np.isfinite(seen.places.points).all(axis=1)
        arm_points = (commanded + self.offsets(seen.q))[finite, :2]
        board_points = seen.places.points[finite, :2]
        return nearest_arm_pose(board_points, arm_points)


def check_cameras(arm: Arm, count: int) -> None:
    """Raise BadSighting unless so many cameras determine where the arm's tip is."""
    needed = 1 if kinematics.coordinates(arm) == 2 else 2
    if count != needed:
        raise BadSighting(
            f"{count} camera{'s' if count > 1 else ''}: an arm "
            f"{'in the plane needs one' if needed == 1 else 'in space needs two'}; give "
            f"{'one' if needed == 1 else 'two'}"
        )


def nearest_arm_pose(board_points: np.ndarray, arm_points: np.ndarray) -> BoardArmPose:
    """Return the arm's pose by which the board's points (n, 2) come nearest to the arm's."""
    return BoardArmPose(*nearest_motion(arm_points, board_points))


def without_common_error(places: Places, poses: Places) -> Places:
    """Return places without those common errors that a fitted pose of the arm takes up.

    Args:
        places: in the arm's frame.
        poses: at which the arm's pose was fitted; only their errors in common are looked at.
    """
    poses = poses.at(np.isfinite(poses.points).all(axis=1))
    motions = _rigid(poses.points).reshape(-1, 3)
    common = poses.common.reshape(len(motions), -1)
    absorbed, *_ = np.linalg.lstsq(motions, common, rcond=None)
    return places._replace(common=places.common - _rigid(places.points) @ absorbed)


def _rigid(points: np.ndarray) -> np.ndarray:
    """Return how points (n, d) move by a shift along x, along y and a turn, (n, d, 3)."""
    moved = np.zeros((*points.shape, 3))
    moved[:, 0, 0] = moved[:, 1, 1] = 1.0
    moved[:, 0, 2], moved[:, 1, 2] = -points[:, 1], points[:, 0]
    return moved


def _noise(run: RunData, camera: str) -> float:
    sights = run.sights[camera]
    deviations = []
    for row in run.rows:
        if not row.rest:
            continue
        in_rest = (sights.t > row.t - SETTLED_SHARE * run.rest) & (sights.t <= row.t)
        seen = sights.pixels[in_rest]
        seen = seen[np.isfinite(seen).all(axis=1)]
        if len(seen) > 2:
            # (Of n values the mean takes one degree of freedom.)
            deviations.append((seen - seen.mean(axis=0)) * np.sqrt(len(seen) / (len(seen) - 1)))
    if not deviations:
        raise BadSighting(
            f"camera {camera} saw the marker in hardly a picture while the arm stood: show it the "
            "arm's whole way, and give it light"
        )
    return float(MAD_TO_SIGMA * np.median(np.abs(np.concatenate(deviations))))


def _between(t: np.ndarray, pixels: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return pixels (n, 2) seen at times t at other times; nan beside those that are missing."""
    return np.stack([np.interp(at, t, column) for column in pixels.T], axis=1)


def _roots(covariance: np.ndarray) -> np.ndarray:
    """Return rows (c, 14) whose outer products sum up to the covariance."""
    values, vectors = np.linalg.eigh(covariance)
    significant = values > MIN_VARIANCE_SHARE * max(float(values[-1]), 1e-300)
    return np.asarray((vectors[:, significant] * np.sqrt(values[significant])).T)


def _moved(camera: CameraModel, by: np.ndarray) -> CameraModel:
    return replace(
        camera,
        lens=camera.lens + by[:8],
        rotation=camera.rotation + by[8:11],
        translation=camera.translation + by[11:],
    )
