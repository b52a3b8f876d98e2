"""All that a page can see and do: the narrow door between the tracker and whoever looks at it.

The tracker's process has a `Desk`; a page, in a process of its own, asks it through a `Door`.
Nothing is pushed: who does not ask costs nothing, and no camera ever waits for a page.  Orders
answer with "", or in one line with the reason why not.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

from laptop.page.camera_feed import BEAT, CameraFeed, Finder, PictureGone, marks, mask
from laptop.page.colour_edits import ColourEdits
from laptop.page.record import Record, Recorder
from laptop.page.snapshots import HISTORY, SAMPLE, USUAL, Eye, Sample, Shown, State, points
from laptop.tracking.server import State as LinkState
from laptop.tracking.watching import GOAL, Point, Watcher
from laptop.vision.tracker import Tracker
from laptop.vision.view import View
from shared.arm_description import ArmError
from shared.messages import BUDGET, TOLERANCE, Start, Status, Stop
from shared.orders import check

AWAY = 5.0
"""Who has asked nothing for so long, s, has closed the page."""
SOON = 60.0
"""A browser that was told to open the page may take so long, s."""
GONE = 25.0
"""A brick that is not back so long after, s, has given its run up: it holds for 20 s."""
ANSWER = 3.0
"""A brick that has not begun so long after a start, s, does not."""
APART = 25.0
"""Between two points of a path, px."""


class Server(Protocol):
    """What is used of the tracking server."""

    def send(self, message: Start | Stop) -> bool: ...  # noqa: D102
    def state(self) -> LinkState: ...  # noqa: D102
    def commands(self) -> list[str]: ...  # noqa: D102


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
            watcher.name: CameraFeed(watcher, tracker, source)
            for watcher, tracker, source in zip(watchers, trackers, sources, strict=True)
        }
        self._server = server
        self._file = file
        self._bring = bring
        self._now = now
        self._own: Callable[[], str] | None = None  # why the brick that came along has ended
        self._asked = -math.inf
        self._colours = ColourEdits(self._cameras, file)
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
        # One order after the other; what only looks takes no lock.
        self._lock = threading.RLock()

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

    def _shown(self, eye: CameraFeed, view: View, masks: Sequence[str]) -> Shown:
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
            tuple(marks(view)),
            self._aims.get(camera),
            path,
            tuple(where for t, where in list(eye.trail) if frame.t - HISTORY <= t <= frame.t),
            {
                marker.name: mask(frame.image, marker)
                for marker in eye.tracker.markers
                if marker.name in masks and marker.color
            },
        )

    def pin(self, camera: str, index: int) -> str:
        """Keep a picture that was given out, for picking in it."""
        try:
            self._cameras[camera].pinned.append(self._cameras[camera].find(index))
        except PictureGone as gone:
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
            {marker.name: str(marker) for marker in self._colours.markers},
            self._colours.undoable,
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

    def _eye(self, name: str, eye: CameraFeed) -> Eye:
        watcher = eye.watcher
        ended = "ended" if watcher.ended else ""
        trouble = watcher.trouble or ended or watcher.silence or watcher.slowness
        return Eye(
            name, eye.source, eye.rate, watcher.dropped, watcher.age, trouble, eye.frames,
            watcher.ended,
        )  # fmt: skip

    # Colours

    def pick(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """As ColourEdits.pick."""
        return self._colours.pick(name, camera, index, where)

    def add(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """As ColourEdits.add."""
        return self._colours.add(name, camera, index, where)

    def remove(self, name: str, camera: str, index: int, where: Sequence[float]) -> str:
        """As ColourEdits.remove."""
        return self._colours.remove(name, camera, index, where)

    def rename(self, name: str, new: str) -> str:
        """As ColourEdits.rename."""
        return self._colours.rename(name, new)

    def undo(self) -> str:
        """As ColourEdits.undo."""
        return self._colours.undo()

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
        if not self._is_fixed() and GOAL not in (marker.name for marker in self._colours.markers):
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


_BUSY = "a run is on; hold or stop it first"


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


def keep_beating(desk: Desk, over: threading.Event) -> None:
    """Let a desk look at what goes on until it is over; for a thread of its own."""
    while not over.wait(BEAT):
        desk.beat()
