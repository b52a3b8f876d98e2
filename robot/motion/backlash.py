"""Backlash compensation: motor set-points by which the links follow in spite of play.  Pure.

With a backlash b, a joint's motor m and link q touch on one side, sigma = +1 or -1, of the play:

    m = q + sigma b/2

The inverse of this nonlinearity (Tao and Kokotovic, 1996; survey: Nordin and Gutman, Automatica
38(10), 2002) jumps by b where sigma changes.  A jump would drive the motor at full power into the
link.  So sigma goes from s0 to s1 by the cubic that starts and ends at rest, with x = 0 .. 1:

    sigma = s0 + (s1 - s0) x^2 (3 - 2 x),    x = (t - begin) / T,    T = crossing_time

It is centred on the reversal, where the link all but stands; at a start it comes before the motion.
Feedback cannot replace it: the encoder is on the motor and does not see the link cross.  A link
that gravity pulls with more than friction stays on one side, and its reversals need no crossing.

Each crossing throws the link a little, and two within T throw it far: the motor comes back before
it has met the link, and hits it.  Where a joint turns by 0.02 degrees and back within 0.1 s, the
link goes by up to 1.4 degrees.  Without crossings the link stays where the joint turned, and is off
by no more than the depth of that.  So reversals are counted as the cycles of a varying load are
(rainflow counting: Matsuishi and Endo, 1968; ASTM E1049): the shallowest goes first, with the one
that undoes it, until those left are deep enough.
"""

import math

from shared.arm_description import JOINT_ACCELERATION

MYPY = False
if MYPY:
    from typing import Callable, Dict, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.interfaces import LinkMotion  # noqa: F401
    from robot.motion.trajectory import SetPoint  # noqa: F401
    from shared.arm_description import Joint  # noqa: F401

    Sides = Sequence[float]  # per joint, from -1 to +1; 0: unknown, or in the middle
    PreloadSides = Callable[[Pose], Sequence[int]]  # from the links' angles, rad; 0: none
    Crossing = Tuple[float, float, float]  # begin, time, step
    Bounds = Tuple[float, float, float]  # lower, upper, fastest: rad and rad/s

CROSSING_TIME = 0.14
"""Minimum time to cross a joint's backlash, s."""

CROSSING_SPEED = math.radians(109)
"""Maximum mean speed of a motor's shaft in a crossing, rad/s: faster, it knocks the link away."""

SLIGHT_SHARE = 0.075
"""Depth of a reversal from which it is worth a crossing, as a share of the backlash."""

RUN_UP = math.radians(1.5)
"""Least distance of a run-up, rad: by so much the play may be wider than described; as described it
is crossed before.  Half of the play, where that is more: its side may not be known."""

APPROACH_SPEED, APPROACH_ACCELERATION = 0.3, 0.2 * JOINT_ACCELERATION
"""Limits of a run-up, share of full speed and rad/s^2: the links stay on their motors' side."""

PRELOAD_STEP, PRELOAD_RESOLUTION = 0.12, 0.01
"""Period of the samples of gravity's side along a motion, and the resolution of its changes, s."""


ANGLE_SLACK, SPEED_SLACK = math.radians(1), 1.15
"""Tolerances of set-points beyond a joint's limits, rad, and its speed, a factor: for rounding."""


def motor_bounds(joints):
    # type: (Sequence[Joint]) -> List[Bounds]
    """Return per joint the bounds (lower, upper, fastest) of its motor: rad, rad, rad/s.

    They exceed the joint's own by half the backlash, and by the speed of a crossing.
    """
    bounds = []
    for joint in joints:
        beyond = joint.backlash / 2 + ANGLE_SLACK
        # (The cubic of `crossed` is 1.5 times as fast in the middle as on the average.)
        fastest = SPEED_SLACK * joint.max_speed + 1.5 * joint.backlash / crossing_time(joint)
        bounds.append((joint.lower - beyond, joint.upper + beyond, fastest))
    return bounds


