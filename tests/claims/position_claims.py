"""What a tracker says of a position, with its confidence, beside the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

from laptop.see.markers.tracker import Sighting


@dataclass(frozen=True)
class Claim:
    """A position with its confidence, beside the truth.

    part        "renders" or "films"
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
    circle: tuple[float, float, float] | None,
    part: str,
    condition: str,
    clear: bool,
) -> Claim:
    """Compare a sighting with the circle (u, v, radius) that is truly there; None: no marker is."""
    confidence = found.confidence if found else 0.0
    if circle is None:
        return Claim(part, condition, confidence, math.inf if found else 0.0, 0.0, False)
    error = math.hypot(found.u - circle[0], found.v - circle[1]) if found else 0.0
    return Claim(part, condition, confidence, error, circle[2], clear)
