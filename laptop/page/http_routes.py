"""Routes of a page besides its socket: pictures, points, reports, files, words."""

from __future__ import annotations

import asyncio
import math

from fastapi import FastAPI, Request, Response

from laptop.page.async_controller import AsyncController, csv_of
from laptop.page.auth import BROWSER
from laptop.page.cards.browser_state import browser_name
from laptop.page.interface import DrawCalls, SteeringCalls
from laptop.page.pulse import Pulse

DRAWING = "/drawing"
"""Path to which a page sends a file that is to be drawn."""
PRESENCE = "/presence"
"""Path to which a page sends a word of itself, see laptop.page.pulse: it may be its last."""
UNREAD = {"connection": "close"}
"""Headers of an answer after which nothing more is read of what was asked."""
MAX_FILE, FILE_TIMEOUT, MAX_UPLOADS = 8_000_000, 20.0, 4
"""Bytes of such a file, and time that it may take to come, s."""


class HttpRoutes:
    """Answers requests of pages.

    Args:
        controller: the tracker's.
        pulse: takes in what a page says of itself.
    """

    def __init__(self, controller: AsyncController, pulse: Pulse) -> None:
        self._controller, self._pulse = controller, pulse
        self._uploads = asyncio.Semaphore(MAX_UPLOADS)

    def add_to(self, app: FastAPI) -> None:
        """Have an application answer them."""
        app.get("/view/{camera}/{index}.jpg")(self.view)
        app.get("/history.csv")(self.history)
        app.get("/report")(self.report)
        app.get("/report/{number}")(self.report)
        app.post(PRESENCE)(self.presence)
        app.post(DRAWING)(self.drawing)

    async def view(self, camera: str, index: int) -> Response:  # (threads are for what blocks)
        """Return a frame of a camera."""
        feed = self._controller.feeds.get(camera)
        shown = feed and (feed.shown.get(index) or feed.stills.get(index))
        if not shown:
            return Response(status_code=404)
        fresh = {"cache-control": "private, max-age=60"}
        return Response(shown.jpeg, media_type="image/jpeg", headers=fresh)

    async def history(self) -> Response:
        """Return the points of the plots."""
        named = {"content-disposition": "attachment; filename=history.csv"}
        points = csv_of(list(self._controller.past))
        return Response(points, media_type="text/csv", headers=named)

    async def report(self, number: int | None = None) -> Response:
        """Return the report of a run, by default of the newest."""
        drawn = await self._controller.report(number)
        if drawn is None:
            return Response("There is no report of such a run.", 404, media_type="text/plain")
        name, text = drawn
        named = {"content-disposition": f"inline; filename={name}", "cache-control": "no-store"}
        return Response(text, media_type="text/html", headers=named)

    async def presence(
        self, request: Request, page: str = "", word: str = "", stood: float | None = None
    ) -> Response:
        """Handle a page's report of its presence, and of its standstill, s."""
        self._pulse.on_presence(page, request.scope[BROWSER], word)
        if stood is not None and math.isfinite(stood):
            await self._controller.call(SteeringCalls.report_return, stood)
        return Response(status_code=204)

    async def drawing(self, request: Request, name: str = "drawing") -> Response:
        """Take a file that is to be drawn; the answer is why it cannot be, or ""."""
        shown = name[:80]
        if self._uploads.locked():
            return Response(f"{shown}: other files are coming; try again soon", 503, UNREAD)
        try:
            async with self._uploads:
                data = await asyncio.wait_for(_body(request), FILE_TIMEOUT)
        except asyncio.TimeoutError:
            return Response(f"{shown}: it took too long to come; try again", 408, UNREAD)
        if data is None:
            most = MAX_FILE // 1_000_000
            return Response(f"{shown}: more than {most} MB; make it smaller", 413, UNREAD)
        who = browser_name(request.headers.get("user-agent", ""))
        why = await self._controller.call(SteeringCalls.claim, request.scope[BROWSER], who)
        why = why or await self._controller.call_slowly(DrawCalls.load, name, data)
        return Response(why, media_type="text/plain")


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
