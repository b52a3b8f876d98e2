"""The tracker's controller as the page's process sees it; all browsers share it."""

from __future__ import annotations

import asyncio
import csv
import io
import math
import secrets
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

from laptop.page.drawing_snapshots import DrawingSnapshot, InkPoint
from laptop.page.interface import Calls, DrawViews, FrameCalls, StatusCalls
from laptop.page.rpc import RpcClient
from laptop.page.run_records import MAX_GROUPS, RunGroup
from laptop.page.snapshots import (
    HISTORY_DURATION,
    SAMPLE_PERIOD,
    FrameSnapshot,
    PageState,
    PlotSample,
)
from laptop.record.run_folder import RUNS, new_folder
from shared.arm_description import ArmError

P = ParamSpec("P")
R = TypeVar("R")

MAX_FRAME_RATE, MAX_TOTAL_FRAME_RATE = 16.0, 20.0
"""Frames per second of a camera that one browser gets, and of all cameras that all browsers get:
more show nobody more, and browsers on this machine take the tracker's time."""
NEXT_FRAME_TIMEOUT = 0.1
"""Time to wait for the next frame, s, before a browser is shown one that has waited."""
INK_PERIOD = 0.3
"""Time between two questions for more ink, s."""
FETCHABLE_FRAMES = 40
"""Number of frames of a camera that browsers may still fetch."""


class AsyncChannel:
    """Remote calls that do not block the event loop; one at a time.

    Args:
        pipe: to `laptop.page.rpc.serve_requests`.
    """

    def __init__(self, pipe: Connection) -> None:
        self._client = RpcClient(pipe)
        self._thread = ThreadPoolExecutor(1, "channel")

    async def call(
        self, method: Callable[Concatenate[Calls, P], R], *args: P.args, **kwargs: P.kwargs
    ) -> R:
        """Return what a method of the controller returns, see `laptop.page.rpc.RpcClient.call`."""
        call = partial(self._client.call, method, *args, **kwargs)
        return await asyncio.get_running_loop().run_in_executor(self._thread, call)


class Feed:
    """Frames of one camera, for one browser after the other.

    They do not share one: on this machine, all would be busy with it at the same time.

    Args:
        channel: to the controller, for this camera alone.
        camera: its name.

    Attributes:
        shown: the newest frames by index.
        stills: frames that somebody has paused at, by index.
        masks: name of the marker whose pixels are to be shown, by browser.
    """

    def __init__(self, channel: AsyncChannel, camera: str) -> None:
        self._channel = channel
        self.camera = camera
        self.shown: OrderedDict[int, FrameSnapshot] = OrderedDict()
        self.stills: OrderedDict[int, FrameSnapshot] = OrderedDict()
        self.masks: dict[str, str] = {}
        self._turn = asyncio.Lock()

    @property
    def newest(self) -> FrameSnapshot | None:
        """Newest frame that is here."""
        return next(reversed(self.shown.values())) if self.shown else None

    async def next(self) -> FrameSnapshot | None:
        """Return the next frame, or the newest if none comes; None if there is none at all."""
        async with self._turn:
            newest = self.newest
            after, within = (newest.index, NEXT_FRAME_TIMEOUT) if newest else (-1, 0.0)
            masks = tuple(set(self.masks.values()))
            shown = await self._channel.call(FrameCalls.view, self.camera, after, masks, within)
            if shown:
                _put(self.shown, shown)
            return self.newest

    def store_still(self, shown: FrameSnapshot) -> None:
        """Store a frame at which a browser has paused."""
        _put(self.stills, shown)


def _put(cache: OrderedDict[int, FrameSnapshot], shown: FrameSnapshot) -> None:
    cache[shown.index] = shown
    cache.move_to_end(shown.index)
    while len(cache) > FETCHABLE_FRAMES:
        cache.popitem(last=False)


class Ink:
    """Ink of a job in a camera's picture, as far as it was fetched.

    Attributes:
        version: of it; another one begins anew.
        points: in order.
    """

    def __init__(self) -> None:
        self.version = -1
        self.points: list[InkPoint] = []
        self.asked = -math.inf  # s


