"""Pieces of a job's strokes: read, and checked against the limits of an arm's joints.  Pure.

Lengths are cm, angles rad, times s.
"""

import math

from shared.arm_description import ArmError, joint_accelerations
from shared.config_files import InvalidFile, number

MYPY = False
if MYPY:
    from typing import (  # noqa: F401
        Any,
        Callable,
        Iterator,
        List,
        NoReturn,
        Optional,
        Sequence,
        Tuple,
    )

    from shared.arm_description import Joint  # noqa: F401

    Cubic = Sequence[float]  # an angle, rad, over arc length s, cm: c0 + c1 s + c2 s^2 + c3 s^3
    # The tip's speed, cm/s, and acceleration, cm/s^2; a Cubic per joint; across: see Trajectory
    Segment = Tuple[float, float, Sequence[Cubic], Optional[Sequence[float]]]
    # Times at which segments begin, and the last ends, s; these; the joints' angles at the end, rad
    Piece = Tuple[Sequence[float], Sequence[Segment], Sequence[float]]
    Between = Callable[[], object]
    Refuse = Callable[..., NoReturn]

MAX_JUMP = 0.01
"""Greatest jump of a joint's angle between two segments, rad, and greatest sum of a stroke's jumps:
many would be a speed that no segment has."""

SPEED_MARGIN = 1.02
"""Greatest planned speed of a joint, times its greatest speed: room for rounding."""

ACCELERATION_MARGIN = 1.2
"""Greatest acceleration of a joint, times the planned one: room for bends between knots. A joint
that were to do much more would lag so far that it would seem blocked."""

MAX_SPEED_JUMP = math.radians(6)
"""Greatest difference of a joint's speed between two segments, and at a piece's ends, rad/s: near
a singular pose rounded numbers may make 2 degrees a second of it."""

MAX_NUMBER = 1e9
"""Greatest absolute value of the numbers of a piece: their products stay finite."""

MIN_LENGTH = 1e-9
"""Least length of a segment, cm: a division by less may overflow."""

MAX_REVERSE_SPEED = 0.01
"""Greatest speed, cm/s, at which a segment may run backwards at its end, by rounding."""


class BadJob(ArmError, ValueError):
    """A file that is no job, or none for this arm."""


def read_piece(value, joints):
    # type: (Any, int) -> Piece
    """Read (times, segments, end) as a Trajectory takes them, of finite numbers only.

    Args:
        value: what JSON holds.
        joints: number of the arm's joints.

    Raises:
        InvalidFile: it is no piece, or one of another arm.
    """
    times, segments, end = value
    times = [_bounded(t) for t in times]
    if times[0] != 0 or len(times) != len(segments) + 1 or len(segments) < 1:
        raise InvalidFile("has a piece whose times do not fit")
    if any(b <= a for a, b in zip(times, times[1:])):
        raise InvalidFile("has a piece whose time does not go on")
    out = []
    for (v, a, cubics, across), t, t_end in zip(segments, times, times[1:]):
        v, a, dt = _bounded(v), _bounded(a), t_end - t
        if not dt * (v + 0.5 * a * dt) >= MIN_LENGTH:
            raise InvalidFile("has a piece that does not go on")
        if v < 0 or v + a * dt < -MAX_REVERSE_SPEED:
            raise InvalidFile("has a piece that runs backwards")
        cubics = [tuple([_bounded(c) for c in cubic]) for cubic in cubics]
        across = across if across is None else [_bounded(x) for x in across]
        if len(cubics) != joints or any(len(cubic) != 4 for cubic in cubics):
            raise InvalidFile("has a piece of another arm")
        if across is not None and len(across) != joints:
            raise InvalidFile("has a piece of another arm")
        out.append((v, a, cubics, across))
    end = tuple([_bounded(q) for q in end])
    if len(end) != joints:
        raise InvalidFile("has a piece of another arm")
    return times, out, end


def _bounded(value):
    # type: (Any) -> float
    bounded = number(value)
    if not -MAX_NUMBER <= bounded <= MAX_NUMBER:
        raise InvalidFile("has a number beyond all bounds")
    return bounded


