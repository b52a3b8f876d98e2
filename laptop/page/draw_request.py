"""The drawing that is asked for: its source, its place, and what came of planning it."""

from __future__ import annotations

import threading
from collections.abc import Callable

from laptop.page.drawing_snapshots import (
    Answer,
    Deviation,
    Lines,
    NothingShown,
    PlacedDrawing,
    Placing,
    Request,
    Source,
)
from laptop.page.drawing_worker import DrawingWorker
from shared.arm_description import Arm


class DrawRequest:
    """The drawing; orders answer with "", or in one line why not.

    Args:
        arm: that is to draw; None: it is not known, and nothing can be drawn.
        lock: held while an order is carried out, and while an answer is taken in.

    Attributes:
        revision: rises with all that browsers show of it.
        placed: the drawing as it lies on the table; None: there is none (yet).
        deviation: of what was drawn from it; None: not known.
        busy: what is done with it just now, for people, or "".
        trouble: why it cannot be drawn, or "".
    """

    def __init__(self, arm: Arm | None, lock: threading.RLock) -> None:
        self._worker = DrawingWorker(arm, self.on_answer) if arm else None
        self._lock = lock
        self._request: Request | None = None  # the last of a drawing
        self._number = 0  # of its source
        self.revision = 0
        self.placed: PlacedDrawing | None = None
        self.deviation: Deviation | None = None
        self.busy = self.trouble = ""

    @property
    def source(self) -> Source | None:
        """Source of the drawing; None: there is none."""
        return self._request and self._request.source

    def close(self) -> None:
        """End the process that reads and plans."""
        if self._worker:
            self._worker.close()

    def load(self, source: Source, placing: Placing | None = None) -> str:
        """Load another drawing."""
        if self._worker is None:
            return "the arm is not known here; give its file by BRICKSERVO_ARM"
        with self._lock:
            # (Also after one was taken away: the worker knows sources by their numbers.)
            self._number += 1
            self.placed = self.deviation = None
            self._ask(Request(self._number, source, placing or Placing()))
            return ""

    def reload(self, edit: Callable[[Source], Source | None], or_else: str) -> str:
        """Read the source anew with other settings.

        Args:
            edit: returns the source as it is to be read; None: it does not apply to this source.
            or_else: the answer in that case, and where there is no source.
        """
        with self._lock:
            before = self.source
            if before is None or (source := edit(before)) is None:
                return or_else
            self._number += 1
            return self.change(lambda asked: asked._replace(number=self._number, source=source))

    def change(self, edit: Callable[[Request], Request]) -> str:
        """Plan the same drawing with other settings."""
        with self._lock:
            if self._request is None:
                return "there is no drawing yet"
            self._ask(edit(self._request))
            return ""

    def clear(self) -> None:
        """Remove the drawing."""
        self._request = self.placed = self.deviation = None
        self.busy = self.trouble = ""
        self.revision += 1

    def begin(self) -> None:
        """Forget the deviation of the last job: another one begins."""
        self.deviation, self.trouble = None, ""

    def compare(self, wish: Lines, ink: Lines) -> None:
        """Compute how far the ink is from the wish, both lines of (n, 2), cm."""
        if self._worker:
            self._worker.ask(Request(0, None, wish=wish, ink=ink))

    def _ask(self, request: Request) -> None:
        assert self._worker
        is_read = self._request is None or self._request.number != request.number
        self.busy = "reading it" if is_read else "planning it"
        self._request, self.trouble = request, ""
        if self.placed:  # what was planned is not what is asked for now
            self.placed = self.placed._replace(seconds=None, job=b"")
        self.revision += 1
        self._worker.ask(request)

    def on_answer(self, request: Request, answer: Answer, last: bool) -> None:
        """Handle an answer of the worker, in the worker's thread."""
        with self._lock:
            self.revision += 1
            if isinstance(answer, Deviation):
                self.deviation = answer
                return
            if request is not self._request:
                return  # something newer is asked for
            self.busy = "" if last else "planning it"
            if isinstance(answer, str):
                self.trouble = answer
                if self.placed is not None:
                    self.placed = self.placed._replace(why_not=answer, job=b"")
                elif not isinstance(answer, NothingShown):
                    self._request = None
            else:
                self.placed = answer
