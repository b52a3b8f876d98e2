"""Placement of a camera: as the constants have it, and so that the workspace fits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from laptop.emulator.scene.optics import Pinhole
from laptop.emulator.scene.scene_constants import BadScene
from laptop.emulator.scene.workcell import Workcell, workcell
from shared.arm_description import Arm

MAX_DISTANCE = 2000.0
"""Greatest distance from which the workspace is tried to fit, cm."""


def place_camera(arm: Arm, constants: dict[str, Any]) -> Pinhole:
    """Return the camera as the constants have it, placed so that the workspace fits.

    In space that is all above the table; with a distance given, its middle is in the middle.

    Raises:
        BadScene: the arm cannot be shown so.
    """
    return camera_on(workcell(arm, constants))


def camera_on(cell: Workcell) -> Pinhole:
    """Return the camera as `place_camera` does, for a workcell.

    Raises:
        BadScene: it would stand below the table.
    """
    constants = cell.constants
    points = cell.frame_points()
    near, far = 1.0, constants["distance"] or MAX_DISTANCE
    while constants["distance"] is None and far - near > 0.05:
        middle = (near + far) / 2
        fits = _shows(_aimed(cell, points, middle), points)
        near, far = (near, middle) if fits else (middle, far)
    camera = _aimed(cell, points, far)
    if camera.position[2] <= 0:
        raise BadScene(
            f"camera {constants['camera']} stands {-camera.position[2]:.1f} cm below the table;"
            " take another aim_z or less tilt"
        )
    return camera


def _aimed(cell: Workcell, points: np.ndarray, distance: float) -> Pinhole:
    """Return the camera at a distance, cm, aimed at the middle of points (n, 3), cm.

    What the constants fix of its aim stays.
    """
    constants = cell.constants
    size = constants["width"], constants["height"]
    tilt, azimuth, roll = (math.radians(constants[key]) for key in ("tilt", "azimuth", "roll"))
    lens = constants["focal"], size, constants["k1"], constants["k2"]
    given = [constants[key] for key in ("aim_x", "aim_y", "aim_z")]
    free = np.array([value is None for value in given])
    fixed = np.array([0.0 if value is None else value for value in given])
    aim = start = np.where(free, cell.aim_start(points), fixed)
    for _ in range(8):
        camera = Pinhole.aimed(aim, distance, (tilt, azimuth, roll), *lens)
        if not cell.can_aim(camera, points, distance):
            aim = start
            break
        shown = camera.project(points)
        off = (shown.min(axis=0) + shown.max(axis=0)) / 2 - camera.centre
        # A step sideways by the offset of the middle.
        step = camera.rotation[:2].T @ (off / camera.focal * distance)
        aim = aim + np.where(free, cell.aim_step(step, tilt), 0.0)
    return Pinhole.aimed(aim, distance, (tilt, azimuth, roll), *lens)


def _shows(camera: Pinhole, points: np.ndarray) -> bool:
    """Return True if points (n, 3), cm, are all before the camera and in its picture."""
    shown = camera.project(points)
    x, y, z = camera.seen(points).T
    in_front = z.min() > 1 and (np.hypot(x, y) < camera.widest * z).all()
    inside = (shown >= 2).all() and (shown <= np.array(camera.size) - 3).all()
    return bool(in_front and inside)
