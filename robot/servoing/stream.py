"""Steering by what is seen while the arm moves.  Pure."""

import math
from operator import sub

from robot.motion.kinematics import damped_solve
from robot.motion.online_trajectory import Moving
from robot.servoing.linear_algebra import apart, dot, median
from shared.record import record

STANDS = 0.0, 0.0
"""The velocity of a goal that stands, px/s."""

_Sight = record("_Sight", "t shape offset goal speed")


def _missed(shape, q, s):
    return q, s, shape, list(map(sub, s, shape.predict(list(q))))


class Stream(object):
    """Steers by what is seen while the arm moves: every frame is of the joints at its own time.

    Set-points are absolute, so the delay of the camera does not act on the loop; only a goal that
    moves is predicted.  Aiming is a search that is done in slices, between control ticks.

    Args:
        servo: Servo, whose models have been explored.

    Attributes:
        still_since: since when the joints are where they are, s.
    """

    FEWEST, MOST, NEAR = 5, 12, math.radians(4)
    """The last FEWEST frames, or up to MOST if the joints have stayed within NEAR (rad), say by
    their median by how much the model is off."""
    REAIM, STILL = math.radians(1.5), math.radians(0.7)
    """An aim so near to the last one is the same; a joint that stays within STILL stands, rad."""
    ARRIVED, SURE = math.radians(2), 3
    """Within this of its aim (rad), after so many of them, it has arrived."""
    STALE = 0.3
    """What a camera has not seen for so long is not gone by, s."""

    def __init__(self, servo):
        self._servo = servo
        self.still_since = None

    def begin(self, q):
        """Begin with the first aim, rad."""
        self._aim, self._drift, self._aimed_at = tuple(q), None, None
        self._better = self._aim  # so far; on the way there it may be found to be another
        self._recent = {}  # camera: the last frames, [(q, s, shape, what the shape missed, px)]
        self._sights = {}
        self._news_at = None  # time of the newest frame that has not been aimed by
        self._still_at = self.still_since = None
        self._confirmed = False
        self._aims = 0

    def see(self, frame, goal):
        """Take in a MarkerFrame; `goal` is its GoalEstimate, None if that is a fixed pixel."""
        camera, t, q, s, where = frame
        if q is None or camera not in self._servo.cameras:
            return
        shape = self._servo.shape(camera)
        recent = self._recent.setdefault(camera, [])
        if recent and recent[-1][2] is not shape:
            recent[:] = [_missed(shape, q, s) for q, s, _, _ in recent[1 - self.FEWEST :]]
        recent.append(_missed(shape, q, s))
        del recent[: -self.MOST]
        slow = apart(recent[0][0], q) < self.NEAR
        near = [off for _, _, _, off in (recent if slow else recent[-self.FEWEST :])]
        offset = [median(column) for column in zip(*near)]
        speed = STANDS
        if goal is not None:
            where, speed = goal.at(t), goal.velocity
        self._sights[camera] = _Sight(t, shape, offset, where, speed)
        self._news_at = t

    def reaim(self):
        """Aim by what was seen since the last time: an iterator, each step a slice of the work."""
        t, self._news_at = self._news_at, None
        if t is None:
            return
        sights = {c: sight for c, sight in self._sights.items() if t - sight.t < self.STALE}
        if not self._servo.suffices(sorted(sights)):
            return
        image, wanted, speed = self._servo.together(sights, t)
        start = self._better
        if self._drift is not None:
            start = [a + v * (t - self._aimed_at) for a, v in zip(self._aim, self._drift)]
        for found, _ in self._servo.nearing(image, wanted, start):
            self._better = found
            yield
        self._settle_on(self._better, image, speed, t)

    def _settle_on(self, q, image, speed, t):
        """Make it the aim, unless it is all but the same."""
        self._aims += 1
        if any(speed):
            J = image.jacobian(q)
            size = math.sqrt(sum([dot(row, row) for row in J]))
            self._aim, self._drift = q, damped_solve(J, speed, 0.05 * size)
            self._aimed_at, self._confirmed = t, False
            return
        self._drift = None
        if apart(q, self._aim) > self.REAIM:
            self._aim, self._confirmed = q, False
        elif self.still_since is not None and t > self.still_since:
            self._confirmed = True

    def has_arrived(self, q):
        """Whether the joints, at q (rad), are all but there, where they can be looked at."""
        return self._aims >= self.SURE and apart(q, self._aim) < self.ARRIVED

    def aim(self, t, q):
        """Where the joints should be at time t, rad or Moving; None: stand and look."""
        if self._still_at is None or apart(q, self._still_at) > self.STILL:
            self._still_at, self.still_since, self._confirmed = q, t, False
        if self._drift is not None:
            late = t - self._aimed_at
            return Moving([a + v * late for a, v in zip(self._aim, self._drift)], self._drift)
        there = apart(q, self._aim) < 2 * self.REAIM
        if there and self._confirmed and t - self.still_since > 0.1:
            return None
        return self._aim
