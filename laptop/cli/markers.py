"""`markers`: a page of them to print."""

from __future__ import annotations

from pathlib import Path

import click

from laptop.cli.options import importing, in_one_line


@click.command()
@click.option("--size", default=20.0, metavar="MM", show_default=True, help="Of a disc, mm.")
@click.argument("file", default="markers.pdf", type=click.Path(dir_okay=False, path_type=Path))
def markers(size: float, file: Path) -> None:
    """Make a page of markers to print: FILE is .pdf (markers.pdf if not said), .svg or .png."""
    with importing():  # OpenCV
        from laptop.vision.marker_sheet import write_sheet

    with in_one_line():
        write_sheet(file, size)
    click.echo(f"{file}: print it at 100 %")
