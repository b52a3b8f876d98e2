"""View of an emulated arm's tip by a synthetic camera that is known exactly."""

from __future__ import annotations

import cv2
import numpy as np

from laptop.emulator.scene.scene import Scene
from laptop.measure.ilc.view import TipView
from laptop.see.table.camera_model import CameraModel
from shared.arm_description import Arm


def view_of(scene: Scene, arm: Arm) -> TipView:
    """Return the view that a calibrated camera has, its board lying in the arm's frame.

    Args:
        scene: what it sees.
        arm: as it is described, whose marker_offset counts.
    """
    camera = scene.camera
    lens = np.array([camera.focal, *camera.centre, camera.k1, camera.k2, 0.0, 0.0, 0.0])
    model = CameraModel(
        camera.size,
        lens,
        cv2.Rodrigues(camera.rotation)[0].ravel(),
        -camera.rotation @ camera.position,
        np.zeros((14, 14)),
    )
    return TipView(model, scene.constants["marker_height"], arm.marker_offset)
