"""Steering by what is seen while the arm moves.  Pure."""

import math
from operator import mul, sub

from robot.motion.linear_systems import damped_solve
from robot.motion.online_trajectory import Landing, Moving
from robot.servoing.linear_algebra import distance, dot, length, median
from robot.servoing.pose_search import BETTER_POSTURE_SHARE, MAX_LEFTOVER_SHARE
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Any,
        Dict,
        Generator,
        Iterator,
        List,
        NamedTuple,
        Optional,
        Tuple,
        Union,
    )

    from robot.servoing.goal_estimate import GoalEstimate  # noqa: F401
    from robot.servoing.image_model import Features, LinearImageModel, Pixel, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Vector  # noqa: F401
    from robot.servoing.pose_search import Target  # noqa: F401
    from robot.servoing.servo import Servo  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401


ZERO_VELOCITY = 0.0, 0.0
"""Velocity of a goal that stands, px/s."""

if MYPY:
    Sight = NamedTuple(
        "Sight",
        [
            ("t", float),
            ("shape", LinearImageModel),
            ("offset", List[float]),
            ("goal", Pixel),
            ("speed", Pixel),
        ],
    )
else:
    Sight = record("Sight", "t shape offset goal speed")
# t of the last frame, s; image model, and its median error, px; goal, px, and its velocity, px/s.


class _Recent(object):
    """One of the last frames, and what the image model missed in it.

    Args:
        q: joint angles, rad (n).
        s: px (m).

    Attributes:
        shape: LinearImageModel by which it was predicted last; None at first.
    """

    __slots__ = ("q", "shape", "_missed", "_s", "_terms")

    def __init__(self, q, s):
        # type: (Pose, Features) -> None
        self.q, self._s = q, s
        self.shape = self._terms = None  # type: Any
        self._missed = ()  # type: Vector

    def missed_by(self, shape):
        # type: (LinearImageModel) -> Vector
        """Return what was seen less what is predicted, px (m); evaluated once for each model."""
        if self.shape is not shape:
            if self._terms is None:
                self._terms = shape.terms(self.q)
            self.shape = shape
            self._missed = [y - sum(map(mul, w, self._terms)) for y, w in zip(self._s, shape.W)]
        return self._missed


