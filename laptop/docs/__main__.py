"""Writes anew what the programs tell of themselves in the documentation, and says what changed.

    python -m laptop.docs

With `--check` nothing is written, and the status is 1 where something would change.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click
import cogapp

PAGES = Path(__file__).resolve().parent
MARK = "[[[cog "
"""What stands in a page before the call of one of the functions in `tables`."""


def made_pages() -> list[Path]:
    """Return the pages that hold something made."""
    return [page for page in sorted(PAGES.rglob("*.md")) if MARK in page.read_text("utf-8")]


@click.command(help=__doc__)
@click.option("--check", is_flag=True, help="Write nothing; fail where something would change.")
def docs(check: bool) -> None:
    """Run the calls in all pages."""
    words = ["cog", "--check", "--diff"] if check else ["cog", "-r"]
    words += ["-P", "-n", "UTF-8", "-p", "from laptop.docs.tables import *"]
    sys.exit(cogapp.Cog().main([*words, *map(str, made_pages())]))


if __name__ == "__main__":
    docs()
