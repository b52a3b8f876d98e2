"""An item to paint, and the outlines that items are made of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.emulator.scene.optics import LAMP, Point, light_of


class Item(NamedTuple):
    """One thing to paint.

    rings   its polygons, each (n, 3) in cm; or of a `hull`, the points whose hull is painted
    light   (3,) B, G, R; of a shadow, how much light it takes
    kind    "flat", "hull", "shadow" or "ball"
    name    of the marker it belongs to
    ball    centre (3,) and radius, cm
    """

    rings: Sequence[np.ndarray]
    light: Any
    kind: str = "flat"
    name: str = ""
    ball: tuple[np.ndarray, float] | None = None


SIDE_SHARE = 0.5
"""Share of its colour's light that a vertical face shows."""

BEAM_HALF_WIDTH = 0.4
"""Half the width of a LEGO beam; its holes are twice that apart; cm."""
HOLE_SHARE = 0.32
"""Share of its beam's light that a hole shows."""

GREY = light_of("#b9bcbf")
"""Light (3,), B, G, R, of grey LEGO."""


def stadium(length: float, radius: float) -> np.ndarray:
    """Return a bar (n, 2) with round ends, from the origin to (length, 0), its sides in pieces."""
    arc = np.linspace(-math.pi / 2, math.pi / 2, 9)
    end = radius * np.stack([np.cos(arc), np.sin(arc)], axis=1)
    side = np.linspace(0, length, 8)[1:-1]
    top = np.stack([side[::-1], np.full(6, radius)], axis=1)
    bottom = np.stack([side, np.full(6, -radius)], axis=1)
    return np.concatenate([end + (length, 0), top, -end, bottom])


def place_outline(outline: np.ndarray, origin: Point, angle: float, z: float) -> np.ndarray:
    """Turn an outline (n, 2), cm, by `angle` (rad), move it to `origin` and raise it: (n, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    placed = np.empty((len(outline), 3))
    placed[:, 0] = outline[:, 0] * c - outline[:, 1] * s + origin[0]
    placed[:, 1] = outline[:, 0] * s + outline[:, 1] * c + origin[1]
    placed[:, 2] = z
    return placed


def cast_shadow(points: np.ndarray) -> np.ndarray:
    """Return the shadow of points (n, 3), cm, on the table."""
    return np.asarray(points - points[:, 2:] * (LAMP / LAMP[2]))


def table_hull(points: np.ndarray) -> np.ndarray:
    """Return the hull of points (n, 3), cm, that all lie on the table."""
    hull = cv2.convexHull(points[:, :2].astype(np.float32)).reshape(-1, 2)
    return np.asarray(np.c_[hull, np.zeros(len(hull))])


def block(outline: np.ndarray, at: Point, angle: float, height: float, light: Any) -> list[Item]:
    """Return a solid on the table: shadow, sides, top.

    Args:
        outline: convex, (n, 2), cm.
        at: where it stands, cm.
        angle: by which it is turned, rad.
        height: cm.
        light: (3,), of its top.
    """
    foot, lid = (place_outline(outline, at, angle, z) for z in (0.0, height))
    return [
        Item([table_hull(np.concatenate([foot, cast_shadow(lid)]))], 1.0, "shadow"),
        Item([foot, lid], light * SIDE_SHARE, "hull"),
        Item([lid], light),
    ]
