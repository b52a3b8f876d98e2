"""The page's server: behind authentication, images to fetch and a page for each browser."""

from __future__ import annotations

import asyncio
import math
import socket
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection

import uvicorn
from fastapi import FastAPI, Request, Response
from nicegui import Client, core, ui
from nicegui import app as nice

from laptop.page.async_controller import AsyncChannel, AsyncController, csv_of
from laptop.page.auth import BROWSER, MAX_MESSAGE, AuthMiddleware
from laptop.page.browser import Page
from laptop.page.build_turns import TURN, BuildTurns
from laptop.page.cards.session import BrowserSession, browser_name
from laptop.page.http_limits import LimitedHttp
from laptop.page.interface import AdmissionCalls, DrawCalls, RunCalls, StatusCalls, SteeringCalls
from laptop.page.pulse import Pulse
from laptop.page.sessions import SessionKey
from laptop.page.silence import PageReport
from laptop.see.serve.listening import is_loopback, own_addresses

MAX_BUILDS = 4
"""Number of pages that are put together at the same time; others wait for their turn."""
DRAWING = "/drawing"
"""Path to which a page sends a file that is to be drawn."""
PRESENCE = "/presence"
"""Path to which a page sends a word of itself, see laptop.page.pulse: it may be its last."""
UNREAD = {"connection": "close"}
"""Headers of an answer after which nothing more is read of what was asked."""
MAX_FILE, FILE_TIMEOUT, MAX_UPLOADS = 8_000_000, 20.0, 4
"""Bytes of such a file, and time that it may take to come, s."""
BUILD_TIMEOUT = 60.0
"""Time that a page may take to be put together once it is its turn, s."""
MAX_MISSED = 2000
"""Messages that are kept for a browser that is away, and sent to it when it is back.

They must last for RECONNECT_TIMEOUT and for what it takes to notice that it is away: with 200, at
20 in a second, pages were loaded anew under somebody's hand.
"""
RECONNECT_TIMEOUT = 30.0
"""A browser that is back so soon finds its page as it was, and else loads it anew, s.

It may be away because this computer is busy: where the two had 10 s, pages were loaded anew while
somebody pressed something. (That nothing comes from it is known long before, see Pulse.)
"""


