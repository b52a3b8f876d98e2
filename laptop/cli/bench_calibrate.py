"""`bench calibrate`: arms that measure themselves by a camera, beside the truth."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import Seeds, bench_examples, importing, in_one_line


@click.command("calibrate", epilog=bench_examples("calibrate --seeds 0:10"))
@click.option("--seeds", type=Seeds(), default="0:10", show_default=True, help="One arm each.")
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_calibrate(seeds: range, as_json: bool) -> None:
    """Calibrate arms that are not as described, and compare what is found with the truth."""
    with importing():
        from laptop.bench import calibrate, show

    with in_one_line():
        todo = calibrate.cases(seeds)
        results = list(show.progress(calibrate.run(todo), len(todo), "calibrating"))
    if as_json:
        click.echo(json.dumps([asdict(one) for one in results], indent=1))
        return
    title = f"Arms of the seeds {seeds.start} to {seeds.stop - 1}; {calibrate.LEGEND}"
    show.table(title, calibrate.HEADINGS, calibrate.table(results), 0)
    for line in calibrate.summary(results):
        click.echo(line)
