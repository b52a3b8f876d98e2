"""Trials of a drawing before a camera, until no more can be learned."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from laptop.drawing import planning
from laptop.drawing.preparing import DrawingPlan
from laptop.measure.ilc.learning import Offsets, none, stroke_errors
from laptop.measure.ilc.piece_path import paths_of
from laptop.measure.ilc.stroke_learning import StrokeLearner, Trial, floor
from laptop.measure.ilc.tracks import aligned, tracks
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import BadMeasurement, MeasuringRig, RunData
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
NO_GAIN = "no rehearsal was better than without; nothing of them is kept"
"""Reason why there is no more to learn."""

DrawingOffsets = Sequence[Sequence[Offsets]]
"""Offsets of a drawing, per stroke, per piece."""


@dataclass(frozen=True)
class TrialResult:
    """One trial of a whole drawing, as the camera saw it.

    number       from 1 on
    rms_mm       rms of the trajectory error, weighed by the length of its strokes
    greatest_mm  greatest trajectory error, across the path or at an end
    """

    number: int
    rms_mm: float
    greatest_mm: float


@dataclass(frozen=True)
class Unseen:
    """What the trials of a few strokes tell of all others, joined strokes counted as one.

    strokes     in the trials
    total       of the drawing
    kinds       of an arm's errors that foretell them, see ArmErrors; (): nothing does
    without_mm  rms error of the strokes in the trials, as the arm is described
    left_mm     rms error of each of them when it is foretold from the rest
    """

    strokes: int
    total: int
    kinds: tuple[str, ...]
    without_mm: float
    left_mm: float


@dataclass(frozen=True, eq=False)
class LearningResult:
    """Result of a drawing's trials.

    offsets  with which to draw it
    steps    result of each trial
    floor_mm noise floor: what two drawings of it differ by, about, rms
    why      it ended before all were done, or what else is to be reported; ""
    no_gain  nothing that was tried was better than what it began with
    unseen   what a few strokes tell of all others; None: all were in the trials
    """

    offsets: DrawingOffsets
    steps: Sequence[TrialResult]
    floor_mm: float
    why: str
    no_gain: bool
    unseen: Unseen | None = None

    def numbers(self) -> list[list[planning.Learned]]:
        """Offsets as a job has them."""
        return [[piece.numbers() for piece in stroke] for stroke in self.offsets]


def merged_numbers(plan: DrawingPlan) -> list[list[int]]:
    """Return the numbers of a drawing's strokes, joined ones together."""
    out: list[list[int]] = []
    for k, stroke in enumerate(plan.strokes):
        if k and planning.is_joined(plan.strokes[k - 1], stroke):
            out[-1].append(k)
        else:
            out.append([k])
    return out


