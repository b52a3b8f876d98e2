"""Reads, places and plans drawings in a process of its own, which has bounds: files may be hostile.

The tracker asks; nothing that is done here makes it or the page wait.  A request that is newer than
the one under way comes next, and those between are left out.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import numpy as np

from laptop import system
from laptop.page.drawing_snapshots import Deviation, Lines, PlacedDrawing, Placing, Source
from shared.arm_description import Arm, ArmError

WORK_TIMEOUT = 60.0
"""Time that one request may take, s."""
MEMORY = 3_000_000_000
"""Bytes that the process may have."""
NICENESS = 10
"""Of the process: tracker, page and emulated brick come first."""


class Request(NamedTuple):
    """What is to be done: a drawing is read, unless it is the one of before, and placed.

    number  of the source, by which it is told whether it is the one of before
    height  of the paper, cm
    wish    lines (n, 2), cm, with `ink`: how far one is from the other; then nothing else is done
    """

    number: int
    source: Source | None
    placing: Placing = Placing()
    height: float = 0.0
    wish: Lines = ()
    ink: Lines = ()


Answer = PlacedDrawing | Deviation | str
"""A drawing, placed and then planned; a deviation; or why it was not done."""


class DrawingWorker:
    """The process, seen from the tracker.

    Args:
        arm: that is to draw.
        hear: is given each answer, in a thread of the worker's, and whether it is the last one.
    """

    def __init__(self, arm: Arm, hear: Callable[[Request, Answer, bool], None]) -> None:
        self._arm, self._hear = arm, hear
        self._next: Request | None = None
        self._changed = threading.Condition()
        self._over = False
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._thread: threading.Thread | None = None

    def ask(self, request: Request) -> None:
        """Have a request done as soon as what is under way is done."""
        with self._changed:
            self._next = request
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, daemon=True)
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """End the process."""
        with self._changed:
            self._over = True
            self._changed.notify()
        if self._thread:
            self._thread.join(1.0)
        self._end()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._next or self._over)
                request, self._next = self._next, None
            if self._over or request is None:
                return
            self._do(request)

    def _do(self, request: Request) -> None:
        try:
            pipe = self._begin()
            pipe.send(request)
            last = False
            while not last:
                if not pipe.poll(WORK_TIMEOUT):
                    self._end()
                    why = f"this takes longer than {WORK_TIMEOUT:.0f} s; make the drawing simpler"
                    self._hear(request, why, True)
                    return
                answer, last = pipe.recv()
                self._hear(request, answer, last)
        except (EOFError, OSError):
            self._end()
            if not self._over:
                self._hear(request, "this needs too much memory; make the drawing simpler", True)

    def _begin(self) -> Connection:
        """Return the pipe to the process, which is started where there is none."""
        if self._pipe is None or self._process is None or not self._process.is_alive():
            self._end()
            known = multiprocessing.get_all_start_methods()
            # (Not a fork of this process, which has threads that hold locks.)
            context = multiprocessing.get_context("forkserver" if "forkserver" in known else None)
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=work, args=(theirs, self._arm), daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        if self._process is not None:
            self._process.kill()
            self._process.join(1.0)
            self._process = None


def work(pipe: Connection, arm: Arm) -> None:
    """Do requests until the other side is gone; the process does no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the tracker's, who then ends this
    system.give_way(NICENESS)
    system.limit_memory(MEMORY)
    import cv2  # it has threads, one for each core

    cv2.setNumThreads(1)
    studio = Studio(arm)
    with suppress(EOFError, OSError):
        while True:
            request = pipe.recv()
            try:
                for answer, last in studio.answers(request, pipe.poll):
                    pipe.send((answer, last))
            except ArmError as error:
                pipe.send((str(error), True))
            except MemoryError:
                pipe.send(("this needs too much memory; make the drawing simpler", True))
            except Exception as error:  # a drawing that trips a library must not end the page's
                why = f"this cannot be drawn ({type(error).__name__}); take another drawing"
                pipe.send((why, True))


