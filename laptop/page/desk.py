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

from laptop.page.camera_feed import BEAT, CameraFeed, Finder, PictureGone, marks, mask
from laptop.page.colour_edits import ColourEdits
from laptop.page.run_control import RunControl, Server
from laptop.page.run_records import RunGroup, RunRecorder
from laptop.page.snapshots import HISTORY, SAMPLE, USUAL, Eye, Sample, Shown, State
from laptop.tracking.server import State as LinkState
from laptop.tracking.watching import Point, Watcher
from laptop.vision.tracker import Tracker
from laptop.vision.view import View
from shared.arm_description import ArmError
from shared.messages import Start

AWAY = 5.0
"""Who has asked nothing for so long, s, has closed the page."""
SOON = 60.0
"""A browser that was told to open the page may take so long, s."""
GONE = 25.0
"""A brick that is not back so long after, s, has given its run up: it holds for 20 s."""


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
        self._runs = RunControl(self._cameras, self._colours, server, now)
        self._linked = now()  # when a brick was last there
        self._recorder = RunRecorder()
        self._history: deque[Sample] = deque(maxlen=round(HISTORY / SAMPLE))
        self._lock = self._runs.lock

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
        return Shown(
            camera,
            frame.index,
            frame.t,
            self._now() - frame.t,
            width,
            height,
            eye.jpeg(view),
            tuple(marks(view)),
            self._runs.aims.get(camera),
            self._runs.ahead(camera),
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
        running = self._runs.running(link)
        with self._lock:
            runs = self._recorder.summaries()
        return State(
            tuple(self._eye(name, eye) for name, eye in self._cameras.items()),
            link.client,
            tuple(self._server.commands() if self._server else ()),
            link.round_trip,
            link.status,
            running,
            running and self._runs.follows,
            dict(self._runs.aims),
            self._runs.left,
            {marker.name: str(marker) for marker in self._colours.markers},
            self._colours.undoable,
            str(self._file),
            "; ".join(
                filter(None, ("" if link.client else link.lost or link.refusal, self._runs.note))
            ),
            self._own is not None,
            self._runs.is_fixed,
            runs,
        )

    def history(self, after: float = -math.inf) -> list[Sample]:
        """The last minute, or what of it is later than `after` (s)."""
        return [sample for sample in list(self._history) if sample.t > after]

    def record(self, number: int | None = None) -> RunGroup | None:
        """What is known of a run, the newest by default; None if there is none of this number."""
        with self._lock:
            return self._recorder.group(number)

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

    # Drive

    def aim(self, camera: str, u: float, v: float) -> str:
        """As RunControl.aim."""
        return self._runs.aim(camera, [(u, v)])

    def aim_at_marker(self) -> str:
        """As RunControl.aim_at_marker."""
        return self._runs.aim_at_marker()

    def follow(self, camera: str, points: Sequence[Point]) -> str:
        """As RunControl.follow."""
        return self._runs.follow(camera, points)

    def start(
        self,
        method: str = USUAL.method,
        mode: str = USUAL.mode,
        rows: str = USUAL.rows,
        tolerance: float = USUAL.tolerance,
        budget: float = USUAL.budget,
        follow: bool = USUAL.follow,
    ) -> str:
        """As RunControl.start."""
        return self._runs.start(Start(method, mode, rows, tolerance, budget, follow))

    def hold(self) -> str:
        """As RunControl.hold."""
        return self._runs.hold()

    def stop(self) -> str:
        """As RunControl.stop."""
        return self._runs.stop()

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
            self._runs.go_on()
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
                    self._runs.note = f"no emulated brick: {error.strerror}: {error.filename}"

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
            t = self._now() - (link.status_age or 0.0)
            self._recorder.receive(status, t, link.client, *self._runs.orders_of(status))
        if link.client:
            self._linked = self._now()
        elif self._now() - self._linked > GONE:
            self._recorder.lose_brick(self._now())
        self._recorder.add_views({name: eye.watcher.view for name, eye in self._cameras.items()})

    def _mind_own(self) -> None:
        """Tell of an emulated brick that has ended."""
        if self._own and self._server and not self._server.state().client and (why := self._own()):
            self._own = None
            told = f"{why}; load the page anew for another one"
            self._runs.note = "; ".join(filter(None, (self._runs.note, told)))


def keep_beating(desk: Desk, over: threading.Event) -> None:
    """Let a desk look at what goes on until it is over; for a thread of its own."""
    while not over.wait(BEAT):
        desk.beat()
