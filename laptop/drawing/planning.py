"""Strokes become joint motions and a job that the brick draws alone.  Pure but for the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from laptop.drawing import reach, simplify
from laptop.drawing.artwork import stroke_length
from laptop.drawing.strokes import Missed, PlacedStroke
from robot.motion import kinematics, trajectory
from shared import job
from shared.arm_description import Arm

SEGMENT_BYTES, JOINT_BYTES = 75, 62
"""Greatest length of a segment in a job's line, bytes, and what each joint adds."""

LINE_SHARE = 0.9
"""Share of a job's longest line that is used."""

Progress = Callable[[float], None]
"""Callback with the share that is done, 0 to 1, called now and then."""

Piece = list[tuple[float, ...]]

Learned = tuple[list[float], list[list[float]]]
"""Stored offsets of a piece as a job has them."""


@dataclass(frozen=True, eq=False)
class PlannedStroke:
    """A stroke with its motions, from pen down to pen up.

    placed   PlacedStroke, as simplified
    posture  in which it is drawn
    motions  robot.motion.trajectory.Trajectory of each piece
    cm       its length
    """

    placed: PlacedStroke
    posture: str
    motions: tuple[trajectory.Trajectory, ...]
    cm: float

    def segments(self) -> int:
        """Return the number of cubic segments of its motions."""
        return sum(len(motion.numbers()[1]) for motion in self.motions)


def plan_strokes(
    arm: Arm,
    strokes: Sequence[PlacedStroke],
    height: float,
    speed: float,
    tolerance: float,
    progress: Progress = lambda share: None,
) -> tuple[list[PlannedStroke], list[Missed]]:
    """Simplify strokes and plan their motions.

    Args:
        arm: shared.arm_description.Arm.
        strokes: in the order in which they are drawn.
        height: of the paper, cm; in space only.
        speed: greatest of the tip, cm/s.
        tolerance: by which lines are simplified, cm.
        progress: called with the share of the length that is planned.

    Returns:
        What is planned, and what cannot be followed after all.
    """
    total = sum(stroke_length(stroke.points) for stroke in strokes) or 1.0
    planned: list[PlannedStroke] = []
    missed: list[Missed] = []
    done = 0.0
    for stroke, posture in zip(strokes, _postures(arm, strokes, height), strict=True):
        pieces = simplify.pieces(stroke.points, tolerance)
        try:
            planned += _planned(arm, stroke, pieces, posture, height, speed)
        except kinematics.Unreachable as error:
            reason = str(error).rsplit(";", 1)[0]
            missed.append(Missed(stroke.points, stroke.number, stroke.layer, reason))
        done += stroke_length(stroke.points)
        progress(min(1.0, done / total))
    return planned, missed


def _planned(
    arm: Arm,
    stroke: PlacedStroke,
    pieces: list[np.ndarray],
    posture: str,
    height: float,
    speed: float,
) -> list[PlannedStroke]:
    """Return the planned stroke; in parts with pen lifts between where it is too long for a job."""
    paths = [_tuples(reach.on_table(arm, piece, height)) for piece in pieces]
    postures = (posture, *(other for other in stroke.postures if other != posture))
    for number, own in enumerate(postures, 1):
        try:
            motions = trajectory.plan(arm, paths, speed, own)
            break
        except kinematics.Unreachable:
            if number == len(postures):
                raise
    most = LINE_SHARE * job.MAX_LINE / (SEGMENT_BYTES + JOINT_BYTES * len(arm.joints))
    parts: list[tuple[list[np.ndarray], list[trajectory.Trajectory]]] = [([], [])]
    count = 0
    for piece, motion in zip(pieces, motions, strict=True):
        size = len(motion.numbers()[1])
        if size > most:
            half = len(piece) // 2
            earlier = [p for part, _ in parts for p in part]
            later = pieces[len(earlier) + 1 :]
            first, second = [*earlier, piece[: half + 1]], [piece[half:], *later]
            return _planned(arm, stroke, first, own, height, speed) + _planned(
                arm, stroke, second, own, height, speed
            )
        if count + size > most:
            parts.append(([], []))
            count = 0
        parts[-1][0].append(piece)
        parts[-1][1].append(motion)
        count += size
    out = []
    for drawn, own_motions in parts:
        points = np.vstack([drawn[0][:1], *(piece[1:] for piece in drawn)])
        cm = sum(stroke_length(piece) for piece in drawn)
        out.append(PlannedStroke(replace(stroke, points=points), own, tuple(own_motions), cm))
    return out


