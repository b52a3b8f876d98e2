"""The last line of what a program writes, that others may begin one of their own behind it."""

import contextlib
import io
import sys
from typing import Iterator

MYPY = False
if MYPY:
    from typing import Any, BinaryIO, TextIO


class _Noted(io.BufferedIOBase):
    """Bytes on their way to a stream of this process.

    Attributes:
        unfinished: whether the last of them ended no line.
    """

    def __init__(self, buffer: "BinaryIO") -> None:
        super(_Noted, self).__init__()
        self.unfinished = False
        self._buffer = buffer

    def writable(self) -> bool:
        """Return True."""
        return True

    def write(self, data: "Any") -> int:
        """Hand `data` on; return the number of its bytes."""
        if data:
            self.unfinished = bytes(data)[-1:] != b"\n"
        return self._buffer.write(data)

    def flush(self) -> None:
        """Flush the stream itself, which others may have closed by now."""
        if not self._buffer.closed:
            self._buffer.flush()

    def close(self) -> None:
        """Leave the stream open: it is not ours."""

    def __getattr__(self, name: str) -> object:
        return getattr(self._buffer, name)

    def fileno(self) -> int:
        """Return that of the stream itself."""
        return self._buffer.fileno()

    def isatty(self) -> bool:
        """Return that of the stream itself."""
        return self._buffer.isatty()


@contextlib.contextmanager
def finished() -> Iterator[None]:
    """Watch standard output and error for a `with` block; both end with a complete line.

    A stream that holds text alone, in a notebook, is left as it is.
    """
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (_noted(stream) for stream in before)
    try:
        yield
    finally:
        finish()
        sys.stdout, sys.stderr = before


def _noted(stream: "TextIO") -> "TextIO":
    if not hasattr(stream, "buffer"):
        return stream
    stream.flush()
    noted = io.TextIOWrapper(
        _Noted(stream.buffer),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=bool(stream.line_buffering),
        write_through=getattr(stream, "write_through", False),  # Python 3.7
    )
    setattr(noted, "mode", getattr(stream, "mode", "w"))  # noqa: B010 (to read alone, for mypy)
    return noted


def finish() -> None:
    """End the lines that are not, within `finished`; nothing where nobody is left to read them."""
    for stream in (sys.stdout, sys.stderr):
        noted = getattr(stream, "buffer", None)
        with contextlib.suppress(OSError):
            stream.flush()
            if isinstance(noted, _Noted) and noted.unfinished:
                stream.write("\n")
                stream.flush()
