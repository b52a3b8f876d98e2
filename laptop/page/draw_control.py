"""Drawings on the page: read, laid on the table, offered to the brick, and watched while drawn."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from laptop.drawing.pictures import Tracing
from laptop.page.brick_link import BrickLink
from laptop.page.camera_feed import CameraFeed
from laptop.page.drag_path import smooth_path
from laptop.page.draw_job import DrawJob
from laptop.page.draw_request import DrawRequest
from laptop.page.drawing_snapshots import (
    DrawingSnapshot,
    DrawingState,
    InkPoint,
    PlacedDrawing,
    Placing,
    Source,
    file_source,
)
from laptop.page.drawn_ink import DrawnInk
from laptop.page.look_around import survey_job
from laptop.page.marker_height import DrawingArm
from laptop.page.paper_views import PaperViews
from laptop.see.serve.pipeline import Point
from laptop.see.serve.server_state import ServerState as LinkState
from shared.arm_description import ArmError
from shared.job_messages import DONE

MAX_FILE_BYTES = 8_000_000
"""Greatest size of a file that is dropped, bytes."""
MAX_TEXT_LENGTH = 2000
"""Greatest length of a text, characters."""


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
        self._arm = arm.arm
        self._is_running, self._now, self._lock = is_running, now, lock
        self._link = link
        self._request = DrawRequest(arm.arm, lock)
        self._job = DrawJob(link, now)
        self._paper = PaperViews(arm, cameras)
        self.view = self._paper.view
        self._ink = DrawnInk(cameras, self._paper)
        self._wish: PlacedDrawing | None = None  # of the job that was started here
        self._revision = 0  # of what is not the request's

    def close(self) -> None:
        """End the process that reads and plans."""
        self._request.close()

    # The request

    def load(self, name: str, data: bytes) -> str:
        """Read a drawing from a file's bytes: SVG, PNG, JPEG, or a text."""
        if len(data) > MAX_FILE_BYTES:
            return (
                f"{name}: {len(data) / 1e6:.0f} MB; at most {MAX_FILE_BYTES / 1e6:.0f} MB are read"
            )
        return self._request.load(file_source(name, data))

    def write(self, text: str) -> str:
        """Write a text, in letters of single strokes."""
        if not text.strip():
            return "type a text first"
        if len(text) > MAX_TEXT_LENGTH:
            return f"the text has {len(text)} characters; at most {MAX_TEXT_LENGTH} are written"
        return self._request.load(Source("text", text[:40], text.encode("utf-8")))

    def choose(self, name: str) -> str:
        """Take a drawing from the gallery."""
        return self._request.load(Source("gallery", name))

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
        return self._request.load(Source("path", "dragged path", path=path), placing)

    def trace_picture(self, tracing: Tracing) -> str:
        """Trace the picture with other settings; its placement stays."""
        return self._request.reload(
            lambda one: one._replace(tracing=tracing) if one.tracing else None,
            "there is no picture to trace; drop a PNG or JPEG first",
        )

    def hatch(self, areas: bool) -> str:
        """Hatch areas of an SVG, or draw their outlines only; its placement stays."""
        return self._request.reload(
            lambda one: None if one.is_hatched is None else one._replace(is_hatched=areas),
            "there is no SVG to hatch; drop one first",
        )

    def place(self, placing: Placing) -> str:
        """Lay the drawing elsewhere, or turn it, or make it larger or smaller."""
        return self._request.change(lambda asked: asked._replace(placing=placing))

    def set_pens(self, pens: str) -> str:
        """Draw each of its layers, or colours, with a pen of its own; "": all with one."""
        return self._request.change(lambda asked: asked._replace(pens=pens))

    def clear(self) -> str:
        """Take the drawing away; what the brick draws goes on."""
        with self._lock:
            self._request.clear()
            if not self.is_on:
                self._ink.begin()
            return ""

    # The job

    @property
    def is_on(self) -> bool:
        """Return True if a job is on at the brick, or was offered a moment ago."""
        return self._job.is_on

    def start(self, dry: bool = False, alone: bool = False) -> str:
        """Have the brick draw it: `dry` with the pen up, `alone` also when the link is lost."""
        with self._lock:
            placed = self._request.placed
            if placed is None:
                return (
                    self._request.trouble or "there is no drawing yet; drop a file, or choose one"
                )
            if placed.why_not or not placed.job:
                return placed.why_not or "it is not planned yet; wait a moment"
            return self._start(placed.job, placed, dry, alone)

    def look_around(self) -> str:
        """Let the arm sweep its reach, pen up, to learn the mapping from pictures to the table."""
        if self._arm is None:
            return "the arm is not known here; give its file by BRICKSERVO_ARM"
        with tempfile.TemporaryDirectory(prefix="brickservo-") as folder:
            file = Path(folder) / "look.job"
            try:
                survey_job(self._arm, file)
            except ArmError as error:
                return f"this arm cannot look around: {error}"
            job = file.read_bytes()
        with self._lock:
            return self._start(job, None, dry=True, alone=False)

    def _start(self, job: bytes, wish: PlacedDrawing | None, dry: bool, alone: bool) -> str:
        why = self._job.why_not()
        if not why and self._is_running():
            why = "a run is on; hold or stop it first"
        why = why or self._job.offer(job, dry, alone)
        if why:
            return why
        self._wish = None if dry else wish
        self._request.begin()
        self._ink.begin()
        self._revision += 1
        return ""

    def order(self, what: str, value: float | None = None) -> str:
        """Pause, resume or abort what the brick draws, or change its speed (%) or pen (degrees)."""
        with self._lock:
            return self._job.order(what, value)

    def stop(self, reason: str) -> None:
        """Stop everything: the order is sent again until the job has ended."""
        with self._lock:
            self._job.stop(reason)

    # State

    def set_marker_height(self, mm: float | None) -> str:
        """Set the height of the arm's marker over the paper, mm; None: unknown."""
        with self._lock:
            why = self._paper.set_height(mm)
            self._invalidate()
            return why

    def state(self) -> DrawingState:
        """Return the state."""
        with self._lock:
            asked, placed, source = self._request, self._request.placed, self._request.source
            views = self._paper.views().values()
            return DrawingState(
                revision=asked.revision + self._revision,
                is_there=placed is not None,
                busy=asked.busy,
                trouble=asked.trouble,
                unmapped=self._paper.unmapped(),
                misfit=max((view.misfit for view in views), default=None),
                source=next((view.source for view in views), ""),
                is_on_paper=all(view.is_paper for view in views),
                marker=self._paper.height,
                asks_height=self._paper.is_flat,
                job=self._job.state(),
                can_start=bool(placed and placed.job and not placed.why_not and not self.is_on),
                tracing=source.tracing if source else None,
                is_hatched=source.is_hatched if source else None,
            )

    def drawing(self) -> DrawingSnapshot:
        """Return all that browsers draw of it."""
        with self._lock:
            placed = self._request.placed and self._request.placed._replace(job=b"")
            return DrawingSnapshot(placed, self._paper.views(), self._request.deviation)

    def ink(self, camera: str, version: int, after: int) -> tuple[int, list[InkPoint]]:
        """Return the version of a camera's ink, and its points; of that `version` those `after`."""
        with self._lock:
            return self._ink.points(camera, version, after)

    # At every heartbeat

    def poll(self) -> None:
        """Update by what cameras and brick report; to be called at every heartbeat."""
        with self._lock:
            link = self._link.state()
            tips = self._paper.sample_tips()
            if self._job.is_reported:
                self._ink.add_tip(tips)
            self._paper.learn(link, self._now())
            self._handle_progress(link)
            self._ink.resolve(self._now())
            if self._paper.have_changed():
                self._invalidate()

    def _invalidate(self) -> None:
        """Let browsers fetch drawing and ink anew: the mapping has changed."""
        self._revision += 1
        self._ink.invalidate()

    def _handle_progress(self, link: LinkState) -> None:
        """Handle the brick's progress with a job."""
        if update := self._job.handle(link):
            self._revision += update.changes_state
            self._ink.set_pen(update.t, update.down)
        if self._wish and self._job.has_settled:
            self._compare(self._wish)
            self._wish = None

    def _compare(self, wish: PlacedDrawing) -> None:
        """Compute the deviation of the ink from the wish, where a mapping to cm is known."""
        progress, ink = self._job.progress, self._ink.lines()
        if progress and progress.state == DONE and wish.reachable and ink is not None:
            self._request.compare(wish.reachable, ink)
