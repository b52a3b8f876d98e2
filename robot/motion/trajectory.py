"""Joint set-points in time: along the pieces of a stroke, or from pose to pose.  Pure.

`q` joint angles rad, `p` a tip position cm, `s` the path length cm, `t` time s.

A control tick has little time.  So a piece becomes a few cubics q(s), one between any two *knots*,
and a tick only evaluates them.
"""

import math

from robot.motion import kinematics
from shared.arm_description import JOINT_ACCELERATION, joint_accelerations

MYPY = False
if MYPY:
    from typing import Callable, List, Optional, Sequence, Tuple, TypeVar  # noqa: F401

    from robot.motion.chains import FixedPose, Point, Pose  # noqa: F401
    from robot.motion.knots import Knot  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from robot.motion.paths import Piece  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

    Cubic = Sequence[float]  # four coefficients, from the constant one on
    Segment = Tuple[float, float, Sequence[Cubic], Optional[Vector]]  # v, a, cubics, across
    TimedPiece = Tuple[Sequence[float], Sequence[Segment], Pose]  # times, segments, end
    NumbersOfSegment = Tuple[float, float, List[List[float]], Optional[List[float]]]
    PieceNumbers = Tuple[List[float], List[NumbersOfSegment], List[float]]  # a TimedPiece
    AlongPath = Optional[Tuple[Vector, Vector]]  # J^T t, dq/ds
    # signs, and per joint s and rad
    Turns = Tuple[Tuple[int, ...], Tuple[Tuple[float, ...], ...], Tuple[Tuple[float, ...], ...]]
    SetPoint = Tuple[List[float], AlongPath]  # q, path
    Followed = TypeVar("Followed")

SPEED_UP_TIME = 0.2
"""Minimum time in which the tip reaches its speed, s."""

MAX_BEND = 0.5 * JOINT_ACCELERATION
"""Maximum acceleration of a joint by the bends of a path, rad/s^2.  Where a joint turns round in a
bend, its link stands while the motor crosses the backlash, however light the link is."""

MIN_PATH_SPEED = 0.5
"""Minimum speed of the tip at which errors along the path are separated, cm/s."""


