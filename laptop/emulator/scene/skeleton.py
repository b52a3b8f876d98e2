"""The bodies of an arm with a turning base, and the stand of its goal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from laptop.emulator.scene.items import BEAM_HALF_WIDTH, GREY, HOLE_SHARE, stadium
from laptop.emulator.scene.optics import circle, light_of
from laptop.emulator.scene.solids import BLACK, Mark, Solid, box, prism, solid
from robot.motion import kinematics
from shared.arm_description import Arm

DARK = light_of("#3a3d40")
"""Light (3,), B, G, R, of turntable and column."""


class Skeleton:
    """The bodies of an arm in space: a turntable, a column, two links with a motor between them.

    Args:
        arm: its links, cm.
        light: (3,), B, G, R, of its beams.
        radius: of the ball at its tip, cm.
    """

    def __init__(self, arm: Arm, light: Any, radius: float) -> None:
        self._arm = arm
        height, upper, fore = (joint.link for joint in arm.joints)
        wide, thick = 1.5 * BEAM_HALF_WIDTH, BEAM_HALF_WIDTH
        end = max(0.3 * fore, fore - 2.6)
        self._standing = [
            prism(circle(2.8, 32), (0.0, 1.5), DARK, "z", [([circle(1.9, 28)], GREY * 0.8)]),
            box((-8.5, -3.0), (-1.5, 1.5), (0.0, 2.8), GREY),
        ]
        self._turning = [
            box((-1.0, 1.0), (-0.9, 0.9), (1.5, height + 0.9), DARK * 2),
            box((-4.0, -1.0), (-0.9, 0.9), (max(1.6, height - 6.0), height - 1.4), GREY),
        ]
        hubs: list[Mark] = [
            ([circle(r, n) + (x, 0.0) for x in (0.0, upper)], tone)
            for r, n, tone in ((0.55, 20, DARK), (0.26, 14, GREY))
        ]
        self._upper = [
            prism(
                stadium(upper, wide),
                (y - thick, y + thick),
                light,
                marks=_holes(upper, light) + hubs,
            )
            for y in (-1.4, 1.4)
        ]
        self._upper.append(box((0.42 * upper, 0.82 * upper), (-0.95, 0.95), (-1.2, 1.2), GREY))
        self._fore = [
            prism(stadium(end, wide), (-thick, thick), light, marks=_holes(end, light)),
            box((end + wide, fore - 0.9 * radius), (-0.2, 0.2), (-0.2, 0.2), BLACK),
        ]

    def solids(self, q: Sequence[float], eye: np.ndarray) -> list[Solid]:
        """Return all bodies but the marker, joints at q, rad, seen from `eye` (3,), cm."""
        base, shoulder, elbow, tip = np.array(kinematics.joint_positions(self._arm, q))
        left = np.array([-math.sin(q[0]), math.cos(q[0]), 0.0])
        groups = [(self._standing, np.eye(3), base)]
        for parts, axis, origin in (
            (self._turning, np.cross(left, (0.0, 0.0, 1.0)), base),
            (self._upper, elbow - shoulder, shoulder),
            (self._fore, tip - elbow, elbow),
        ):
            ahead = axis / np.linalg.norm(axis)
            groups.append((parts, np.array([ahead, left, np.cross(ahead, left)]), origin))
        return [solid(part, eye, axes, at) for parts, axes, at in groups for part in parts]


def _holes(length: float, light: Any) -> list[Mark]:
    """Return the holes on a beam's two faces."""
    count = max(1, round(length / BEAM_HALF_WIDTH / 2))
    places = length * np.arange(1, count) / count
    return (
        [([circle(0.24, 10) + (x, 0.0) for x in places], light * HOLE_SHARE)] if count > 1 else []
    )


def ball_stand(place: np.ndarray, radius: float, eye: np.ndarray) -> list[Solid]:
    """Return the stand that holds a ball of a radius, cm, at a place (3,), cm, above the table."""
    x, y, z = place
    foot = prism(circle(1.3, 24), (0.0, 0.3), GREY, "z")
    parts = [foot]
    if z - 0.9 * radius > 0.4:
        parts.append(box((-0.15, 0.15), (-0.15, 0.15), (0.3, z - 0.9 * radius), GREY))
    return [solid(part, eye, np.eye(3), np.array([x, y, 0.0])) for part in parts]
