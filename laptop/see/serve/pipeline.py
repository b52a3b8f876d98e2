"""One camera's pipeline: a frame is captured, its markers found, and the observation published."""

from __future__ import annotations

import statistics
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from laptop.see.camera.frames import Frame
from laptop.see.markers.tracks import Sighting, Window
from laptop.see.markers.view import AnnotatedFrame, BoardPlace
from laptop.see.serve.detection_stats import DetectionStats
from laptop.see.serve.observation_csv import ObservationCsv, PairedPlace
from shared.messages import GOAL, Observation

SILENCE_TIMEOUT = 1.0
"""Longest wait for a live camera's frame, or three frames' time, before it is reported as silent,
s."""

MAX_SHOWN_AGE = 0.3
"""Greatest age of a place in space that is shown beside a marker, s: the other camera's picture is
later."""

Point = tuple[float, float]
"""A place in an image (u, v), px."""


class FrameSource(Protocol):
    """The part of a camera that tracking uses; see `laptop.see.camera.cameras`."""

    name: str

    @property
    def fps(self) -> float | None: ...  # noqa: D102
    @property
    def notes(self) -> Sequence[str]: ...  # noqa: D102
    @property
    def ended(self) -> bool: ...  # noqa: D102
    def read(self, timeout: float) -> Frame | None: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class FrameTracker(Protocol):
    """The part of a tracker that a pipeline uses; see `laptop.see.markers.tracker`."""

    why: dict[str, str]
    windows: dict[str, Window | None]

    def find(self, image: np.ndarray, t: float) -> Mapping[str, Sighting | None]: ...  # noqa: D102


class ObservationSink(Protocol):
    """The part of the server that a pipeline uses; see `laptop.see.serve.server`."""

    def publish(self, observation: Observation) -> None: ...  # noqa: D102


class TablePlacer(Protocol):
    """Map from pixels to places on the table, once that is known; see `see.table`.

    Attributes:
        version: rises whenever it is found anew how.
        why: why it is not known any more, or "".
        height: of the arm's marker over the table, cm; None: not known.
    """

    version: int
    why: str
    height: float | None

    def update(self, image: np.ndarray) -> None: ...  # noqa: D102
    def place_at(self, pixel: Point, height: float) -> Point | None: ...  # noqa: D102
    def board_place(self, marker: str, pixel: Point) -> BoardPlace | None: ...  # noqa: D102


class PairPlacer(Protocol):
    """Places in space by two cameras; see `see.table.two_cameras`."""

    latest: dict[str, PairedPlace]

    def see(  # noqa: D102
        self, camera: str, frame: Frame, markers: Mapping[str, tuple[float, float, float] | None]
    ) -> list[PairedPlace]: ...
    def lines(self) -> list[str]: ...  # noqa: D102


class PipelineOutputs(NamedTuple):
    """Destinations of a pipeline's results.

    server         gets every frame's observation, or None
    csv            gets every frame's rows, or None
    picture_index  index of the frame to store as a picture; None: the last one
    """

    server: ObservationSink | None = None
    csv: ObservationCsv | None = None
    picture_index: int | None = None


class MarkerPlacers(NamedTuple):
    """Placers of markers beyond the picture.

    table  where on the table, cm, or None
    space  where in space, with the other cameras, or None
    """

    table: TablePlacer | None = None
    space: PairPlacer | None = None


_NO_OUTPUTS = PipelineOutputs()
_NO_PLACERS = MarkerPlacers()


