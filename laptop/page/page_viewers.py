"""Whether a browser has the page open."""

from __future__ import annotations

import math
from collections.abc import Callable

VIEWER_TIMEOUT = 5.0
"""Time without a question, s, after which the page counts as closed."""
PAGE_OPEN_TIMEOUT = 60.0
"""Time that a browser may take to open the page, s."""


class PageViewers:
    """Knows by the page's questions whether somebody has it open.

    Args:
        now: a clock, s.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._last_question = self._expected_until = -math.inf  # s

    @property
    def are_there(self) -> bool:
        """Whether a browser has the page open, or is expected to."""
        now = self._now()
        return now - self._last_question < VIEWER_TIMEOUT or now < self._expected_until

    def expect(self) -> None:
        """Expect a browser to open the page."""
        self._expected_until = self._now() + PAGE_OPEN_TIMEOUT

    def arrive(self) -> None:
        """Handle that a browser has the page, which polls from now on: expect none any more."""
        self._last_question, self._expected_until = self._now(), -math.inf

    def ask(self) -> None:
        """Record a poll."""
        self._last_question = self._now()
