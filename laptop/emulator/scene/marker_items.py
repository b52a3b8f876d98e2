"""The markers on tip and goal: discs, balls and ArUco squares, as items to paint."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from laptop.emulator.scene.items import Item, place_outline
from laptop.emulator.scene.optics import (
    Pinhole,
    bit_rings,
    circle,
    light_of,
    rectangle,
    similar_hues,
)
from shared.arm_description import Arm

ARUCO_IDS = {"effector": 0, "goal": 1}
"""Number of an ArUco marker by the marker's name."""
ARUCO_SIDE = 3.0
"""Side of the black square of an ArUco marker, in marker radii: a bit takes as much as it needs."""


def shown_markers(constants: dict[str, Any]) -> list[str]:
    """Return the names of the markers that are there: "effector", and "goal" unless it is none."""
    return [name for name in ("effector", "goal") if constants[name] != "none"]


def marker_lift(constants: dict[str, Any]) -> float:
    """Return the height of a marker's centre above what it lies on, cm."""
    return float(constants["marker_radius"]) if constants["marker"] == "ball" else 0.0


def marker_offset(arm: Arm, constants: dict[str, Any]) -> np.ndarray:
    """Return the offset (2,), cm, of the tip's marker from the tip, in the last link's frame.

    It is as the arm's file has it, and off by `marker_stray` in a direction from the seed.
    """
    direction = np.random.default_rng([constants["seed"], 4]).uniform(0, 2 * math.pi)
    stray = constants["marker_stray"] * np.array([math.cos(direction), math.sin(direction)])
    return np.asarray(np.array(arm.marker_offset) + stray)


def outer_radius(constants: dict[str, Any]) -> float:
    """Return the radius of a marker with all that belongs to it, cm."""
    radius = constants["marker_radius"]
    by_kind = {"disc": radius + constants["rim"], "ball": radius, "aruco": 1.4 * radius}
    return float(by_kind[constants["marker"]])


def beam_light(constants: dict[str, Any]) -> np.ndarray:
    """Return the light (3,) of the arm's beams: yellow, unless a marker looks like that."""
    near = any(similar_hues("yellow", constants[name]) for name in shown_markers(constants))
    return light_of("grey" if near else "yellow")


def marker_items(
    constants: dict[str, Any], name: str, centre: np.ndarray, angle: float, camera: Pinhole
) -> list[Item]:
    """Return the items of one marker as a camera sees it, the topmost last.

    Args:
        constants: of the scene.
        name: "effector" or "goal".
        centre: (3,), cm.
        angle: to which a flat one is turned, rad.
        camera: that sees it.
    """
    light, radius = light_of(constants[name]), constants["marker_radius"]
    if constants["marker"] == "ball":
        return [Item([ball_contour(centre, radius, camera)], light, "ball", name, (centre, radius))]
    if constants["marker"] == "aruco":
        return _aruco(name, radius, centre, angle)
    assert constants["marker"] == "disc", "a kind without a picture"
    return _disc(name, radius, constants["rim"], light, centre)


def ball_contour(centre: np.ndarray, radius: float, camera: Pinhole) -> np.ndarray:
    """Return the circle (n, 3), cm, on a ball that the camera sees as its outline."""
    view = camera.position - centre
    distance = float(np.linalg.norm(view))
    view = view / distance
    share = radius / distance
    one = np.cross(view, (1.0, 0.0, 0.0) if abs(view[0]) < 0.8 else (0.0, 1.0, 0.0))
    one = one / np.linalg.norm(one)
    flat = circle(radius * math.sqrt(1 - share**2), 128)
    return np.asarray(centre + radius * share * view + flat @ np.array([one, np.cross(view, one)]))


_bit_rings = functools.lru_cache(maxsize=2)(bit_rings)


def _aruco(name: str, radius: float, centre: np.ndarray, angle: float) -> list[Item]:
    half = ARUCO_SIDE / 2 * radius
    edge = half * 4 / 3
    white = light_of("white")

    def placed(outline: np.ndarray) -> np.ndarray:
        return place_outline(outline, centre, angle, centre[2])

    paper, square = (placed(rectangle(-s, -s, s, s)) for s in (edge, half))
    bits = [placed(half * ring) for ring in _bit_rings(ARUCO_IDS[name])]
    return [
        Item([paper], white),
        Item([square], light_of("black"), name=name),
        Item(bits, white, name=name),
    ]


def _disc(
    name: str, radius: float, rim: float, light: np.ndarray, centre: np.ndarray
) -> list[Item]:
    around = place_outline(circle(radius + rim, 64), centre, 0, centre[2])
    disc = place_outline(circle(radius, 128), centre, 0, centre[2])
    return ([Item([around], light_of("white"))] if rim else []) + [Item([disc], light, name=name)]
