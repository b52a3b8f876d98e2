"""All that a page can see and do: the narrow door between the tracker and whoever looks at it.

The tracker's process has a `Desk`; a page, in a process of its own, has a `Door` to it and asks.
Nothing is pushed: who does not ask costs nothing, and no camera ever waits for a page.  Orders
answer with "", or in one line with the reason why not.
"""

from __future__ import annotations

import math
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np

from laptop.page.record import EFFECTOR, Record, Recorder, Summary
from laptop.tracking.server import State as LinkState
from laptop.tracking.watching import GOAL, Point, Watcher
from laptop.vision.frames import Frame
from laptop.vision.learning import exclude, include, learn
from laptop.vision.markers import BadMarker, Marker, gate, read_markers, write_markers
from laptop.vision.stills import Stills
from laptop.vision.tracker import BELIEVED, Tracker, Window
from laptop.vision.view import View
from shared.arm_description import ArmError
from shared.messages import BUDGET, MAX_MARKERS, TOLERANCE, Start, Status, Stop
from shared.orders import check

USUAL = Start()
"""What is ordered unless something else is said."""
LOW = 6.5
"""A battery below this, V, is soon empty: the brick warns of a rechargeable one from here on."""

BEAT = 0.05
"""Between two looks at what goes on, s."""
SAMPLE = 0.2
"""Between two samples of the history, s."""
HISTORY = 60.0
"""So much of it is kept, s."""
KEPT = 64
"""Pictures of each camera that stay at hand after they were given out, so that one can pick: those
of some seconds, for a browser that is late."""
PINNED = 4
"""Of each camera, pictures that are paused at."""
STILLS = 8
"""Frames of a recording that stay at hand; others are read again."""
UNDONE = 50
"""Changes of colours that can be taken back."""
AWAY = 5.0
"""Who has asked nothing for so long, s, has closed the page."""
SOON = 60.0
"""A browser that was told to open the page may take so long, s."""
GONE = 25.0
"""A brick that is not back so long after, s, has given its run up: it holds for 20 s."""
ANSWER = 3.0
"""A brick that has not begun so long after a start, s, does not."""
FINEST = 2.0
"""The tip's trail goes on where it has moved so far, px."""
APART = 25.0
"""Between two points of a path, px."""
QUALITY = 80
"""Of a JPEG."""

ADVICE = {
    "several alike": "cover the others, or pick this one's colour anew",
    "nothing of this colour is a disc": "turn it to the camera, uncover it, or pick it anew",
    "nothing of this colour is a ball": "uncover it, or pick it anew",
    "too dark": "give more light, or a longer exposure",
    "nothing of this colour": "bring it into the picture, or pick it anew: the light may differ",
}
"""What to do about a marker that is lost, by the tracker's reason."""

VERDICTS = {
    "": "On its way.",
    "ready": "Ready. Aim, then start.",
    "converged": "Arrived: the tip is at the goal.",
    "unreachable": "Out of reach: the arm cannot get there. Aim nearer to its base.",
    "marker lost": "The marker is lost. Uncover it, or pick its colour anew; then start again.",
    "singular": "The joints cannot move the tip that way from here. Aim elsewhere, or start from "
    "another posture.",
    "limit": "A joint is at its limit. Aim elsewhere.",
    "stalled": "A motor is blocked. Free the arm, then start again.",
    "too slow": "The brick is too slow. End other programs on it; then start again.",
    "link lost": "The link was lost. Look at the cable or Wi-Fi; then start again.",
    "budget spent": "Not there in time. Look at camera and light, or allow a greater tolerance.",
    "stopped": "Stopped. The arm is held.",
    "refused": "The brick refused these orders.",
}
"""The brick's verdicts, for people."""


