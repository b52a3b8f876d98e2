"""Writes anew what the programs tell of themselves in the documentation, and says what changed.

    python -m laptop.docs

With `--check` nothing is written, and the status is 1 where something would change.
Names of measurements and pictures have these made anew first, and `all` makes all: the tables of
the figures, on all cores of this machine, and the pictures.  Both come of runs in virtual time, so
that a machine gives the same ones twice; only tables of how fast it is come out otherwise.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click
import cogapp

from laptop.bench.bench import silenced
from laptop.cli.options import in_one_line, without_own_arms
from laptop.docs import measured, pictures
from laptop.docs.drawings import DRAWINGS

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted(Path(__file__).resolve().parent.rglob("*.md"))]
MARK = "[[[cog"
"""What stands in a page before the call of one of the functions in `tables`."""


def made_pages() -> list[Path]:
    """Return the pages that hold something made."""
    return [page for page in PAGES if MARK in page.read_text("utf-8")]


def remeasure(name: str) -> str:
    """Run a bench and keep its tables; return which rows have changed."""
    found = measured.measure(name)
    try:
        changed = list(measured.changes(measured.read(name), found))
        told = "\n  ".join(["changed", *changed]) if changed else "the same"
    except measured.NotMeasured:
        told = "new"
    measured.write(name, found)
    return told


def repaint(name: str) -> str:
    """Make a picture anew; return whether it has changed."""
    file = pictures.FOLDER / name
    before = file.read_bytes() if file.exists() else None
    with silenced():
        PICTURES[name](file)
    same = file.read_bytes() == before
    return "the same" if same else "new" if before is None else "changed"


PICTURES = {**pictures.PICTURES, **DRAWINGS}
MADE = {**dict.fromkeys(measured.MEASURED, remeasure), **dict.fromkeys(PICTURES, repaint)}
"""By its name all that can be made anew, and how."""


@click.command(help=__doc__)
@click.argument("names", nargs=-1, type=click.Choice(["all", *MADE]), metavar="[NAME]...")
@click.option("--check", is_flag=True, help="Write nothing; fail where something would change.")
def docs(names: tuple[str, ...], check: bool) -> None:
    """Run the calls in all pages."""
    with in_one_line(), without_own_arms():
        for name in MADE if "all" in names else names:
            began = time.monotonic()
            told = MADE[name](name)
            click.echo(f"{name}, {time.monotonic() - began:.0f} s: {told}")
    words = ["cog", "--check", "--diff"] if check else ["cog", "-r"]
    words += ["--verbosity=1", "-P", "-n", "UTF-8", "-p", "from laptop.docs.tables import *"]
    sys.exit(cogapp.Cog().main([*words, *map(str, made_pages())]))


if __name__ == "__main__":
    docs()
