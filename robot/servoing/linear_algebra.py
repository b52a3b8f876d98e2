"""Small linear algebra on plain lists, and a median: numpy takes ten times as long on the brick.

Pure.
"""

import math
from operator import mul, sub

from robot.motion.linear_systems import dot as dot

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Sequence  # noqa: F401

    Vector = Sequence[float]
    Matrix = Sequence[Sequence[float]]  # rows


def length(e):
    # type: (Vector) -> float
    """Return the Euclidean norm of a vector."""
    return math.sqrt(sum(map(mul, e, e)))


def distance(a, b):
    # type: (Vector, Vector) -> float
    """Return the distance of two lists of angles in the maximum norm, rad."""
    greatest = max(map(abs, map(sub, a, b)))  # type: float
    return greatest


def median(values):
    # type: (Vector) -> float
    """Return the median of a list of numbers."""
    values = sorted(values)
    half = len(values) // 2
    return values[half] if len(values) % 2 else (values[half - 1] + values[half]) / 2


def cholesky(N):
    # type: (Matrix) -> List[List[float]]
    """Return the rows of the lower triangle L with L L' = N, by the lower triangle of N."""
    L = []  # type: List[List[float]]
    for row in N:
        new, left = [], row[len(L)]  # type: List[float], float
        for value, other in zip(row, L):
            for a, b in zip(new, other):
                value -= a * b
            value /= other[-1]
            left -= value * value
            new.append(value)
        new.append(math.sqrt(left))
        L.append(new)
    return L


def forward_substituted(L, b):
    # type: (Matrix, Vector) -> List[float]
    """Return y with L y = b, for a lower triangle L."""
    y = []  # type: List[float]
    for row, value in zip(L, b):
        for a, known in zip(row, y):
            value -= a * known
        y.append(value / row[-1])
    return y


def back_substituted(L, y):
    # type: (Matrix, Vector) -> List[float]
    """Return x with L' x = y, for a lower triangle L."""
    x = list(y)
    for i in range(len(L) - 1, -1, -1):
        row = L[i]
        x[i] = known = x[i] / row[-1]
        for j in range(i):
            x[j] -= row[j] * known
    return x


def solve_definite(H, b):
    # type: (Matrix, Vector) -> List[float]
    """Return x with H x = b, for a positive definite H (its lower triangle)."""
    if len(b) == 2:  # these two most often by far, and several times as fast
        (a,), (c, d) = H
        det = a * d - c * c
        return [(d * b[0] - c * b[1]) / det, (a * b[1] - c * b[0]) / det]
    if len(b) == 3:  # L D L'
        (d0,), (l1, d1), (l2, l3, d2) = H
        x0, x1, x2 = b
        e1, e2 = l1 / d0, l2 / d0
        d1 -= e1 * l1
        l3 -= e1 * l2
        e3 = l3 / d1
        x1 -= e1 * x0
        x2 = (x2 - e2 * x0 - e3 * x1) / (d2 - e2 * l2 - e3 * l3)
        x1 = x1 / d1 - e3 * x2
        return [x0 / d0 - e1 * x1 - e2 * x2, x1, x2]
    L = cholesky(H)
    return back_substituted(L, forward_substituted(L, b))


def condition(J):
    # type: (Matrix) -> float
    """Return the condition of J (m x n, n 2 or 3): greatest over least singular value, or inf.

    By the roots of the characteristic polynomial of J'J, in closed form (Smith 1961): beyond some
    1e7 rounding outweighs the least.
    """
    columns = list(zip(*J))
    a, b = columns[:2]
    aa, bb, ab = dot(a, a), dot(b, b), dot(a, b)
    if len(columns) == 2:
        middle, spread = (aa + bb) / 2, math.hypot((aa - bb) / 2, ab)
        greatest, least = middle + spread, middle - spread
    else:
        c = columns[2]
        cc, ac, bc = dot(c, c), dot(a, c), dot(b, c)
        middle = (aa + bb + cc) / 3
        x, y, z = aa - middle, bb - middle, cc - middle
        mixed = ab * ab + ac * ac + bc * bc
        spread = math.sqrt((x * x + y * y + z * z + 2 * mixed) / 6)
        if spread == 0:
            return 1.0 if middle else math.inf
        det = x * (y * z - bc * bc) - ab * (ab * z - bc * ac) + ac * (ab * bc - y * ac)
        angle = math.acos(min(max(det / (2 * spread**3), -1.0), 1.0)) / 3
        greatest = middle + 2 * spread * math.cos(angle)
        least = middle + 2 * spread * math.cos(angle + 2 * math.pi / 3)
    return math.sqrt(greatest / least) if least > 0 else math.inf
