"""Paths to draw, as pieces: lines, arcs, circles, rectangles and strokes of any shape.

Pure.  A *piece* is a tuple of points (x, y) or, in space, (x, y, z), cm: two for a straight line,
or more for the smooth curve through them, dense enough where it bends to pass for a polyline.  The
tip moves along a piece without stopping; corners lie between pieces.  A *stroke* is drawn from pen
down to pen up.  Curves lie at one height z.
"""

import math

from robot.motion import kinematics
from shared.arm_description import ArmError

MYPY = False
if MYPY:
    from typing import Iterable, List, Sequence  # noqa: F401

    from robot.motion.chains import FixedPoint, Point  # noqa: F401

    Piece = Sequence[FixedPoint]  # points, cm

POINT_SPACING = 0.05
"""Maximum distance between the points of a curve, cm."""

MAX_ARC_LENGTH = 200.0
"""Maximum length of an arc between two points, cm."""


MIN_CORNER_ANGLE = math.radians(20)
"""Minimum turn of a stroke at a corner, rad; a point with a smaller one is part of a curve."""

COS_MIN_CORNER = math.cos(MIN_CORNER_ANGLE)
"""Cosine of MIN_CORNER_ANGLE."""

MIN_POINT_DISTANCE = 1e-6
"""Minimum distance of two points, cm; nearer ones are the same."""

MAX_COORDINATE = 1000.0
"""Maximum coordinate of a point, cm: out of every arm's reach, and its square is finite."""


class BadPath(ArmError, ValueError):
    """An invalid path: too few points, points that coincide, coordinates that are not finite."""


def _checked(points, fewest, what):
    # type: (Iterable[Point], int, str) -> List[FixedPoint]
    """Return the points as tuples of floats, cm; raise BadPath if they are no path."""
    places = [tuple(map(float, point)) for point in points]
    if len(places) < fewest:
        raise BadPath("{} needs at least {} points, not {}".format(what, fewest, len(places)))
    for point in places:
        if not all(math.isfinite(value) for value in point):
            raise BadPath(
                "{} has the point ({}), which is not a place; give finite numbers in cm".format(
                    what, ", ".join(map(str, point))
                )
            )
        if max(map(abs, point)) > MAX_COORDINATE:
            raise BadPath(
                "{} has the point ({}), farther than {:g} cm away; give a place that the arm can "
                "reach, in cm".format(what, _numbers(point), MAX_COORDINATE)
            )
    for a, b in zip(places, places[1:]):
        if kinematics.distance(a, b) < MIN_POINT_DISTANCE:
            raise BadPath(
                "{} has the point ({}) twice in a row; leave one out".format(what, _numbers(a))
            )
    return places


def _numbers(point):
    # type: (Point) -> str
    """Return a point as text for people."""
    return ", ".join("{:g}".format(value) for value in point)


def _height(points, what):
    # type: (Sequence[FixedPoint], str) -> FixedPoint
    """Return the points' common coordinates after x and y: () in the plane, (z,) in space."""
    if len({point[2:] for point in points}) > 1:
        raise BadPath(
            "{} lies at one height, not at {}; give one z".format(
                what, " and ".join(_numbers(point[2:]) for point in points)
            )
        )
    return tuple(points[0][2:])


def polyline(points):
    # type: (Iterable[Point]) -> List[Piece]
    """Return the straight pieces from each of `points` (cm) to the next."""
    points = _checked(points, 2, "a line")
    return [(a, b) for a, b in zip(points, points[1:])]


def pieces_of(points):
    # type: (Iterable[Point]) -> List[Piece]
    """Return the pieces of a stroke through `points` (cm), cut at its corners.

    Successive points that coincide count as one.

    Raises:
        BadPath: fewer than two distinct points, or an invalid one.
    """
    places = [tuple(map(float, point)) for point in points]
    distinct = places[:1] + [
        b for a, b in zip(places, places[1:]) if not kinematics.distance(a, b) < MIN_POINT_DISTANCE
    ]
    distinct = _checked(distinct, 2, "a stroke")
    directions = [
        [(v - u) / kinematics.distance(a, b) for u, v in zip(a, b)]
        for a, b in zip(distinct, distinct[1:])
    ]
    pieces, first = [], 0  # type: List[Piece], int
    for k, (before, after) in enumerate(zip(directions, directions[1:]), 1):
        if sum([u * v for u, v in zip(before, after)]) < COS_MIN_CORNER:
            pieces.append(tuple(distinct[first : k + 1]))
            first = k
    return pieces + [tuple(distinct[first:])]


def line_from(start, angle, length):
    # type: (Point, float, float) -> List[Piece]
    """Return the piece from `start`, `length` long (cm), in the level direction `angle` (rad)."""
    if not length > 0:
        raise BadPath("a line of length {:g} cm is none; give more than 0".format(length))
    step = (length * math.cos(angle), length * math.sin(angle)) + (0.0,) * (len(start) - 2)
    return polyline([start, tuple(a + b for a, b in zip(start, step))])


