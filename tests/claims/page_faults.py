"""Faults of the page, measured: each strikes for real in the middle of a run that it has ordered.

Tracker, page, browsers and emulated brick are processes of their own, in real time.  The true pose
tells when the arm stands; the page itself notes what it shows, and when.
"""

from __future__ import annotations

import json
import re
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from laptop.bench.bench import BenchRecord, BenchTable
from laptop.measure.demo.processes import answers
from shared.arm_description import ArmError
from tests.claims.page import browser
from tests.claims.page_fault_kinds import FAULTS, PageCase, PageFault, PageNote
from tests.claims.page_rig import (
    NOTE_PRESS,
    PageRig,
    aim_and_start,
    page_processes,
    page_rig,
    point_at_stop,
    standing,
    wait_for_motion,
)
from tests.claims.silent_network import silent_network

CUT_OFF_TIME = 5.0
"""What is not mended by the programs themselves is after so long, s."""
AFTERMATH = 4.0
"""It is looked on for so long at least after a fault, or after it is mended, s; then again after
the end of the run."""
RUN_TIMEOUT = 30.0
"""A run that has not ended so long after a fault, s, goes on for ever."""
SETTLED = 0.5
"""What a page says so long after it has shown a fault is what people read, s."""
TRIES = 3
"""An arm that does not move is given another rig."""

NOTE = """(() => {
  let last = "";
  const text = (name) => document.querySelector(name)?.textContent ?? "";
  const keep = (what) => sessionStorage.notes = JSON.stringify(
    [...JSON.parse(sessionStorage.notes || "[]"), { t: Date.now() / 1000, ...what }]);
  setInterval(() => {
    if (!document.body) return;
    const has = (name) => document.body.classList.contains(name);
    const off = has("cut-off");
    const now = {
      off,
      here: !off && typeof pulse !== "undefined" && pulse.clocks.length > 0
        && !!document.querySelector("[data-marker=effector]"),
      says: off ? text(".alarm") + (has("stop-dead") ? " " + text(".stop .cannot") : "")
        : [text(".verdict"), text(".reason") || text(".note")].filter((part) => part).join(" "),
      driver: text(".driver"),
    };
    if (JSON.stringify(now) === last) return;
    last = JSON.stringify(now);
    keep(now);
  }, 20);
})();
"""
"""Notes in the browser what the page shows, whenever that changes; a page loaded anew goes on."""

ENDED = re.compile(r"(?P<verdict>[a-z ]+): .* after \d+ moves?, ")
"""What the brick says at the end of a run."""


@dataclass(frozen=True)
class PageFaultResult:
    """One fault: s after it struck; None where that never was.

    Attributes:
        goals: see PageFault.
        stands: when the arm stood for good, on the clock of the emulated world.
        wall: the same on the wall's clock; the others are, too.
        shown: when the page that steers showed it.
        anew: when another process served the page.
        back: when that page was there again; of what is mended, after that.
        page: what it said while it was cut off, if so, and at the end.
        brick: the last that the brick's program said.
        status: with which it ended; None: it waits for the next run.
    """

    fault: str
    goals: Mapping[str, float]
    stands: float | None
    wall: float | None
    shown: float | None
    anew: float | None
    back: float | None
    page: str
    brick: str
    status: int | None

    @property
    def verdict(self) -> str:
        """The run's, as the brick has it; "" if it had none."""
        found = ENDED.match(self.brick)
        return found["verdict"] if found else ""

    @property
    def misses(self) -> tuple[str, ...]:
        """Goals that do not hold."""
        went_on = self.verdict == "converged"
        measured = {"stands": self.stands, "shown": self.shown, "anew": self.anew}
        held = {
            name: took is not None and took <= self.goals.get(name, 0.0)
            for name, took in measured.items()
        }
        held["stands"] &= not went_on  # it came to stand by itself
        held["goes on"] = went_on
        return tuple(name for name in self.goals if not held[name])


def run(faults: Sequence[PageFault] = FAULTS) -> Iterator[PageFaultResult]:
    """Let one fault after the other strike, each in a rig of its own.

    Raises:
        NoBrowser: pages cannot be opened.
        ArmError: a program fails, or the arm does not move.
    """
    with browser():
        pass  # what is missing is said before anything else
    for fault in faults:
        for _ in range(TRIES):
            if (result := _measure(fault)) is not None:
                yield result
                break
        else:
            raise ArmError(f"{fault.name}: the arm did not move; is this computer too busy?")