class Mark(NamedTuple):
    """A marker in one picture.

    u, v, radius   px; u is None where it was not seen
    confidence     0 to 1; None of a fixed goal
    why, advice    why it is lost or doubted, and what to do; "" where it is seen
    window         where it was looked for first, px; None: in the whole picture
    """

    name: str
    u: float | None
    v: float | None
    radius: float | None
    confidence: float | None
    why: str
    advice: str
    window: Window | None


class Shown(NamedTuple):
    """One picture with what belongs to it.

    index, t       the frame's; t is its capture time, s
    age            s, when this was answered
    width, height  px
    jpeg           the picture
    marks          per marker
    aim            where the tip is to go, (u, v) px; None: to the goal's marker
    ahead          the points of a path that come next, (u, v) px
    trail          where the tip has been lately, (u, v) px
    masks          per marker that was asked for: a PNG, opaque where its colour is
    """

    camera: str
    index: int  # type: ignore[assignment]  # hides tuple.index, which nobody needs here
    t: float
    age: float
    width: int
    height: int
    jpeg: bytes
    marks: tuple[Mark, ...]
    aim: Point | None
    ahead: tuple[Point, ...]
    trail: tuple[Point, ...]
    masks: Mapping[str, bytes]


class Eye(NamedTuple):
    """How a camera is doing.

    rate     frames per second
    age      s
    trouble  in words, or ""
    frames   of a recording, each of which can be looked at; 0: it is none
    ended    there are no more to come
    """

    camera: str
    source: str
    rate: float
    dropped: int
    age: float | None
    trouble: str
    frames: int = 0
    ended: bool = False


class State(NamedTuple):
    """How everything is doing.

    brick     its address, or None
    commands  what to type on the brick
    round_trip  s, or None
    status    the brick's last, or None
    running   a run is on, or was ordered
    following it goes after a goal that moves, as was ordered here
    aims      per camera where the tip is to go, px; {}: to the goal's marker
    left      points of a path still to come
    markers   name: what it looks like, in words
    undoable  how many changes of colours can be taken back
    file      where colours are kept
    note      what was last to be said about the link or the run, or ""
    own       the brick is an emulated one that came with the camera
    fixed     the command line has fixed the goal
    runs      of which there can be a report, oldest first
    """

    eyes: tuple[Eye, ...]
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
    runs: tuple[Summary, ...]


class Sample(NamedTuple):
    """One moment of the history; t in s, error in px, q in rad, ages in s, rates per s."""

    t: float
    error: float | None
    e: Mapping[str, float]
    q: tuple[float, ...]
    condition: float | None
    moves: int
    ages: Mapping[str, float | None]
    rates: Mapping[str, float]


class Finder(Protocol):
    """What is used of a tracker."""

    markers: tuple[Marker, ...]


class Server(Protocol):
    """What is used of the tracking server."""

    def send(self, message: Start | Stop) -> bool: ...  # noqa: D102
    def state(self) -> LinkState: ...  # noqa: D102
    def commands(self) -> list[str]: ...  # noqa: D102


def points(count: int) -> str:
    """Of a path, for people."""
    return f"{count} point{'s' * (count != 1)}"


class _Gone(ArmError):
    """A picture that is no longer at hand."""


class _Change(NamedTuple):
    """What there was before a change: the markers that were tracked, and those in the file."""

    tracked: Mapping[str, Marker]
    kept: Mapping[str, Marker]


