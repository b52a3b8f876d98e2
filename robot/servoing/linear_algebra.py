"""Small linear algebra on plain lists, and a median: numpy takes ten times as long on the brick.

Pure.
"""

import math
from operator import mul, sub

from robot.motion.linear_systems import dot as dot

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Sequence, Tuple  # noqa: F401

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


def normal_equations(J, e):
    # type: (Matrix, Vector) -> Tuple[List[List[float]], List[float]]
    """Return (the lower triangle of J'J, J'e), for J of 2 or 3 columns.

    Row by row, and written out: there are many on the way to one aim.
    """
    aa = ab = bb = ac = bc = cc = ae = be = ce = 0.0
    if len(J[0]) == 2:
        for (a, b), r in zip(J, e):
            aa += a * a
            ab += a * b
            bb += b * b
            ae += a * r
            be += b * r
        return [[aa], [ab, bb]], [ae, be]
    for (a, b, c), r in zip(J, e):
        aa += a * a
        ab += a * b
        bb += b * b
        ac += a * c
        bc += b * c
        cc += c * c
        ae += a * r
        be += b * r
        ce += c * r
    return [[aa], [ab, bb], [ac, bc, cc]], [ae, be, ce]


def sandwiched(D, C):
    # type: (Matrix, Matrix) -> Matrix
    """Return D C D' for a symmetric C, both 2 x 2 or 3 x 3."""
    if len(C) == 2:
        (p, q), (_, r) = C
        (a, b), (c, d) = D
        pa, qa, pc, qc = p * a + q * b, q * a + r * b, p * c + q * d, q * c + r * d
        mixed = a * pc + b * qc
        return (a * pa + b * qa, mixed), (mixed, c * pc + d * qc)
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = C
    halves = [(xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c)
              for a, b, c in D]  # fmt: skip
    return [[a * x + b * y + c * z for x, y, z in halves] for a, b, c in D]


def solve_definite(H, b):
    # type: (Matrix, Vector) -> List[float]
    """Return x with H x = b, for a positive definite H (its lower triangle), up to 3 x 3."""
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
    return [b[0] / H[0][0]]


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
