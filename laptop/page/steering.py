"""Steering: one of the browsers that have the page open gives orders; the others watch."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping

from laptop.page.silence import Evidence, PageReport

BROWSER_TIMEOUT = 2.0
"""Silence of a browser, s, after which it counts as gone: its run is held."""
RELEASE_TIMEOUT = 10.0
"""Silence of a browser, s, after which it steers no longer: the next one that orders does."""

NO_REPORT = PageReport()


class Steering:
    """Who steers, and when each browser was heard last; from any thread.

    Args:
        now: a clock, s, that goes on whatever the camera does, and is the page's process's, too.

    Attributes:
        driver: number of the browser that steers; 0: nobody does yet.
        beats: number of times that the page was heard, with a browser or without.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._lock = threading.Lock()
        self._names: dict[int, str] = {}
        self._last_heard_at: dict[int, float] = {}  # s
        self._report = PageReport()  # the last
        self._reports: deque[tuple[float, PageReport]] = deque(maxlen=64)  # when it came, s
        self._last_beat_at = now()  # s
        self._standstill: float | None = None  # s
        self.driver = 0
        self.beats = 0

    def on_status(self, browsers: Mapping[int, float], report: PageReport = NO_REPORT) -> None:
        """Handle the page's status: it is alive, and has heard these browsers.

        Args:
            browsers: their numbers, each with the time at which it was heard last, s on the
                clock: how long ago that was may have changed on the way.
            report: the page's own state.
        """
        with self._lock:
            self.beats += 1
            self._last_beat_at = self._now()
            self._report = report
            self._reports.append((self._last_beat_at, report))
            for browser, t in browsers.items():
                self._last_heard_at[browser] = max(self._last_heard_at.get(browser, t), t)

    def claim(self, browser: int, name: str) -> str:
        """Return "" if a browser steers, or does from now on as nobody else is there; or who does.

        Args:
            browser: its number.
            name: what it is, for people.
        """
        with self._lock:
            self._names[browser] = name
            if self.driver not in (0, browser) and self._silence(self.driver) < RELEASE_TIMEOUT:
                return f"{self._name(self.driver)} steers; press Take over first"
            self._set_driver(browser)
            return ""

    def take_over(self, browser: int, name: str) -> None:
        """Let a browser steer from now on, whoever did before."""
        with self._lock:
            self._names[browser] = name
            self._set_driver(browser)

    def name(self, browser: int) -> str:
        """Return a browser's name for people; "" of browser 0, which is nobody."""
        with self._lock:
            return self._name(browser) if browser else ""

    @property
    def silence(self) -> float:
        """Time since any browser was heard, s: each may STOP; 0 while nobody steers."""
        with self._lock:
            return min(map(self._silence, self._last_heard_at)) if self.driver else 0.0

    def report_return(self, standstill: float) -> None:
        """Report that a browser is back after a silence, and how long it stood still itself, s."""
        with self._lock:
            self._standstill = standstill

    def pop_return(self) -> float | None:
        """Return the last standstill of `report_return`, s, once; None: none since."""
        with self._lock:
            standstill, self._standstill = self._standstill, None
            return standstill

    def evidence(self) -> Evidence:
        """Return what the page's process has reported about a silence."""
        with self._lock:
            now = self._now()
            last = min(self._last_heard_at, key=self._silence, default=0)
            since = now - self._silence(last) if last else now
            lately = [report for t, report in self._reports if t >= since]
            return Evidence(
                browser=self._name(last) if last else "",
                sign=self._report.signs.get(last),
                unbeaten=now - self._last_beat_at,
                late=max((report.late for report in lately), default=0.0),
                waited=max((report.waited for report in lately), default=0.0),
            )

    def _set_driver(self, browser: int) -> None:
        self.driver = browser
        self._last_heard_at.setdefault(browser, self._now())

    def _name(self, browser: int) -> str:
        return browser_title(browser, self._names.get(browser, ""))

    def _silence(self, browser: int) -> float:
        return self._now() - self._last_heard_at.get(browser, self._now())


def browser_title(browser: int, name: str) -> str:
    """Return a browser's number and what it is, for people."""
    return f"browser {browser}" + (f" ({name})" if name else "")
