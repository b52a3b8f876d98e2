"""Authentication of the page's browsers by a token, and only from pages of its own.

What another page makes a browser send here is refused.
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any
from urllib.parse import parse_qs

MAX_MESSAGE = 64 * 1024
"""Bytes of a message from a browser; the page's own need a few hundred."""

Scope = Mapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]


class AuthMiddleware:
    """ASGI middleware that lets nobody in without the token, nor from elsewhere.

    The address with the token gives a cookie, and is left at once; from then on the cookie is
    asked for, with everything.

    Args:
        app: the ASGI application behind it.
        token: the secret.
        hosts: HOST:PORT by which browsers may call it.
    """

    def __init__(self, app: Any, token: str, hosts: Sequence[str]) -> None:
        self._app = app
        self._token = token
        self._hosts = frozenset(hosts)
        self._origins = frozenset(f"http://{host}" for host in hosts)
        # Cookies know no ports: two pages on one machine would take each other's away.
        self._cookie = f"brickservo-{hosts[0].rpartition(':')[2]}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request or connection, see ASGI."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        why = self._refusal(scope, headers)
        if why is None and scope["type"] == "http" and self._has_token(scope):
            await self._send_cookie(send)
        elif why is None and self._has_cookie(headers):
            await self._app(
                scope, receive, send if scope["type"] != "http" else _with_headers(send)
            )
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            # What may follow the head is not even thrown away.
            await _send_text(send, 403, why or NO_TOKEN, connection="close")

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> str | None:
        """Return why a request is refused whoever sends it, or None."""
        if headers.get("host", "").lower() not in self._hosts:
            return "This page is not to be reached by that name."
        origin = headers.get("origin")
        if origin is None and scope["type"] == "websocket":
            return "No browser connects like that."
        if origin is not None and origin.lower() not in self._origins:
            return "Another page has no business here."
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD"):
            return "There is nothing to be sent here."
        return None

    def _has_token(self, scope: Scope) -> bool:
        """Return True if the token is in the address."""
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [])
        return any(self._is_token(token) for token in given)

    def _has_cookie(self, headers: Mapping[str, str]) -> bool:
        """Return True if the cookie with the token came along."""
        # By hand: a parser gives up at cookies of other programs that are none.
        cookies = (part.strip().partition("=") for part in headers.get("cookie", "").split(";"))
        return any(name == self._cookie and self._is_token(value) for name, _, value in cookies)

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), self._token.encode())

    async def _send_cookie(self, send: Send) -> None:
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Lax"
        await _send_text(send, 303, "", location="/", set_cookie=cookie)


NO_TOKEN = (
    "Open the address that the tracker prints: it holds a token, without which nobody gets in. "
    "Each start of the tracker has a new one."
)

SECURITY_HEADERS = {
    # Nothing comes from elsewhere, nothing goes there, and no other page shows this one in itself.
    "content-security-policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    "frame-ancestors 'none'; base-uri 'self'; form-action 'none'",
    "x-frame-options": "DENY",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
}


def _headers(more: Mapping[str, str]) -> list[tuple[bytes, bytes]]:
    """Return these headers and those for security, as ASGI wants them."""
    return [
        (key.replace("_", "-").encode(), value.encode())
        for key, value in {**SECURITY_HEADERS, **more}.items()
    ]


async def _send_text(send: Send, status: int, text: str, **headers: str) -> None:
    headers.update(content_type="text/plain; charset=utf-8", cache_control="no-store")
    await send({"type": "http.response.start", "status": status, "headers": _headers(headers)})
    await send({"type": "http.response.body", "body": text.encode()})


def _with_headers(send: Send) -> Send:
    """Add to every answer the headers that keep other pages out."""

    async def send_with_headers(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message["headers"], *_headers({})]}
        await send(message)

    return send_with_headers
