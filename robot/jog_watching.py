"""Jogs each motor before a camera: looks while all stands, watches while something turns.

Nothing turns unseen: without a sighting of the tip, without the link, at a stop of the laptop and
at a signal the motor is stopped at once.
"""

from robot.motion import mounting
from robot.motion.jog_views import CLEAR, Jog, NotSeen, View, check_size, has_moved, place
from robot.motion.online_trajectory import STOP
from robot.servoing.linear_algebra import median
from robot.servoing.loss_of_sight import LossOfSight
from robot.servoing.measurement import MIN_SIGMA, robust_mean
from robot.servoing.repeated_pictures import RepeatedPictures
from robot.servoing.sightings import SIGHT_TIMEOUT, Sightings
from robot.tracker_address import Refusal
from shared.messages import EFFECTOR, GOAL, LEAST_CONFIDENCE, Stop
from shared.verdicts import MARKER_LOST

MYPY = False
if MYPY:
    from typing import Dict, List, Optional, Sequence, Tuple  # noqa: F401

    from robot.clock import Clock  # noqa: F401
    from robot.motion.arm import RobotArm  # noqa: F401
    from robot.motion.chains import Pose  # noqa: F401
    from robot.motion.control_loop import OnTick  # noqa: F401
    from robot.tracking import TrackingClient  # noqa: F401

    Pixel = Sequence[float]  # u, v

LOOK_FRAMES, LOOK_TIME, FIRST_LOOK_TIME = 10, 0.6, 3.4
"""Frames of a look, at least, and over how long, s; the first look shows whether all stands."""

LOOKS = 3
"""So often it is looked anew if something moves that nothing has turned."""

SETTLING_DELAY = 0.1
"""What is seen so long after a jog is seen of an arm that stands, s."""

POLL_TIMEOUT, POLL_PERIOD = 0.1, 0.05
"""For observations at rest; between two times of listening while something turns, s."""

SIGMAS, MEDIAN_SIGMA = 4.0, 1.25
"""By chance a place is off by so many standard deviations at most; that of a median, over that of
a mean."""

JITTER, DRIFT = 1.5, 2.5
"""Standard deviation of a place at rest, and way between the halves of a look, from which on the
picture is not to be measured by, px."""

PLACING = (
    "Lay the arm {straight} under the camera, which looks from above: the marker effector on its "
    "tip, goal to the left of the {joint}'s axle, a hand's width away."
)