def serve(
    controller: AsyncController,
    pulse_pipe: Connection,
    listener: socket.socket,
    key: SessionKey,
    hosts: Sequence[str],
    gate_port: int,
) -> None:
    """Serve the page until the process ends.

    Args:
        controller: the tracker's.
        pulse_pipe: to it, for the pulse alone.
        listener: bound already.
        key: of the sessions.
        hosts: HOST:PORT by which browsers may call it.
        gate_port: of laptop.page.stop_gate.
    """
    channel = AsyncChannel(pulse_pipe)

    async def hear(heard: Mapping[int, float], report: PageReport) -> None:
        await channel.call(SteeringCalls.hear, heard, report)

    async def beat(page: str, t: float) -> None:
        await core.sio.emit("beat", t, room=page)

    pulse = Pulse(hear, beat)
    sessions: dict[int, BrowserSession] = {}  # the newest of each browser
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    @app.get("/view/{camera}/{index}.jpg")
    async def view(camera: str, index: int) -> Response:  # (threads are for what blocks)
        feed = controller.feeds.get(camera)
        shown = feed and (feed.shown.get(index) or feed.stills.get(index))
        if not shown:
            return Response(status_code=404)
        fresh = {"cache-control": "private, max-age=60"}
        return Response(shown.jpeg, media_type="image/jpeg", headers=fresh)

    @app.get("/history.csv")
    async def history() -> Response:
        named = {"content-disposition": "attachment; filename=history.csv"}
        return Response(csv_of(list(controller.past)), media_type="text/csv", headers=named)

    @app.get("/report")
    @app.get("/report/{number}")
    async def report(number: int | None = None) -> Response:
        drawn = await controller.report(number)
        if drawn is None:
            return Response("There is no report of such a run.", 404, media_type="text/plain")
        name, text = drawn
        named = {"content-disposition": f"inline; filename={name}", "cache-control": "no-store"}
        return Response(text, media_type="text/html", headers=named)

    @app.post(PRESENCE)
    async def presence(
        request: Request, page: str = "", word: str = "", stood: float | None = None
    ) -> Response:
        pulse.take_word(page, request.scope[BROWSER], word)
        if stood is not None and math.isfinite(stood):
            await controller.call(SteeringCalls.come_back, stood)
        return Response(status_code=204)

    uploads = asyncio.Semaphore(MAX_UPLOADS)

    @app.post(DRAWING)
    async def drawing(request: Request, name: str = "drawing") -> Response:
        if uploads.locked():
            return Response(f"{name[:80]}: other files are coming; try again soon", 503, UNREAD)
        try:
            async with uploads:
                data = await asyncio.wait_for(_body(request), FILE_TIMEOUT)
        except asyncio.TimeoutError:
            return Response(f"{name[:80]}: it took too long to come; try again", 408, UNREAD)
        if data is None:
            most = MAX_FILE // 1_000_000
            return Response(f"{name[:80]}: more than {most} MB; make it smaller", 413, UNREAD)
        who = browser_name(request.headers.get("user-agent", ""))
        why = await controller.call(SteeringCalls.claim, request.scope[BROWSER], who)
        why = why or await controller.call_slowly(DrawCalls.load, name, data)
        return Response(why, media_type="text/plain")

    @ui.page("/", response_timeout=BUILD_TIMEOUT)
    async def root() -> None:
        client = ui.context.client
        browser = _browser(client)
        session = BrowserSession(
            controller, browser, _name(client), age=lambda: pulse.age(client.id)
        )
        if browser in sessions:  # it goes on where it was: pages are also loaded anew unasked
            session.tool, session.folds = sessions[browser].tool, sessions[browser].folds
        sessions[browser] = session
        async with client.request.scope[TURN]:
            await Page(session, gate_port).build()

    @nice.exception_handler(404)
    async def unknown(request: Request, error: Exception) -> Response:
        return Response("There is nothing at this address.", 404, media_type="text/plain")

    async def on_connect(client: Client) -> None:
        controller.pages.add(client.id)
        pulse.join(client.id, _browser(client), _is_local(client))
        await controller.call(StatusCalls.arrived)
        # Who comes first steers.
        await controller.call(SteeringCalls.claim, _browser(client), _name(client))

    def on_disconnect(client: Client) -> None:
        if not client.has_socket_connection:  # it may have come back meanwhile
            controller.pages.discard(client.id)
            pulse.leave(client.id)

    def on_delete(client: Client) -> None:
        controller.pages.discard(client.id)
        pulse.leave(client.id)
        for feed in controller.feeds.values():
            feed.masks.pop(client.id, None)

    nice.on_connect(on_connect)
    nice.on_disconnect(on_disconnect)
    nice.on_delete(on_delete)

    @core.sio.on("echo")
    def on_echo(sid: str, t: object) -> None:
        for client in _clients(sid):
            pulse.take_echo(client.id, t)

    @core.sio.on("stop")
    async def on_stop(sid: str) -> str | None:
        for client in _clients(sid):
            name = await controller.call(SteeringCalls.name, _browser(client))
            return await controller.call(RunCalls.stop, name)
        return None

    async def begin() -> None:
        tasks.append(asyncio.create_task(pulse.run()))

    async def redeem(token: str) -> str:
        return await controller.call(AdmissionCalls.redeem, token)

    tasks: list[asyncio.Task[None]] = []  # a task that nobody keeps may vanish
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
        message_history_length=MAX_MISSED,
        tailwind=False,
        show_welcome_message=False,
    )
    config = uvicorn.Config(
        AuthMiddleware(
            BuildTurns(app, "/", MAX_BUILDS),
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


async def _body(request: Request) -> bytes | None:
    """Return what a request brings; None if it is more than is taken."""
    if int(request.headers.get("content-length") or 0) > MAX_FILE:
        return None
    data = bytearray()
    async for piece in request.stream():
        data += piece
        if len(data) > MAX_FILE:
            return None
    return bytes(data)


def _browser(client: Client) -> int:
    """Return the number of the browser that has a page open."""
    return client.request.scope[BROWSER]


def _is_local(client: Client) -> bool:
    """Return True if the browser that has a page open is on this computer."""
    address = client.request.client
    host = address.host.removeprefix("::ffff:") if address else ""
    return is_loopback(host) or host in own_addresses()


def _name(client: Client) -> str:
    """Return what a browser is, for people."""
    return browser_name(client.request.headers.get("user-agent", ""))


def _clients(sid: str) -> list[Client]:
    """Return the page, if any, that a socket belongs to: its room is named after it."""
    rooms = core.sio.rooms(sid)
    return [Client.instances[room] for room in rooms if room in Client.instances]
