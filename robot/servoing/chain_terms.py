"""Kinematic chains of revolute joints, by the terms in which their image is linear.  Pure.

q      joint angles, rad
terms  1 and the tip's place by the described links, cm; then what J needs beside it
W      image coefficients: a row for each image feature, of an offset, px, and of px/cm for each
       axis of space
"""

import math

from robot.servoing.affine_camera import planar_camera, spatial_camera
from robot.servoing.image_model import Chain

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List  # noqa: F401

    from robot.servoing.affine_camera import Camera  # noqa: F401
    from robot.servoing.image_model import Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401


class ChainTerms(object):
    """The terms of one arm's chain.

    Args:
        links: their lengths, cm (n).

    Attributes:
        size: number of the terms in which the image is linear.
        chain: Chain.
    """

    size = 0

    @staticmethod
    def camera(sums):
        # type: (Vector) -> Camera
        """Fit the camera, as affine_camera does."""
        raise NotImplementedError

    def __init__(self, links):
        # type: (Vector) -> None
        self._links = links[-2:]
        self.chain = Chain(self.terms, self.jacobian)

    def terms(self, q):
        # type: (Pose) -> List[float]
        """Return the terms at q (rad)."""
        raise NotImplementedError

    def jacobian(self, terms, W):
        # type: (Vector, Matrix) -> Matrix
        """Return W d terms / dq, px/rad: m rows, n columns."""
        raise NotImplementedError

    def slopes(self, terms):
        # type: (Vector) -> Matrix
        """Return the tip's dp/dq, cm/rad: a list for each joint."""
        raise NotImplementedError


class PlanarTerms(ChainTerms):
    """1, x, y; x and y of the forearm."""

    size = 3
    camera = staticmethod(planar_camera)

    def terms(self, q):
        # type: (Pose) -> List[float]
        """Return the terms at q (rad)."""
        first, second = q
        second += first
        upper, fore = self._links
        x2, y2 = fore * math.cos(second), fore * math.sin(second)
        return [1.0, upper * math.cos(first) + x2, upper * math.sin(first) + y2, x2, y2]

    def jacobian(self, terms, W):
        # type: (Vector, Matrix) -> Matrix
        """Return W d terms / dq, px/rad."""
        _, x, y, x2, y2 = terms
        return [[b * x - a * y, b * x2 - a * y2] for _, a, b in W]

    def slopes(self, terms):
        # type: (Vector) -> Matrix
        """Return dp/dq: the first joint turns both links."""
        _, x, y, x2, y2 = terms
        return [-y, x], [-y2, x2]


class SpatialTerms(ChainTerms):
    """1, x, y, z above the shoulder; cosine and sine of the yaw; the reach, its and z's forearm.

    The reach is out from the base's axis.
    """

    size = 4
    camera = staticmethod(spatial_camera)

    def terms(self, q):
        # type: (Pose) -> List[float]
        """Return the terms at q (rad)."""
        yaw, first, second = q
        second += first
        upper, fore = self._links
        cos, sin = math.cos(yaw), math.sin(yaw)
        out2, z2 = fore * math.cos(second), fore * math.sin(second)
        out, z = upper * math.cos(first) + out2, upper * math.sin(first) + z2
        return [1.0, out * cos, out * sin, z, cos, sin, out, out2, z2]

    def jacobian(self, terms, W):
        # type: (Vector, Matrix) -> Matrix
        """Return W d terms / dq, px/rad."""
        _, x, y, z, cos, sin, out, out2, z2 = terms
        J = []
        for _, a, b, c in W:
            ahead = a * cos + b * sin
            J.append([b * x - a * y, c * out - ahead * z, c * out2 - ahead * z2])
        return J

    def slopes(self, terms):
        # type: (Vector) -> Matrix
        """Return dp/dq: the yaw turns all that reaches out."""
        _, x, y, z, cos, sin, out, out2, z2 = terms
        return (
            [-y, x, 0.0],
            [-z * cos, -z * sin, out],
            [-z2 * cos, -z2 * sin, out2],
        )


CHAINS = {"planar": PlanarTerms, "spatial": SpatialTerms}
"""ChainTerms of each kind of chain."""
