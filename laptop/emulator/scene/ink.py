"""The ground of a picture, all that stands still, and the ink that comes onto it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from laptop.emulator.scene.optics import Box, Pinhole, box_of, coverage, light_of

INK_WIDTH = 0.13
"""cm."""

INK = light_of("#23262e")

INK_COVER = 0.92
"""Share of the light of the paper that ink takes."""


class InkedGround:
    """A picture of what stands still, with the ink so far.

    Args:
        bare: float32 (height, width, 3), light of it without ink.
        camera: Pinhole.

    Attributes:
        pixels: the same with ink.
        changes: Boxes that were painted over, in order; the first is all of it.
    """

    def __init__(self, bare: np.ndarray, camera: Pinhole) -> None:
        self._bare = bare
        self._camera = camera
        self._frame = Box(0, 0, *camera.size)
        self.pixels = bare.copy()
        self.changes = [self._frame]
        self._cover = np.zeros(bare.shape[:2], np.float32)
        self._segments: list[Sequence[float]] = []

    def lay(self, ink: Sequence[Sequence[float]]) -> None:
        """Bring the ink to these segments (n, 4), cm; those that are there already stay."""
        known = len(self._segments)
        if len(ink) < known or (known and tuple(ink[known - 1]) != tuple(self._segments[-1])):
            self._cover[:] = 0
            self.pixels[:] = self._bare
            self.changes.append(self._frame)
            self._segments, known = [], 0
        fresh = list(ink[known:])
        if not fresh:
            return
        self._segments += fresh
        rings = self._outlines(np.array(fresh, float))
        box = box_of(np.concatenate(rings), self._frame)
        if box.empty:
            return
        cover = box.cut(self._cover)
        cover[:] = np.minimum(cover + coverage(rings, box), 1)
        bare = box.cut(self._bare)
        box.cut(self.pixels)[:] = bare + INK_COVER * cover[..., None] * (
            INK.astype(np.float32) - bare
        )
        self.changes.append(box)

    def _outlines(self, segments: np.ndarray) -> list[np.ndarray]:
        """Polygons (4, 2), px, of segments (n, 4), cm."""
        a, b = segments.reshape(-1, 2, 2).transpose(1, 0, 2)
        along = b - a
        length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        across = INK_WIDTH / 2 / length * np.stack([-along[:, 1], along[:, 0]], axis=1)
        corners = np.stack([a + across, b + across, b - across, a - across], axis=1)
        flat = np.c_[corners.reshape(-1, 2), np.zeros(4 * len(a))]
        return list(self._camera.project(flat).reshape(-1, 4, 2))
