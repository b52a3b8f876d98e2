"""Snapshots of a drawing that the page receives: what, where it lies, how the brick gets on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from laptop.drawing.pictures import Tracing
from laptop.drawing.xml_guard import is_svg
from laptop.page.marker_height import MarkerHeight
from laptop.page.table_mapping import TableView
from laptop.system.picture_heads import is_picture

Lines = tuple[np.ndarray, ...]
"""Lines of points (n, 2), cm, in the arm's coordinates."""


class Source(NamedTuple):
    """Source of a drawing.

    kind     "file", "text", "gallery", "path" (dragged in a picture)
    name     for people; of a gallery's drawing its key
    data     of a file or a text, as UTF-8
    path     of what was dragged (n, 2), cm, in the arm's coordinates
    tracing  how a picture, PNG or JPEG, is drawn; None: it is none
    is_hatched  whether areas of an SVG are hatched; None: it is none
    """

    kind: str
    name: str
    data: bytes = b""
    path: np.ndarray | None = None
    tracing: Tracing | None = None
    is_hatched: bool | None = None


def file_source(name: str, data: bytes) -> Source:
    """Return the Source of a file: as what it begins, and drawn as by default."""
    tracing = Tracing() if is_picture(data) else None
    is_hatched = False if is_svg(data) else None
    return Source("file", name[:80], data, tracing=tracing, is_hatched=is_hatched)


class Placing(NamedTuple):
    """Placing of a drawing; None: where the arm draws it largest.

    x, y    its centre in the arm's coordinates, cm
    size    its greater side, cm; None: as large as the arm reaches there
    rotate  degrees, counter-clockwise as seen from above
    """

    x: float | None = None
    y: float | None = None
    size: float | None = None
    rotate: float = 0.0


class PlacedDrawing(NamedTuple):
    """A drawing on the table.

    name     for people
    good     lines that can be drawn
    missed   those that cannot
    centre   of it, cm
    size     width and height before it is turned, cm
    rotate   degrees
    notes    sentences for people
    why_not  why it cannot be drawn so, or ""
    strokes, cm, seconds  of the plan; seconds is None while it is planned
    several  of what it has several, so that each may have a pen of its own: "layers", "colours"
    pens     of which each has, or "" for one pen
    job      the job's file, once it is planned; b"" in what browsers get
    """

    name: str
    reachable: Lines
    missed: Lines
    centre: tuple[float, float]
    size: tuple[float, float]
    rotate: float
    notes: tuple[str, ...] = ()
    why_not: str = ""
    strokes: int = 0
    cm: float = 0.0
    seconds: float | None = None
    several: tuple[str, ...] = ()
    pens: str = ""
    job: bytes = b""


class Deviation(NamedTuple):
    """Deviation of the tip from the wish while the pen was down, mm, as the camera saw it.

    points  number of places where it was seen
    ink     these, lines of points (n, 2), cm
    """

    greatest: float
    rms: float
    points: int
    ink: Lines


class Request(NamedTuple):
    """Request: a drawing is read, unless it is the one of before, and placed.

    number  of the source, by which it is told whether it is the one of before, drawn as before
    height  of the paper, cm
    pens    "layers" or "colours", of which each has a pen of its own; "": one pen draws all
    wish    lines (n, 2), cm, with `ink`: how far one is from the other; then nothing else is done
    """

    number: int
    source: Source | None
    placing: Placing = Placing()
    height: float = 0.0
    pens: str = ""
    wish: Lines = ()
    ink: Lines = ()


class NothingShown(str):
    """Reason why nothing was drawn of a picture that may be drawn if it is traced otherwise."""


Answer = PlacedDrawing | Deviation | str
"""A drawing, placed and then planned; a deviation; or why it was not done."""


class JobState(NamedTuple):
    """State of a job on the brick.

    name     for people
    state    one of shared.job_messages.STATES
    share    of its length that is drawn, or of its file that is fetched: 0 to 1
    stroke, strokes, cm, cm_all, seconds, reason  as in shared.job_messages.JobStatus
    is_on    it has not ended
    """

    name: str
    state: str
    share: float
    stroke: int
    strokes: int
    cm: float
    cm_all: float
    seconds: float | None
    reason: str
    is_on: bool


class DrawingState(NamedTuple):
    """State of the drawing on the page.

    revision   rises whenever `DrawCalls.drawing` would answer otherwise
    is_there   there is one
    busy       what is done to it just now, in words, or ""
    trouble    why the last thing that was asked was not done, or ""
    unmapped   per camera why its pixels are not known in cm; {} of those that are known
    misfit     greatest of the known cameras, mm, or None
    source     what it is known by, in words, or ""
    is_on_paper  these are of the paper, not of the plane above it in which the marker rides
    marker     its height over the paper
    asks_height  that height counts: the arm moves in a plane
    job        of the brick, or None
    can_start  it can be drawn now
    tracing    how the picture that was asked for is drawn; None: it is none
    is_hatched  whether areas of the SVG that was asked for are hatched; None: it is none
    """

    revision: int = 0
    is_there: bool = False
    busy: str = ""
    trouble: str = ""
    unmapped: Mapping[str, str] = {}
    misfit: float | None = None
    source: str = ""
    is_on_paper: bool = False
    marker: MarkerHeight = MarkerHeight()
    asks_height: bool = False
    job: JobState | None = None
    can_start: bool = False
    tracing: Tracing | None = None
    is_hatched: bool | None = None


class DrawingSnapshot(NamedTuple):
    """All that browsers draw of a drawing.

    placed     None: there is none
    views      per camera where the table is in its picture; those that are not known are missing
    deviation  of the last job, once it has ended and was seen
    """

    placed: PlacedDrawing | None
    views: Mapping[str, TableView]
    deviation: Deviation | None = None


class InkPoint(NamedTuple):
    """A place of the tip with the pen down, (u, v) px; `begins`: a line begins here."""

    u: float
    v: float
    begins: bool
