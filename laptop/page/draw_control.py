"""Drawings on the page: read, laid on the table, offered to the brick, and watched while drawn."""

from __future__ import annotations

import math
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from laptop.drawing.pictures import Tracing
from laptop.page.brick_link import BrickLink
from laptop.page.camera_feed import CameraFeed
from laptop.page.drag_path import smooth_path
from laptop.page.drawing_snapshots import (
    Answer,
    Deviation,
    DrawingSnapshot,
    DrawingState,
    InkPoint,
    JobState,
    NothingShown,
    PlacedDrawing,
    Placing,
    Request,
    Source,
    file_source,
)
from laptop.page.drawing_worker import DrawingWorker
from laptop.page.ink_track import InkTrack
from laptop.page.job_states import heard, unheard
from laptop.page.look_around import look_job
from laptop.page.marker_height import DrawingArm
from laptop.page.paper_views import PaperViews
from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.pipeline import Point
from laptop.see.serve.server_state import ServerState as LinkState
from shared.arm_description import ArmError
from shared.job_messages import DONE, ENDS, ORDERS, Draw, JobStatus, Order, check_order
from shared.messages import Stop

MAX_FILE = 8_000_000
"""Bytes of a file that is dropped, at the most."""
MAX_TEXT = 2000
"""Characters of a text, at the most."""
START_TIMEOUT = 6.0
"""A brick that has said nothing of a job so long after it was offered will not draw it, s."""
SETTLED = 0.6
"""So long after a job's end the last of its ink is known, s."""
_BUSY = "a drawing is on; abort it first"
_NO_BRICK = "no brick is connected; the tab Drive says what to do"


