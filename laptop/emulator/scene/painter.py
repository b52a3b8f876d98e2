"""Painting of items: outlines, exact coverage, shadows, shaded balls."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from laptop.emulator.scene.items import Item
from laptop.emulator.scene.optics import LAMP, Box, Pinhole, ball_light, box_of, coverages


class Painter:
    """A painter of items over pictures of one camera.

    Args:
        camera: Pinhole.
        penumbra: softness of shadows, px.

    Attributes:
        frame: Box of the whole picture.
        rays: float32 (height, width, 2), of each pixel the x, y of its ray (x, y, 1).
    """

    def __init__(self, camera: Pinhole, penumbra: float) -> None:
        self.camera = camera
        self.frame = Box(0, 0, *camera.size)
        self.rays = camera.rays().astype(np.float32)
        self._penumbra = penumbra

    @property
    def soft_edge(self) -> int:
        """Width by which a shadow spreads beyond its outline, px."""
        return math.ceil(3 * self._penumbra)

    def outlines(self, items: Sequence[Item]) -> list[list[np.ndarray]]:
        """Return the polygons (n, 2) of each item in the picture, px."""
        rings = [ring for item in items for ring in item.rings]
        places = self.camera.project(np.concatenate(rings))
        bounds = np.cumsum([0, *map(len, rings)])
        placed = iter([places[a:b] for a, b in zip(bounds, bounds[1:])])
        outlines = []
        for item in items:
            own = [next(placed) for _ in item.rings]
            if item.kind == "hull":
                hull = cv2.convexHull(np.concatenate(own).astype(np.float32))
                own = [hull.reshape(-1, 2).astype(float)]
            outlines.append(own)
        return outlines

    def paint(self, pixels: np.ndarray, items: Sequence[Item]) -> None:
        """Paint items, the farthest first, on a whole picture."""
        for painted in self.covered(items, self.outlines(items), self.frame):
            self.lay(pixels, self.frame, *painted)

    def covered(
        self, items: Sequence[Item], outlines: Sequence[list[np.ndarray]], window: Box
    ) -> list[tuple[Item, Box, np.ndarray]]:
        """Return each item with the pixels of a window that it spans, and its coverage of them."""
        boxes = [
            box_of(np.concatenate(rings), window, item.kind == "shadow" and self.soft_edge)
            for item, rings in zip(items, outlines)
        ]
        shown = [k for k, box in enumerate(boxes) if not box.empty]
        covers = [np.zeros((0, 0), np.float32)] * len(items)
        for k, cover in zip(shown, coverages([(outlines[k], boxes[k]) for k in shown])):
            covers[k] = cover
        return list(zip(items, boxes, covers))

    def lay(self, pixels: np.ndarray, window: Box, item: Item, box: Box, cover: np.ndarray) -> None:
        """Lay one item over a picture.

        Args:
            pixels: float32 (height, width, 3), those of `window`.
            window: place of these pixels in the picture.
            item: to be laid.
            box: pixels that the item spans.
            cover: float32 (height, width), which part of each of them it covers.
        """
        if box.empty:
            return
        local = box.seen_from(window).cut(pixels)
        if item.kind == "shadow":
            local *= (1 - item.light * cv2.GaussianBlur(cover, (0, 0), self._penumbra))[..., None]
            return
        light = item.light if item.ball is None else self._shaded(item, box)
        local += cover[..., None] * (np.asarray(light, np.float32) - local)

    def _shaded(self, item: Item, box: Box) -> np.ndarray:
        """Return the light (height, width, 3) of a ball, with a highlight (Blinn, 1977)."""
        assert item.ball is not None
        centre, radius = item.ball
        middle = self.camera.seen(centre[None])[0]
        ray = np.dstack([box.cut(self.rays), np.ones((box.bottom - box.top, box.right - box.left))])
        ray = ray / np.linalg.norm(ray, axis=2, keepdims=True)
        along = ray @ middle
        # Rays that miss the ball by part of a pixel take the light of its contour.
        depth = along - np.sqrt(np.maximum(along**2 - middle @ middle + radius**2, 0))
        return ball_light(
            item.light, depth[..., None] * ray - middle, -ray, self.camera.rotation @ LAMP
        )
