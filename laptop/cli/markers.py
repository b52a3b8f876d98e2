"""`markers`: a page of them to print, or the board."""

from __future__ import annotations

from pathlib import Path

import click

from laptop.cli.command import OwnCommand
from laptop.cli.options import importing, in_one_line, replace_option
from laptop.system.files import check_new, written

PAGE_SUFFIXES = (".pdf", ".svg", ".png")
"""Endings of a page to print."""


@click.command(cls=OwnCommand, short_help="Make a page of markers, or the board, to print.")
@click.option(
    "--diameter", "size", default=20.0, metavar="MM", show_default=True, help="Of a disc, mm."
)
@click.option("--board", is_flag=True, help="The board that tells a camera where it stands.")
@click.option(
    "--paper",
    type=click.Choice(("a4", "letter")),
    help="Of the board.  [default: a4]",
)
@replace_option
@click.argument("file", required=False, type=click.Path(dir_okay=False, path_type=Path))
def markers(
    size: float,
    board: bool,
    paper: str | None,
    replace: bool,
    file: Path | None,
) -> None:
    """Make a page to print: FILE is .pdf (markers.pdf or board.pdf if not said), .svg or .png."""
    with importing():  # OpenCV
        from laptop.see.markers.board_sheet import write_board
        from laptop.see.markers.marker_sheet import write_sheet

    file = file or Path("board.pdf" if board else "markers.pdf")
    with in_one_line():
        check_new(file, PAGE_SUFFIXES, replace)
        if board:
            with written(file) as draft:
                printed = write_board(draft, paper or "a4")
            width, height = printed.middle
            click.echo(
                f"{file}: print it on {printed.paper} at 100 % and measure its bar, 100 mm; "
                f"{10 * width:.0f} x {10 * height:.0f} mm in the middle are free to draw on"
            )
            return
        with written(file) as draft:
            write_sheet(draft, size)
    click.echo(f"{file}: print it at 100 %")
