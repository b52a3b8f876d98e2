"""The servo's pure parts against numpy: least squares, singular values, the textbook's filter."""

# J, P: the letters of the literature.
# ruff: noqa: N803, N806

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from robot.servoing import affine_camera, chain_model, local_jacobian
from robot.servoing.chain_model import ChainModel
from robot.servoing.image_model import straight
from robot.servoing.linear_algebra import condition
from robot.servoing.local_jacobian import LocalJacobian
from robot.servoing.pose_search import best_pose


def test_the_filter_is_the_textbooks():
    """Kalman's equations with the state vec(J), as matrices, on steps without outliers."""
    rng = np.random.default_rng(7)
    m, n = 2, 3
    true = rng.normal(0, 300, (m, n))
    model = LocalJacobian(m, n)
    x, P = np.zeros(m * n), np.eye(m * n) * local_jacobian.FIRST_SIGMA**2
    q = np.zeros(n)
    s, variance = true @ q, 1.0
    model.observe(q.tolist(), s.tolist(), variance)
    for _ in range(40):
        dq = rng.normal(0, 0.15, n)
        # Noise well below the variance that is claimed: nothing here is an outlier.
        ds = true @ dq + rng.normal(0, 0.5, m)
        new_variance = float(rng.uniform(1, 3))
        q, s = q + dq, s + ds
        model.observe(q.tolist(), s.tolist(), new_variance)

        bent = local_jacobian.CHANGE_PER_RADIAN**2 * (dq @ dq) * (x @ x) / m
        P = P + bent * np.eye(m * n)
        cap = local_jacobian.FIRST_SIGMA**2
        P[np.diag_indices(m * n)] = np.minimum(np.diag(P), cap)
        H = np.kron(np.eye(m), dq)
        S = H @ P @ H.T + (variance + new_variance) * np.eye(m)
        K = P @ H.T @ np.linalg.inv(S)
        x = x + K @ (ds - H @ x)
        P = (np.eye(m * n) - K @ H) @ P
        least = local_jacobian.MIN_SIGMA**2
        P[np.diag_indices(m * n)] = np.maximum(np.diag(P), least)
        variance = new_variance

        assert np.allclose(np.array(model.J).ravel(), x, rtol=1e-6, atol=1e-5)
        assert np.allclose(np.kron(np.eye(m), model.covariance()), P, rtol=1e-6, atol=1e-4)
        assert np.linalg.eigvalsh(P).min() > 0


LINKS = 11.3, 9.5


def planar_terms(q):
    headings = np.cumsum(q)
    return np.array([1.0, np.array(LINKS) @ np.cos(headings), np.array(LINKS) @ np.sin(headings)])


def similarity(poses, seen, weights):
    """d of u + iv = o + d (x - iy) by numpy, d being near 0 by the prior, and its variance."""
    terms = np.array([planar_terms(q) for q in poses])
    root = np.sqrt(weights)
    columns = np.column_stack([np.ones(len(poses)), terms[:, 1] - 1j * terms[:, 2]])
    A = np.vstack([root[:, None] * columns, [0, 1 / affine_camera.SCALE_SIGMA]])
    z = np.append(root * (seen[:, 0] + 1j * seen[:, 1]), 0)
    return np.linalg.lstsq(A, z, rcond=None)[0][1], np.linalg.inv(A.conj().T @ A)[1, 1].real


def test_the_chains_fit_is_numpys_weighted_ridge():
    """As stacked rows: key-frames by their standard deviations, the prior by its square root.

    Some fits weigh the key-frames for the place that they are seen from.
    """
    rng = np.random.default_rng(3)
    n = 2
    poses = rng.uniform(-1.2, 1.2, (10, n))
    variances = rng.uniform(0.1, 4, 10)
    true = rng.normal(0, 10, (2, 3))
    noise = rng.normal(0, 1, (10, 2)) * np.sqrt(variances)[:, None]
    seen = np.array([true @ planar_terms(q) for q in poses]) + noise
    model = ChainModel("planar", LINKS)
    for q, s, variance in zip(poses, seen, variances, strict=True):
        model.observe(q.tolist(), s.tolist(), float(variance))
    here, s_here = rng.uniform(-1, 1, n), rng.normal(0, 100, 2)
    for _ in range(chain_model.REWEIGH_PERIOD + 1):
        picture = model.seen_from(here.tolist(), s_here.tolist())

    distances = ((poses - here) ** 2).sum(axis=1)
    sd = np.sqrt(variances + chain_model.SIGMA_PER_RADIAN**2 * distances)
    d, scale_variance = similarity(poses, seen, 1 / sd**2)
    skew = math.hypot(affine_camera.SKEW_SHARE * abs(d), affine_camera.MIN_SKEW)
    whiten = np.diag([1 / affine_camera.OFFSET_SIGMA, 1 / skew, 1 / skew])
    mean = np.array([[0, d.real, d.imag], [0, d.imag, -d.real]])
    A = np.vstack([np.array([planar_terms(q) for q in poses]) / sd[:, None], whiten])
    b = np.vstack([seen / sd[:, None], whiten @ mean.T])
    W = np.linalg.lstsq(A, b, rcond=None)[0].T

    for there in rng.uniform(-2, 2, (5, n)):
        expected = s_here + W @ (planar_terms(there) - planar_terms(here))
        assert np.allclose(picture.predict(there.tolist()), expected, atol=1e-3)

    # and its covariance is that of the slopes of the terms, and of the scale
    h = 1e-6
    slopes = np.array(
        [(planar_terms(here + h * e) - planar_terms(here - h * e)) / (2 * h) for e in np.eye(n)]
    )
    covariance = slopes @ (np.linalg.inv(A.T @ A) + scale_variance * np.eye(3)) @ slopes.T
    assert np.allclose(model.covariance(), covariance, rtol=1e-4, atol=1e-3)
    assert np.linalg.eigvalsh(model.covariance()).min() > 0


