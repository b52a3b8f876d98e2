"""Diagnosis of an address without a stream: asks as a browser would, and reads the answer."""

from __future__ import annotations

import base64
import http.client
import urllib.error
import urllib.request
from urllib.parse import unquote, urlsplit

from shared.message_fields import printable

ASK_TIMEOUT = 3.0
"""Longest wait for a camera's answer, s."""
_REFUSALS = {
    401: "asks for a name and a password, or refuses yours; write http://NAME:PASSWORD@HOST/...",
    403: "refuses this computer; allow it in the camera's settings",
    404: "has nothing at this address; look up in its manual which one the video has",
}


def why_no_stream(url: str) -> str:
    """Return why nothing can be read from an address, and what to do; "" if that is not known."""
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        return ""
    bare = parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()
    request = urllib.request.Request(bare)
    if parts.username is not None:
        pair = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
        request.add_header("Authorization", f"Basic {base64.b64encode(pair).decode()}")
    try:
        with urllib.request.urlopen(request, timeout=ASK_TIMEOUT) as answer:
            kind = answer.headers.get_content_type()
    except urllib.error.HTTPError as error:
        with error:
            refused = _REFUSALS.get(error.code, "fails; check the address in a browser")
        return f"answers {error.code}: it {refused}"
    except (OSError, ValueError, http.client.HTTPException):
        return ""
    if kind.startswith("text/"):
        return (
            f"gives a page ({printable(kind)}), and no video; open it in a browser, and look there "
            "for the address of the video itself"
        )
    return f"gives {printable(kind)}, which is no video that FFmpeg knows; check it with ffplay"
