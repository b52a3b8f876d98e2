"""Taking points with an arm that is led by hand, and what they measure: distance, angle, midpoint.

The motors coast and the encoders count on.  Within the play a link turns without its motor, so a
joint led by hand is known to half of its play only: see `play_at`.
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
"""The arm is to stand for so long after a press, s."""

STILL_COUNTS = 1.6
"""Counts by which a joint's angle may differ in that time: one, and what rounding adds."""

SAME_PLACE = 0.05
"""Points nearer together than this span no angle, cm."""

if MYPY:
    TouchPoint = NamedTuple(
        "TouchPoint", [("p", Tuple[float, ...]), ("q", Tuple[float, ...]), ("t", float)]
    )
else:
    TouchPoint = record("TouchPoint", "p q t")
TouchPoint.__doc__ = """A point that was taken.

p   the tip, (x, y), cm
q   the joints' angles, rad
t   when, s on the brick's clock
"""


class StillWatch(object):
    """Whether joints led by hand stand still, and where, from readings one after the other.

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
        """Somebody wants a point, at the time `now`, s; what was read before counts no more."""
        if self._since is None:
            self._since = now
            self._seen.clear()

    def see(self, now, angles):
        # type: (float, Sequence[float]) -> Union[None, Literal[False], Tuple[float, ...]]
        """Take in the joints' angles (rad) at the time `now`, s.

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


def play_at(arm, q):
    # type: (Arm, Sequence[float]) -> float
    """How far the tip may be from where the encoders have it, cm: half of each joint's play.

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
    """The point halfway between two, cm."""
    return tuple([(x + y) / 2 for x, y in zip(a, b)])


def angle_at(a, b, c):
    # type: (Point, Point, Point) -> Optional[float]
    """The angle at `b` between the ways to `a` and to `c`, rad, 0 to pi; None where there is none.

    By the arc tangent of cross and dot product, which is as exact near 0 and pi as between.
    """
    if min(kinematics.distance(a, b), kinematics.distance(c, b)) < SAME_PLACE:
        return None
    (ux, uy), (vx, vy) = ([p[k] - b[k] for k in (0, 1)] for p in (a, c))
    return math.atan2(abs(ux * vy - uy * vx), ux * vx + uy * vy)


def told(points, play, number):
    # type: (Sequence[Point], float, int) -> List[str]
    """Short lines on the last of some points, which fit the brick's screen.

    Args:
        points: the last tips, (x, y), cm: up to three.
        play: see `play_at`, of the last one.
        number: of the last one, from 1 on.
    """
    lines = ["point {}: {} cm".format(number, _pair(points[-1]))]
    if play >= 0.05:
        lines.append("to {:.1f} cm (play)".format(play))
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
