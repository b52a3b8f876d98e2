"""The status while tracking: lines that stay in place on a terminal, or now and then on a pipe."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from laptop.see.serve.pipeline import CameraPipeline
from laptop.see.serve.status_text import line_printer, pipeline_status

PIPE_STATUS_PERIOD = 2.0
"""Time between two status lines where nothing can be overwritten, s."""
FIRST_STATUS_DELAY = 1.0
"""Time before the first of those, s: there is little to say at once."""


class StatusDisplay:
    """Status of all cameras and of the link on a console.

    Args:
        pipelines: one for each camera.
        link: gives the link's status in a few words, or None.
        console: shows it.
        others: gives further lines.
    """

    def __init__(
        self,
        pipelines: Sequence[CameraPipeline],
        link: Callable[[], str] | None,
        console: Console,
        others: Callable[[], list[str]] = list,
    ) -> None:
        self._others = others
        self._pipelines = pipelines
        self._link = link
        self._console = console
        self._print_line = line_printer(console)
        self._next_line_at = 0.0

    def lines(self) -> list[str]:
        """Return a line for each camera, others, and one for the link."""
        lines = [pipeline_status(pipeline) for pipeline in self._pipelines]
        if len(lines) > 1:
            lines = [f"{p.name}: {line}" for p, line in zip(self._pipelines, lines, strict=True)]
        lines += self._others()
        return [*lines, self._link()] if self._link else lines

    @contextmanager
    def shown(self) -> Iterator[Callable[[], None]]:
        """Show the status; gives a function that brings it up to date."""
        live = any(pipeline.live for pipeline in self._pipelines)
        for pipeline in self._pipelines:
            pipeline.rate()  # counts from here on
        self._next_line_at = time.monotonic() + FIRST_STATUS_DELAY
        if not self._console.is_terminal:
            yield self.print_when_due if live else (lambda: None)
            return
        bar = None if live else self.bar()
        with Live(console=self._console, auto_refresh=False, transient=True) as shown:

            def update() -> None:
                text = Text("\n".join(self.lines()), no_wrap=True, overflow="ellipsis")
                if bar:
                    bar.update(bar.task_ids[0], **self._progress())
                shown.update(Group(bar, text) if bar else text, refresh=True)

            update()
            yield update

    def print_when_due(self) -> None:
        """Print the status if the last time is long enough ago."""
        now = time.monotonic()
        if now >= self._next_line_at:
            self._next_line_at = now + PIPE_STATUS_PERIOD
            lines = self.lines()
            for line in lines if len(self._pipelines) > 1 else ["; ".join(lines)]:
                self._print_line(line)

    def bar(self) -> Progress:
        """Return the recordings' progress, for a terminal."""
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        bar = Progress(*columns, console=self._console)
        bar.add_task(**self._progress())
        return bar

    def _progress(self) -> dict[str, Any]:
        """Return the recordings' progress; some tell their number of frames only at the end."""
        cameras = [pipeline.camera for pipeline in self._pipelines]
        counts = [getattr(camera, "count", None) or 0 for camera in cameras]
        about = any(getattr(camera, "guessed", False) for camera in cameras)
        unread = sum(getattr(camera, "unread", 0) for camera in cameras)
        return {
            "description": "tracking, in all about" if about else "tracking",
            "completed": sum(pipeline.frames for pipeline in self._pipelines) + unread,
            "total": sum(counts) if all(counts) else None,
        }
