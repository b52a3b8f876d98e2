"""LEGO's measures: holes for a link, wheels for a gear, and what is in which set.  Pure.

The counts are those that Brickset and Rebrickable list for the sets 45544 (education) and 31313
(home); a wheel of n teeth has a pitch radius of n / 2 mm, and holes are 8 mm apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

PITCH = 8.0
"""Distance of neighbouring holes, mm."""
SETS = ("45544", "31313")


@dataclass(frozen=True)
class Part:
    """A kind of part, and how many are in the sets, in the order of SETS."""

    name: str
    counts: tuple[int, int]


BEAMS = {
    15: (6, 4), 13: (6, 4), 11: (4, 4), 9: (6, 8), 7: (4, 6), 5: (4, 10), 3: (18, 12),
}  # fmt: skip
"""Straight beams by their holes."""
WHEELS = {8: (4, 0), 12: (2, 2), 16: (4, 0), 20: (2, 4), 24: (4, 2), 36: (2, 5), 40: (2, 0)}
"""Gear wheels by their teeth; those with 12, 20 and 36 are double bevel gears."""
LARGE, MEDIUM = Part("large motor", (2, 2)), Part("medium motor", (1, 1))
OTHERS = (
    Part("EV3 brick", (1, 1)),
    Part("cable 25 cm", (4, 4)),
    Part("cable 35 cm", (2, 2)),
    Part("cable 50 cm", (1, 1)),
    Part("pin with friction, 2 holes", (60, 95)),
    Part("pin with friction, 3 holes", (30, 38)),
    Part("frame 5 x 7", (3, 2)),
    Part("angle beam 3 x 5", (6, 6)),
)
"""Parts beside beams and wheels that the guide names."""


@dataclass(frozen=True)
class BeamLink:
    """A link made of beams.

    length  as the arm's file has it, mm
    pitches from axis to axis
    beam    holes of the beam to take; None: no beam is as long
    """

    length: float
    pitches: int
    beam: int | None

    @property
    def built(self) -> float:
        """Its length as it is built, mm."""
        return self.pitches * PITCH

    @property
    def holes(self) -> int:
        """Holes from axis to axis, both included."""
        return self.pitches + 1


def link_of(length: float) -> BeamLink:
    """Return the link whose holes come nearest to a length, cm."""
    pitches = max(1, round(10 * length / PITCH))
    longer = sorted(beam for beam in BEAMS if beam > pitches)
    return BeamLink(10 * length, pitches, longer[0] if longer else None)


@dataclass(frozen=True)
class GearPair:
    """Two wheels: the joint's and the motor's, by their teeth."""

    wheel: int
    pinion: int

    @property
    def distance(self) -> float:
        """From axis to axis, mm."""
        return (self.wheel + self.pinion) / 2

    @property
    def fits(self) -> bool:
        """True if their axes are whole holes apart."""
        return self.distance % PITCH == 0

    def sets(self, joints: int = 1) -> list[str]:
        """Return the sets that have the wheels for so many joints."""
        return [
            name
            for k, name in enumerate(SETS)
            if min(WHEELS[self.wheel][k], WHEELS[self.pinion][k]) >= joints
        ]


def gear_pairs(ratio: float) -> list[GearPair]:
    """Return the pairs of wheels that make a ratio within 1 %, those that fit first."""
    pairs = [
        GearPair(wheel, pinion)
        for wheel in WHEELS
        for pinion in WHEELS
        if wheel != pinion and abs(wheel / pinion - ratio) <= 0.01 * ratio
    ]
    return sorted(pairs, key=lambda pair: (not pair.fits, pair.wheel))


def enough(wanted: int, counts: Sequence[int]) -> list[str]:
    """Return the sets that have as many."""
    return [name for name, count in zip(SETS, counts, strict=True) if count >= wanted]
