"""Sightings: what the cameras have shown of tip and goal, at which joint angles, and when.

Pure.
"""

import math
from collections import deque

from robot.servoing.goal_estimate import GoalEstimate
from robot.servoing.joint_history import JointHistory
from robot.servoing.picture_rates import PictureRates
from shared.messages import EFFECTOR, GOAL, LEAST_CONFIDENCE
from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import (  # noqa: F401
        Callable,
        Deque,
        Dict,
        Iterable,
        List,
        Mapping,
        NamedTuple,
        Optional,
        Sequence,
        Set,
        Tuple,
    )

    from robot.servoing.image_model import Pixel  # noqa: F401
    from robot.servoing.repeated_pictures import RepeatedPictures  # noqa: F401
    from shared.messages import Observation  # noqa: F401

    _Angles = Tuple[float, ...]  # rad
    LogFrame = Callable[[str, float, Optional[_Angles], Optional[Pixel], Optional[Pixel]], object]

SIGHT_TIMEOUT = 0.3
"""Longest silence about the marker before it counts as lost, s: nothing moves on old data."""

SMOOTHING_TIME = 0.5
"""Time constant of the smoothed error when a moving goal is followed, s."""

MAX_SEEN = 128
"""Places of the tip that are stored, their greatest number."""

if MYPY:
    MarkerFrame = NamedTuple(
        "MarkerFrame",
        [
            ("camera", str),
            ("t", float),
            ("q", Optional[Tuple[float, ...]]),
            ("s", Pixel),
            ("goal", Pixel),
        ],
    )
else:
    MarkerFrame = record("MarkerFrame", "camera t q s goal")
MarkerFrame.__doc__ = "Frame of one camera: capture time t, s; joint angles q, rad; s and goal, px."


# Pairing by capture time.  A picture is of the past: exposure, transfer and marker search take tens
# of milliseconds, in which a joint at 60 deg/s turns by degrees.  So the joint angles that belong
# to a picture are those of its capture, not of its arrival.  Each Observation bears the time t of
# its capture, by now on the brick's clock: the offset of the clocks is estimated as in NTP
# (Cristian 1989, shared/peer_clock.py).  Each control tick adds (t, q) to the JointHistory, and
# q(t) is interpolated linearly.  Before the first entry there are no angles; after the last there
# is no extrapolation.  The usual other method subtracts a constant delay from the arrival: it is
# wrong by the jitter of camera and network.  The error that is left enters as MOTION_SIGMA
# (image_models).


