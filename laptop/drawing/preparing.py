"""The preparation of a drawing, from an artwork to its plan.  Pure but for the job's file."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from laptop.drawing import merging, ordering, placing, planning, strokes
from laptop.drawing.artwork import Artwork, BadArtwork
from laptop.drawing.options import BadDrawingOption, DrawingOptions
from laptop.drawing.planning import PlannedStroke
from laptop.drawing.strokes import Missed, PlacedStroke
from laptop.drawing.timing import Estimate, estimate
from robot.motion import kinematics
from shared import job
from shared.arm_description import Arm

MOST_POINTS = 1_000_000
"""Greatest number of points of an artwork."""

FARTHEST = 1e6
"""Greatest coordinate of an artwork's point, cm."""

STAGES = {"placing": 0.0, "ordering": 0.2, "planning": 0.35, "timing": 0.85}
"""Stages of the preparation, and the share of the time at which each begins, about."""

Progress = Callable[[str, float], None]
"""Callback with the stage, one of STAGES, and the share of all that is done, 0 to 1."""


@dataclass(frozen=True)
class StrokeCounts:
    """Numbers of a drawing before it was put into order, or after.

    strokes    from pen down to pen up
    points     of them all
    pen_up_cm  length of the pen-up moves between them, cm
    """

    strokes: int
    points: int
    pen_up_cm: float


@dataclass(frozen=True, eq=False)
class DrawingPlan:
    """A drawing placed, put into order, planned and timed.

    name       for people
    arm        shared.arm_description.Arm that draws it
    options    DrawingOptions
    placement  where it lies
    strokes    PlannedStrokes, in order
    missed     parts of strokes that cannot be reached
    total      how many strokes the artwork has
    before     counts as they came, and
    after      as they are drawn
    estimate   how long it takes
    speed      greatest of the tip, cm/s
    notes      sentences for people
    """

    name: str
    arm: Arm
    options: DrawingOptions
    placement: placing.Placement
    strokes: tuple[PlannedStroke, ...]
    missed: tuple[Missed, ...]
    total: int
    before: StrokeCounts
    after: StrokeCounts
    estimate: Estimate
    speed: float
    notes: tuple[str, ...]

    @property
    def cm(self) -> float:
        """Length of what is drawn, cm."""
        return sum(stroke.cm for stroke in self.strokes)

    def check(self) -> None:
        """Refuse what cannot be drawn, before anything moves.

        Raises:
            kinematics.Unreachable: it lies partly out of reach and is not to be clipped, or all of
                it does.
        """
        if self.missed and not (self.options.clip and self.strokes):
            raise strokes.refusal(self.missed, self.total, self.options.clip)

    def part(self, numbers: Sequence[int]) -> DrawingPlan:
        """Return the plan of some of its strokes alone, by their numbers from 0 on."""
        own = tuple(self.strokes[k] for k in numbers)
        after = _count([stroke.placed for stroke in own])
        return replace(self, strokes=own, after=after, estimate=estimate(self.arm, own))

    def write_job(
        self,
        file: str | os.PathLike[str],
        offsets: Sequence[Sequence[planning.Learned]] = (),
        log: float = 0.0,
    ) -> job.JobHeader:
        """Write the job that the brick draws, whole or not at all.

        Args:
            file: where to.
            offsets: per stroke, what was learned of its pieces, see shared.job.Stroke.
            log: so often the brick logs where its motors are, s; 0: never.

        Raises:
            kinematics.Unreachable: see `check`.
            job.BadJob: too much for the brick.
            OSError: as the system says it.
        """
        self.check()
        lines = planning.job_strokes(self.strokes, self.estimate.starts, offsets)
        header: job.JobHeader = job.header_of(
            self.arm,
            self.name,
            self.speed,
            lines,
            round(self.after.pen_up_cm, 3),
            round(self.estimate.seconds, 2),
        )._replace(log=log, pens=self._pens())
        job.write_job(str(Path(file)), header, lines)
        return header

    def pen_lines(self) -> list[str]:
        """Say which pens draw it, and when, in a sentence for people; none of a single one."""
        if not self.options.pens:
            return []
        counts = Counter(stroke.placed.layer for stroke in self.strokes)
        pens = ", ".join(f"{name or 'no layer'} ({count})" for name, count in counts.items())
        return [f"{len(counts)} pens, in this order (strokes): {pens}"]

    def _pens(self) -> str:
        """Return the pen changes as a job states them."""
        if self.options.pens is None:
            return ""
        return "touch-up" if self.options.touch_up else "change"


