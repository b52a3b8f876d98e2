"""Reads, places and plans drawings in a process of its own, which has bounds: files may be hostile.

The tracker asks; nothing that is done here makes it or the page wait.  A request that is newer than
the one under way comes next, and those between are left out.
"""

from __future__ import annotations

import multiprocessing
import tempfile
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from laptop.page.drawing_snapshots import Answer, Request
from shared.arm_description import Arm

WORK_TIMEOUT = 60.0
"""Time that one request may take, s."""
PREEMPTION_PERIOD = 0.1
"""Period of checks whether something newer waits, s."""


class DrawingWorker:
    """The process, seen from the tracker.

    Args:
        arm: that is to draw.
        hear: is given each answer, in a thread of the worker's, and whether it is the last one.
    """

    def __init__(self, arm: Arm, on_answer: Callable[[Request, Answer, bool], None]) -> None:
        self._arm, self._on_answer = arm, on_answer
        self._next: Request | None = None
        self._changed = threading.Condition()
        self._is_closing = False
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        # Its own, for what it writes now and then: it may be killed at any moment.
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._thread: threading.Thread | None = None

    def ask(self, request: Request) -> None:
        """Do a request next; a newer one replaces one that waits."""
        with self._changed:
            self._next = request
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, daemon=True)
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """End the process."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        if self._thread:
            self._thread.join(1.0)
        self._end()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._next or self._is_closing)
                request, self._next = self._next, None
            if self._is_closing or request is None:
                return
            self._do(request)

    def _do(self, request: Request) -> None:
        try:
            pipe = self._begin()
            pipe.send(request)
            last = preempted = False
            deadline = time.monotonic() + WORK_TIMEOUT
            while not last:
                if pipe.poll(PREEMPTION_PERIOD):
                    answer, last = pipe.recv()
                    self._on_answer(request, answer, last)
                elif self._is_closing:
                    return
                elif self._next is not None and not preempted:
                    pipe.send(None)  # the next request makes this one obsolete
                    preempted = True
                elif time.monotonic() > deadline:
                    self._end()
                    why = f"this takes longer than {WORK_TIMEOUT:.0f} s; make the drawing simpler"
                    self._on_answer(request, why, True)
                    return
        except (EOFError, OSError):
            self._end()
            if not self._is_closing:
                self._on_answer(
                    request, "this needs too much memory; make the drawing simpler", True
                )

    def _begin(self) -> Connection:
        """Return the pipe to the process, which is started if necessary."""
        if self._pipe is None or self._process is None or not self._process.is_alive():
            self._end()
            known = multiprocessing.get_all_start_methods()
            # (Not a fork of this process, which has threads that hold locks.)
            context = multiprocessing.get_context("forkserver" if "forkserver" in known else None)
            self._pipe, child_end = context.Pipe()
            self._folder = tempfile.TemporaryDirectory(prefix="brickservo-")
            args = child_end, self._arm, self._folder.name
            self._process = context.Process(target=_work, args=args, daemon=True)
            self._process.start()
            child_end.close()
        return self._pipe

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        if self._process is not None:
            self._process.kill()
            self._process.join(1.0)
            self._process = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None


def _work(pipe: Connection, arm: Arm, folder: str) -> None:
    from laptop.page.drawing_planner import work  # only there: it is slow to import

    work(pipe, arm, folder)