class Sightings(object):
    """The sightings of a run.

    Args:
        fixed_goals: {camera: (u, v)}, px; none for the marker.
        streaming: whether the arm is steered by them while it moves.
        pictures: RepeatedPictures.

    Attributes:
        history: JointHistory.
        pictures: as given.
        rates: PictureRates.
        goals: {camera: GoalEstimate}.
        seen_by: {camera: when both tip and goal were last received, s}.
        behind: {camera: e, smoothed, px}.
        seen: the last (camera, t, s, whether in motion) of the tip, also where no goal is known.
    """

    def __init__(self, fixed_goals, streaming, pictures):
        # type: (Mapping[str, Pixel], bool, RepeatedPictures) -> None
        self.history, self.pictures = JointHistory(), pictures
        self.rates = PictureRates(SIGHT_TIMEOUT)
        self.goals = {}  # type: Dict[str, GoalEstimate]
        self.seen_by = {}  # type: Dict[str, float]
        self.behind = {}  # type: Dict[str, Tuple[float, ...]]
        self.seen = deque(maxlen=MAX_SEEN)  # type: Deque[Tuple[str, float, Pixel, bool]]
        self._fixed_goals, self._streaming = fixed_goals, streaming
        self._senders = set()  # type: Set[str]  # cameras that send, whatever they see
        self._blind = set()  # type: Set[str]  # those that were reported as blind
        self._smoothed_at = {}  # type: Dict[str, float]

    def frame(self, seen, now, moving, log=None):
        # type: (Observation, float, bool, Optional[LogFrame]) -> Optional[MarkerFrame]
        """Return the MarkerFrame of an Observation; None unless the tip is seen and the goal known.

        None, too, of a picture that has come before, with the joints elsewhere.

        Args:
            seen: Observation.
            now: s.
            moving: whether the arm moves.
            log: called with what a MarkerFrame has, also where something is not known (None).
        """
        camera = seen.camera
        self._senders.add(camera)
        self.rates.add(seen, now)
        q = self.history.at(seen.t)
        if not self.pictures.is_new(seen, q):
            if camera in self.pictures.frozen and camera in self.seen_by:
                self.seen_by[camera] = -math.inf
            return None
        tip, goal = seen.markers.get(EFFECTOR), seen.markers.get(GOAL)
        s = tip[:2] if tip and tip[2] >= LEAST_CONFIDENCE else None
        if s:
            self.seen.append((camera, seen.t, s, moving))
            if goal and goal[2] >= LEAST_CONFIDENCE and not self._fixed_goals:
                if camera not in self.goals:
                    self.goals[camera] = GoalEstimate()
                self.goals[camera].add(seen.t, goal[:2], goal[2], s)
        where = self._fixed_goals.get(camera)
        if camera in self.goals:
            estimate = self.goals[camera]
            # In motion nothing is made of where it is, unless it is steered for.
            where = estimate.latest if moving and not self._streaming else estimate.at(seen.t)
        if log:
            log(camera, seen.t, q, s, where)
        if s is None or where is None:
            return None
        self.seen_by[camera] = now
        return MarkerFrame(camera, seen.t, q, s, where)

    def smooth(self, frame):
        # type: (MarkerFrame) -> None
        """Add the error of a MarkerFrame to the smoothed one in `behind`."""
        e = tuple([a - b for a, b in zip(frame.s, frame.goal)])
        camera = frame.camera
        share = min((frame.t - self._smoothed_at.get(camera, frame.t)) / SMOOTHING_TIME, 1.0)
        self._smoothed_at[camera] = frame.t
        before = self.behind.get(camera, e)
        self.behind[camera] = tuple([b + share * (x - b) for b, x in zip(before, e)])

    def seeing(self, now):
        # type: (float) -> List[str]
        """Return the cameras that have lately seen tip and goal."""
        return [
            camera for camera in sorted(self.seen_by) if now - self.seen_by[camera] <= SIGHT_TIMEOUT
        ]

    def goal_moves(self, now):
        # type: (float) -> bool
        """Return whether the goal moves, as far as known."""
        seeing = self.seeing(now) or self.goals
        return any(goal.moving for camera, goal in self.goals.items() if camera in seeing)

    def changes(self, now):
        # type: (float) -> Tuple[Sequence[str], Sequence[str]]
        """Return (cameras that have lost sight of the marker, those that see it again) anew."""
        if not self._blind and len(self.seeing(now)) == len(self.seen_by):
            return (), ()
        blind = set(self.seen_by) - set(self.seeing(now))
        lost, found = sorted(blind - self._blind), sorted(self._blind - blind)
        self._blind = blind
        return lost, found

    @property
    def without_goal(self):
        # type: () -> List[str]
        """The cameras that send although a pixel is the goal of others only."""
        return sorted(self._senders - set(self._fixed_goals)) if self._fixed_goals else []

    @property
    def any_blind(self):
        # type: () -> bool
        """Whether some camera has lost sight of the marker."""
        return bool(self._blind)

    def what_is_missing(self, now, joints, seconds):
        # type: (float, int, float) -> str
        """Return one line for people: why it does not go on.

        Args:
            now: s.
            joints: how many.
            seconds: for how long nothing was seen, s.
        """
        if not self._fixed_goals and not self.goals:
            return (
                "effector and goal have not been seen together for {:g} s; let the camera see "
                "both, or give a pixel as the goal".format(seconds)
            )
        seeing = self.seeing(now)
        missing = sorted((set(self.seen_by) | set(self._fixed_goals)) - set(seeing))
        silent = [camera for camera in missing if camera not in self._senders]
        if silent and self._fixed_goals:
            return "no camera {}, of which a pixel is the goal; those that send are {}".format(
                " and ".join(silent), " and ".join(sorted(self._senders)) or "none"
            )
        if seeing:
            return (
                "what {} sees is not enough to move {} joints; let {} see effector and goal".format(
                    " and ".join(seeing), joints, " and ".join(missing) or "another camera"
                )
            )
        return "{} has not been seen for {:g} s; look at what the tracker says of it".format(
            "the effector, or the goal, which moves," if self.goal_moves(now) else "the effector",
            seconds,
        )


class StandingFrames(object):
    """The frames of an arm while it stands.

    Args:
        since: frames that were taken before are left out, s.

    Attributes:
        seen: {camera: [(t, s, goal)]}, s and px, as the estimators take it.
        count: of the frames.
    """

    def __init__(self, since):
        # type: (float) -> None
        self._since = since
        self._received_at = {}  # type: Dict[str, float]  # camera: when a frame came last, s
        self.seen, self.count = {}, 0  # type: Dict[str, List[Tuple[float, Pixel, Pixel]]], int

    def add(self, frames, now):
        # type: (Iterable[MarkerFrame], float) -> None
        """Add MarkerFrames that came at the time `now`; no camera waits for one that is lost."""
        for frame in frames:
            self._received_at[frame.camera] = now
            if frame.t >= self._since:
                of_camera = self.seen.setdefault(frame.camera, [])
                of_camera.append((frame.t, frame.s, frame.goal))
                self.count += 1
        for camera in list(self.seen):
            if now - self._received_at[camera] > SIGHT_TIMEOUT:
                del self.seen[camera]
