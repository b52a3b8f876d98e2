"""`bench interruptions`: drawings that are paused, aborted, stopped or killed, and gone on with."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import Seeds, bench_examples, importing


@click.command(
    "interruptions",
    epilog=bench_examples("interruptions", "interruptions --seeds 7000:7004 --json"),
)
@click.option(
    "--seeds",
    type=Seeds(),
    default="7000:7050",
    show_default=True,
    help="Times of what happens; each seed is a drawing.",
)
@click.option("--arm", "arms", multiple=True, metavar="ARM", help="[default: planar, geared]")
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_interruptions(seeds: range, arms: tuple[str, ...], as_json: bool) -> None:
    """Pause a drawing twice, end it by an order, a signal or the battery, and go on with it."""
    with importing():
        from laptop.bench import interruptions, show

    todo = interruptions.cases(seeds, arms or ("planar", "geared"))
    results = list(show.progress(interruptions.run(todo), len(todo), "interrupting"))
    if as_json:
        click.echo(json.dumps(list(map(asdict, results)), indent=1))
        return
    title = f"A house of {interruptions.SIZE:g} cm, seeds {seeds.start}:{seeds.stop}"
    show.table(title, interruptions.HEADINGS, interruptions.table(results), 1)
