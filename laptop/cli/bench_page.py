"""`bench page` and `bench stop`: what is measured in real browsers."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path

import click

from laptop.cli.options import Seeds, bench_examples, importing, in_one_line
from laptop.emulator.device.plant_constants import CPU


@click.command(
    "page",
    epilog=bench_examples("page", "page --seeds 1000:1001 --json"),
)
@click.option(
    "--seeds", type=Seeds(), default="1000:1004", show_default=True, help="Cameras and goals."
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
@click.option(
    "--pictures",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Take the pictures of the page's README instead.",
)
def bench_page(seeds: range, as_json: bool, pictures: Path | None) -> None:
    """What it matters how many look at the page: tracking, servoing, and how late they see."""
    with importing():
        from laptop.bench import page, page_pictures, show

    with in_one_line():
        if pictures:
            for file in page_pictures.take(pictures):
                click.echo(file)
            return
        todo = len(seeds) * len(page.CASES)
        results = list(show.progress(page.run(seeds), todo, "looking"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    title = (
        f"seeds {seeds.start}:{seeds.stop}, cpu={CPU:g}; camera, brick and browsers on one "
        f"machine, {os.cpu_count()} cores; figures from the emulator, in real time"
    )
    show.table(title, page.HEADINGS, page.table(results), sections=0)
    for line in page.failures(results):
        click.echo(line)


@click.command(
    "stop",
    epilog=bench_examples("stop", "stop --count 20 --busy 0,8"),
)
@click.option(
    "--count",
    type=click.IntRange(1, 10_000),
    default=100,
    show_default=True,
    help="Presses with each load.",
)
@click.option(
    "--busy",
    default="0,8",
    show_default=True,
    metavar="N,...",
    help="Number of busy processes beside them.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_stop(count: int, busy: str, as_json: bool) -> None:
    """STOP on the page: from the press in a browser until the true arm stands still."""
    from laptop.bench import page_stop, show

    try:
        loads = [int(text) for text in busy.split(",")]
    except ValueError:
        raise click.UsageError(f"busy '{busy}': write whole numbers, e.g. 0,8") from None
    with in_one_line():
        presses = (one for load in loads for one in page_stop.run(count, load))
        results = list(show.progress(presses, count * len(loads), "stopping"))
    if as_json:
        click.echo(json.dumps([asdict(result) for result in results], indent=1))
        return
    title = (
        f"STOP on the page; camera, brick and browser on one machine, {os.cpu_count()} cores; "
        "figures from the emulator, in real time"
    )
    show.table(title, page_stop.HEADINGS, page_stop.table(results), sections=0)
