"""Small systems of equations against hand-computed solutions and numpy."""

import itertools
import math

import pytest

from robot.motion.kinematics import jacobian
from robot.motion.linear_systems import Singular, broyden_update, damped_solve, solve
from shared.arm_description import ArmError, find_arm, read_arm

ARM = read_arm(find_arm("planar"))


def test_solve_by_hand():
    assert solve([[2, 1], [1, 3]], [5, 10]) == pytest.approx([1, 3])


def test_solve_swaps_rows_where_the_diagonal_is_zero():
    assert solve([[0, 2, 0], [3, 0, 0], [0, 0, 4]], [2, 6, 12]) == pytest.approx([2, 1, 3])


def test_solve_pivots_where_the_diagonal_is_tiny():
    assert solve([[1e-12, 1], [1, 1]], [1, 2]) == pytest.approx([1, 1], abs=1e-9)


def test_solve_leaves_its_arguments_alone():
    rows, b = [[0.0, 2.0], [3.0, 0.0]], [2.0, 6.0]
    solve(rows, b)
    assert (rows, b) == ([[0.0, 2.0], [3.0, 0.0]], [2.0, 6.0])


@pytest.mark.parametrize(
    "rows",
    [
        [[0, 0], [0, 0]],
        [[1, 2], [2, 4]],
        [[0.1, 0.7], [0.3, 2.1]],  # leaves a pivot of 1e-16
        jacobian(ARM, (0.7, 0)),
        [[math.nan, 1], [1, 1]],
    ],
    ids=["zeros", "dependent", "dependent but for rounding", "stretched arm", "NaN"],
)
def test_solve_refuses_a_singular_system(rows):
    with pytest.raises(Singular, match="singular") as caught:
        solve(rows, [1, 2])
    assert isinstance(caught.value, ArmError)


def test_solve_and_damped_solve_are_numpys():
    np = pytest.importorskip("numpy")
    draw = np.random.RandomState(3)
    for height, width in itertools.product(range(1, 5), repeat=2):
        a, b = draw.randn(height, width), draw.randn(height)
        rows, right = a.tolist(), b.tolist()
        if height == width:
            assert solve(rows, right) == pytest.approx(list(np.linalg.solve(a, b)))
        assert damped_solve(rows, right, 0.0) == pytest.approx(list(np.linalg.pinv(a).dot(b)))
        # The oracle: damping as additional rows of a least-squares problem
        stacked = np.vstack([a, 0.3 * np.eye(width)])
        oracle = np.linalg.lstsq(stacked, np.concatenate([b, np.zeros(width)]), rcond=-1)[0]
        assert damped_solve(rows, right, 0.3) == pytest.approx(list(oracle))
        assert solve(rows, right, damping=0.3) == pytest.approx(list(oracle))


def test_damping_keeps_the_step_finite_at_a_singular_pose():
    dq = damped_solve(jacobian(ARM, (0, 0)), [1, 1], 0.1)
    # Only y can move: along the row (20.8, 9.5), shortest solution, by its length squared + 0.1^2
    assert dq == pytest.approx([20.8 / (522.89 + 0.01), 9.5 / (522.89 + 0.01)])


def test_broyden_update_explains_the_step_and_nothing_else():
    rows, dq, dp = ((1.0, 2.0), (3.0, 4.0)), (0.1, -0.2), (0.5, 0.7)
    updated = broyden_update(rows, dq, dp)
    for row, old, moved in zip(updated, rows, dp):
        assert row[0] * dq[0] + row[1] * dq[1] == pytest.approx(moved)
        # Across dq, along (0.2, 0.1), what was known stays
        assert row[0] * 0.2 + row[1] * 0.1 == pytest.approx(old[0] * 0.2 + old[1] * 0.1)