class Trajectory(object):
    """Joint set-points in time along one piece.

    Args:
        times: of the knots, s, from 0 on.
        segments: from each knot to the next (v, a, cubics, across): the tip's speed at the first
            one (cm/s) and its acceleration (cm/s^2); per joint the coefficients of its angle (rad)
            by the path length from there (cm), from the constant one on; and J^T t, None where the
            arm is nearly singular.  The inner product of J^T t and joint errors (rad) is their
            part along the path's tangent t (cm).
        end: joint angles at the last knot, rad.
        turning: segments whose reversals count in place of those of `segments`: of the plan that
            `segments` correct.  A correction then does not move a crossing of the backlash.

    Attributes:
        duration: s.
        start, end: joint angles at the start and end, rad.
        directions: per joint, the sign of its first motion (0: it does not move).
        reversals: per joint, the times (s) of its reversals.
        extremes: per joint, its angles at the start, at each reversal and at the end, rad.
    """

    def __init__(self, times, segments, end, turning=None):
        # type: (Sequence[float], Sequence[Segment], Pose, Optional[Sequence[Segment]]) -> None
        self._times = times
        self._segments = segments
        self._k = 0
        self.duration = times[-1]
        self.start, self.end = tuple(cubic[0] for cubic in segments[0][2]), tuple(end)
        self.directions, self.reversals, self.extremes = self._turns(turning or segments)

    def numbers(self):
        # type: () -> PieceNumbers
        """Return (times, segments, end), rounded, to be stored in a file."""
        return (
            [round(t, 6) for t in self._times],
            [
                (
                    round(v, 5), round(a, 4),
                    [[round(c, 7) for c in cubic] for cubic in cubics],
                    [round(x, 4) for x in across] if across else None,
                )
                for v, a, cubics, across in self._segments
            ],
            [round(q, 7) for q in self.end],
        )  # fmt: skip

    def _passing(self, t):
        # type: (float) -> Segment
        """Return (cm since the last knot, cm/s, cubics, J^T t) at `t` (s), 0 < t < duration."""
        times, k = self._times, self._k
        while t < times[k]:
            k -= 1
        while t > times[k + 1]:
            k += 1
        self._k = k
        v, a, cubics, across = self._segments[k]
        dt = t - times[k]
        return dt * (v + 0.5 * a * dt), v + a * dt, cubics, across

    def at(self, t):
        # type: (float) -> SetPoint
        """Return (q, path) at time `t` (s); before the start and after the end it is at rest.

        `path` is (J^T t, dq/ds), see `segments`; None where it is undefined.
        """
        if t <= 0:
            return list(self.start), None
        if t >= self.duration:
            return list(self.end), None
        s, v, cubics, across = self._passing(t)
        q, slopes = [], []
        for c0, c1, c2, c3 in cubics:
            bent = c2 + c3 * s
            q.append(c0 + s * (c1 + s * bent))
            slopes.append(c1 + s * (bent + bent + c3 * s))
        return q, (across, slopes) if across and v > MIN_PATH_SPEED else None

    def speeds(self, t):
        # type: (float) -> List[float]
        """Return dq/dt at time `t` (s), rad/s."""
        if not 0 < t < self.duration:
            return [0.0] * len(self.end)
        s, v, cubics, _ = self._passing(t)
        return [v * (c1 + s * (c2 + c2 + 3.0 * c3 * s)) for _, c1, c2, c3 in cubics]

    def _turns(self, segments):
        # type: (Sequence[Segment]) -> Turns
        """Return per joint its first sign, and the times and angles of its reversals, see above."""
        directions, reversals, extremes = [], [], []
        for j in range(len(self.end)):
            first, sign, turns, angles = 0, 0, [], [segments[0][2][j][0]]
            for t, (v, a, cubics, _), t_end in zip(self._times, segments, self._times[1:]):
                c0, c1, c2, c3 = cubics[j]
                dt = t_end - t
                length = dt * (v + 0.5 * a * dt)
                for s, slope in ((0.0, c1), (length, c1 + length * (2 * c2 + 3 * c3 * length))):
                    now = (slope > 1e-9) - (slope < -1e-9)
                    if now and sign and now != sign:
                        s = _root(c1, c2, c3, now) if s else 0.0
                        turns.append(t + _time(s, v, a))
                        angles.append(c0 + s * (c1 + s * (c2 + s * c3)))
                    first, sign = first or now, now or sign
            directions.append(first)
            reversals.append(tuple(turns))
            angles.append(c0 + length * (c1 + length * (c2 + length * c3)))
            extremes.append(tuple(angles))
        return tuple(directions), tuple(reversals), tuple(extremes)


def _root(c1, c2, c3, sign):
    # type: (float, float, float, int) -> float
    """Return where (cm) the slope c1 + 2 c2 s + 3 c3 s^2 changes to `sign`.

    Of the two forms of the root, it is the one without a difference of like numbers.
    """
    root = sign * math.sqrt(max(0.0, c2 * c2 - 3 * c1 * c3))
    return -c1 / (c2 + root) if sign * c2 > 0 else (root - c2) / (3 * c3)


def _time(s, v, a):
    # type: (float, float, float) -> float
    """Return the time (s) of a path `s` (cm) from the speed `v` (cm/s) at `a` (cm/s^2).

    2 s / (v + sqrt(v^2 + 2 a s)) is the root of s = v t + a t^2 / 2 that also holds for a = 0.
    """
    return 2 * s / (v + math.sqrt(max(0.0, v * v + 2 * a * s))) if s else 0.0


