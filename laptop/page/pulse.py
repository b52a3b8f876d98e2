"""The pulse between page and browsers: who hears it is not cut off, and who answers is there.

Each beat goes to a browser only after the tracker has answered, so that it vouches for the whole
way; a browser sends it back at once.  How long ago the beat was sent that a browser has sent back
last is how old everything may be that it has seen.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress

from laptop.page.rpc import RpcError

BEAT_PERIOD = 0.25
"""Between two beats, s."""


class Pulse:
    """Gives browsers their beats, and knows how old what they have heard is.

    Args:
        hear: tells the tracker which browsers are heard, and when they were last, s on
            time.monotonic(), which is the same in all processes.
        beat: sends a beat, a time in s, to a page by NiceGUI's id.
    """

    def __init__(
        self,
        hear: Callable[[Mapping[int, float]], Awaitable[None]],
        beat: Callable[[str, float], Awaitable[None]],
    ) -> None:
        self._hear, self._beat = hear, beat
        self._browsers: dict[str, int] = {}
        self._echoed: dict[str, float] = {}  # s

    def join(self, page: str, browser: int) -> None:
        """Give beats to a page from now on."""
        self._browsers[page] = browser
        self._echoed.pop(page, None)

    def leave(self, page: str) -> None:
        """Give no more beats to a page."""
        self._browsers.pop(page, None)
        self._echoed.pop(page, None)

    def take_echo(self, page: str, beat: object) -> None:
        """Take in what a page has sent back."""
        if page in self._browsers and isinstance(beat, (int, float)) and math.isfinite(beat):
            self._echoed[page] = min(float(beat), time.monotonic())

    def age(self, page: str) -> float:
        """Time since the tracker was known to a page to be there, s."""
        return time.monotonic() - self._echoed.get(page, -math.inf)

    async def run(self) -> None:
        """Beat for ever."""
        while True:
            heard: dict[int, float] = {}
            for page, browser in self._browsers.items():
                if (echoed := self._echoed.get(page)) is not None:
                    heard[browser] = max(echoed, heard.get(browser, echoed))
            with suppress(RpcError):  # then nobody gets a beat
                await self._hear(heard)
                now = time.monotonic()
                await asyncio.gather(*(self._beat(page, now) for page in list(self._browsers)))
            await asyncio.sleep(BEAT_PERIOD)
