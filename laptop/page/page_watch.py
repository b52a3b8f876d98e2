"""Watchdog of the page: holds a run when no page is heard any more, and reports why."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from laptop.page.run_control import RunControl
from laptop.page.silence import BUSY_DELAY, Evidence, settled, verdict
from laptop.page.steering import BROWSER_TIMEOUT, Steering


class PageWatch:
    """Watchdog that holds runs that a page has ordered when no page is heard any more.

    Args:
        steering: gives the time since pages were heard.
        runs: the runs to hold.
        clock: of the pages, s.
        holds: whether to hold them.

    Attributes:
        why_page_stands: returns what keeps the page's process from going on, as "was stopped by a
            signal", or "".
    """

    def __init__(
        self, steering: Steering, runs: RunControl, clock: Callable[[], float], holds: bool
    ) -> None:
        self._steering, self._runs, self._clock, self._holds = steering, runs, clock, holds
        self.why_page_not_running: Callable[[], str] = lambda: ""
        self._page_ended = -math.inf, ""  # when, s, and how
        self._pauses: deque[tuple[float, float]] = deque(maxlen=64)  # until when, how long, s
        self._open_note = ""  # of a hold that a browser can settle once it is back
        self._last_heartbeat = math.inf  # s

    def lose_page(self, why: str) -> None:
        """Handle that the page's process is replaced; `why` is the reason."""
        self._page_ended = self._clock(), why

    def notice_standstill(self) -> None:
        """Record a standstill of this process since its last heartbeat, if there was one."""
        now = self._clock()
        if (pause := now - self._last_heartbeat) > BUSY_DELAY:
            self._pauses.append((now, pause))
        self._last_heartbeat = now

    def poll(self) -> None:
        """Hold the run after a timeout; complete the reason once a browser is back."""
        silence = self._steering.silence
        if self._holds and silence > BROWSER_TIMEOUT and self._runs.is_driven:
            why = verdict(self._evidence(silence))
            self._runs.hold_on_timeout(silence, why)
            self._open_note = self._runs.note if why.is_open else ""
        if (stood := self._steering.pop_return()) is not None:
            if self._open_note and self._runs.note == self._open_note:
                self._runs.note += f" {settled(stood)}"
            self._open_note = ""

    def _evidence(self, silence: float) -> Evidence:
        """Return the evidence of why no page was heard for `silence` s."""
        since = self._clock() - silence
        ended_at, ended = self._page_ended
        return self._steering.evidence()._replace(
            ended=ended if ended_at >= since else self.why_page_not_running(),
            standstill=max([0.0, *(min(pause, t - since) for t, pause in self._pauses)]),
        )
