"""Completion of the last line of a program's output, so that other output starts on a new line."""

import contextlib
import io
import sys
from typing import Iterator

MYPY = False
if MYPY:
    from typing import Any, BinaryIO, TextIO


class _LineTracker(io.BufferedIOBase):
    """Buffer that passes bytes on to a stream of this process.

    Attributes:
        unfinished: whether the last line is incomplete.
    """

    def __init__(self, buffer: "BinaryIO") -> None:
        super(_LineTracker, self).__init__()
        self.unfinished = False
        self._buffer = buffer

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, data: "Any") -> int:
        """Pass `data` on; return the number of its bytes."""
        if data:
            self.unfinished = bytes(data)[-1:] != b"\n"
        return self._buffer.write(data)

    def flush(self) -> None:
        """Flush the stream, unless it is closed."""
        if not self._buffer.closed:
            self._buffer.flush()

    def close(self) -> None:
        """Leave the stream open: others use it."""

    def __getattr__(self, name: str) -> object:
        return getattr(self._buffer, name)

    def fileno(self) -> int:
        """Return that of the stream."""
        return self._buffer.fileno()

    def isatty(self) -> bool:
        """Return that of the stream."""
        return self._buffer.isatty()


@contextlib.contextmanager
def complete() -> Iterator[None]:
    """Wrap standard output and error for a `with` block; both end with a complete line.

    A stream that holds text alone, in a notebook, is left as it is.
    """
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (_tracked(stream) for stream in before)
    try:
        yield
    finally:
        end_lines()
        sys.stdout, sys.stderr = before


def _tracked(stream: "TextIO") -> "TextIO":
    if not hasattr(stream, "buffer"):
        return stream
    stream.flush()
    tracker = io.TextIOWrapper(
        _LineTracker(stream.buffer),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=bool(stream.line_buffering),
        write_through=getattr(stream, "write_through", False),  # Python 3.7
    )
    setattr(tracker, "mode", getattr(stream, "mode", "w"))  # noqa: B010 (to read alone, for mypy)
    return tracker


def end_lines() -> None:
    """End incomplete lines, within `complete`; ignore closed pipes."""
    for stream in (sys.stdout, sys.stderr):
        tracker = getattr(stream, "buffer", None)
        with contextlib.suppress(OSError):
            stream.flush()
            if isinstance(tracker, _LineTracker) and tracker.unfinished:
                stream.write("\n")
                stream.flush()
