"""Small linear algebra on plain lists, and a median: numpy takes ten times as long on the brick.

Pure.
"""

import math
from operator import mul, sub


def dot(a, b):
    """Inner product."""
    return sum(map(mul, a, b))


def length(e):
    """Euclidean."""
    return math.sqrt(sum(map(mul, e, e)))


def apart(a, b):
    """Greatest difference of two lists of angles, rad."""
    return max(map(abs, map(sub, a, b)))


def median(values):
    """Of a list of numbers."""
    values = sorted(values)
    half = len(values) // 2
    return values[half] if len(values) % 2 else (values[half - 1] + values[half]) / 2


def cholesky(N):
    """Rows of the lower triangle L with L L' = N, for a positive definite N (its lower part)."""
    L = []
    for row in N:
        new, left = [], row[len(L)]
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
    """y with L y = b."""
    y = []
    for row, value in zip(L, b):
        for a, known in zip(row, y):
            value -= a * known
        y.append(value / row[-1])
    return y


def back_substituted(L, y):
    """x with L' x = y."""
    x = list(y)
    for i in range(len(L) - 1, -1, -1):
        row = L[i]
        x[i] = known = x[i] / row[-1]
        for j in range(i):
            x[j] -= row[j] * known
    return x


def solve_definite(H, b):
    """x with H x = b, for a positive definite H (its lower triangle)."""
    if len(b) == 2:  # most often by far, and several times as fast
        (a,), (c, d) = H
        det = a * d - c * c
        return [(d * b[0] - c * b[1]) / det, (a * b[1] - c * b[0]) / det]
    L = cholesky(H)
    return back_substituted(L, forward_substituted(L, b))


def condition(J):
    """Greatest over least singular value of J (m x n, m >= n); inf where the least is 0.

    By Hestenes' one-sided rotations (1958).
    """
    columns = [list(column) for column in zip(*J)]
    for _ in range(30):
        turned = False
        for i in range(len(columns)):
            for j in range(i + 1, len(columns)):
                a, b = columns[i], columns[j]
                aa, bb, ab = dot(a, a), dot(b, b), dot(a, b)
                if abs(ab) <= 1e-12 * math.sqrt(aa * bb):
                    continue
                turned = True
                angle = 0.5 * math.atan2(2 * ab, aa - bb)
                c, s = math.cos(angle), math.sin(angle)
                columns[i] = [c * x + s * y for x, y in zip(a, b)]
                columns[j] = [c * y - s * x for x, y in zip(a, b)]
        if not turned:
            break
    sizes = [length(column) for column in columns]
    return max(sizes) / min(sizes) if min(sizes) > 0 else float("inf")
