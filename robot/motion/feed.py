"""Feed override and feed hold: a plan whose time goes slower, stops and goes on.  Pure.

The terms are those of machine tools.  Every point of the way stays where it is; only when the tip
gets there changes.  What a plan gives at its own time tau is asked for by the loop's time t:

    q(t) = plan(tau(t)),  dq/dt = rate(t) dq/dtau,  dtau/dt = rate

The rate changes linearly, so that tau is a parabola, then a straight line.
"""

import math

from robot.motion.online_trajectory import STOP
from robot.motion.trajectory import JOINT_ACCELERATION

MYPY = False
if MYPY:
    from typing import Callable, Iterator, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.backlash import BacklashCompensation  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.linear_systems import Vector  # noqa: F401
    from robot.motion.trajectory import Cubic, Segment, SetPoint, TimedPiece  # noqa: F401

    Way = Tuple[float, float, float, Sequence[Cubic], Optional[Vector]]  # v, a, cm, cubics, across

RAMP_TIME, LONGEST_RAMP = 0.15, 0.2
"""The rate goes from 1 to 0 in this time at the least, s, and at the most: joints that turn fast
take longer, as they are to slow down no harder than a plan does (JOINT_ACCELERATION)."""

LOOK_PERIOD = 0.06
"""So often is the wanted rate asked for, s."""

HOLD_TIME = 0.02
"""A motion that is held is over so long after its set-points stand, s, wherever the joints are: the
pen is to leave the paper."""

STANDING = 0.1
"""At a lower rate the tip all but stands, and along its path means nothing."""

LEAST_SPEED = 0.01
"""A piece is never drawn slower, whatever it says, cm/s."""

LEAST_ACCELERATION = 5.0
"""Of the tip, where a piece shows none that is greater, cm/s^2."""

SHORTEST = 0.005
"""What is left of a way, cm, where less is nothing."""


class FeedOverride(object):
    """The plans of a motion, one after the other, at a rate that may change at any moment.

    Used by the control loop like the BacklashCompensation that it is a wrapper of.

    Args:
        look: called with the clock's time (s) every LOOK_PERIOD; the rate that is wanted, from 0
            (hold) to 1.

    Attributes:
        duration, before, rests_from, sides: as of a BacklashCompensation, by the loop's time.
        index: which plan it is in, from 0 on; past the last one when all are over.
        reached: the plan's own time when the rate was last asked for, s.
    """

    def __init__(self, look):
        # type: (Callable[[float], float]) -> None
        self._look = look
        self._look_at = -math.inf
        self._r0 = self._r1 = 1.0
        self.index = 0
        self.reached = 0.0

    def begin_at(self, rate):
        # type: (float) -> None
        """The next motion begins at this rate."""
        self._r1 = rate

    def each(self, plans):
        # type: (Sequence[BacklashCompensation]) -> Iterator[FeedOverride]
        """Yield itself for every plan in turn; no more once it is held."""
        for self.index, plan in enumerate(plans):
            self._begin(plan)
            yield self
            if self.held:
                return
        self.index += 1

    def _begin(self, plan):
        # type: (BacklashCompensation) -> None
        self._plan = plan
        self.before = plan.before
        self._t0 = self._t1 = self._tau0 = self._tau1 = -plan.before
        # (A rate of 0 has ended the motion before; a ramp goes on where it was to end.)
        self._r0, self._slope = self._r1, 0.0
        self._foresee()

    @property
    def held(self):
        # type: () -> bool
        """Whether it stands or comes to stand, as wanted, though there may be more to do."""
        return self._r1 == 0.0

    @property
    def tau(self):
        # type: () -> float
        """The plan's own time at which it ends or is held, s."""
        return min(self._tau(self.duration), self._plan.duration)

    @property
    def sides(self):
        # type: () -> Tuple[float, ...]
        """Where the backlash lies at the end."""
        return self._plan.sides_at(self._tau(self.duration))

    def order(self, t, rate):
        # type: (float, float) -> None
        """From the loop's time `t` (s) on the rate goes to `rate`, 0 to 1."""
        now = self._rate(t)
        self._t0, self._tau0, self._r0 = t, self._tau(t), now
        fastest = max(map(abs, self._plan.speeds(self._tau0)))
        whole = min(max(RAMP_TIME, fastest / JOINT_ACCELERATION), LONGEST_RAMP)
        time = whole * abs(rate - now)
        self._slope = (rate - now) / time if time else 0.0
        self._r1, self._t1 = rate, t + time
        self._tau1 = self._tau0 + time * (now + rate) / 2
        self._foresee()

    def _foresee(self):
        # type: () -> None
        """When it comes to its end, or to stand."""
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
        if t >= self._t1:
            return self._tau1 + self._r1 * (t - self._t1)
        dt = t - self._t0
        return self._tau0 + dt * (self._r0 + 0.5 * self._slope * dt)

    def _rate(self, t):
        # type: (float) -> float
        return self._r1 if t >= self._t1 else self._r0 + self._slope * (t - self._t0)

    def at(self, t):
        # type: (float) -> SetPoint
        """As BacklashCompensation.at, by the loop's time."""
        # (Most ticks find the rate as it stays: for them no function is called.)
        steady = t >= self._t1
        q, path = self._plan.at(self._tau1 + self._r1 * (t - self._t1) if steady else self._tau(t))
        if (self._r1 if steady else self._rate(t)) > STANDING:
            return q, path
        return q, None

    def speeds(self, t):
        # type: (float) -> List[float]
        """As BacklashCompensation.speeds, by the loop's time."""
        if t < self._t1:
            rate, speeds = self._rate(t), self._plan.speeds(self._tau(t))
        else:
            rate = self._r1
            speeds = self._plan.speeds(self._tau1 + rate * (t - self._t1))
        return speeds if rate == 1.0 else [rate * speed for speed in speeds]

    def sides_at(self, t):
        # type: (float) -> Tuple[float, ...]
        """As BacklashCompensation.sides_at, by the loop's time."""
        return self._plan.sides_at(self._tau(t))

    def tick(self, t, now, angles):
        # type: (float, float, Pose) -> object
        """What the control loop calls in every tick: ask for the rate now and then."""
        if now < self._look_at:
            if self._r1:
                return None
        else:
            self._look_at = now + LOOK_PERIOD
            self.reached = self._tau(t)
            wanted = self._look(now)
            if wanted != self._r1:
                self.order(t, wanted)
        return STOP if self._r1 == 0.0 and t > self.duration + HOLD_TIME else None


