"""`draw --simulate`: a drawing on the emulated brick, its truth laid over what was wished."""

from __future__ import annotations

import contextlib
import sys
import tempfile
from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.hearing import Hearing
from laptop.cli.options import leave, typed_words
from laptop.cli.simulate_record import camera_of
from laptop.drawing.planning import chains
from laptop.drawing.timing import in_minutes
from laptop.emulator.device.buttons import Press
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.rig import Rig
from laptop.record.drawing_tables import drawing_table
from laptop.record.figures import drawing_plot, line_accuracy
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.figures.learning_plot import write_learning_plot
from laptop.record.figures.private_paths import without_folders
from laptop.record.names import TRACE
from laptop.record.run import DRAWING, Ending, Run
from laptop.record.run_folder import PICTURE, RunFolder

if TYPE_CHECKING:
    from laptop.drawing.preparing import DrawingPlan
    from laptop.emulator.device.brick import EmulatedBrick
    from laptop.emulator.device.peripherals import Peripherals
    from shared.arm_description import Arm

CHANGING = 5.0
"""So long it takes to put in another pen, s."""

ASKED = "put in the pen for", "nudge the tip"
"""What the brick says where it waits for that, or for the pen's tip to be looked at."""

TIMEOUT = 24 * 3600.0
"""A drawing may take so long on the emulated brick, s."""

LEARNING = "learning.png"
"""The drawing over those in which it was learned."""
FILES = (TRACE, PICTURE, LEARNING)
"""Names of what it may leave."""
DRAWING_CAPTION = (
    "What was wished (grey), and over it the true ink of the emulated arm in colours for its "
    "distance from the wish."
)
LEARNING_CAPTION = "The drawing as it was at first, and after rehearsals."


def draw_simulated(
    plan: DrawingPlan,
    folder: RunFolder,
    plant_text: str,
    words: tuple[str, ...],
    repeat: int = 1,
    share: str | None = None,
    offsets: Sequence[Any] = (),
    built: Arm | None = None,
    rehearsals: Sequence[Sequence[Any]] = (),
    scene: str | None = None,
) -> int:
    """Draw a plan on the emulated brick and leave its files; return the exit status.

    Args:
        plan: what is drawn.
        folder: of the run.
        plant_text: changes of the plant.
        words: for the program on the brick, `repeat` and `share` among them.
        repeat: how often it is drawn.
        share: of its length at which it begins, as "40%", or None.
        offsets: what was learned of it, as DrawingPlan.write_job takes it.
        built: the arm as it is; None: as described.
        rehearsals: records of this drawing's, to be shown beside.
        scene: before which it was rehearsed, or None.
    """
    plant = read_plant(plant_text)
    with tempfile.TemporaryDirectory() as temporary:
        file = str(Path(temporary) / "drawing.job")
        header = plan.write_job(file, offsets)
        changer = PenChanger()
        with (
            contextlib.closing(Hearing(sys.stdout, changer.hear, ("paused",), True)) as output,
            contextlib.redirect_stdout(output),
            Rig(plan.arm, built, plant) as rig,
        ):
            run = rig.job(file, *words, timeout=TIMEOUT, person=changer)
    wished = chains(plan.strokes, plan.arm, plan.options.height)
    accuracy = drawing_plot.compare(run.record, wished)
    estimated = repeat * header.seconds - _left_out(plan, share)
    took = {"time s": run.outcome.t, "estimated s": estimated}
    told = Run(
        kind=DRAWING,
        what=f"drawing {without_folders(plan.name) or 'something'}",
        typed=typed_words(),
        ending=Ending(
            int(run.outcome.status),
            run.outcome.reason,
            round(run.outcome.t, 2),
            {
                "pen_up_cm": round(accuracy.pen_up_cm, 3),
                "stood_with_the_pen_down_s": round(accuracy.standing_s, 3),
            },
        ),
        arm=numbers_of(plan.arm),
        built=numbers_of(built) if built else None,
        tables=[drawing_table(plan.arm.name, without_folders(plan.name), accuracy, took)],
    )
    rehearsed = {} if scene is None else {"rehearsals": len(rehearsals)}
    told.on_emulated_brick(plant_text, scene, cpu=plant["cpu"], **camera_of(scene), **rehearsed)
    notes = _in_words(estimated, run.outcome.t, accuracy)
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
    if rehearsals and accuracy.inks:
        shown = [*rehearsals[:2], run.record]
        names = ["at first", "after 1", f"after {len(rehearsals)}"]
        names = [*names[: len(shown) - 1], names[-1]]
        every = list(zip(names, shown, strict=True))
        files[LEARNING] = (
            lambda path: write_learning_plot(path, every, wished, plan.name),
            LEARNING_CAPTION,
        )
    click.echo(leave(folder, told, files))
    return int(run.outcome.status)


class PenChanger:
    """Somebody at the emulated brick who puts in the pen that it asks for, and presses CENTRE."""

    def __call__(self, brick: EmulatedBrick, devices: Peripherals) -> None:
        """Be there from now on."""
        self._world, self._press = brick.world, devices.press

    def hear(self, line: str) -> None:
        """Do what a line of the brick's asks for; what else it waits for is not this hand's."""
        if any(asked in line for asked in ASKED):
            self._press(Press("enter", self._world.now() + CHANGING, 0.2))


def _left_out(plan: DrawingPlan, share: str | None) -> float:
    """Return how long what lies before a share of the length takes, s."""
    if share is None:
        return 0.0
    begins = [0.0, *accumulate(stroke.cm for stroke in plan.strokes[:-1])]
    first = bisect_right(begins, float(share.rstrip("%")) / 100 * plan.cm) - 1
    return plan.estimate.starts[first] - plan.estimate.starts[0]


def _in_words(estimated: float, drawn: float, accuracy: drawing_plot.DrawingAccuracy) -> str:
    """Say how it went in a line."""
    if not accuracy.inks:
        return f"nothing was drawn in {in_minutes(drawn)}"
    return (
        f"drawn in {in_minutes(drawn)} ({in_minutes(estimated)} estimated), off by "
        f"{accuracy.greatest_mm:.1f} mm at most and {accuracy.rms_mm:.2f} mm rms"
    )
