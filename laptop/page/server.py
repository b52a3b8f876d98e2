"""The page's server: behind authentication, images to fetch and a page for each browser."""

from __future__ import annotations

import socket
from collections.abc import Sequence

import uvicorn
from fastapi import FastAPI, Response
from nicegui import Client, core, ui
from nicegui import app as nice

from laptop.page.async_controller import AsyncController, csv_of
from laptop.page.auth import MAX_MESSAGE, AuthMiddleware
from laptop.page.browser import Page


def serve(
    controller: AsyncController, listener: socket.socket, token: str, hosts: Sequence[str]
) -> None:
    """Serve the page until the process ends.

    Args:
        controller: the tracker's.
        listener: bound already.
        token: lets a browser in.
        hosts: HOST:PORT by which browsers may call it.
    """
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

    async def root() -> None:
        await Page(controller).build()

    def on_connect(client: Client) -> None:
        controller.pages.add(client.id)

    def on_disconnect(client: Client) -> None:
        if not client.has_socket_connection:  # it may have come back meanwhile
            controller.pages.discard(client.id)

    def on_delete(client: Client) -> None:
        controller.pages.discard(client.id)
        for feed in controller.feeds.values():
            feed.masks.pop(client.id, None)

    nice.on_connect(on_connect)
    nice.on_disconnect(on_disconnect)
    nice.on_delete(on_delete)
    # Its own socket would take every origin; and what is polled is posted, which is refused.
    core.sio.eio.cors_allowed_origins = [f"http://{host}" for host in hosts]
    core.sio.eio.transports = ["websocket"]
    nice.config.socket_io_js_transports = ["websocket"]
    ui.run_with(
        app,
        root=root,
        title="BrickServo",
        dark=None,
        language="en-US",
        reconnect_timeout=10.0,
        message_history_length=200,
        tailwind=False,
        show_welcome_message=False,
    )
    config = uvicorn.Config(
        AuthMiddleware(app, token, hosts),
        log_level="critical",  # addresses hold the token
        access_log=False,
        ws="wsproto",
        ws_per_message_deflate=False,  # takes longer than a network that is near
        ws_max_size=MAX_MESSAGE,
        server_header=False,
    )
    uvicorn.Server(config).run(sockets=[listener])
