"""What is seen may be something else: the farther off, the less it counts.  Pure."""

from operator import sub

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Tuple  # noqa: F401

    from robot.servoing.image_model import Features, Pose  # noqa: F401

    Learned = Tuple[Tuple[float, ...], Features, float]  # q, s, and the variance of s, px^2

RESIDUAL_SCALE = 3.0
"""Residuals beyond so many standard deviations count ever less (Geman and McClure)."""

MAX_DISAGREEMENT = 3.0
"""What was learned early holds if what is seen in the end is no more standard deviations off."""


def trust(excess):
    # type: (float) -> float
    """Weight of a residual by its square, as a share of what is still believed."""
    return 1.0 if excess <= 1 else (1.0 + excess) ** -2


def agrees(early, q, s):
    # type: (Learned, Pose, Features) -> bool
    """Whether what was learned early, (q, s, variance), is of the arm at q, and s what was seen."""
    at, seen, variance = early
    square = sum([d * d for d in map(sub, seen, s)])
    return at == tuple(q) and square < MAX_DISAGREEMENT**2 * variance * len(s)
