"""The page's server: behind authentication, images to fetch and a page for each browser."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection

import uvicorn
from fastapi import FastAPI
from nicegui import app as nice
from nicegui import core, ui

from laptop.page.async_controller import AsyncChannel, AsyncController
from laptop.page.auth import MAX_MESSAGE, AuthMiddleware
from laptop.page.build_limiter import BuildLimiter
from laptop.page.http_limits import LimitedHttp
from laptop.page.http_routes import DRAWING, PRESENCE, HttpRoutes
from laptop.page.interface import AdmissionCalls, SteeringCalls
from laptop.page.login import LoginKey
from laptop.page.page_clients import PageClients
from laptop.page.pulse import Pulse
from laptop.page.silence import PageReport

MAX_BUILDS = 4
"""Number of pages that are put together at the same time; others wait for their turn."""
MAX_KEPT_MESSAGES = 2000
"""Greatest number of messages that are kept for a browser that is away, and sent to it when it is
back.

They must last for RECONNECT_TIMEOUT and for what it takes to notice that it is away: with 200, at
20 in a second, pages were loaded anew under somebody's hand.
"""
RECONNECT_TIMEOUT = 30.0
"""Longest absence of a browser that finds its page as it was, s; later it loads the page anew.

It may be away because this computer is busy: where the two had 10 s, pages were loaded anew while
somebody pressed something. (That nothing comes from it is known long before, see Pulse.)
"""


def serve(
    controller: AsyncController,
    pulse_pipe: Connection,
    listener: socket.socket,
    key: LoginKey,
    hosts: Sequence[str],
    gate_port: int,
) -> None:
    """Serve the page until the process ends.

    Args:
        controller: the tracker's.
        pulse_pipe: to it, for the pulse alone.
        listener: bound already.
        key: signs the browsers' login cookies.
        hosts: HOST:PORT by which browsers may call it.
        gate_port: of laptop.page.stop_gate.
    """
    pulse = _pulse(AsyncChannel(pulse_pipe))
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    HttpRoutes(controller, pulse).add_to(app)
    PageClients(controller, pulse, gate_port).serve()
    _run_pages_with(app, pulse, hosts)

    async def redeem(token: str) -> str:
        return await controller.call(AdmissionCalls.redeem, token)

    config = uvicorn.Config(
        AuthMiddleware(
            BuildLimiter(app, "/", MAX_BUILDS),
            *(key, hosts, hosts),
            posts=[DRAWING, PRESENCE],
            redeem=redeem,
            gate_port=gate_port,
        ),
        http=LimitedHttp,
        log_level="critical",  # addresses hold the token
        access_log=False,
        ws="wsproto",
        ws_per_message_deflate=False,  # takes longer than a network that is near
        ws_max_size=MAX_MESSAGE,
        server_header=False,
    )
    uvicorn.Server(config).run(sockets=[listener])


def _pulse(channel: AsyncChannel) -> Pulse:
    """Return the pulse of all pages; the channel is for it alone."""

    async def report_status(last_heard_at: Mapping[int, float], report: PageReport) -> None:
        await channel.call(SteeringCalls.on_status, last_heard_at, report)

    async def beat(page: str, t: float) -> None:
        await core.sio.emit("beat", t, room=page)

    return Pulse(report_status, beat)


def _run_pages_with(app: FastAPI, pulse: Pulse, hosts: Sequence[str]) -> None:
    """Let an application serve NiceGUI's pages, and give them their pulse once it runs."""
    tasks: list[asyncio.Task[None]] = []  # a task without a reference may be collected

    async def begin() -> None:
        tasks.append(asyncio.create_task(pulse.run()))

    nice.on_startup(begin)
    # Its own socket would take every origin; and what is polled is posted, which is refused.
    core.sio.eio.cors_allowed_origins = [f"http://{host}" for host in hosts]
    core.sio.eio.transports = ["websocket"]
    nice.config.socket_io_js_transports = ["websocket"]
    ui.run_with(
        app,
        title="BrickServo",
        dark=None,
        language="en-US",
        reconnect_timeout=RECONNECT_TIMEOUT,
        message_history_length=MAX_KEPT_MESSAGES,
        tailwind=False,
        show_welcome_message=False,
    )