def _tuples(points: np.ndarray) -> Piece:
    return [tuple(p) for p in points.tolist()]


def _postures(arm: Arm, strokes: Sequence[PlacedStroke], height: float) -> list[str]:
    """Return each stroke's posture, chosen so that the moves between strokes take least time.

    The shortest path through a table of strokes and postures (Viterbi 1967).
    """
    if not strokes:
        return []
    ends = np.array([(stroke.points[0], stroke.points[-1]) for stroke in strokes])
    top = np.array([joint.max_speed for joint in arm.joints])
    begin, finish = (
        {
            posture: reach.joint_angles(arm, reach.on_table(arm, ends[:, k], height), posture)
            for posture in reach.POSTURES
        }
        for k in (0, 1)
    )
    home = np.array([joint.home for joint in arm.joints])
    costs: dict[str, float] = {
        posture: _time(home, begin[posture][0], top) for posture in strokes[0].postures
    }
    predecessors: list[dict[str, str]] = []
    for k, (before, stroke) in enumerate(pairwise(strokes), 1):
        durations = {
            posture: {
                old: costs[old] + _time(finish[old][k - 1], begin[posture][k], top)
                for old in before.postures
            }
            for posture in stroke.postures
        }
        predecessors.append(
            {posture: min(times, key=times.__getitem__) for posture, times in durations.items()}
        )
        costs = {posture: min(times.values()) for posture, times in durations.items()}
    posture = min(costs, key=costs.__getitem__)
    chosen = [posture]
    for back in reversed(predecessors):
        posture = back[posture]
        chosen.append(posture)
    return chosen[::-1]


def _time(q: np.ndarray, goal: np.ndarray, top: np.ndarray) -> float:
    """Return the approximate duration of a joint move, s."""
    return float((np.abs(goal - q) / top).max())


def merged_strokes(
    strokes: Sequence[PlannedStroke], arm: Arm, height: float
) -> list[list[np.ndarray]]:
    """Return the tip's paths, cm, grouped by what is drawn without a pen lift."""
    out: list[list[np.ndarray]] = []
    for before, stroke in zip([None, *strokes], strokes, strict=False):
        if before is None or not is_joined(before, stroke):
            out.append([])
        out[-1].append(reach.on_table(arm, stroke.placed.points, height))
    return out


def is_joined(stroke: PlannedStroke, after: PlannedStroke) -> bool:
    """Return whether the pen stays down from one stroke to the one after it."""
    ends = zip(stroke.motions[-1].end, after.motions[0].start, strict=True)
    return max(abs(a - b) for a, b in ends) <= job.JOIN_TOLERANCE


def job_strokes(
    strokes: Sequence[PlannedStroke],
    starts: Sequence[float],
    offsets: Sequence[Sequence[Learned]] = (),
) -> list[job.Stroke]:
    """Return strokes as they stand in a job.

    Args:
        strokes: in order.
        starts: when the pen comes down on each, s.
        offsets: per stroke, the stored offsets of its pieces, see shared.job.Stroke; none: no
            stroke has any.
    """
    return [
        job.Stroke(
            stroke.placed.layer,
            round(stroke.cm, 3),
            round(start, 2),
            [motion.numbers() for motion in stroke.motions],
            learned,
        )
        for stroke, start, learned in zip(
            strokes, starts, offsets or [()] * len(strokes), strict=True
        )
    ]
