"""Who knows a synthetic camera knows where its pixels are."""

import numpy as np
import pytest

from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.ilc.emulated_view import view_of
from shared.arm_description import find_arm, read_arm


def test_the_view_is_the_inverse_of_the_camera():
    arm = read_arm(find_arm("planar"))
    scene = Scene(arm, read_scene("seed=3"))
    view = view_of(scene, arm)
    headings = np.array([0.2, 1.0, 2.0])
    tips = np.array([[10.0, 0.0], [8.0, 6.0], [2.0, 12.0]])
    x, y = arm.marker_offset
    c, s = np.cos(headings), np.sin(headings)
    markers = tips + np.stack([c * x - s * y, s * x + c * y], axis=1)
    height = np.full(3, scene.constants["marker_height"])
    pixels = np.asarray(scene.project(np.column_stack([markers, height])))
    assert view.tips(pixels, headings) == pytest.approx(tips, abs=1e-3)
