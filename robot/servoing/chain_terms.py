"""Kinematic chains of revolute joints, by the terms in which their image is linear.  Pure.

q      joint angles, rad
terms  1, and sines and cosines of the links' headings: a list of numbers
W      coefficients of the terms, px: a row of each image feature
"""

import math

from robot.servoing.image_model import Chain

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Tuple  # noqa: F401

    from robot.servoing.image_model import Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    _Found = Callable[[Vector], Matrix]


def _planar_terms(q):
    # type: (Pose) -> List[float]
    """Return 1, and cosine and sine of each link's heading: in a planar chain the angles add up."""
    first, second = q
    second += first
    return [1.0, math.cos(first), math.sin(first), math.cos(second), math.sin(second)]


def _planar_slopes(terms):
    # type: (Vector) -> Matrix
    """Return d terms / dq, a list for each joint: the first one turns both links."""
    _, cos1, sin1, cos2, sin2 = terms
    return [0.0, -sin1, cos1, -sin2, cos2], [0.0, 0.0, 0.0, -sin2, cos2]


def _planar_jacobian(terms, W):
    # type: (Vector, Matrix) -> Matrix
    """Return W d terms / dq, without its zeros."""
    _, cos1, sin1, cos2, sin2 = terms
    J = []
    for _, a, b, c, d in W:
        forearm = d * cos2 - c * sin2
        J.append([b * cos1 - a * sin1 + forearm, forearm])
    return J


def _planar_axes(links):
    # type: (Vector) -> Matrix
    """Return the tip's coordinates in space as coefficients of the terms, cm: a row per axis."""
    x_terms, y_terms = [0.0], [0.0]
    for link in links:
        x_terms += [link, 0.0]
        y_terms += [0.0, link]
    return [x_terms, y_terms]


def _spatial_terms(q):
    # type: (Pose) -> List[float]
    """Return 1, cosine and sine of the yaw; of both pitching links the reach up, ahead, aside."""
    yaw, first, second = q
    second += first
    cos, sin = math.cos(yaw), math.sin(yaw)
    out1, out2 = math.cos(first), math.cos(second)
    return [
        1.0, cos, sin, math.sin(first), out1 * cos, out1 * sin,
        math.sin(second), out2 * cos, out2 * sin,
    ]  # fmt: skip


def _spatial_slopes(terms):
    # type: (Vector) -> Matrix
    """Return d terms / dq, a list for each joint: the yaw turns all that reaches out."""
    _, cos, sin, z1, x1, y1, z2, x2, y2 = terms
    forearm = [x2 * cos + y2 * sin, -z2 * cos, -z2 * sin]
    return (
        [0.0, -sin, cos, 0.0, -y1, x1, 0.0, -y2, x2],
        [0.0, 0.0, 0.0, x1 * cos + y1 * sin, -z1 * cos, -z1 * sin] + forearm,
        [0.0] * 6 + forearm,
    )


def _spatial_jacobian(terms, W):
    # type: (Vector, Matrix) -> Matrix
    """Return W d terms / dq, without its zeros."""
    _, cos, sin, z1, x1, y1, z2, x2, y2 = terms
    out1, out2 = x1 * cos + y1 * sin, x2 * cos + y2 * sin
    J = []
    for _, a, b, c, d, e, f, g, h in W:
        forearm = f * out2 - (g * cos + h * sin) * z2
        both = c * out1 - (d * cos + e * sin) * z1 + forearm
        yawed = b * cos - a * sin + e * x1 - d * y1 + h * x2 - g * y2
        J.append([yawed, both, forearm])
    return J


def _spatial_axes(links):
    # type: (Vector) -> Matrix
    """Return what _planar_axes does: out from the base's axis, ahead and aside; and upwards."""
    x_terms, y_terms, z_terms = [0.0] * 3, [0.0] * 3, [0.0] * 3
    for link in links[1:]:
        z_terms += link, 0.0, 0.0
        x_terms += 0.0, link, 0.0
        y_terms += 0.0, 0.0, link
    return [x_terms, y_terms, z_terms]


CHAINS = {  # type: Dict[str, Tuple[Chain, _Found, _Found]]
    "planar": (Chain(_planar_terms, _planar_jacobian), _planar_slopes, _planar_axes),
    "spatial": (Chain(_spatial_terms, _spatial_jacobian), _spatial_slopes, _spatial_axes),
}
"""Chain of each kind, with functions for the derivatives of its terms and for the axes of space."""
