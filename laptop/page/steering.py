"""Steering: of the browsers that have the page open one gives orders; the others watch."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping

UNHEARD_TIMEOUT = 2.0
"""Time, s, after which a browser that is not heard counts as gone: its run is held."""
RELEASE_TIMEOUT = 10.0
"""Time, s, after which a browser that is not heard steers no longer: whoever orders next does."""


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
        self.driver = 0
        self.beats = 0

    def hear(self, browsers: Mapping[int, float]) -> None:
        """Take in that the page is there, and which browsers it has heard.

        Args:
            browsers: their numbers, each with the time at which it was heard last, s on the
                clock: how long ago that was may have changed on the way.
        """
        with self._lock:
            self.beats += 1
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
