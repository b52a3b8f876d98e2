"""Limit of the pages that are built at the same time; the timeout of a build starts with it."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import Any

from laptop.page.auth import Receive, Scope, Send

BUILD_SLOT = "brickservo.turn"
"""Key of the slot in a page's scope: an asynchronous context, whose exit frees the slot."""


class BuildLimiter:
    """ASGI middleware that limits how many pages are built at the same time.

    A page that waits here has not begun.  NiceGUI does not know it yet: it would time out a page
    that takes long, and delete one that no browser has joined for a minute.

    Args:
        app: the ASGI application behind it.
        path: of the page.
        most: number of pages that are built at the same time.
    """

    def __init__(self, app: Any, path: str, most: int) -> None:
        self._app, self._path = app, path
        self._slots = asyncio.Semaphore(most)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request or connection, see ASGI."""
        if scope["type"] != "http" or scope["path"] != self._path:
            await self._app(scope, receive, send)
            return
        async with AsyncExitStack() as slot:
            await slot.enter_async_context(self._slots)
            scope[BUILD_SLOT] = slot  # exited when the page is built, or here, if it never is
            await self._app(scope, receive, send)
