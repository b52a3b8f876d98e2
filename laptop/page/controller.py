"""The tracker's side of the page: what goes on, and what can be done about it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from laptop.page.brick_call import NO_BRICKS, ComingBricks, EmulatedBrickCall
from laptop.page.brick_link import BrickLink, Server
from laptop.page.camera_feed import HEARTBEAT_PERIOD, CameraFeed
from laptop.page.colour_edits import ColourEdits
from laptop.page.draw_control import DrawControl
from laptop.page.frames import Frames
from laptop.page.goal_hints import GoalHints
from laptop.page.login import Admission
from laptop.page.marker_height import UNKNOWN_ARM, DrawingArm
from laptop.page.marker_text import describe_marker
from laptop.page.page_viewers import PageViewers
from laptop.page.page_watch import PageWatch
from laptop.page.plot_history import PlotHistory
from laptop.page.run_control import RunControl
from laptop.page.run_records import RunGroup, RunRecorder
from laptop.page.snapshots import CameraStatus, PageState, PlotSample
from laptop.page.steering import Steering

BRICK_GONE_TIMEOUT = 25.0
"""Time without a brick, s, after which its run is over: the brick itself gives up after 20 s."""


class PageController:
    """All that a page can see and do; implements `laptop.page.interface.PageInterface`.

    Its methods may be called from any thread.

    Args:
        cameras: in the order in which they are shown.
        server: of the brick, or None.
        file: where learned colours are kept.
        bricks: that may come.
        arm: that draws.
        now: clock of the frames, s.
        clock: of people and pages, s; the frames' may stand still.
        hold_on_timeout: hold a run that a page has ordered once no page answers any more.

    Attributes:
        frames, colours, runs, drawings, drawing_views, steering, admission: the groups of calls of
            PageInterface.
        watch: holds runs when no page is heard.
    """

    def __init__(
        self,
        cameras: Sequence[CameraFeed],
        server: Server | None,
        file: Path,
        bricks: ComingBricks = NO_BRICKS,
        arm: DrawingArm = UNKNOWN_ARM,
        now: Callable[[], float] = time.monotonic,
        clock: Callable[[], float] = time.monotonic,
        hold_on_timeout: bool = True,
    ) -> None:
        self._cameras = {feed.watcher.name: feed for feed in cameras}
        self._link = BrickLink(server)
        self._file = file
        self._now = now
        self._viewers = PageViewers(now)
        self._emulated_brick = EmulatedBrickCall(bricks.emulated, self._link)
        self.colours = ColourEdits(self._cameras, file)
        self.runs = RunControl(self._cameras, self.colours, self._link, now, bricks.real)
        self.drawings = self.drawing_views = DrawControl(
            arm, self._cameras, self._link, self.runs.running, now, self.runs.lock
        )
        self.runs.is_drawing = lambda: self.drawings.is_on
        self.runs.on_stop = self.drawings.stop
        self._hints = GoalHints(self._cameras)
        self.frames = Frames(self._cameras, self.runs, self._hints, now)
        self.steering = Steering(clock)
        self.admission = Admission()
        self.watch = PageWatch(self.steering, self.runs, clock, hold_on_timeout)
        self._last_linked = now()  # s
        self._recorder = RunRecorder()
        self._history = PlotHistory(self._cameras, self._link)
        self._lock = self.runs.lock

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras."""
        return tuple(self._cameras)

    # Viewers

    @property
    def has_viewers(self) -> bool:
        """Return True if a browser has the page open, or is expected to."""
        return self._viewers.are_there

    def expect_viewer(self) -> None:
        """Expect a browser to open the page."""
        self._viewers.expect()

    def opened(self) -> None:
        """Count on somebody who opens the page, which takes a slow browser a while.

        An emulated brick comes, if there is one to come and no other there.
        """
        self.expect_viewer()
        with self._lock:
            self.runs.note = self._emulated_brick.begin() or self.runs.note

    def arrived(self) -> None:
        """Handle that a browser has the page, which polls from now on: expect none any more."""
        self._viewers.arrive()

    def lose_page(self, why: str) -> None:
        """Handle that the page's process is replaced; `why` is the reason."""
        self.watch.lose_page(why)
        self.runs.note = f"page: its process {why}; it starts anew"

    # State

    def state(self) -> PageState:
        """Return the state of cameras, link, run and colours."""
        self._viewers.ask()
        link = self._link.state()
        running = self.runs.running(link)
        with self._lock:
            records = self._recorder.summaries()
        trouble = "" if link.client else link.lost or link.refusal
        return PageState(
            cameras=tuple(_camera_status(feed) for feed in self._cameras.values()),
            brick=link.client,
            commands=self._link.commands(),
            round_trip=link.round_trip,
            status=link.status,
            running=running,
            following=running and self.runs.follows,
            aims=dict(self.runs.aims),
            left=self.runs.left,
            markers={marker.name: str(marker) for marker in self.colours.markers},
            undoable=self.colours.undoable,
            file=str(self._file),
            note="; ".join(filter(None, (trouble, self.runs.note))),
            own=self._emulated_brick.is_on,
            fixed=self.runs.is_fixed,
            runs=records,
            driver=self.steering.driver,
            driver_name=self.steering.name(self.steering.driver),
            can_call=self.runs.brick_call.is_possible,
            drawing=self.drawings.state(),
            marker_descriptions={
                marker.name: describe_marker(marker) for marker in self.colours.markers
            },
        )

    def history(self, after: float = -math.inf) -> list[PlotSample]:
        """Return the points of the plots that are later than `after` (s)."""
        return self._history.after(after)

    def record(self, number: int | None = None) -> RunGroup | None:
        """Return the records of one order's runs, by default the newest; None if there are none."""
        with self._lock:
            return self._recorder.group(number)

    # Heartbeat

    def heartbeat(self) -> None:
        """Update once; to be called every HEARTBEAT_PERIOD."""
        for feed in self._cameras.values():
            feed.extend_trail()
        self._hints.learn()
        self.watch.notice_standstill()
        self._history.poll(self._now())
        with self._lock:
            self._record()
            self.runs.poll()
            self.drawings.poll()
            self.watch.poll()
            if why := self._emulated_brick.poll():
                reported = f"{why}; load the page anew for another one"
                self.runs.note = "; ".join(filter(None, (self.runs.note, reported)))
            self.runs.note = self.runs.brick_call.poll() or self.runs.note

    def _record(self) -> None:
        """Record the samples of a run."""
        link = self._link.state()
        status = link.status
        if link.client and status:
            t = self._now() - (link.status_age or 0.0)
            self._recorder.receive(status, t, link.client, *self.runs.orders_of(status))
        if link.client:
            self._last_linked = self._now()
        elif self._now() - self._last_linked > BRICK_GONE_TIMEOUT:
            self._recorder.lose_brick(self._now())
        self._recorder.add_views({name: feed.watcher.view for name, feed in self._cameras.items()})


def _camera_status(feed: CameraFeed) -> CameraStatus:
    watcher = feed.watcher
    ended = "ended" if watcher.ended else ""
    return CameraStatus(
        name=watcher.name,
        source=feed.source,
        rate=feed.rate,
        dropped=watcher.dropped,
        age=watcher.age,
        trouble=watcher.trouble or ended or watcher.silence or watcher.slowness,
        frames=feed.frames,
        ended=watcher.ended,
    )


def keep_heartbeat(controller: PageController, over: threading.Event) -> None:
    """Give a controller its heartbeat until it is over; for a thread of its own."""
    while not over.wait(HEARTBEAT_PERIOD):
        controller.heartbeat()
