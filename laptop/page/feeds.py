"""The tracker's desk as the page's process sees it, shared by all browsers."""

from __future__ import annotations

import asyncio
import csv
import io
import math
import secrets
import time
from collections import OrderedDict, deque
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

from laptop.page.channel import Door
from laptop.page.run_records import MAX_GROUPS, RunGroup
from laptop.page.snapshots import HISTORY, SAMPLE, Sample, Shown, State

BROWSER_FPS, TOTAL_FPS = 16.0, 20.0
"""Images per second of a camera that one browser gets, and of all cameras all browsers: more
show nobody more, and browsers on this machine take the tracker's time."""
NEXT_IMAGE_TIMEOUT = 0.1
"""A browser waits so long for the next image, s, before it is shown one that has waited."""
MAX_KEPT_IMAGES = 40
"""Images of a camera that browsers may still fetch."""


class Line:
    """A door to the desk for who must not block; one question at a time.

    Args:
        pipe: to it.
    """

    def __init__(self, pipe: Connection) -> None:
        self._door = Door(pipe)
        self._thread = ThreadPoolExecutor(1, "line")

    async def ask(self, question: str, *args: Any) -> Any:
        """See `laptop.page.channel.Door.ask`."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._door.ask, question, *args)


class Feed:
    """One camera's images, for one browser after the other.

    They do not share one: on this machine, all would be busy with it at the same time.

    Args:
        line: to the desk, for this camera alone.
        camera: its name.
    """

    def __init__(self, line: Line, camera: str) -> None:
        self._line = line
        self.camera = camera
        self.shown: OrderedDict[int, Shown] = OrderedDict()
        self.stills: OrderedDict[int, Shown] = OrderedDict()
        self.masks: dict[str, str] = {}  # marker whose pixels are shown, per browser
        self._turn = asyncio.Lock()

    @property
    def newest(self) -> Shown | None:
        """The newest image that is here."""
        return next(reversed(self.shown.values())) if self.shown else None

    async def next(self) -> Shown | None:
        """Return the next image that comes, or the newest if none does; None if there is none."""
        async with self._turn:
            newest = self.newest
            after, within = (newest.index, NEXT_IMAGE_TIMEOUT) if newest else (-1, 0.0)
            masks = tuple(set(self.masks.values()))
            shown = await self._line.ask("view", self.camera, after, masks, within)
            if shown:
                _keep(self.shown, shown)
            return self.newest

    def keep(self, shown: Shown) -> None:
        """Keep an image that stands still, to be fetched."""
        _keep(self.stills, shown)


def _keep(kept: OrderedDict[int, Shown], shown: Shown) -> None:
    kept[shown.index] = shown
    kept.move_to_end(shown.index)
    while len(kept) > MAX_KEPT_IMAGES:
        kept.popitem(last=False)


class FarDesk:
    """The tracker's desk, seen from here: never blocks, and what many ask is asked once.

    Args:
        pipe: to it.
        slow: to it, too, for what takes a while.
        cameras: one more for each, by name, for its pictures.
    """

    def __init__(
        self, pipe: Connection, slow: Connection, cameras: Mapping[str, Connection]
    ) -> None:
        self.ask = Line(pipe).ask
        self.ask_slowly = Line(slow).ask  # while other questions go on
        self.feeds = {name: Feed(Line(pipe), name) for name, pipe in cameras.items()}
        # In the addresses of images: what a browser kept of an earlier run is none of this one.
        self.run = secrets.token_hex(4)
        self.state: State | None = None
        self.past: deque[Sample] = deque(maxlen=round(HISTORY / SAMPLE))
        self.pages: set[str] = set()  # that are connected, by NiceGUI's id
        self._looked = -math.inf
        self._lock = asyncio.Lock()
        self._drawer = ThreadPoolExecutor(1, "drawer")
        self._drawn: OrderedDict[tuple[int, int], tuple[str, str]] = OrderedDict()

    @property
    def pace(self) -> float:
        """Period of the images of a camera for one browser, s."""
        return max(1 / BROWSER_FPS, len(self.pages) * len(self.feeds) / TOTAL_FPS)

    def due(self, period: float) -> float:
        """Return when a browser's next update is due (s) that has some period (s).

        The more browsers there are, the later.
        """
        return time.monotonic() + period * (max(1, len(self.pages)) - 0.5)

    async def still(self, camera: str, index: int, masks: Sequence[str]) -> Shown | str:
        """See `laptop.page.desk.Desk.still`."""
        still = await self.ask_slowly("still", camera, index, masks)
        if isinstance(still, Shown):
            self.feeds[camera].keep(still)
        return still

    async def look(self) -> State:
        """Return the newest state, and take up the newest history."""
        async with self._lock:
            if self.state is None or time.monotonic() - self._looked > SAMPLE / 2:
                self._looked = time.monotonic()
                self.state = await self.ask("state")
                last = self.past[-1].t if self.past else -math.inf
                self.past.extend(await self.ask("history", last))
        return self.state

    async def report(self, number: int | None) -> tuple[str, str] | None:
        """Return name and text of a run's report, by default the newest; None if there is none."""
        group = await self.ask("record", number)
        if group is None:
            return None
        return await asyncio.get_running_loop().run_in_executor(self._drawer, self._draw, group)

    def _draw(self, group: RunGroup) -> tuple[str, str]:
        from laptop.page import report  # not above: slow to import, and not every page wants one

        key = group.number, len(group.runs)
        if key in self._drawn:
            return self._drawn[key]
        drawn = report.file_name(group), report.render(group)
        if group.runs[-1].ended is not None:
            self._drawn[key] = drawn
            while len(self._drawn) > MAX_GROUPS:
                self._drawn.popitem(last=False)
        return drawn


def csv_of(samples: Sequence[Sample]) -> str:
    """Return the history as CSV: t, error, components, joints, condition, moves, cameras."""
    rows = sorted({row for sample in samples for row in sample.e})
    joints = max((len(sample.q) for sample in samples), default=0)
    cameras = sorted({name for sample in samples for name in sample.ages})
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ["t", "error_px"]
        + [f"e_{row}_px" for row in rows]
        + [f"q{n}_deg" for n in range(1, joints + 1)]
        + ["condition", "moves"]
        + [f"{what}_{name}" for name in cameras for what in ("age_ms", "fps")]
    )
    for sample in samples:
        angles = [math.degrees(angle) for angle in sample.q]
        numbers: list[float | None] = [sample.t, sample.error]
        numbers += [sample.e.get(row) for row in rows]
        numbers += [*angles, *[None] * (joints - len(angles)), sample.condition, sample.moves]
        for name in cameras:
            age = sample.ages.get(name)
            numbers += [None if age is None else 1000 * age, sample.rates.get(name)]
        writer.writerow(["" if n is None else f"{n:.10g}" for n in numbers])
    return out.getvalue()
