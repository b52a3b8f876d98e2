"""The scene of a synthetic camera: table, sheet of paper, ink, the arm, its marker and the goal.

Rules:
1. The world is three-dimensional: cm, x forward, y left, z up, z = 0 on the table.  Everything gets
   into the picture vertex by vertex through one camera model, lens distortion included, so that
   `truth` is exact: where a marker's centre projects to.
2. Colours are amounts of light (linear, 1 = as bright as the sensor can say at gain 1), never sRGB.
   An edge covers each pixel by the exact area of the polygon in it.
3. What stands still is painted once, the ground; ink is added to it; per frame only what moves is
   painted, on a cut-out of it.

Pixel centres have integer coordinates, u right, v down, as OpenCV has them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.emulator.scene.camera_placement import camera_on
from laptop.emulator.scene.ink import InkedGround
from laptop.emulator.scene.marker_items import shown_markers
from laptop.emulator.scene.optics import Box, box_of, coverage
from laptop.emulator.scene.painter import Painter
from laptop.emulator.scene.tabletop import paint_ground
from laptop.emulator.scene.workcell import workcell
from shared.arm_description import Arm


class Patch(NamedTuple):
    """All that moves, painted on a cut-out of the ground: `pixels` are those of `outer`.

    Beyond `inner` the ground is as it was; between the two there is room for blur.
    """

    inner: Box
    outer: Box
    pixels: np.ndarray


class Scene:
    """One camera's view of an arm at work, in the plane or in space (see `workcell`).

    Args:
        arm: its description.
        constants: from `read_scene`.

    Attributes:
        asked: the constants as they were given.
        constants: the same, completed for this arm.
        cell: the workcell before the camera.
        camera: Pinhole.
        painter: paints for this camera.
        ground: float32 (height, width, 3), light of all that stands still, with the ink so far.
        changes: Boxes of the ground that were painted over, in order; the first is all of it.
    """

    def __init__(self, arm: Arm, constants: dict[str, Any]) -> None:
        self.arm = arm
        self.asked = constants
        self.cell = workcell(arm, constants)
        self.constants = self.cell.constants
        self.camera = camera_on(self.cell)
        self.frame = Box(0, 0, *self.camera.size)
        self.painter = Painter(self.camera, self.cell.penumbra)
        self._inked = InkedGround(paint_ground(self.cell, self.painter), self.camera)
        self.ground = self._inked.pixels
        self.changes = self._inked.changes

    # Where things are

    def project(self, points: np.ndarray) -> np.ndarray:
        """Project points (n, 3), cm, into the picture: (n, 2), px."""
        return self.camera.project(points)

    def centres(self, q: Sequence[float]) -> dict[str, np.ndarray]:
        """Return the markers' centres (3,), cm, with the joints at q, rad."""
        centres = {"effector": self.cell.tip_marker(q)}
        if "goal" in shown_markers(self.constants):
            centres["goal"] = self.cell.goal_marker()
        return centres

    def truth(self, q: Sequence[float]) -> dict[str, tuple[float, float]]:
        """Return the markers' true centres in the picture, (u, v) px, occluded or not."""
        centres = self.centres(q)
        places = self.project(np.array(list(centres.values())))
        return {name: (float(u), float(v)) for name, (u, v) in zip(centres, places)}

    def visible(self, q: Sequence[float], t: float = 0.0) -> dict[str, float]:
        """Return the visible part of each marker, 0 .. 1, neither occluded nor beyond the edge.

        Args:
            q: joint angles, rad.
            t: s, when (for the hand).
        """
        items = self.cell.static_items(self.camera) + self.cell.moving_items(q, t, self.camera)
        outlines = self.painter.outlines(items)
        seen = {}
        for name in self.centres(q):
            at = min(k for k, item in enumerate(items) if item.name == name)
            rings = outlines[at]
            box = box_of(np.concatenate(rings), self.frame)
            if box.empty:
                seen[name] = 0.0
                continue
            left = coverage(rings, box)
            for item, above in zip(items[at + 1 :], outlines[at + 1 :]):
                if item.kind != "shadow" and item.name != name:
                    left = left * (1 - coverage(above, box))
            seen[name] = float(left.sum()) / sum(abs(_area(ring)) for ring in rings)
        return seen

    # What the camera sees

    def image(
        self, q: Sequence[float], ink: Sequence[Sequence[float]] = (), t: float = 0.0
    ) -> np.ndarray:
        """Return the light (height, width, 3) that falls on the sensor.

        Args:
            q: joint angles, rad.
            ink: segments (x0, y0, x1, y1), cm, drawn so far.
            t: s, when (for the hand).
        """
        patch = self.patch([q], ink, t)
        image = self.ground.copy()
        patch.outer.cut(image)[:] = patch.pixels
        return image

    def patch(
        self, poses: Sequence[Sequence[float]], ink: Sequence[Sequence[float]], t: float
    ) -> Patch:
        """Return all that moves, as the mean of several poses q (rad) of one exposure."""
        self._inked.lay(ink)
        painter = self.painter
        margin = 1 + math.ceil(4 * self.constants["blur"])
        layers = [self.cell.moving_items(q, t, self.camera) for q in poses]
        items = [item for layer in layers for item in layer]
        outlines = painter.outlines(items)
        points = np.concatenate([ring for rings in outlines for ring in rings])
        inner = box_of(points, self.frame, margin + painter.soft_edge)
        outer = inner.grown(margin, self.frame)
        if inner.empty:
            return Patch(inner, outer, outer.cut(self.ground))
        total = np.zeros_like(outer.cut(self.ground))
        covered = iter(painter.covered(items, outlines, outer))
        for layer in layers:
            pixels = outer.cut(self.ground).copy()
            for _ in layer:
                painter.lay(pixels, outer, *next(covered))
            cv2.add(total, pixels, dst=total)
        total *= np.float32(1 / len(layers))
        return Patch(inner, outer, total)


def _area(ring: np.ndarray) -> float:
    """Return the signed area of a polygon (n, 2), px."""
    after = np.roll(ring, -1, axis=0)
    return float(ring[:, 0] @ after[:, 1] - after[:, 0] @ ring[:, 1]) / 2
