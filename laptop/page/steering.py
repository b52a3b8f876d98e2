"""Steering: of the browsers that have the page open one gives orders; the others watch."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping

from laptop.page.silence import Evidence, PageReport

UNHEARD_TIMEOUT = 2.0
"""Time, s, after which a browser that is not heard counts as gone: its run is held."""
RELEASE_TIMEOUT = 10.0
"""Time, s, after which a browser that is not heard steers no longer: whoever orders next does."""

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
        self._heard: dict[int, float] = {}  # s
        self._report = PageReport()  # the last
        self._reports: deque[tuple[float, PageReport]] = deque(maxlen=64)  # when it came, s
        self._beaten = now()  # s
        self._stood: float | None = None  # s
        self.driver = 0
        self.beats = 0

    def hear(self, browsers: Mapping[int, float], report: PageReport = NO_REPORT) -> None:
        """Take in that the page is there, and which browsers it has heard.

        Args:
            browsers: their numbers, each with the time at which it was heard last, s on the
                clock: how long ago that was may have changed on the way.
            report: what the page's process knows beside that.
        """
        with self._lock:
            self.beats += 1
            self._beaten = self._now()
            self._report = report
            self._reports.append((self._beaten, report))
            for browser, t in browsers.items():
                self._heard[browser] = max(self._heard.get(browser, t), t)

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
            self._seat(browser)
            return ""

    def take(self, browser: int, name: str) -> None:
        """Let a browser steer from now on, whoever did before."""
        with self._lock:
            self._names[browser] = name
            self._seat(browser)

    def name(self, browser: int) -> str:
        """Return a browser's name for people; "" of browser 0, which is nobody."""
        with self._lock:
            return self._name(browser) if browser else ""

    @property
    def silence(self) -> float:
        """Time since any browser was heard, s: each may STOP; 0 while nobody steers."""
        with self._lock:
            return min(map(self._silence, self._heard)) if self.driver else 0.0

    def come_back(self, stood: float) -> None:
        """Take in that a browser was not heard, is back, and stood still itself for so long, s."""
        with self._lock:
            self._stood = stood

    def take_return(self) -> float | None:
        """Return what `come_back` was given last, once; None: nothing since."""
        with self._lock:
            stood, self._stood = self._stood, None
            return stood

    def evidence(self) -> Evidence:
        """Return what the page's process has told of why no page is heard."""
        with self._lock:
            now = self._now()
            last = min(self._heard, key=self._silence, default=0)
            since = now - self._silence(last) if last else now
            lately = [report for t, report in self._reports if t >= since]
            return Evidence(
                browser=self._name(last) if last else "",
                sign=self._report.signs.get(last),
                unbeaten=now - self._beaten,
                late=max((report.late for report in lately), default=0.0),
                waited=max((report.waited for report in lately), default=0.0),
            )

    def _seat(self, browser: int) -> None:
        self.driver = browser
        self._heard.setdefault(browser, self._now())

    def _name(self, browser: int) -> str:
        return browser_title(browser, self._names.get(browser, ""))

    def _silence(self, browser: int) -> float:
        return self._now() - self._heard.get(browser, self._now())


def browser_title(browser: int, name: str) -> str:
    """Return a browser's number and what it is, for people."""
    return f"browser {browser}" + (f" ({name})" if name else "")
