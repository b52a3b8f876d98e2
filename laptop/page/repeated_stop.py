"""A stop that is said again until the brick has heard it: it gets lost with the link."""

from __future__ import annotations

from laptop.page.brick_link import BrickLink
from shared.messages import Status, Stop


class RepeatedStop:
    """The stop of a run.

    Args:
        link: to the brick.

    Attributes:
        was_sent: whether there was a link when it was said last.
    """

    def __init__(self, link: BrickLink) -> None:
        self._link = link
        self._reason = ""
        self.was_sent = False
        self._told: Status | None = None  # the brick's status when it was last told to stop

    def begin(self, reason: str) -> None:
        """Take in why the next run is to stop."""
        self._reason, self._told = reason, None

    def send(self) -> None:
        """Say it."""
        self.was_sent = self._link.send(Stop(self._reason))

    def repeat(self, status: Status | None) -> None:
        """Say it once more with every new status of the brick's."""
        if status is not self._told:
            self._told = status
            self.send()
