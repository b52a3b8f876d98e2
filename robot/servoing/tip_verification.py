"""Verification that what is taken for the tip is the tip, before success is reported.  Pure.

Something else of its colour may lie at the goal.  Then the tip seems to get there by a jump: to
where the models did not have it, or, seen in motion, away from its own track.  To turn the joints
decides: the tip follows them.
"""

import math

from robot.servoing.linear_algebra import distance

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import List, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.image_model import Features, Pose  # noqa: F401
    from robot.servoing.linear_algebra import Matrix  # noqa: F401
    from robot.servoing.measurement import Measurement  # noqa: F401
    from robot.servoing.servo import LastMeasurement  # noqa: F401
    from robot.servoing.sightings import MarkerFrame  # noqa: F401

    TrackFrame = Tuple[
        float, Pose, Features
    ]  # when it was taken, s; where the joints were; the tip

SURPRISE_TOLERANCES, MIN_SURPRISE = 1.5, 6.0
"""Distance from where all models had the tip at last that is a surprise, tolerances, and at least
px."""

MIN_JUMP, JUMP_SHARE = 20.0, 0.5
"""Least distance of a jump from the track, px, beside this share of the track's own length
meanwhile."""

MAX_LEAP = 2.0
"""Length of a jump as a multiple of what all joints do by the Jacobian of the chase's beginning,
which it must exceed, too; where there is a track, half of it."""

MAX_STILL_DISTANCE, MIN_STILL_TURN = 5.0, math.radians(6)
"""Range within which a place stays, px, and turn of a joint meanwhile beyond which it may be no
tip, rad."""

CONFIRMING_FRAMES, TRACK_FRAMES, STANDING_FRAMES = 3, 4, 3
"""Number of frames in a row, near each other, that confirm a jump; number of frames of a track;
number of frames for which a measurement at rest counts."""

DOES_NOT_MOVE = (
    "the marker does not move when the joints do: it is not on the tip, or what the motors turn is "
    "loose, its play far beyond backlash in the arm's file; driver.py check tells"
)
"""Reason of a run that ends since what is taken for the tip follows no joint."""


def has_jumped(frames, size):
    # type: (Sequence[TrackFrame], float) -> bool
    """Return whether the tip has left its track for good.

    Args:
        frames: [(t, q, s)], s, rad and px, in order of time, of one camera; the first one is of
            the arm as it stood, and right.
        size: of the image Jacobian, px/rad.
    """
    track, away = [frames[0]], []  # type: List[TrackFrame], List[TrackFrame]
    for frame in frames[1:]:
        if not _leaves(track, frame, size):
            track.append(frame)
            del track[:-TRACK_FRAMES]
            away = []
            continue
        if away and _pixel_distance(frame[2], away[-1][2]) > MIN_JUMP:
            away = []  # now here, now elsewhere: false sightings
        away.append(frame)
        if len(away) >= CONFIRMING_FRAMES:
            return True
    return False


def has_stayed(frames):
    # type: (Sequence[TrackFrame]) -> bool
    """Return whether the supposed tip has stood at its end while the joints still turned.

    Args:
        frames: as for `has_jumped`.
    """
    _, q, end = frames[-1]
    turned = 0.0
    for _, at, s in reversed(frames):
        if _pixel_distance(s, end) > MAX_STILL_DISTANCE:
            break
        turned = max(turned, distance(at, q))
    return turned > MIN_STILL_TURN


def _pixel_distance(a, b):
    # type: (Features, Features) -> float
    """Return the distance of two places in the image, px."""
    return math.hypot(a[0] - b[0], a[1] - b[1])


def _leaves(track, frame, size):
    # type: (Sequence[TrackFrame], TrackFrame, float) -> bool
    """Return whether a frame cannot be the next one of a track."""
    t, q, s = frame
    last_t, last_q, last_s = track[-1]
    excess, reach = _pixel_distance(s, last_s) - MIN_JUMP, size * distance(q, last_q)
    if len(track) < TRACK_FRAMES:
        return excess > MAX_LEAP * reach
    if excess <= 0.5 * MAX_LEAP * reach:
        return False
    first_t, _, first_s = track[0]
    share = (t - last_t) / max(last_t - first_t, 1e-3)
    expected = [share * (b - a) for a, b in zip(first_s, last_s)]
    deviation = _pixel_distance(s, [a + b for a, b in zip(last_s, expected)])
    return deviation > MIN_JUMP + JUMP_SHARE * math.hypot(*expected)


class TipVerification(object):
    """Verification of the tip, before a servo reports that it is at the goal.

    Args:
        tolerance: px.

    Attributes:
        missed: by how much all models missed the last measurement, px.
        begun: whether the joints have been turned, and no answer is seen yet.
    """

    def __init__(self, tolerance):
        # type: (float) -> None
        self.missed = 0.0
        self.begun = self._answered = False
        self._limit = max(SURPRISE_TOLERANCES * tolerance, MIN_SURPRISE)

    def begin(self):
        # type: () -> bool
        """Begin to turn the joints; return whether that is the first time."""
        first, self.begun = not self.begun, True
        return first

    def record_elsewhere(self):
        # type: () -> None
        """Record that the supposed tip is not at the goal."""
        self._answered = self._answered or self.begun
        self.begun = False

    def is_needed(
        self,
        measurements,  # type: Sequence[Measurement]
        chase,  # type: Sequence[MarkerFrame]
        by_model,  # type: bool
        before,  # type: LastMeasurement
        J,  # type: Optional[Matrix]
    ):
        # type: (...) -> bool
        """Return whether to verify that what is at the goal is the tip, or to go on with that.

        Args:
            measurements: one for each camera.
            chase: MarkerFrames of the chase that led here; none if the joints went to a pose.
            by_model: whether a model led here.  Exploring is verified once, then believed.
            before: (q, {camera: s}) of the last measurement, rad and px.
            J: by which the last move was made, px/rad, its rows at one pose of it or at several;
                None if by none.
        """
        if self.begun:
            return True
        if not by_model:
            return not self._answered
        if self.missed <= self._limit:
            return False
        if (
            J is None or not chase
        ):  # what was learned in a chase may know better than what was known before it
            return True
        size = math.sqrt(sum(x * x for row in J for x in row))
        q, seen = before
        still = []
        for measurement in measurements:
            camera = measurement.camera
            frames = [  # type: List[TrackFrame]
                (frame.t, frame.q, frame.s)
                for frame in chase
                if frame.camera == camera and frame.q is not None
            ]
            if frames and camera in seen:
                t, here, _ = frames[-1]
                frames.insert(0, (frames[0][0], q, seen[camera]))
                for k in range(1, 1 + STANDING_FRAMES):
                    frames.append((t + 0.03 * k, here, measurement.s))
                if has_jumped(frames, size):
                    return True
                still.append(has_stayed(frames))  # along the line of sight of one, any tip does
        return bool(still) and all(still)
