"""The emulated table has things where trigonometry has them."""

import math

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.emulated_table import camera_over, rng_of
from laptop.see.table.camera_report import shift_since
from robot.motion import kinematics


def test_a_camera_sees_what_it_aims_at_in_the_middle():
    for tilt, azimuth, roll in ((0.0, 0.0, 0.0), (0.3, 1.0, 0.2), (0.5, -2.0, 1.4)):
        camera = camera_over(600.0, (3.0, -2.0), 50.0, tilt, azimuth, roll)
        assert camera.project(np.array([[3.0, -2.0, 0.0]]))[0] == pytest.approx([319.5, 239.5])
        assert math.dist(camera.position, (3.0, -2.0, 0.0)) == pytest.approx(50.0)
        assert camera.tilt == pytest.approx(tilt, abs=1e-6)


def test_the_arm_stands_on_the_board_turned_and_shifted():
    over = seen_arms.table(base=(-10.0, 2.0), turn=math.pi / 2)
    (place,) = over.on_board(np.array([[5.0, 1.0, 2.5]]))
    assert place == pytest.approx([-11.0, 7.0, 2.5])


def test_what_is_outside_the_picture_is_not_seen():
    over = seen_arms.table()
    seen = over.project(np.array([[10.0, 0.0, 0.0], [500.0, 0.0, 0.0]]))
    assert np.isfinite(seen).all(axis=1).tolist() == [True, False]


def test_the_camera_that_is_calibrated_is_the_true_one_and_a_hand_is_nearly_right():
    over = seen_arms.table()
    found = over.calibrated(rng_of(1), 100.0)
    points = np.array([[x, y, z] for x in (-10.0, 8.0) for y in (-6.0, 6.0) for z in (0.0, 3.0)])
    off = found.camera.project(points) - over.camera.project(points)
    assert np.abs(off).max() < 0.5
    assert not shift_since(found, over._view((0.0, 0.0), rng_of(2))).moved
    touches = over.touches(5, rng_of(3))
    assert len(touches) == 5
    assert touches == over.touches(5, rng_of(3))
    assert touches != over.touches(5, rng_of(4))


def test_a_hand_touches_the_crosses_that_were_named():
    over = seen_arms.table(seen_arms.ARM)
    crosses = [(-5.0, 7.5), (0.0, 0.0), (5.0, -7.5)]
    assert [touch.cross for touch in over.touched(crosses, rng_of(1))] == crosses
    with pytest.raises(kinematics.Unreachable):
        over.touched([(50.0, 0.0)], rng_of(1))
