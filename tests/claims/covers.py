"""Outlines of what hides a marker, and grounds to be searched: what a confidence has to stand."""

from __future__ import annotations

import math

import numpy as np

from laptop.emulator.scene.optics import Box, box_of, coverage, light_of
from tests.claims.position_claims import Circle


def half_plane(share: float, circle: Circle, direction: float) -> np.ndarray:
    """Corners of what comes from a direction (rad) and hides a share of the diameter."""
    u, v, radius = circle
    reach = radius * (1 - 2 * share)
    corners = np.array([(reach, -2e3), (reach + 4e3, -2e3), (reach + 4e3, 2e3), (reach, 2e3)])
    return _turned(corners, direction) + (u, v)


def fingers(share: float, circle: Circle, direction: float) -> list[np.ndarray]:
    """Corners of two fingers that reach a share of the radius over a marker from its rim."""
    u, v, radius = circle
    angle = np.linspace(-math.pi / 2, math.pi / 2, 20)
    width = 0.35 * radius
    tip = np.column_stack([-width * np.cos(angle), width * np.sin(angle)])
    finger = np.vstack([tip, [(2e3, width), (2e3, -width)]]) + (radius * (1 - share) + width, 0)
    return [_turned(finger, turn) + (u, v) for turn in (direction, direction + 2.4)]


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([(c, s), (-s, c)])


def leaves(luck: np.random.Generator, tone: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Light (height, width, 3) of sixty leaves of all shades of a tone (3,)."""
    width, height = size
    image = np.full((height, width, 3), light_of("#303428"))
    angle = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    for _ in range(60):
        long = luck.uniform(8, 50)
        short = long * luck.uniform(0.35, 1)
        leaf = np.column_stack(
            [long * np.cos(angle), short * np.sin(angle) * (1 - 0.5 * np.cos(angle) ** 3)]
        )
        leaf = _turned(leaf, luck.uniform(0, 2 * math.pi)) + luck.uniform((0, 0), size)
        shade = tone * luck.uniform(0.5, 1.3) * luck.uniform(0.75, 1.3, 3)
        box = box_of(leaf, Box(0, 0, width, height))
        if not box.empty:
            covered = box.cut(image)
            covered += coverage([leaf], box)[..., None] * (shade - covered)
    return image
