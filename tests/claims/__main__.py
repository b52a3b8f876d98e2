"""The claims: `python -m tests.claims` lists them, `python -m tests.claims NAME` measures one."""

from __future__ import annotations

import sys

import click

from laptop.cli.bench import BenchCommand, choices, command_of, cpu_option, seeds_option
from laptop.cli.main import main
from laptop.cli.options import without_own_arms
from laptop.cli.start import order_sets
from tests.claims.mutant_list import GROUPS

PROGRAM = "python -m tests.claims"
HERE = "tests.claims."

CLAIMS = (
    BenchCommand(
        "limits",
        HERE + "limits",
        "Where lines are no longer straight: plants farther and farther off.",
        (cpu_option(),),
    ),
    BenchCommand(
        "interruptions",
        HERE + "interruptions",
        "Drawings that are paused, stopped, killed, and gone on with.",
        (
            seeds_option("7000:7050", "Times of what happens; each seed is a drawing."),
            choices("--arm", (), "[default: planar, geared]"),
        ),
    ),
    BenchCommand(
        "jobs",
        HERE + "aimed_jobs",
        "Jobs that lead beyond limits: what is refused, what joints do.",
        (
            seeds_option("40000:40200", "Each seed is a job."),
            choices("--arm", (), "[default: planar, geared, spatial]"),
        ),
    ),
    BenchCommand(
        "confidence",
        HERE + "confidence",
        "What confidence says of the error of a marker hidden or blurred.",
        (seeds_option("7000:7004", "Markers, grounds, lamps and what hides them."),),
    ),
    BenchCommand(
        "camera",
        HERE + "camera_table",
        "Millimetres from the picture: of the board, of the pen by its marker.",
        (seeds_option("5000:5005", "Lenses, places of the camera and noise."),),
    ),
    BenchCommand(
        "disturbances",
        HERE + "disturbances",
        "Servoing while something goes wrong: what is claimed, what moves.",
        (
            seeds_option("1000:1003", "Random arms, cameras, starts, goals and moments."),
            choices("--arm", ("planar", "geared", "spatial"), "[default: planar]"),
            cpu_option(),
        ),
    ),
    BenchCommand(
        "faults",
        HERE + "faults",
        "Faults of arm, brick, program: when the arm stands, how far it goes.",
        (
            seeds_option(None, "Random tasks, five faults in each; 200 make a thousand."),
            seeds_option(None, "The same with five pairs of faults; 60 make 300.", "--pairs"),
            cpu_option(),
        ),
    ),
    BenchCommand(
        "wrong-arms",
        HERE + "wrong_arms",
        "Arms that are not as described: whether it is named in time.",
        (seeds_option("1:21", "Random wrong arms, and as many right ones."), cpu_option()),
    ),
    BenchCommand(
        "page",
        HERE + "page",
        "What it matters to tracker and arm how many look at the page.",
        (seeds_option("1000:1004", "Cameras and goals."),),
    ),
    BenchCommand(
        "page-faults",
        HERE + "page_faults",
        "Faults of the page in mid-motion: when the arm stands.",
        (),
    ),
    BenchCommand(
        "stop",
        HERE + "page_stop",
        "STOP on the page: from the press until the true arm stands.",
        (
            click.option(
                "--count",
                type=click.IntRange(1, 10_000),
                default=100,
                show_default=True,
                help="Presses with each load.",
            ),
            click.option(
                "--busy",
                default="0,8",
                show_default=True,
                metavar="N,...",
                help="Number of busy processes beside them.",
            ),
        ),
    ),
    BenchCommand(
        "brick",
        HERE + "brick",
        "What the brick's computing costs: counted, and as it is emulated.",
        (),
    ),
    BenchCommand(
        "mutants",
        HERE + "mutants",
        "Safety-relevant lines broken one at a time: which test notices.",
        (choices("--group", GROUPS, "Only lines that guard this; all."),),
    ),
)


@click.group(
    commands=list(map(command_of, CLAIMS)),
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "terminal_width": 100},
)
@click.pass_context
def claims(context: click.Context) -> None:
    """Measure what this project says of itself; each claim has --json and --help."""
    context.with_resource(without_own_arms())
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


if __name__ == "__main__":
    order_sets()
    sys.exit(main(claims, PROGRAM))
