"""The page's process asks the tracker's, over a pipe, one question at a time."""

from __future__ import annotations

import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from laptop.page.desk import Desk

OPEN = {
    name
    for name in vars(Desk)
    if not name.startswith("_") and name not in ("beat", "expect") and callable(getattr(Desk, name))
}
"""What may be asked through a door."""


class AskedWrongly(Exception):
    """Something was asked that a desk has no answer to."""


class Door:
    """The page's side: asks a desk in another process, one question at a time.

    Args:
        pipe: to `answer` on the other side.
    """

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._lock = threading.Lock()

    def ask(self, question: str, *args: Any) -> Any:
        """What the desk's method of that name returns.

        Raises:
            EOFError, OSError: there is no desk any more.
            AskedWrongly: it failed at this question.
        """
        with self._lock:
            self._pipe.send((question, args))
            answer, trouble = self._pipe.recv()
        if trouble:
            raise AskedWrongly(trouble)
        return answer


def answer(desk: Desk, pipe: Connection) -> None:
    """The desk's side: answer until the other side is gone; for a thread of its own."""
    with suppress(EOFError, OSError):
        while True:
            question, args = pipe.recv()
            try:
                if question not in OPEN:
                    raise AskedWrongly(f"{question} is none of a desk's")
                reply = getattr(desk, question)(*args), ""
            except Exception as error:  # it is for who asked, not for this thread to end by
                reply = None, f"{type(error).__name__}: {error}"
            pipe.send(reply)
