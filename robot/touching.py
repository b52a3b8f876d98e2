"""Points taken by hand guiding, and what they measure: distance, angle, midpoint.

The motors coast and the encoders count on.  Within its backlash a link turns without its motor.  So
a joint that is guided by hand is known to half of its backlash only: see `backlash_at`.  In texts
for people backlash is "play".
"""

import math
from collections import deque

from robot.motion import kinematics
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Deque,
        List,
        Literal,
        NamedTuple,
        Optional,
        Sequence,
        Tuple,
        Union,
    )

    from shared.arm_description import Arm  # noqa: F401

    Point = Sequence[float]  # the tip, (x, y), cm

STILL_TIME = 0.3
"""Time for which the arm is to stand after a press, s."""

STILL_COUNTS = 1.6
"""Greatest span of a joint's angle in that time, counts: one, and what rounding adds."""

SAME_PLACE = 0.05
"""Least distance of points that span an angle, cm."""

if MYPY:
    TouchPoint = NamedTuple(
        "TouchPoint", [("p", Tuple[float, ...]), ("q", Tuple[float, ...]), ("t", float)]
    )
else:
    TouchPoint = record("TouchPoint", "p q t")
TouchPoint.__doc__ = """A point that was taken.

p   tip, (x, y), cm
q   the joints' angles, rad
t   time, s on the brick's clock
"""


class StandstillDetector(object):
    """Detector of joints that stand still under hand guiding, from readings one after the other.

    Args:
        resolutions: rad per count, of each joint.
    """

    def __init__(self, resolutions):
        # type: (Sequence[float]) -> None
        self._limits = [STILL_COUNTS * one for one in resolutions]
        self._since = None  # type: Optional[float]
        self._seen = deque()  # type: Deque[Sequence[float]]

    def press(self, now):
        # type: (float) -> None
        """Begin to wait for a point, at the time `now`, s; earlier readings count no more."""
        if self._since is None:
            self._since = now
            self._seen.clear()

    def see(self, now, angles):
        # type: (float, Sequence[float]) -> Union[None, Literal[False], Tuple[float, ...]]
        """Handle a reading of the joints.

        Args:
            now: its time, s.
            angles: the joints' angles, rad.

        Returns:
            None: no point is wanted, or it is too early to tell; False: the joints moved; else
            their mean angles, rad.
        """
        if self._since is None:
            return None
        self._seen.append(angles)
        spans = [max(column) - min(column) for column in zip(*self._seen)]
        if any(span > limit for span, limit in zip(spans, self._limits)):
            self._since = None
            return False
        if now - self._since < STILL_TIME:
            return None
        self._since = None
        return tuple([sum(column) / len(column) for column in zip(*self._seen)])


def backlash_at(arm, q):
    # type: (Arm, Sequence[float]) -> float
    """Return how far the tip may be from where the encoders have it, cm.

    Each joint adds half of its backlash (rad) times its axis' distance from the tip (cm); they sum
    up in the worst case.

    Args:
        arm: shared.arm_description.Arm.
        q: joint angles, rad.
    """
    *axes, tip = kinematics.joint_positions(arm, q)
    return sum(
        kinematics.distance(axis, tip) * joint.backlash / 2 for axis, joint in zip(axes, arm.joints)
    )


def midpoint(a, b):
    # type: (Point, Point) -> Tuple[float, ...]
    """Return the point halfway between two, cm."""
    return tuple([(x + y) / 2 for x, y in zip(a, b)])


def angle_at(a, b, c):
    # type: (Point, Point, Point) -> Optional[float]
    """Return the angle at `b` between the lines to `a` and `c`, rad, 0 to pi; None if undefined.

    By the arc tangent of cross and dot product, which is as exact near 0 and pi as between; the arc
    cosine of the dot product loses half of its digits there.

    Args:
        a: point (x, y), cm.
        b: the vertex, likewise.
        c: likewise.
    """
    if min(kinematics.distance(a, b), kinematics.distance(c, b)) < SAME_PLACE:
        return None
    (ux, uy), (vx, vy) = ([p[k] - b[k] for k in (0, 1)] for p in (a, c))
    return math.atan2(abs(ux * vy - uy * vx), ux * vx + uy * vy)


def describe_points(points, backlash, number):
    # type: (Sequence[Point], float, int) -> List[str]
    """Return short lines on the last of some points, which fit the brick's screen.

    Args:
        points: the last tips, (x, y), cm: up to three.
        backlash: see `backlash_at`, of the last one, cm.
        number: number of the last one, from 1 on.
    """
    lines = ["point {}: {} cm".format(number, _pair(points[-1]))]
    if backlash >= 0.05:
        lines.append("to {:.1f} cm (play)".format(backlash))
    if len(points) > 1:
        a, b = points[-2:]
        lines.append("distance {:.2f} cm".format(kinematics.distance(a, b)))
    if len(points) > 2:
        angle = angle_at(*points)
        lines.append(
            "no angle: same place"
            if angle is None
            else "angle {:.1f} deg at {}".format(math.degrees(angle), number - 1)
        )
    if len(points) > 1:
        lines.append("middle {} cm".format(_pair(midpoint(a, b))))
    return lines


def _pair(point):
    # type: (Point) -> str
    return ",".join("{:.2f}".format(value + 0.0) for value in point)
