"""Feed override and feed hold: a plan whose time goes slower, stops and goes on.  Pure.

The terms are those of machine tools.  The path stays the same; only the time at which the tip
passes its points changes (trajectory scaling: Dahl and Nielsen, 1990).  The plan has its own time
tau, the loop the time t:

    q(t) = plan(tau(t)),   dtau/dt = r(t),   dq/dt = r dq/dtau
    d2q/dt2 = r^2 d2q/dtau2 + dr/dt dq/dtau

The rate r, 0 .. 1, changes linearly, so that tau is a parabola, then a straight line.  A step of r
would be a step of all speeds; a linear change keeps the second term finite.
To scale the set-points' speed in the loop instead would leave position and speed apart.
"""

import math

from robot.motion.online_trajectory import STOP
from shared.arm_description import JOINT_ACCELERATION

MYPY = False
if MYPY:
    from typing import Callable, Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.backlash import BacklashCompensation  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from robot.motion.trajectory import Cubic, Segment, SetPoint, TimedPiece  # noqa: F401

    # v, a, length in cm, cubics, across
    Section = Tuple[float, float, float, Sequence[Cubic], Optional[Vector]]

MIN_RAMP_TIME, MAX_RAMP_TIME = 0.15, 0.2
"""Bounds of the time in which the rate goes from 1 to 0, s: fast joints take longer, to slow down
no harder than a plan does (JOINT_ACCELERATION)."""

RATE_PERIOD = 0.06
"""Period at which the wanted rate is asked for, s."""

HOLD_TIME = 0.02
"""Time from the set-points' rest to the end of a held motion, s: the pen is to leave the paper
wherever the joints are."""

MIN_PATH_RATE = 0.1
"""Minimum rate at which errors along the path are separated from those across it."""

MIN_TIP_SPEED = 0.01
"""Minimum speed of the tip in a slowed piece, cm/s."""

MIN_TIP_ACCELERATION = 5.0
"""Minimum acceleration of the tip at the start of a rest, cm/s^2."""

MIN_REST_LENGTH = 0.005
"""Minimum length of a rest worth drawing, cm."""


