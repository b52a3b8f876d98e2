"""The job that the brick draws, as the page offered it and as the brick reports it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from laptop.page.brick_link import BrickLink
from laptop.page.drawing_snapshots import JobState
from laptop.page.job_states import reported_state, unreported_state
from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.server_state import ServerState as LinkState
from shared.arm_description import ArmError
from shared.job_messages import ENDS, ORDERS, Draw, JobStatus, Order, check_order
from shared.messages import Stop

START_TIMEOUT = 6.0
"""Longest silence of a brick about a job since it was offered, s; then it will not draw it."""
INK_GRACE = 0.6
"""Time after a job's end by which the last of its ink is known, s."""
_BUSY = "a drawing is on; abort it first"
_NO_BRICK = "no brick is connected; the tab Drive says what to do"


class JobUpdate(NamedTuple):
    """Update of a job from the brick.

    t              time of the report, s
    down           whether the pen was down then
    changes_state  the job is in another state than before
    """

    t: float
    down: bool
    changes_state: bool


class DrawJob:
    """The job on the brick; orders answer with "", or in one line why not.

    Args:
        link: to the brick.
        now: clock of the frames, s.

    Attributes:
        progress: the brick's last report; None: none.
    """

    def __init__(self, link: BrickLink, now: Callable[[], float]) -> None:
        self._link, self._now = link, now
        self.progress: JobStatus | None = None
        self._offered: Draw | None = None  # the job that was started here
        self._offered_at = -1e9  # s
        self._reported_before = -1.0  # time of the last progress when the job was offered, s
        self._ended_at: float | None = None
        self._stop: Stop | None = None  # to be repeated until the job has ended

    @property
    def is_reported(self) -> bool:
        """Return True if the brick has reported a job that has not ended."""
        return self.progress is not None and self.progress.state not in ENDS

    @property
    def is_on(self) -> bool:
        """Return True if a job is on at the brick, or was offered a moment ago."""
        if self.is_reported:
            return True
        if self._offered is None or self._is_overdue():
            return False
        return self._is_unreported()

    @property
    def has_settled(self) -> bool:
        """Return True if the job has ended so long ago that all of its ink is known."""
        return self._ended_at is not None and self._now() - self._ended_at > INK_GRACE

    def _is_overdue(self) -> bool:
        return self._now() - self._offered_at > START_TIMEOUT

    def _is_unreported(self) -> bool:
        """Return True if the brick has reported nothing since the job was offered."""
        return self.progress is None or self.progress.t <= self._reported_before

    def why_not(self) -> str:
        """Return why none can be offered now, or ""."""
        if not self._link.has_brick:
            return _NO_BRICK
        return _BUSY if self.is_on else ""

    def offer(self, job: bytes, dry: bool, alone: bool) -> str:
        """Offer a job's file to the brick, see JobOffer."""
        reported = self._link.state().progress
        with tempfile.TemporaryDirectory(prefix="brickservo-") as folder:
            file = Path(folder) / "drawing.job"
            file.write_bytes(job)
            try:
                offer = JobOffer(file, alone=alone, dry=dry)
            except ArmError as error:
                return str(error).replace(str(file), "the drawing")
        self._reported_before = reported.t if reported else -1.0
        if not self._link.offer(offer):
            return "the link has just broken; it mends by itself, then start again"
        self._offered, self._offered_at = offer.draw, self._now()
        self._ended_at, self._stop = None, None
        return ""

    def order(self, what: str, value: float | None) -> str:
        """Send it an order of ORDERS, with what belongs to it."""
        if what not in ORDERS:
            return f"{what}: give one of {', '.join(ORDERS)}"
        order = Order(what, value)
        try:
            check_order(order)
        except ArmError as error:
            return str(error)
        if not self.is_on:
            return "nothing is drawn just now"
        return "" if self._link.send(order) else _NO_BRICK

    def stop(self, reason: str) -> None:
        """Stop everything: the order is sent again until the job has ended."""
        self._stop = Stop(reason) if self.is_on else None

    def state(self) -> JobState | None:
        """Return the state of the job; None: there is none."""
        if self._offered and self._is_unreported():
            return unreported_state(self._offered.name, self._is_overdue())
        if self.progress is None:
            return None
        alone = bool(self._offered and self._offered.alone)
        return reported_state(self.progress, not self._link.has_brick, alone)

    def handle(self, link: LinkState) -> JobUpdate | None:
        """Handle the brick's progress; return the update, None: none."""
        update, progress = None, link.progress
        if progress is not None and progress is not self.progress:
            changes_state = self.progress is None or self.progress.state != progress.state
            self.progress = progress
            t = self._now() - (link.progress_age or 0.0)
            update = JobUpdate(t, progress.down, changes_state)
            if self._stop and progress.state not in ENDS:
                self._link.send(self._stop)  # it gets lost with the link
        if progress is None or progress.state not in ENDS:
            self._ended_at = None
        else:
            self._stop = None
            if self._ended_at is None:
                self._ended_at = self._now()
        return update
