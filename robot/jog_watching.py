"""Jogs of each motor before a camera, measured at rest and watched in motion.

Nothing turns unseen: without a sighting of the tip, without the link, at a stop of the laptop and
at a signal the motor is stopped at once.

A marker's place at rest is a robust mean over a view's frames. Its accuracy is not just
sigma / sqrt(n): errors of neighbouring frames may be correlated (light, compression), so n counts
for VIEW_FRAMES at most. That the arm stands is tested by the medians of the first and second half
of the frames: they must agree to what noise explains.
"""

from robot.motion import mounting
from robot.motion.jog_views import (
    MIN_SIGNAL_TO_NOISE,
    Jog,
    NotSeen,
    View,
    check_size,
    has_moved,
    place,
)
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

VIEW_FRAMES, VIEW_TIME, FIRST_VIEW_TIME = 10, 0.6, 3.4
"""Least number of frames of a view, and least time over which they are taken, s; the first view
shows whether all stands."""

MAX_VIEWS = 3
"""Greatest number of views where something moves that nothing has turned."""

SETTLING_DELAY = 0.1
"""Time after a jog from which the arm stands, s."""

POLL_TIMEOUT, POLL_PERIOD = 0.1, 0.05
"""Longest wait for observations at rest, s; and period of polling while something turns, s."""

MAX_SIGMAS, MEDIAN_SIGMA = 4.0, 1.25
"""Greatest deviation by chance of a place, standard deviations; and the standard deviation of a
median over that of a mean, which is sqrt(pi / 2) for normal errors."""

MAX_JITTER, MAX_DRIFT = 1.5, 2.5
"""Greatest standard deviation of a place at rest, and greatest distance between the halves of a
view, of pictures that can be measured by, px."""

PLACING_ADVICE = (
    "Lay the arm {straight} under the camera, which looks from above: the marker effector on its "
    "tip, goal to the left of the {joint}'s axle, a hand's width away."
)
"""Text for people on where arm and markers are to be."""


class JogWatcher(object):
    """The views and jogs of one check by camera.

    Args:
        arm: robot.motion.arm.RobotArm.
        client: robot.tracking_client.TrackingClient.
        clock: has `now()` and `sleep(seconds)`.

    Attributes:
        camera: name of the one that is used; "" before the first view.
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
        self._stopped = ""  # the reason for which the motor was stopped

    def jogs(self):
        # type: () -> List[Jog]
        """Jog every motor; return a jog_views.Jog of each.

        Raises:
            NotSeen: it cannot go on; the message says why.
            Refusal: the tracker will not serve this brick.
            and what mounting.jog raises: with all motors stopped.
        """
        before = self._view_at_rest(FIRST_VIEW_TIME)
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
            views.append(self._view_at_rest(VIEW_TIME))

        mounting.jog(self._arm, k, angle, pause, self._watching(k))
        return Jog(views[0], views[1], views[2], ends[1] - ends[0])

    # Seeing

    def _view_at_rest(self, seconds):
        # type: (float) -> View
        """Return the View of an arm that stands, of frames over at least so many seconds.

        Raises:
            NotSeen: something moves, or is not seen.
            Refusal: the tracker will not serve this brick.
        """
        if self._stopped:
            raise NotSeen(self._stopped)
        self._seen_at = self._clock.now()
        for _ in range(MAX_VIEWS):
            view, unsteady = _view(self._frames(seconds))
            if view:
                return view
        raise NotSeen(
            unsteady + " though nothing turns; keep camera and table still, let nobody walk through"
            " the picture or touch the arm, then check again"
        )

    def _frames(self, seconds):
        # type: (float) -> List[Tuple[Pixel, Pixel]]
        """Return [(tip, marker beside the arm)], places (u, v) in px, all of one camera.

        Raises:
            NotSeen: a marker, or the link, is lost.
            Refusal: the tracker will not serve this brick.
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
                if len(seen) >= VIEW_FRAMES and seen[-1][0] - seen[0][0] >= seconds:
                    self.camera = camera
                    return [(tip, base) for _, tip, base in seen]
            now = self._clock.now()
            if now - self._seen_at > SIGHT_TIMEOUT:
                end = self._loss.end(now, self._seen_at, self._unlinked_at)
                if end:
                    raise NotSeen(self._reason(end.word, now))

    def _receive(self, timeout, moving):
        # type: (float, bool) -> List[Tuple[str, float, Pixel, Optional[Pixel]]]
        """Return [(camera, time in s, tip in px, marker beside the arm in px or None)]."""
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
        """Return a function for every control tick while the motor of joint `k` turns."""

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
                    port, self._reason(word, now)
                )
            return STOP if self._stopped else None

        return on_tick

    def _reason(self, word, now):
        # type: (str, float) -> str
        """Return why what moves cannot be seen, one line; `word` as LossOfSight has it."""
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
    """Return (View of an arm at rest, ""), or (None, what moves, for people), of frames."""
    places, uncertainties = [], []
    for name, pixels in zip((EFFECTOR, GOAL), zip(*frames)):
        middle, sigma, inliers = robust_mean(pixels)
        # Noise of which a part stays for a while is not to be averaged away.
        uncertainty = (
            MAX_SIGMAS * MEDIAN_SIGMA * max(sigma, MIN_SIGMA) / min(inliers, VIEW_FRAMES) ** 0.5
        )
        half = len(pixels) // 2
        early, late = [
            place([median(column) for column in zip(*part)])
            for part in (pixels[:half], pixels[half:])
        ]
        drift = abs(late - early)
        if drift > min(MIN_SIGNAL_TO_NOISE * uncertainty, MAX_DRIFT) or sigma > MAX_JITTER:
            return None, "the marker {} moves by {:.1f} px in the picture,".format(
                name, max(drift, sigma)
            )
        places.append(place(middle))
        uncertainties.append(uncertainty)
    return View(places[0], places[1], max(uncertainties)), ""
