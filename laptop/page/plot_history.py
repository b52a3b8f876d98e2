"""The points of the page's plots."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from laptop.page.brick_link import BrickLink
from laptop.page.camera_feed import HEARTBEAT_PERIOD, CameraFeed
from laptop.page.snapshots import HISTORY_DURATION, SAMPLE_PERIOD, PlotSample


class PlotHistory:
    """Keeps a point every SAMPLE_PERIOD, for HISTORY_DURATION.

    Args:
        cameras: feeds by camera name.
        link: to the brick.
    """

    def __init__(self, cameras: Mapping[str, CameraFeed], link: BrickLink) -> None:
        self._cameras, self._link = cameras, link
        self._samples: deque[PlotSample] = deque(maxlen=round(HISTORY_DURATION / SAMPLE_PERIOD))

    def after(self, t: float) -> list[PlotSample]:
        """Return the points that are later than t, s."""
        return [sample for sample in list(self._samples) if sample.t > t]

    def poll(self, now: float) -> None:
        """Take a point where one is due; `now` is s."""
        last = self._samples[-1].t if self._samples else None
        if last is None or now - last >= SAMPLE_PERIOD - HEARTBEAT_PERIOD / 2:
            self._samples.append(self._sample(now))

    def _sample(self, now: float) -> PlotSample:
        status = self._link.state().status
        for feed in self._cameras.values():
            feed.update_rate(now)
        return PlotSample(
            t=now,
            error=status and status.error,
            e=dict(status.e) if status else {},
            q=tuple(status.q) if status else (),
            condition=status and status.condition,
            moves=status.moves if status else 0,
            ages={name: feed.watcher.age for name, feed in self._cameras.items()},
            rates={name: feed.rate for name, feed in self._cameras.items()},
        )
