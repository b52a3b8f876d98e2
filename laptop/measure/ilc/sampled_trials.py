"""Trials of a few strokes of a drawing, which teach the arm all of its strokes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from laptop.drawing.preparing import DrawingPlan
from laptop.measure.ilc import arm_errors, stroke_choice
from laptop.measure.ilc.trials import (
    DrawingLearner,
    DrawingOffsets,
    LearningResult,
    TrialResult,
    Unseen,
    merged_numbers,
    run_trials,
)
from laptop.measure.ilc.view import TipView
from laptop.measure.run_data import MeasuringRig


def run_sampled_trials(
    plan: DrawingPlan,
    rig: MeasuringRig,
    view: TipView,
    times: int,
    count: int,
    first: DrawingOffsets | None = None,
    on_trial: Callable[[TrialResult], None] = lambda step: None,
) -> LearningResult:
    """Run the trials of a few strokes, and foretell the offsets of all others.

    Args:
        plan: the drawing.
        rig: an arm with a camera A.
        view: of that camera.
        times: greatest number of trials.
        count: number of strokes in them, joined strokes counted as one.
        first: what was learned before, which strokes beside the trials keep; None: nothing.
        on_trial: called after each trial with its result.

    Raises:
        BadMeasurement: the camera saw too little, or the job did not come to its end.
        ArmError: the arm fails.
    """
    groups = merged_numbers(plan)
    if count >= len(groups):
        return run_trials(plan, rig, view, times, first, on_trial=on_trial)
    whole = DrawingLearner(plan, first)
    in_groups = [[piece for k in group for piece in whole.paths[k]] for group in groups]
    chosen = stroke_choice.choose(in_groups, count)
    numbers = [k for n in chosen for k in groups[n]]
    begin = [first[k] for k in numbers] if first else None
    learned = run_trials(plan.part(numbers), rig, view, times, begin, on_trial=on_trial)
    by_number = dict(zip(numbers, learned.offsets, strict=True))
    errors = arm_errors.fit(
        plan.arm,
        [
            [pair for k in groups[n] for pair in zip(whole.paths[k], by_number[k], strict=True)]
            for n in chosen
        ],
    )
    if first:
        by_number = {**dict(enumerate(first)), **by_number}
    else:
        for n, group in enumerate(groups):
            if n in chosen:
                continue
            own = errors.offsets(plan.arm, in_groups[n])
            for k in group:
                by_number[k] = own[: len(whole.paths[k])]
                own = own[len(whole.paths[k]) :]
    every = [by_number[k] for k in range(len(plan.strokes))]
    unseen = Unseen(
        len(chosen), len(groups), tuple(errors.values), 10 * errors.without_cm, 10 * errors.left_cm
    )
    # (Of what is foretold, too, the arm does no more than it may.)
    return replace(learned, offsets=DrawingLearner(plan, every).offsets, unseen=unseen)
