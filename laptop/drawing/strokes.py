"""Strokes on the table, cut where the arm cannot follow.  Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from laptop.drawing import reach
from laptop.drawing.artwork import stroke_length
from robot.motion import kinematics
from shared.arm_description import Arm

CUT_PRECISION = 0.005
"""Precision with which a line is cut at the end of the reach, cm."""

MIN_PART = 0.05
"""Least length of a part of a cut line, cm; shorter ones are left out, too."""

MAX_NAMED = 3
"""Number of unreachable strokes that are named one by one."""


@dataclass(frozen=True, eq=False)
class PlacedStroke:
    """From pen down to pen up, on the table.

    points    (n, 2), cm, in the arm's coordinates
    layer     name of its layer
    number    of the artwork's stroke that it is, or a part of, from 1 on
    postures  in which it can be drawn whole, the preferred one first
    """

    points: np.ndarray
    layer: str
    number: int
    postures: tuple[str, ...]

    def turned_round(self) -> PlacedStroke:
        """Return the stroke drawn from its end."""
        return replace(self, points=self.points[::-1])


@dataclass(frozen=True, eq=False)
class Missed:
    """A part of a stroke that cannot be reached.

    points  (n, 2), cm
    number  of the artwork's stroke, from 1 on
    layer   its layer
    reason  why its first point cannot be had
    """

    points: np.ndarray
    number: int
    layer: str
    reason: str


@dataclass(frozen=True, eq=False)
class CutStrokes:
    """Reachable parts of strokes, unreachable ones, and the numbers of strokes drawn in parts."""

    strokes: tuple[PlacedStroke, ...]
    missed: tuple[Missed, ...]
    in_parts: tuple[int, ...]


def cut(
    arm: Arm,
    strokes: tuple[np.ndarray, ...],
    layers: tuple[str, ...],
    height: float,
    postures: tuple[str, ...],
) -> CutStrokes:
    """Cut strokes (n, 2), cm, into parts that can be drawn in one posture each.

    A stroke that needs two postures is cut where both have it, so that nothing of it is missing.
    """
    reached = reach.try_strokes(arm, strokes, height, postures)
    bounds = np.searchsorted(reached.stroke, np.arange(len(strokes) + 1))
    runs = {posture: reached.runs(posture) for posture in postures}
    found: list[PlacedStroke] = []
    missed: list[Missed] = []
    in_parts: list[int] = []
    for k, (points, layer) in enumerate(zip(strokes, layers, strict=True)):
        complete = tuple(posture for posture in postures if reached.is_complete[posture][k])
        if complete:
            found.append(PlacedStroke(points, layer, k + 1, complete))
            continue
        part = slice(bounds[k], bounds[k + 1])
        dense = reached.points[part]
        spans, gaps = _spans([runs[posture][part] for posture in postures])
        before = len(found)
        for first, last in spans:
            line = _ended(arm, dense, first, last, gaps, height, postures)
            able = tuple(p for p in postures if runs[p][part][first] > last - first)
            if stroke_length(line) >= MIN_PART:
                found.append(PlacedStroke(line, layer, k + 1, able))
        if len(found) > before + 1 and not gaps:
            in_parts.append(k + 1)
        for first, last in gaps:
            line = dense[max(0, first - 1) : last + 2]
            missed.append(Missed(line, k + 1, layer, _reason(arm, dense[first], height)))
    return CutStrokes(tuple(found), tuple(missed), tuple(in_parts))


def _spans(runs: list[np.ndarray]) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return (reachable spans, unreachable spans): first and last point of each, in order."""
    longest = np.max(runs, axis=0)
    spans: list[tuple[int, int]] = []
    gaps: list[tuple[int, int]] = []
    k, n = 0, len(longest)
    while k < n:
        if longest[k] == 0:
            ahead = np.flatnonzero(longest[k:])
            last = k + int(ahead[0]) - 1 if len(ahead) else n - 1
            gaps.append((k, last))
            k = last + 1
            continue
        last = k + int(longest[k]) - 1
        if last > k:
            spans.append((k, last))
        if last == n - 1:
            break
        # Where another posture goes on from here, it begins here: nothing is missing.
        k = last if last > k and longest[last] > 1 else last + 1
    return spans, gaps


def _ended(
    arm: Arm,
    dense: np.ndarray,
    first: int,
    last: int,
    gaps: list[tuple[int, int]],
    height: float,
    postures: tuple[str, ...],
) -> np.ndarray:
    """Return the line between two points, extended into the gaps to the edge of the reach."""
    line = dense[first : last + 1]
    for end, beyond in ((0, first - 1), (-1, last + 1)):
        if not any(begin <= beyond <= finish for begin, finish in gaps):
            continue
        inside, outside = line[end], dense[beyond]
        while np.hypot(*(outside - inside)) > CUT_PRECISION:
            middle = (inside + outside) / 2
            both = np.vstack([line[end], middle])
            tried = reach.try_strokes(arm, [both], height, postures)
            if any(complete[0] for complete in tried.is_complete.values()):
                inside = middle
            else:
                outside = middle
        if np.hypot(*(inside - line[end])) > CUT_PRECISION:
            line = np.vstack([inside, line]) if end == 0 else np.vstack([line, inside])
    return line


def _reason(arm: Arm, point: np.ndarray, height: float) -> str:
    p = tuple(float(x) for x in reach.on_table(arm, point[None], height)[0])
    try:
        kinematics.inverse(arm, p)
    except kinematics.Unreachable as error:
        return str(error).rsplit(";", 1)[0]
    return (
        f"({p[0]:.2f}, {p[1]:.2f}) cm is so near to a joint's limit that no line can be drawn there"
    )


def refusal(
    missed: tuple[Missed, ...], total: int, clipped: bool = False
) -> kinematics.Unreachable:
    """Return the error for strokes out of reach, in one line: which, how much, where.

    clipped: whether they were left out already, and nothing is left.
    """
    numbers = sorted({miss.number for miss in missed})
    length = sum(stroke_length(miss.points) for miss in missed)
    named = ", ".join(map(str, numbers[:MAX_NAMED]))
    if len(numbers) > MAX_NAMED:
        named += f" and {len(numbers) - MAX_NAMED} more"
    plural = "s" if len(numbers) > 1 else ""
    advice = "place it elsewhere, make it smaller, or leave that out by --clip"
    if clipped:
        advice = "nothing is left; place it elsewhere, or make it smaller"
    return kinematics.Unreachable(
        f"{length:.1f} cm of stroke{plural} {named} (of {total}) cannot be drawn: "
        f"{missed[0].reason}; {advice}"
    )
