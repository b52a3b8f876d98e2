"""Why no page is heard: each cause is told apart from what looks like it."""

import re

import pytest

from laptop.page.silence import Evidence, Presence, Sign, settled, verdict

ME = "browser 1 (Chrome on Linux)"
SILENT = Evidence(ME, Sign(Presence.SHOWN), unbeaten=0.2)


def sign(presence, is_local=False):
    return Evidence(ME, Sign(presence, is_local), unbeaten=0.2)


CASES = [
    # What a page said of itself holds, whatever else was slow or has ended since.
    (sign(Presence.CLOSED), f"the page was closed in {ME}", "Keep it open"),
    (sign(Presence.CLOSED)._replace(ended="was ended by SIGKILL"), "the page was closed", "Keep"),
    (sign(Presence.CLOSED)._replace(standstill=1.5, late=1.5), "the page was closed", "Keep"),
    (sign(Presence.ASLEEP), f"{ME} put the page to sleep", "Keep it open and in front"),
    # A process that is no more, or is stopped, is not called busy.
    (SILENT._replace(ended="was ended by SIGKILL", unbeaten=2), "ended by SIGKILL", "starts anew"),
    (SILENT._replace(ended="was stopped by a signal", unbeaten=2), "by a signal", "starts anew"),
    # While the tracker stands still, the page waits for it, and so do browsers.
    (
        SILENT._replace(standstill=5, waited=5, late=5, unbeaten=5),
        "the tracker stood still for 5",
        "",
    ),
    (SILENT._replace(unbeaten=2.1), "its process was too busy to answer for 2 s", "Close other"),
    (SILENT._replace(late=1.9), "its process was too busy to answer for 2 s", "Close other"),
    (SILENT._replace(waited=1.9), "the tracker took 2 s to answer the page", "Close other"),
    # The same with a browser that is gone: the page's process has not noticed, or it was all slow.
    (sign(Presence.BROKEN)._replace(late=1.9), "its process was too busy", "Close other"),
    (
        sign(Presence.BROKEN),
        f"the connection to {ME} broke",
        "Look whether that browser still runs",
    ),
    (sign(Presence.HIDDEN), f"in the background of {ME}, which may let it sleep", "in front"),
    (SILENT, f"nothing comes from {ME}, though it is connected", "Look at the network"),
    (SILENT._replace(late=0.7), "its network is cut, or it hangs", "Look at the network"),
    # That this computer is busy is said only where that shows in its own processes.
    (sign(Presence.SHOWN, True), "its network is cut, or it hangs", "Look at the network"),
    (sign(Presence.SHOWN, True)._replace(late=0.7), "this computer is too busy", "Close other"),
    (sign(Presence.SHOWN, True)._replace(standstill=0.7), "late by 0.7 s, too", "Close other"),
    (Evidence(unbeaten=0.2), "nothing comes from the browser", "Look at the network"),
]


@pytest.mark.parametrize(("evidence", "cause", "advice"), CASES)
def test_each_cause_is_told_and_what_to_do(evidence, cause, advice):
    found = verdict(evidence)
    assert cause in found.cause
    assert advice in found.advice
    assert found.is_open == ("or it hangs" in found.cause)
    text = found.text(2.04)
    assert text.startswith("no page was heard for 2 s, as ")
    for sentence in re.split(r"[.:] ", f"{text}. {found.advice}"):
        assert len(sentence.split()) <= 25


def test_a_browser_that_is_back_tells_on_which_side_it_was():
    assert settled(3.2).startswith("It is back: it stood still itself for 3 s. Close other")
    assert settled(0.3) == "It is back, and went on itself all the time: its network was cut."