@pytest.mark.parametrize("shape", [(2, 2), (3, 3), (4, 2), (4, 3), (6, 3)])
def test_conditions_are_numpys(shape):
    rng = np.random.default_rng(1)
    for _ in range(20):
        J = rng.normal(0, 100, shape)
        assert condition(J.tolist()) == pytest.approx(np.linalg.cond(J), rel=1e-6)
    J[:, 1] = J[:, 0] * 2 + 1e-3 * rng.normal(0, 1, shape[0])
    assert condition(J.tolist()) == pytest.approx(np.linalg.cond(J), rel=1e-3)


@pytest.mark.parametrize("joints", [2, 3])
def test_the_best_pose_is_that_of_every_set_of_walls_tried(joints):
    """The least cost of a quadratic in a box, by solving for every choice of joints at walls."""
    rng = np.random.default_rng(5)
    for _ in range(25):
        J = rng.normal(0, 150, (4, joints))
        goal = rng.normal(0, 150, 4)
        root = rng.normal(0, 30, (joints, joints))
        caution = root.T @ root
        here = rng.uniform(-0.5, 0.5, joints)
        low, high = here - rng.uniform(0, 0.8, joints), here + rng.uniform(0, 0.8, joints)

        def cost(q, J=J, goal=goal, caution=caution, here=here):
            e, x = J @ q - goal, q - here
            return e @ e + x @ caution @ x

        best = math.inf
        for walls in itertools.product((None, 0, 1), repeat=joints):
            q = np.array([0.0 if w is None else (low, high)[w][k] for k, w in enumerate(walls)])
            free = [k for k, w in enumerate(walls) if w is None]
            if free:
                H = J.T @ J + caution
                b = J.T @ goal + caution @ here - H @ q
                q[free] = np.linalg.solve(H[np.ix_(free, free)], b[free])
            if np.all(q >= low - 1e-9) and np.all(q <= high + 1e-9):
                best = min(best, cost(q))

        found, left = best_pose(
            straight(J.tolist()), goal.tolist(), here.tolist(),
            (low.tolist(), high.tolist()), here.tolist(), caution.tolist(),
        )  # fmt: skip
        assert np.all(found >= low)
        assert np.all(found <= high)
        assert left == pytest.approx(np.linalg.norm(J @ found - goal), abs=1e-6)
        # a joint that is at a wall too early may cost a little
        assert cost(np.array(found)) <= 1.05 * best + 4


def test_the_best_pose_before_a_bent_camera_is_the_one_of_a_grid():
    """A pinhole over a two-joint arm; goals in and out of reach; the grid is 1.5 degrees fine."""

    def see(q):
        x = 11.3 * np.cos(q[0]) + 9.5 * np.cos(q[0] + q[1])
        y = 11.3 * np.sin(q[0]) + 9.5 * np.sin(q[0] + q[1])
        depth = 60 - 0.2 * x + 0.3 * y
        return np.array([320 + 700 * x / depth, 240 - 700 * y / depth])

    def jacobian(q, h=1e-6):
        columns = [(see(q + h * e) - see(q - h * e)) / (2 * h) for e in np.eye(2)]
        return tuple(map(tuple, np.array(columns).T.tolist()))

    picture = SimpleNamespace(
        predict=lambda q: see(q).tolist(), jacobian=lambda q: jacobian(np.array(q))
    )
    low, high = np.array([-0.5, 0.1]), np.array([1.2, 2.0])
    grid = np.stack(
        np.meshgrid(np.linspace(low[0], high[0], 66), np.linspace(low[1], high[1], 73)), axis=-1
    )
    pixels = see(np.moveaxis(grid, -1, 0))
    zeros = [[0.0, 0.0], [0.0, 0.0]]
    for goal in ([400, 60], [500, 120], [330, 140], [620, 240], [380, 300]):
        far = np.hypot(pixels[0] - goal[0], pixels[1] - goal[1])
        start = [0.4, 1.0]
        q, left = best_pose(picture, goal, start, (low.tolist(), high.tolist()), start, zeros, 40)
        assert np.all(q >= low)
        assert np.all(q <= high)
        assert left <= far.min() + 1.5
