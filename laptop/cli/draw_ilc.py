"""`draw --trials N`: a drawing is rehearsed before a camera, which teaches the arm."""

from __future__ import annotations

import contextlib
import io
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.draw_simulated import EmulatedBrickSpec, LearnedOffsets, draw_simulated
from laptop.measure.ilc import stored_offsets
from laptop.measure.ilc.sampled_trials import run_sampled_trials
from laptop.measure.ilc.trials import (
    LOG_PERIOD,
    LearningResult,
    TrialResult,
    Unseen,
    run_trials,
)

if TYPE_CHECKING:
    from laptop.cli.draw_options import DrawOrders
    from laptop.cli.ilc_options import IlcOptions
    from laptop.drawing.preparing import DrawingPlan
    from laptop.measure.emulated_rig import EmulatedRig
    from laptop.measure.ilc.still_table import StillTable
    from laptop.measure.ilc.view import TipView
    from laptop.measure.live_rig import LiveRig
    from laptop.measure.run_data import RunData
    from laptop.record.run_folder import RunFolder

NOISE_PX = 0.5
"""Noise of the emulated camera, which sees by its formula, px: ten times what the tracker has."""


def simulate_ilc(
    plan: DrawingPlan,
    asked: IlcOptions,
    folder: RunFolder,
    brick: EmulatedBrickSpec,
    orders: DrawOrders,
    films: Sequence[Path] = (),
) -> int:
    """Run the trials and draw on the emulated brick; return the exit status."""
    before = _before(plan, asked)
    if not asked.times:
        known = LearnedOffsets(_offsets_of(before))
        return draw_simulated(plan, folder, brick, orders, known, films)
    from laptop.emulator.scene.scene import Scene
    from laptop.emulator.scene.scene_constants import read_scene
    from laptop.measure.emulated_rig import EmulatedRig
    from laptop.measure.ilc.emulated_view import view_of

    scene = Scene(brick.built or plan.arm, read_scene(asked.scene))
    height = scene.constants["marker_height"]
    rig = EmulatedRig(plan.arm, brick.built, brick.plant, {"A": scene}, height, NOISE_PX)
    watched = _Watched(rig)
    with contextlib.redirect_stdout(io.StringIO()):
        learned = _run_trials(plan, asked, watched, view_of(scene, plan.arm), before)
    taught = LearnedOffsets(learned.numbers(), watched.records, asked.scene)
    return draw_simulated(plan, folder, brick, orders, taught, films)


class _Watched:
    """A rig that records the true motion of its runs."""

    def __init__(self, rig: EmulatedRig) -> None:
        self.arm = rig.arm
        self._rig = rig
        self.records: list[Sequence[Any]] = []

    def measure(self, job: Path, dry: bool = True) -> RunData:
        run = self._rig.measure(job, dry)
        self.records.append(self._rig.last.record)
        return run


def offsets_on_file(plan: DrawingPlan, asked: IlcOptions) -> list[Any]:
    """Return the stored offsets, for a drawing without new trials.

    Raises:
        click.ClickException: nothing was.
    """
    return _offsets_of(_before(plan, asked))


def _offsets_of(before: stored_offsets.StoredOffsets | None) -> list[Any]:
    if before is None or before.offsets is None:
        why = "for this arm as it is described now" if before else "of this path"
        raise click.ClickException(
            f"nothing is learned {why}; give --trials 3, say, to rehearse it"
        )
    click.echo(f"as {_gained(before)}")
    return [[piece.numbers() for piece in stroke] for stroke in before.offsets]


def draw_ilc(plan: DrawingPlan, asked: IlcOptions, arm: str) -> int:
    """Run the trials before a real camera, and let the brick draw; return the exit status."""
    before = _before(plan, asked)
    with _live(plan, asked, arm) as (rig, still, view):
        learned = _run_trials(plan, asked, still, view, before)
        if sys.stdin.isatty():
            click.prompt("put the good sheet there, then press Enter", "", show_default=False)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{Path(plan.name).stem or 'drawing'}.job"
            plan.write_job(file, learned.numbers(), LOG_PERIOD)
            rig.measure(file, dry=False)
    click.echo("drawn")
    return 0


