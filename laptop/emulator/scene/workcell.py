"""The workcell before the cameras: an arm in the plane or one in space, with its markers.

Only this module tells the two apart; all else works with either.
"""

from __future__ import annotations

from typing import Any

from laptop.emulator.scene.planar import PlanarWorkcell
from laptop.emulator.scene.scene_constants import CAMERAS, named_cameras
from laptop.emulator.scene.spatial import SpatialWorkcell
from robot.motion import kinematics
from shared.arm_description import Arm

Workcell = PlanarWorkcell | SpatialWorkcell
"""Either kind of workcell."""


def _kind(arm: Arm) -> type[PlanarWorkcell] | type[SpatialWorkcell]:
    return SpatialWorkcell if kinematics.coordinates(arm) == 3 else PlanarWorkcell


def workcell(arm: Arm, constants: dict[str, Any]) -> Workcell:
    """Return the workcell of an arm.

    Args:
        arm: its description.
        constants: from `read_scene`; those that depend on arm and camera may be None.

    Raises:
        BadScene: the arm cannot be shown so.
    """
    kind = _kind(arm)
    usual = kind.defaults(constants["camera"])
    values = {**constants, **{k: v for k, v in usual.items() if constants[k] is None}}
    kind.check(arm, values)
    return kind(arm, values)


def cameras(arm: Arm, text: str = "") -> str:
    """Return the names of the cameras that see an arm: the usual ones and those a text names."""
    watching = named_cameras(text).union(_kind(arm).usual_cameras)
    return "".join(name for name in CAMERAS if name in watching)
