"""A stop that is sent again until the brick has received it: a lost link loses it."""

from __future__ import annotations

from laptop.page.brick_link import BrickLink
from shared.messages import Status, Stop


class RepeatedStop:
    """The stop of a run.

    Args:
        link: to the brick.

    Attributes:
        was_sent: whether there was a link when it was sent last.
    """

    def __init__(self, link: BrickLink) -> None:
        self._link = link
        self._reason = ""
        self.was_sent = False
        self._last_status: Status | None = None  # of the brick when the stop was last sent

    def begin(self, reason: str) -> None:
        """Set why the next run is to stop."""
        self._reason, self._last_status = reason, None

    def send(self) -> None:
        """Send the stop."""
        self.was_sent = self._link.send(Stop(self._reason))

    def repeat(self, status: Status | None) -> None:
        """Send it once more with every new status of the brick."""
        if status is not self._last_status:
            self._last_status = status
            self.send()
