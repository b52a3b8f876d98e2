"""The tracker's side of the page: what goes on, and what can be done about it."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from laptop.page.brick_call import StartOnBrick
from laptop.page.camera_feed import HEARTBEAT_PERIOD, CameraFeed, MarkerTracker
from laptop.page.colour_edits import ColourEdits
from laptop.page.draw_control import DrawControl
from laptop.page.frames import Frames
from laptop.page.goal_hints import GoalHints
from laptop.page.marker_height import HeightMemory, MarkerHeight
from laptop.page.marker_words import marker_looks
from laptop.page.run_control import RunControl, Server
from laptop.page.run_records import RunGroup, RunRecorder
from laptop.page.sessions import Admission
from laptop.page.silence import BUSY, Evidence, settled, verdict
from laptop.page.snapshots import (
    HISTORY_DURATION,
    SAMPLE_PERIOD,
    CameraStatus,
    PageState,
    PlotSample,
)
from laptop.page.steering import UNHEARD_TIMEOUT, Steering
from laptop.see.serve.pipeline import CameraPipeline
from laptop.see.serve.server_state import ServerState as LinkState
from shared.arm_description import Arm

VIEWER_TIMEOUT = 5.0
"""Time without a question, s, after which the page counts as closed."""
PAGE_OPEN_TIMEOUT = 60.0
"""Time that a browser may take to open the page, s."""
BRICK_GONE_TIMEOUT = 25.0
"""Time without a brick, s, after which its run is over: the brick itself gives up after 20 s."""


class PageController:
    """All that a page can see and do; implements `laptop.page.interface.PageInterface`.

    Its methods may be called from any thread.

    Args:
        watchers: one for each camera.
        trackers: theirs, in the same order.
        sources: names of the cameras for people, in the same order.
        server: of the brick, or None.
        file: where learned colours are kept.
        bring: starts an emulated brick when somebody opens the page and none is there; it returns
            a function that tells why that one has ended, "" as long as it has not.  Or None.
        now: clock of the frames, s.
        hold_unheard: a run that was ordered from a page is held when none is heard any more.
        clock: of people and pages, s; the frames' may stand still.
        start_on_brick: what a click does to have a real brick; None: there is nothing to click.
        arm: that draws; None: it is not known.
        height: of its marker over the paper, if that is told from the beginning.
        memory: of heights that people type; None: they are not kept.

    Attributes:
        frames, colours, runs, drawings, drawing_views, steering, admission: the groups of calls of
            PageInterface.
        why_page_stands: tells what keeps the page's process from going on, as "was stopped by a
            signal", or "".
    """

    def __init__(
        self,
        watchers: Sequence[CameraPipeline],
        trackers: Sequence[MarkerTracker],
        sources: Sequence[str],
        server: Server | None,
        file: Path,
        bring: Callable[[], Callable[[], str]] | None = None,
        now: Callable[[], float] = time.monotonic,
        hold_unheard: bool = True,
        clock: Callable[[], float] = time.monotonic,
        start_on_brick: StartOnBrick | None = None,
        arm: Arm | None = None,
        height: MarkerHeight | None = None,
        memory: HeightMemory | None = None,
    ) -> None:
        self._cameras = {
            watcher.name: CameraFeed(watcher, tracker, source)
            for watcher, tracker, source in zip(watchers, trackers, sources, strict=True)
        }
        self._server = server
        self._file = file
        self._bring = bring
        self._now = now
        self._why_emulated_ended: Callable[[], str] | None = None  # of the brick brought along
        self._last_question = self._expected_until = -math.inf  # s
        self.colours = ColourEdits(self._cameras, file)
        self.runs = RunControl(self._cameras, self.colours, server, now, start_on_brick)
        self.drawings = self.drawing_views = DrawControl(
            arm,
            self._cameras,
            self._link,
            lambda offer: bool(server and server.offer(offer)),
            lambda message: bool(server and server.send(message)),
            self.runs.running,
            now,
            self.runs.lock,
            height,
            memory,
        )
        self.runs.is_drawing = lambda: self.drawings.is_on
        self.runs.on_stop = self.drawings.stop
        self._hints = GoalHints(self._cameras)
        self.frames = Frames(self._cameras, self.runs, self._hints, now)
        self.steering = Steering(clock)
        self.admission = Admission()
        self._clock = clock
        self._hold_unheard = hold_unheard
        self.why_page_stands: Callable[[], str] = lambda: ""
        self._page_ended = -math.inf, ""  # when, s, and how
        self._pauses: deque[tuple[float, float]] = deque(maxlen=64)  # until when, how long, s
        self._open_note = ""  # of a hold that a browser can settle once it is back
        self._last_heartbeat = math.inf  # s
        self._last_linked = now()  # s
        self._recorder = RunRecorder()
        self._history: deque[PlotSample] = deque(maxlen=round(HISTORY_DURATION / SAMPLE_PERIOD))
        self._lock = self.runs.lock

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras."""
        return tuple(self._cameras)

    # Viewers

    @property
    def has_viewers(self) -> bool:
        """Return True if somebody has the page open, or is about to."""
        now = self._now()
        return now - self._last_question < VIEWER_TIMEOUT or now < self._expected_until

    def expect_viewer(self) -> None:
        """Count on somebody who is about to open the page."""
        self._expected_until = self._now() + PAGE_OPEN_TIMEOUT

    def opened(self) -> None:
        """Count on somebody who opens the page, which takes a slow browser a while.

        An emulated brick comes, if there is one to come and no other there.
        """
        self.expect_viewer()
        with self._lock:
            missing = self._server and self._server.state().client is None
            if self._bring and missing and not self._why_emulated_ended:
                try:
                    self._why_emulated_ended = self._bring()
                except OSError as error:
                    self.runs.note = f"no emulated brick: {error.strerror}: {error.filename}"

    def arrived(self) -> None:
        """Take in that a browser has the page, which asks from now on: expect nobody any more."""
        self._last_question, self._expected_until = self._now(), -math.inf

    def lose_page(self, why: str) -> None:
        """Take in that the page's process is replaced, and why."""
        self._page_ended = self._clock(), why
        self.runs.note = f"page: its process {why}; it starts anew"

    # State

    def state(self) -> PageState:
        """Return the state of cameras, link, run and colours."""
        self._last_question = self._now()
        link = self._link()
        running = self.runs.running(link)
        with self._lock:
            records = self._recorder.summaries()
        trouble = "" if link.client else link.lost or link.refusal
        return PageState(
            cameras=tuple(_camera_status(feed) for feed in self._cameras.values()),
            brick=link.client,
            commands=tuple(self._server.commands() if self._server else ()),
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
            own=self._why_emulated_ended is not None,
            fixed=self.runs.is_fixed,
            runs=records,
            driver=self.steering.driver,
            driver_name=self.steering.name(self.steering.driver),
            can_call=self.runs.brick_call.is_possible,
            drawing=self.drawings.state(),
            looks={marker.name: marker_looks(marker) for marker in self.colours.markers},
        )

    def history(self, after: float = -math.inf) -> list[PlotSample]:
        """Return the points of the plots that are later than `after` (s)."""
        return [sample for sample in list(self._history) if sample.t > after]

    def record(self, number: int | None = None) -> RunGroup | None:
        """Return the records of one order's runs, by default the newest; None if there are none."""
        with self._lock:
            return self._recorder.group(number)

    # Heartbeat

    def heartbeat(self) -> None:
        """Take in once what goes on; to be called every HEARTBEAT_PERIOD."""
        for feed in self._cameras.values():
            feed.extend_trail()
        self._hints.learn()
        self._notice_standstill()
        now = self._now()
        if not self._history or now - self._history[-1].t >= SAMPLE_PERIOD - HEARTBEAT_PERIOD / 2:
            self._history.append(self._sample(now))
        with self._lock:
            self._record()
            self.runs.poll()
            self.drawings.poll()
            silence = self.steering.silence
            if self._hold_unheard and silence > UNHEARD_TIMEOUT and self.runs.is_driven:
                why = verdict(self._evidence(silence))
                self.runs.hold_unheard(silence, why)
                self._open_note = self.runs.note if why.is_open else ""
            if (stood := self.steering.take_return()) is not None:
                if self._open_note and self.runs.note == self._open_note:
                    self.runs.note += f" {settled(stood)}"
                self._open_note = ""
            self._check_emulated_brick()
            self.runs.note = self.runs.brick_call.poll() or self.runs.note

    def _notice_standstill(self) -> None:
        """Take in for how long this process stood still, or was too busy for a heartbeat."""
        now = self._clock()
        if (pause := now - self._last_heartbeat) > BUSY:
            self._pauses.append((now, pause))
        self._last_heartbeat = now

    def _evidence(self, silence: float) -> Evidence:
        """Return all that is known of why no page was heard for so long, s."""
        since = self._clock() - silence
        ended_at, ended = self._page_ended
        return self.steering.evidence()._replace(
            ended=ended if ended_at >= since else self.why_page_stands(),
            standstill=max([0.0, *(min(pause, t - since) for t, pause in self._pauses)]),
        )

    def _link(self) -> LinkState:
        return self._server.state() if self._server else LinkState()

    def _sample(self, now: float) -> PlotSample:
        status = self._link().status
        for feed in self._cameras.values():
            feed.update_rate(now)
        return PlotSample(
            t=now,
            error=status and status.error,
            e=dict(status.e) if status else {},
            q=tuple(status.q) if status else (),
            condition=status and status.condition,
            moves=status.moves if status else 0,
            ages={name: feed.watcher.age for name, feed in self._cameras.items()},
            rates={name: feed.rate for name, feed in self._cameras.items()},
        )

    def _record(self) -> None:
        """Keep what belongs to a run."""
        link = self._link()
        status = link.status
        if link.client and status:
            t = self._now() - (link.status_age or 0.0)
            self._recorder.receive(status, t, link.client, *self.runs.orders_of(status))
        if link.client:
            self._last_linked = self._now()
        elif self._now() - self._last_linked > BRICK_GONE_TIMEOUT:
            self._recorder.lose_brick(self._now())
        self._recorder.add_views({name: feed.watcher.view for name, feed in self._cameras.items()})

    def _check_emulated_brick(self) -> None:
        """Tell of the emulated brick that was brought along if it has ended."""
        if self._why_emulated_ended is None or self._link().client:
            return
        if why := self._why_emulated_ended():
            self._why_emulated_ended = None
            told = f"{why}; load the page anew for another one"
            self.runs.note = "; ".join(filter(None, (self.runs.note, told)))


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
