"""The gate of STOP: it takes a STOP whatever becomes of the page's own process.

It is a thread of the tracker's process, draws nothing, and answers two addresses: POST /stop stops
the arm; GET /pulse says several times a second that a STOP would get through.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from laptop.page.auth import BROWSER, AuthMiddleware, Receive, Scope, Send, send_text
from laptop.page.login import LoginKey

if TYPE_CHECKING:
    import uvicorn

PULSE_PERIOD = 0.25
"""Period of the signs of life, s."""
EXIT_TIMEOUT = 5.0
"""Time, s, that it has to end; importing what it serves by takes about one."""
MAX_STREAMS = 64
"""Greatest number of pages that hear them."""


class StopGate:
    """Serves the gate until it is closed.

    Args:
        stop: stops the arm for the browser with this number; answers as
            laptop.page.run_control.RunControl.stop does.
        key: signs the browsers' login cookies.
        listener: a socket that listens; it is taken over.
        hosts: HOST:PORT by which browsers may call it.
        pages: HOST:PORT of the pages that may do so.
    """

    def __init__(
        self,
        stop: Callable[[int], str],
        key: LoginKey,
        listener: socket.socket,
        hosts: Sequence[str],
        pages: Sequence[str],
    ) -> None:
        self._stop = stop
        self._listener = listener
        self._streams = 0
        self._server: uvicorn.Server | None = None
        self._over = threading.Event()
        self._app = AuthMiddleware(self._answer, key, hosts, pages, methods=("GET", "POST"))
        self._thread = threading.Thread(target=self._serve, name="stop gate", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End it, whoever still listens."""
        self._over.set()
        self._end(self._server)
        self._thread.join(EXIT_TIMEOUT)

    def _end(self, server: uvicorn.Server | None) -> None:
        if server:
            server.should_exit = server.force_exit = True

    def _serve(self) -> None:
        import uvicorn  # not above: who needs no page need not wait for it

        from laptop.page.http_limits import LimitedHttp

        config = uvicorn.Config(
            self._app,
            http=LimitedHttp,
            ws="none",
            lifespan="off",
            log_level="critical",
            access_log=False,
            server_header=False,
        )
        self._server = uvicorn.Server(config)
        if self._over.is_set():  # while all that was imported
            self._end(self._server)
        self._server.run(sockets=[self._listener])

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        asked = scope["method"], scope["path"]
        cors = _cors(scope)
        if asked == ("POST", "/stop"):
            # In a thread: whatever a stop may wait for, the next one is taken.
            why = await asyncio.to_thread(self._stop, scope[BROWSER])
            await send_text(send, 200, why, **cors)
        elif asked != ("GET", "/pulse"):
            await send_text(send, 404, "There is nothing at this address.", **cors)
        elif self._streams >= MAX_STREAMS:
            await send_text(send, 503, "Too many pages are open.", **cors)
        else:
            self._streams += 1
            try:
                await self._send_pulse(receive, send, cors)
            finally:
                self._streams -= 1

    async def _send_pulse(self, receive: Receive, send: Send, cors: Mapping[str, str]) -> None:
        """Send heartbeats until the browser is gone."""
        headers = {**cors, "content-type": "text/event-stream", "cache-control": "no-store"}
        named = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
        await send({"type": "http.response.start", "status": 200, "headers": named})
        message: dict[str, Any] = {"type": "http.request"}
        while message["type"] != "http.disconnect":
            pulse = {"type": "http.response.body", "body": b"data: .\n\n", "more_body": True}
            await send(pulse)
            with suppress(asyncio.TimeoutError):
                message = await asyncio.wait_for(receive(), PULSE_PERIOD)


def _cors(scope: Scope) -> dict[str, str]:
    """Return the headers by which a browser gives a page of ours what the gate answers."""
    for name, value in scope["headers"]:
        if name == b"origin":
            return {
                "access_control_allow_origin": value.decode("latin-1"),
                "access_control_allow_credentials": "true",
            }
    return {}
