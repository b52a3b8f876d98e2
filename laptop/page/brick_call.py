"""Bricks that the page has come: a real one at a click, over ssh, and an emulated one by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from laptop.page.brick_link import BrickLink

StartBrick = Callable[[], Callable[[], str]]
"""Starts a brick's program; gives a function that tells why it has ended, "" as long as it has
not."""


class ComingBricks(NamedTuple):
    """The bricks that may come.

    emulated  when somebody opens the page and no brick is there; None: none comes
    real      at a click; None: there is nothing to click
    """

    emulated: StartBrick | None = None
    real: StartBrick | None = None


NO_BRICKS = ComingBricks()


class EmulatedBrickCall:
    """The emulated brick that comes by itself.

    Args:
        start: starts it; None: it never comes.
        link: to the brick.
    """

    def __init__(self, start: StartBrick | None, link: BrickLink) -> None:
        self._start, self._link = start, link
        self._why_ended: Callable[[], str] | None = None

    @property
    def is_on(self) -> bool:
        """Return True if it was started and has not ended."""
        return self._why_ended is not None

    def begin(self) -> str:
        """Start it, if it is to come and no brick is there; return why it cannot be, or ""."""
        is_missing = self._link.is_served and not self._link.has_brick
        if self._start is None or not is_missing or self._why_ended is not None:
            return ""
        try:
            self._why_ended = self._start()
        except OSError as error:
            return f"no emulated brick: {error.strerror}: {error.filename}"
        return ""

    def poll(self) -> str:
        """Return why it has ended, once after it has; else ""."""
        if self._why_ended is None or self._link.has_brick:
            return ""
        why = self._why_ended()
        if why:
            self._why_ended = None
        return why


class BrickCall:
    """Start of a brick's program from a page.

    Args:
        start: what is done at a click; None: bricks are not called from here.
        link: to the brick.
    """

    def __init__(self, start: StartBrick | None, link: BrickLink) -> None:
        self._start, self._link = start, link
        self._why_ended: Callable[[], str] | None = None  # of the program that was started

    @property
    def is_possible(self) -> bool:
        """Return True if a click would call a brick."""
        return self._start is not None and self._why_ended is None and not self._link.has_brick

    @property
    def is_on(self) -> bool:
        """Return True if the program was started and has not ended."""
        return self._why_ended is not None

    def begin(self) -> str:
        """Call the brick; return why not, or ""."""
        if self._start is None:
            return "no brick is called from here; type the command that the page shows"
        if self._link.has_brick:
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