class Stream(object):
    """Steering by what is seen while the arm moves: every frame is of the joints at its own time.

    Set-points are absolute, so the delay of the camera does not act on the loop; only a goal that
    moves is predicted.  Aiming is a search that is done in slices, between control ticks.

    Args:
        servo: Servo; that it is steered is recorded there.
    """

    MIN_FRAMES, MAX_FRAMES, FRAMES_RANGE = 5, 12, math.radians(4)
    """Number of last frames whose median says by how much the model is off; the greatest number,
    if the joints have stayed within this range, rad."""
    MIN_AIM_CHANGE, STANDSTILL_RANGE = math.radians(1.5), math.radians(0.7)
    """Difference below which an aim is the same as the last one, rad; range of a joint that
    stands, rad."""
    ARRIVAL_DISTANCE, MIN_AIMS, ARRIVAL_TIME = math.radians(2), 3, 0.06
    """Distance from the aim within which the arm has arrived, rad, after this number of aims, and
    standing for this time, s: a joint that passes by goes on beyond."""
    EXPLORING_DELAY, MIN_EXPLORED = 0.15, math.radians(4)
    """Delay between the starts of two joints that explore, s; motion of every joint that must have
    been seen before there is an aim, rad."""
    SIGHT_MAX_AGE, AIM_MAX_AGE = 0.3, 1.6
    """Longest silence of a camera in use, s; age of what the last aim goes by beyond which brick or
    camera is too slow to steer by: where they keep up it is 0.2 to 1.1 s."""

    def __init__(self, servo):
        # type: (Servo) -> None
        self._servo = servo
        servo.steered = True
        self._still_since = None  # type: Optional[float]

    def begin(self, q, detour_pose=None, explore_from=None):
        # type: (Pose, Optional[Pose], Optional[Pose]) -> None
        """Begin a motion.

        Args:
            q: the first aim, rad (n).
            detour_pose: where it leads, if that is another posture, rad (n).
            explore_from: where the arm stands, rad (n), if its models are to be explored: the
                joints begin one after the other, so that the motion of each is seen by itself; the
                aim follows as soon as every one has moved.
        """
        self._explore_from = explore_from
        self._exploring_began = self._news_used_at = None  # type: Optional[float]
        self._low, self._high = list(q), list(q)  # the ranges in which the joints were seen, rad
        if explore_from is not None:
            self._low = self._high = list(explore_from)
        self._aim, self._aimed_at = tuple(q), 0.0  # type: Pose, float
        self._drift = None  # type: Optional[Vector]
        self._better = detour_pose or self._aim  # so far; a better one may be found on the path
        self._uncertainty_penalty = self._servo.uncertainty_penalty(q)
        self._recent = {}  # type: Dict[str, List[_Recent]]  # camera: the last frames
        # Camera: (t, goal, its speed) in the last one.
        self._seen = {}  # type: Dict[str, Tuple[float, Pixel, Pixel]]
        # Time of the newest frame that has not been aimed by.
        self._news_at = None  # type: Optional[float]
        self._still_at = ()  # type: Pose
        self._still_since = None
        self._confirmed = False
        self._aims = 0

    def see(self, frame, goal):
        # type: (MarkerFrame, Optional[GoalEstimate]) -> None
        """Add a MarkerFrame; `goal` is its GoalEstimate, None if that is a fixed pixel."""
        camera, t, q, s, where = frame
        if q is None or camera not in self._servo.cameras:
            return
        recent = self._recent.setdefault(camera, [])
        recent.append(_Recent(q, s))
        del recent[: -self.MAX_FRAMES]
        speed = ZERO_VELOCITY
        if goal is not None:
            where, speed = goal.at(t) or where, goal.velocity
        self._seen[camera] = t, where, speed
        self._q, self._news_at = q, t
        if self._explore_from is not None:
            self._low, self._high = list(map(min, self._low, q)), list(map(max, self._high, q))

    def _sight(self, camera):
        # type: (str) -> Sight
        """Return a camera's last frames as a Sight, with the median error of its model."""
        shape = self._servo.shape(camera)
        recent = self._recent[camera]
        if recent[0].shape is not shape:
            del recent[: -self.MIN_FRAMES]
        off = [frame.missed_by(shape) for frame in recent]
        if distance(recent[0].q, recent[-1].q) >= self.FRAMES_RANGE:
            off = off[-self.MIN_FRAMES :]
        t, where, speed = self._seen[camera]
        return Sight(t, shape, [median(column) for column in zip(*off)], where, speed)

    def reaim(self):
        # type: () -> Iterator[None]
        """Aim by what was seen since the last time: an iterator, each step a slice of the work."""
        t, self._news_at = self._news_at, None
        if t is None:
            return
        if self._explore_from is not None:
            if min(map(sub, self._high, self._low)) < self.MIN_EXPLORED:
                return
            self._explore_from, self._better = None, self._q
        cameras = sorted(c for c, seen in self._seen.items() if t - seen[0] < self.SIGHT_MAX_AGE)
        if not self._servo.suffices(cameras):
            return
        sights = {}
        for camera in cameras:
            sights[camera] = self._sight(camera)
            yield
        image, wanted, speed = self._servo.together(sights, t)
        q, start = self._q, self._better
        self._uncertainty_penalty = self._servo.uncertainty_penalty(q)  # that has learned since
        yield
        if self._drift is not None:
            start = [a + v * (t - self._aimed_at) for a, v in zip(self._aim, self._drift)]
        better, left = yield from self._nearing(image, wanted, start, q)
        if left > self._servo.tolerance:
            off = length(list(map(sub, wanted, image.predict(q))))
            if left > MAX_LEFTOVER_SHARE * off:  # perhaps beyond a wall: what from here?
                found, less = yield from self._nearing(image, wanted, q, q)
                if less < BETTER_POSTURE_SHARE * left:
                    better = found
        self._better = better
        self._settle_on(better, image, speed, t)

    def _nearing(self, image, wanted, start, q):
        # type: (LinearImageModel, Features, Pose, Pose) -> Generator[None, None, Target]
        """Take the steps of Servo.nearing, each in a slice of its own; return the last one."""
        steps = self._servo.nearing(image, wanted, start, q, self._uncertainty_penalty)
        for found in steps:  # noqa: B007 - the last one is returned
            yield
        return found

    def _settle_on(self, q, image, speed, t):
        # type: (Pose, LinearImageModel, Vector, float) -> None
        """Make q (rad) the aim, unless it is all but the same; of a moving goal, with its drift."""
        self._aims += 1
        self._news_used_at = t
        if any(speed):
            J = image.jacobian(q)
            size = math.sqrt(sum([dot(row, row) for row in J]))
            self._aim, self._drift = q, damped_solve(J, speed, 0.05 * size)
            self._aimed_at, self._confirmed = t, False
            return
        self._drift = None
        if distance(q, self._aim) > self.MIN_AIM_CHANGE:
            self._aim, self._confirmed = q, False
        elif self._still_since is not None and t > self._still_since:
            self._confirmed = True

    def give_up(self):
        # type: () -> None
        """Steer no more: from now on joints are explored one by one."""
        self._servo.steered = False

    def is_late(self, t):
        # type: (float) -> bool
        """Return whether the last aim, at time t (s), is too old to go by; asked in every tick."""
        if self._news_used_at is None:
            self._news_used_at = t
        return t - self._news_used_at > self.AIM_MAX_AGE

    def aim(self, t, q, follow=False):
        # type: (float, Pose, object) -> Union[Pose, Moving, Landing, None]
        """Return where the joints should be, as RobotArm.chase takes it.

        Args:
            t: s.
            q: joint angles at that time, rad (n).
            follow: do not end near a goal that moves.
        """
        if self._explore_from is not None:
            if self._exploring_began is None:
                self._exploring_began = t
            begun = (t - self._exploring_began) / self.EXPLORING_DELAY
            return [
                b if k <= begun else a
                for k, (a, b) in enumerate(zip(self._explore_from, self._aim))
            ]
        if self._still_since is None or distance(q, self._still_at) > self.STANDSTILL_RANGE:
            self._still_at, self._still_since, self._confirmed = q, t, False
        stands_for = t - self._still_since
        near = distance(q, self._aim) < self.ARRIVAL_DISTANCE and self._aims >= self.MIN_AIMS
        arrived = near and stands_for > self.ARRIVAL_TIME and not follow
        if self._drift is not None:
            late = t - self._aimed_at
            target = [a + v * late for a, v in zip(self._aim, self._drift)]
            return None if arrived else Moving(target, self._drift)
        if (
            self._confirmed
            and stands_for > 0.1
            and distance(q, self._aim) < 2 * self.MIN_AIM_CHANGE
        ):
            return None
        return Landing(self._aim) if arrived else self._aim
