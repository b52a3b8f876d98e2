"""Faults of the page by name: how each is let strike, and what is to hold then."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from tests.claims.page_rig import PageRig, press_stop
from tests.claims.silent_network import SilentNetwork

STOP_GOAL = 0.3
"""Longest time from the press of STOP to standstill, s."""
HELD_GOAL = 2.0 + STOP_GOAL
"""The same from when a page was heard last, s: 2 s later the run is held."""
SHOWN_GOAL = 1.0
"""Longest time until a page shows that it is cut off, s."""
ANEW_GOAL = 3.0
"""Longest time until another process serves the page, s."""


class PageNote(NamedTuple):
    """What a page shows from a time (s on the wall's clock) on.

    off   that it is cut off
    here  the tracker is heard, and a picture of it is there
    """

    t: float
    off: bool
    here: bool
    says: str
    driver: str


@dataclass
class PageCase:
    """One run with a fault: who takes part.

    Attributes:
        made: the browser of the page that steers.
        page: that page.
        other: another one that watches, of a browser of its own; None: there is none.
        page_process: number of the page's process.
        frozen: processes that stand still, to be woken.
    """

    rig: PageRig
    made: Any
    page: Any
    other: Any
    network: SilentNetwork
    page_process: int
    frozen: tuple[int, ...] = ()

    def send(self, number: signal.Signals, *processes: int) -> None:
        """Send a signal to processes."""
        self.frozen = processes if number == signal.SIGSTOP else ()
        for process in processes:
            os.kill(process, number)

    def wake(self) -> None:
        """Let what is frozen go on, if it is there still."""
        for process in self.frozen:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGCONT)
        self.frozen = ()


def freeze_tabs(case: PageCase) -> None:
    """Freeze the processes of all tabs of the browser."""
    told = case.made.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    tabs = [process["id"] for process in told["processInfo"] if process["type"] == "renderer"]
    case.send(signal.SIGSTOP, *tabs)


def block_gate(case: PageCase) -> None:
    """Let nothing through to the gate of STOP."""
    for address in ("**/stop", "**/pulse"):
        case.page.route(address, lambda route: route.abort())
    case.page.reload()  # the connection that there is would go on
    case.page.wait_for_selector("[data-marker=effector]", state="attached")


def freeze_and_stop(case: PageCase) -> float:
    """Freeze the page's process and press STOP; return when that was."""
    case.send(signal.SIGSTOP, case.page_process)
    return press_stop(case.page)


def _nothing(case: PageCase) -> None:
    pass


@dataclass(frozen=True)
class PageFault:
    """One kind of fault.

    Attributes:
        name: for people.
        strike: lets it strike; returns when that was, s on the wall's clock, or None: just now.
        goals: of "stands", "shown" and "anew" the longest times, s; "goes on": nothing holds the
            run.
        ready: is called before the run is ordered.
        mend: ends it CUT_OFF_TIME later; None: it mends by itself, or never.
        shows: whether a note is what is to be shown; None: nothing is.
        returns: whether the page is cut off by it, and is there again at the end.
        watched: whether another browser watches.
        presses: the page, "page" or "other", whose STOP is pressed; "": none.
    """

    name: str
    strike: Callable[[PageCase], float | None]
    goals: Mapping[str, float]
    ready: Callable[[PageCase], None] = _nothing
    mend: Callable[[PageCase], None] | None = None
    shows: Callable[[PageNote], bool] | None = field(default=lambda note: note.off)
    returns: bool = True
    watched: bool = False
    presses: str = ""


CUT_OFF = {"stands": HELD_GOAL, "shown": SHOWN_GOAL}
STOPPED = {"stands": STOP_GOAL}


def _stop(name: str, presses: str = "page", **more: Any) -> PageFault:
    """STOP, pressed on one of the pages, which gets through."""
    return PageFault(
        name,
        lambda case: press_stop(case.page if presses == "page" else case.other),
        STOPPED,
        shows=lambda note: note.says.startswith("Stopped"),
        returns=False,
        presses=presses,
        **more,
    )


FAULTS = (
    PageFault(
        "page's process killed",
        lambda case: case.send(signal.SIGKILL, case.page_process),
        {**CUT_OFF, "anew": ANEW_GOAL},
    ),
    PageFault(
        "page's process frozen",
        lambda case: case.send(signal.SIGSTOP, case.page_process),
        {**CUT_OFF, "anew": ANEW_GOAL},
    ),
    PageFault(
        "browser offline",
        lambda case: case.page.context.set_offline(True),
        CUT_OFF,
        mend=lambda case: case.page.context.set_offline(False),
    ),
    PageFault(
        "network silent",
        lambda case: case.network.passes.clear(),
        CUT_OFF,
        mend=lambda case: case.network.passes.set(),
    ),
    PageFault(
        "browser closed",
        lambda case: case.made.close(),
        {"stands": HELD_GOAL},
        shows=None,
        returns=False,
    ),
    PageFault(
        "tab's process frozen",
        freeze_tabs,
        {"stands": HELD_GOAL},
        mend=PageCase.wake,
        shows=None,
    ),
    PageFault(
        "tracker killed",
        lambda case: case.send(signal.SIGKILL, case.rig.tracker.pid),
        CUT_OFF,
        returns=False,
    ),
    PageFault(
        "tracker frozen",
        lambda case: case.send(signal.SIGSTOP, case.rig.tracker.pid),
        CUT_OFF,
        mend=PageCase.wake,
    ),
    _stop("STOP, its gate blocked", ready=block_gate),
    PageFault(
        "STOP, page's process frozen",
        freeze_and_stop,
        STOPPED,
        presses="page",
    ),
    _stop("STOP by who steers"),
    _stop("STOP by who watches", presses="other", watched=True),
    PageFault(
        "who watches takes over",
        lambda case: case.other.get_by_role("button", name="Take over").click(),
        {"goes on": 0.0},
        shows=lambda note: note.driver != "You steer",
        returns=False,
        watched=True,
    ),
)