def _ends(times, segments):
    # type: (Sequence[float], Sequence[Segment]) -> Iterator[List[Tuple[float, float]]]
    """Yield per segment a list with each joint's angles at its beginning and end, rad."""
    for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
        dt = t_end - t
        s = dt * (v + 0.5 * a * dt)
        yield [(c0, c0 + s * (c1 + s * (c2 + s * c3))) for c0, c1, c2, c3 in cubics]


def go_on():
    # type: () -> None
    """Do nothing: the default of `between`."""


def check_joined(pieces, between):
    # type: (Sequence[Piece], Between) -> None
    """Refuse pieces of a stroke whose joint angles jump by more than MAX_JUMP.

    Args:
        pieces: of one stroke, in order.
        between: called before each piece.

    Raises:
        InvalidFile: they jump.
    """
    before = ()  # type: Sequence[float]
    jumped = 0.0
    for times, segments, end in pieces:
        between()
        for joints in _ends(times, segments):
            if before:
                jumped = _jumped(jumped, before, [joint[0] for joint in joints])
            before = [joint[1] for joint in joints]
        jumped = _jumped(jumped, before, end)
        before = end


def _jumped(jumped, before, after):
    # type: (float, Sequence[float], Sequence[float]) -> float
    jumped += max([abs(a - b) for a, b in zip(before, after)])
    if not jumped <= MAX_JUMP:
        raise InvalidFile("has a joint that jumps by {:.1f} deg".format(math.degrees(jumped)))
    return jumped


def check_joints(path, k, pieces, joints, between=go_on, more=0.0):
    # type: (str, int, Sequence[Piece], Sequence[Joint], Between, float) -> None
    """Refuse pieces on which a joint exceeds its limits, its speed or its acceleration.

    The limits hold along the whole path, not only at samples. Each joint angle is a cubic q(s) of
    the arc length s, and the tip's speed V obeys V^2 = v^2 + 2 a s. So the extremes of q, of dq/dt
    and of d2q/dt2 lie at the ends or at roots of quadratics, which have closed forms.

    Args:
        path: of the job's file, for people.
        k: number of the stroke, for people.
        pieces: of the stroke.
        joints: the arm's.
        between: called before each piece.
        more: acceleration allowed beyond what is planned with ACCELERATION_MARGIN, rad/s^2.

    Raises:
        BadJob: it names the joint, the value and the limit.
    """
    limits = [ACCELERATION_MARGIN * most + more for most in joint_accelerations(joints)]

    def refuse(joint, what, *numbers):
        # type: (Joint, str, *float) -> NoReturn
        raise BadJob(
            "{}: stroke {} needs the {} {}; plan it for this arm as it is".format(
                path, k, joint.name, what.format(*[math.degrees(number) for number in numbers])
            )
        )

    for times, segments, _ in pieces:
        between()
        speeds = [0.0] * len(joints)
        for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
            dt = t_end - t
            v_end = v + a * dt
            end = dt * (v + 0.5 * a * dt)
            # (A segment that turns back at its very end has been a little farther before.)
            s = end if v_end >= 0 else -0.5 * v * v / a
            top = max(v, -v_end, v_end)
            for n, (joint, cubic, hardest) in enumerate(zip(joints, cubics, limits)):
                low, high, steepest = _span(cubic, s)
                if low < joint.lower or high > joint.upper:
                    low, high = _range(cubic, s)
                if not joint.lower - MAX_JUMP <= low <= high <= joint.upper + MAX_JUMP:
                    refuse(
                        joint, "at {:.1f} deg, beyond its limits {:g} to {:g}",
                        low if low < joint.lower else high, joint.lower, joint.upper,
                    )  # fmt: skip
                fastest = top * steepest
                if fastest > SPEED_MARGIN * joint.max_speed:
                    fastest = _fastest(cubic, v, a, s)
                if not fastest <= SPEED_MARGIN * joint.max_speed:
                    refuse(joint, "at {:.0f} deg/s, beyond its {:g}", fastest, joint.max_speed)
                acceleration = _hardest(cubic, v, a, s)
                if not acceleration <= hardest:
                    refuse(
                        joint, "accelerated by {:.0f} deg/s^2, beyond {:.0f}", acceleration, hardest
                    )
                _, c1, c2, c3 = cubic
                _check_no_leap(refuse, joint, v * c1 - speeds[n])
                speeds[n] = v_end * (c1 + end * (c2 + c2 + 3.0 * c3 * end))
        for joint, speed in zip(joints, speeds):
            _check_no_leap(refuse, joint, speed)


