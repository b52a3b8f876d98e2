"""Writes anew what the programs tell of themselves in the documentation, and says what changed.

    python -m laptop.docs

With `--check` nothing is written, and the status is 1 where something would change.
Names of measurements and of pictures have these made anew first, and `all` has all of them: the
tables of the figures, in virtual time, with all cores of this machine.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click
import cogapp

from laptop.cli.options import in_one_line, without_own_arms
from laptop.docs import measured

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted(Path(__file__).resolve().parent.rglob("*.md"))]
MARK = "[[[cog"
"""What stands in a page before the call of one of the functions in `tables`."""


def made_pages() -> list[Path]:
    """Return the pages that hold something made."""
    return [page for page in PAGES if MARK in page.read_text("utf-8")]


def remeasure(name: str) -> None:
    """Run a bench, keep its tables, and say which rows have changed."""
    began = time.monotonic()
    found = measured.measure(name)
    try:
        before = measured.read(name)
    except measured.NotMeasured:
        before = measured.Measured("", [], [])
    measured.write(name, found)
    changed = list(measured.changes(before, found))
    told = "changed" if changed else "the same"
    click.echo(f"{name}: {told}, {time.monotonic() - began:.0f} s")
    for line in changed:
        click.echo(f"  {line}")


@click.command(help=__doc__)
@click.argument("names", nargs=-1, type=click.Choice(["all", *measured.MEASURED]))
@click.option("--check", is_flag=True, help="Write nothing; fail where something would change.")
def docs(names: tuple[str, ...], check: bool) -> None:
    """Run the calls in all pages."""
    with in_one_line(), without_own_arms():
        for name in measured.MEASURED if "all" in names else names:
            remeasure(name)
    words = ["cog", "--check", "--diff"] if check else ["cog", "-r"]
    words += ["-P", "-n", "UTF-8", "-p", "from laptop.docs.tables import *"]
    sys.exit(cogapp.Cog().main([*words, *map(str, made_pages())]))


if __name__ == "__main__":
    docs()
