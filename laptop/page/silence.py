"""Diagnosis of why no page is heard: for page, brick and terminal alike.  Pure.

A page is heard when its browser sends a beat back (`pulse`).  Whether that fails as somebody closed
the page, as the browser let it sleep, as the network is cut, or as one of the processes here stood
still, tell signs of which each excludes others.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

STANDSTILL_TIMEOUT = 1.0
"""Shortest standstill that explains why no page was heard, s."""
BUSY_DELAY = 0.4
"""Shortest delay that shows that this computer is busy, s."""


class Presence(IntEnum):
    """Presence of a browser's page; of several the one with the greatest number counts."""

    BROKEN = 0
    """State of a page whose connection ended, and which said nothing before."""
    CLOSED = 1
    """State of a page which said that it is being closed."""
    ASLEEP = 2
    """State of a page which said that the browser puts it to sleep."""
    HIDDEN = 3
    """State of a page that is connected, and said that it is not in front."""
    SHOWN = 4
    """State of a page that is connected, and in front for all that is known."""


class Sign(NamedTuple):
    """Knowledge of the page's process about a browser.

    presence  of its page
    is_local  it is on this computer
    """

    presence: Presence
    is_local: bool = False


class PageReport(NamedTuple):
    """Report of the page's process about itself with each beat.

    signs   by the browser's number
    late    by how much it was late since the last one, s
    waited  for the tracker's answer, s
    """

    signs: Mapping[int, Sign] = {}
    late: float = 0.0
    waited: float = 0.0


class Evidence(NamedTuple):
    """Evidence when no page is heard any more.

    browser     that was heard last, for people
    sign        what is known of it; None: nothing
    ended       what became of the page's process, as "was ended by SIGKILL", or ""
    standstill  for how long the tracker stood still meanwhile, s
    unbeaten    for how long nothing has come from the page's process, s
    late        by how much that was late meanwhile, s
    waited      for how long it waited for the tracker's answer meanwhile, s
    """

    browser: str = ""
    sign: Sign | None = None
    ended: str = ""
    standstill: float = 0.0
    unbeaten: float = 0.0
    late: float = 0.0
    waited: float = 0.0


class SilenceCause(NamedTuple):
    """Reason why no page is heard.

    cause    to stand behind "as"
    advice   what to do next, a sentence
    is_open  it may be one or the other; the browser tells once it is back
    """

    cause: str
    advice: str
    is_open: bool = False

    def text(self, silence: float) -> str:
        """Return it for people; `silence`: for how long no page was heard, s."""
        return f"no page was heard for {silence:.0f} s, as {self.cause}"


RELIEVE = "Close other programs on this computer."
IN_FRONT = "Keep it open and in front while a run is on."


def verdict(evidence: Evidence) -> SilenceCause:
    """Return why no page is heard."""
    e = evidence
    browser = e.browser or "the browser"
    presence = e.sign.presence if e.sign else None
    # A page's own report counts first, whatever else is slow.
    if presence is Presence.CLOSED:
        return SilenceCause(f"the page was closed in {browser}", IN_FRONT)
    if presence is Presence.ASLEEP:
        return SilenceCause(f"{browser} put the page to sleep in the background", IN_FRONT)
    if e.ended:
        return SilenceCause(f"its process {e.ended}", "It starts anew by itself.")
    if e.standstill >= STANDSTILL_TIMEOUT:
        cause = f"the tracker stood still for {e.standstill:.0f} s"
        return SilenceCause(cause, f"{RELIEVE} It must not sleep, either.")
    if (silent := max(e.unbeaten, e.late)) >= STANDSTILL_TIMEOUT:
        return SilenceCause(
            f"its process was too busy to answer for {silent:.0f} s, or hangs", RELIEVE
        )
    if e.waited >= STANDSTILL_TIMEOUT:
        return SilenceCause(f"the tracker took {e.waited:.0f} s to answer the page", RELIEVE)
    if presence is Presence.BROKEN:
        cause = f"the connection to {browser} broke"
        return SilenceCause(cause, "Look whether that browser still runs, and at the network.")
    if presence is Presence.HIDDEN:
        cause = f"the page is in the background of {browser}, which may let it sleep"
        return SilenceCause(cause, IN_FRONT)
    behind = max(e.standstill, e.unbeaten, e.late, e.waited)
    if e.sign and e.sign.is_local and behind > BUSY_DELAY:
        cause = f"this computer is too busy: page and tracker are late by {behind:.1f} s, too"
        return SilenceCause(cause, RELIEVE)
    cause = f"nothing comes from {browser}, though it is connected: its network is cut, or it hangs"
    return SilenceCause(cause, "Look at the network, and at that browser.", is_open=True)


def settled(standstill: float) -> str:
    """Return what a browser that is back tells of an open verdict.

    Args:
        standstill: for how long the browser itself stood still meanwhile, s.
    """
    if standstill >= STANDSTILL_TIMEOUT:
        return f"It is back: it stood still itself for {standstill:.0f} s. {RELIEVE}"
    return "It is back, and went on itself all the time: its network was cut."