class FeedOverride(object):
    """The plans of a motion, one after the other, at a rate that may change at any moment.

    It is used by the control loop like the BacklashCompensation that it wraps.

    Args:
        wanted_rate: called with the clock's time (s) every RATE_PERIOD; returns the wanted rate,
            from 0 (hold) to 1.

    Attributes:
        duration, before, rests_from, sides: as of a BacklashCompensation, by the loop's time.
        index: number of the present plan, from 0 on; past the last one when all are over.
        reached: the plan's own time when the rate was last asked for, s.
    """

    def __init__(self, wanted_rate):
        # type: (Callable[[float], float]) -> None
        self._wanted_rate = wanted_rate
        self._sample_at = -math.inf
        self._r0 = self._r1 = 1.0
        self.index = 0
        self.reached = 0.0

    def begin_at(self, rate):
        # type: (float) -> None
        """Let the next motion begin at this rate, 0 .. 1."""
        self._r1 = rate

    def each(self, plans):
        # type: (Sequence[BacklashCompensation]) -> Iterator[FeedOverride]
        """Yield itself for every plan in turn, until it is held."""
        for self.index, plan in enumerate(plans):
            self._begin(plan)
            yield self
            if self.held:
                return
        self.index += 1

    def _begin(self, plan):
        # type: (BacklashCompensation) -> None
        """Begin a plan at the present rate."""
        self._plan = plan
        self.before = plan.before
        self._t0 = self._t1 = self._tau0 = self._tau1 = -plan.before
        # (A rate of 0 has ended the motion before; a ramp goes on where it was to end.)
        self._r0, self._slope = self._r1, 0.0
        self._update_end()

    @property
    def held(self):
        # type: () -> bool
        """Whether the wanted rate is 0: it stands, or slows down to stand."""
        return self._r1 == 0.0

    @property
    def tau(self):
        # type: () -> float
        """The plan's own time at which it ends or is held, s."""
        return min(self._tau(self.duration), self._plan.duration)

    @property
    def sides(self):
        # type: () -> Tuple[float, ...]
        """Side of the backlash per joint at the end, -1 .. +1."""
        return self._plan.sides_at(self._tau(self.duration))

    def order(self, t, rate):
        # type: (float, float) -> None
        """Let the rate go to `rate`, 0 .. 1, from the loop's time `t` (s) on."""
        now = self._rate(t)
        self._t0, self._tau0, self._r0 = t, self._tau(t), now
        fastest = max(map(abs, self._plan.speeds(self._tau0)))
        ramp_time = min(max(MIN_RAMP_TIME, fastest / JOINT_ACCELERATION), MAX_RAMP_TIME)
        time = ramp_time * abs(rate - now)
        self._slope = (rate - now) / time if time else 0.0
        self._r1, self._t1 = rate, t + time
        self._tau1 = self._tau0 + time * (now + rate) / 2
        self._update_end()

    def _update_end(self):
        # type: () -> None
        """Compute when it comes to its end, or to rest: `duration`, `rests_from`."""
        end = self._plan.duration
        if self._tau1 >= end:
            left = max(0.0, end - self._tau0)
            fast = self._r0 + math.sqrt(max(0.0, self._r0 * self._r0 + 2 * self._slope * left))
            self.duration = self._t0 + (2 * left / fast if fast else 0.0)
        elif self._r1:
            self.duration = self._t1 + (end - self._tau1) / self._r1
        else:
            self.duration = self._t1
        self.rests_from = [self.duration] * len(self._plan.rests_from)

    def _tau(self, t):
        # type: (float) -> float
        """Return the plan's own time (s) at the loop's time `t` (s)."""
        if t >= self._t1:
            return self._tau1 + self._r1 * (t - self._t1)
        dt = t - self._t0
        return self._tau0 + dt * (self._r0 + 0.5 * self._slope * dt)

    def _rate(self, t):
        # type: (float) -> float
        """Return the rate at the loop's time `t` (s), 0 .. 1."""
        return self._r1 if t >= self._t1 else self._r0 + self._slope * (t - self._t0)

    def at(self, t):
        # type: (float) -> SetPoint
        """Return (q, path) as BacklashCompensation.at, by the loop's time `t` (s)."""
        # (In most ticks the rate is constant: those call no function, to save time.)
        steady = t >= self._t1
        q, path = self._plan.at(self._tau1 + self._r1 * (t - self._t1) if steady else self._tau(t))
        if (self._r1 if steady else self._rate(t)) > MIN_PATH_RATE:
            return q, path
        return q, None

    def speeds(self, t):
        # type: (float) -> List[float]
        """Return dq/dt, rad/s, by the loop's time `t` (s)."""
        if t < self._t1:
            rate, speeds = self._rate(t), self._plan.speeds(self._tau(t))
        else:
            rate = self._r1
            speeds = self._plan.speeds(self._tau1 + rate * (t - self._t1))
        return speeds if rate == 1.0 else [rate * speed for speed in speeds]

    def sides_at(self, t):
        # type: (float) -> Tuple[float, ...]
        """Return the side of the backlash per joint, -1 .. +1, at the loop's time `t` (s)."""
        return self._plan.sides_at(self._tau(t))

    def tick(self, t, now, angles):
        # type: (float, float, Pose) -> object
        """Ask for the rate every RATE_PERIOD; return STOP when a held motion is over.

        It is the `on_tick` of the control loop.
        """
        if now < self._sample_at:
            if self._r1:
                return None
        else:
            self._sample_at = now + RATE_PERIOD
            self.reached = self._tau(t)
            wanted = self._wanted_rate(now)
            if wanted != self._r1:
                self.order(t, wanted)
        return STOP if self._r1 == 0.0 and t > self.duration + HOLD_TIME else None


# ---- a piece drawn slower, and what is left of one


def with_speed_limit(piece, share):
    # type: (TimedPiece, float) -> TimedPiece
    """Return a piece with its speed limited to this share of its maximum, at its accelerations.

    Another rate, in contrast, also lengthens the time in which a backlash is crossed.

    Args:
        piece: (times, segments, end), see robot.motion.trajectory.Trajectory.
        share: of the maximum speed, > 0.
    """
    times, segments, end = piece
    most = share * max([v for v, _, _, _ in segments] + [MIN_TIP_SPEED])
    out, new, v0 = [], [0.0], min(segments[0][0], most)
    for k, (v, a, cubics, across) in enumerate(segments):
        dt = times[k + 1] - times[k]
        length, v1 = dt * (v + 0.5 * a * dt), min(max(0.0, v + a * dt), most)
        out.append((v0, (v1 * v1 - v0 * v0) / (2 * length), cubics, across))
        new.append(new[-1] + 2 * length / max(v0 + v1, MIN_TIP_SPEED))
        v0 = v1
    return new, out, end


