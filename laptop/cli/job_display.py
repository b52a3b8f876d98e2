"""The display of a job that the brick draws: a bar in a terminal, else a line now and then."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from laptop.brick.jobs import BrickJobStatus, JobKeys
from laptop.drawing.timing import in_minutes

LINE_PERIOD = 10.0
"""Period of the lines where there is no terminal, s."""


def line_of(status: BrickJobStatus) -> str:
    """Return how a job goes in one line."""
    parts = [f"{status.job}: {status.state}", f"{100 * status.share:.0f} %"]
    parts.append(f"stroke {status.stroke} of {status.strokes}")
    if status.repeats > 1:
        parts.append(f"time {status.repeat} of {status.repeats}")
    parts.append(f"{in_minutes(status.left_s)} left")
    if status.tip:
        parts.append(f"tip {', '.join(f'{x:.1f}' for x in status.tip)} cm")
    if status.volts is not None:
        parts.append(f"{status.volts:.1f} V")
    if status.speed != 100:
        parts.append(f"speed {status.speed:.0f} %")
    if status.pen:
        parts.append(f"pen {status.pen:+.0f} deg")
    return ", ".join(parts)


class JobDisplay:
    """Shows how a job goes.

    Args:
        console: where to.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bar: Progress | None = None
        self._said_at, self._state = -LINE_PERIOD, ""

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it while the block runs."""
        if not self._console.is_terminal:
            yield
            return
        columns = (BarColumn(bar_width=30), TextColumn("{task.description}", markup=False))
        self._bar = Progress(*columns, console=self._console)
        self._task = self._bar.add_task("the brick starts the job", total=1.0)
        self._console.print(JobKeys.HELP, style="dim", highlight=False)
        with self._bar:
            yield

    def show(self, status: BrickJobStatus) -> None:
        """Show a status."""
        if self._bar is not None:
            self._bar.update(self._task, completed=status.share, description=line_of(status))
            return
        now = time.monotonic()
        if status.state != self._state or now - self._said_at >= LINE_PERIOD:
            self._said_at, self._state = now, status.state
            self._console.print(line_of(status), soft_wrap=True, highlight=False, markup=False)
