"""Tracks of the tip while each piece was drawn, beside where it was to be.  Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from laptop.measure.ilc.piece_path import PiecePath
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import BadMeasurement, RunData

STANDING_BEFORE, STANDING_AFTER = 0.3, 0.3
"""Time before the first row of a stroke's log, and after its last, for which the pen is down and
the tip stands, s."""

LANDING_TIME = 0.06
"""Time after a piece's end by which its tip has come to rest, s."""

MIN_ALIGNMENT_SIGHTS = 10
"""Fewest sights from which the arm's pose on the board is fitted."""

MAX_SETTLING, TIME_TOLERANCE = 0.3, 1e-6
"""Longest time from a piece's end to the next one's beginning, s; and greatest step back of the
plan's time that counts as none, s."""


@dataclass(frozen=True, eq=False)
class PieceTrack:
    """Track of the tip as it was seen on a piece.

    s         arc length along the path that was planned by then, (n,), cm
    p         where the tip was, (n, 2), cm
    standing  -1 before it began to move, 1 after it has landed at the end, 0 between, (n,)
    """

    s: np.ndarray
    p: np.ndarray
    standing: np.ndarray


@dataclass(frozen=True, eq=False)
class _StrokeSights:
    """One stroke's log (t and the job's plan, s) and sights (times, pixels, the link's heading)."""

    t: np.ndarray
    plan: np.ndarray
    times: np.ndarray
    pixels: np.ndarray
    heading: np.ndarray


def _sights(run: RunData, camera: str, strokes: int) -> list[_StrokeSights]:
    """Return what was logged and seen of each stroke."""
    sights = run.sights[camera]
    seen = np.isfinite(sights.pixels).all(axis=1)
    times, pixels = sights.t[seen], sights.pixels[seen]
    moved = [
        [row for row in run.rows if row.stroke == number and not row.rest]
        for number in range(1, strokes + 1)
    ]
    for number, rows in enumerate(moved, 1):
        if len(rows) < 2:
            raise BadMeasurement(
                f"the brick has logged nothing of stroke {number}; put today's program on it: "
                "brickservo brick install"
            )
    first, last = ([rows[k].t for rows in moved] for k in (0, -1))
    # Where strokes are joined the pen stays down, and one ends where the next one begins.
    begins = [
        max(t - STANDING_BEFORE, before) for t, before in zip(first, [-np.inf, *last], strict=False)
    ]
    ends = [
        min(t + STANDING_AFTER, after) for t, after in zip(last, [*first[1:], np.inf], strict=True)
    ]
    found = []
    for rows, begin, end in zip(moved, begins, ends, strict=True):
        t = np.array([row.t for row in rows])
        inside = (times > begin) & (times < end)
        heading = np.interp(times[inside], t, [sum(row.q) for row in rows])
        plan = np.array([row.plan for row in rows])
        found.append(_StrokeSights(t, plan, times[inside], pixels[inside], heading))
    return found


def tracks(
    run: RunData,
    view: TipView,
    strokes: Sequence[Sequence[PiecePath]],
    starts: Sequence[float],
    camera: str = "A",
) -> list[list[PieceTrack]]:
    """Return what a camera saw of every piece of every stroke.

    Args:
        run: of the strokes' job, with a log.
        view: of that camera.
        strokes: pieces of each.
        starts: each stroke's start_s in the job, s.
        camera: its name in the run.

    Raises:
        BadMeasurement: the brick logged nothing of a stroke.
    """
    found = []
    for pieces, start, seen in zip(
        strokes, starts, _sights(run, camera, len(strokes)), strict=True
    ):
        tips = view.tips(seen.pixels, seen.heading)
        finite = np.isfinite(tips).all(axis=1)
        plan = seen.plan - start
        found.append(_by_piece(pieces, seen.t, plan, seen.times[finite], tips[finite]))
    return found


def aligned(
    run: RunData,
    view: TipView,
    strokes: Sequence[Sequence[PiecePath]],
    starts: Sequence[float],
    camera: str = "A",
) -> TipView:
    """Return the view in which a first run lies best on the desired path, see TipView.aligned.

    Raises:
        BadMeasurement: the brick logged nothing of a stroke, or the camera saw next to nothing.
    """
    pixels, headings, desired = [], [], []
    for pieces, start, seen in zip(
        strokes, starts, _sights(run, camera, len(strokes)), strict=True
    ):
        at = np.interp(seen.times, seen.t, seen.plan - start)
        begun = np.cumsum([0.0, *(piece.duration for piece in pieces)])
        t = np.concatenate([first + piece.t for first, piece in zip(begun, pieces, strict=False)])
        p = np.concatenate([piece.p for piece in pieces])
        pixels.append(seen.pixels)
        headings.append(seen.heading)
        desired.append(np.stack([np.interp(at, t, column) for column in p.T], axis=1))
    seen_px = np.concatenate(pixels)
    if len(seen_px) < MIN_ALIGNMENT_SIGHTS:
        raise BadMeasurement(
            f"the camera saw the marker {len(seen_px)} times: light the table, let nothing hide it"
        )
    return view.aligned(seen_px, np.concatenate(headings), np.concatenate(desired))


def _by_piece(
    pieces: Sequence[PiecePath], t: np.ndarray, plan: np.ndarray, seen: np.ndarray, tips: np.ndarray
) -> list[PieceTrack]:
    """Share out what was seen at times among pieces, by the log's rows (t, plan)."""
    ends = np.cumsum([piece.duration for piece in pieces])
    # After a piece's end its own time goes on while it settles; then the next one's begins.
    own = np.zeros(len(t), int)
    for k in range(1, len(t)):
        later = plan[k] < plan[k - 1] - TIME_TOLERANCE or plan[k] > ends[own[k - 1]] + MAX_SETTLING
        own[k] = min(own[k - 1] + int(later), len(pieces) - 1)
    out = []
    for number, piece in enumerate(pieces):
        rows = own == number
        if not rows.any():
            out.append(PieceTrack(np.zeros(0), np.zeros((0, 2)), np.zeros(0)))
            continue
        first, last = np.flatnonzero(rows)[[0, -1]]
        begin = -np.inf if number == 0 else t[first]
        end = np.inf if number == len(pieces) - 1 else t[min(last + 1, len(t) - 1)]
        inside = (seen >= begin) & (seen < end)
        tau = plan[rows] - (ends[number] - piece.duration)
        at = np.interp(seen[inside], t[rows], tau)
        standing = np.where(at <= 0, -1, np.where(at > piece.duration + LANDING_TIME, 1, 0))
        out.append(PieceTrack(np.interp(at, piece.t, piece.s), tips[inside], standing))
    return out