class Studio:
    """What the process does.

    Args:
        arm: that is to draw.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._number = -1
        self._artwork: Any = None

    def answers(self, request: Request, hurry: Callable[[], bool]) -> Any:
        """Yield (answer, whether it is the last) of a request.

        Args:
            request: see Request.
            hurry: tells whether another one waits already.

        Raises:
            ArmError: it cannot be done.
        """
        if request.source is None:
            yield compare(request.wish, request.ink), True
            return
        if request.number != self._number:
            self._number, self._artwork = -1, None
            self._artwork = read(request.source, self._arm)
            self._number = request.number
        placed, wish = self._place(request)
        hurried = hurry()
        yield placed, hurried or bool(placed.why_not)
        if not hurried and not placed.why_not:
            yield self._plan(placed, wish), True

    def _place(self, request: Request) -> tuple[PlacedDrawing, Any]:
        from laptop.drawing import strokes
        from laptop.drawing.options import DrawingOptions
        from laptop.drawing.placing import place

        artwork, at = self._artwork, request.placing
        is_place = at.x is not None and at.y is not None
        options = DrawingOptions(
            at=(at.x, at.y) if is_place else None,  # type: ignore[arg-type]
            size=None if at.width is None else (at.width, None),
            rotate=at.rotate,
            height=request.height,
            elbow=None,
        )
        postures = options.postures(self._arm)
        placement = place(artwork, self._arm, options.wish(self._arm), postures)
        cut = strokes.cut(self._arm, placement.strokes, artwork.layers, options.height, postures)
        why_not = ""
        if cut.missed:
            total = len(placement.strokes)
            why_not = str(strokes.refusal(cut.missed, total)).split("; place it")[0]
            why_not += ": move it, or make it smaller"
        placed = PlacedDrawing(
            artwork.name,
            tuple(stroke.points for stroke in cut.strokes),
            tuple(missed.points for missed in cut.missed),
            placement.centre,
            placement.size,
            at.rotate,
            (*artwork.left_out, *placement.notes),
            why_not,
            len(placement.strokes),
            artwork.length() * placement.scale,
        )
        return placed, options

    def _plan(self, placed: PlacedDrawing, options: Any) -> PlacedDrawing:
        raise NotImplementedError


def read(source: Source, arm: Arm) -> Any:
    """Return the Artwork of a source.

    Raises:
        ArmError: it is none.
    """
    from laptop.drawing import lettering, picture_files, pictures, svg

    if source.kind == "text":
        how = lettering.Lettering(align="centre")
        return lettering.write_text(source.data.decode("utf-8"), how)
    if source.kind == "file":
        if picture_files.is_picture(source.data):
            return pictures.read_picture(source.data, source.name)
        return svg.read_svg(source.data, source.name)
    raise ArmError(f"{source.name}: this is no drawing")


def compare(wish: Lines, ink: Lines) -> Deviation:
    """Return how far the ink's points are from the wish's lines; both (n, 2), cm."""
    lines = np.vstack([np.column_stack([line[:-1], line[1:]]) for line in wish if len(line) > 1])
    points = np.vstack(ink)
    start, way = lines[:, :2], lines[:, 2:] - lines[:, :2]
    length = np.maximum((way**2).sum(axis=1), 1e-12)
    nearest = np.empty(len(points))
    chunk = max(1, 1_000_000 // len(lines))  # all at once would take too much memory
    for first in range(0, len(points), chunk):
        part = points[first : first + chunk, None, :]
        share = np.clip(((part - start) * way).sum(axis=2) / length, 0.0, 1.0)
        off = part - (start + share[..., None] * way)
        nearest[first : first + chunk] = np.sqrt((off**2).sum(axis=2).min(axis=1))
    nearest *= 10
    return Deviation(float(nearest.max()), float(np.sqrt((nearest**2).mean())), len(points), ink)
