"""Snapshots that the page receives: the state of everything, one frame, one point of the plots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from laptop.page.drawing_snapshots import DrawingState
from laptop.page.run_records import RunSummary
from laptop.see.markers.tracks import Window
from laptop.see.markers.view import BoardPlace
from laptop.see.serve.pipeline import Point
from shared.messages import Start, Status

DEFAULTS = Start()
"""Orders of a run where the page changes nothing."""
LOW_BATTERY = 6.5
"""Battery voltage, V, below which it is soon empty: the brick warns of a rechargeable one there."""
SAMPLE_PERIOD = 0.2
"""Time between two samples of the plots, s."""
HISTORY_DURATION = 60.0
"""Length of the plots and of the tip's trail, s."""


class MarkerSnapshot(NamedTuple):
    """One marker in one frame.

    u, v, radius   px; u is None where it was not seen
    confidence     0 to 1; None of a fixed goal
    why, advice    why it is lost or doubted, and what to do; "" where it is seen
    window         where it was looked for first, px; None: in the whole picture
    place          where it is on the board; None: that is not known
    """

    name: str
    u: float | None
    v: float | None
    radius: float | None
    confidence: float | None
    why: str
    advice: str
    window: Window | None
    place: BoardPlace | None = None


class FrameSnapshot(NamedTuple):
    """One frame with everything that is drawn over it.

    index, t       the frame's; t is its capture time, s
    age            s, when this was answered
    taken          when that was so long ago, s of time.monotonic, which is this machine's
    width, height  px
    jpeg           the picture
    marks          per marker
    aim            where the tip is to go, (u, v) px; None: to the goal's marker
    ahead          the points of a path that come next, (u, v) px
    trail          where the tip has been lately, (u, v) px
    masks          per marker that was asked for: a PNG, opaque where its colour is
    hint           where the goal must be by another camera's aim: two ends of a line or a place, px
    """

    camera: str
    index: int  # type: ignore[assignment]  # hides tuple.index, which nobody needs here
    t: float
    age: float
    taken: float
    width: int
    height: int
    jpeg: bytes
    marks: tuple[MarkerSnapshot, ...]
    aim: Point | None
    ahead: tuple[Point, ...]
    trail: tuple[Point, ...]
    masks: Mapping[str, bytes]
    hint: tuple[Point, ...] = ()


class CameraStatus(NamedTuple):
    """State of a camera.

    rate     frames per second
    age      of the newest frame, s
    trouble  in words, or ""
    frames   of a recording, each of which can be looked at; 0: it is none
    ended    there are no more to come
    """

    name: str
    source: str
    rate: float
    dropped: int
    age: float | None
    trouble: str
    frames: int = 0
    ended: bool = False


class PageState(NamedTuple):
    """State of cameras, link, run and colours.

    brick     its address, or None
    commands  what to type on the brick
    round_trip  s, or None
    status    the brick's last, or None
    running   a run is on, or was ordered
    following it goes after a goal that moves, as was ordered here
    aims      per camera where the tip is to go, px; {}: to the goal's marker
    left      points of a path still to come
    markers   name: what it looks like, in figures
    undoable  how many changes of colours can be taken back
    file      where colours are kept
    note      what was last to be said about the link or the run, or ""
    own       the brick is an emulated one that came with the camera
    fixed     the command line has fixed the goal
    runs      of which there can be a report, oldest first
    driver    number of the browser that steers; 0: nobody does yet
    driver_name  its name for people, or ""
    can_call  a click would have the real brick run its program
    drawing   on the page
    looks     of each marker, by name: what it looks like, in words
    """

    cameras: tuple[CameraStatus, ...]
    brick: str | None
    commands: tuple[str, ...]
    round_trip: float | None
    status: Status | None
    running: bool
    following: bool
    aims: Mapping[str, Point]
    left: int
    markers: Mapping[str, str]
    undoable: int
    file: str
    note: str
    own: bool
    fixed: bool
    runs: tuple[RunSummary, ...]
    driver: int = 0
    driver_name: str = ""
    can_call: bool = False
    drawing: DrawingState = DrawingState()
    marker_descriptions: Mapping[str, str] = {}


class PlotSample(NamedTuple):
    """One point of the plots: t in s, error and e in px, q in rad, ages in s, rates per s."""

    t: float
    error: float | None
    e: Mapping[str, float]
    q: tuple[float, ...]
    condition: float | None
    moves: int
    ages: Mapping[str, float | None]
    rates: Mapping[str, float]


def points(count: int) -> str:
    """Return a number of points in words."""
    return f"{count} point{'s' * (count != 1)}"
