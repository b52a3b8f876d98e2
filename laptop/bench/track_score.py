"""Scores of a tracking method: frames found, lost and false, and the errors of those found."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from laptop.see.markers.markers import BadMarker
from laptop.see.markers.tracks import Sighting

Point = tuple[float, float]

CLAIM_CONFIDENCE = 0.5
"""Least confidence of a sighting that is a claim."""


@dataclass(frozen=True)
class Score:
    """Frames counted, and errors (px) summed, of one method under one condition.

    frames    all of them
    clear     with at least 90 % of the marker to be seen
    lost      clear, but nothing claimed
    false     claimed more than two radii off, or while all of the marker was hidden
    measured  clear and claimed, not false; the sums are over these
    squares   sum of du^2 + dv^2, px^2
    du, dv    sums of the errors, px
    """

    frames: int = 0
    clear: int = 0
    lost: int = 0
    false: int = 0
    measured: int = 0
    squares: float = 0.0
    du: float = 0.0
    dv: float = 0.0

    def __add__(self, other: Score) -> Score:
        return Score(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(Score)))

    @property
    def rms(self) -> float:
        """Root mean square error per axis, px."""
        return math.sqrt(self.squares / (2 * self.measured)) if self.measured else math.nan

    @property
    def bias(self) -> Point:
        """Mean error (u, v), px."""
        if not self.measured:
            return math.nan, math.nan
        return self.du / self.measured, self.dv / self.measured

    @property
    def lost_percent(self) -> float:
        """Share of the clear frames, percent."""
        return 100 * self.lost / self.clear if self.clear else math.nan

    @property
    def false_percent(self) -> float:
        """Share of all frames, percent."""
        return 100 * self.false / self.frames if self.frames else math.nan


def judge(
    found: Sighting | None,
    truth: Point,
    shown: float,
    radius: float,
    least: float = CLAIM_CONFIDENCE,
) -> Score:
    """Score one frame.

    Args:
        found: the method's answer.
        truth: centre of the marker, px.
        shown: visible part of the marker, 0 to 1.
        radius: of the marker, px.
        least: least confidence of a claim.
    """
    clear = shown >= 0.9
    if found is None or found.confidence < least:
        return Score(1, int(clear), int(clear))
    du, dv = found.u - truth[0], found.v - truth[1]
    false = shown < 0.005 or math.hypot(du, dv) > 2 * radius
    if false or not clear:
        return Score(1, int(clear), 0, int(false))
    return Score(1, 1, 0, 0, 1, du * du + dv * dv, du, dv)


@dataclass(frozen=True)
class TrackResult:
    """One method under one condition; `error` is the reason why a marker was not learned."""

    part: str
    condition: str
    marker: str
    method: str
    score: Score = Score()
    error: str = ""


def unlearned(
    part: str, condition: str, marker: str, method: str, frames: int, problem: BadMarker
) -> TrackResult:
    """Return the result of a marker that cannot be learned: lost in all frames."""
    score = Score(frames, frames, frames)
    return TrackResult(part, condition, marker, method, score, str(problem))


SURE_CONFIDENCE = 0.9
"""Least confidence of a position that is good for measuring."""
