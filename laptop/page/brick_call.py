"""A real brick that is called at a click: its program is run there, over ssh."""

from __future__ import annotations

from collections.abc import Callable

StartOnBrick = Callable[[], Callable[[], str]]
"""Starts the program on the brick; gives a function that tells why it has ended, "" as long as it
has not."""


class BrickCall:
    """The call of a brick, by whoever is at a page.

    Args:
        start: what is done at a click; None: bricks are not called from here.
        is_there: tells whether a brick is connected.
    """

    def __init__(self, start: StartOnBrick | None, is_there: Callable[[], bool]) -> None:
        self._start, self._is_there = start, is_there
        self._why_ended: Callable[[], str] | None = None  # of the program that was started

    @property
    def is_possible(self) -> bool:
        """Return True if a click would call a brick."""
        return self._start is not None and self._why_ended is None and not self._is_there()

    @property
    def is_on(self) -> bool:
        """Return True if the program was started and has not ended."""
        return self._why_ended is not None

    def begin(self) -> str:
        """Call the brick; return why not, or ""."""
        if self._start is None:
            return "no brick is called from here; type the command that the page shows"
        if self._is_there():
            return "a brick is connected already"
        if self._why_ended is not None:
            return "the brick is being called; wait"
        try:
            self._why_ended = self._start()
        except OSError as error:
            return f"cannot call the brick: {error.strerror}: {error.filename}"
        return ""

    def poll(self) -> str:
        """Return why the program has ended, once after it has; else ""."""
        why = self._why_ended() if self._why_ended else ""
        if why:
            self._why_ended = None
        return why