class JointMove(object):
    """A move of all joints together from rest to rest, wherever that takes the tip.

    Each joint moves by the quintic with speed and acceleration 0 at both ends (Flash and Hogan,
    1985): x^3 (10 - 15 x + 6 x^2), x = t / T.  It is used like a Trajectory, or like a
    BacklashCompensation.

    Args:
        start, end: joint angles, rad.
        fastest: maximum speed per joint, rad/s.
        accelerations: maximum acceleration per joint, rad/s^2; JOINT_ACCELERATION if None.
    """

    before = 0.0

    def __init__(self, start, end, fastest, accelerations=None):
        # type: (Pose, Pose, Vector, Optional[Vector]) -> None
        self.start, self.end = tuple(start), tuple(end)
        accelerations = accelerations or [JOINT_ACCELERATION] * len(self.start)
        duration = 0.0
        for a, b, max_speed, most in zip(start, end, fastest, accelerations):
            travel = abs(b - a)
            # The quintic's peaks: 1.875 travel / T and 5.774 travel / T^2.
            duration = max(duration, 1.875 * travel / max_speed, math.sqrt(5.774 * travel / most))
        self.duration = duration
        self.rests_from = [duration] * len(self.start)
        self._travels = [b - a for a, b in zip(start, end)]
        signs = tuple((b > a) - (b < a) for a, b in zip(start, end))
        self.directions, self.reversals = signs, ((),) * len(signs)
        self.extremes = tuple(zip(start, end))

    def at(self, t):
        # type: (float) -> SetPoint
        """Return (q, None) at time `t` (s), as Trajectory.at without a path."""
        if t >= self.duration:
            return list(self.end), None
        if t <= 0:
            return list(self.start), None
        x = t / self.duration
        share = x * x * x * (10.0 + x * (6.0 * x - 15.0))
        return [a + share * travel for a, travel in zip(self.start, self._travels)], None

    def speeds(self, t):
        # type: (float) -> List[float]
        """Return dq/dt at time `t` (s), rad/s."""
        if not 0 < t < self.duration:
            return [0.0] * len(self.end)
        x = t / self.duration
        rate = x * (1.0 - x)
        rate *= 30.0 * rate / self.duration
        return [rate * travel for travel in self._travels]


# ---- planning


def plan(arm, pieces, speed=None, elbow=None):
    # type: (Arm, Sequence[Piece], Optional[float], Optional[str]) -> List[Trajectory]
    """Return the Trajectories along the pieces of one stroke, all on one branch.

    Args:
        arm: shared.arm_description.Arm.
        pieces: see robot.motion.paths; each begins where the one before ends.
        speed: maximum speed of the tip, cm/s; the arm's own if None.
        elbow: "up" | "down"; None tries the arm's own branch, then the other.

    Raises:
        kinematics.Unreachable: with the first point out of reach; nothing has moved.
    """
    from robot.motion.knots import knots_through, stations_of  # not above: few plan a stroke

    for piece in pieces:
        # Before a very long line is cut into knots.
        kinematics.inverse(arm, piece[0])
        kinematics.inverse(arm, piece[-1])

    def follow(q):
        # type: (FixedPose) -> List[List[Knot]]
        paths = []
        for piece in pieces:
            paths.append(knots_through(arm, stations_of(piece), q))
            q = paths[-1][-1][1]
        return paths

    paths = _on_a_branch(arm, pieces[0][0], elbow, follow)
    return [_timed(arm, knots, speed or arm.speed) for knots in paths]


def joint_path(arm, points, elbow=None):
    # type: (Arm, Sequence[Point], Optional[str]) -> List[FixedPose]
    """Return the joint angles along `points`, within reach and limits, without a jump.

    Args:
        arm: shared.arm_description.Arm.
        points: close together, cm.
        elbow: "up" | "down"; None tries the arm's own branch, then the other.

    Returns:
        As many tuples of angles, rad.

    Raises:
        kinematics.Unreachable: with the first point out of reach.
    """
    from robot.motion.knots import next_pose  # as above

    def follow(q):
        # type: (FixedPose) -> List[FixedPose]
        joints = [q]
        for p in points[1:]:
            joints.append(next_pose(arm, p, joints[-1]))
        return joints

    return _on_a_branch(arm, points[0], elbow, follow)


