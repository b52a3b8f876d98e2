"""Robust weights: an outlier is something else than the tip, and must not move the fit.  Pure."""

from operator import sub

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Tuple  # noqa: F401

    from robot.servoing.image_model import Features, Pose  # noqa: F401

    Learned = Tuple[Tuple[float, ...], Features, float]  # q, s, and the variance of s, px^2

RESIDUAL_SCALE = 3.0
"""Scale of residuals beyond which their weight falls (Geman and McClure), standard deviations."""

MAX_DISAGREEMENT = 3.0
"""Greatest difference at which what was learned early still holds, standard deviations."""


# Least squares believes an outlier in proportion to its size.  With iteratively reweighted least
# squares a residual r counts by the weight w(x), x = (r / scale)^2.  The tail (1 + x)^-2 is that of
# Geman and McClure (1985): the influence r w falls to 0, so a brick of the marker's colour hardly
# pulls, however far off it is.  Huber's weight, the usual one, keeps its influence constant: many
# false sightings at one place would add up.  Below the scale w is 1, so inliers count as in plain
# least squares, which is best for normal noise.  The price is a cost that is not convex: the fit
# must begin near the truth.  Its prior, and the fit before, see to that.


def robust_weight(excess):
    # type: (float) -> float
    """Return the weight, 0 to 1, of a residual whose square is `excess` times that of the scale."""
    return 1.0 if excess <= 1 else (1.0 + excess) ** -2


def agrees(early, q, s):
    # type: (Learned, Pose, Features) -> bool
    """Return whether what was learned early is of the arm at q, and near what is seen in the end.

    Args:
        early: (q, s, variance), rad, px and px^2.
        q: joint angles, rad (n).
        s: px (m).
    """
    at, seen, variance = early
    square = sum([d * d for d in map(sub, seen, s)])
    return at == tuple(q) and square < MAX_DISAGREEMENT**2 * variance * len(s)
