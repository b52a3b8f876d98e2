"""The pieces of a job's strokes: read, and held to what an arm's joints may do.  Pure.

Lengths are cm, angles rad, times s.
"""

import math

from shared.arm_description import ArmError
from shared.small_files import SpoiltFile, number

MAX_JUMP = 0.01
"""Greatest difference of a joint's angle from where a piece or segment ends to where the next
begins, rad."""

SPEED_MARGIN = 1.1
"""A joint is planned no faster than so many times its greatest speed."""


class BadJob(ArmError, ValueError):
    """A file that is no job, or none for this arm."""


def read_piece(value, joints):
    """(times, segments, end) as a Trajectory takes them, of numbers only."""
    times, segments, end = value
    times = [number(t) for t in times]
    if times[0] != 0 or len(times) != len(segments) + 1 or len(segments) < 1:
        raise SpoiltFile("has a piece whose times do not fit")
    if any(b <= a for a, b in zip(times, times[1:])):
        raise SpoiltFile("has a piece whose time does not go on")
    out = []
    for (v, a, cubics, across), t, t_end in zip(segments, times, times[1:]):
        v, a = number(v), number(a)
        if v + 0.5 * a * (t_end - t) <= 0:
            raise SpoiltFile("has a piece that does not go on")
        cubics = [tuple(number(c) for c in cubic) for cubic in cubics]
        across = across if across is None else [number(x) for x in across]
        if len(cubics) != joints or any(len(cubic) != 4 for cubic in cubics):
            raise SpoiltFile("has a piece of another arm")
        if across is not None and len(across) != joints:
            raise SpoiltFile("has a piece of another arm")
        out.append((v, a, cubics, across))
    end = tuple(number(q) for q in end)
    if len(end) != joints:
        raise SpoiltFile("has a piece of another arm")
    return times, out, end


def _ends(times, segments):
    """Per segment, per joint: angle at its beginning and end, rad, and speed there, rad/s."""
    for t, t_end, (v, a, cubics, _) in zip(times, times[1:], segments):
        dt = t_end - t
        s, v_end = dt * (v + 0.5 * a * dt), v + a * dt
        yield [
            (
                c0,
                c0 + s * (c1 + s * (c2 + s * c3)),
                v * c1,
                v_end * (c1 + s * (c2 + c2 + 3 * c3 * s)),
            )
            for c0, c1, c2, c3 in cubics
        ]


def go_on():
    """What is called between two pieces of work where nobody wants to be."""


def check_joined(pieces, between):
    """Refuse angles that jump."""
    before = None
    for times, segments, end in pieces:
        between()
        for joints in _ends(times, segments):
            if before is not None:
                _check_jump(before, [joint[0] for joint in joints])
            before = [joint[1] for joint in joints]
        _check_jump(before, end)
        before = end


def _check_jump(before, after):
    jump = max([abs(a - b) for a, b in zip(before, after)])
    if not jump <= MAX_JUMP:
        raise SpoiltFile("has a joint that jumps by {:.1f} deg".format(math.degrees(jump)))


def _range(cubic, s):
    """Least and greatest angle of a joint on a way `s` (cm) by its cubic, rad."""
    c0, c1, c2, c3 = cubic
    places = [0.0, s]
    # It turns round where c1 + 2 c2 x + 3 c3 x^2 = 0.
    root = c2 * c2 - 3.0 * c1 * c3
    if not abs(root) < math.inf:  # nor what is no number
        return -math.inf, math.inf
    if root >= 0:
        far = -c2 - math.copysign(math.sqrt(root), c2)
        turns = ([far / (3.0 * c3)] if c3 else []) + ([c1 / far] if far else [])
        places += [x for x in turns if 0 < x < s]
    angles = [c0 + x * (c1 + x * (c2 + x * c3)) for x in places]
    return min(angles), max(angles)


def check_joints(path, k, pieces, joints, between=go_on):
    """Refuse, by BadJob, angles and speeds that the joints may not have."""
    for times, segments, _ in pieces:
        between()
        for t, t_end, segment, states in zip(times, times[1:], segments, _ends(times, segments)):
            v, a, cubics, _ = segment
            s = (t_end - t) * (v + 0.5 * a * (t_end - t))
            for joint, cubic, (q, q_end, speed, speed_end) in zip(joints, cubics, states):
                low, high = min(q, q_end), max(q, q_end)
                # Between its ends a cubic stays within the span of them and two points more (as P.
                # Bezier's curves do): hardly one needs its roots.
                first = q + s * cubic[1] / 3.0
                second = first + first - q + s * s * cubic[2] / 3.0
                if min(first, second) < joint.lower or max(first, second) > joint.upper:
                    low, high = _range(cubic, s)
                if low < joint.lower - MAX_JUMP or high > joint.upper + MAX_JUMP:
                    raise BadJob(
                        "{}: stroke {} needs the {} at {:.1f} deg, beyond its limits {:g} to {:g}; "
                        "plan it for this arm as it is".format(
                            path, k, joint.name,
                            math.degrees(low if low < joint.lower else high),
                            math.degrees(joint.lower), math.degrees(joint.upper),
                        )
                    )  # fmt: skip
                fastest = max(abs(speed), abs(speed_end))
                if fastest > SPEED_MARGIN * joint.max_speed:
                    raise BadJob(
                        "{}: stroke {} needs the {} at {:.0f} deg/s, beyond its {:g}; plan it for "
                        "this arm as it is".format(
                            path, k, joint.name, math.degrees(fastest),
                            math.degrees(joint.max_speed),
                        )
                    )  # fmt: skip
