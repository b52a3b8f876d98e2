"""`draw --simulate`: a drawing on the emulated brick, its truth laid over what was wished."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

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

TIMEOUT = 24 * 3600.0
"""A drawing may take so long on the emulated brick, s."""

PICTURE = "picture.png"


def draw_simulated(
    plan: DrawingPlan,
    out: Path,
    plant_text: str,
    words: tuple[str, ...],
    repeat: int = 1,
    share: str | None = None,
) -> int:
    """Draw a plan on the emulated brick and leave its files in `out`; return the exit status.

    Args:
        plan: what is drawn.
        out: the folder.
        plant_text: changes of the plant.
        words: for the program on the brick, `repeat` and `share` among them.
        repeat: how often it is drawn.
        share: of its length at which it begins, as "40%", or None.
    """
    plant = read_plant(plant_text)
    check_room(out)
    with alone_in(out), tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "drawing.job")
        header = plan.write_job(file)
        args = ("job", file, *words)
        run = session.run(plan.arm, find_script("driver.py"), args, plant, timeout=TIMEOUT)
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


def _left_out(plan: DrawingPlan, share: str | None) -> float:
    """Return how long what lies before a share of the length takes, s."""
    if share is None:
        return 0.0
    begins = np.cumsum([0.0, *(stroke.cm for stroke in plan.strokes[:-1])])
    first = np.searchsorted(begins, float(share.rstrip("%")) / 100 * plan.cm, side="right") - 1
    return plan.estimate.starts[first] - plan.estimate.starts[0]


def _in_words(estimated: float, drawn: float, accuracy: drawing_plot.DrawingAccuracy) -> str:
    """Say how it went in a line."""
    if not accuracy.inks:
        return f"nothing was drawn in {in_minutes(drawn)}"
    return (
        f"drawn in {in_minutes(drawn)} ({in_minutes(estimated)} estimated), off by "
        f"{accuracy.greatest_mm:.1f} mm at most and {accuracy.rms_mm:.2f} mm rms"
    )


def _write(path: str, summary: dict[str, Any]) -> None:
    Path(path).write_text(json.dumps(summary, indent=1) + "\n")
