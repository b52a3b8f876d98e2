"""Model of where a camera sees an arm's marker, by the numbers that make the arm.

A joint's link stands at

    theta = sign * (gear * e - side * (backlash / 2 - back + lag)) + zero

where back is by how much the motor went back after it had pushed the link there, but no more than
the backlash: so far the link does not follow.  And where sign is -1 for a joint that turns the
other way round than described, e is the motor's encoder's angle, gear the true turns over the
described ones, and side +1 or -1: the flank of its play on which the link rests, 0 between them.
The marker sits on the last link, `along` it and `aside` from it, seen from the pen's tip; so the
picture alone tells only the sum of the last link and `along`, and of its zero and `aside`.

All numbers are one vector, cm and rad; a camera's are standard normal ones, by the square root of
its covariance.  Each has a prior: what is believed before, and how firmly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from laptop.see.table.camera_model import CameraModel, projected
from shared.arm_description import Arm

LINK_SPREAD = 0.1
"""Standard deviation of a link from its description, a share of it."""
ZERO_SPREAD = math.radians(5)
BACKLASH_SPREAD = math.radians(5)
GEAR_SPREAD = 0.05
OFFSET_SPREAD = 1.0
"""Standard deviation of the marker's place beside the pen, cm: untouched it sits somewhere on the
last link's end."""
HEIGHT_SPREAD, GIVEN_HEIGHT_SPREAD = 2.0, 0.05
"""Standard deviations of the marker's height over the table, cm: not measured, and measured by a
ruler."""
USUAL_HEIGHT = 2.5
SQUARE_SPREAD = math.radians(0.3)
"""Standard deviation of the angle between a board's edge and the arm's x, rad."""
POSE_SPREAD = 100.0
"""Standard deviation of the arm's pose on the board, cm and rad: nothing is known."""
BASE_HEIGHT_SPREAD, TILT_SPREAD = 1.0, math.radians(3)
PHASE = 1 / math.sqrt(12)
"""Standard deviation of a shaft that stands anywhere within a count, counts."""
COUNT = math.radians(1)
LAG = (0.02, 0.06)
"""Lag of a link behind its motor beyond what the brick's observer believes, counts: mean and
standard deviation from arm to arm. It looks like backlash, and no more poses tell it from that."""
MAX_RETREAT_SHARE, RETREAT_LAG = 0.5, 0.2
"""Share of the rests beyond which a motor goes back so often that its link mostly runs on, too; and
the standard deviation of the lag there, counts."""
MIN_RETREAT = 0.4
"""Least angle behind its former place at which a motor counts as gone back, counts."""
SIGNS = (1, -1)
ANGLE_STEP = 1e-4
"""Step of a derivative by an angle, rad."""


class JointStates(NamedTuple):
    """State of the joints, each (n, joints).

    e      angles by the encoders, rad
    sides  flank on which each link was pushed: +1 by a motion upwards, -1, or 0: between them
    back   how far the motor has gone back since, rad; below 0 where it is believed not to have been
           so far
    """

    e: np.ndarray
    sides: np.ndarray
    back: np.ndarray