class CameraPipeline:
    """One camera with its tracker, and what became of its frames.

    Args:
        name: short name of the camera in observations, "A", "B", ...
        camera: gives the frames.
        tracker: finds the markers in them.
        goal: a fixed goal (u, v), px, or None.
        outputs: where the results go.
        live: the camera goes on whether or not its frames are taken.
        now: the clock of live capture times, s.
        placers: what knows where on the table and in space the markers are.

    Attributes:
        ended: the camera gives no more frames.
        frames: number of frames so far.
        dropped: number of frames of a live camera that were not taken in time.
        stats: by marker.
        view: the last frame with what was found in it; None before the first.
    """

    def __init__(
        self,
        name: str,
        camera: FrameSource,
        tracker: FrameTracker,
        goal: Point | None = None,
        outputs: PipelineOutputs = _NO_OUTPUTS,
        live: bool = True,
        now: Callable[[], float] = time.monotonic,
        placers: MarkerPlacers = _NO_PLACERS,
    ) -> None:
        self.name = name
        self.camera = camera
        self.live = live
        self.ended = False
        self.frames = 0
        self.dropped = 0
        self.stats: dict[str, DetectionStats] = {}
        self.view: AnnotatedFrame | None = None
        self.fixed = {GOAL: (*goal, 1.0)} if goal else {}
        self._view_changed = threading.Condition()
        self._tracker = tracker
        self._server, self._csv, self._picture_index = outputs
        self._picture_view: AnnotatedFrame | None = None
        self._now = now
        self._placer, self._pairs = placers
        self._ages: deque[float] = deque(maxlen=30)
        self._counts: deque[tuple[float, int]] = deque(maxlen=60)  # when (s), frames by then
        self._last_index: int | None = None
        self._last_frame_at = now()

    def begin(self) -> None:
        """Switch a synthetic camera to its own pace: the steps follow one another from here on."""
        getattr(self.camera, "keep_pace", lambda: None)()

    def step(self, timeout: float) -> bool:
        """Process one frame, if one comes within the timeout (s); False once there are no more."""
        frame = self.camera.read(timeout)
        if frame is None:
            self.ended = self.camera.ended
            return not self.ended
        self._last_frame_at = self._now()
        found = dict(self._tracker.find(frame.image, frame.t))
        markers: dict[str, tuple[float, float, float] | None] = {
            name: seen and (seen.u, seen.v, seen.confidence) for name, seen in found.items()
        }
        markers.update(self.fixed)
        if self._server:
            self._server.publish(Observation(frame.index, self.name, frame.t, markers))
        if self.live:
            self._ages.append(self._now() - frame.t)
        places = self._places(frame, markers)
        if self._csv:
            self._csv.add(self.name, frame, markers, places)
        if self._pairs:
            new = self._pairs.see(self.name, frame, markers)
            if self._csv:
                self._csv.add_pairs(new)
            for name, pair in self._pairs.latest.items():
                if frame.t - pair.t < MAX_SHOWN_AGE and markers.get(name):
                    places.setdefault(name, pair.place)
        self._count(frame, found, places)
        return True

    def _places(
        self, frame: Frame, markers: Mapping[str, tuple[float, float, float] | None]
    ) -> dict[str, BoardPlace]:
        """Return the known places of the markers on the board, by name."""
        if self._placer is None:
            return {}
        self._placer.update(frame.image)
        places = {
            name: self._placer.board_place(name, (seen[0], seen[1]))
            for name, seen in markers.items()
            if seen
        }
        return {name: place for name, place in places.items() if place}

    def _count(
        self, frame: Frame, found: dict[str, Sighting | None], places: dict[str, BoardPlace]
    ) -> None:
        why = dict(self._tracker.why)
        for name, seen in found.items():
            stats = self.stats.setdefault(name, DetectionStats())
            stats.add(seen and seen.confidence, why.get(name, ""))
        if self.live and self._last_index is not None:
            self.dropped += max(0, frame.index - self._last_index - 1)
        self._last_index = frame.index
        self.frames += 1
        with self._view_changed:
            self.view = AnnotatedFrame(frame, found, why, self.fixed, self._tracker.windows, places)
            self._view_changed.notify_all()
        if (
            self._picture_index is not None
            and self._picture_view is None
            and frame.index >= self._picture_index
        ):
            self._picture_view = self.view

    def place_at(self, pixel: Point, height: float) -> Point | None:
        """Return the place over the table, cm, of what a pixel shows at a height, cm, or None."""
        return self._placer.place_at(pixel, height) if self._placer else None

    @property
    def marker_height(self) -> float | None:
        """Height of the arm's marker over the table, cm, if that is known."""
        return self._placer.height if self._placer else None

    @property
    def placing(self) -> tuple[int, str]:
        """Version of the calibration in use, 0: none; and why it places nothing any more, or ""."""
        return (self._placer.version, self._placer.why) if self._placer else (0, "")

    def wait(self, timeout: float) -> None:
        """Wait until the next frame has been processed, or for so long (s)."""
        with self._view_changed:
            self._view_changed.wait(timeout)

    @property
    def picture_view(self) -> AnnotatedFrame | None:
        """View of the frame to store as a picture, by default the last one; None: not there yet."""
        return self.view if self._picture_index is None else self._picture_view

    @property
    def trouble(self) -> str:
        """The camera's trouble in words, or ""."""
        return getattr(self.camera, "why", "")

    @property
    def silence(self) -> str:
        """The time for which a live camera has given nothing, in words, or ""."""
        silent = self._now() - self._last_frame_at
        fps = self.camera.fps
        usual = max(SILENCE_TIMEOUT, 3 / fps if fps else SILENCE_TIMEOUT)
        return f"no frame for {silent:.0f} s" if self.live and silent > usual else ""

    @property
    def slowness(self) -> str:
        """A line that says that this computer is too slow for a synthetic camera, or ""."""
        return getattr(self.camera, "slowness", "")

    @property
    def age(self) -> float | None:
        """Median age of a live camera's last frames once processed, s; None without any."""
        ages = list(self._ages)
        return statistics.median(ages) if ages else None

    def rate(self) -> float:
        """Return frames per second over the last second or two, up to now."""
        now = self._now()
        while len(self._counts) > 1 and now - self._counts[1][0] >= 1.0:
            self._counts.popleft()
        before, frames = self._counts[0] if self._counts else (now, self.frames)
        self._counts.append((now, self.frames))
        return (self.frames - frames) / (now - before) if now > before else 0.0
