"""Authentication of the page's browsers by their cookies, and only from pages of its own.

What another page makes a browser send here is refused.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Any
from urllib.parse import parse_qs

from laptop.page.login import LoginKey

MAX_MESSAGE = 64 * 1024
"""Bytes of a message from a browser; the page's own need a few hundred."""
BROWSER = "brickservo.browser"
"""Key of an ASGI scope: number of the browser that asks."""

Scope = dict[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
RedeemToken = Callable[[str], Awaitable[str]]
"""Exchange of a token for a cookie, or ""; see laptop.page.login.Admission."""


class AuthMiddleware:
    """ASGI middleware that refuses requests without a cookie, and from other origins.

    The address with the token gives a cookie, and is left at once; from then on the cookie is
    asked for, with everything.

    Args:
        app: the ASGI application behind it; in its scopes the browser's number is under BROWSER.
        key: signs the browsers' login cookies.
        hosts: HOST:PORT by which browsers may call it.
        pages: HOST:PORT of the pages that may do so.
        methods: of HTTP that it takes.
        posts: paths to which pages may also POST.
        redeem: makes a cookie of a token; None: nobody gets one here.
        gate_port: of laptop.page.stop_gate, which pages may call, too; None: they may not.
    """

    def __init__(
        self,
        app: Any,
        key: LoginKey,
        hosts: Sequence[str],
        pages: Sequence[str],
        methods: Sequence[str] = ("GET", "HEAD"),
        posts: Sequence[str] = (),
        redeem: RedeemToken | None = None,
        gate_port: int | None = None,
    ) -> None:
        self._app = app
        self._key = key
        self._hosts = frozenset(hosts)
        self._origins = frozenset(f"http://{host}" for host in pages)
        self._methods = methods
        self._posts = frozenset(posts)
        self._redeem = redeem
        self._gate_port = gate_port
        # Cookies know no ports: two pages on one machine would take each other's away.
        self._cookie = f"brickservo-{pages[0].rpartition(':')[2]}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request or connection, see ASGI."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        why = self._refusal(scope, headers)
        browser = 0 if why else self._browser(headers)
        is_http = scope["type"] == "http"
        token = _token(scope) if is_http and self._redeem and not why else ""
        # A browser that is in already uses up no token by coming in again.
        cookie = await self._redeem(token) if token and self._redeem and not browser else ""
        if token and (browser or cookie):
            await self._lead_in(send, cookie)
        elif browser:
            scope = {**scope, BROWSER: browser}
            await self._app(scope, receive, self._with_headers(send, headers) if is_http else send)
        elif not is_http:
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            # What may follow the head is not even thrown away.
            await send_text(send, 403, why or NO_TOKEN, connection="close")

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> str | None:
        """Return why a request is refused with or without a cookie, or None."""
        if headers.get("host", "").lower() not in self._hosts:
            return "This page is not to be reached by that name."
        origin = headers.get("origin")
        if origin is None and scope["type"] == "websocket":
            return "No browser connects like that."
        if origin is not None and origin.lower() not in self._origins:
            return "Another page has no business here."
        if scope["type"] == "http" and scope["method"] not in self._methods:
            # (A page always says where what it posts is from; other programs need not.)
            is_posted = scope["method"] == "POST" and scope["path"] in self._posts
            if not is_posted or origin is None:
                return "There is nothing to be sent here."
        return None

    def _browser(self, headers: Mapping[str, str]) -> int:
        """Return the number of the browser whose cookie came along, or 0."""
        # By hand: a parser gives up at cookies of other programs that are none.
        cookies = (part.strip().partition("=") for part in headers.get("cookie", "").split(";"))
        numbers = [self._key.browser(value) for name, _, value in cookies if name == self._cookie]
        return max(numbers, default=0)

    async def _lead_in(self, send: Send, cookie: str) -> None:
        """Redirect to the page, with a cookie if there is a new one."""
        given = f"{self._cookie}={cookie}; Path=/; HttpOnly; SameSite=Strict"
        await send_text(send, 303, "", location="/", **({"set_cookie": given} if cookie else {}))

    def _with_headers(self, send: Send, headers: Mapping[str, str]) -> Send:
        """Add the security headers to every response."""
        policy = SECURITY_HEADERS["content-security-policy"]
        if self._gate_port:
            name = headers["host"].rpartition(":")[0]
            policy += f"; connect-src 'self' http://{name}:{self._gate_port}"

        async def send_with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                more = _headers({"content-security-policy": policy})
                message = {**message, "headers": [*message["headers"], *more]}
            await send(message)

        return send_with_headers


NO_TOKEN = (
    "Open the address that the tracker prints: it holds a token, without which nobody gets in. "
    "Each lets one browser in; then the tracker prints a new one."
)

SECURITY_HEADERS = {
    # Nothing comes from elsewhere, nothing goes there, and no other page shows this one in itself.
    # (NiceGUI makes functions of text, which is 'unsafe-eval'.)
    "content-security-policy": "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    "frame-ancestors 'none'; base-uri 'self'; form-action 'none'",
    "x-frame-options": "DENY",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
}


def _token(scope: Scope) -> str:
    """Return the token in an address, or ""."""
    return parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[-1]


def _headers(more: Mapping[str, str]) -> list[tuple[bytes, bytes]]:
    """Return these headers and those for security, as ASGI wants them."""
    return [
        (key.replace("_", "-").encode(), value.encode())
        for key, value in {**SECURITY_HEADERS, **more}.items()
    ]


async def send_text(send: Send, status: int, text: str, **headers: str) -> None:
    """Answer a request with a line of text, and these headers beside the usual ones."""
    headers.update(content_type="text/plain; charset=utf-8", cache_control="no-store")
    await send({"type": "http.response.start", "status": status, "headers": _headers(headers)})
    await send({"type": "http.response.body", "body": text.encode()})
