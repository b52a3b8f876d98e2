"""Work of the drawing's process: a source becomes an artwork, is placed, and planned."""

from __future__ import annotations

import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

import cv2
import numpy as np

from laptop.drawing import lettering, strokes
from laptop.drawing.artwork import Artwork, stroke_length
from laptop.drawing.gallery_files import gallery
from laptop.drawing.lettering import Lettering
from laptop.drawing.options import DrawingOptions
from laptop.drawing.pictures import ShowsNothing
from laptop.drawing.placing import LEAST_SIZE, place
from laptop.drawing.preparing import prepare, several
from laptop.drawing.sources import read_source
from laptop.page.drawing_snapshots import (
    Answer,
    Deviation,
    Lines,
    NothingShown,
    PlacedDrawing,
    Request,
    Source,
)
from laptop.system import platforms
from shared.arm_description import Arm, ArmError

MEMORY_LIMIT = 3_000_000_000
"""Greatest memory of the process, bytes."""
PLANNER_NICENESS = 10
"""Increment of the process's niceness: tracker, page and emulated brick come first."""


def work(pipe: Connection, arm: Arm, folder: str) -> None:
    """Run the process that reads and plans drawings.

    Args:
        pipe: to who asks.
        arm: that is to draw.
        folder: for temporary files.
    """
    tempfile.tempdir = folder
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the tracker's, who then ends this
    platforms.lower_priority(PLANNER_NICENESS)
    platforms.limit_memory(MEMORY_LIMIT)
    cv2.setNumThreads(1)
    serve(pipe, arm)


def serve(pipe: Connection, arm: Arm) -> None:
    """Answer requests until the other side is gone."""
    planner = DrawingPlanner(arm)
    with suppress(EOFError, OSError):
        while True:
            request = pipe.recv()
            if request is None:
                continue  # a preemption that came too late
            try:
                for answer, last in planner.answers(request, pipe.poll):
                    pipe.send((answer, last))
            except ShowsNothing as error:
                pipe.send((NothingShown(error), True))
            except ArmError as error:
                pipe.send((str(error), True))
            except MemoryError:
                pipe.send(("this needs too much memory; make the drawing simpler", True))
            except Exception as error:  # a drawing that trips a library must not end the page's
                why = f"this cannot be drawn ({type(error).__name__}); take another drawing"
                pipe.send((why, True))


class Preempted(Exception):
    """Something newer is asked for."""


class DrawingPlanner:
    """Reader and planner of drawings, for one arm.

    Args:
        arm: that is to draw.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._number = -1
        self._artwork = Artwork("", (), ())

    def answers(
        self, request: Request, is_preempted: Callable[[], bool]
    ) -> Iterator[tuple[Answer, bool]]:
        """Yield (answer, whether it is the last) of a request.

        Args:
            request: see Request.
            is_preempted: returns whether another request is waiting.

        Raises:
            ArmError: it cannot be done.
        """
        if request.source is None:
            yield compare(request.wish, request.ink), True
            return
        if request.number != self._number:
            self._number = -1
            self._artwork = read(request.source)
            self._number = request.number
        placed, options = self._place(request)
        yield placed, bool(placed.why_not)
        if not placed.why_not:
            with suppress(Preempted):  # then nobody waits for it any more
                placed = self._plan(placed, options, is_preempted)
            yield placed, True

    def _place(self, request: Request) -> tuple[PlacedDrawing, DrawingOptions]:
        artwork, at = self._artwork, request.placing
        low, high = artwork.bounds()
        sides = high - low
        size = None
        if at.size is not None and sides.max() > 0:
            width, height = (max(LEAST_SIZE, s * at.size / sides.max()) for s in sides)
            size = width, height
        options = DrawingOptions(
            at=None if at.x is None or at.y is None else (at.x, at.y),
            size=size,
            rotate=at.rotate,
            height=request.height,
            pens=request.pens if request.pens in several(artwork) else None,
        )
        postures = options.postures(self._arm)
        placement = place(artwork, self._arm, options.placement_request(self._arm), postures)
        cut = strokes.cut(self._arm, placement.strokes, artwork.layers, options.height, postures)
        why_not = ""
        if cut.missed:
            out = sum(stroke_length(missed.points) for missed in cut.missed)
            share = "all" if not cut.strokes else f"{out:.1f} cm"
            why_not = f"{share} of it cannot be reached (red): move it, or make it smaller"
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
            several=several(artwork),
            pens=options.pens or "",
        )
        return placed, options

    def _plan(
        self, placed: PlacedDrawing, options: DrawingOptions, is_preempted: Callable[[], bool]
    ) -> PlacedDrawing:
        def on_progress(stage: str, share: float) -> None:
            if is_preempted():
                raise Preempted

        plan = prepare(self._artwork, self._arm, options, on_progress)
        with tempfile.TemporaryDirectory(prefix="brickservo-") as folder:
            file = Path(folder) / "drawing.job"
            plan.write_job(file)
            job = file.read_bytes()
        return placed._replace(
            strokes=len(plan.strokes),
            cm=plan.cm,
            seconds=plan.estimate.seconds,
            notes=(*plan.pen_lines(), *self._artwork.left_out, *plan.notes),
            job=job,
        )


def read(source: Source) -> Artwork:
    """Return the Artwork of a source.

    Raises:
        ArmError: it is none.
    """
    if source.kind == "text":
        return lettering.write_text(source.data.decode("utf-8"), Lettering(align="centre"))
    if source.kind == "gallery":
        if source.name not in gallery():  # else any file here could be asked for
            known = ", ".join(gallery())
            raise ArmError(f"there is no drawing {source.name} here; choose one of {known}")
        return read_source(source.name, source.name)
    if source.path is not None:
        # A sheet's right is the arm's -y, and up on it is the arm's x.
        sheet = np.column_stack([-source.path[:, 1], source.path[:, 0]])
        return Artwork(source.name, (sheet,), ("",))
    return read_source(source.data, source.name, None, source.tracing, bool(source.is_hatched))


def compare(wish: Lines, ink: Lines) -> Deviation:
    """Return how far the ink's points are from the wish's lines; both (n, 2), cm."""
    lines = np.vstack([np.column_stack([line[:-1], line[1:]]) for line in wish if len(line) > 1])
    points = np.vstack(ink)
    start, path = lines[:, :2], lines[:, 2:] - lines[:, :2]
    length = np.maximum((path**2).sum(axis=1), 1e-12)
    nearest = np.empty(len(points))
    chunk = max(1, 1_000_000 // len(lines))  # all at once would take too much memory
    for first in range(0, len(points), chunk):
        part = points[first : first + chunk, None, :]
        share = np.clip(((part - start) * path).sum(axis=2) / length, 0.0, 1.0)
        off = part - (start + share[..., None] * path)
        nearest[first : first + chunk] = np.sqrt((off**2).sum(axis=2).min(axis=1))
    nearest *= 10
    return Deviation(float(nearest.max()), float(np.sqrt((nearest**2).mean())), len(points), ink)
