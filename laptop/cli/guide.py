"""`guide`: how to build the arm."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

from laptop.cli.command import OwnCommand
from laptop.cli.options import arm_option, examples, importing, in_one_line, replace_option
from laptop.system.files import check_new, write_whole
from shared.arm_description import find_arm, read_arm


@click.command(
    cls=OwnCommand,
    short_help="Make the guide to build the arm.",
    epilog=examples("guide", "guide --arm mine.ini --to guide.html"),
)
@arm_option("Arm to be drawn")
@click.option(
    "--to",
    "out",
    default=None,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the guide there, and open no browser.  [default: guide.html, which is opened]",
)
@replace_option
def guide(arm_file: str, out: Path | None, replace: bool) -> None:
    """Make the guide to build the arm, one page to read or to print."""
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