class _Watched:
    """A watcher, its tracker, and what the desk keeps of them."""

    def __init__(self, watcher: Watcher, tracker: Finder, source: str) -> None:
        self.watcher = watcher
        self.tracker = tracker
        self.source = source
        self.given: deque[View] = deque(maxlen=KEPT)
        self.pinned: deque[View] = deque(maxlen=PINNED)
        self.encoded: tuple[int, bytes] | None = None
        self.trail: deque[tuple[float, Point]] = deque(maxlen=round(HISTORY / BEAT))
        self.counts: deque[tuple[float, int]] = deque(maxlen=round(2.0 / SAMPLE))
        self.rate = 0.0
        # (What lies on a server would all have to be fetched again.)
        count = getattr(watcher.camera, "count", None)
        self.frames: int = 0 if "://" in source else count or 0
        self._reel: Stills | None = None
        self._stills: deque[Frame] = deque(maxlen=STILLS)
        self._lock = threading.Lock()  # of these two

    def note(self) -> None:
        """Where the tip is now."""
        view = self.watcher.view
        seen = view and view.found.get(EFFECTOR)
        if view and seen and seen.confidence >= BELIEVED:
            where = seen.u, seen.v
            if not self.trail or math.dist(self.trail[-1][1], where) >= FINEST:
                self.trail.append((view.frame.t, where))

    def count(self, now: float) -> None:
        """How many frames there were until now (s)."""
        self.counts.append((now, self.watcher.frames))
        before, frames = self.counts[0]
        self.rate = (self.watcher.frames - frames) / (now - before) if now > before else 0.0

    def find(self, index: int) -> View:
        """The picture of a frame that was given out.

        Raises:
            _Gone: it was too long ago.
        """
        for view in (*self.pinned, *self.given):
            if view.frame.index == index:
                return view
        raise _Gone("this picture is too old; click into a newer one, or pause first")

    def frame(self, index: int) -> Frame:
        """A frame that was given out, or any of a recording.

        Raises:
            ArmError: it is not to be had.
        """
        try:
            return self.find(index).frame
        except _Gone:
            if not self.frames:
                raise
        with self._lock:
            for still in self._stills:
                if still.index == index:
                    return still
            return self._read(index)

    def _read(self, index: int) -> Frame:
        """From the source, which is opened a second time."""
        if not 0 <= index < self.frames:
            raise _Gone(f"frame {index}: {self.source} has frames 0 to {self.frames - 1}")
        camera = self.watcher.camera
        self._reel = self._reel or Stills(self.source)
        image = self._reel.read(index)
        if image is None:
            raise _Gone(f"frame {index} of {self.source} cannot be read; take another one")
        # Its time on the clock of those that were tracked.
        t = 0.0
        if (view := self.watcher.view) and camera.fps:
            t = view.frame.t + (index - view.frame.index) / camera.fps
        self._stills.append(Frame(index, t, image))
        return self._stills[-1]

    def jpeg(self, view: View) -> bytes:
        """Of one picture; encoded once, however many look."""
        encoded = self.encoded
        if encoded is None or encoded[0] != view.frame.index:
            _, data = cv2.imencode(".jpg", view.frame.image, (cv2.IMWRITE_JPEG_QUALITY, QUALITY))
            self.encoded = encoded = view.frame.index, data.tobytes()
        return encoded[1]