class DrawingLearner:
    """Learns joint offsets of a drawing, stroke by stroke; joined strokes are learned together.

    Args:
        plan: the drawing.
        first: with which offsets it begins; None: without.
    """

    def __init__(self, plan: DrawingPlan, first: DrawingOffsets | None = None) -> None:
        self.plan = plan
        self.paths = [paths_of(plan.arm, stroke.motions) for stroke in plan.strokes]
        first = first or [[none(piece) for piece in stroke] for stroke in self.paths]
        self._merged_strokes = merged_numbers(plan)
        self._learners = []
        for joined in self._merged_strokes:
            pieces = [piece for k in joined for piece in self.paths[k]]
            begin = [piece for k in joined for piece in first[k]]
            self._learners.append(StrokeLearner(pieces, floor(plan.arm, pieces), begin))

    @property
    def offsets(self) -> DrawingOffsets:
        """The best that is known."""
        out: list[Sequence[Offsets]] = []
        for joined, learner in zip(self._merged_strokes, self._learners, strict=True):
            own = list(learner.offsets)
            strokes = []
            for k in joined:
                strokes.append(own[: len(self.paths[k])])
                del own[: len(self.paths[k])]
            out += self._drawable(joined, strokes)
        return out

    def _drawable(self, joined: Sequence[int], strokes: DrawingOffsets) -> DrawingOffsets:
        """Return so much of joined strokes' offsets as the arm may do, which the brick checks, too.

        It is as much of each: where they meet, no joint may jump.
        """
        joints = self.plan.arm.joints
        low = np.array([joint.lower for joint in joints]) + LIMIT_MARGIN
        high = np.array([joint.upper for joint in joints]) - LIMIT_MARGIN
        bounded: list[list[Offsets]] = []
        for k, pieces in zip(joined, strokes, strict=True):
            bounded.append([])
            for path, own in zip(self.paths[k], pieces, strict=True):
                q = path.at(own.s, path.q)
                # (A path that is planned nearer to a limit stays where it is.)
                moved = np.clip(q + own.q, np.minimum(low, q), np.maximum(high, q))
                bounded[-1].append(Offsets(own.s, moved - q))
        for share in OFFSET_SHARES:
            scaled = [[Offsets(own.s, share * own.q) for own in pieces] for pieces in bounded]
            with contextlib.suppress(job.BadJob):
                for k, pieces in zip(joined, scaled, strict=True):
                    self._check(k, pieces)
                return scaled
        return [[none(piece) for piece in self.paths[k]] for k in joined]

    def _check(self, k: int, pieces: Sequence[Offsets]) -> None:
        """Raise BadJob for offsets of a stroke that the brick would refuse."""
        planned = [piece.numbers() for piece in self.plan.strokes[k].motions]
        learned = [own.numbers() for own in pieces]
        stroke = job.Stroke("", 0.0, 0.0, planned, learned)
        merged(self.plan.name, k + 1, stroke, self.plan.arm.joints)

    @property
    def floor(self) -> float:
        """Noise floor: difference of two drawings of it, about, rms, cm."""
        return self._mean([learner.floor for learner in self._learners])

    @property
    def is_at_noise_floor(self) -> bool:
        """Whether no stroke has more to learn."""
        return all(learner.is_at_noise_floor for learner in self._learners)

    @property
    def has_no_gain(self) -> bool:
        """Whether no stroke has learned anything."""
        return all(learner.has_no_gain for learner in self._learners)

    def _mean(self, values: Sequence[float]) -> float:
        lengths = [sum(piece.length for piece in learner.pieces) for learner in self._learners]
        return float(np.sqrt(np.average(np.square(values), weights=lengths)))

    def add(self, run: RunData, view: TipView, starts: Sequence[float], camera: str) -> TrialResult:
        """Add a trial that was drawn with `offsets`; starts are its job's, s.

        Raises:
            BadMeasurement: the camera saw too little of it.
        """
        seen = tracks(run, view, self.paths, starts, camera)
        trials: list[Trial] = []
        for joined, learner in zip(self._merged_strokes, self._learners, strict=True):
            found = stroke_errors(learner.pieces, [track for k in joined for track in seen[k]])
            if found is None:
                raise BadMeasurement(
                    f"the camera saw next to nothing of stroke {joined[0] + 1}: light the table, "
                    "let nothing hide the marker, or draw slower with --speed"
                )
            learner.add(found)
            trials.append(learner.trials[-1])
        number = len(self._learners[0].trials)
        return TrialResult(
            number,
            10 * self._mean([trial.rms for trial in trials]),
            10 * max(trial.greatest for trial in trials),
        )


def run_trials(
    plan: DrawingPlan,
    rig: MeasuringRig,
    view: TipView,
    times: int,
    first: DrawingOffsets | None = None,
    camera: str = "A",
    on_trial: Callable[[TrialResult], None] = lambda step: None,
) -> LearningResult:
    """Let the arm draw a drawing several times, pen down, and learn from what a camera sees.

    Args:
        plan: the drawing.
        rig: an arm with that camera.
        view: of it.
        times: greatest number of trials.
        first: what was learned before, with which it begins; None: nothing.
        camera: its name.
        on_trial: called after each trial with its result.

    Raises:
        BadMeasurement: the camera saw too little, or the job did not come to its end.
        ArmError: the arm fails.
    """
    learner = DrawingLearner(plan, first)
    steps: list[TrialResult] = []
    one_pen = replace(plan.options, pens=None, touch_up=False)  # it is drawn on scrap
    why = ""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{Path(plan.name).stem or 'drawing'}.job"
        for number in range(1, times + 1):
            # (So that whoever watches the brick reads which one is on.)
            renamed = replace(plan, name=f"rehearsal {number} of {plan.name}", options=one_pen)
            offsets = [[piece.numbers() for piece in own] for own in learner.offsets]
            renamed.write_job(file, offsets, LOG_PERIOD)
            starts = [round(start, 2) for start in plan.estimate.starts]
            run = rig.measure(file, dry=False)
            if view.to_align:
                view = aligned(run, view, learner.paths, starts, camera)
            steps.append(learner.add(run, view, starts, camera))
            on_trial(steps[-1])
            if steps[-1].rms_mm > MAX_RMS_MM:
                raise BadMeasurement(
                    f"the tip was seen {steps[-1].rms_mm:.0f} mm beside its path, and "
                    f"{MAX_RMS_MM:g} are the most that is learned: check where the arm stands on "
                    "the board, the marker's height and offset, and home the arm; nothing of it "
                    "is kept"
                )
            if learner.is_at_noise_floor:
                why = AT_FLOOR
                break
    if learner.has_no_gain:
        why = NO_GAIN
    return LearningResult(learner.offsets, steps, 10 * learner.floor, why, learner.has_no_gain)