class BacklashCompensation(object):
    """The motors' set-points for the links to follow a motion in spite of backlash.

    A link that is pushed in the positive direction lags its motor by half the backlash, in the
    negative direction it leads.  The backlash is crossed before the start where the first direction
    needs it, around every reversal, and where gravity's side changes.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motion: Trajectory or JointMove.
        sides: per joint, sigma at the start: +1, -1, or between (0: unknown).
        preload_sides: from the links' angles (rad) to the side, per joint, to which gravity presses
            it, 0: none; None: gravity presses none.

    Attributes:
        duration: s, from the start of the motion; `at` begins at -before.
        before: time of the crossing before the motion starts, s.
        rests_from: per joint, when its set-point comes to rest, s.
        sides: sigma per joint at the end.
    """

    def __init__(self, joints, motion, sides, preload_sides=None):
        # type: (Sequence[Joint], LinkMotion, Sides, Optional[PreloadSides]) -> None
        self._motion = motion
        self.duration = motion.duration
        self._crossings = []
        ends = []
        self.before = 0.0
        wanted_sides = _wanted_sides(joints, motion, preload_sides)
        for joint, side, wanted in zip(joints, sides, wanted_sides):
            backlash = joint.backlash
            time = crossing_time(joint)
            crossings = []  # type: List[Crossing]
            _, now = wanted[0]
            if now and now != side and backlash:
                self.before = max(self.before, time)
                crossings.append((-time, time, now - side))
            now = now or side
            for t, then in wanted[1:]:
                if not then or then == now:
                    continue
                crossings.append((t - time / 2, time, then - now))
                now = then
                if preload_sides and backlash:  # gravity's side may change at the ends, too
                    self.before = max(self.before, time / 2 - t)
                    self.duration = max(self.duration, t + time / 2)
            self._crossings.append((backlash / 2, side, crossings))
            ends.append(now)
        self.sides = tuple(ends)
        self.rests_from = [self.duration] * len(self.sides)

    def at(self, t):
        # type: (float) -> SetPoint
        """Return (q, path) of the motors' side at time `t` (s); see Trajectory.at."""
        q, path = self._motion.at(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            q[k] += half * (crossed(t, side, crossings)[0] if crossings else side)
        return q, path

    def speeds(self, t):
        # type: (float) -> List[float]
        """Return dq/dt of the motors' side at time `t` (s), rad/s."""
        speeds = self._motion.speeds(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            if crossings:
                speeds[k] += half * crossed(t, side, crossings)[1]
        return speeds

    def sides_at(self, t):
        # type: (float) -> Tuple[float, ...]
        """Return sigma per joint at time `t` (s), -1 .. +1."""
        return tuple(crossed(t, side, crossings)[0] for _, side, crossings in self._crossings)


def crossed_turns(joints, motion):
    # type: (Sequence[Joint], LinkMotion) -> Tuple[List[int], List[List[float]]]
    """Return (first directions, reversals) of a motion without those not worth a crossing.

    Returns:
        Per joint the sign of its first motion, and the times (s) of its reversals.
    """
    directions, reversals = [], []
    for k, joint in enumerate(joints):
        first, times = motion.directions[k], list(motion.reversals[k])
        angles = list(motion.extremes[k]) if times else []
        while times:
            # Depth from each extreme to the next, for each crossing that leaving it out saves: one
            # at the ends, else two.
            depths = [
                abs(b - a) / (2 if 0 < n < len(times) else 1)
                for n, (a, b) in enumerate(zip(angles, angles[1:]))
            ]
            n = depths.index(min(depths))
            if depths[n] >= SLIGHT_SHARE * joint.backlash:
                break
            if n == 0:
                first = -first
            begin, end = max(n - 1, 0), min(n + 1, len(times))
            del times[begin:end]
            del angles[begin + 1 : end + 1]
        directions.append(first)
        reversals.append(times)
    return directions, reversals


def _wanted_sides(joints, motion, preload_sides):
    # type: (Sequence[Joint], LinkMotion, Optional[PreloadSides]) -> List[List[Tuple[float, float]]]
    """Return per joint the list of (time, s; side from then on: +1, -1, 0: any), from 0 s on."""
    directions, reversals = crossed_turns(joints, motion)
    times = {0.0}.union(*reversals)
    held = {}  # type: Dict[float, Sequence[int]]

    def press(t):
        # type: (float) -> Sequence[int]
        if t not in held:
            held[t] = preload_sides(motion.at(t)[0]) if preload_sides else (0,) * len(directions)
        return held[t]

    def bisect(begin, end):
        # type: (float, float) -> None
        """Add the times (s) between these two at which gravity's side changes."""
        if press(begin) == press(end):
            return
        if end - begin <= PRELOAD_RESOLUTION:
            times.add(end)
            return
        bisect(begin, (begin + end) / 2)
        bisect((begin + end) / 2, end)

    if preload_sides:
        n = int(motion.duration / PRELOAD_STEP) + 1
        for k in range(n):
            bisect(motion.duration * k / n, motion.duration * (k + 1) / n)
    out = [[] for _ in directions]  # type: List[List[Tuple[float, float]]]
    for t in sorted(times):
        for wanted, side, first, turns in zip(out, press(t), directions, reversals):
            turned = sum([turn <= t for turn in turns])
            wanted.append((t, side or first * (-1) ** turned))
    return out


def pose_behind(joints, motion):
    # type: (Sequence[Joint], LinkMotion) -> List[float]
    """Return joint angles (rad) from which the move to the motion's start takes up all backlash."""
    behind = []
    directions, _ = crossed_turns(joints, motion)
    for joint, start, direction in zip(joints, motion.start, directions):
        back = start - direction * max(RUN_UP, joint.backlash / 2)
        behind.append(min(max(back, joint.lower), joint.upper))
    return behind


def crossing_time(joint):
    # type: (Joint) -> float
    """Return the time that a joint's motor takes to cross the backlash, s."""
    return max(CROSSING_TIME, joint.backlash * joint.gear / CROSSING_SPEED)


def crossed(t, side, crossings):
    # type: (float, float, Sequence[Crossing]) -> Tuple[float, float]
    """Return sigma at time `t`, and its rate, 1/s.

    Args:
        t: s.
        side: sigma before the crossings.
        crossings: of each (begin, s; time, s; step of sigma).
    """
    rate = 0.0
    for begin, time, step in crossings:
        if t > begin:
            x = (t - begin) / time
            if x >= 1.0:
                side += step
            else:
                side += step * x * x * (3 - 2 * x)
                rate += step * 6 * x * (1 - x) / time
    return side, rate
