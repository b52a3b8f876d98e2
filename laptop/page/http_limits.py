"""HTTP with limits: a client that never finishes a request delays others only briefly."""

from __future__ import annotations

import asyncio
from typing import ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

REQUEST_TIMEOUT = 5.0
"""Time that a request may take to come in, s."""
MAX_UNFINISHED = 32
"""Greatest number of unfinished requests; one more ends the oldest."""
GRACE = 0.25
"""A request that is in after this, s, was never on its way: many may come at the same moment."""


class LimitedHttp(H11Protocol):
    """uvicorn's HTTP/1.1, of which unfinished requests end after a while and are few."""

    _on_their_way: ClassVar[dict[LimitedHttp, None]] = {}  # the oldest first

    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first request."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(GRACE, self._count)

    def data_received(self, data: bytes) -> None:
        """Receive data; a request that is complete has no timeout any more."""
        super().data_received(data)
        if self._is_waiting():
            self._timer = self._timer or self.loop.call_later(GRACE, self._count)
        else:
            self._forget()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._forget()
        super().connection_lost(exc)

    def _is_waiting(self) -> bool:
        """Return True if no request is complete, or what comes belongs to one that is answered."""
        if self.transport.get_protocol() is not self:
            return False  # a WebSocket now
        return self.cycle is None or self.cycle.response_complete

    def _count(self) -> None:
        self._on_their_way[self] = None
        self._timer = self.loop.call_later(REQUEST_TIMEOUT - GRACE, self.transport.abort)
        if len(self._on_their_way) > MAX_UNFINISHED:
            oldest = next(iter(self._on_their_way))
            oldest._forget()
            oldest.transport.abort()

    def _forget(self) -> None:
        self._on_their_way.pop(self, None)
        if self._timer:
            self._timer.cancel()
            self._timer = None
