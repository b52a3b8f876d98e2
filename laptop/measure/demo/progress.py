"""The display of a demo's stages while it runs."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.live import Live
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from laptop.emulator.pace import BUSY_PACE, in_words


class Stage:
    """One thing that the demo does, and how it is going."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.text = ""
        self.mark = " "
        self.began: float | None = None
        self.took: float | None = None
        self.spinner = Spinner("dots", style="cyan")

    def begin(self, text: str = "") -> None:
        """Record that it runs from now on."""
        self.began, self.text = time.monotonic(), text

    def report(self, text: str) -> None:
        """Record how it is going."""
        if self.took is None:
            self.text = text

    def finish(self, is_good: bool, text: str) -> None:
        """Record that it is over."""
        self.took = time.monotonic() - (self.began or time.monotonic())
        self.text = text
        self.mark = "[green]✓[/]" if is_good else "[red]✗[/]"

    @property
    def seconds(self) -> str:
        """Time it has been going on, as text."""
        if self.began is None:
            return ""
        return f"{self.took if self.took is not None else time.monotonic() - self.began:.1f} s"


PACE_NOTICE_PERIOD = 10.0
"""Period between two lines about a computer that is busy, s."""


class ProgressDisplay:
    """All stages, on a terminal as they go, elsewhere a line as each is over.

    Args:
        console: where to.
        names: of the stages.
    """

    def __init__(self, console: Console, names: Sequence[str]) -> None:
        self._console = console
        self._last_notice = -math.inf
        self.stages = {name: Stage(name) for name in names}
        self.pace = 1.0

    def __rich__(self) -> Table:
        """Return the table that is drawn anew all the time."""
        table = Table.grid(padding=(0, 2))
        for stage in self.stages.values():
            running = stage.began is not None and stage.took is None
            table.add_row(
                stage.spinner if running else stage.mark,
                Text(stage.name, style="" if stage.began else "dim"),
                Text(stage.seconds, justify="right"),
                Text(stage.text, no_wrap=True, overflow="ellipsis", style="" if running else "dim"),
            )
        if self.pace < BUSY_PACE:
            table.add_row("[yellow]![/]", "", "", Text(in_words(self.pace), style="yellow"))
        return table

    def report(self, line: str) -> None:
        """Print a line of its own, above all."""
        self._console.print(line, soft_wrap=True, highlight=False, markup=False)

    def add_pace(self, pace: float) -> None:
        """Show how fast the emulated clock goes of late, as laptop.emulator.pace has it."""
        self.pace = pace
        now = time.monotonic()
        if (
            pace < BUSY_PACE
            and not self._console.is_terminal
            and now - self._last_notice > PACE_NOTICE_PERIOD
        ):
            self._last_notice = now
            self.report(in_words(pace))

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Show the stages while the block runs."""
        if not self._console.is_terminal:
            yield
            return
        with Live(self, console=self._console, refresh_per_second=10):
            yield

    def finish(self, name: str, is_good: bool, text: str) -> None:
        """Record that a stage is over."""
        stage = self.stages[name]
        stage.finish(is_good, text)
        if not self._console.is_terminal:
            self.report(f"{name}: {text} ({stage.seconds})")
