import cv2
import numpy as np
import pytest
from board_views import LENS, SIZE, pixels, stand

from laptop.see.table.camera_model import CameraModel, triangulate

FULL = (*LENS, 0.0)


def model(where, lens=FULL, covariance=None):
    turned, shift = where
    rotation = cv2.Rodrigues(turned)[0].ravel()
    return CameraModel(
        SIZE,
        np.array(lens),
        rotation,
        shift,
        np.zeros((14, 14)) if covariance is None else covariance,
    )


def test_it_projects_as_the_formula_does_and_back():
    where = stand(50, 30, 70, 12)
    camera = model(where)
    points = np.random.default_rng(0).uniform((-10, -14, 0), (10, 14, 6), (50, 3))
    seen = camera.project(points)
    assert seen == pytest.approx(pixels(where, points), abs=1e-6)
    for k, point in enumerate(points):
        assert camera.to_table(seen[k : k + 1], point[2])[0] == pytest.approx(point[:2], abs=1e-6)
    assert camera.to_table(seen, points[:, 2]) == pytest.approx(points[:, :2], abs=1e-6)


def test_what_is_above_the_horizon_behind_or_not_in_the_lens_has_no_place():
    camera = model(stand(50, 70))
    middle, sky = camera.to_table(np.array([(320.0, 240.0), (320.0, 0.0)]))
    assert np.isfinite(middle).all()
    assert np.isnan(sky).all()
    assert np.isnan(camera.to_table(np.array([(np.nan, 3.0), (np.inf, 0)]))).all()
    assert np.isnan(camera.project(np.array([camera.position + (0, 0, 5)]))).all()
    # No ray gets there: the lens folds the picture over before.
    assert np.isnan(camera.to_table(np.array([(5000.0, 5000.0)]))).all()
    # A plane above the camera is not met by looking down.
    assert np.isnan(camera.to_table(np.array([(320.0, 240.0)]), 80.0)).all()


def test_nothing_in_gives_nothing_out():
    camera = model(stand(50, 30))
    assert camera.project(np.empty((0, 3))).shape == (0, 2)
    assert camera.to_table(np.empty((0, 2))).shape == (0, 2)
    assert camera.placed(np.empty((0, 2))).covariance.shape == (0, 2, 2)


def test_the_covariance_of_a_place_is_that_of_a_thousand_drawn_cameras():
    where = stand(50, 35, 30)
    rng = np.random.default_rng(1)
    spreads = np.array([4, 1, 1, 0.01, 0.01, 1e-4, 1e-4, 0, *[1e-3] * 3, *[0.02] * 3])
    camera = model(where, covariance=np.diag(spreads**2))
    seen = camera.project(np.array([(4.0, -6.0, 2.0)]))
    drawn = []
    for _ in range(800):
        d = spreads * rng.standard_normal(14)
        other = CameraModel(
            SIZE, camera.lens + d[:8], camera.rotation + d[8:11], camera.translation + d[11:], d
        )
        u = seen + 0.2 * rng.standard_normal(2)
        drawn.append(other.to_table(u, 2.0 + 0.1 * rng.standard_normal())[0])
    reported = camera.placed(seen, 2.0, 0.2, 0.1)
    assert reported.xy[0] == pytest.approx((4, -6), abs=1e-6)
    assert np.cov(np.array(drawn).T) == pytest.approx(reported.covariance[0], rel=0.25, abs=2e-4)


def test_a_plain_lens_from_straight_above_has_its_scale():
    camera = model(stand(50, 0), (600.0, 319.5, 239.5, 0, 0, 0, 0, 0))
    assert camera.px_per_cm(np.zeros((1, 2)))[0] == pytest.approx(12)
    assert camera.px_per_cm(np.zeros((1, 2)), 10.0)[0] == pytest.approx(15)
    assert camera.position == pytest.approx((0, 0, 50))
    assert camera.tilt == pytest.approx(0, abs=1e-6)


def test_two_cameras_place_a_point_in_space_and_tell_when_they_disagree():
    one, other = model(stand(50, 20, 0)), model(stand(55, 40, 100))
    points = np.random.default_rng(2).uniform((-8, -10, 0), (8, 10, 8), (20, 3))
    seen = one.project(points), other.project(points)
    found, gap = triangulate(one, other, *seen)
    assert found == pytest.approx(points, abs=1e-6)
    assert gap == pytest.approx(0, abs=1e-6)
    found, gap = triangulate(one, other, seen[0], seen[1] + (5, -3))
    assert gap.max() > 0.1
    assert np.linalg.norm(found - points, axis=1).max() < 1.5
    assert np.isnan(triangulate(one, one, seen[0][:1], seen[0][:1])[0]).all()
