"""The link to the brick, as the page's side of the tracker uses it."""

from __future__ import annotations

from typing import Protocol

from laptop.see.serve.job_offer import JobOffer
from laptop.see.serve.server_state import ServerState as LinkState
from shared.job_messages import Order
from shared.messages import Start, Stop


class Server(Protocol):
    """Part of the tracking server that the page uses."""

    def send(self, message: Start | Stop | Order) -> bool: ...  # noqa: D102
    def offer(self, offer: JobOffer) -> bool: ...  # noqa: D102
    def state(self) -> LinkState: ...  # noqa: D102
    def commands(self) -> list[str]: ...  # noqa: D102


class BrickLink:
    """A server's link to the brick; without a server no brick is ever there.

    Args:
        server: of the brick, or None.
    """

    def __init__(self, server: Server | None) -> None:
        self._server = server

    @property
    def is_served(self) -> bool:
        """Whether a brick may come."""
        return self._server is not None

    @property
    def has_brick(self) -> bool:
        """Whether a brick is linked."""
        return self.state().client is not None

    def state(self) -> LinkState:
        """Return the state of the link."""
        return self._server.state() if self._server else LinkState()

    def send(self, message: Start | Stop | Order) -> bool:
        """Send the brick a message; return whether there is one."""
        return bool(self._server and self._server.send(message))

    def offer(self, offer: JobOffer) -> bool:
        """Offer the brick a job; return whether there is one."""
        return bool(self._server and self._server.offer(offer))

    def commands(self) -> tuple[str, ...]:
        """Return what to type so that a brick comes."""
        return tuple(self._server.commands() if self._server else ())