class Desk:
    """What goes on, and what can be done about it.

    Its methods without an underscore may be called from any thread, and through a `Door`.

    Args:
        watchers: one for each camera.
        trackers: theirs, in the same order.
        sources: what people call the cameras, in the same order.
        server: of the brick, or None.
        file: where learned colours are kept.
        bring: starts an emulated brick when somebody opens the page and none is there; it gives
            what tells why that one has ended, "" as long as it has not.  Or None.
        now: the clock of the frames, s.
    """

    def __init__(
        self,
        watchers: Sequence[Watcher],
        trackers: Sequence[Finder],
        sources: Sequence[str],
        server: Server | None,
        file: Path,
        bring: Callable[[], Callable[[], str]] | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._cameras = {
            watcher.name: _Watched(watcher, tracker, source)
            for watcher, tracker, source in zip(watchers, trackers, sources, strict=True)
        }
        self._server = server
        self._file = file
        self._bring = bring
        self._now = now
        self._own: Callable[[], str] | None = None  # why the brick that came along has ended
        self._asked = -math.inf
        self._before: deque[_Change] = deque(maxlen=UNDONE)
        self._aims: dict[str, Point] = {}
        self._path: deque[Point] = deque()
        self._along = ""  # the camera in which the path was drawn
        self._orders = USUAL
        self._ordered: tuple[float, int] | None = None  # when, and the brick's last run by then
        self._awaited = 0  # the run that the rest of a path waits for; 0: none
        self._order = 0  # number of the last start from here
        self._obeyed: tuple[int, int] | None = None  # that number, and the brick's last run by then
        self._note = ""
        self._stopping = ""  # why, until the brick has heard it
        self._stop_told: Status | None = None  # the brick's status when it was last told
        self._linked = now()  # when a brick was last there
        self._recorder = Recorder()
        self._history: deque[Sample] = deque(maxlen=round(HISTORY / SAMPLE))
        # One order after the other; what only looks takes no lock.  (To learn a colour takes a
        # while, for which a STOP does not wait.)
        self._lock = threading.RLock()
        self._colours = threading.RLock()

    # See

    @property
    def cameras(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self._cameras)

    def view(
        self, camera: str, newer_than: int = -1, masks: Sequence[str] = (), within: float = 0.0
    ) -> Shown | None:
        """The newest picture of a camera; None if there is none after the frame `newer_than`.

        Args:
            masks: names of markers whose pixels are to be shown, too.
            within: wait so long, s, for one that is new by now; this thread answers nothing else.
        """
        eye = self._cameras[camera]
        if within > 0:
            eye.watcher.wait(within)
        view = eye.watcher.view
        if view is None or view.frame.index <= newer_than:
            return None
        if not eye.given or eye.given[-1] is not view:
            eye.given.append(view)
        return self._shown(eye, view, masks)

    def still(self, camera: str, index: int, masks: Sequence[str] = ()) -> Shown | str:
        """A frame that was given out, or any of a recording, as the markers are looked for now.

        It is looked at by itself: what was known from the frames before it is not used.  To read it
        may take a while, in which this thread answers nothing else.

        Returns:
            the frame; or in one line why it is not to be had.
        """
        eye = self._cameras[camera]
        try:
            frame = eye.frame(index)
        except ArmError as error:
            return str(error)
        tracker = Tracker(eye.tracker.markers)
        found = tracker.find(frame.image, frame.t)
        fixed = eye.watcher.view.fixed if eye.watcher.view else {}
        return self._shown(eye, View(frame, found, tracker.why, fixed, tracker.windows), masks)

    def _shown(self, eye: _Watched, view: View, masks: Sequence[str]) -> Shown:
        camera, frame = eye.watcher.name, view.frame
        height, width = frame.image.shape[:2]
        path = tuple(self._path) if camera == self._along else ()
        return Shown(
            camera,
            frame.index,
            frame.t,
            self._now() - frame.t,
            width,
            height,
            eye.jpeg(view),
            tuple(_marks(view)),
            self._aims.get(camera),
            path,
            tuple(where for t, where in list(eye.trail) if frame.t - HISTORY <= t <= frame.t),
            {
                marker.name: _mask(frame.image, marker)
                for marker in eye.tracker.markers
                if marker.name in masks and marker.color
            },
        )

    def pin(self, camera: str, index: int) -> str:
        """Keep a picture that was given out, for picking in it."""
        try:
            self._cameras[camera].pinned.append(self._cameras[camera].find(index))
        except _Gone as gone:
            return str(gone)
        return ""

    @property
    def watched(self) -> bool:
        """Whether somebody has the page open, or is about to."""
        return self._now() - self._asked < AWAY

    def expect(self) -> None:
        """Somebody is about to open the page."""
        self._asked = self._now() + SOON - AWAY

    def state(self) -> State:
        """How everything is doing."""
        self._asked = self._now()
        link = self._server.state() if self._server else LinkState()
        running = self._running(link)
        with self._lock:
            runs = self._recorder.summaries()
        return State(
            tuple(self._eye(name, eye) for name, eye in self._cameras.items()),
            link.client,
            tuple(self._server.commands() if self._server else ()),
            link.round_trip,
            link.status,
            running,
            running and self._obeyed is not None and self._orders.follow,
            dict(self._aims),
            len(self._path),
            {marker.name: str(marker) for marker in self._markers()},
            len(self._before),
            str(self._file),
            "; ".join(filter(None, ("" if link.client else link.lost or link.refusal, self._note))),
            self._own is not None,
            self._is_fixed(),
            runs,
        )

    def history(self, after: float = -math.inf) -> list[Sample]:
        """The last minute, or what of it is later than `after` (s)."""
        return [sample for sample in list(self._history) if sample.t > after]

    def record(self, number: int | None = None) -> Record | None:
        """What is known of a run, the newest by default; None if there is none of this number."""
        with self._lock:
            return self._recorder.record(number)

    def _eye(self, name: str, eye: _Watched) -> Eye:
        watcher = eye.watcher
        ended = "ended" if watcher.ended else ""
        trouble = watcher.trouble or ended or watcher.silence or watcher.slowness
        return Eye(
            name, eye.source, eye.rate, watcher.dropped, watcher.age, trouble, eye.frames,
            watcher.ended,
        )  # fmt: skip

    # Colours

    def pick(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Learn a marker's colour at a pixel (u, v), or in a rectangle (u0, v0, u1, v1), px.

        Args:
            name: an old marker's or a new one's.
            index: of the frame, one that was given out.
        """
        if why := _bad_name(name):
            return why
        names = [marker.name for marker in self._markers()]
        if name not in names and len(names) >= MAX_MARKERS - 1:
            return f"{len(names)} markers are all that can be tracked; pick one of them anew"
        return self._change(name, camera, index, lambda old, image: learn(name, image, (*where,)))

    def add(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Add what is at a pixel or in a rectangle to a marker's colour, see `pick`."""
        return self._change(
            name, camera, index, lambda old, image: include(_known(old, name), image, (*where,))
        )

    def remove(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """Remove what is at a pixel or in a rectangle from a marker's colour, see `pick`."""
        return self._change(
            name, camera, index, lambda old, image: exclude(_known(old, name), image, (*where,))
        )

    def rename(self, name: str, new: str) -> str:
        """Give a marker another name; one that has that name already is forgotten."""
        if why := _bad_name(new):
            return why
        with self._colours:
            markers = {marker.name: marker for marker in self._markers()}
            if name not in markers:
                return f"marker '{name}': there is none of this name"
            marker = markers.pop(name)
            return self._look_for({**markers, new: replace(marker, name=new)})

    def undo(self) -> str:
        """Take the last change of a colour back."""
        with self._colours:
            if not self._before:
                return "there is nothing to undo"
            before = self._before.pop()
            why = self._look_for(dict(before.tracked), before.kept)
            self._before.pop()
            return why

    def _change(
        self,
        name: str,
        camera: str,
        index: int,
        change: Callable[[Marker | None, np.ndarray], Marker],
    ) -> str:
        try:
            image = self._cameras[camera].frame(index).image
            with self._colours:
                markers = {marker.name: marker for marker in self._markers()}
                return self._look_for({**markers, name: change(markers.get(name), image)})
        except ArmError as error:
            return str(error)

    def _look_for(
        self, markers: dict[str, Marker], once: Mapping[str, Marker] = MappingProxyType({})
    ) -> str:
        """Track these markers from now on, and keep them; those that are not tracked any more go.

        Args:
            once: in the file if they go.
        """
        tracked = {marker.name: marker for marker in self._markers()}
        kept: dict[str, Marker] = {}
        trouble = ""
        try:
            kept = read_markers(self._file) if self._file.exists() else {}
            others = {name: marker for name, marker in kept.items() if name not in tracked}
            gone = {name: once[name] for name in tracked if name in once}
            # Of those that stay as they are the file may know better than this camera's scene.
            same = {name for name, marker in markers.items() if tracked.get(name) == marker}
            stay = {name: kept[name] for name in same if name in kept}
            new = {name: marker for name, marker in markers.items() if name not in same}
            write_markers(self._file, {**others, **gone, **stay, **new})
        except BadMarker as error:
            trouble = f"tracked, but not kept: {error}"
        self._before.append(_Change(tracked, kept))
        for eye in self._cameras.values():
            eye.tracker.markers = tuple(markers.values())
        return trouble

    def _markers(self) -> tuple[Marker, ...]:
        return next(iter(self._cameras.values())).tracker.markers

    # Aim

    def aim(self, camera: str, u: float, v: float) -> str:
        """Let the goal be a pixel of a camera."""
        return self._aim(camera, [(u, v)])

    def aim_at_marker(self) -> str:
        """Let the goal be the goal's marker."""
        with self._lock:
            if self._running():
                return _BUSY
            self._aims, self._path, self._along, self._note = {}, deque(), "", ""
            return ""

    def follow(self, camera: str, points: Sequence[Point]) -> str:
        """Let the goal be a path, point after point, in the picture of the only camera."""
        if len(self._cameras) > 1:
            return "a path is drawn in one picture; with several cameras aim at a point in each"
        return self._aim(camera, _thinned(points))

    def _aim(self, camera: str, points: Sequence[Point]) -> str:
        with self._lock:
            if self._running():
                return _BUSY
            view = self._cameras[camera].watcher.view
            if view is None:
                return f"camera {camera} gives no picture to aim in; look at its cable"
            height, width = view.frame.image.shape[:2]
            for u, v in points:
                if not (0 <= u <= width - 1 and 0 <= v <= height - 1):
                    return (
                        f"goal {u:.0f},{v:.0f} is outside the picture; u from 0 to {width - 1}, "
                        f"v from 0 to {height - 1}"
                    )
            self._note = ""
            first, *others = points
            self._aims[camera] = first
            self._path = deque(others)
            self._along = camera if others else ""
            return ""

    # Drive

    def start(
        self,
        method: str = USUAL.method,
        mode: str = USUAL.mode,
        rows: str = USUAL.rows,
        tolerance: float = USUAL.tolerance,
        budget: float = USUAL.budget,
        follow: bool = USUAL.follow,
    ) -> str:
        """Send the tip to the goal, or on along the path; the orders are as in `Start`."""
        for what, value, (least, most, unit) in (
            ("tolerance", tolerance, TOLERANCE), ("budget", budget, BUDGET),
        ):  # fmt: skip
            if not least <= value <= most:
                return f"{what} {value:g}: from {least:g} to {most:g} {unit}"
        with self._lock:
            if self._running():
                return _BUSY
            if why := self._not_aimed():
                return why
            orders = Start(method, mode, rows, tolerance, budget, follow, dict(self._aims))
            try:
                check(orders, self._joints())
            except ArmError as error:
                return str(error)
            self._orders = orders
            self._order += 1
            return self._send_start()

    def hold(self) -> str:
        """End the run; the arm is held where it is, and a start goes on from there."""
        with self._lock:
            self._awaited = 0
            return self._send_stop("held from the page")

    def stop(self) -> str:
        """End the run; the arm is held, and a path is given up."""
        with self._lock:
            self._awaited = 0
            self._path, self._along, self._note = deque(), "", ""
            return self._send_stop("stopped from the page")

    def _send_stop(self, reason: str) -> str:
        """Stop, and go on saying so until the brick tells that no run is on."""
        self._ordered = None
        self._stopping, self._stop_told = reason, None
        if self._server and self._server.send(Stop(reason)):
            return ""
        return "no brick is connected; it is stopped as soon as it is back"

    def _insist(self, status: Status) -> None:
        """A stop gets lost with the link, behind which a run may go on by itself."""
        assert self._server is not None
        if status.verdict:
            self._stopping = ""
        elif status is not self._stop_told:
            self._stop_told = status
            self._server.send(Stop(self._stopping))

    def _joints(self) -> int:
        """How many the brick's arm has; 0 while that is not known."""
        status = self._server.state().status if self._server else None
        return len(status.q) if status else 0

    def _is_fixed(self) -> bool:
        """Whether the command line has fixed the goal."""
        return all(
            bool(eye.watcher.view and eye.watcher.view.fixed) for eye in self._cameras.values()
        )

    def _not_aimed(self) -> str:
        """Why there is no goal, or ""."""
        if self._aims:
            missing = [name for name in self._cameras if name not in self._aims]
            if missing:
                return f"click the goal in the picture of camera {' and '.join(missing)}, too"
            return ""
        if not self._is_fixed() and GOAL not in (marker.name for marker in self._markers()):
            return "there is no goal yet; click one in the picture, or pick a goal marker"
        return ""

    def _send_start(self) -> str:
        link = self._server.state() if self._server else LinkState()
        if self._server is None or link.client is None:
            return "no brick is connected; type the command below on it"
        run = link.status.run if link.status else 0
        self._orders = self._orders._replace(goals=dict(self._aims))
        if not self._server.send(self._orders):
            return "the link has just broken; it mends by itself, then start again"
        self._stopping = ""
        self._ordered = self._now(), run
        self._obeyed = self._order, run
        self._awaited = run + 1 if self._path else 0
        self._note = ""
        return ""

    def _running(self, link: LinkState | None = None) -> bool:
        if self._server is None:
            return False
        link = link or self._server.state()
        if link.client is None:
            return False
        ordered, status = self._ordered, link.status
        if ordered and (status is None or status.run <= ordered[1]):
            return self._now() - ordered[0] < ANSWER
        return status is not None and (status.verdict == "" or self._goes_on(status))

    def _goes_on(self, status: Status) -> bool:
        """Whether a run has ended where the next point of a path is due."""
        arrived = status.run == self._awaited and status.verdict == "converged"
        return arrived and bool(self._path)

    # Beats

    def beat(self) -> None:
        """Look once at what goes on; to be called every BEAT s."""
        for eye in self._cameras.values():
            eye.note()
        now = self._now()
        if not self._history or now - self._history[-1].t >= SAMPLE - BEAT / 2:
            self._sample(now)
        with self._lock:
            self._record()
            self._go_on()
            self._mind_own()

    def opened(self) -> None:
        """Somebody opens the page, which takes a slow browser a while.

        An emulated brick comes, if there is one to come and no other there.
        """
        self.expect()
        with self._lock:
            missing = self._server and self._server.state().client is None and not self._own
            if self._bring and missing:
                try:
                    self._own = self._bring()
                except OSError as error:
                    self._note = f"no emulated brick: {error.strerror}: {error.filename}"

    def _sample(self, now: float) -> None:
        link = self._server.state() if self._server else LinkState()
        status = link.status
        ages, rates = {}, {}
        for name, eye in self._cameras.items():
            eye.count(now)
            ages[name], rates[name] = eye.watcher.age, eye.rate
        self._history.append(
            Sample(
                now,
                status and status.error,
                dict(status.e) if status else {},
                tuple(status.q) if status else (),
                status and status.condition,
                status.moves if status else 0,
                ages,
                rates,
            )
        )

    def _record(self) -> None:
        """What is to be kept of a run."""
        link = self._server.state() if self._server else LinkState()
        status = link.status
        if link.client and status:
            order, before = self._obeyed or (0, status.run)
            ours = status.run > before
            t = self._now() - (link.status_age or 0.0)
            orders = self._orders if ours else None
            self._recorder.hear(status, t, link.client, order if ours else 0, orders)
            if ours and status.verdict:
                self._obeyed = None
        if link.client:
            self._linked = self._now()
        elif self._now() - self._linked > GONE:
            self._recorder.lose(self._now())
        self._recorder.see({name: eye.watcher.view for name, eye in self._cameras.items()})

    def _mind_own(self) -> None:
        """Tell of an emulated brick that has ended."""
        if self._own and self._server and not self._server.state().client and (why := self._own()):
            self._own = None
            told = f"{why}; load the page anew for another one"
            self._note = "; ".join(filter(None, (self._note, told)))

    def _go_on(self) -> None:
        """What is due after a run: the next point of a path."""
        if self._server is None:
            return
        link = self._server.state()
        status = link.status
        if self._stopping and link.client and status:
            self._insist(status)
        if self._ordered and not self._running(link):
            if link.client and (status is None or status.run <= self._ordered[1]):
                self._note = "the brick did not begin; does its program run with --wait?"
                self._awaited = 0
                self._obeyed = None
            self._ordered = None
        over = status is not None and status.run >= self._awaited and status.verdict
        if not self._awaited or (link.client and not over):
            return
        if link.client and status and self._goes_on(status):
            self._aims[self._along] = self._path.popleft()
            self._awaited = 0
            self._note = self._send_start()
        else:
            self._awaited = 0
            self._note = f"the path ends here, {points(len(self._path))} before its end"


def _bad_name(name: str) -> str:
    """Why a marker cannot be called that, or ""."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,32}", name):
        return ""
    return f"marker '{name[:40]}': name it with 1 to 32 of A-Z a-z 0-9 _ -"


_BUSY = "a run is on; hold or stop it first"


def _known(marker: Marker | None, name: str) -> Marker:
    if marker is None:
        raise BadMarker(f"{name} has not been picked yet; pick it first")
    return marker


def _marks(view: View) -> list[Mark]:
    """What was found in a picture, and where the fixed goal is."""
    marks = []
    for name, seen in view.found.items():
        window = view.windows.get(name)
        if seen is None:
            why = view.why.get(name) or "not seen"
            marks.append(Mark(name, None, None, None, 0.0, why, _advice(why), window))
        else:
            why = view.why.get(name) or ("doubtful" if seen.confidence < BELIEVED else "")
            u, v, confidence, radius = seen
            marks.append(Mark(name, u, v, radius, confidence, why, _advice(why), window))
    for name, (u, v, _) in view.fixed.items():
        marks.append(Mark(name, u, v, None, None, "", "", None))
    return marks


def _advice(why: str) -> str:
    if why.startswith("no ArUco"):
        return "bring it into the picture, all of its white border, too"
    if why == "doubtful":
        return "something else may look like it; pick its colour anew"
    return ADVICE.get(why, "")


def _mask(image: np.ndarray, marker: Marker) -> bytes:
    """A PNG, magenta where the picture has the marker's colour, and transparent elsewhere."""
    assert marker.color is not None
    inside = gate(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), marker.color)
    layer = np.full((*inside.shape, 4), (255, 60, 255, 0), np.uint8)
    layer[..., 3] = inside
    _, data = cv2.imencode(".png", layer, (cv2.IMWRITE_PNG_COMPRESSION, 1))
    return data.tobytes()


def _thinned(points: Sequence[Point]) -> list[Point]:
    """The points of a path, no two closer than APART but the last one."""
    kept = [points[0]]
    for point in points[1:]:
        if math.dist(kept[-1], point) >= APART:
            kept.append(point)
    if len(kept) > 1 and math.dist(kept[-1], points[-1]) < APART / 2:
        kept[-1] = points[-1]
    elif kept[-1] != points[-1]:
        kept.append(points[-1])
    return kept


# The door


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


def keep_beating(desk: Desk, over: threading.Event) -> None:
    """Let a desk look at what goes on until it is over; for a thread of its own."""
    while not over.wait(BEAT):
        desk.beat()