def prepare(
    artwork: Artwork,
    arm: Arm,
    options: DrawingOptions | None = None,
    progress: Progress = lambda stage, share: None,
) -> DrawingPlan:
    """Place an artwork, put it into order, plan and time it.

    What cannot be reached is in the plan (`missed`), so that it can be shown; `check` refuses it.

    Args:
        artwork: what is to be drawn.
        arm: the arm that draws it.
        options: how it is to be drawn; None: as large as the arm reaches.
        progress: called with the stage and the share that is done.

    Raises:
        BadArtwork: there is nothing to draw, or no place for it; see the options' errors.
    """
    options = options or DrawingOptions()
    progress("placing", STAGES["placing"])
    chosen = _chosen(artwork, options)
    postures = options.postures(arm)
    # All of it, so that each of its layers comes to lie where it is in the whole.
    placement = placing.place(artwork, arm, options.placement_request(arm), postures)
    placement = replace(placement, strokes=tuple(placement.strokes[k] for k in chosen))
    layers = _layers(artwork, chosen, options)
    found = strokes.cut(arm, placement.strokes, layers, options.height, postures)
    progress("ordering", STAGES["ordering"])
    before = _count(found.strokes)
    placed = _in_order(arm, found.strokes) if options.order else found.strokes
    progress("planning", STAGES["planning"])
    speed = float(options.speed or arm.speed)
    planned, left = planning.plan_strokes(
        arm,
        placed,
        options.height,
        speed,
        options.tolerance,
        lambda share: progress(
            "planning",
            STAGES["planning"] + share * (STAGES["timing"] - STAGES["planning"]),
        ),
    )
    progress("timing", STAGES["timing"])
    expected = estimate(arm, planned)
    progress("timing", 1.0)
    return DrawingPlan(
        artwork.name,
        arm,
        options,
        placement,
        tuple(planned),
        found.missed + tuple(left),
        len(chosen),
        before,
        _count([stroke.placed for stroke in planned]),
        expected,
        speed,
        (*placement.notes, *_part_notes(found.in_parts)),
    )


def _part_notes(in_parts: Sequence[int]) -> list[str]:
    """Return a sentence for people on the strokes, by number, that are drawn in parts."""
    if not in_parts:
        return []
    named = ", ".join(map(str, in_parts[: strokes.MAX_NAMED]))
    more = len(in_parts) - strokes.MAX_NAMED
    is_several = len(in_parts) > 1
    return [
        f"stroke{'s' * is_several} {named}{f' and {more} more' if more > 0 else ''} "
        f"{'are' if is_several else 'is'} drawn in parts, between which the elbow bends "
        "the other way"
    ]


def _in_order(arm: Arm, found: Sequence[PlacedStroke]) -> Sequence[PlacedStroke]:
    """Return strokes joined where they meet, with short pen-up moves from the home pose on."""
    if not found:
        return found
    home = kinematics.forward(arm, [joint.home for joint in arm.joints])
    return ordering.ordered(merging.merged(found), np.array(home[:2], float))


def several(artwork: Artwork) -> tuple[str, ...]:
    """Return of what an artwork has several: "layers", "colours", both or none."""
    return tuple(name for name in ("layers", "colours") if len(set(getattr(artwork, name))) > 1)


def _layers(artwork: Artwork, chosen: list[int], options: DrawingOptions) -> tuple[str, ...]:
    """Return the strokes' groups, which stay apart and in order: layers, or pens."""
    by_colour = options.pens == "colours"
    names = artwork.colours if by_colour else artwork.layers
    layers = tuple(names[k] for k in chosen) if names else ("",) * len(chosen)
    if options.pens and len(set(layers)) < 2:
        has = f"one {options.pens[:-1]}, {layers[0]}" if layers[0] else f"no {options.pens}"
        raise BadDrawingOption(
            f"{artwork.name}: has {has}: one pen draws all of it; leave --pens out"
        )
    return layers


def _count(placed: Sequence[PlacedStroke]) -> StrokeCounts:
    points = sum(len(stroke.points) for stroke in placed)
    return StrokeCounts(len(placed), points, ordering.pen_up_length(placed))


def _chosen(artwork: Artwork, options: DrawingOptions) -> list[int]:
    """Return which strokes are wanted, by their layers; refuse what is no drawing."""
    if artwork.points() > MOST_POINTS:
        raise BadArtwork(
            f"{artwork.name}: {artwork.points()} points are more than the {MOST_POINTS} that can "
            "be prepared; simplify it"
        )
    for stroke in artwork.strokes:
        if not (np.abs(stroke) <= FARTHEST).all():  # (nor is what is no number)
            raise BadArtwork(
                f"{artwork.name}: it has a point that is no place, or farther away than "
                f"{FARTHEST:g} cm; make it anew"
            )
    if options.layers is None:
        return list(range(len(artwork.strokes)))
    known = list(dict.fromkeys(artwork.layers))
    for layer in options.layers:
        if layer not in known:
            named = ", ".join(repr(name) for name in known if name)
            advice = f"has {named}; give one of these" if named else "has no layers; leave it out"
            raise BadDrawingOption(f"layer {layer!r}: {artwork.name} {advice}")
    return [k for k, layer in enumerate(artwork.layers) if layer in options.layers]
