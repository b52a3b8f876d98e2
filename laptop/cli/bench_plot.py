"""`bench plot`: drawings on the emulated brick, their order beside vpype's."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

import click

from laptop.cli.options import bench_examples, importing, in_one_line


@click.command("plot", epilog=bench_examples("plot", "plot --arm planar mine.svg --pictures ."))
@click.option("--arm", "arms", multiple=True, metavar="ARM", help="Only this one; all three.")
@click.option(
    "--pictures",
    type=click.Path(exists=True, file_okay=False),
    metavar="DIR",
    help="Leave a picture of each there: wish and truth.",
)
@click.option(
    "--speed",
    is_flag=True,
    help="How long large drawings take to be read and ordered, and vpype for the same.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
@click.argument("files", nargs=-1, metavar="[FILE]...")
def bench_plot(
    arms: tuple[str, ...],
    pictures: str | None,
    speed: bool,
    as_json: bool,
    files: tuple[str, ...],
) -> None:
    """Draw ten drawings, or these, by three arms at the brick's pace, and measure the ink.

    Five come along, five are drawn anew from rules that are everybody's: hilbert, snowflake, maze,
    tiles, stars.  Where vpype is installed, its order of strokes stands beside ours.
    """
    with importing():
        from laptop.bench import plot, plot_speed, show
        from shared.arm_description import find_arm, read_arm

    if speed:
        if arms or pictures or files:
            raise click.UsageError("--speed is of its own drawings: leave all but --json out.")
        told = list(
            show.progress(plot_speed.run(list(plot_speed.SIZES)), len(plot_speed.SIZES), "ordering")
        )
        if as_json:
            click.echo(json.dumps([asdict(one) for one in told], indent=1))
        else:
            show.table(
                "CPU seconds to read and order", plot_speed.HEADINGS, plot_speed.table(told), 0
            )
        return
    with in_one_line():
        for arm in arms:
            read_arm(find_arm(arm))
        for file in files:
            plot.artwork_of(file)  # before minutes are spent
        todo = plot.cases(files, arms or plot.ARMS, pictures and str(Path(pictures).resolve()))
        results = list(show.progress(plot.run(todo), len(todo), "drawing"))
    if as_json:
        figures = [
            {key: None if value != value else value for key, value in asdict(one).items()}
            for one in results
        ]
        click.echo(json.dumps(figures, indent=1))
        return
    show.table(f"Drawings; {plot.LEGEND}", plot.HEADINGS, plot.table(results), int(len(arms) != 1))
    off = [abs(one.estimated_s / one.drawn_s - 1) for one in results]
    click.echo(
        f"estimates are off by {100 * max(off):.1f} % at most and by "
        f"{100 * math.fsum(off) / len(off):.1f} % in the mean"
    )
