"""`guide`: how to build the arm, and the class's handouts."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path

import click

from laptop.cli.options import arm_option, examples, importing, in_one_line, replace_option
from laptop.system.files import check_new, write_whole
from shared.arm_description import find_arm, read_arm


@click.group(
    invoke_without_command=True,
    epilog=examples("guide", "guide handouts --out class", "guide check kinematics.py"),
)
@arm_option("Arm to be drawn")
@click.option(
    "--out",
    default=None,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the guide there, and open no browser.  [default: guide.html, and open it]",
)
@replace_option
@click.pass_context
def guide(context: click.Context, arm_file: str, out: Path | None, replace: bool) -> None:
    """Make the guide to build the arm, one page to read or to print; or go on with a command."""
    if context.invoked_subcommand:
        return
    with importing():  # matplotlib
        from laptop.course.build import render_guide

    file = out or Path("guide.html")
    with in_one_line():
        check_new(file, (".html", ".htm"), replace)
        guide_page = render_guide(read_arm(find_arm(arm_file)), arm_file)
        write_whole(file, guide_page.encode())
    click.echo(f"{file}: print it on A4 at 100 %, then measure the check length")
    if out is None:
        webbrowser.open(file.resolve().as_uri())


@guide.command(epilog=examples("guide handouts --out class --solutions"))
@click.option(
    "--out",
    default="handouts",
    show_default=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where they go.",
)
@click.option("--solutions", is_flag=True, help="The solutions, too.")
def handouts(out: Path, solutions: bool) -> None:
    """Put four handouts into a folder: of each a page to print and a script to complete."""
    with importing():  # numpy
        from laptop.course.handouts import write_handouts

    with in_one_line():
        for file in write_handouts(out, solutions):
            click.echo(file)


@guide.command(epilog=examples("guide check kinematics.py", "guide check kinematics_*.py"))
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
def check(files: tuple[Path, ...]) -> None:
    """Check scripts of the handouts on the emulated brick; the status is 0 if all is right.

    The name of a script begins with that of its handout: kinematics, pid, line, servoing.
    """
    with importing():  # numpy
        from laptop.course.handouts import handout_of

    wrong = 0
    with in_one_line():
        handouts = [handout_of(file) for file in files]
    for file, handout in zip(files, handouts, strict=True):
        click.echo(f"{file}: {handout.title}")
        for finding in handout.findings(file):
            wrong += not finding.right
            click.echo(f"  {'right' if finding.right else 'WRONG'}  {finding.text}")
    click.echo("all is right" if not wrong else f"{wrong} of it is wrong")
    sys.exit(1 if wrong else 0)