# ---- a piece drawn slower, and what is left of one


def slowed(piece, share):
    # type: (TimedPiece, float) -> TimedPiece
    """A piece drawn with no more than this share of its greatest speed, speeding up as ever.

    At another rate, on the contrary, all of it takes longer, also where the tip stands while a
    backlash is crossed.

    Args:
        piece: (times, segments, end), see robot.motion.trajectory.Trajectory.
    """
    times, segments, end = piece
    most = share * max([v for v, _, _, _ in segments] + [LEAST_SPEED])
    out, new, v0 = [], [0.0], min(segments[0][0], most)
    for k, (v, a, cubics, across) in enumerate(segments):
        dt = times[k + 1] - times[k]
        length, v1 = dt * (v + 0.5 * a * dt), min(max(0.0, v + a * dt), most)
        out.append((v0, (v1 * v1 - v0 * v0) / (2 * length), cubics, across))
        new.append(new[-1] + 2 * length / max(v0 + v1, LEAST_SPEED))
        v0 = v1
    return new, out, end


def same_place(piece, other, tau):
    # type: (TimedPiece, TimedPiece, float) -> float
    """When a piece is where another one, the same but for its times, is at its time `tau`, s."""
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


def rest_of(piece, tau):
    # type: (TimedPiece, float) -> Optional[TimedPiece]
    """The rest of a piece from its time `tau` (s) on, begun at rest; None if there is next to none.

    The way is the same to the last digit; the tip speeds up as it did at the piece's beginning.

    Args:
        piece: (times, segments, end), see robot.motion.trajectory.Trajectory.

    Returns:
        Such a triple.
    """
    times, segments, end = piece
    if tau <= 0:
        return piece
    k = len([t for t in times[1:-1] if t <= tau])
    ways = []  # type: List[Way]
    for (t, t_end), (v, a, cubics, across) in list(zip(zip(times, times[1:]), segments))[k:]:
        ways.append((v, a, (t_end - t) * (v + 0.5 * a * (t_end - t)), cubics, across))
    v, a, whole, cubics, across = ways[0]
    dt = min(tau, times[k + 1]) - times[k]
    done = dt * (v + 0.5 * a * dt)
    ways[0] = v + a * dt, a, whole - done, [_moved(c, done) for c in cubics], across
    if sum([way[2] for way in ways]) < SHORTEST:
        return None
    if ways[0][2] < SHORTEST and len(ways) > 1:  # too short to speed up in: of one cubic
        del ways[0]
        # (Its few micrometres are a leap of the set-points far below what an encoder shows.)
    if len(ways) == 1:  # it must speed up and slow down
        v, a, whole, cubics, across = ways[0]
        half = whole / 2
        middle = math.sqrt(max(0.0, v * v + 2 * a * half))
        rest = middle, a, half, [_moved(c, half) for c in cubics], across
        ways = [(v, a, half, cubics, across), rest]
    return _from_rest(ways, end, _acceleration(segments))


def _moved(cubic, s):
    # type: (Cubic, float) -> List[float]
    """The coefficients of a cubic from `s` on."""
    c0, c1, c2, c3 = cubic
    return [c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + 3 * c3 * s), c2 + 3 * c3 * s, c3]


def _acceleration(segments):
    # type: (Sequence[Segment]) -> float
    """With which the tip was to speed up, cm/s^2."""
    return max([LEAST_ACCELERATION] + [a for _, a, _, _ in segments])


def _from_rest(ways, end, along):
    # type: (Sequence[Way], Pose, float) -> TimedPiece
    """Ways (v, a, length, cubics, across) in time, begun at rest: nowhere faster than they were."""
    speeds = [way[0] for way in ways]
    v_end = ways[-1][0] ** 2 + 2 * ways[-1][1] * ways[-1][2]
    speeds = [0.0] + speeds[1:] + [math.sqrt(max(0.0, v_end))]
    times, out = [0.0], []
    for k, (_, _, length, cubics, across) in enumerate(ways):
        steep = max(
            [max(abs(c[1]), abs(c[1] + length * (2 * c[2] + 3 * c[3] * length))) for c in cubics]
        )
        most = min(along, JOINT_ACCELERATION / 2 / steep) if steep else along
        v0 = speeds[k]
        v1 = speeds[k + 1] = min(speeds[k + 1], math.sqrt(v0 * v0 + 2 * most * length))
        out.append((v0, (v1 * v1 - v0 * v0) / (2 * length), cubics, across))
        times.append(times[-1] + 2 * length / (v0 + v1))
    return times, out, end