@contextmanager
def _live(
    plan: DrawingPlan, asked: IlcOptions, arm: str
) -> Iterator[tuple[LiveRig, StillTable, TipView]]:
    """Open a rig with a real camera; give it, it with a table that has to stand, and its view."""
    from laptop.cli.rigs import RigOptions, live_rig
    from laptop.measure.ilc.still_table import StillTable
    from laptop.measure.ilc.view import TipView
    from laptop.see.markers.finders.board import find_board
    from laptop.see.table.camera_file import read_camera
    from laptop.see.table.camera_fit import BadCalibration, calibrate, check_bar

    check_bar(asked.bar)
    known, since = None, "the first look"
    if asked.camera_file:
        known, since = read_camera(asked.camera_file), f"{asked.camera_file} was made"
    with ExitStack() as stack:
        source = asked.camera or "0"
        rig_options = RigOptions([source], arm, asked.scene, port=asked.port)
        rig = stack.enter_context(live_rig(rig_options))
        if known is None:
            board = find_board(rig.image())
            if board is None:
                raise BadCalibration(
                    "the camera sees no board, so that nobody knows where its pixels are: print "
                    "one by markers --board and lay it on the table, or give --calibration"
                )
            known = calibrate([board], asked.bar)
        still = StillTable(rig, known, rig.image, since)
        still.check()
        x, y, degrees = asked.arm_at or (0.0, 0.0, 0.0)
        to_align = asked.arm_at is None
        if to_align:
            click.echo(
                "where the arm stands on the board is not known (--arm-at X,Y,DEG): the shape is "
                "learned, and the drawing stays where the arm puts it"
            )
        height, offset = asked.height_mm / 10, plan.arm.marker_offset
        turn = math.radians(degrees)
        yield rig, still, TipView(known.camera, height, offset, turn, (x, y), to_align)


def _before(plan: DrawingPlan, asked: IlcOptions) -> stored_offsets.StoredOffsets | None:
    """Return what was learned before, if it is wanted."""
    if asked.forget:
        return None
    notes: list[str] = []
    before = stored_offsets.find(plan, asked.emulated, notes)
    for note in notes:
        click.echo(note, err=True)
    return before


def _gained(before: stored_offsets.StoredOffsets) -> str:
    if before.trials == 1:
        return f"1 rehearsal has taught: {before.without_mm:.1f} mm were missed in it (rms)"
    missed = f"{before.without_mm:.1f} mm were missed before, {before.left_mm:.1f} after (rms)"
    return f"{before.trials} rehearsals have taught: {missed}"


def _foretold(unseen: Unseen, continued: bool) -> str:
    """Say what a few strokes have told of all others."""
    seen = f"{unseen.strokes} of {unseen.total} strokes were rehearsed"
    if continued:
        return f"{seen}; the others keep what was learned before"
    if not unseen.kinds:
        return f"{seen}; they foretell nothing of the others, which are drawn as before"
    return (
        f"{seen}; foretold from one another they miss {unseen.left_mm:.1f} mm rms in place of "
        f"{unseen.without_mm:.1f}, and so the others are foretold from them"
    )


def _run_trials(
    plan: DrawingPlan,
    asked: IlcOptions,
    rig: Any,
    view: TipView,
    before: stored_offsets.StoredOffsets | None,
) -> LearningResult:
    """Run the trials, report the result of each, and store the offsets."""
    first = before.offsets if before else None
    if before and first is not None:
        click.echo(
            f"begins with what {_gained(before)}; --forget begins anew",
            err=True,
        )
    steps: list[TrialResult] = []

    def on_trial(step: TrialResult) -> None:
        gain = ""
        if steps:
            less = steps[-1].rms_mm - step.rms_mm
            gain = f", {abs(less):.1f} mm {'less' if less >= 0 else 'more'} than the last time"
        steps.append(step)
        click.echo(
            f"rehearsal {step.number} of {asked.times}: the tip missed its path by "
            f"{step.rms_mm:.1f} mm rms, {step.greatest_mm:.1f} mm at most{gain}",
            err=True,
        )

    if asked.strokes is None:
        learned = run_trials(plan, rig, view, asked.times, first, on_trial=on_trial)
    else:
        learned = run_sampled_trials(
            plan, rig, view, asked.times, asked.strokes, first, on_trial=on_trial
        )
    if learned.unseen:
        click.echo(_foretold(learned.unseen, first is not None), err=True)
    if before and first is None:
        less = before.without_mm - learned.steps[0].rms_mm
        click.echo(
            f"as the arm was described before, it missed by {before.without_mm:.1f} mm unlearned: "
            f"now there is {abs(less):.1f} mm {'less' if less >= 0 else 'more'} to learn",
            err=True,
        )
    if learned.why:
        click.echo(f"{learned.why} (about {learned.floor_mm:.1f} mm rms)", err=True)
    if not learned.no_gain and any(piece.greatest for own in learned.offsets for piece in own):
        try:
            file = stored_offsets.store(plan, learned, asked.emulated, before)
            click.echo(f"what was learned is kept in {file}", err=True)
        except OSError as error:
            click.echo(f"what was learned cannot be kept: {error.strerror}", err=True)
    return learned
