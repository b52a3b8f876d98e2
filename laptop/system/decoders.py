"""Suppression of the messages that picture decoders write on the terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def quiet_decoders() -> Iterator[None]:
    """Suppress messages of libjpeg and libpng on the terminal: they have no log level.

    They write to file descriptor 2, whatever Python's stderr is; that goes on as before.
    """
    before = sys.stderr
    if before is None:  # nobody listens anyway
        yield
        return
    before.flush()
    saved_stderr = os.dup(2)
    try:
        if _descriptor(before) == 2:
            sys.stderr = open(  # noqa: SIM115 - closed below
                saved_stderr,
                "w",
                buffering=1,
                encoding=before.encoding,
                errors="backslashreplace",
                closefd=False,
            )
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        if sys.stderr is not before:
            sys.stderr.close()
            sys.stderr = before
        os.dup2(saved_stderr, 2)
        os.close(saved_stderr)


def _descriptor(file: Any) -> int | None:
    try:
        return int(file.fileno())
    except (AttributeError, OSError, ValueError):
        return None