class AsyncController:
    """Tracker's controller, seen from the page's process: never blocks, and asks once for many.

    Args:
        pipe: to the controller.
        slow: to it, too, for calls that take a while.
        cameras: one more pipe for the frames of each camera, by its name.
        runs: folder for the runs whose report somebody has opened.

    Attributes:
        call: makes a remote call, see `AsyncChannel.call`.
        call_slowly: makes one that takes a while; other calls go on.
        feeds: by camera name.
        state: the newest that is known, or None.
        past: points of the plots.
        pages: NiceGUI's ids of the pages that are connected.
    """

    def __init__(
        self,
        pipe: Connection,
        slow: Connection,
        cameras: Mapping[str, Connection],
        runs: Path = Path(RUNS),
    ) -> None:
        self._runs = runs
        self._report_folders: dict[int, Path] = {}  # by a group's number
        self.call = AsyncChannel(pipe).call
        self.call_slowly = AsyncChannel(slow).call
        self.feeds = {name: Feed(AsyncChannel(pipe), name) for name, pipe in cameras.items()}
        # Part of the pictures' addresses: a browser's cache of an earlier run does not match.
        self.run = secrets.token_hex(4)
        self.state: PageState | None = None
        self.past: deque[PlotSample] = deque(maxlen=round(HISTORY_DURATION / SAMPLE_PERIOD))
        self.pages: set[str] = set()
        self._last_poll = -math.inf
        self._lock = asyncio.Lock()
        self._drawer = ThreadPoolExecutor(1, "drawer")
        self._reports: OrderedDict[tuple[int, int], tuple[str, str]] = OrderedDict()
        self._drawing = -1, DrawingSnapshot(None, {})  # with its revision
        self._inks = {name: Ink() for name in cameras}
        self._draw_lock = asyncio.Lock()

    @property
    def pace(self) -> float:
        """Time between two frames of a camera for one browser, s."""
        return max(1 / MAX_FRAME_RATE, len(self.pages) * len(self.feeds) / MAX_TOTAL_FRAME_RATE)

    def due(self, period: float) -> float:
        """Return when a browser's next update is due (s, time.monotonic), later if there are many.

        Args:
            period: of the update, s.
        """
        return time.monotonic() + period * (max(1, len(self.pages)) - 0.5)

    async def still(self, camera: str, index: int, masks: Sequence[str]) -> FrameSnapshot | str:
        """Return a frame as `laptop.page.frames.Frames.still` does."""
        still = await self.call_slowly(FrameCalls.still, camera, index, masks)
        if isinstance(still, FrameSnapshot):
            self.feeds[camera].store_still(still)
        return still

    async def poll(self) -> PageState:
        """Return the newest state; `past` is the newest, too."""
        async with self._lock:
            if self.state is None or time.monotonic() - self._last_poll > SAMPLE_PERIOD / 2:
                self._last_poll = time.monotonic()
                self.state = await self.call(StatusCalls.state)
                last = self.past[-1].t if self.past else -math.inf
                self.past.extend(await self.call(StatusCalls.history, last))
        return self.state

    async def drawing(self, revision: int) -> DrawingSnapshot:
        """Return the drawing at a revision, or later; one call for all browsers."""
        async with self._draw_lock:
            if self._drawing[0] != revision:
                self._drawing = revision, await self.call_slowly(DrawViews.drawing)
            return self._drawing[1]

    async def ink(self, camera: str) -> Ink:
        """Return the ink of the job that is on, or was last, in a camera's picture."""
        ink = self._inks[camera]
        async with self._draw_lock:
            if time.monotonic() - ink.asked > INK_PERIOD:
                ink.asked = time.monotonic()
                known = ink.version, len(ink.points)
                version, points = await self.call(DrawViews.ink, camera, *known)
                if version != ink.version:
                    ink.version, ink.points = version, []
                ink.points += points
        return ink

    async def report(self, number: int | None) -> tuple[str, str] | None:
        """Return file name and text of a run's report, by default the newest run's, or None."""
        group = await self.call(StatusCalls.record, number)
        if group is None:
            return None
        return await asyncio.get_running_loop().run_in_executor(
            self._drawer, self._write_report, group
        )

    def _write_report(self, group: RunGroup) -> tuple[str, str]:
        from laptop.page import report  # not above: slow to import, and not every page wants one

        key = group.number, len(group.runs)
        if key in self._reports:
            return self._reports[key]
        name, has_ended = report.file_name(group), group.runs[-1].ended is not None
        try:
            if has_ended and group.number not in self._report_folders:
                self._report_folders[group.number] = new_folder(report.COMMAND, self._runs)
            text = (
                name,
                report.render(group, self._report_folders[group.number] if has_ended else None),
            )
        except ArmError as error:
            why = str(error).partition(";")[0]  # the advice is for another command
            text = name, report.render(group, why_not_stored=f"it is not kept: {why}")
        if group.runs[-1].ended is not None:
            self._reports[key] = text
            while len(self._reports) > MAX_GROUPS:
                self._reports.popitem(last=False)
        return text


def csv_of(samples: Sequence[PlotSample]) -> str:
    """Return the plots as CSV: time, error, its components, joints in degrees, cameras."""
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
