"""`bench accuracy`: the test of `accuracy` on emulated arms, by camera beside the truth."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from laptop.cli.options import Seeds, bench_examples, importing, in_one_line, noise_option


@click.command("accuracy", epilog=bench_examples("accuracy", "accuracy --arm planar --cycles 10"))
@click.option("--arm", "arms", multiple=True, metavar="ARM", help="Only this one; all three.")
@click.option(
    "--cycles", type=click.IntRange(3, 100), default=30, show_default=True, help="Of each pose."
)
@noise_option("Of the marker in one picture, standard deviation.")
@click.option(
    "--seeds",
    type=Seeds(),
    default="1000:1001",
    show_default=True,
    help="Of plants, cameras and noise.",
)
@click.option("--json", "as_json", is_flag=True, help="All figures instead of the table.")
def bench_accuracy(
    arms: tuple[str, ...], cycles: int, noise: float, seeds: range, as_json: bool
) -> None:
    """Measure accuracy and repeatability by camera, and set the truth beside it.

    The emulated arm does the whole test of `accuracy` at the brick's pace.  Its cameras have
    lenses that bend, and are calibrated by photographs of the printed board.
    """
    with importing():
        from laptop.bench import accuracy, show
        from shared.arm_description import find_arm, read_arm

    with in_one_line():
        for arm in arms:
            read_arm(find_arm(arm))
        todo = [
            accuracy.AccuracyCase(arm, cycles, noise, seed)
            for arm in arms or accuracy.ARMS
            for seed in seeds
        ]
        results = list(show.progress(accuracy.run(todo), len(todo), "measuring"))
    figures = [one for result in results for one in result]
    if as_json:
        click.echo(json.dumps([{**asdict(one), "off": one.off} for one in figures], indent=1))
        return
    show.table(
        f"Accuracy and repeatability; {accuracy.LEGEND}",
        accuracy.HEADINGS,
        accuracy.table(figures),
        2,
    )
    for result in results:
        click.echo(f"{result[0].arm}, seed {result[0].seed}: {accuracy.verdict(result)}")
