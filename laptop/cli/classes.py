"""`class`: the handouts, and what students made of them."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from laptop.cli.command import OwnCommand
from laptop.cli.commands import FullHelpGroup
from laptop.cli.options import examples, importing, in_one_line, json_option, print_json


@click.group(
    "class", cls=FullHelpGroup, short_help="Hand out exercises, and check what comes back."
)
def classes() -> None:
    """Hand out exercises, and check what students wrote."""


@classes.command(cls=OwnCommand, epilog=examples("class new lab1 --solutions"))
@click.argument(
    "folder", default="handouts", metavar="[DIR]", type=click.Path(file_okay=False, path_type=Path)
)
@click.option("--solutions", is_flag=True, help="The solutions, too.")
def new(folder: Path, solutions: bool) -> None:
    """Put four handouts into DIR (handouts): of each a page to print and a script to complete."""
    with importing():  # numpy
        from laptop.course.handouts import write_handouts

    with in_one_line():
        for file in write_handouts(folder, solutions):
            click.echo(file)


@classes.command(epilog=examples("class check kinematics.py", "class check kinematics_*.py"))
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@json_option
def check(files: tuple[Path, ...]) -> None:
    """Check scripts of the handouts on the emulated brick; the status is 0 if all is right.

    The name of a script begins with that of its handout: kinematics, pid, line, servoing.
    """
    with importing():  # numpy
        from laptop.course.handouts import handout_of

    wrong = 0
    figures = []
    with in_one_line():
        handouts = [handout_of(file) for file in files]
    for file, handout in zip(files, handouts, strict=True):
        click.echo(f"{file}: {handout.title}")
        for finding in handout.findings(file):
            wrong += not finding.right
            figures.append({"file": str(file), "right": finding.right, "text": finding.text})
            click.echo(f"  {'right' if finding.right else 'WRONG'}  {finding.text}")
    print_json(figures)
    click.echo("all is right" if not wrong else f"{wrong} wrong")
    sys.exit(1 if wrong else 0)
