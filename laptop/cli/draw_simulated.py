"""`draw --simulate`: a drawing on the emulated brick, its truth laid over what was wished."""

from __future__ import annotations

import contextlib
import sys
import tempfile
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.line_handler import LineHandler
from laptop.cli.options import typed_args, write_run
from laptop.cli.simulate_record import camera_of
from laptop.drawing.planning import merged_strokes
from laptop.drawing.timing import in_minutes
from laptop.emulator.device.buttons import Press
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.rig import Rig
from laptop.emulator.simulation_result import SimulationResult
from laptop.record.drawing_tables import drawing_table
from laptop.record.figures import drawing_plot, line_accuracy
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.figures.drawing_film import write_drawing_film
from laptop.record.figures.learning_plot import write_learning_plot
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run import DRAWING, Ending, Run
from laptop.record.run_folder import PICTURE, RunFolder
from laptop.system.files import written
from robot.motion import kinematics

if TYPE_CHECKING:
    from laptop.cli.draw_options import DrawOrders
    from laptop.drawing.preparing import DrawingPlan
    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.device.peripherals import Peripherals
    from shared.arm_description import Arm

PEN_CHANGE_TIME = 5.0
"""Time to put in another pen, s."""

WAIT_PROMPTS = "put in the pen for", "nudge the tip"
"""Beginnings of what the brick prints where it waits for a pen, or for a look at the pen's tip."""

DRAWING_TIMEOUT = 24 * 3600.0
"""Longest time of a drawing on the emulated brick, s."""

LEARNING_FILE = "learning.png"
"""Name of the picture of the drawing over those in which it was learned."""
OUTPUT_FILES = (TRACE, PICTURE, LEARNING_FILE)
"""Names of what it may leave."""
DRAWING_CAPTION = (
    "What was wished (grey), and over it the true ink of the emulated arm in colours for its "
    "distance from the wish."
)
LEARNING_CAPTION = "The drawing as it was at first, and after rehearsals."


@dataclass(frozen=True)
class EmulatedBrickSpec:
    """The emulated brick.

    plant  changes of its constants, as text
    built  the arm as it is; None: as described
    """

    plant: str
    built: Arm | None = None


@dataclass(frozen=True)
class LearnedOffsets:
    """Learned offsets of a drawing.

    offsets  as DrawingPlan.write_job takes it
    records  of the drawing's trials, to be shown beside it
    scene    of the camera in the trials; None: no trials
    """

    offsets: Sequence[Any] = ()
    records: Sequence[Sequence[Any]] = ()
    scene: str | None = None


NOTHING_LEARNED = LearnedOffsets()


def draw_simulated(
    plan: DrawingPlan,
    folder: RunFolder,
    brick: EmulatedBrickSpec,
    orders: DrawOrders,
    taught: LearnedOffsets = NOTHING_LEARNED,
    films: Sequence[Path] = (),
) -> int:
    """Draw a plan on the emulated brick and leave its files; return the exit status.

    Args:
        plan: what is drawn.
        folder: of the run.
        brick: that draws.
        orders: how often it draws it, and from where on.
        taught: what was learned before.
        films: files that a film of it goes to.
    """
    run, seconds = _drawn(plan, brick, orders, taught)
    wished = merged_strokes(plan.strokes, plan.arm, plan.options.height)
    accuracy = drawing_plot.compare(run.record, wished)
    estimated = orders.repeat * seconds - _left_out(plan, orders)
    reported = _record(plan, brick, taught, run, accuracy, estimated)
    notes = _summary(estimated, run.outcome.t, accuracy)
    click.echo(notes)
    files: dict[str, tuple[Callable[[str], None], str]] = {
        TRACE: (
            lambda path: line_accuracy.write_trace(path, run.record, run.names),
            "t, joint angles (rad), place of the tip (cm), pen",
        ),
        PICTURE: (
            lambda path: drawing_plot.write_drawing_plot(
                path, run.record, wished, accuracy, plan.name, notes
            ),
            DRAWING_CAPTION,
        ),
    }
    if taught.records and accuracy.inks:
        every = _trial_records(taught.records, run.record)
        files[LEARNING_FILE] = (
            lambda path: write_learning_plot(path, every, wished, plan.name),
            LEARNING_CAPTION,
        )
    click.echo(write_run(folder, reported, files))
    for file in films:
        arm = brick.built or plan.arm
        with written(file) as draft:
            write_drawing_film(draft, run.record, wished, partial(kinematics.joint_positions, arm))
        click.echo(f"{file} is written")
    return int(run.outcome.status)


