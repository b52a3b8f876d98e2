"""What a tracker says of a position, with its confidence, beside the truth."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.tracks import Sighting

Circle = tuple[float, float, float]
"""Where a marker truly is: u, v, radius, px."""


@dataclass(frozen=True)
class Claim:
    """A position with its confidence, beside the truth.

    part        "renders" or "rays"
    condition   what was done to the marker
    confidence  0: nothing was found
    error       px; infinite if there was no marker at all
    radius      of the marker, px
    clear       it was sharp and in full view
    """

    part: str
    condition: str
    confidence: float
    error: float
    radius: float
    clear: bool

    @property
    def is_off(self) -> bool:
        """True if it is farther off than a tenth of the radius and 1 px."""
        return self.confidence > 0 and self.error > 0.1 * self.radius + 1

    @property
    def is_wrong(self) -> bool:
        """True if it is farther off than half a radius."""
        return self.confidence > 0 and self.error > 0.5 * self.radius


def claim(
    found: Sighting | None,
    circle: Circle | None,
    part: str,
    condition: str,
    clear: bool,
) -> Claim:
    """Compare a sighting with the circle that is truly there; None: no marker is."""
    confidence = found.confidence if found else 0.0
    if circle is None:
        return Claim(part, condition, confidence, math.inf if found else 0.0, 0.0, False)
    error = math.hypot(found.u - circle[0], found.v - circle[1]) if found else 0.0
    return Claim(part, condition, confidence, error, circle[2], clear)


class Shot(NamedTuple):
    """A picture (BGR, uint8) and the marker in it, if any.

    t          s
    condition  what was done to the marker
    clear      it is sharp and in full view
    """

    image: np.ndarray
    circle: Circle | None
    t: float
    condition: str
    clear: bool


def claims_of(clip: Iterable[Shot], kind: str, part: str) -> list[Claim]:
    """What the tracker says of every picture but the first, in which it learns the marker.

    Nothing if it cannot, as orange on orange wood.
    """
    claims: list[Claim] = []
    tracker: Tracker | None = None
    for shot in clip:
        if tracker is None:
            assert shot.circle
            where = round(shot.circle[0]), round(shot.circle[1])
            try:
                tracker = Tracker([learn("marker", shot.image, where, kind)])
            except BadMarker:
                return []
            continue
        found = tracker.find(shot.image, shot.t)["marker"]
        claims.append(claim(found, shot.circle, part, shot.condition, shot.clear))
    return claims
