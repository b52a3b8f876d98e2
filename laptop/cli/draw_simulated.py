"""`draw --simulate`: a drawing on the emulated brick, its truth laid over what was wished."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from laptop.cli.run_folder import alone_in, check_room, write_files
from laptop.drawing.durations import in_minutes
from laptop.drawing.planning import chains
from laptop.reporting import drawing_plot, line_accuracy
from laptop.reporting.arm_numbers import numbers_of
from laptop.simulator import session
from laptop.simulator.device.plant_constants import read_plant
from laptop.simulator.own_programs import find_script

if TYPE_CHECKING:
    from laptop.drawing.preparing import DrawingPlan
    from shared.arm_description import Arm

TIMEOUT = 24 * 3600.0
"""A drawing may take so long on the emulated brick, s."""

PICTURE = "picture.png"


def draw_simulated(
    plan: DrawingPlan,
    out: Path,
    plant_text: str,
    words: tuple[str, ...],
    offsets: Sequence[Any] = (),
    built: Arm | None = None,
) -> int:
    """Draw a plan on the emulated brick and leave its files in `out`; return the exit status.

    Args:
        plan: the drawing.
        out: folder for files.
        plant_text: constants of the emulated motors.
        words: more arguments of `driver.py job`.
        offsets: what was learned of it, as DrawingPlan.write_job takes it.
        built: the arm as it is; None: as described.
    """
    plant = read_plant(plant_text)
    check_room(out)
    with alone_in(out), tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "drawing.job")
        header = plan.write_job(file, offsets)
        args = ("job", file, *words)
        run = session.run(
            plan.arm, find_script("driver.py"), args, plant, timeout=TIMEOUT, built=built
        )
        wished = chains(plan.strokes, plan.arm, plan.options.height)
        accuracy = drawing_plot.compare(run.record, wished)
        summary: dict[str, Any] = {
            "kind": "drawing",
            "drawing": plan.name,
            "arm": plan.arm.name,
            "plant": plant_text,
            "status": run.outcome.status,
            "reason": run.outcome.reason,
            "estimated_s": round(header.seconds, 2),
            "drawn_s": round(run.outcome.t, 2),
            **accuracy.as_dict(),
            "arm_numbers": numbers_of(plan.arm),
        }
        notes = _in_words(header.seconds, run.outcome.t, accuracy)
        click.echo(notes)
        write_files(
            out,
            {
                "trace.csv": lambda path: line_accuracy.write_trace(path, run.record, run.names),
                "summary.json": lambda path: _write(path, summary),
                PICTURE: lambda path: drawing_plot.write_drawing_plot(
                    path, run.record, wished, accuracy, plan.name, notes
                ),
            },
        )
    click.echo(f"{out}/{PICTURE}, trace.csv, summary.json")
    return int(run.outcome.status)


def write_picture(plan: DrawingPlan, record: Sequence[Any], file: Path, what: str) -> None:
    """Write the picture of a run: its truth over what was wished."""
    wished = chains(plan.strokes, plan.arm, plan.options.height)
    accuracy = drawing_plot.compare(record, wished)
    notes = f"{what}: off by {accuracy.greatest_mm:.1f} mm at most"
    drawing_plot.write_drawing_plot(file, record, wished, accuracy, plan.name, notes)


def _in_words(estimated: float, drawn: float, accuracy: drawing_plot.DrawingAccuracy) -> str:
    """Say how it went in a line."""
    if not accuracy.inks:
        return "nothing was drawn"
    return (
        f"drawn in {in_minutes(drawn)} ({in_minutes(estimated)} estimated), off by "
        f"{accuracy.greatest_mm:.1f} mm at most and {accuracy.rms_mm:.2f} mm rms"
    )


def _write(path: str, summary: dict[str, Any]) -> None:
    Path(path).write_text(json.dumps(summary, indent=1) + "\n")
