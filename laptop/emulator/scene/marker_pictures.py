"""Pictures of one marker alone, seen straight on, whose place is known to the last digit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from laptop.emulator.scene.optics import (
    LAMP,
    Box,
    ball_light,
    bit_rings,
    box_of,
    circle,
    coverage,
    light_of,
    rectangle,
    to_linear,
    to_srgb,
)
from laptop.emulator.scene.sensor import blurred, through_jpeg


def marker_frame(
    kind: str,
    u: float,
    v: float,
    radius: float,
    colour: str = "red",
    background: str | np.ndarray = "#808080",
    size: tuple[int, int] = (128, 128),
    motion: tuple[float, float] = (0.0, 0.0),
    blur: float = 0.7,
    noise: float = 3.0,
    jpeg: int = 0,
    chroma: str = "420",
    gain: float = 1.0,
    warm: float = 0.0,
    number: int = 0,
    seed: int | Sequence[int] = 0,
) -> np.ndarray:
    """A picture of one marker with its centre at (u, v), through the sensor of the camera.

    Args:
        kind: "disc", "ball" or "aruco".
        u, v, radius: px; of an ArUco the radius is half the side of its black square.
        colour: of disc and ball, a word of `optics.COLOURS` or #rrggbb.
        background: a word, #rrggbb, or a picture (BGR, uint8), which then gives the size.
        size: (width, height), px.
        motion: px (u, v) that it moves during the exposure, centred on (u, v).
        blur: sigma of the point spread, px.
        noise: sigma, DN.
        jpeg: quality; 0 for none.
        chroma: of the JPEG, "420", "422" or "444".
        gain, warm: as in `scene_constants.CONSTANTS`.
        number: of the ArUco.
        seed: of the noise.

    Returns:
        BGR, uint8.
    """
    if isinstance(background, str):
        ground = np.broadcast_to(light_of(background), (size[1], size[0], 3))
    else:
        ground = to_linear(background)
    light = marker_light(kind, u, v, radius, light_of(colour), ground, motion, number)
    exposed = blurred(light, blur) * (gain * np.array([1 - warm, 1.0, 1 + warm], np.float32))
    values = to_srgb(exposed)
    if noise:
        values = values + noise * np.random.default_rng(seed).standard_normal(values.shape)
    image = np.clip(np.round(values), 0, 255).astype(np.uint8)
    return through_jpeg(image, jpeg, chroma) if jpeg else image


def marker_light(
    kind: str,
    u: float,
    v: float,
    radius: float,
    light: Any,
    background: np.ndarray,
    motion: tuple[float, float] = (0.0, 0.0),
    number: int = 0,
    lamp: np.ndarray | None = None,
) -> np.ndarray:
    """One marker alone, seen straight on, on a background.

    Args:
        kind: "disc", "ball" or "aruco".
        u, v: px, its centre; of a moving one, in the middle of the exposure.
        radius: px; of an ArUco, half the side of its black square.
        light: (3,) B, G, R of disc and ball.
        background: light (height, width, 3).
        motion: px that it moves during the exposure, (u, v).
        number: of the ArUco.
        lamp: of a ball, the unit vector towards it (u, v, away from the camera); None: the scene's.

    Returns:
        light (height, width, 3)
    """
    # The lamp of the scene as a camera sees it that looks straight down.
    lamp = LAMP * (1, -1, -1) if lamp is None else lamp
    image = np.array(background, np.float32)
    frame = Box(0, 0, image.shape[1], image.shape[0])
    count = max(1, math.ceil(4 * math.hypot(*motion)))
    margin = radius * 4 / 3 + max(abs(motion[0]), abs(motion[1])) / 2 + 2
    box = box_of(np.array([(u - margin, v - margin), (u + margin, v + margin)]), frame)
    if box.empty:
        return image
    pixels = box.cut(image)
    total = np.zeros(pixels.shape)
    for k in range(count):
        share = (k + 0.5) / count - 0.5
        place = np.array([u + share * motion[0], v + share * motion[1]])
        reach = radius * (4 / 3 if kind == "aruco" else 1) + 1
        own = box_of(np.array([place - reach, place + reach]), frame)
        layers: Iterable[tuple[list[np.ndarray], Any]]
        if kind == "aruco":
            white, black = light_of("white"), light_of("black")
            bits = [place + radius * ring * (1, -1) for ring in bit_rings(number)]
            layers = [
                ([place + rectangle(-s, -s, s, s, 1)], tone)
                for s, tone in ((radius * 4 / 3, white), (radius, black))
            ]
            layers = [*layers, (bits, white)]
        elif kind == "ball":
            layers = [
                ([place + circle(radius, 256)], _ball_straight_on(place, radius, light, own, lamp))
            ]
        else:
            layers = [([place + circle(radius, 256)], np.asarray(light))]
        painted = pixels.astype(float)
        if not own.empty:
            covered = own.seen_from(box).cut(painted)
            for rings, tone in layers:
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
