"""The ground of a picture, all that stands still, and the ink that comes onto it.

A stroke is a chain of segments, each a rectangle INK_WIDTH wide on the paper, z = 0.  Its corners
go through the lens; a is the share of a pixel that the polygon covers, exactly (see
`optics.coverages`).  Where shares of several segments meet, they add up to at most 1.  The light is

    light = bare + INK_COVER a (INK - bare),

that is "over" of Porter and Duff (1984), in linear light and not in sRGB, since a pixel gathers
light.  `cv2.line` would be the obvious way.  It rounds to whole pixels, in which a line of 1.3 mm
would be off by more than what is measured.  Ink only grows, so each picture adds the new segments
alone; if the list is another than before, the ground is painted anew.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from laptop.emulator.scene.optics import Box, Pinhole, box_of, coverage, light_of

INK_WIDTH = 0.13
"""Width of a stroke, cm."""

INK = light_of("#23262e")
"""Light (3,), B, G, R, of ink that covers fully."""

INK_COVER = 0.92
"""Opacity of ink, 0 .. 1."""


class InkedGround:
    """A picture of all that stands still, with the ink so far.

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
        """Paint the ink of these segments (n, 4), cm, as far as it is not there yet."""
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
        """Return the polygons (4, 2), px, of segments (n, 4), cm."""
        a, b = segments.reshape(-1, 2, 2).transpose(1, 0, 2)
        along = b - a
        length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        across = INK_WIDTH / 2 / length * np.stack([-along[:, 1], along[:, 0]], axis=1)
        corners = np.stack([a + across, b + across, b - across, a - across], axis=1)
        flat = np.c_[corners.reshape(-1, 2), np.zeros(4 * len(a))]
        return list(self._camera.project(flat).reshape(-1, 4, 2))
