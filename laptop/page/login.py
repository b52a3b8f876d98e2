"""Login of browsers: a token in an address admits one browser, once; then it has a cookie.

A cookie is neither a token nor the key that signs it: who intercepts one can admit nobody else.
Logins outlive the page's process, because the key is the tracker's.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import threading
from collections.abc import Callable


class LoginKey:
    """Signs and verifies login cookies; the same in the tracker's process and the page's.

    Args:
        key: the secret.
    """

    def __init__(self, key: bytes) -> None:
        self._key = key

    def cookie(self, browser: int) -> str:
        """Return a cookie of a browser, by its number, from 1 on."""
        login = f"{browser}.{secrets.token_urlsafe(12)}"
        return f"{login}.{self._signature(login)}"

    def browser(self, cookie: str) -> int:
        """Return the number of the browser that a cookie belongs to; 0 if it is not valid."""
        login, _, signature = cookie.rpartition(".")
        is_ours = hmac.compare_digest(
            signature.encode("utf-8", "replace"), self._signature(login).encode()
        )
        return int(login.partition(".")[0]) if is_ours else 0

    def _signature(self, login: str) -> str:
        return hmac.new(self._key, login.encode("utf-8", "replace"), hashlib.sha256).hexdigest()


class Admission:
    """Admits browsers: each token admits one, then there is a new one.

    Attributes:
        key: signs the cookies of all logins.
        token: for the next browser.
        on_renewal: is called whenever there is a new token.
    """

    def __init__(self) -> None:
        self.key = LoginKey(secrets.token_bytes(32))
        self.token = secrets.token_urlsafe(24)
        self.on_renewal: Callable[[], None] = lambda: None
        self._browsers = 0
        self._lock = threading.Lock()

    def redeem(self, token: str) -> str:
        """Return a cookie for the token, which is used up by that; "" if it is not the one."""
        with self._lock:
            given = token.encode("utf-8", "replace")
            if not hmac.compare_digest(given, self.token.encode()):
                return ""
            self.token = secrets.token_urlsafe(24)
            self._browsers += 1
            cookie = self.key.cookie(self._browsers)
        self.on_renewal()
        return cookie
