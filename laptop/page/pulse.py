"""Heartbeat between page and browsers, by which the page knows that a browser is alive.

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
"""Presence by the word that a page reports."""


class Pulse:
    """Heartbeat of the browsers, which gives the age of what each has received.

    Args:
        report: reports to the tracker when each browser was last heard, s on time.monotonic(),
            which is the same in all processes, and the page's own state.
        beat: sends a beat, a time in s, to a page by NiceGUI's id.
    """

    def __init__(
        self,
        report: Callable[[Mapping[int, float], PageReport], Awaitable[None]],
        beat: Callable[[str, float], Awaitable[None]],
    ) -> None:
        self._report, self._beat = report, beat
        self._browsers: dict[str, int] = {}
        self._echoed: dict[str, float] = {}  # s
        self._tabs: dict[str, tuple[int, Sign]] = {}  # by page, with its browser

    def join(self, page: str, browser: int, is_local: bool = False) -> None:
        """Send beats to a page from now on; `is_local`: its browser is on this computer."""
        self._browsers[page] = browser
        self._echoed.pop(page, None)
        known = [*self._tabs.items()][-MAX_TABS:]
        self._tabs = {tab: sign for tab, sign in known if tab != page}
        self._tabs[page] = browser, Sign(Presence.SHOWN, is_local)

    def leave(self, page: str) -> None:
        """Stop sending beats to a page."""
        self._browsers.pop(page, None)
        self._echoed.pop(page, None)
        if page in self._tabs:
            browser, sign = self._tabs[page]
            if sign.presence > Presence.ASLEEP:
                self._tabs[page] = browser, sign._replace(presence=Presence.BROKEN)

    def on_presence(self, page: str, browser: int, word: str) -> None:
        """Handle what a page of a browser reports of itself, a key of PRESENCE_WORDS."""
        whose, sign = self._tabs.get(page, (0, None))
        if sign is None or whose != browser or word not in PRESENCE_WORDS:
            return
        # (Reports of a page that closes may arrive in any order.)
        if sign.presence is not Presence.CLOSED or word == "visible":
            self._tabs[page] = browser, sign._replace(presence=PRESENCE_WORDS[word])

    def signs(self) -> dict[int, Sign]:
        """Return the sign of each browser: of several pages that of the most present.

        A page that loads counts only where there is no other: that it has come says nothing of why
        the one before it was not heard.
        """
        ranks: dict[int, tuple[bool, Sign]] = {}
        for page, (browser, sign) in self._tabs.items():
            loads = page in self._browsers and page not in self._echoed
            rank = (not loads, sign)
            ranks[browser] = max(rank, ranks.get(browser, rank))
        return {browser: sign for browser, (_, sign) in ranks.items()}

    def on_echo(self, page: str, beat: object) -> None:
        """Handle a beat that a page has sent back."""
        if page in self._browsers and isinstance(beat, (int, float)) and math.isfinite(beat):
            if page not in self._echoed:
                self._forget_closed(self._browsers[page])
            self._echoed[page] = min(float(beat), time.monotonic())

    def _forget_closed(self, browser: int) -> None:
        """Forget the closed pages of a browser: another one has replaced them."""
        self._tabs = {
            tab: (whose, sign)
            for tab, (whose, sign) in self._tabs.items()
            if whose != browser or sign.presence > Presence.CLOSED
        }

    def age(self, page: str) -> float:
        """Time since a page last knew the tracker to be alive, s."""
        return time.monotonic() - self._echoed.get(page, -math.inf)

    async def run(self) -> None:
        """Beat for ever."""
        late = waited = 0.0
        while True:
            began = time.monotonic()
            last_heard_at: dict[int, float] = {}
            for page, browser in self._browsers.items():
                if (echoed := self._echoed.get(page)) is not None:
                    last_heard_at[browser] = max(echoed, last_heard_at.get(browser, echoed))
            report = PageReport(self.signs(), late, waited)
            answered = began
            with suppress(RpcError):  # then nobody gets a beat
                await self._report(last_heard_at, report)
                now = answered = time.monotonic()
                await asyncio.gather(*(self._beat(page, now) for page in list(self._browsers)))
            await asyncio.sleep(BEAT_PERIOD)
            waited = answered - began
            late = max(0.0, time.monotonic() - answered - BEAT_PERIOD)
