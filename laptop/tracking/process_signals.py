"""Exit statuses of signals, and stretches of a program that none may interrupt."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

EXIT_STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}
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


def is_stopped(process: int) -> bool:
    """Return True if a signal has stopped a process, which does nothing then; False if unknown.

    Args:
        process: its number.
    """
    try:
        text = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:  # not on Linux, or it has ended
        return False
    return text.rpartition(")")[2].split()[0] == "T"  # (its name may hold anything)


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
