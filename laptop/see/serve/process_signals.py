"""Exit statuses of signals, and stretches of a program that none may interrupt."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from laptop.system import platforms

EXIT_STATUS = {number: 128 + number for number in platforms.ENDING}
"""Exit status after a signal, as in a shell."""


def killed_by(status: int | None) -> str:
    """Return the name of the signal that has ended a child; "" for one that ended by itself.

    Args:
        status: as subprocess.Popen has it.
    """
    if status is None or status >= 0:
        return ""
    try:
        return signal.Signals(-status).name
    except ValueError:  # one without a name
        return f"signal {-status}"


@contextmanager
def signals_ignored() -> Iterator[None]:
    """Ignore signals while the block runs: what ends in order does so in any case."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[int, Any] = {}
    while len(before) < len(EXIT_STATUS):
        # One may just have come in, and wait to be noticed.
        with suppress(KeyboardInterrupt, SystemExit):
            for number in EXIT_STATUS.keys() - before.keys():
                before[number] = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