def _on_a_branch(arm, p, elbow, follow):
    # type: (Arm, Point, Optional[str], Callable[[FixedPose], Followed]) -> Followed
    """Return `follow` of the pose at `p` (cm), on the first branch on which it succeeds."""
    first_error = None  # type: Optional[kinematics.Unreachable]
    for branch in (elbow,) if elbow else (arm.elbow, "down" if arm.elbow == "up" else "up"):
        try:
            return follow(kinematics.inverse(arm, p, elbow=branch))
        except kinematics.Unreachable as error:
            first_error = first_error or error
    assert first_error is not None  # one branch was tried at least
    raise first_error


def _timed(arm, knots, speed):
    # type: (Arm, Sequence[Knot], float) -> Trajectory
    """Return the Trajectory along `knots` with at most `speed` (cm/s), within the joints' limits.

    With q(s), speed v and acceleration a along the path, a joint has

        dq/dt = q' v,    d2q/dt2 = q'' v^2 + q' a

    A joint's maximum speed, and MAX_BEND for q'' v^2, cap v at each knot; half of the joint's own
    acceleration bounds a, or MAX_BEND as far as bends use that up: else a rose, which goes by its
    bends all the way, is off by a third more.  With a constant, v^2 is linear in s; so a forward
    and a backward pass over v^2 give the fastest profile under the cap (Bobrow, Dubowsky and
    Gibson, 1985, here with constant limits).  Limits of torque would need the masses and the
    battery's voltage.
    """
    limits = [
        (joint.max_speed, 0.5 * most)
        for joint, most in zip(arm.joints, joint_accelerations(arm.joints))
    ]
    v = [speed] * len(knots)
    v[0] = v[-1] = 0.0
    gains, pieces = [], []  # of speed squared from knot to knot at the most; cubics
    for k, ((s0, q, slopes, across), (s1, q_there, slopes_there, _)) in enumerate(
        zip(knots, knots[1:])
    ):
        s = s1 - s0
        cap, acceleration, cubics = speed, speed / SPEED_UP_TIME, []
        max_bend, steep = 0.0, []
        for q0, q1, m0, m1, (max_speed, half) in zip(q, q_there, slopes, slopes_there, limits):
            mean = (q1 - q0) / s
            c2, c3 = (3.0 * mean - m0 - m0 - m1) / s, (m0 + m1 - mean - mean) / (s * s)
            cubics.append((q0, m0, c2, c3))
            # (Of the slope's parabola, the ends and the middle.)
            slope = max(abs(m0), abs(m1), abs(1.5 * mean - 0.25 * (m0 + m1)))
            if slope * cap > max_speed:
                cap = max_speed / slope
            steep.append((slope, half))
            max_bend = max(max_bend, abs(c2), abs(c2 + 3.0 * c3 * s))
        if 2.0 * max_bend * cap * cap > MAX_BEND:
            cap = math.sqrt(0.5 * MAX_BEND / max_bend)
        bent = 2.0 * max_bend * cap * cap / MAX_BEND
        for slope, half in steep:
            half -= bent * (half - MAX_BEND)
            if slope * acceleration > half:
                acceleration = half / slope
        v[k], v[k + 1] = min(v[k], cap), min(v[k + 1], cap)
        gains.append(2 * acceleration * s)
        pieces.append((s, cubics, across))
    squares = [x * x for x in v]
    for k, gain in enumerate(gains):
        squares[k + 1] = min(squares[k + 1], squares[k] + gain)
    for k in range(len(gains) - 1, -1, -1):
        squares[k] = min(squares[k], squares[k + 1] + gains[k])
    v = [math.sqrt(x) for x in squares]
    times, segments = [0.0], []
    for (s, cubics, across), v0, v1 in zip(pieces, v, v[1:]):
        segments.append((v0, (v1 * v1 - v0 * v0) / (2 * s), cubics, across))
        times.append(times[-1] + 2 * s / (v0 + v1))
    return Trajectory(times, segments, knots[-1][1])