def _measure(fault: PageFault) -> PageFaultResult | None:
    """Let a fault strike in the middle of a motion; None if the arm does not move."""
    with ExitStack() as stack:
        made = stack.enter_context(browser())
        network = stack.enter_context(silent_network())
        rig = stack.enter_context(page_rig())
        page = rig.open(made, NOTE + NOTE_PRESS, proxy={"server": network.url})
        other = rig.open(made, NOTE_PRESS) if fault.watched else None
        (process,) = page_processes(rig.tracker.pid)
        case = PageCase(rig, made, page, other, network, process)
        stack.callback(case.wake)
        fault.ready(case)
        aim_and_start(page, rig.goals[0])
        if fault.presses:
            point_at_stop(case.other if fault.presses == "other" else page)
        if not wait_for_motion(page, rig.watch):
            return None
        address, struck = page.url, time.time()
        struck = mended = fault.strike(case) or struck
        served = _Successor(rig.tracker.pid, process, address) if "anew" in fault.goals else None
        if fault.mend:
            _look_on(page, CUT_OFF_TIME)
            mended = time.time()
            fault.mend(case)
        _look_on(page, AFTERMATH)
        while time.time() < struck + RUN_TIMEOUT and not (
            _verdict(rig) and (served is None or served.t)
        ):
            _look_on(page, 0.1)
        _look_on(page, AFTERMATH)
        case.wake()
        return judge(
            fault,
            struck,
            mended,
            standing(list(rig.watch.poses), struck),
            [] if page.is_closed() else _notes(page),
            served.t if served else None,
            _verdict(rig) or rig.brick.lines[-1],
            None if rig.brick.running else rig.brick.wait(0.0),
        )


class _Successor:
    """Waits for another process in the place of a page's, and notes when it answers.

    Attributes:
        t: s on the wall's clock; 0: it does not yet.
    """

    def __init__(self, tracker: int, process: int, address: str) -> None:
        self.t = 0.0
        words = tracker, process, address
        threading.Thread(target=self._ask, args=words, daemon=True).start()

    def _ask(self, tracker: int, process: int, address: str) -> None:
        deadline = time.monotonic() + RUN_TIMEOUT
        while time.monotonic() < deadline and page_processes(tracker) in ([], [process]):
            time.sleep(0.05)
        if answers(address):
            self.t = time.time()


def _look_on(page: Any, duration: float) -> None:
    """Let time pass (s), in which playwright does what a page asks of it, if there is a page."""
    if page.is_closed():
        time.sleep(duration)
    else:
        page.wait_for_timeout(1000 * duration)


def _verdict(rig: PageRig) -> str:
    """Return what the brick said at the end of its run, "" if it has not ended."""
    return next((line for line in rig.brick.lines if ENDED.match(line)), "")


def _notes(page: Any) -> list[PageNote]:
    """Return what the page has noted."""
    return [PageNote(**note) for note in json.loads(page.evaluate("sessionStorage.notes"))]


def judge(
    fault: PageFault,
    struck: float,
    mended: float,
    stood: tuple[float, float] | None,
    notes: Sequence[PageNote],
    served: float | None,
    brick: str,
    status: int | None,
) -> PageFaultResult:
    """Make a result of what was measured.

    Args:
        fault: which struck.
        struck, mended: when, s on the wall's clock.
        stood: how long after that the arm stood, see `standing`.
        notes: of the page that steers, the oldest first.
        served: when its server answered again, s on the wall's clock; 0 or None: it never did.
        brick: what it said last.
        status: of its program; None: it goes on.
    """
    since = [note for note in notes if note.t >= struck]
    shown = next((note for note in since if fault.shows and fault.shows(note)), None)
    gone = next((note.t for note in since if note.off), struck)
    here = (note.t for note in since if note.here and note.t > max(gone, mended, served or 0))
    back = next(here, None) if fault.returns else None
    told = None  # a page may find out by and by that STOP is cut off, too
    if shown:
        told = [note for note in since if shown.t <= note.t <= shown.t + SETTLED][-1]
    last = notes[-1] if notes and not (told and told.off and notes[-1].off) else None
    said = [note.says for note in (told, last) if note and note.says]
    wall, world = stood or (0.0, 0.0)
    return PageFaultResult(
        fault.name,
        dict(fault.goals),
        world,
        wall,
        shown and shown.t - struck,
        served - struck if served else None,
        back and back - mended,
        "; then: ".join(dict.fromkeys(said)) or "-",
        brick,
        status,
    )


HEADINGS = (
    "fault", "goals, s", "met", "stands\nafter, s", "shown\nafter, s", "anew\nafter, s",
    "back\nafter, s", "what the page says", "what the brick says", "status",
)  # fmt: skip

TITLE = "faults of the page, in the middle of a motion ordered on it; figures from the emulator"
LEGEND = (
    "stands: for good, on the emulated clock; anew: another process serves the page; back: the "
    f"page is there again; offline, silent and frozen end after {CUT_OFF_TIME:g} s unless the "
    "tracker ends them, and back counts from then"
)


def table(results: Sequence[PageFaultResult]) -> list[tuple[str, ...]]:
    """A row for each."""

    def seconds(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f}"

    return [
        (
            one.fault,
            ", ".join(f"{name} {most:g}" if most else name for name, most in one.goals.items()),
            f"no: {', '.join(one.misses)}" if one.misses else "yes",
            "-" if "goes on" in one.goals else seconds(one.stands),
            seconds(one.shown),
            seconds(one.anew),
            seconds(one.back),
            one.page,
            one.brick,
            "waits" if one.status is None else str(one.status),
        )
        for one in results
    ]


def summary(results: Sequence[PageFaultResult]) -> str:
    """How many of them miss no goal."""
    well = sum(not one.misses for one in results)
    return f"{well} of {len(results)} faults of the page miss no goal"


BENCH = BenchRecord(
    "of the page",
    lambda it: FAULTS,
    None,
    lambda results, it: [
        BenchTable(TITLE, HEADINGS, table(results), 1),
        f"{LEGEND}\n{summary(results)}",
    ],
    in_turn=run,
)
