"""Pictures of one marker alone, seen straight on, at an exactly known place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from laptop.emulator.scene.optics import (
    LAMP,
    Box,
    Point,
    ball_light,
    bit_rings,
    box_of,
    circle,
    coverage,
    light_of,
    rectangle,
    to_linear,
)
from laptop.emulator.scene.sensor import Development

Layer = tuple[list[np.ndarray], np.ndarray]
"""Polygons (n, 2), px, and their light, of one colour or pixel by pixel."""


@dataclass(frozen=True)
class LoneMarker:
    """One marker alone.

    kind    "disc", "ball" or "aruco"
    radius  px; of an ArUco, half the side of its black square
    colour  of disc and ball: a word of `optics.COLOURS`, #rrggbb, or light (3,), B, G, R
    number  of the ArUco
    """

    kind: str
    radius: float
    colour: str | np.ndarray = "red"
    number: int = 0

    @property
    def reach(self) -> float:
        """Greatest distance of its pixels from its centre, px."""
        return self.radius * (4 / 3 if self.kind == "aruco" else 1) + 1

    def layers(self, place: np.ndarray, box: Box, lamp: np.ndarray) -> list[Layer]:
        """Return its layers, the lowest first: polygons, px, and their light.

        Args:
            place: its centre (u, v), px.
            box: pixels for which a ball's light is computed.
            lamp: the unit vector towards it (u, v, away from the camera).
        """
        if self.kind == "aruco":
            white, black = light_of("white"), light_of("black")
            bits = [place + self.radius * ring * (1, -1) for ring in bit_rings(self.number)]
            rim, side = self.radius * 4 / 3, self.radius
            return [
                ([place + rectangle(-rim, -rim, rim, rim, 1)], white),
                ([place + rectangle(-side, -side, side, side, 1)], black),
                (bits, white),
            ]
        light = light_of(self.colour) if isinstance(self.colour, str) else self.colour
        assert self.kind in ("disc", "ball"), "a kind without a picture"
        if self.kind == "ball":
            light = _ball_straight_on(place, self.radius, light, box, lamp)
        return [([place + circle(self.radius, 256)], np.asarray(light))]


def marker_frame(
    marker: LoneMarker,
    place: Point,
    background: str | np.ndarray = "#808080",
    size: tuple[int, int] = (128, 128),
    motion: tuple[float, float] = (0.0, 0.0),
    development: Development = Development(),  # noqa: B008 (it does not change)
    seed: int | Sequence[int] = 0,
) -> np.ndarray:
    """Return a picture of one marker, through the sensor of the camera.

    Args:
        marker: what is shown.
        place: its centre (u, v), px.
        background: a word, #rrggbb, or a picture (BGR, uint8), which then gives the size.
        size: (width, height), px.
        motion: px (u, v) that it moves during the exposure, centred on its place.
        development: of the picture.
        seed: of the noise.

    Returns:
        BGR, uint8.
    """
    if isinstance(background, str):
        ground = np.broadcast_to(light_of(background), (size[1], size[0], 3))
    else:
        ground = to_linear(background)
    return development.picture(marker_light(marker, place, ground, motion), seed)


def marker_light(
    marker: LoneMarker,
    place: Point,
    background: np.ndarray,
    motion: tuple[float, float] = (0.0, 0.0),
    lamp: np.ndarray | None = None,
) -> np.ndarray:
    """Return the light of one marker, seen straight on, on a background.

    Args:
        marker: what is shown.
        place: px, its centre (u, v); of a moving one, in the middle of the exposure.
        background: light (height, width, 3).
        motion: px that it moves during the exposure, (u, v).
        lamp: of a ball, the unit vector towards it (u, v, away from the camera); None: the scene's.

    Returns:
        light (height, width, 3)
    """
    # The lamp of the scene as a camera sees it that looks straight down.
    lamp = LAMP * (1, -1, -1) if lamp is None else lamp
    image = np.array(background, np.float32)
    frame = Box(0, 0, image.shape[1], image.shape[0])
    u, v = place
    count = max(1, math.ceil(4 * math.hypot(*motion)))
    margin = marker.radius * 4 / 3 + max(abs(motion[0]), abs(motion[1])) / 2 + 2
    box = box_of(np.array([(u - margin, v - margin), (u + margin, v + margin)]), frame)
    if box.empty:
        return image
    pixels = box.cut(image)
    total = np.zeros(pixels.shape)
    for k in range(count):
        share = (k + 0.5) / count - 0.5
        centre = np.array([u + share * motion[0], v + share * motion[1]])
        own = box_of(np.array([centre - marker.reach, centre + marker.reach]), frame)
        painted = pixels.astype(float)
        if not own.empty:
            covered = own.seen_from(box).cut(painted)
            for rings, tone in marker.layers(centre, own, lamp):
                covered += coverage(rings, own)[..., None] * (tone - covered)
        total += painted
    pixels[:] = total / count
    return image


def _ball_straight_on(
    place: np.ndarray, radius: float, light: Any, box: Box, lamp: np.ndarray
) -> np.ndarray:
    x = (np.arange(box.left, box.right) - place[0]) / radius
    y = (np.arange(box.top, box.bottom) - place[1]) / radius
    x, y = np.meshgrid(x, y)
    normals = np.dstack([x, y, -np.sqrt(np.maximum(1 - x**2 - y**2, 0))])
    return ball_light(light, normals, np.array([[(0.0, 0.0, -1.0)]]), lamp)
