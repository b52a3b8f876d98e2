"""Systems of two, three or a few linear equations, in plain Python.  Pure.

On the brick a 2 x 2 system is solved faster than numpy converts its arguments.  A matrix J is a
tuple of rows.
"""

from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import List, Sequence, Tuple  # noqa: F401

    Vector = Sequence[float]
    Matrix = Sequence[Vector]  # by rows

    def mul(a, b):
        # type: (float, float) -> float
        """Return a * b, as operator.mul, which has no types."""
        return a * b

else:
    from operator import mul

MIN_PIVOT = 1e-13
"""Minimum pivot of a regular matrix, as a share of its greatest element."""

_NO_SOLUTION = (
    "the equations are singular (pivot {:.3g}); move the arm away from its stretched or folded pose"
)


class Singular(ArmError, ArithmeticError):
    """A system of equations without exactly one solution, as at a singular pose."""


def solve(J, b, damping=0.0):
    # type: (Matrix, Vector, float) -> List[float]
    """Return x with J x = b, for a square J; with damping > 0, for any shape, `damped_solve`.

    Gaussian elimination with partial pivoting.  Raises Singular when a pivot is below MIN_PIVOT.
    """
    if damping:
        return damped_solve(J, b, damping)
    n = len(b)
    if n == 2:
        return _solve_two(J, b)
    if n == 3:
        return _solve_three(J, b)
    rows = [list(row) + [value] for row, value in zip(J, b)]
    least = MIN_PIVOT * max(abs(a) for row in J for a in row)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        if not abs(rows[k][k]) > least:  # worded so that NaN ends here, too
            raise Singular(_NO_SOLUTION.format(rows[k][k]))
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] -= factor * rows[k][j]
    x = [0.0] * n
    for k in reversed(range(n)):
        known = sum(rows[k][j] * x[j] for j in range(k + 1, n))
        x[k] = (rows[k][n] - known) / rows[k][k]
    return x


def _solve_two(J, b):
    # type: (Matrix, Vector) -> List[float]
    """Solve two equations by Cramer's rule: by far the most frequent case."""
    (a, c), (d, f) = J
    det = a * f - c * d
    if not abs(det) > MIN_PIVOT * max(abs(a), abs(c), abs(d), abs(f)) ** 2:
        raise Singular(_NO_SOLUTION.format(det))
    return [(b[0] * f - c * b[1]) / det, (a * b[1] - b[0] * d) / det]


def _solve_three(J, b):
    # type: (Matrix, Vector) -> List[float]
    """Solve three equations by Cramer's rule, with the cross products of the columns."""
    (a, d, g), (e, h, k), (f, i, m) = J
    u, v, w = b
    hm, ig, di = h * m - k * i, i * g - d * m, d * k - g * h
    det = a * hm + e * ig + f * di
    if not abs(det) > MIN_PIVOT * max([abs(x) for row in J for x in row]) ** 3:
        raise Singular(_NO_SOLUTION.format(det))
    return [
        (u * hm + v * ig + w * di) / det,
        (u * (k * f - e * m) + v * (a * m - g * f) + w * (g * e - a * k)) / det,
        (u * (e * i - h * f) + v * (d * f - a * i) + w * (a * h - d * e)) / det,
    ]


def damped_solve(J, e, damping):
    # type: (Matrix, Vector, float) -> List[float]
    """Return the x that minimises |J x - e|^2 + damping^2 |x|^2, for a J of any shape.

    x = (J^T J + damping^2 I)^-1 J^T e = J^T (J J^T + damping^2 I)^-1 e (Tikhonov; for arms Wampler,
    1986); the smaller of the two matrices is solved.  `damping` has the unit of J.  With damping 0
    this is the least-squares or the shortest solution, and Singular is raised where J has not full
    rank.
    """
    columns = tuple(zip(*J))  # type: Matrix
    wide = len(J) < len(columns)
    vectors = J if wide else columns
    square = [[dot(a, b) for b in vectors] for a in vectors]
    for i in range(len(square)):
        square[i][i] += damping * damping
    if wide:
        y = solve(square, e)
        return [dot(column, y) for column in columns]
    return solve(square, [dot(column, e) for column in columns])


def dot(a, b):
    # type: (Vector, Vector) -> float
    """Return the inner product of two vectors of the same length."""
    return sum(map(mul, a, b))


def broyden_update(J, dq, dp):
    # type: (Matrix, Vector, Vector) -> Tuple[Tuple[float, ...], ...]
    """Return J + (dp - J dq) dq^T / (dq^T dq) (Broyden, 1965), as rows; dq must not be zero."""
    square = sum(d * d for d in dq)
    return tuple(
        tuple(a + (moved - dot(row, dq)) * d / square for a, d in zip(row, dq))
        for row, moved in zip(J, dp)
    )
