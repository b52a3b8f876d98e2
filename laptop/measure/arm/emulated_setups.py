"""An emulated arm before a camera by its formula, or one whose pictures are rendered."""

from __future__ import annotations

import math

import numpy as np

from laptop.emulator.rendered_tracker import marker_specs
from laptop.emulator.scene.board_items import board_place
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import BadScene, read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.measure.arm.arm_fit import PLACING_ERROR, TouchSight
from laptop.measure.arm.arm_model import USUAL_HEIGHT, MeasuredByHand
from laptop.measure.arm.calibrating import CalibrationSetup, check_unmoved, seen_board
from laptop.measure.arm.emulated_table import (
    EmulatedTable,
    camera_over,
    rng_of,
    with_free_joints,
)
from laptop.measure.arm.touching import touch_sight
from laptop.measure.emulated_rig import EmulatedRig, RenderedRig
from laptop.measure.run_data import Sights
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.table.camera_fit import calibrate
from robot.motion import kinematics
from shared.arm_description import Arm
from shared.messages import EFFECTOR

SCENE_PREFIX = "board=a4,board_x=12,goal=none,fps=12"
"""Text before what is written for a scene."""
PARKED_ANGLES = (2.4, 1.2)
"""Joint angles of a planar arm that leaves the board free, rad."""
CROSS_PICTURES = 6
"""Number of pictures of the marker on a cross."""


def ideal_camera(
    arm: Arm,
    built: Arm,
    plant: str,
    seed: int,
    bar: float | None,
    crosses: list[tuple[float, float]],
    known: MeasuredByHand,
) -> CalibrationSetup:
    """Return an arm before a camera that sees to 1 px by its formula.

    Raises:
        ArmError: a text is wrong, or the board is not seen.
    """
    height, distance = USUAL_HEIGHT if known.height is None else known.height, 44.0
    if built.chain == "spatial":  # the tip is the marker, and high
        height, distance = 0.0, 90.0
    camera = camera_over(560.0, (-8.0, 0.0), distance, math.radians(20), 1.0, 0.1)
    turn = -math.pi / 2 * (known.square or 0)
    table = EmulatedTable(built, camera, turn=turn, height=height)
    rng = rng_of(seed)
    found = table.calibrated(rng, bar)
    touches = table.touched(crosses, rng)
    rig = EmulatedRig(arm, built, plant, {"A": table}, height, seed=seed)
    return CalibrationSetup(rig, found, touches, lambda: None)


def rendered(
    arm: Arm,
    built: Arm,
    plant: str,
    seed: int,
    bar: float | None,
    crosses: list[tuple[float, float]],
    scene: str,
) -> CalibrationSetup:
    """Return an arm before a camera whose pictures are rendered and really looked at.

    Raises:
        ArmError: a text is wrong, or the board is not seen.
    """
    constants = read_scene(f"{SCENE_PREFIX},{scene}" if scene else SCENE_PREFIX)
    if constants["board"] == "none":
        raise BadScene("the scene has no board: --scene board=a4,board_x=12")
    view = Scene(built, constants)
    pictures = _Pictures(built, view)
    found = calibrate([seen_board(pictures.capture(PARKED_ANGLES))], bar)
    touches = pictures.touches(crosses, rng_of(seed))
    rig = RenderedRig(arm, {"A": view}, built, plant, seed, only_rests=True)

    def check() -> None:
        check_unmoved(found, pictures.capture(rig.last.record[-1].q))

    return CalibrationSetup(rig, found, touches, check)


class _Pictures:
    """Single pictures of an arm that stands still."""

    def __init__(self, arm: Arm, scene: Scene) -> None:
        self._arm, self._scene = arm, scene
        self._index = 0

    def capture(self, q: tuple[float, ...]) -> np.ndarray:
        """Return a picture of the arm at q, rad, BGR."""
        q = (*q, *(joint.home for joint in self._arm.joints[len(q) :]))
        self._index += 1
        camera = SyntheticCamera(self._scene, ScriptedPoses(self._arm, lambda t: q), lambda: 0.0)
        return camera.capture(self._index).image

    def touches(
        self, crosses: list[tuple[float, float]], rng: np.random.Generator
    ) -> list[TouchSight]:
        """Set the pen on crosses by hand, and look."""
        marker = read_spec(EFFECTOR, marker_specs(self._scene.constants)[EFFECTOR])
        free, found = with_free_joints(self._arm), []
        for cross in crosses:
            x, y, _ = board_place(self._scene.constants, np.array([cross]))[0]
            point = np.array([x, y]) + PLACING_ERROR * rng.standard_normal(2)
            q = kinematics.inverse(free, tuple(map(float, point)))
            tracker, seen = Tracker([marker]), np.full((CROSS_PICTURES, 2), np.nan)
            for k in range(CROSS_PICTURES):
                if place := tracker.find(self.capture(q), float(k)).get(EFFECTOR):
                    seen[k] = place.u, place.v
            found.append(touch_sight(cross, Sights(np.arange(float(CROSS_PICTURES)), seen)))
        return found
