"""Frames: any picture as blue, green, red."""

import numpy as np
import pytest

from laptop.see.camera.frames import bgr


@pytest.mark.parametrize(
    "image",
    [
        np.full((4, 6), 90, np.uint8),
        np.full((4, 6, 1), 90, np.uint8),
        np.full((4, 6, 4), 90, np.uint8),
        np.full((4, 6), 90 << 8, np.uint16),
    ],
    ids=lambda image: str(image.shape),
)
def test_what_a_driver_hands_over_becomes_blue_green_red(image):
    made = bgr(image)
    assert (made.shape, made.dtype) == ((4, 6, 3), np.uint8)
    assert made[0, 0].tolist() == [90, 90, 90]