def time_at_same_place(piece, other, tau):
    # type: (TimedPiece, TimedPiece, float) -> float
    """Return the time (s) at which a piece is where `other`, of the same path, is at `tau` (s)."""
    if piece is other or tau <= 0:
        return tau
    times, segments, _ = other
    k = len([t for t in times[1:-1] if t <= tau])
    v, a = segments[k][:2]
    dt = min(tau, times[k + 1]) - times[k]
    s = dt * (v + 0.5 * a * dt)
    v, a = piece[1][k][:2]
    fast = v + math.sqrt(max(0.0, v * v + 2 * a * s))
    return min(piece[0][k] + (2 * s / fast if fast else 0.0), piece[0][k + 1])


def remaining(piece, tau):
    # type: (TimedPiece, float) -> Optional[TimedPiece]
    """Return the rest of a piece, begun at rest; None if it is shorter than MIN_REST_LENGTH.

    The path is the same; the tip speeds up as it did at the piece's beginning.

    Args:
        piece: (times, segments, end), see robot.motion.trajectory.Trajectory.
        tau: the piece's time at which the rest begins, s.

    Returns:
        Such a triple.
    """
    times, segments, end = piece
    if tau <= 0:
        return piece
    k = len([t for t in times[1:-1] if t <= tau])
    sections = []  # type: List[Section]
    for (t, t_end), (v, a, cubics, across) in list(zip(zip(times, times[1:]), segments))[k:]:
        sections.append((v, a, (t_end - t) * (v + 0.5 * a * (t_end - t)), cubics, across))
    v, a, length, cubics, across = sections[0]
    dt = min(tau, times[k + 1]) - times[k]
    done = dt * (v + 0.5 * a * dt)
    sections[0] = v + a * dt, a, length - done, [_moved(c, done) for c in cubics], across
    if sum([section[2] for section in sections]) < MIN_REST_LENGTH:
        return None
    if sections[0][2] < MIN_REST_LENGTH and len(sections) > 1:  # too short to speed up in
        del sections[0]
        # (Without its few micrometres the set-points jump by far less than a count.)
    if len(sections) == 1:  # it must speed up and slow down
        v, a, length, cubics, across = sections[0]
        half = length / 2
        middle = math.sqrt(max(0.0, v * v + 2 * a * half))
        rest = middle, a, half, [_moved(c, half) for c in cubics], across
        sections = [(v, a, half, cubics, across), rest]
    return _from_rest(sections, end, _acceleration(segments))


def _moved(cubic, s):
    # type: (Cubic, float) -> List[float]
    """Return the coefficients of a cubic whose argument begins at `s`."""
    c0, c1, c2, c3 = cubic
    return [c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + 3 * c3 * s), c2 + 3 * c3 * s, c3]


def _acceleration(segments):
    # type: (Sequence[Segment]) -> float
    """Return the maximum acceleration of the tip in these segments, cm/s^2."""
    return max([MIN_TIP_ACCELERATION] + [a for _, a, _, _ in segments])


def _from_rest(sections, end, along):
    # type: (Sequence[Section], Pose, float) -> TimedPiece
    """Return sections in time, begun at rest with at most `along` (cm/s^2), nowhere faster."""
    speeds = [section[0] for section in sections]
    v_end = sections[-1][0] ** 2 + 2 * sections[-1][1] * sections[-1][2]
    speeds = [0.0] + speeds[1:] + [math.sqrt(max(0.0, v_end))]
    times, out = [0.0], []
    for k, (_, _, length, cubics, across) in enumerate(sections):
        max_slope = max(
            [max(abs(c[1]), abs(c[1] + length * (2 * c[2] + 3 * c[3] * length))) for c in cubics]
        )
        most = min(along, JOINT_ACCELERATION / 2 / max_slope) if max_slope else along
        v0 = speeds[k]
        v1 = speeds[k + 1] = min(speeds[k + 1], math.sqrt(v0 * v0 + 2 * most * length))
        out.append((v0, (v1 * v1 - v0 * v0) / (2 * length), cubics, across))
        times.append(times[-1] + 2 * length / (v0 + v1))
    return times, out, end
