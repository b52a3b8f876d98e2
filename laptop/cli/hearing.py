"""Output of a program on the emulated brick, some lines of which others hear while it runs."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TextIO


class Hearing(io.TextIOBase):
    """An output while the program on the brick runs: some of its lines are heard.

    Args:
        shown: where all else goes.
        hear: called with each such line.
        begins: how those begin.
        shows_all: whether they are shown, too.
    """

    def __init__(
        self,
        shown: TextIO,
        hear: Callable[[str], None],
        begins: tuple[str, ...] = ("{",),
        shows_all: bool = False,
    ) -> None:
        super().__init__()
        self._shows_all = shows_all
        self._shown, self._hear, self._begins = shown, hear, begins
        self._rest = ""

    def write(self, text: str) -> int:
        """Hear each line as it comes."""
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            is_heard = line.startswith(self._begins)
            if is_heard:
                self._hear(line)
            if self._shows_all or not is_heard:
                self._shown.write(f"{line}\n")
        return len(text)

    def flush(self) -> None:
        """Show what is to be shown."""
        self._shown.flush()
