"""Options of a drawing: checked once, then frozen.  Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from laptop.drawing.artwork import BadArtwork
from laptop.drawing.placing import LARGEST, LEAST_SIZE, PlacementRequest, paper_size
from laptop.drawing.reach import POSTURES
from robot.motion import kinematics
from shared.arm_description import Arm

TOLERANCE = 0.01
"""Greatest error by which lines are simplified, cm: finer than any arm of bricks draws."""

GREATEST_TOLERANCE = 0.2

SPEEDS = (0.5, 50.0)
"""Least and greatest speed of the tip, cm/s."""


class BadDrawingOption(BadArtwork):
    """An option of a drawing with which it cannot be drawn."""


@dataclass(frozen=True)
class DrawingOptions:
    """Options of a drawing; by default it is as large as the arm reaches.

    paper      sheet on which it lies with a margin: a5, a4, letter, a5-landscape, WxH in cm
    at         its centre (with paper: the sheet's) in the arm's coordinates, cm
    size       (width, height or None) that it fills, cm
    rotate     degrees, counter-clockwise; 0: upright for who sits behind the arm
    height     of the paper above the table, cm; of arms in space only
    speed      greatest of the tip, cm/s; None: the arm's own
    elbow      "up" or "down"; None: whichever can
    clip       whether what cannot be reached is left out; else it is refused
    tolerance  by which lines may be simplified, cm
    order      whether strokes may be joined, turned round and put into another order
    layers     names of those that are drawn; None: all
    pens       "layers" or "colours": each has a pen of its own; None: one pen draws all
    touch_up   whether each new pen waits over its first point, where it can be nudged
    scale      times as large as it is made; None: by `size`, or as large as it fits
    """

    paper: str | None = None
    at: tuple[float, float] | None = None
    size: tuple[float, float | None] | None = None
    rotate: float = 0.0
    height: float = 0.0
    speed: float | None = None
    elbow: str | None = None
    clip: bool = False
    tolerance: float = TOLERANCE
    order: bool = True
    layers: tuple[str, ...] | None = None
    scale: float | None = None
    pens: str | None = None
    touch_up: bool = False

    def __post_init__(self) -> None:
        if self.paper is not None:
            paper_size(self.paper)
        if self.at is not None:
            for value in self.at:
                _within("at", value, -LARGEST, LARGEST, "cm")
        for side in self.size or ():
            if side is not None:
                _within("size", side, LEAST_SIZE, LARGEST, "cm")
        _within("rotate", self.rotate, -3600.0, 3600.0, "degrees")
        _within("height", self.height, -LARGEST, LARGEST, "cm")
        if self.speed is not None:
            _within("speed", self.speed, *SPEEDS, "cm/s")
        _within("tolerance", 10 * self.tolerance, 0.0, 10 * GREATEST_TOLERANCE, "mm")
        if self.elbow not in (None, *POSTURES):
            raise BadDrawingOption(f"elbow {self.elbow!r}: give one of {', '.join(POSTURES)}")

    def postures(self, arm: Arm) -> tuple[str, ...]:
        """Return the postures that may be taken, the preferred one first."""
        if self.elbow:
            return (self.elbow,)
        return POSTURES if arm.elbow == POSTURES[0] else POSTURES[::-1]

    def placement_request(self, arm: Arm) -> PlacementRequest:
        """Return the options that say where the drawing lies.

        Raises:
            BadDrawingOption: a height for an arm that has none.
        """
        if self.height and kinematics.coordinates(arm) == 2:
            raise BadDrawingOption(
                f"height {self.height:g} cm: the arm {arm.name} draws on the table only; leave it "
                "out, or take an arm in space"
            )
        return PlacementRequest(
            paper_size(self.paper) if self.paper else None,
            self.at,
            self.size,
            self.rotate,
            self.height,
            self.clip,
            self.scale,
        )


def _within(name: str, value: float, least: float, greatest: float, unit: str) -> None:
    if not (math.isfinite(value) and least <= value <= greatest):
        raise BadDrawingOption(
            f"{name} {value:g}: give {least:g} to {greatest:g} {unit}".replace("to inf", "or more")
        )