def _check_no_leap(refuse, joint, leap):
    # type: (Refuse, Joint, float) -> None
    if not -MAX_SPEED_JUMP <= leap <= MAX_SPEED_JUMP:
        refuse(joint, "to change its speed by {:.0f} deg/s at once", abs(leap))


def _span(cubic, s):
    # type: (Cubic, float) -> Tuple[float, float, float]
    """Return bounds of a joint's angle, rad, and of its slope, rad/cm, on an arc `s` (cm).

    A polynomial stays within the convex hull of its Bezier control points (Farin, Curves and
    Surfaces for CAGD). The bounds cost no root; few cubics come so near to a limit that the exact
    extremes are needed.
    """
    c0, c1, c2, c3 = cubic
    bent, curved = c2 * s, c3 * s * s
    end = c0 + s * (c1 + bent + curved)
    first = c0 + s * c1 / 3.0
    second = first + first - c0 + s * bent / 3.0
    middle = c1 + bent
    last = middle + bent + 3.0 * curved
    return (
        min(c0, first, second, end), max(c0, first, second, end),
        max(c1, -c1, middle, -middle, last, -last),
    )  # fmt: skip


def _range(cubic, s):
    # type: (Cubic, float) -> Tuple[float, float]
    """Return the least and greatest angle of a joint on an arc `s` (cm) by its cubic, rad."""
    c0, c1, c2, c3 = cubic
    places = [0.0, s] + _roots(3.0 * c3, c2 + c2, c1, s)  # there it turns round
    angles = [c0 + x * (c1 + x * (c2 + x * c3)) for x in places]
    return min(angles), max(angles)


def _fastest(cubic, v, a, s):
    # type: (Cubic, float, float, float) -> float
    """Return the greatest speed of a joint on an arc `s` (cm) by its cubic, rad/s.

    The tip begins at speed v (cm/s) and accelerates by a (cm/s^2). By the chain rule the joint's
    speed is dq/ds sqrt(v^2 + 2 a x), greatest where the derivative of its square is 0.
    """
    _, c1, c2, c3 = cubic
    v2 = v * v
    places = [0.0, s] + _roots(15.0 * a * c3, 6.0 * (a * c2 + c3 * v2), a * c1 + 2.0 * c2 * v2, s)
    return max([
        abs(c1 + x * (c2 + c2 + 3.0 * c3 * x)) * math.sqrt(max(0.0, v2 + 2.0 * a * x))
        for x in places
    ])  # fmt: skip


def _hardest(cubic, v, a, s):
    # type: (Cubic, float, float, float) -> float
    """Return the greatest acceleration of a joint on an arc `s` (cm) by its cubic, rad/s^2.

    By the chain rule it is V^2 d2q/ds2 + a dq/ds, with V^2 = v^2 + 2 a x: a parabola in x.
    """
    _, c1, c2, c3 = cubic
    v2 = v * v
    begin, rise, bend = a * c1 + 2.0 * c2 * v2, 6.0 * (a * c2 + c3 * v2), 15.0 * a * c3
    most = max(abs(begin), abs(begin + s * (rise + s * bend)))
    if bend and 0 < -rise < 2.0 * bend * s or bend < 0 < rise < -2.0 * bend * s:
        most = max(most, abs(begin - 0.25 * rise * rise / bend))
    return most


def _roots(a, b, c, s):
    # type: (float, float, float, float) -> List[float]
    """Return the real roots of a x^2 + b x + c between 0 and s.

    The larger root comes first, the other by Vieta's c / (a x1): no cancellation (Press et al.,
    Numerical Recipes, 5.6).
    """
    below = b * b - 4.0 * a * c
    if below < 0:
        return []
    far = -0.5 * (b + math.copysign(math.sqrt(below), b))
    roots = ([far / a] if a else []) + ([c / far] if far else [])
    return [x for x in roots if 0 < x < s]
