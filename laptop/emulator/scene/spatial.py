"""The workcell of an arm in space."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from laptop.emulator.scene.hand import (
    HAND_DISTANCE,
    covered_place,
    hand_items,
    hand_outlines,
    hand_pass,
)
from laptop.emulator.scene.items import Item, cast_shadow, table_hull
from laptop.emulator.scene.marker_items import (
    beam_light,
    marker_items,
    marker_offset,
    shown_markers,
)
from laptop.emulator.scene.optics import Pinhole
from laptop.emulator.scene.planar import sampled_tips
from laptop.emulator.scene.scene_constants import CAMERAS, BadScene
from laptop.emulator.scene.skeleton import Skeleton, ball_stand
from laptop.emulator.scene.solids import Solid, ball, in_order
from robot.motion import chains, kinematics
from shared.arm_description import Arm

_AZIMUTHS = (60.0, -60.0, 120.0, -120.0, 180.0, 0.0)
"""Azimuths of the cameras from C on, deg."""
VIEWS = {
    "A": (15.0, 0.0),
    "B": (90.0, 0.0),
    **{name: (60.0, azimuth) for name, azimuth in zip(CAMERAS[2:], _AZIMUTHS)},
}
"""Tilt and azimuth of cameras on an arm in space, deg: from above, from the side, and askew."""

JOINT_SAMPLES = 13
"""Number of angles of each joint that are tried to find the workspace."""

HAND_ANGLE = math.radians(-112)
"""Direction in the picture, v down, in which the hand reaches out, rad."""


class SpatialWorkcell:
    """An arm that moves above its table: balls as markers, the goal on a stand, cameras all around.

    Args:
        arm: its description.
        constants: completed, see `workcell.workcell`.

    Attributes:
        usual_cameras: names of those that watch it if nothing is said.
        penumbra: softness of its shadows, which fall from high up, px.
        table_half_side: distance of the wall from the base, cm.
        clutter_area: two corners, reaches, between which bricks lie.
    """

    usual_cameras = "AB"
    penumbra = 4.0
    clutter_area = ((-1.7, -1.7), (1.7, 1.7))

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self.arm = arm
        self.constants = constants

    @staticmethod
    def defaults(camera: str) -> dict[str, Any]:
        """Return the constants that depend on the arm and the camera's name."""
        tilt, azimuth = VIEWS[camera]
        return {"tilt": tilt, "azimuth": azimuth, "marker": "ball", "goal_z": 9.0}

    @staticmethod
    def check(arm: Arm, constants: dict[str, Any]) -> None:
        """Refuse constants that do not suit this arm.

        Raises:
            BadScene
        """
        if constants["marker"] != "ball":
            raise BadScene(
                f"camera marker = {constants['marker']}: {arm.name} moves in space, where a flat"
                " marker is not seen from the side; write marker=ball"
            )

    @functools.cached_property
    def reach(self) -> float:
        """Greatest distance of the tip from the base, cm."""
        return float(chains.reach(self.arm)[1])

    @property
    def table_half_side(self) -> float:
        """Distance of the wall from the base, cm."""
        return 2.4 * self.reach

    @functools.cached_property
    def _marker_offset(self) -> np.ndarray:
        return marker_offset(self.arm, self.constants)

    @functools.cached_property
    def skeleton(self) -> Skeleton:
        """Bodies of the arm."""
        return Skeleton(self.arm, beam_light(self.constants), self.constants["marker_radius"])

    # Where things are

    def tip_marker(self, q: Sequence[float]) -> np.ndarray:
        """Return the centre (3,), cm, of the ball on the tip with the joints at q, rad."""
        base, *pitches = q
        pitch = sum(pitches)
        along, up = self._marker_offset
        out = along * math.cos(pitch) - up * math.sin(pitch)
        raised = along * math.sin(pitch) + up * math.cos(pitch)
        off = out * math.cos(base), out * math.sin(base), raised
        return np.asarray(np.array(kinematics.forward(self.arm, q)) + off)

    def goal_marker(self) -> np.ndarray:
        """Return the centre (3,), cm, of the ball on the stand."""
        c = self.constants
        return np.array([c["goal_x"], c["goal_y"], c["goal_z"]])

    def frame_points(self) -> np.ndarray:
        """Return points (n, 3), cm, that span the workspace with the marker at the tip."""
        wide = self.constants["marker_radius"] * 1.5
        corners = np.array([(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)])
        tips = sampled_tips(self.arm, JOINT_SAMPLES)
        tips = tips[tips[:, 2] >= 0]
        # The outermost in many directions stand for all of them.
        directions = np.random.default_rng(0).normal(size=(300, 3))
        tips = tips[np.unique((tips @ directions.T).argmax(axis=0))]
        cube = [np.c_[corners, np.full(4, z)] for z in (-wide, wide)]
        return np.asarray((tips[:, None] + np.concatenate(cube)).reshape(-1, 3))

    # How a camera aims at it: at the middle of the workspace

    @staticmethod
    def aim_start(points: np.ndarray) -> np.ndarray:
        """Return the first aim (3,), cm, of a camera that is to show points (n, 3)."""
        return points.mean(axis=0)

    @staticmethod
    def aim_step(step: np.ndarray, tilt: float) -> np.ndarray:
        """Return the step (3,), cm, of the aim for one across the picture; `tilt` in rad."""
        return step

    @staticmethod
    def can_aim(camera: Pinhole, points: np.ndarray, distance: float) -> bool:
        """Return whether a camera finds the middle of points: it must not be too near.

        Args:
            camera: that is to be aimed.
            points: (n, 3), that it is to show, cm.
            distance: to what it aims at, cm.
        """
        return bool(camera.seen(points)[:, 2].min() >= distance / 4)

    # What is painted

    def static_items(self, camera: Pinhole) -> list[Item]:
        """Return nothing: arm and goal may hide one another, so both are painted anew."""
        return []

    def fixtures(self) -> list[tuple[list[Item], np.ndarray]]:
        """Return nothing: the arm's foot is one of its bodies."""
        return []

    def keeps_clear(self, at: np.ndarray) -> bool:
        """Return True at a place (2,), cm, where a brick could hide the arm or its goal."""
        return bool(np.linalg.norm(at) < 1.15 * self.reach)

    def moving_items(self, q: Sequence[float], t: float, camera: Pinhole) -> list[Item]:
        """Return the items of arm, goal, shadow and perhaps a hand, each after those it hides."""
        solids = self._solids(q, camera)
        items = [item for solid in solids for item in solid.items]
        if self.constants["shadow"]:
            bodies = [np.concatenate(solid.items[0].rings) for solid in solids]
            fallen = [table_hull(cast_shadow(points)) for points in bodies]
            items.insert(0, Item(fallen, self.constants["shadow"], "shadow"))
        return items + self._hand(q, t, camera)

    def _solids(self, q: Sequence[float], camera: Pinhole) -> list[Solid]:
        """Return all bodies with the joints at q, rad, each after those that it can hide."""
        eye, radius = camera.position, self.constants["marker_radius"]

        def marker(name: str, centre: np.ndarray) -> Solid:
            return ball(*marker_items(self.constants, name, centre, 0.0, camera))

        tip = self.tip_marker(q)
        groups = [[*self.skeleton.solids(q, eye), marker("effector", tip)]]
        if "goal" in shown_markers(self.constants):
            place = self.goal_marker()
            goal = [*ball_stand(place, radius, eye), marker("goal", place)]
            # Where the balls are inside one another, the tip's is over the goal's, as in the plane.
            met = math.dist(tip, place) < 2 * radius
            groups = [goal, *groups] if met else [goal + groups[0]]
        return [solid for group in groups for solid in in_order(group, camera)]

    def _hand(self, q: Sequence[float], t: float, camera: Pinhole) -> list[Item]:
        """Return a hand that comes from above in the picture, in front of everything."""
        moment = hand_pass(self.constants, t)
        if moment is None:
            return []
        target = covered_place(moment, self.constants, self.tip_marker(q))
        ahead = np.array([math.cos(HAND_ANGLE), math.sin(HAND_ANGLE)])
        palm = 0 - (1 - moment.share) * HAND_DISTANCE * self.reach * ahead
        right, down, _ = camera.rotation
        axes = np.array([right, -down])
        outlines = hand_outlines(self.constants, palm, HAND_ANGLE)
        return hand_items([target + outline[:, :2] @ axes for outline in outlines])