def _drawn(
    plan: DrawingPlan, brick: EmulatedBrickSpec, orders: DrawOrders, taught: LearnedOffsets
) -> tuple[SimulationResult, float]:
    """Let the emulated brick draw; return the result, and the job's estimated duration, s."""
    plant = read_plant(brick.plant)
    with tempfile.TemporaryDirectory() as temporary:
        file = str(Path(temporary) / "drawing.job")
        header = plan.write_job(file, taught.offsets)
        changer = PenChanger()
        with (
            contextlib.closing(
                LineHandler(sys.stdout, changer.handle, ("paused",), True)
            ) as output,
            contextlib.redirect_stdout(output),
            Rig(plan.arm, brick.built, plant) as rig,
        ):
            run = rig.job(file, *orders.args(), timeout=DRAWING_TIMEOUT, person=changer)
    return run, header.seconds


def _record(
    plan: DrawingPlan,
    brick: EmulatedBrickSpec,
    taught: LearnedOffsets,
    run: SimulationResult,
    accuracy: drawing_plot.DrawingAccuracy,
    estimated: float,
) -> Run:
    """Return the record of a drawing; `estimated` is how long it was to take, s."""
    outcome, name = run.outcome, without_folders(plan.name)
    took = {"time s": outcome.t, "estimated s": estimated}
    more = {
        "pen_up_cm": round(accuracy.pen_up_cm, 3),
        "stood_with_the_pen_down_s": round(accuracy.standing_s, 3),
    }
    reported = Run(
        kind=DRAWING,
        what=f"drawing {name or 'something'}",
        typed=typed_args(),
        ending=Ending(int(outcome.status), outcome.reason, round(outcome.t, 2), more),
        arm=numbers_of(plan.arm),
        built=numbers_of(brick.built) if brick.built else None,
        tables=[drawing_table(plan.arm.name, name, accuracy, took)],
    )
    cpu = read_plant(brick.plant)["cpu"]
    trials = {} if taught.scene is None else {"rehearsals": len(taught.records)}
    camera = camera_of(taught.scene)
    reported.on_emulated_brick(brick.plant, taught.scene, cpu=cpu, **camera, **trials)
    return reported


def _trial_records(
    records: Sequence[Sequence[Any]], last: Sequence[Any]
) -> list[tuple[str, Sequence[Any]]]:
    """Return (name, record) of the first trials and of the last one."""
    shown = [*records[:2], last]
    names = ["at first", "after 1", f"after {len(records)}"]
    names = [*names[: len(shown) - 1], names[-1]]
    return list(zip(names, shown, strict=True))


class PenChanger:
    """Emulated user who inserts the pen that the brick asks for, and presses CENTRE."""

    def __call__(self, brick: EmulatedBrick, devices: Peripherals) -> None:
        """Attach to a brick and its devices."""
        self._world, self._press = brick.world, devices.press

    def handle(self, line: str) -> None:
        """Handle a prompt of the brick for a pen; other prompts are ignored."""
        if any(asked in line for asked in WAIT_PROMPTS):
            self._press(Press("enter", self._world.now() + PEN_CHANGE_TIME, 0.2))


def _left_out(plan: DrawingPlan, orders: DrawOrders) -> float:
    """Return how long what lies before the place where it begins takes, s."""
    if orders.share is None:
        return 0.0
    begins = [0.0, *accumulate(stroke.cm for stroke in plan.strokes[:-1])]
    first = bisect_right(begins, orders.begins * plan.cm) - 1
    return plan.estimate.starts[first] - plan.estimate.starts[0]


def _summary(estimated: float, drawn: float, accuracy: drawing_plot.DrawingAccuracy) -> str:
    """Return a summary in one line."""
    if not accuracy.inks:
        return f"nothing was drawn in {in_minutes(drawn)}"
    return (
        f"drawn in {in_minutes(drawn)} ({in_minutes(estimated)} estimated), off by "
        f"{accuracy.greatest_mm:.1f} mm at most and {accuracy.rms_mm:.2f} mm rms"
    )
