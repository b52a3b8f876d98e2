"""A hand that reaches out over the goal, the next time over the tip, and goes again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from laptop.emulator.scene.items import Item, place_outline, stadium
from laptop.emulator.scene.optics import Point, circle, light_of
from laptop.emulator.scene.scene_constants import HAND_PASS

SKIN = light_of("#c98f6b")
"""Light (3,), B, G, R, of the hand."""

FINGERS = ((-0.42, 6.6), (-0.14, 7.6), (0.12, 7.3), (0.38, 6.0), (1.1, 5.6))
"""Angle, rad, and length, cm, of each finger of a hand of usual size."""

HAND_DISTANCE = 3.0
"""Distance from which the hand comes, in reaches of the arm."""


class HandPass(NamedTuple):
    """A moment of a pass: whether the hand covers the tip, and the share of its way in, 0 .. 1."""

    over_tip: bool
    share: float


def hand_pass(constants: dict[str, Any], t: float) -> HandPass | None:
    """Return the pass that the hand is in at t, s; None while there is no hand."""
    every = constants["occlusion"]
    if not every:
        return None
    turn, phase = divmod(t, every)
    phase = (phase - (every - HAND_PASS)) / HAND_PASS
    if phase < 0:
        return None
    # In by 0.35, out from 0.65 on, smoothly.
    share = min(1.0, min(phase, 1 - phase) / 0.35)
    return HandPass(bool(turn % 2), share * share * (3 - 2 * share))


def covered_place(moment: HandPass, constants: dict[str, Any], tip: np.ndarray) -> np.ndarray:
    """Return the place (3,), cm, to cover; `tip` (3,) is the marker on the tip."""
    if moment.over_tip:
        return tip
    return np.array([constants["goal_x"], constants["goal_y"], constants["goal_z"]])


def hand_outlines(
    constants: dict[str, Any], palm: Point, angle: float, z: float = 0.0
) -> list[np.ndarray]:
    """Return the outlines (n, 3), cm, of arm, palm and fingers in a plane.

    Args:
        constants: of the scene.
        palm: its middle, cm.
        angle: to which the fingers point, rad.
        z: height of the plane, cm.
    """
    size = max(1.0, constants["marker_radius"] / 1.1)
    parts = [(stadium(60, 2.9 * size), angle + math.pi)]
    parts.append((circle(4.2 * size, 32) * (1.0, 0.9), angle))
    parts += [(stadium(length * size, 0.85 * size), angle + spread) for spread, length in FINGERS]
    return [place_outline(outline, palm, turned, z) for outline, turned in parts]


def hand_items(outlines: Sequence[np.ndarray]) -> list[Item]:
    """Return the hand with these outlines (n, 3), cm."""
    return [Item([outline], SKIN) for outline in outlines]
