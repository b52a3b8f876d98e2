"""Turns: pages are put together a few at a time, and who waits for that is not late yet."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import Any

from laptop.page.auth import Receive, Scope, Send

TURN = "brickservo.turn"
"""Key of a page's scope under which its turn is, an asynchronous context: left, it is over."""


class BuildTurns:
    """ASGI middleware that lets few pages be put together at the same time.

    A page that waits here has not begun.  What makes pages does not know of it yet: it would give
    up one that takes long, and clear away one that no browser has joined for a minute.

    Args:
        app: the ASGI application behind it.
        path: of the page.
        most: number of pages that have their turn at the same time.
    """

    def __init__(self, app: Any, path: str, most: int) -> None:
        self._app, self._path = app, path
        self._turns = asyncio.Semaphore(most)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request or connection, see ASGI."""
        if scope["type"] != "http" or scope["path"] != self._path:
            await self._app(scope, receive, send)
            return
        async with AsyncExitStack() as turn:
            await turn.enter_async_context(self._turns)
            scope[TURN] = turn  # left when it is put together, or here, if it never was
            await self._app(scope, receive, send)
