"""Affine cameras, fitted with what is known of cameras before: by numpy and scipy."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares

from robot.servoing import affine_camera
from robot.servoing.affine_camera import planar_camera, spatial_camera


def sums_of(places, seen, weights):
    """Return what the fits take: t = (1, p), weighted."""
    t = np.column_stack([np.ones(len(places)), places])
    N = (t * weights[:, None]).T @ t
    sides = (t * weights[:, None]).T @ seen
    lower = [N[i, j] for i in range(len(N)) for j in range(i + 1)]
    return lower + list(sides[:, 0]) + list(sides[:, 1])


def orthographic(rng, scale):
    """Return a random scaled orthographic projection, 2 x 3, px/cm."""
    return scale * np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]


def frames(rng, camera, n=9, size=1.5, sigma=0.7):
    """Return places, what is seen of them, and weights."""
    places = np.array([12.0, -4.0, 9.0]) + rng.normal(0, size, (n, 3))
    return (
        places,
        places @ camera.T + (320, 240) + rng.normal(0, sigma, (n, 2)),
        np.full(n, sigma**-2),
    )


def most_probable(places, seen, weights, a):
    """Return W and the covariance of its rows by scipy, the constraint's variance being that at a.

    The rows' covariance is the mean of u's and v's.
    """
    sigma = math.hypot(affine_camera.SKEW_SHARE * a / math.sqrt(2), affine_camera.MIN_SKEW)

    def residuals(x):
        W = x.reshape(2, 4)
        off = (seen - W[:, 0] - places @ W[:, 1:].T) * np.sqrt(weights)[:, None]
        b = W[0, 1:] + 1j * W[1, 1:]
        h = b @ b / (2 * a * sigma)
        before = W[:, 1:] / affine_camera.SCALE_SIGMA
        return np.concatenate([off.ravel(), [h.real, h.imag], before.ravel()])

    plain = np.linalg.lstsq(np.column_stack([np.ones(len(places)), places]), seen, rcond=None)[0].T
    found = least_squares(residuals, plain.ravel(), x_scale="jac", xtol=1e-12, ftol=1e-12)
    C = np.linalg.inv(found.jac.T @ found.jac)
    return found.x.reshape(2, 4), (C[1:4, 1:4] + C[5:, 5:]) / 2


@pytest.mark.parametrize("seed", range(6))
def test_a_camera_in_space_is_the_most_probable_one(monkeypatch, seed):
    monkeypatch.setattr(affine_camera, "ITERATIONS", 60)
    rng = np.random.default_rng(seed)
    A = orthographic(rng, rng.uniform(5, 15)) + rng.normal(0, 1, (2, 3))
    seen = frames(rng, A)
    W, C = map(np.array, spatial_camera(sums_of(*seen)))
    expected, covariance = most_probable(*seen, np.linalg.norm(W[:, 1:]))
    assert np.allclose(W[:, 1:], expected[:, 1:], atol=0.02)
    assert np.allclose(W[:, 0], expected[:, 0], atol=0.5)
    assert np.allclose(C, covariance, rtol=0.05, atol=0.02 * np.abs(covariance).max())


def test_a_few_frames_pin_down_an_orthographic_camera():
    """By 9 frames all but in a plane, beside least squares that knows nothing before."""
    better, plain = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        A = orthographic(rng, 9.0)
        places, seen, weights = frames(rng, A, size=(2.0, 2.0, 0.1))
        W = np.array(spatial_camera(sums_of(places, seen, weights))[0])
        t = np.column_stack([np.ones(len(places)), places])
        free = np.linalg.lstsq(t, seen, rcond=None)[0].T
        better.append(np.linalg.norm(W[:, 1:] - A))
        plain.append(np.linalg.norm(free[:, 1:] - A))
    assert np.median(better) < 0.75 * np.median(plain)


def test_many_frames_outweigh_what_is_known_before():
    """Pixels that are no squares, and a picture that is mirrored."""
    rng = np.random.default_rng(0)
    for A in np.array([[12.0, 0, 3], [1, -4, 2]]), np.array([[9.0, 0, 0], [0, 9, 1]]):
        seen = frames(rng, A, n=200, size=8, sigma=0.1)
        W, C = map(np.array, spatial_camera(sums_of(*seen)))
        assert np.allclose(W[:, 1:], A, atol=0.02)
        assert np.sqrt(np.diag(C)).max() < 0.01
        places, *rest = seen
        flat = np.array(planar_camera(sums_of(places[:, :2], rest[0] - places[:, 2:] @ A.T[2:],
                                              rest[1]))[0])  # fmt: skip
        assert np.allclose(flat[:, 1:], A[:, :2], atol=0.02)


@pytest.mark.parametrize(("camera", "size"), [(planar_camera, 3), (spatial_camera, 4)])
def test_one_frame_or_none_is_enough_to_go_on(camera, size):
    for n in 0, 1:
        place, pixel = np.full((n, size - 1), 7.0), np.full((n, 2), 300.0)
        W, C = camera(sums_of(place, pixel, np.ones(n)))
        assert np.isfinite(W).all()
        assert np.linalg.eigvalsh(C).min() > 0
        if n:
            assert np.array(W) @ [1, *place[0]] == pytest.approx(pixel[0], abs=0.01)