class JogWatcher(object):
    """The looks of one check.

    Args:
        arm: robot.motion.arm.RobotArm.
        client: robot.tracking_client.TrackingClient.
        clock: has `now()` and `sleep(seconds)`.

    Attributes:
        camera: the name of the one that is looked through; "" before the first look.
    """

    def __init__(self, arm, client, clock):
        # type: (RobotArm, TrackingClient, Clock) -> None
        self._arm, self._client, self._clock = arm, client, clock
        joints = arm.description.joints
        self._sightings = Sightings({}, False, RepeatedPictures(joints))
        self._loss = LossOfSight(client, self._sightings, len(joints))
        self.camera = ""
        self._q = [motor.angle() for motor in arm.joints]
        self._seen_at = self._unlinked_at = self._heard_at = clock.now()
        self._missing = {}  # type: Dict[str, List[str]] # by camera: not in its last picture
        self._stopped = ""  # why the motor was stopped

    def jogs(self):
        # type: () -> List[Jog]
        """Jog every motor; a jog_views.Jog of each.

        Raises:
            NotSeen: it cannot go on; the message says why.
            Refusal: the tracker will not serve this brick.
            and what mounting.jog raises: with all motors stopped.
        """
        before = self._look(FIRST_LOOK_TIME)
        check_size(self._arm.description, before)
        jogs = []
        for k in range(len(self._arm.joints)):
            for angle in mounting.jog_angles(self._arm.description, k):
                jog = self._jog(k, angle, before)
                before = jog.back
                if has_moved(jog):
                    break
            jogs.append(jog)
        return jogs

    def _jog(self, k, angle, before):
        # type: (int, float, View) -> Jog
        motor, views, ends = self._arm.joints[k], [before], []

        def pause():
            # type: () -> None
            ends.append(motor.angle())
            self._q[k] = ends[-1]
            views.append(self._look(LOOK_TIME))

        mounting.jog(self._arm, k, angle, pause, self._watching(k))
        return Jog(views[0], views[1], views[2], ends[1] - ends[0])

    # Seeing

    def _look(self, seconds):
        # type: (float) -> View
        """The View of an arm that stands.

        Raises:
            NotSeen, Refusal
        """
        if self._stopped:
            raise NotSeen(self._stopped)
        self._seen_at = self._clock.now()
        for _ in range(LOOKS):
            view, unsteady = _view(self._frames(seconds))
            if view:
                return view
        raise NotSeen(
            unsteady + " though nothing turns; keep camera and table still, let nobody walk through"
            " the picture or touch the arm, then check again"
        )

    def _frames(self, seconds):
        # type: (float) -> List[Tuple[Pixel, Pixel]]
        """[(places of the tip, and of the marker beside the arm)], all of the one camera.

        Raises:
            NotSeen, Refusal
        """
        since = self._clock.now() + SETTLING_DELAY
        frames = {}  # type: Dict[str, List[Tuple[float, Pixel, Pixel]]]
        while True:
            for camera, t, tip, base in self._receive(POLL_TIMEOUT, False):
                if t >= since and base:
                    frames.setdefault(camera, []).append((t, tip, base))
            if self._stopped:
                raise NotSeen(self._stopped)
            for camera in sorted(frames):
                seen = frames[camera]
                if len(seen) >= LOOK_FRAMES and seen[-1][0] - seen[0][0] >= seconds:
                    self.camera = camera
                    return [(tip, base) for _, tip, base in seen]
            now = self._clock.now()
            if now - self._seen_at > SIGHT_TIMEOUT:
                end = self._loss.end(now, self._seen_at, self._unlinked_at)
                if end:
                    raise NotSeen(self._told(end.word, now))

    def _receive(self, timeout, moving):
        # type: (float, bool) -> List[Tuple[str, float, Pixel, Optional[Pixel]]]
        """[(camera, time, place of the tip, that of the marker beside the arm or None)]."""
        new = self._client.poll(timeout)
        now = self._heard_at = self._clock.now()
        if self._client.refused:
            raise Refusal(self._client.why)
        if not self._client.linked:
            self._unlinked_at = now
        for command in self._client.commands():
            if isinstance(command, Stop):
                self._stopped = "stopped by the laptop"
        self._sightings.history.add(now, self._q)
        seen = []  # type: List[Tuple[str, float, Pixel, Optional[Pixel]]]
        for camera in sorted(new):
            if self.camera in ("", camera):
                frame = self._sightings.frame(new[camera], now, moving)
                places = {}  # type: Dict[str, Pixel]
                for name in (EFFECTOR, GOAL):
                    marker = new[camera].markers.get(name)
                    if marker and marker[2] >= LEAST_CONFIDENCE:
                        places[name] = marker[:2]
                self._missing[camera] = [n for n in (EFFECTOR, GOAL) if n not in places]
                if frame and (GOAL in places or moving):
                    self._seen_at = now
                    seen.append((camera, new[camera].t, frame.s, places.get(GOAL)))
        return seen

    def _watching(self, k):
        # type: (int) -> OnTick
        """What is done in every control tick while the motor of joint `k` turns."""

        def on_tick(t, now, angles):
            # type: (float, float, Pose) -> object
            self._q[k] = angles[0]
            self._sightings.history.add(now, self._q)
            if now - self._heard_at >= POLL_PERIOD:
                self._receive(0.0, True)
            if not self._stopped and now - self._seen_at > SIGHT_TIMEOUT:
                port = self._arm.joints[k].port
                word = self._loss.word(now)
                self._stopped = "while the motor at port {} turned: {}".format(
                    port, self._told(word, now)
                )
            return STOP if self._stopped else None

        return on_tick

    def _told(self, word, now):
        # type: (str, float) -> str
        """Why it cannot be seen what moves, one line; `word` as LossOfSight has it."""
        if word != MARKER_LOST:
            return "{} ({})".format(word, self._loss.why(word, now))
        if not self._missing:
            return "linked, but the tracker sends no pictures; look at what it says"
        camera = self.camera or min(self._missing, key=lambda one: len(self._missing[one]))
        missing = self._missing[camera] or [EFFECTOR]
        return (
            "{} (camera {} does not see the marker{} {}: look at what the tracker says of it; the "
            "arm must not hide it, nor leave the picture)".format(
                word, camera, "s" if len(missing) > 1 else "", " and ".join(missing)
            )
        )


def _view(frames):
    # type: (Sequence[Tuple[Pixel, Pixel]]) -> Tuple[Optional[View], str]
    """(the View that frames of an arm at rest show, ""; or None, what moves in them for people)."""
    places, doubts = [], []
    for name, pixels in zip((EFFECTOR, GOAL), zip(*frames)):
        middle, sigma, kept = robust_mean(pixels)
        # Noise of which a part stays for a while is not to be averaged away.
        doubt = SIGMAS * MEDIAN_SIGMA * max(sigma, MIN_SIGMA) / min(kept, LOOK_FRAMES) ** 0.5
        half = len(pixels) // 2
        early, late = [
            place([median(column) for column in zip(*part)])
            for part in (pixels[:half], pixels[half:])
        ]
        drift = abs(late - early)
        if drift > min(CLEAR * doubt, DRIFT) or sigma > JITTER:
            return None, "the marker {} moves by {:.1f} px in the picture,".format(
                name, max(drift, sigma)
            )
        places.append(place(middle))
        doubts.append(doubt)
    return View(places[0], places[1], max(doubts)), ""
