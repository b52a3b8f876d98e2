"""Supervision of this process by another one while it runs a script; see guard_process."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
from typing import Iterator

from laptop.emulator.host import guard_process
from laptop.system import platforms

BEAT_PERIOD = 0.25
"""Period of the heartbeats, s."""

PATIENCE = 12.0
"""Greatest time for which the script may hold the interpreter, s of computing; longer than the
watchdog's patience, which ends whatever it can."""

SIGNAL_TIMEOUT = 3.0
"""Greatest time until the script handles a signal, s of computing."""

_QUIET = {"warn_on_full_buffer": False} if sys.version_info >= (3, 7) else {}


@contextlib.contextmanager
def guarded(name: str) -> Iterator[None]:
    """Have this process killed if it holds the interpreter too long, for a `with` block.

    Args:
        name: of the script, for people.
    """
    args = [guard_process.__file__, os.getpid(), name, PATIENCE, SIGNAL_TIMEOUT]
    try:
        with platforms.signals_blocked():  # else Ctrl-C interrupts it before it can ignore that
            process = subprocess.Popen(
                [sys.executable, "-I", "-S", *map(str, args)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                bufsize=0,
            )
    except OSError:  # no resources for another process: the run goes on without it
        yield
        return
    assert process.stdin is not None  # a pipe
    pipe = process.stdin.fileno()
    over = threading.Event()
    beating = threading.Thread(target=_beat, args=(pipe, over), daemon=True)
    main, before = threading.current_thread() is threading.main_thread(), -1
    if hasattr(os, "set_blocking") and os.name != "nt":
        os.set_blocking(pipe, False)
    if main:
        # From C, as the signal comes, whichever thread holds the interpreter.
        before = signal.set_wakeup_fd(pipe, **_QUIET)
    beating.start()
    try:
        yield
    finally:
        if main:
            signal.set_wakeup_fd(before)
        over.set()
        beating.join()
        process.stdin.close()
        process.wait()


def _beat(pipe: int, over: threading.Event) -> None:
    while not over.wait(BEAT_PERIOD):
        try:
            os.write(pipe, b"\0")
        except BlockingIOError:  # it has not polled for long, as when all are stopped
            continue
        except OSError:  # it has been ended from outside
            return
