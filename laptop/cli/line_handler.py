"""Output stream of a program on the emulated brick that hands some lines to a handler."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TextIO


class LineHandler(io.TextIOBase):
    """An output stream that calls a handler with each line that has a prefix.

    Args:
        stream: gets all other lines.
        handle: called with each line that has a prefix.
        prefixes: beginnings of the lines to handle.
        shows_all: whether the handled lines go to the stream, too.
    """

    def __init__(
        self,
        stream: TextIO,
        handle: Callable[[str], None],
        prefixes: tuple[str, ...] = ("{",),
        shows_all: bool = False,
    ) -> None:
        super().__init__()
        self._shows_all = shows_all
        self._stream, self._handle, self._prefixes = stream, handle, prefixes
        self._rest = ""

    def write(self, text: str) -> int:
        """Handle each complete line."""
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            is_handled = line.startswith(self._prefixes)
            if is_handled:
                self._handle(line)
            if self._shows_all or not is_handled:
                self._stream.write(f"{line}\n")
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        self._stream.flush()
