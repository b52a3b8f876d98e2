"""The terminal here: its size, its input, and the signals that it sends."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator

from laptop.system import platforms

CTRL_C, END_OF_INPUT = b"\x03", b"\x04"


def window_size() -> tuple[int, int]:
    """Return columns and lines of the terminal here; COLUMNS is ignored, which never changes."""
    try:
        return os.get_terminal_size(sys.stdout.fileno())
    except (OSError, ValueError):  # it is none
        return shutil.get_terminal_size()


@contextlib.contextmanager
def reading(send: Callable[[bytes], None]) -> Iterator[None]:
    """Call `send` with what comes on standard input, for a `with` block, then with END_OF_INPUT."""
    loop, going_on = asyncio.get_running_loop(), True

    def hand_over(data: bytes) -> None:
        if going_on:
            send(data or END_OF_INPUT)

    def read() -> None:
        with contextlib.suppress(OSError, RuntimeError):  # there is no input, or no loop any more
            while data := platforms.read_typed():
                loop.call_soon_threadsafe(hand_over, data)
            loop.call_soon_threadsafe(hand_over, b"")

    threading.Thread(target=read, daemon=True).start()
    try:
        yield
    finally:
        going_on = False


@contextlib.contextmanager
def on_signal(number: int | None, act: Callable[[], None]) -> Iterator[None]:
    """Call `act` at a signal, for a `with` block; None: this system has no such signal."""
    if number is None:
        yield
        return
    loop = asyncio.get_running_loop()
    before = signal.signal(number, lambda *_: loop.call_soon_threadsafe(act))
    try:
        yield
    finally:
        signal.signal(number, before)
