"""Backlash compensation: what motors must do for the links to follow all the same.  Pure."""

import math

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
"""Least time to cross a joint's backlash, s."""

CROSSING_SPEED = math.radians(109)
"""Mean speed of a motor's shaft on its way across, rad/s: faster, it would knock the link away."""

APPROACH_MARGIN = math.radians(2)
"""A start is approached from the backlash and so much more, rad."""

APPROACH_SPEED, APPROACH_ACCELERATION = 0.3, math.radians(15)
"""Share of full speed, and rad/s^2, at which links stay on the side that they are pushed by."""

PRELOAD_STEP, PRELOAD_RESOLUTION = 0.12, 0.01
"""How often along a motion it is asked where gravity presses; where that changes is then found to
so much, s."""


SLACK, SPEED_SLACK = math.radians(1), 1.15
"""Set-points are planned within the joints' limits and speeds; so far beyond, rad and as a factor,
roundings may take them."""


def motor_bounds(joints):
    # type: (Sequence[Joint]) -> List[Bounds]
    """Per joint, bounds of its motor's set-points, and of their speed: rad, rad, rad/s.

    Beyond the joint's own the motor goes by half the backlash, and by what crossing that takes.
    """
    bounds = []
    for joint in joints:
        beyond = joint.backlash / 2 + SLACK
        # (The cubic of `crossed` is 1.5 times as fast in the middle as on the average.)
        fastest = SPEED_SLACK * joint.max_speed + 1.5 * joint.backlash / crossing_time(joint)
        bounds.append((joint.lower - beyond, joint.upper + beyond, fastest))
    return bounds


class BacklashCompensation(object):
    """The motors' set-points for the links to follow a motion in spite of backlash.

    A link pushed in the positive direction lags its motor by half the backlash, in the negative
    direction it leads.  The backlash is crossed before the start where the first direction differs
    from where it lies, and around every reversal, where the link all but stands.  Where gravity
    presses a link on its motor, whichever way that goes, the backlash lies as it is pressed; and it
    is crossed where gravity lets go or takes over.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motion: Trajectory or JointMove.
        sides: per joint, where the backlash lies at the start: +1, -1, or between (0: the middle).
        preload_sides: from the links' angles (rad) to the side, per joint, to which gravity presses
            the backlash, 0: none; None: it presses none.

    Attributes:
        duration: s, from the start of the motion; `at` begins at -before.
        before: s of crossing before the motion starts.
        rests_from: per joint, when its set-point comes to rest, s.
        sides: where the backlash lies at the end.
    """

    def __init__(self, joints, motion, sides, preload_sides=None):
        # type: (Sequence[Joint], LinkMotion, Sides, Optional[PreloadSides]) -> None
        self._motion = motion
        self.duration = motion.duration
        self._crossings = []
        ends = []
        self.before = 0.0
        for joint, side, wanted in zip(joints, sides, _wanted_sides(motion, preload_sides)):
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
                if preload_sides and backlash:  # gravity takes over anywhere, also at the very ends
                    self.before = max(self.before, time / 2 - t)
                    self.duration = max(self.duration, t + time / 2)
            self._crossings.append((backlash / 2, side, crossings))
            ends.append(now)
        self.sides = tuple(ends)
        self.rests_from = [self.duration] * len(self.sides)

    def at(self, t):
        # type: (float) -> SetPoint
        """(q, path) of the motors' side at time `t` (s); see Trajectory.at."""
        q, path = self._motion.at(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            q[k] += half * (crossed(t, side, crossings)[0] if crossings else side)
        return q, path

    def speeds(self, t):
        # type: (float) -> List[float]
        """dq/dt of the motors' side at time `t` (s), rad/s."""
        speeds = self._motion.speeds(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            if crossings:
                speeds[k] += half * crossed(t, side, crossings)[1]
        return speeds

    def sides_at(self, t):
        # type: (float) -> Tuple[float, ...]
        """Per joint, where the backlash lies at time `t` (s): from -1 to +1."""
        return tuple(crossed(t, side, crossings)[0] for _, side, crossings in self._crossings)


def _wanted_sides(motion, preload_sides):
    # type: (LinkMotion, Optional[PreloadSides]) -> List[List[Tuple[float, float]]]
    """Per joint, the sides to lie on from when on: (s, +1, -1 or 0: as it lies), from 0 on."""
    times = {0.0}.union(*motion.reversals)
    held = {}  # type: Dict[float, Sequence[int]]

    def press(t):
        # type: (float) -> Sequence[int]
        if t not in held:
            held[t] = (
                preload_sides(motion.at(t)[0]) if preload_sides else (0,) * len(motion.directions)
            )
        return held[t]

    def look(begin, end):
        # type: (float, float) -> None
        """Add the times between these two at which another side is pressed on."""
        if press(begin) == press(end):
            return
        if end - begin <= PRELOAD_RESOLUTION:
            times.add(end)
            return
        look(begin, (begin + end) / 2)
        look((begin + end) / 2, end)

    if preload_sides:
        n = int(motion.duration / PRELOAD_STEP) + 1
        for k in range(n):
            look(motion.duration * k / n, motion.duration * (k + 1) / n)
    out = [[] for _ in motion.directions]  # type: List[List[Tuple[float, float]]]
    for t in sorted(times):
        for wanted, side, first, turns in zip(out, press(t), motion.directions, motion.reversals):
            turned = sum([turn <= t for turn in turns])
            wanted.append((t, side or first * (-1) ** turned))
    return out


def pose_behind(joints, motion):
    # type: (Sequence[Joint], LinkMotion) -> List[float]
    """Joint angles, rad, from which all backlash is taken up on the way to the motion's start."""
    behind = []
    for joint, start, direction in zip(joints, motion.start, motion.directions):
        back = start - direction * (joint.backlash + APPROACH_MARGIN)
        behind.append(min(max(back, joint.lower), joint.upper))
    return behind


def crossing_time(joint):
    # type: (Joint) -> float
    """How long a joint's motor takes to cross the backlash, s."""
    return max(CROSSING_TIME, joint.backlash * joint.gear / CROSSING_SPEED)


def crossed(t, side, crossings):
    # type: (float, float, Sequence[Crossing]) -> Tuple[float, float]
    """Where the backlash lies at time `t`, and how fast that changes, 1/s.

    Args:
        side: where it lay before.
        crossings: (begin, time, step) of each.
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
