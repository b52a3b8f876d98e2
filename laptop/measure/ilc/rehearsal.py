"""Rehearse a drawing before a camera until there is no more to learn of it."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from laptop.drawing import planning
from laptop.drawing.preparing import DrawingPlan
from laptop.measure.ilc.learning import Offsets, missed_of, none
from laptop.measure.ilc.lesson import Lesson, Trial, floor
from laptop.measure.ilc.tracks import aligned, tracks
from laptop.measure.ilc.view import TipView
from laptop.measure.ilc.way import paths_of
from laptop.measure.measured_run import BadMeasurement, MeasuredRun, MeasuringRig
from robot.jobs.learned import merged
from shared import job

LOG_PERIOD = 0.05
"""Period of the brick's log, s."""

LIMIT_MARGIN = np.radians(0.2)
"""Least distance of offset angles from a joint's limits, rad."""

OFFSET_SHARES = (1.0, 0.75, 0.5, 0.25)
"""Shares of a stroke's offsets that are tried in turn, until the arm may do one."""

MAX_RMS_MM = 30.0
"""Greatest rms error of a trial, mm: an arm that is described a little wrongly misses less. 5 % of
its links and 2 degrees of its zero make 20."""

AT_FLOOR = "what is left is no more than two drawings of it differ by"
IN_VAIN = "no rehearsal was better than without; nothing of them is kept"
"""Reason why there is no more to learn."""

DrawingOffsets = Sequence[Sequence[Offsets]]
"""Offsets of a drawing, per stroke, per piece."""


@dataclass(frozen=True)
class Step:
    """One rehearsal of a whole drawing, as the camera saw it.

    number       from 1 on
    rms_mm       what was missed, by the length of its strokes
    greatest_mm  the most of it, across the path or at an end
    """

    number: int
    rms_mm: float
    greatest_mm: float


@dataclass(frozen=True, eq=False)
class Learned:
    """Result of a drawing's rehearsals.

    offsets  with which to draw it
    steps    each rehearsal
    floor_mm what two drawings of it differ by, about, rms
    why      it ended before all were done, or what is to be said of it; ""
    in_vain  nothing that was tried was better than what it began with
    """

    offsets: DrawingOffsets
    steps: Sequence[Step]
    floor_mm: float
    why: str
    in_vain: bool

    def numbers(self) -> list[list[planning.Learned]]:
        """Offsets as a job has them."""
        return [[piece.numbers() for piece in stroke] for stroke in self.offsets]


