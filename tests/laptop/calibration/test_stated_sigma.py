"""What a camera's fit says of its own error, beside the error: by draws whose truth is known.

The pictures are formulas of `board_views`, so nothing of the fit is in its judge.
"""

import numpy as np
import pytest
from board_views import SIZE, pixels, stand, view

from laptop.calibration.camera_fit import calibrate

X, Y = np.meshgrid(np.linspace(-6, 6, 5), np.linspace(-10, 10, 5))
PLACES = np.column_stack([X.ravel(), Y.ravel()])


def lens(field, luck):
    """A lens that is so many degrees wide, off its middle, and bent."""
    focal = SIZE[0] / 2 / np.tan(np.radians(field) / 2)
    bend = luck.uniform(-0.3, 0.1) * min(1, (focal / SIZE[0]) ** 2)
    return (focal, *(luck.normal(0, 8, 2) + (319.5, 239.5)), bend, -0.3 * min(bend, 0), 0, 0)


def in_sigmas(tilts, field, seed, height=3.0, **options):
    """Errors of places at a height, in standard deviations as stated, (25,)."""
    luck = np.random.default_rng([seed, 41])
    through = lens(field, luck)
    views = []
    for tilt in tilts:
        where = stand(
            0.065 * through[0], tilt, luck.uniform(0, 360), luck.uniform(0, 360),
            luck.uniform(-1, 1, 2),
        )  # fmt: skip
        views.append(view(where, luck, lens=through, **options))
    points = np.column_stack([PLACES, np.full(len(PLACES), height)])
    placed = calibrate(views).camera.placed(pixels(where, points, through), height)
    off = np.linalg.norm(placed.xy - PLACES, axis=1)
    return off / np.sqrt(np.trace(placed.covariance, axis1=1, axis2=2))


@pytest.mark.parametrize("field", [30, 45, 60, 75, 90])
def test_straight_from_above_it_is_sure_of_no_lens_that_cameras_have(field):
    """Of such a view the focal length is what the prior says; what is above the table hangs on it.

    Fields of 30 to 90 degrees are a telephone's second lens to a wide webcam.
    """
    ratios = [in_sigmas([0], field, seed) for seed in range(4)]
    assert np.max(ratios) < 2.5
