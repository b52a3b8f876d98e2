"""One marker from frame to frame: its last sighting, speed and colour, and where it should be next.

Pure.  Pixel centres lie at integer coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from laptop.see.markers.discriminant import DiscriminantModel
from laptop.see.markers.markers import Color, Marker

Window = tuple[float, float, float, float]
"""Left, top, right, bottom, px."""
Place = tuple[float, float, float]
"""A place and size that a marker may have: u, v, radius, px."""
Gains = tuple[float, float, float]
"""Factors of red, green, blue by which the light differs from that of learning."""

MISSES_TO_FORGET = 3
"""Number of consecutive frames without the marker after which its size, speed and colour are
forgotten."""
MAX_PREDICTION_TIME = 0.2
"""Longest time over which a speed is extrapolated, s."""
MAX_SURPRISE_SPEED = 10.0
"""Greatest sudden speed of a marker, radii/s."""
MIN_SIZE_RATIO = 0.65
"""Least ratio of two radii of one marker, before and after it was hidden."""
MAX_REACH_TIME = 2.0
"""Longest time for which an unseen marker may have gone on as fast as before, s."""
SPEED_MEMORY = 0.97
"""Share of the greatest speed that is remembered from frame to frame."""
CONFIRM_FRAMES, CONFIRM_TIME = 3, 0.15
"""Number of consecutive frames, and time (s), for which something is seen at another place before
it is taken for the marker."""
MAX_CONFIRM_FRAMES = 10
"""Number of consecutive frames that suffice, though the clock stands."""
KNOWN_OTHER_TIME = 10.0
"""Time after which something seen beside the marker is taken for it all the same, s."""
VELOCITY_BLEND = 0.5
"""Share of the newest speed in the filtered one."""


class Sighting(NamedTuple):
    """The place of a marker: u, v (px, sub-pixel), confidence (0 to 1), radius (px)."""

    u: float
    v: float
    confidence: float
    radius: float


class Suspect(NamedTuple):
    """A detection that may be the marker, but is where that cannot be.

    u, v, radius  where it is, px
    since, t      when it was seen there for the first and for the last time, s
    frames        in which it was, one after the other
    """

    u: float
    v: float
    radius: float
    since: float
    t: float
    frames: int

    def is_sure(self, known: bool) -> bool:
        """Return whether it has been there long enough to be taken for the marker.

        Args:
            known: it was there while the marker was seen elsewhere.
        """
        time = self.t - self.since
        if known:
            return time >= KNOWN_OTHER_TIME
        return self.frames >= CONFIRM_FRAMES and (
            time >= CONFIRM_TIME or self.frames >= MAX_CONFIRM_FRAMES
        )


@dataclass(frozen=True)
class Track:
    """All that is known of one marker after a frame.

    sighting         in that frame; None: not seen
    why              it is not seen; ""
    seen             the last sighting, for the window and the size only; None when forgotten
    t                of that sighting, s
    du, dv           px/s, for the window only
    score            of the sighting: its confidence, and where that is 1, how good the shape is
    misses           frames since
    color            its colour under the present light
    gains            of the present light; None: as it was when the colour was learned
    discriminant     computes a disc's share in a pixel; None until an unoccluded disc is seen
    last_unoccluded  when a disc was last seen unoccluded, s
    ellipse_quality  how well its outline followed an ellipse when it was found, 0 to 1
    last_sure        the last sighting that was surely it, at last_sure_t (s); never forgotten
    speed            the greatest one of late, px/s; kept, too
    picture          the frame of that sighting, BGR; None once others were looked for in it
    others           places of the same colour at that time, elsewhere: they are not it
    suspect          what may be it, but is not where it can be; None: nothing
    """

    sighting: Sighting | None = None
    why: str = ""
    seen: Sighting | None = None
    t: float = 0.0
    du: float = 0.0
    dv: float = 0.0
    score: float = 0.0
    misses: int = 0
    color: Color | None = None
    gains: Gains | None = None
    discriminant: DiscriminantModel | None = None
    last_unoccluded: float = -math.inf
    ellipse_quality: float = 1.0
    last_sure: Sighting | None = None
    last_sure_t: float = 0.0
    speed: float = 0.0
    picture: np.ndarray | None = field(default=None, repr=False, compare=False)
    others: tuple[Place, ...] = ()
    suspect: Suspect | None = None

    def predict(self, t: float) -> Place | None:
        """Return the place of the marker expected at time t (s); None when it is forgotten."""
        seen = self.seen
        if seen is None:
            return None
        dt = min(t - self.t, MAX_PREDICTION_TIME)
        return seen.u + self.du * dt, seen.v + self.dv * dt, seen.radius

    def known_radii(self, marker: Marker) -> tuple[float, ...]:
        """Return the radii when the marker was picked, and when last surely seen, px."""
        last_sure = self.last_sure.radius if self.last_sure else None
        return tuple(radius for radius in (marker.radius, last_sure) if radius)

    def window(self, t: float) -> Window | None:
        """Return the window in which to look first at time t (s); None: everywhere."""
        place = self.predict(t)
        if place is None:
            return None
        u, v, radius = place
        half = half_window(radius)
        return u - half, v - half, u + half, v + half

    def update(self, measured: Track, t: float) -> Track:
        """Return the track after a measurement at time t (s); a second one gives a speed."""
        new = measured.seen
        assert new is not None
        last_unoccluded = self.last_unoccluded if math.isinf(measured.last_unoccluded) else t
        du, dv = measured.du, measured.dv
        dt = t - self.t
        if self.seen is not None and not self.misses and dt > 0:
            # An alpha-beta filter whose position is the measurement.
            old = 1 - VELOCITY_BLEND
            du = old * self.du + VELOCITY_BLEND * (new.u - self.seen.u) / dt
            dv = old * self.dv + VELOCITY_BLEND * (new.v - self.seen.v) / dt
        return replace(
            measured, t=t, du=du, dv=dv, misses=0, last_unoccluded=last_unoccluded,
            last_sure=self.last_sure, last_sure_t=self.last_sure_t, speed=self.speed,
            picture=self.picture, others=self.others,
        )  # fmt: skip

    def miss(self, color: Color | None, why: str) -> Track:
        """Return the track after a frame without the marker.

        Args:
            color: as it was learned: all that is left once the rest is forgotten.
            why: it was not seen.
        """
        misses = self.misses + 1
        track = self if misses < MISSES_TO_FORGET else self.forgotten(color)
        return replace(track, sighting=None, misses=misses, why=why)

    def forgotten(self, color: Color | None) -> Track:
        """Return the track without what changes from frame to frame, but with where it was.

        Args:
            color: as it was learned.
        """
        return Track(
            color=color, last_sure=self.last_sure, last_sure_t=self.last_sure_t, speed=self.speed,
            picture=self.picture, others=self.others, suspect=self.suspect,
        )  # fmt: skip

    def fits(self, seen: Sighting, t: float) -> bool:
        """Return whether the marker can have come there by time t (s), and may be as large."""
        last_sure = self.last_sure
        if last_sure is None:
            return True
        if min(last_sure.radius / seen.radius, seen.radius / last_sure.radius) < MIN_SIZE_RATIO:
            return False
        dt = max(t - self.last_sure_t, 0.0)
        reach = half_window(last_sure.radius) + self.speed * min(dt, MAX_REACH_TIME)
        reach += MAX_SURPRISE_SPEED * last_sure.radius * min(dt, MAX_PREDICTION_TIME)
        return math.hypot(seen.u - last_sure.u, seen.v - last_sure.v) < reach


def half_window(radius: float) -> float:
    """Return half the side of the window for a marker of this radius, px."""
    return 2.2 * radius + 6
