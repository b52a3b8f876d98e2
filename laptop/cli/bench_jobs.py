"""`bench jobs`: jobs that aim at what an arm may not do."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import Seeds, bench_examples, importing


@click.command("jobs", epilog=bench_examples("jobs", "jobs --seeds 40000:50000 --json"))
@click.option(
    "--seeds", type=Seeds(), default="40000:40200", show_default=True, help="Each seed is a job."
)
@click.option(
    "--arm", "arms", multiple=True, metavar="ARM", help="[default: planar, geared, spatial]"
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_jobs(seeds: range, arms: tuple[str, ...], as_json: bool) -> None:
    """Offer jobs that lead beyond limits, and see what is refused and what the true joints do."""
    with importing():
        from laptop.bench import aimed_jobs, show

    todo = aimed_jobs.cases(seeds, arms or ("planar", "geared", "spatial"))
    results = list(show.progress(aimed_jobs.run(todo), len(todo), "aiming"))
    if as_json:
        click.echo(json.dumps(list(map(asdict, results)), indent=1))
        return
    title = f"Jobs with the right checksum, seeds {seeds.start}:{seeds.stop}"
    show.table(title, aimed_jobs.HEADINGS, aimed_jobs.table(results), 1)