@dataclass(frozen=True, eq=False)
class CameraPrior:
    """Knowledge of a camera before the arm has moved.

    size  of the picture, px
    mean  lens, rotation and translation, (14,), see CameraModel
    root  (14, 14): mean + root @ z, with z standard normal, is the camera
    """

    size: tuple[int, int]
    mean: np.ndarray
    root: np.ndarray

    @classmethod
    def of(cls, camera: CameraModel) -> CameraPrior:
        """Take it from a calibrated camera."""
        values, vectors = np.linalg.eigh(camera.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        mean = np.concatenate([camera.lens, camera.rotation, camera.translation])
        return cls(camera.size, mean, root)

    def project(self, z: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points (n, 3), cm, by the camera's numbers (14,)."""
        c = self.mean + self.root @ z
        return projected(points, c[:8], c[8:11], c[11:])[0]

    def model(self, z: np.ndarray, covariance: np.ndarray | None = None) -> CameraModel:
        """Return the camera by its numbers (14,), with their covariance if it is given."""
        c = self.mean + self.root @ z
        spread = np.eye(14) if covariance is None else covariance
        return CameraModel(self.size, c[:8], c[8:11], c[11:], self.root @ spread @ self.root.T)


@dataclass(frozen=True)
class MeasuredByHand:
    """Measurements that somebody has made beside the camera.

    height       of the marker over the table, in space of the shoulder's axis, cm; None: not
                 measured
    square       the board's edge lies along the arm's x: its own x is turned from that by so many
                 quarters, counter-clockwise; None: it does not
    offset_sigma of the marker_offset in the arm's file, cm
    """

    height: float | None = None
    square: int | None = None
    offset_sigma: float = OFFSET_SPREAD


@dataclass(frozen=True, eq=False)
class ArmModel:
    """The numbers of one arm before cameras.

    arm       as described
    cameras   by name
    known     beside them
    signs     per joint: +1, or -1 if it turns the other way round than described
    run_on    per joint: whether its link mostly runs on where its motor stops
    """

    arm: Arm
    cameras: dict[str, CameraPrior]
    known: MeasuredByHand = field(default_factory=MeasuredByHand)
    signs: tuple[int, ...] = ()
    run_on: tuple[bool, ...] = ()
    names: tuple[str, ...] = field(init=False)
    mean: np.ndarray = field(init=False)
    spread: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        rows = list(self._rows())
        rows += [(f"{name}.{k}", 0.0, 1.0) for name in sorted(self.cameras) for k in range(14)]
        object.__setattr__(self, "names", tuple(name for name, _, _ in rows))
        object.__setattr__(self, "mean", np.array([mean for _, mean, _ in rows]))
        object.__setattr__(self, "spread", np.array([spread for _, _, spread in rows]))
        object.__setattr__(self, "signs", self.signs or (1,) * len(self.arm.joints))

    @property
    def spatial(self) -> bool:
        """Whether the arm is one in space."""
        return self.arm.chain == "spatial"

    def index(self, name: str) -> int:
        """Return the index of a number in the vector."""
        return self.names.index(name)

    def of_joints(self, state: np.ndarray, key: str) -> np.ndarray:
        """Return one of the joints' numbers, (joints,)."""
        return state[[self.index(f"{joint.name}.{key}") for joint in self.arm.joints]]

    def _rows(self) -> list[tuple[str, float, float]]:
        """Name, mean and standard deviation of each number but the cameras'."""
        joints, known = self.arm.joints, self.known
        rows: list[tuple[str, float, float]] = []
        for k, joint in enumerate(joints):
            link, link_spread = joint.link, LINK_SPREAD * joint.link
            if self.spatial and k == 0:  # that one is a height
                link_spread = BASE_HEIGHT_SPREAD
                if known.height is not None:
                    link, link_spread = known.height, GIVEN_HEIGHT_SPREAD
            lag_spread = RETREAT_LAG if self.run_on and self.run_on[k] else LAG[1]
            rows += [
                (f"{joint.name}.link", link, link_spread),
                (f"{joint.name}.zero", 0.0, ZERO_SPREAD),
                (f"{joint.name}.backlash", joint.backlash, BACKLASH_SPREAD),
                (f"{joint.name}.gear", 1.0, GEAR_SPREAD),
                (
                    f"{joint.name}.lag",
                    LAG[0] * COUNT / joint.gear,
                    lag_spread * COUNT / joint.gear,
                ),
            ]
        along, aside = self.arm.marker_offset
        rows += [("marker.along", along, known.offset_sigma)]
        rows += [("marker.aside", aside, known.offset_sigma)]
        turn, turn_spread = 0.0, POSE_SPREAD
        if known.square is not None:
            turn, turn_spread = -math.pi / 2 * known.square, SQUARE_SPREAD
        rows += [("board.turn", turn, turn_spread)]
        rows += [(f"board.{axis}", 0.0, POSE_SPREAD) for axis in "xy"]
        if self.spatial:
            rows += [(f"base.tilt_{axis}", 0.0, TILT_SPREAD) for axis in "xy"]
        elif known.height is None:
            rows += [("marker.height", USUAL_HEIGHT, HEIGHT_SPREAD)]
        else:
            rows += [("marker.height", known.height, GIVEN_HEIGHT_SPREAD)]
        return rows

    def least(self) -> np.ndarray:
        """Return the lower bounds of all numbers, in standard deviations of their priors, (m,)."""
        found = np.full(len(self.names), -np.inf)
        for joint in self.arm.joints:  # no link has less play than none
            k = self.index(f"{joint.name}.backlash")
            found[k] = -self.mean[k] / self.spread[k]
        return found

    # Where things are

    def links_at(self, state: np.ndarray, joint_states: JointStates) -> np.ndarray:
        """Angles of the links, rad, (n, joints)."""
        backlash = self.of_joints(state, "backlash")
        back = np.minimum(joint_states.back, np.maximum(backlash, 0.0))
        behind = backlash / 2 - back + self.of_joints(state, "lag")
        turned = self.of_joints(state, "gear") * joint_states.e - joint_states.sides * behind
        return np.array(self.signs) * turned + self.of_joints(state, "zero")

    def marker(self, state: np.ndarray, theta: np.ndarray) -> np.ndarray:
        """Places of the marker on the board, (n, 3), cm, with the links at theta (n, joints)."""
        links = self.of_joints(state, "link")
        along, aside = state[self.index("marker.along")], state[self.index("marker.aside")]
        if not self.spatial:
            heading = theta.sum(axis=1)
            flat = links[0] * np.exp(1j * theta[:, 0]) + (links[1] + along + 1j * aside) * np.exp(
                1j * heading
            )
            placed = self.placed(state, np.column_stack([flat.real, flat.imag]))
            height = state[self.index("marker.height")]
            return np.column_stack([placed, np.full(len(theta), height)])
        pitch = theta[:, 1] + theta[:, 2]
        profile = links[1] * np.exp(1j * theta[:, 1]) + (links[2] + along + 1j * aside) * np.exp(
            1j * pitch
        )
        out, up = profile.real, profile.imag
        points = np.column_stack(
            [out * np.cos(theta[:, 0]), out * np.sin(theta[:, 0]), links[0] + up]
        )
        tilt_x, tilt_y = state[self.index("base.tilt_x")], state[self.index("base.tilt_y")]
        # Small turns about x and y, exact in their product of two rotations.
        cx, sx, cy, sy = math.cos(tilt_x), math.sin(tilt_x), math.cos(tilt_y), math.sin(tilt_y)
        tilted = points @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
        tilted = tilted @ np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
        return np.column_stack([self.placed(state, tilted[:, :2]), tilted[:, 2]])

    def placed(self, state: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Points of the arm's frame, (n, 2), cm, on the board."""
        turn = state[self.index("board.turn")]
        c, s = math.cos(turn), math.sin(turn)
        base = state[[self.index("board.x"), self.index("board.y")]]
        return base + points @ np.array([[c, s], [-s, c]])

    def camera_numbers(self, state: np.ndarray, name: str) -> np.ndarray:
        """Return a camera's standard normal numbers, (14,)."""
        first = self.index(f"{name}.0")
        return state[first : first + 14]

    def pixels(self, state: np.ndarray, name: str, joint_states: JointStates) -> np.ndarray:
        """Pixels (n, 2) of the marker in one camera's picture."""
        points = self.marker(state, self.links_at(state, joint_states))
        return self.cameras[name].project(self.camera_numbers(state, name), points)

    def by_encoders(self, state: np.ndarray, name: str, joint_states: JointStates) -> np.ndarray:
        """Return derivatives of the pixels by the encoders' angles, (n, 2, joints), px/rad."""
        columns = []
        for unit in ANGLE_STEP * np.eye(joint_states.e.shape[1]):
            ends = [
                self.pixels(state, name, joint_states._replace(e=joint_states.e + sign * unit))
                for sign in SIGNS
            ]
            columns.append((ends[0] - ends[1]) / (2 * ANGLE_STEP))
        return np.stack(columns, axis=-1)

    def touched(
        self, state: np.ndarray, name: str, crosses: np.ndarray, elbows: np.ndarray
    ) -> np.ndarray:
        """Pixels (n, 2) of the marker while the pen of a planar arm stands on crosses.

        The links' angles follow from the crosses by the cosine rule; encoders have no part in it.

        Args:
            state: all numbers.
            name: of the camera.
            crosses: on the board, (n, 2), cm.
            elbows: +1 or -1, the sign of the elbow's angle, (n,).
        """
        turn = state[self.index("board.turn")]
        base = state[[self.index("board.x"), self.index("board.y")]]
        c, s = math.cos(turn), math.sin(turn)
        points = (crosses - base) @ np.array([[c, -s], [s, c]])
        upper, fore = self.of_joints(state, "link")
        far2 = (points**2).sum(axis=1)
        bend = elbows * np.arccos(np.clip((far2 - upper**2 - fore**2) / (2 * upper * fore), -1, 1))
        first = np.arctan2(points[:, 1], points[:, 0]) - np.arctan2(
            fore * np.sin(bend), upper + fore * np.cos(bend)
        )
        places = self.marker(state, np.column_stack([first, bend]))
        return self.cameras[name].project(self.camera_numbers(state, name), places)


def running_on(arm: Arm, joint_states: JointStates) -> tuple[bool, ...]:
    """Return per joint whether its link mostly runs on where its motor stops."""
    counts = np.array([COUNT / joint.gear for joint in arm.joints])
    share = (joint_states.back > MIN_RETREAT * counts).mean(axis=0)
    return tuple(bool(one) for one in share > MAX_RETREAT_SHARE)


def encoder_sigma(arm: Arm) -> np.ndarray:
    """Return the standard deviation of the encoders' angles, rad at the joint, (joints,)."""
    return np.array([PHASE * COUNT / joint.gear for joint in arm.joints])


def slopes(
    function: Callable[[np.ndarray], np.ndarray], state: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Return derivatives (n, m) of a function of the numbers (m,), by central differences."""
    columns = []
    for k, step in enumerate(steps):
        unit = np.zeros(len(state))
        unit[k] = step
        columns.append((function(state + unit) - function(state - unit)) / (2 * step))
    return np.stack(columns, axis=-1)
