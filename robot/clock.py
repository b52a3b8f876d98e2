"""The brick's clock: the only place in `robot/` that asks the system for the time."""

import time

MYPY = False
if MYPY:
    from typing import Protocol  # noqa: F401

    class Timepiece(Protocol):
        """A Clock, or what passes time in its stead."""

        def now(self):
            # type: () -> float
            """Return the seconds since some moment in the past."""

        def sleep(self, seconds):
            # type: (float) -> None
            """Wait for so many seconds."""


class Clock(object):
    """Monotonic time: the image's wall clock jumps when it finds a time server."""

    def now(self):
        # type: () -> float
        """Return the seconds since some moment in the past."""
        return time.monotonic()

    def sleep(self, seconds):
        # type: (float) -> None
        """Wait for so many seconds; return at once if they are none or negative."""
        if seconds > 0:
            time.sleep(seconds)
