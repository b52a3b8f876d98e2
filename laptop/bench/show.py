"""Display of a bench: a progress bar while they work, a table at the end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn
from rich.table import Table

from laptop.bench.bench import BenchTable

T = TypeVar("T")

MIN_TABLE_WIDTH = 170
"""Least width of a table, letters, at which no number is cut."""


def progress(results: Iterable[T], total: int, what: str) -> Iterator[T]:
    """Pass the results on, with a bar on stderr."""
    columns = (what, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield from bar.track(results, total)


def table(made: BenchTable) -> None:
    """Print a table, as wide as its figures need."""
    sections = made.sections
    shown = Table(*made.headings, title=made.title)
    for before, row in zip([None, *made.rows], made.rows, strict=False):
        if sections and before and before[:sections] != row[:sections]:
            shown.add_section()
        shown.add_row(*row)
    # A narrow terminal folds the lines; cut figures would be worse.
    Console(width=max(Console().width, MIN_TABLE_WIDTH)).print(shown)
