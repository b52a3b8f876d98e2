"""Backlash compensation: what motors must do for the links to follow in spite of play.  Pure."""

import math

TAKE_UP = 0.14
"""Least time to cross a joint's play, s."""

TAKE_UP_SPEED = math.radians(109)
"""Mean speed of a motor's shaft crossing the play, rad/s: faster, it would knock the link away."""

PRESSED_EVERY, PRESSED_TO = 0.12, 0.01
"""How often along a motion it is asked where gravity presses; where that changes is then found to
so much, s."""


class BacklashCompensation(object):
    """The motors' set-points for the links to follow a motion in spite of play.

    A link pushed in the positive direction lags its motor by half the play, in the negative
    direction it leads.  The play is crossed before the start where the first direction differs from
    where the play lies, and around every reversal, where the link all but stands.  Where gravity
    presses a link on its motor, whichever way that goes, the play lies as it is pressed; and it is
    crossed where gravity lets go or takes over.

    Args:
        joints: the arm's shared.arm_description.Joints.
        motion: Trajectory or JointMove.
        sides: per joint, where the play lies at the start: +1, -1, or between (0: the middle).
        pressed: from the links' angles (rad) to the side, per joint, on which gravity presses the
            play, 0: none; None: it presses on none.

    Attributes:
        duration: s, from the start of the motion; `at` begins at -before.
        before: s of crossing before the motion starts.
        rests_from: per joint, when its set-point comes to rest, s.
        sides: where the play lies at the end.
    """

    def __init__(self, joints, motion, sides, pressed=None):
        self._motion = motion
        self.duration = motion.duration
        self._crossings = []
        self.sides = []
        self.before = 0.0
        for joint, side, wanted in zip(joints, sides, _wanted_sides(motion, pressed)):
            play = joint.backlash
            time = take_up_time(joint)
            crossings = []
            _, now = wanted[0]
            if now and now != side and play:
                self.before = max(self.before, time)
                crossings.append((-time, time, now - side))
            now = now or side
            for t, then in wanted[1:]:
                if not then or then == now:
                    continue
                crossings.append((t - time / 2, time, then - now))
                now = then
                if pressed and play:  # gravity takes over anywhere, also at the very ends
                    self.before = max(self.before, time / 2 - t)
                    self.duration = max(self.duration, t + time / 2)
            self._crossings.append((play / 2, side, crossings))
            self.sides.append(now)
        self.sides = tuple(self.sides)
        self.rests_from = [self.duration] * len(self.sides)

    def at(self, t):
        """(q, path) of the motors' side at time `t` (s); see Trajectory.at."""
        q, path = self._motion.at(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            q[k] += half * (crossed(t, side, crossings)[0] if crossings else side)
        return q, path

    def speeds(self, t):
        """dq/dt of the motors' side at time `t` (s), rad/s."""
        speeds = self._motion.speeds(t)
        for k, (half, side, crossings) in enumerate(self._crossings):
            if crossings:
                speeds[k] += half * crossed(t, side, crossings)[1]
        return speeds

    def sides_at(self, t):
        """Per joint, where the play lies at time `t` (s): from -1 to +1."""
        return tuple(crossed(t, side, crossings)[0] for _, side, crossings in self._crossings)


def _wanted_sides(motion, pressed):
    """Per joint, where the play is to lie from when on: (s, +1, -1 or 0: as it lies), from 0 on."""
    times = {0.0}.union(*motion.reversals)
    held = {}

    def press(t):
        if t not in held:
            held[t] = pressed(motion.at(t)[0]) if pressed else (0,) * len(motion.directions)
        return held[t]

    def look(begin, end):
        """Add the times between these two at which another side is pressed on."""
        if press(begin) == press(end):
            return
        if end - begin <= PRESSED_TO:
            times.add(end)
            return
        look(begin, (begin + end) / 2)
        look((begin + end) / 2, end)

    if pressed:
        n = int(motion.duration / PRESSED_EVERY) + 1
        for k in range(n):
            look(motion.duration * k / n, motion.duration * (k + 1) / n)
    out = [[] for _ in motion.directions]
    for t in sorted(times):
        for wanted, side, first, turns in zip(out, press(t), motion.directions, motion.reversals):
            turned = sum([turn <= t for turn in turns])
            wanted.append((t, side or first * (-1) ** turned))
    return out


def take_up_time(joint):
    """How long a joint's motor takes to cross the play, s."""
    return max(TAKE_UP, joint.backlash * joint.gear / TAKE_UP_SPEED)


def crossed(t, side, crossings):
    """Where the play lies at time `t`, and how fast that changes, 1/s.

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