def rectangle(corner, opposite):
    # type: (FixedPoint, FixedPoint) -> List[Piece]
    """Return the four pieces of a rectangle along the axes, from `corner` (cm) round to it."""
    height = _height([corner, opposite], "a rectangle")
    (x0, y0), (x1, y1) = corner[:2], opposite[:2]
    if x0 == x1 or y0 == y1:
        raise BadPath(
            "a rectangle from ({:g}, {:g}) to ({:g}, {:g}) is none; give opposite corners".format(
                x0, y0, x1, y1
            )
        )
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
    return polyline([corner + height for corner in corners])


def circle(centre, radius):
    # type: (Point, float) -> List[Piece]
    """Return the piece once round `centre` (cm), counter-clockwise, from nearest to the base."""
    if not 0 < radius <= MAX_COORDINATE:
        raise BadPath(
            "a circle of radius {:g} cm is none; give more than 0 and at most {:g}".format(
                radius, MAX_COORDINATE
            )
        )
    _checked([centre], 1, "a circle")
    start = math.atan2(-centre[1], -centre[0])
    n = max(24, int(math.ceil(2 * math.pi * radius / POINT_SPACING)))
    return [
        tuple(
            (
                centre[0] + radius * math.cos(start + 2 * math.pi * k / n),
                centre[1] + radius * math.sin(start + 2 * math.pi * k / n),
            )
            + tuple(centre[2:])
            for k in range(n + 1)
        )
    ]


def arc(points):
    # type: (Iterable[Point]) -> List[Piece]
    """Return the smooth piece through n >= 3 points, cm.

    Between two points it is (1 - t) A(t) + t B(t), t = 0 .. 1, with A the circle through them and
    the point before, B the one through them and the point after (circle blending: Wenz, 1996).  So
    points of a circle give that circle, which a cubic spline would not; points of a line, the line.
    """
    places = _checked(points, 3, "an arc")
    height = _height(places, "an arc")
    level = [place[:2] for place in places]
    out = [level[0]]
    last = len(level) - 2
    for i in range(last + 1):
        a, b = level[i], level[i + 1]
        circles = [_Circle(level[i - 1], a, b)] if i > 0 else []
        if i < last:
            circles.append(_Circle(a, b, level[i + 2], first=True))
        length = max(circle.length for circle in circles)
        if length > MAX_ARC_LENGTH:
            raise BadPath(
                "the arc near ({:g}, {:g}) would be {:.0f} cm long, more than {:g} is no drawing; "
                "give its points in order".format(a[0], a[1], length, MAX_ARC_LENGTH)
            )
        n = max(2, int(math.ceil(length / POINT_SPACING)))
        for k in range(1, n + 1):
            t = k / float(n)
            p, r = circles[0].at(t), circles[-1].at(t)
            out.append((p[0] + t * (r[0] - p[0]), p[1] + t * (r[1] - p[1])))
    return [tuple(point + height for point in out)]


class _Circle(object):
    """An arc of the circle through three points; of a straight line where they are on one.

    Args:
        a, b, c: points (x, y), cm.
        first: whether the arc is from a to b, not from b to c.
    """

    def __init__(self, a, b, c, first=False):
        # type: (Point, Point, Point, bool) -> None
        self.start, self.end = (a, b) if first else (b, c)
        ux, uy = b[0] - a[0], b[1] - a[1]
        vx, vy = c[0] - a[0], c[1] - a[1]
        cross = ux * vy - uy * vx
        self.centre = None
        chord = math.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])
        self.length = chord
        if abs(cross) < 1e-9 * max(1.0, ux * ux + uy * uy + vx * vx + vy * vy):
            return
        uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
        self.centre = (
            a[0] + (vy * uu - uy * vv) / (2 * cross),
            a[1] + (ux * vv - vx * uu) / (2 * cross),
        )
        turn = math.copysign(2 * math.pi, cross)
        self.angle = _bearing(self.centre, self.start)
        sweep = (_bearing(self.centre, self.end) - self.angle) % turn
        self.radius = math.hypot(a[0] - self.centre[0], a[1] - self.centre[1])
        self.sweep = sweep
        self.length = abs(sweep) * self.radius

    def at(self, t):
        # type: (float) -> FixedPoint
        """Return the point at the share `t` of the arc, cm."""
        if self.centre is None:
            return tuple(a + t * (b - a) for a, b in zip(self.start, self.end))
        angle = self.angle + t * self.sweep
        return (
            self.centre[0] + self.radius * math.cos(angle),
            self.centre[1] + self.radius * math.sin(angle),
        )


def _bearing(centre, p):
    # type: (Point, Point) -> float
    """Return the direction of a point from a centre, rad."""
    return math.atan2(p[1] - centre[1], p[0] - centre[0])


def spread(piece):
    # type: (Piece) -> List[FixedPoint]
    """Return at least three points along a piece, its own included, at most POINT_SPACING apart."""
    out = [tuple(piece[0])]
    for a, b in zip(piece, piece[1:]):
        n = int(math.ceil(kinematics.distance(a, b) / POINT_SPACING))
        n = max(n, 2 if len(piece) == 2 else 1)
        for k in range(1, n + 1):
            out.append(tuple(u + (v - u) * k / float(n) for u, v in zip(a, b)))
    return out
