"""Loss of sight: why the arm is held when too little is seen, and when that has lasted too long."""

import math

from robot.servoing.sightings import SIGHT_TIMEOUT
from shared.record import record
from shared.verdicts import (
    CAMERA_LATE,
    CAMERA_SLOW,
    LINK_LOST,
    MARKER_LOST,
    PICTURE_FROZEN,
    REFUSED,
)

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Mapping, NamedTuple, Optional, Protocol, Sequence  # noqa: F401

    from robot.servoing.linear_algebra import Vector  # noqa: F401
    from robot.servoing.sightings import Sightings  # noqa: F401
    from shared.messages import Observation  # noqa: F401

    class SightsClient(Protocol):
        """A client of the tracker: TrackingClient, or what looks like one."""

        @property
        def linked(self):
            # type: () -> bool
            """Whether observations can come in."""

        @property
        def refused(self):
            # type: () -> bool
            """Whether it has given up."""

        @property
        def why(self):
            # type: () -> str
            """Reason why there is no link."""

        @property
        def late(self):
            # type: () -> Mapping[str, float]
            """Cameras that come too late, and how late, s."""

        def poll(self, timeout):
            # type: (float) -> Mapping[str, Observation]
            """Return the new Observations by camera, waiting for `timeout` s at most."""

        def commands(self):
            # type: () -> Sequence[object]
            """Return the messages that order something."""

        def report(
            self,
            q,  # type: Vector
            error,  # type: Optional[float]
            verdict="",  # type: str
            reason="",  # type: str
            e=None,  # type: Optional[Mapping[str, float]]
            condition=None,  # type: Optional[float]
            moves=0,  # type: int
            run=1,  # type: int
        ):
            # type: (...) -> None
            """Report to the laptop how it goes."""


SIGHT_PATIENCE, LINK_PATIENCE = 10.0, 20.0
"""Longest loss of sight, and of the link, before the run is given up, s."""

MIN_PICTURE_RATE = math.ceil(2 / SIGHT_TIMEOUT)
"""Pictures a second at which one may be lost."""

if MYPY:
    Halt = NamedTuple("Halt", [("word", str), ("reason", str)])
else:
    Halt = record("Halt", "word reason")
Halt.__doc__ = "Reason why a motion or a run is over: a verdict's word and its text."

RECOVERY_TEXTS = {LINK_LOST: "linked", PICTURE_FROZEN: "the picture changes"}
"""Texts of a recovery, by the verdict's word of the loss; "seen" of all others."""


class LossOfSight(object):
    """Classifier of the causes of a loss of sight.

    Args:
        client: as for VisualServoing.
        sightings: Sightings of the run.
        joints: how many.
    """

    def __init__(self, client, sightings, joints):
        # type: (SightsClient, Sightings, int) -> None
        self._client, self._sightings, self._joints = client, sightings, joints

    def word(self, now):
        # type: (float) -> str
        """Return the verdict's word that this comes to if it stays."""
        if not self._client.linked:
            return LINK_LOST
        if self._sightings.pictures.frozen:
            return PICTURE_FROZEN
        if self._client.late:
            return CAMERA_LATE
        return CAMERA_SLOW if self._sightings.rates.slow(now) else MARKER_LOST

    def word_of(self, camera):
        # type: (str) -> str
        """Return the same of one camera, while the others go on."""
        return PICTURE_FROZEN if camera in self._sightings.pictures.frozen else MARKER_LOST

    def recovery_text(self, word):
        # type: (str) -> str
        """Return the text of the recovery from a loss, by its word."""
        return RECOVERY_TEXTS.get(word, "seen")

    def end(self, now, seen_at, unlinked_at):
        # type: (float, float, float) -> Optional[Halt]
        """Return the Halt if it has lasted too long, or will; None otherwise.

        Args:
            now: s.
            seen_at: when enough was last seen, s.
            unlinked_at: when the client was last found without a link, s.
        """
        word = self.word(now)
        if word == LINK_LOST:
            patient = now - seen_at <= LINK_PATIENCE
        else:  # a slow camera has been timed for long enough
            patient = word != CAMERA_SLOW and now - max(seen_at, unlinked_at) <= SIGHT_PATIENCE
        return None if patient else Halt(word, self.why(word, now))

    def why(self, word, now):
        # type: (str, float) -> str
        """Return the reason that belongs to a verdict's word."""
        if word == LINK_LOST:
            return self._client.why
        if word == CAMERA_SLOW:
            return self._why_slow(now)
        if word == PICTURE_FROZEN:
            return self._why_frozen()
        if word == CAMERA_LATE:
            return self._why_late()
        return self._sightings.what_is_missing(now, self._joints, SIGHT_PATIENCE)

    def refusal(self):
        # type: () -> Optional[Halt]
        """Return the Halt if nothing may begin, since a camera has no goal; None otherwise."""
        cameras = self._sightings.without_goal
        if not cameras:
            return None
        return Halt(
            REFUSED,
            "camera {0} watches, too, and no goal is given in its picture; give a pixel of each "
            "camera, such as --goal A:400,200 --goal {1}:300,150, or do without camera {0}".format(
                " and ".join(cameras), cameras[0]
            ),
        )

    def too_few(self, rate):
        # type: (float) -> str
        """Return what is added to a reason if the rate of pictures with the marker, 1/s, is low."""
        if rate >= 2 / SIGHT_TIMEOUT:
            return ""
        return "; {:.1f} pictures a second with the marker in them, {:g} are needed".format(
            rate, MIN_PICTURE_RATE
        )

    def _why_frozen(self):
        # type: () -> str
        """Return the reason of pictures that repeat."""
        pictures = self._sightings.pictures
        cameras = sorted(pictures.frozen)
        turn = max([pictures.turn(camera) for camera in cameras])
        return (
            "the picture of camera {} does not change, though a joint has turned by {:.0f} deg; "
            "start the camera anew, and check that the marker is on the arm".format(
                " and ".join(cameras), math.degrees(turn)
            )
        )

    def _why_late(self):
        # type: () -> str
        """Return the reason of pictures that come late."""
        return "; ".join(
            [
                "the pictures of camera {} come {:.1f} s late, and at most 1 s is allowed; end "
                "what keeps the laptop busy, or take a smaller picture".format(camera, late)
                for camera, late in sorted(self._client.late.items())
            ]
        )

    def _why_slow(self, now):
        # type: (float) -> str
        """Return the reason of pictures that are too few."""
        camera, (came, given) = min(self._sightings.rates.slow(now).items())
        if given < MIN_PICTURE_RATE:
            return (
                "camera {} gives only {:.0f} pictures a second; {} are needed: give it more light, "
                "or a smaller picture".format(camera, given, MIN_PICTURE_RATE)
            )
        return (
            "of the {:.0f} pictures a second of camera {} only {:.0f} come here; {} are needed: "
            "end other programs on the laptop, or use a cable".format(
                given, camera, came, MIN_PICTURE_RATE
            )
        )
