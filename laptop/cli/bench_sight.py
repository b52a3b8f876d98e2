"""`bench sight`: what rehearsals before a camera bring."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import FiniteRange, Seeds, bench_examples, importing, in_one_line


@click.command("sight", epilog=bench_examples("sight --seeds 1:5", "sight --json"))
@click.option("--seeds", type=Seeds(), default="1:5", metavar="A:B", show_default=True)
@click.option(
    "--cpu",
    type=FiniteRange(0.1, 10),
    default=1.0,
    show_default=True,
    help="How slowly the brick computes: 2.2 makes its control ticks 30 ms long.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_sight(seeds: range, cpu: float, as_json: bool) -> None:
    """Three lines and two curves by arms that are not as described, after 0 to 3 rehearsals.

    Each seed's arm draws them as it is built and once as it is described.  The first five as built
    are seen in rendered pictures by the real tracker.
    """
    with importing():
        from laptop.bench import show, sight

    with in_one_line():
        todo = sight.cases(seeds, cpu=cpu)
        results = list(show.progress(sight.run(todo), len(todo), "drawing"))
    if as_json:
        click.echo(json.dumps([asdict(one) for one in results], indent=1))
        return
    show.table(
        "Drawn by sight: mm, after 0 to 3 rehearsals", sight.HEADINGS, sight.table(results), 3
    )