class DrawControl:
    """The drawing, and what becomes of it; orders answer with "", or in one line why not.

    Args:
        arm: that is to draw, and how high its marker is.
        cameras: feeds by camera name.
        link: to the brick.
        is_running: tells whether a servo run is on.
        now: clock of the frames, s.
        lock: held while an order is carried out.
    """

    def __init__(
        self,
        arm: DrawingArm,
        cameras: Mapping[str, CameraFeed],
        link: BrickLink,
        is_running: Callable[[], bool],
        now: Callable[[], float],
        lock: threading.RLock,
    ) -> None:
        self._arm, self._link = arm.arm, link
        self._is_running, self._now, self._lock = is_running, now, lock
        self._worker = DrawingWorker(arm.arm, self._hear) if arm.arm else None
        self._paper = PaperViews(arm, cameras)
        self.view = self._paper.view
        self._inks = {name: InkTrack(self._paper.marker_shift) for name in cameras}
        self._revision = 0
        self._request: Request | None = None  # the last of a drawing
        self._number = 0  # of its source
        self._placed: PlacedDrawing | None = None
        self._deviation: Deviation | None = None
        self._busy = self._trouble = ""
        self._offered: Draw | None = None  # the job that was started here
        self._offered_at = -1e9  # s
        self._told_before = -1.0  # time of the last progress when the job was offered, s
        self._wish: PlacedDrawing | None = None  # of that job
        self._progress: JobStatus | None = None
        self._ended_at: float | None = None
        self._stop: Stop | None = None  # to be repeated until the job has ended

    def close(self) -> None:
        """End the process that reads and plans."""
        if self._worker:
            self._worker.close()

    # What is to be drawn

    def load(self, name: str, data: bytes) -> str:
        """Read a drawing from a file's bytes: SVG, PNG, JPEG, or a text."""
        if len(data) > MAX_FILE:
            return f"{name}: {len(data) / 1e6:.0f} MB; at most {MAX_FILE / 1e6:.0f} MB are read"
        return self._take(file_source(name, data))

    def write(self, text: str) -> str:
        """Write a text, in letters of single strokes."""
        if not text.strip():
            return "type a text first"
        if len(text) > MAX_TEXT:
            return f"the text has {len(text)} characters; at most {MAX_TEXT} are written"
        return self._take(Source("text", text[:40], text.encode("utf-8")))

    def choose(self, name: str) -> str:
        """Take a drawing from the gallery."""
        return self._take(Source("gallery", name))

    def trace(self, camera: str, points: Sequence[Point]) -> str:
        """Make a drawing of a path that was dragged in a picture, (u, v) px."""
        view = self.view(camera)
        if view is None:
            return f"where camera {camera} sees the table is not known yet; look around first"
        path = view.to_table(smooth_path(points))
        low, high = path.min(axis=0), path.max(axis=0)
        if not np.isfinite(path).all() or float((high - low).max()) < 0.3:
            return "this path is too short to be drawn; drag a longer one"
        x, y = (low + high) / 2
        placing = Placing(float(x), float(y), float((high - low).max()))
        return self._take(Source("path", "dragged path", path=path), placing)

    def trace_picture(self, tracing: Tracing) -> str:
        """Draw the picture otherwise: it is read anew, and lies where it was."""
        return self._read_anew(
            lambda one: one._replace(tracing=tracing) if one.tracing else None,
            "there is no picture to trace; drop a PNG or JPEG first",
        )

    def hatch(self, areas: bool) -> str:
        """Hatch areas of an SVG, or draw their outlines alone: it is read anew, too."""
        return self._read_anew(
            lambda one: None if one.is_hatched is None else one._replace(is_hatched=areas),
            "there is no SVG to hatch; drop one first",
        )

    def _read_anew(self, change: Callable[[Source], Source | None], or_else: str) -> str:
        with self._lock:
            before = self._request and self._request.source
            if before is None or (source := change(before)) is None:
                return or_else
            self._number += 1
            return self._change(lambda asked: asked._replace(number=self._number, source=source))

    def place(self, placing: Placing) -> str:
        """Lay the drawing elsewhere, or turn it, or make it larger or smaller."""
        return self._change(lambda asked: asked._replace(placing=placing))

    def take_pens(self, pens: str) -> str:
        """Draw each of its layers, or colours, with a pen of its own; "": all with one."""
        return self._change(lambda asked: asked._replace(pens=pens))

    def _change(self, change: Callable[[Request], Request]) -> str:
        with self._lock:
            if self._request is None:
                return "there is no drawing yet"
            self._ask(change(self._request))
            return ""

    def clear(self) -> str:
        """Take the drawing away; what the brick draws goes on."""
        with self._lock:
            self._request = self._placed = self._deviation = None
            self._busy = self._trouble = ""
            for ink in self._inks.values():
                if not self.is_on:
                    ink.begin()
            self._revision += 1
            return ""

    def _take(self, source: Source, placing: Placing | None = None) -> str:
        if self._arm is None:
            return "the arm is not known here; give its file by BRICKSERVO_ARM"
        with self._lock:
            # (Also after one was taken away: the worker knows sources by their numbers.)
            self._number += 1
            self._placed = self._deviation = None
            self._ask(Request(self._number, source, placing or Placing()))
            return ""

    def _ask(self, request: Request) -> None:
        assert self._worker
        is_read = self._request is None or self._request.number != request.number
        self._busy = "reading it" if is_read else "planning it"
        self._request, self._trouble = request, ""
        if self._placed:  # what was planned is not what is asked for now
            self._placed = self._placed._replace(seconds=None, job=b"")
        self._revision += 1
        self._worker.ask(request)

    def _hear(self, request: Request, answer: Answer, last: bool) -> None:
        """Take an answer of the worker's, in its thread."""
        with self._lock:
            self._revision += 1
            if isinstance(answer, Deviation):
                self._deviation = answer
                return
            if request is not self._request:
                return  # something newer is asked for
            self._busy = "" if last else "planning it"
            if isinstance(answer, str):
                self._trouble = answer
                if self._placed is not None:
                    self._placed = self._placed._replace(why_not=answer, job=b"")
                elif not isinstance(answer, NothingShown):
                    self._request = None
            else:
                self._placed = answer

    # The job

    @property
    def is_on(self) -> bool:
        """Return True if a job is on at the brick, or was offered a moment ago."""
        if self._progress is not None and self._progress.state not in ENDS:
            return True
        if self._offered is None or self._now() - self._offered_at > START_TIMEOUT:
            return False
        return self._progress is None or self._progress.t <= self._told_before

    def start(self, dry: bool = False, alone: bool = False) -> str:
        """Have the brick draw it: `dry` with the pen up, `alone` also when the link is lost."""
        with self._lock:
            placed = self._placed
            if placed is None:
                return self._trouble or "there is no drawing yet; drop a file, or choose one"
            if placed.why_not or not placed.job:
                return placed.why_not or "it is not planned yet; wait a moment"
            return self._start(placed.job, placed, dry, alone)

    def look_around(self) -> str:
        """Let the arm look around, pen up, so that it is learned where pictures show the table."""
        if self._arm is None:
            return "the arm is not known here; give its file by BRICKSERVO_ARM"
        with tempfile.TemporaryDirectory(prefix="brickservo-") as folder:
            file = Path(folder) / "look.job"
            try:
                look_job(self._arm, file)
            except ArmError as error:
                return f"this arm cannot look around: {error}"
            job = file.read_bytes()
        with self._lock:
            return self._start(job, None, dry=True, alone=False)

    def _start(self, job: bytes, wish: PlacedDrawing | None, dry: bool, alone: bool) -> str:
        link = self._link.state()
        if link.client is None:
            return _NO_BRICK
        if self.is_on:
            return _BUSY
        if self._is_running():
            return "a run is on; hold or stop it first"
        with tempfile.TemporaryDirectory(prefix="brickservo-") as folder:
            file = Path(folder) / "drawing.job"
            file.write_bytes(job)
            try:
                offer = JobOffer(file, alone=alone, dry=dry)
            except ArmError as error:
                return str(error).replace(str(file), "the drawing")
        self._told_before = link.progress.t if link.progress else -1.0
        if not self._link.offer(offer):
            return "the link has just broken; it mends by itself, then start again"
        self._offered, self._offered_at = offer.draw, self._now()
        self._wish = None if dry else wish
        self._ended_at, self._deviation, self._trouble, self._stop = None, None, "", None
        for ink in self._inks.values():
            ink.begin()
        self._revision += 1
        return ""

    def order(self, what: str, value: float | None = None) -> str:
        """Pause, resume or abort what the brick draws, or change its speed (%) or pen (degrees)."""
        if what not in ORDERS:
            return f"{what}: give one of {', '.join(ORDERS)}"
        order = Order(what, value)
        try:
            check_order(order)
        except ArmError as error:
            return str(error)
        with self._lock:
            if not self.is_on:
                return "nothing is drawn just now"
            return "" if self._link.send(order) else _NO_BRICK

    def stop(self, reason: str) -> None:
        """Take in that everything is to stop: it is said again until the job has ended."""
        with self._lock:
            self._stop = Stop(reason) if self.is_on else None

    # What is seen

    def set_marker_height(self, mm: float | None) -> str:
        """Take in how high the arm's marker is over the paper, mm; None: that is not known."""
        with self._lock:
            why = self._paper.set_height(mm)
            self._show_elsewhere()
            return why

    def state(self) -> DrawingState:
        """Return how it stands."""
        with self._lock:
            placed, on = self._placed, self.is_on
            source = self._request and self._request.source
            views = self._paper.views().values()
            return DrawingState(
                revision=self._revision,
                is_there=placed is not None,
                busy=self._busy,
                trouble=self._trouble,
                unmapped=self._paper.unmapped(),
                misfit=max((view.misfit for view in views), default=None),
                source=next((view.source for view in views), ""),
                is_on_paper=all(view.is_paper for view in views),
                marker=self._paper.height,
                asks_height=self._paper.is_flat,
                job=self._job_state(),
                can_start=bool(placed and placed.job and not placed.why_not and not on),
                tracing=source.tracing if source else None,
                is_hatched=source.is_hatched if source else None,
            )

    def drawing(self) -> DrawingSnapshot:
        """Return all that browsers draw of it."""
        with self._lock:
            placed = self._placed and self._placed._replace(job=b"")
            return DrawingSnapshot(placed, self._paper.views(), self._deviation)

    def ink(self, camera: str, version: int, after: int) -> tuple[int, list[InkPoint]]:
        """Return the version of a camera's ink, and its points; of that `version` those `after`."""
        with self._lock:
            ink = self._inks[camera]
            first = after if version == ink.version else 0
            points, shifts = ink.points[first:], np.array(ink.shifts[first:])
            paper = self.view(camera)
            if points and paper:
                # What is seen is the marker, beside the pen and over it.
                seen = np.array([(point.u, point.v) for point in points])
                places = paper.to_picture(self._paper.pen_places(camera, seen, shifts))
                points = [
                    InkPoint(float(u), float(v), point.begins) if math.isfinite(u + v) else point
                    for (u, v), point in zip(places, points, strict=True)
                ]
            return ink.version, points

    def _job_state(self) -> JobState | None:
        offered, progress = self._offered, self._progress
        if offered and (progress is None or progress.t <= self._told_before):
            return unheard(offered.name, self._now() - self._offered_at > START_TIMEOUT)
        if progress is None:
            return None
        is_lost = self._link.state().client is None
        return heard(progress, is_lost, bool(offered and offered.alone))

    # At every heartbeat

    def poll(self) -> None:
        """Take in what cameras and brick tell; to be called at every heartbeat."""
        with self._lock:
            link = self._link.state()
            on = self._progress and self._progress.state not in ENDS
            for name, tip in self._paper.take_tips().items():
                if on:
                    self._inks[name].see(*tip)
            self._paper.learn(link, self._now())
            self._follow(link)
            for ink in self._inks.values():
                ink.judge(self._now())
            if self._paper.have_changed():
                self._show_elsewhere()

    def _show_elsewhere(self) -> None:
        """Have browsers show drawing and ink where they are now."""
        self._revision += 1
        for ink in self._inks.values():
            ink.version += 1

    def _follow(self, link: LinkState) -> None:
        """Take in how the brick gets on with a job."""
        progress = link.progress
        if progress is not None and progress is not self._progress:
            fresh = self._progress is None or self._progress.state != progress.state
            self._progress = progress
            self._revision += fresh
            t = self._now() - (link.progress_age or 0.0)
            for ink in self._inks.values():
                ink.tell(t, progress.down)
            if self._stop and progress.state not in ENDS:
                self._link.send(self._stop)  # it gets lost with the link
        if progress is None or progress.state not in ENDS:
            self._ended_at = None
            return
        self._stop = None
        if self._ended_at is None:
            self._ended_at = self._now()
        elif self._wish and self._now() - self._ended_at > SETTLED:
            self._compare(progress)
            self._wish = None

    def _compare(self, progress: JobStatus) -> None:
        """Have it worked out how far what was drawn is from the wish, where cm are known."""
        for name, ink in self._inks.items():
            if self.view(name) and len(ink.points) > 1 and self._wish and self._worker:
                wish = self._wish.good
                if progress.state == DONE and wish:
                    lines = ink.lines(partial(self._paper.pen_places, name))
                    lines = tuple(line[np.isfinite(line).all(axis=1)] for line in lines)
                    self._worker.ask(Request(0, None, wish=wish, ink=lines))
                    return
