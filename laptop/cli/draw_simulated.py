"""`draw --simulate`: a drawing on the emulated brick, its truth laid over what was wished."""

from __future__ import annotations

import contextlib
import sys
import tempfile
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.hearing import Hearing
from laptop.cli.run_folder import PICTURES, SUMMARY, alone_in, check_room, write_files
from laptop.drawing.durations import in_minutes
from laptop.drawing.planning import chains
from laptop.emulator.device.buttons import Press
from laptop.emulator.device.plant_constants import read_plant
from laptop.emulator.rig import Rig
from laptop.record.figures import drawing_plot, line_accuracy
from laptop.record.figures.arm_numbers import numbers_of
from laptop.record.figures.learning_plot import write_learning_plot

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

PICTURE, LEARNING = "picture.png", "learning.png"
"""The drawing; and it over those in which it was learned."""


def draw_simulated(
    plan: DrawingPlan,
    out: Path,
    plant_text: str,
    words: tuple[str, ...],
    repeat: int = 1,
    share: str | None = None,
    offsets: Sequence[Any] = (),
    built: Arm | None = None,
    rehearsals: Sequence[Sequence[Any]] = (),
) -> int:
    """Draw a plan on the emulated brick and leave its files in `out`; return the exit status.

    Args:
        plan: what is drawn.
        out: the folder.
        plant_text: changes of the plant.
        words: for the program on the brick, `repeat` and `share` among them.
        repeat: how often it is drawn.
        share: of its length at which it begins, as "40%", or None.
        offsets: what was learned of it, as DrawingPlan.write_job takes it.
        built: the arm as it is; None: as described.
        rehearsals: records of this drawing's, to be shown beside.
    """
    plant = read_plant(plant_text)
    check_room(out)
    with alone_in(out), tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "drawing.job")
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
        summary: dict[str, Any] = {
            "kind": "drawing",
            "drawing": plan.name,
            "arm": plan.arm.name,
            "plant": plant_text,
            "status": run.outcome.status,
            "reason": run.outcome.reason,
            "estimated_s": round(estimated, 2),
            "drawn_s": round(run.outcome.t, 2),
            **accuracy.as_dict(),
            "arm_numbers": numbers_of(plan.arm),
        }
        notes = _in_words(estimated, run.outcome.t, accuracy)
        click.echo(notes)
        files: dict[str, Any] = {
            "trace.csv": lambda path: line_accuracy.write_trace(path, run.record, run.names),
            SUMMARY: summary,
            PICTURE: lambda path: drawing_plot.write_drawing_plot(
                path, run.record, wished, accuracy, plan.name, notes
            ),
        }
        if rehearsals and accuracy.inks:
            shown = [*rehearsals[:2], run.record]
            names = ["at first", "after 1", f"after {len(rehearsals)}"]
            names = [*names[: len(shown) - 1], names[-1]]
            every = list(zip(names, shown, strict=True))
            files[LEARNING] = lambda path: write_learning_plot(path, every, wished, plan.name)
        write_files(out, files, PICTURES)
    click.echo(f"{out}/{PICTURE}, {', '.join(name for name in files if name != PICTURE)}")
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