class Lessons:
    """Learning of a drawing, stroke by stroke; what is joined is learned together.

    Args:
        plan: the drawing.
        first: with which offsets it begins; None: without.
    """

    def __init__(self, plan: DrawingPlan, first: DrawingOffsets | None = None) -> None:
        self.plan = plan
        self.paths = [paths_of(plan.arm, stroke.motions) for stroke in plan.strokes]
        first = first or [[none(piece) for piece in stroke] for stroke in self.paths]
        self._chains: list[list[int]] = []
        for k, stroke in enumerate(plan.strokes):
            if k and planning.is_joined(plan.strokes[k - 1], stroke):
                self._chains[-1].append(k)
            else:
                self._chains.append([k])
        self._lessons = []
        for chain in self._chains:
            pieces = [piece for k in chain for piece in self.paths[k]]
            begin = [piece for k in chain for piece in first[k]]
            self._lessons.append(Lesson(pieces, floor(plan.arm, pieces), begin))

    @property
    def offsets(self) -> DrawingOffsets:
        """The best that is known."""
        out: list[Sequence[Offsets]] = []
        for chain, lesson in zip(self._chains, self._lessons, strict=True):
            own = list(lesson.offsets)
            strokes = []
            for k in chain:
                strokes.append(own[: len(self.paths[k])])
                del own[: len(self.paths[k])]
            out += self._drawable(chain, strokes)
        return out

    def _drawable(self, chain: Sequence[int], strokes: DrawingOffsets) -> DrawingOffsets:
        """Return so much of joined strokes' offsets as the arm may do, which the brick checks, too.

        It is as much of each: where they meet, no joint may jump.
        """
        joints = self.plan.arm.joints
        low = np.array([joint.lower for joint in joints]) + LIMIT_MARGIN
        high = np.array([joint.upper for joint in joints]) - LIMIT_MARGIN
        within: list[list[Offsets]] = []
        for k, pieces in zip(chain, strokes, strict=True):
            within.append([])
            for path, own in zip(self.paths[k], pieces, strict=True):
                q = path.at(own.s, path.q)
                # (A path that is planned nearer to a limit stays where it is.)
                moved = np.clip(q + own.q, np.minimum(low, q), np.maximum(high, q))
                within[-1].append(Offsets(own.s, moved - q))
        for share in OFFSET_SHARES:
            some = [[Offsets(own.s, share * own.q) for own in pieces] for pieces in within]
            with contextlib.suppress(job.BadJob):
                for k, pieces in zip(chain, some, strict=True):
                    self._check(k, pieces)
                return some
        return [[none(piece) for piece in self.paths[k]] for k in chain]

    def _check(self, k: int, pieces: Sequence[Offsets]) -> None:
        """Raise BadJob for offsets of a stroke that the brick would refuse."""
        planned = [piece.numbers() for piece in self.plan.strokes[k].motions]
        learned = [own.numbers() for own in pieces]
        stroke = job.Stroke("", 0.0, 0.0, planned, learned)
        merged(self.plan.name, k + 1, stroke, self.plan.arm.joints)

    @property
    def floor(self) -> float:
        """Difference of two drawings of it, about, rms, cm."""
        return self._mean([lesson.floor for lesson in self._lessons])

    @property
    def is_at_floor(self) -> bool:
        """Whether no stroke has more to learn."""
        return all(lesson.is_at_floor for lesson in self._lessons)

    @property
    def is_in_vain(self) -> bool:
        """Whether no stroke has learned anything."""
        return all(lesson.is_in_vain for lesson in self._lessons)

    def _mean(self, values: Sequence[float]) -> float:
        lengths = [sum(piece.length for piece in lesson.pieces) for lesson in self._lessons]
        return float(np.sqrt(np.average(np.square(values), weights=lengths)))

    def add(self, run: MeasuredRun, view: TipView, starts: Sequence[float], camera: str) -> Step:
        """Take in a rehearsal that was drawn with `offsets`; starts are its job's, s.

        Raises:
            BadMeasurement: the camera saw too little of it.
        """
        seen = tracks(run, view, self.paths, starts, camera)
        every: list[Trial] = []
        for chain, lesson in zip(self._chains, self._lessons, strict=True):
            found = missed_of(lesson.pieces, [track for k in chain for track in seen[k]])
            if found is None:
                raise BadMeasurement(
                    f"the camera saw next to nothing of stroke {chain[0] + 1}: light the table, "
                    "let nothing hide the marker, or draw slower with --speed"
                )
            lesson.add(found)
            every.append(lesson.rehearsals[-1])
        number = len(self._lessons[0].rehearsals)
        return Step(
            number,
            10 * self._mean([one.rms for one in every]),
            10 * max(one.greatest for one in every),
        )


def rehearse(
    plan: DrawingPlan,
    rig: MeasuringRig,
    view: TipView,
    times: int,
    first: DrawingOffsets | None = None,
    camera: str = "A",
    tell: Callable[[Step], None] = lambda step: None,
) -> Learned:
    """Let the arm draw a drawing some times, pen down, and learn from what a camera sees.

    Args:
        plan: the drawing.
        rig: an arm with that camera.
        view: of it.
        times: so often at the most.
        first: what was learned before, with which it begins; None: nothing.
        camera: its name.
        tell: called after each.

    Raises:
        BadMeasurement: the camera saw too little, or the job did not come to its end.
        ArmError: the arm fails.
    """
    lessons = Lessons(plan, first)
    steps: list[Step] = []
    one_pen = replace(plan.options, pens=None, touch_up=False)  # it is drawn on scrap
    why = ""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{Path(plan.name).stem or 'drawing'}.job"
        for number in range(1, times + 1):
            # (So that whoever watches the brick reads which one is on.)
            named = replace(plan, name=f"rehearsal {number} of {plan.name}", options=one_pen)
            offsets = [[piece.numbers() for piece in own] for own in lessons.offsets]
            named.write_job(file, offsets, LOG_PERIOD)
            starts = [round(start, 2) for start in plan.estimate.starts]
            run = rig.measure(file, dry=False)
            if view.to_align:
                view = aligned(run, view, lessons.paths, starts, camera)
            steps.append(lessons.add(run, view, starts, camera))
            tell(steps[-1])
            if steps[-1].rms_mm > MAX_RMS_MM:
                raise BadMeasurement(
                    f"the tip was seen {steps[-1].rms_mm:.0f} mm beside its path, and "
                    f"{MAX_RMS_MM:g} are the most that is learned: check where the arm stands on "
                    "the board, the marker's height and offset, and home the arm; nothing of it "
                    "is kept"
                )
            if lessons.is_at_floor:
                why = AT_FLOOR
                break
    if lessons.is_in_vain:
        why = IN_VAIN
    return Learned(lessons.offsets, steps, 10 * lessons.floor, why, lessons.is_in_vain)
