"""The workcell of an arm in the plane over its paper."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from laptop.emulator.scene.hand import (
    HAND_DISTANCE,
    covered_place,
    hand_items,
    hand_outlines,
    hand_pass,
)
from laptop.emulator.scene.items import (
    BEAM_HALF_WIDTH,
    GREY,
    HOLE_SHARE,
    SIDE_SHARE,
    Item,
    block,
    cast_shadow,
    place_outline,
    stadium,
    table_hull,
)
from laptop.emulator.scene.marker_items import (
    beam_light,
    marker_items,
    marker_lift,
    marker_offset,
    outer_radius,
    shown_markers,
)
from laptop.emulator.scene.optics import Pinhole, circle, light_of, rectangle
from laptop.emulator.scene.scene_constants import BadScene
from robot.motion import chains, kinematics
from shared.arm_description import Arm

MAX_TILT = 85.0
"""Greatest tilt of a camera that can see flat markers, deg."""

JOINT_SAMPLES = 25
"""Number of angles of each joint that are tried to find the workspace."""

PEN_RADIUS = 0.28
"""Radius of the pen, cm."""

DARK = light_of("#4a4d51")
"""Light (3,), B, G, R, of pen and pins."""

HAND_ANGLE = math.radians(112)
"""Direction on the table in which the hand reaches out, rad."""


class PlanarWorkcell:
    """An arm that moves over its paper: flat markers, the goal on the paper, a camera above.

    Args:
        arm: its description.
        constants: completed, see `workcell.workcell`.

    Attributes:
        usual_cameras: names of those that watch it if nothing is said.
        penumbra: softness of its shadows, px.
        table_half_side: distance of the wall from the base, cm.
        clutter_area: two corners, reaches, between which bricks lie.
    """

    usual_cameras = "A"
    penumbra = 2.0
    table_half_side = math.inf
    clutter_area = ((-1.6, -1.1), (1.7, 1.2))

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self.arm = arm
        self.constants = constants

    @staticmethod
    def defaults(camera: str) -> dict[str, Any]:
        """Return the constants that depend on the arm and the camera's name."""
        return {"tilt": 25.0, "azimuth": 0.0, "marker": "disc", "goal_z": 0.0}

    @staticmethod
    def check(arm: Arm, constants: dict[str, Any]) -> None:
        """Refuse constants that do not suit this arm.

        Raises:
            BadScene
        """
        if constants["goal_z"]:
            raise BadScene(
                f"camera goal_z = {constants['goal_z']:g}: {arm.name} moves in the plane, and its"
                " goal lies on the paper; leave goal_z out"
            )
        if constants["tilt"] > MAX_TILT:
            raise BadScene(
                f"camera tilt = {constants['tilt']:g}: must be at most {MAX_TILT:g} deg for"
                f" {arm.name}, whose markers lie flat"
            )

    @functools.cached_property
    def reach(self) -> float:
        """Greatest distance of the tip from the base, cm."""
        return float(chains.reach(self.arm)[1])

    @functools.cached_property
    def _beam_light(self) -> np.ndarray:
        return beam_light(self.constants)

    @functools.cached_property
    def _marker_offset(self) -> np.ndarray:
        return marker_offset(self.arm, self.constants)

    # Where things are

    def tip_marker(self, q: Sequence[float]) -> np.ndarray:
        """Return the centre (3,), cm, of the marker on the tip with the joints at q, rad."""
        c = self.constants
        heading = sum(q)
        x, y = kinematics.forward(self.arm, q)
        along, left = self._marker_offset
        x += along * math.cos(heading) - left * math.sin(heading)
        y += along * math.sin(heading) + left * math.cos(heading)
        return np.array([x, y, c["marker_height"] + marker_lift(c)])

    def goal_marker(self) -> np.ndarray:
        """Return the centre (3,), cm, of the marker on the paper."""
        c = self.constants
        return np.array([c["goal_x"], c["goal_y"], c["goal_z"] + marker_lift(c)])

    def frame_points(self) -> np.ndarray:
        """Return points (n, 3), cm, that span the workspace with the marker at the tip.

        They are every corner of the widest marker, at the tip's and at the paper's height.
        """
        wide = self.constants["marker_radius"] * 1.5
        corners = np.array([(-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide)])
        tips = sampled_tips(self.arm, JOINT_SAMPLES)
        outline = cv2.convexHull(tips.astype(np.float32)).reshape(-1, 2).astype(float)
        around = (outline[:, None] + corners).reshape(-1, 2)
        heights = 0.0, self.constants["marker_height"]
        return np.concatenate([np.c_[around, np.full(len(around), z)] for z in heights])

    # How a camera aims at it: at the table, on which a step sideways is longer than in the picture

    @staticmethod
    def aim_start(points: np.ndarray) -> np.ndarray:
        """Return the first aim (3,), cm, of a camera that is to show points (n, 3)."""
        return points.mean(axis=0) * (1, 1, 0)

    @staticmethod
    def aim_step(step: np.ndarray, tilt: float) -> np.ndarray:
        """Return the step (3,), cm, of the aim for one across the picture; `tilt` in rad."""
        return np.asarray(step / np.array([1.0, max(0.2, math.cos(tilt)), math.inf]))

    @staticmethod
    def can_aim(camera: Pinhole, points: np.ndarray, distance: float) -> bool:
        """Return True: every distance lets a camera find the middle."""
        return True

    # What is painted

    def static_items(self, camera: Pinhole) -> list[Item]:
        """Return the items of the marker on the paper, which is painted once."""
        if "goal" not in shown_markers(self.constants):
            return []
        return marker_items(self.constants, "goal", self.goal_marker(), 0.0, camera)

    def fixtures(self) -> list[tuple[list[Item], np.ndarray]]:
        """Return the shoulder's blocks on the table, each with its place (3,), cm."""
        body = rectangle(-6.5, -1.5, 1.3, 1.5, 3)
        height = 0.28 * self.constants["marker_height"]
        return [(block(body, (0, 0), 0.0, height, GREY), np.zeros(3))]

    def keeps_clear(self, at: np.ndarray) -> bool:
        """Return True if nothing may lie at a place (2,), cm."""
        return False

    def moving_items(self, q: Sequence[float], t: float, camera: Pinhole) -> list[Item]:
        """Return the items of arm, shadow, marker and perhaps a hand, the topmost last."""
        base, *middle = [np.array(p[:2]) for p in kinematics.joint_positions(self.arm, q)]
        joints = [base, *middle]
        tip, before = joints[-1], joints[-2]
        items, shadows = self._links(joints)
        angle = math.atan2(tip[1] - before[1], tip[0] - before[0])
        marker = self.tip_marker(q)
        items += marker_items(self.constants, "effector", marker, angle, camera)
        disc = circle(outer_radius(self.constants), 32)
        shadows.append(cast_shadow(place_outline(disc, marker, 0, self.constants["marker_height"])))
        hand = self._hand(marker, t)
        shadows += [cast_shadow(item.rings[0]) for item in hand]
        items += hand
        if self.constants["shadow"]:
            items.insert(0, Item(shadows, self.constants["shadow"], "shadow"))
        return items

    def _links(self, joints: Sequence[np.ndarray]) -> tuple[list[Item], list[np.ndarray]]:
        """Return the links between joints (2,), cm, and the rings of their shadows."""
        h = self.constants["marker_height"]
        light = self._beam_light
        tip = joints[-1]
        items: list[Item] = []
        shadows: list[np.ndarray] = []
        count = len(joints) - 1
        # Each link lies on the one before it, the last just under the marker.
        levels = [h * (0.28 + 0.68 * k / count) for k in range(count)]
        thick = 0.6 * h / count
        for k, (a, b) in enumerate(zip(joints, joints[1:])):
            length = float(np.linalg.norm(b - a))
            angle = math.atan2(b[1] - a[1], b[0] - a[0])
            top, bottom = levels[k] + thick, levels[k]
            beam = stadium(length, BEAM_HALF_WIDTH)
            raised, lowered = (place_outline(beam, a, angle, z) for z in (top, bottom))
            if k + 1 < count:
                body = rectangle(length - 3.2, -1.1, length + 1.2, 1.1, 2)
                foot, lid = (place_outline(body, a, angle, z) for z in (bottom - 0.25 * h, bottom))
                items += [Item([foot, lid], GREY * SIDE_SHARE, "hull"), Item([lid], GREY)]
                shadows.append(cast_shadow(lid))
            else:
                pen = circle(PEN_RADIUS, 12)
                foot, lid = (place_outline(pen, tip, 0, z) for z in (0.0, bottom))
                items.append(Item([foot, lid], DARK * 0.6, "hull"))
                shadows.append(table_hull(np.concatenate([cast_shadow(foot), cast_shadow(lid)])))
            items += [Item([lowered, raised], light * SIDE_SHARE, "hull"), Item([raised], light)]
            holes = max(1, round(length / BEAM_HALF_WIDTH / 2))
            hole = circle(0.24, 10)
            rings = [place_outline(hole, a + (b - a) * j / holes, 0, top) for j in range(1, holes)]
            if rings:
                items.append(Item(rings, light * HOLE_SHARE))
            shadows.append(cast_shadow(raised))
            items.append(Item([place_outline(circle(0.55, 20), a, 0, top)], DARK))
            items.append(Item([place_outline(circle(0.26, 14), a, 0, top)], GREY))
        return items, shadows

    def _hand(self, tip: np.ndarray, t: float) -> list[Item]:
        c = self.constants
        moment = hand_pass(c, t)
        if moment is None:
            return []
        target = covered_place(moment, c, tip)
        ahead = np.array([math.cos(HAND_ANGLE), math.sin(HAND_ANGLE)])
        palm = target[:2] - (1 - moment.share) * HAND_DISTANCE * self.reach * ahead
        z = c["marker_height"] + (2 * c["marker_radius"] if c["marker"] == "ball" else 0.0) + 0.8
        return hand_items(hand_outlines(c, palm, HAND_ANGLE, z))


def sampled_tips(arm: Arm, count: int) -> np.ndarray:
    """Return points (n, coordinates), cm, that the tip reaches, for `count` angles per joint."""
    grids = [np.linspace(joint.lower, joint.upper, count) for joint in arm.joints]
    poses = np.stack(np.meshgrid(*grids), axis=-1).reshape(-1, len(grids))
    return np.array([kinematics.forward(arm, tuple(q)) for q in poses])
