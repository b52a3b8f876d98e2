"""Pulse between page and browsers: how the page knows that a browser is there.

Each beat goes to a browser only after the tracker has answered, so it vouches for the whole path.
It carries the time t at which it is sent, by this computer's monotonic clock.  A browser sends t
back at once.  So no two clocks are compared, and delays on the path count as silence:

    age = now - t of the newest echo

is an upper bound of the age of all that the browser has seen.  This is a heartbeat failure detector
(T. Chandra and S. Toueg, 1996): silence alone cannot tell a dead browser from a slow one.  A
connection that is open does not do instead: TCP notices a network that is cut only after minutes.
Nor does an event that the page sends as it closes, which may get lost.  A page still reports that
it is closed, hidden or asleep: not to decide, but to say why it is silent (see `silence`).
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress

from laptop.page.rpc import RpcError
from laptop.page.silence import PageReport, Presence, Sign

BEAT_PERIOD = 0.25
"""Period of the beats, s."""
MAX_TABS = 64
"""Greatest number of pages whose last reports are kept."""
PRESENCE_WORDS = {
    "visible": Presence.SHOWN,
    "hidden": Presence.HIDDEN,
    "asleep": Presence.ASLEEP,
    "closed": Presence.CLOSED,
}
"""Presence by the word that a page sends of itself."""


class Pulse:
    """Gives browsers their beats, and knows how old what they have heard is.

    Args:
        hear: tells the tracker which browsers are heard, and when they were last, s on
            time.monotonic(), which is the same in all processes; and what is known beside that.
        beat: sends a beat, a time in s, to a page by NiceGUI's id.
    """

    def __init__(
        self,
        hear: Callable[[Mapping[int, float], PageReport], Awaitable[None]],
        beat: Callable[[str, float], Awaitable[None]],
    ) -> None:
        self._hear, self._beat = hear, beat
        self._browsers: dict[str, int] = {}
        self._echoed: dict[str, float] = {}  # s
        self._tabs: dict[str, tuple[int, Sign]] = {}  # by page, with its browser

    def join(self, page: str, browser: int, is_local: bool = False) -> None:
        """Give beats to a page from now on; `is_local`: its browser is on this computer."""
        self._browsers[page] = browser
        self._echoed.pop(page, None)
        known = [*self._tabs.items()][-MAX_TABS:]
        self._tabs = {tab: sign for tab, sign in known if tab != page}
        self._tabs[page] = browser, Sign(Presence.SHOWN, is_local)

    def leave(self, page: str) -> None:
        """Give no more beats to a page."""
        self._browsers.pop(page, None)
        self._echoed.pop(page, None)
        if page in self._tabs:
            browser, sign = self._tabs[page]
            if sign.presence > Presence.ASLEEP:
                self._tabs[page] = browser, sign._replace(presence=Presence.BROKEN)

    def take_word(self, page: str, browser: int, word: str) -> None:
        """Take in what a page of a browser says of itself, a key of PRESENCE_WORDS."""
        whose, sign = self._tabs.get(page, (0, None))
        if sign is None or whose != browser or word not in PRESENCE_WORDS:
            return
        # (What a page says as it closes may come in any order.)
        if sign.presence is not Presence.CLOSED or word == "visible":
            self._tabs[page] = browser, sign._replace(presence=PRESENCE_WORDS[word])

    def signs(self) -> dict[int, Sign]:
        """Return what is known of each browser: of several pages that of the most present.

        A page that loads counts only where there is no other: that it has come says nothing of why
        the one before it was not heard.
        """
        ranks: dict[int, tuple[bool, Sign]] = {}
        for page, (browser, sign) in self._tabs.items():
            loads = page in self._browsers and page not in self._echoed
            rank = (not loads, sign)
            ranks[browser] = max(rank, ranks.get(browser, rank))
        return {browser: sign for browser, (_, sign) in ranks.items()}

    def take_echo(self, page: str, beat: object) -> None:
        """Take in what a page has sent back."""
        if page in self._browsers and isinstance(beat, (int, float)) and math.isfinite(beat):
            if page not in self._echoed:
                self._forget_closed(self._browsers[page])
            self._echoed[page] = min(float(beat), time.monotonic())

    def _forget_closed(self, browser: int) -> None:
        """Forget the pages of a browser that have gone: another one has taken their place."""
        self._tabs = {
            tab: (whose, sign)
            for tab, (whose, sign) in self._tabs.items()
            if whose != browser or sign.presence > Presence.CLOSED
        }

    def age(self, page: str) -> float:
        """Time since the tracker was known to a page to be there, s."""
        return time.monotonic() - self._echoed.get(page, -math.inf)

    async def run(self) -> None:
        """Beat for ever."""
        late = waited = 0.0
        while True:
            began = time.monotonic()
            heard: dict[int, float] = {}
            for page, browser in self._browsers.items():
                if (echoed := self._echoed.get(page)) is not None:
                    heard[browser] = max(echoed, heard.get(browser, echoed))
            report = PageReport(self.signs(), late, waited)
            answered = began
            with suppress(RpcError):  # then nobody gets a beat
                await self._hear(heard, report)
                now = answered = time.monotonic()
                await asyncio.gather(*(self._beat(page, now) for page in list(self._browsers)))
            await asyncio.sleep(BEAT_PERIOD)
            waited = answered - began
            late = max(0.0, time.monotonic() - answered - BEAT_PERIOD)
