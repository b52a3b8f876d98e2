"""Hints where the goal is in pictures in which it is not aimed at yet, as the tip has taught."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from itertools import permutations

from laptop.page.camera_feed import CameraFeed
from laptop.see.markers.two_views import TwoViews
from laptop.see.serve.pipeline import Point
from shared.messages import EFFECTOR, LEAST_CONFIDENCE

MAX_FRAME_GAP = 0.2
"""Greatest time between two frames between which the tip counts as moving straight on, s."""
MAX_SPEED = 150.0
"""Greatest speed of a tip that is used, px/s: nobody knows the clocks of two cameras to the
millisecond."""


class GoalHints:
    """Hints of a goal from the tip's places in the pictures of all cameras.

    Args:
        cameras: feeds by camera name.
    """

    def __init__(self, cameras: Mapping[str, CameraFeed]) -> None:
        self._cameras = cameras
        self._lately: dict[str, deque[tuple[float, Point]]] = {
            name: deque(maxlen=2) for name in cameras
        }
        self._views = {pair: TwoViews() for pair in permutations(cameras, 2)}
        self._lock = threading.Lock()

    def learn(self) -> None:
        """Sample the tip; to be called at every heartbeat."""
        if len(self._cameras) < 2:
            return
        for name, feed in self._cameras.items():
            view, lately = feed.watcher.view, self._lately[name]
            if view is None or (lately and lately[-1][0] == view.frame.t):
                continue
            seen = view.found.get(EFFECTOR)
            if seen and seen.confidence >= LEAST_CONFIDENCE:
                lately.append((view.frame.t, (seen.u, seen.v)))
            else:
                lately.clear()
        with self._lock:
            for (one, other), views in self._views.items():
                pair = _at_one_time(self._lately[one], self._lately[other])
                if pair:
                    views.add(*pair)

    def of(
        self, camera: str, aims: Mapping[str, Point], size: tuple[int, int]
    ) -> tuple[Point, ...]:
        """Return a line (two ends) or a place, px, where the goal must be; nothing if not known.

        Args:
            camera: in whose picture.
            aims: per camera where the tip is to go, px.
            size: of the picture, px.
        """
        for other, aim in aims.items():
            if other != camera:
                with self._lock:
                    return self._views[other, camera].where(aim, size)
        return ()


def _at_one_time(
    one: deque[tuple[float, Point]], other: deque[tuple[float, Point]]
) -> tuple[Point, Point] | None:
    """Return where the tip was at one time in both pictures, px; None: that is not known well."""
    if len(one) < 2 or len(other) < 2:
        return None
    t = min(one[1][0], other[1][0])
    places = []
    for (t0, (u0, v0)), (t1, (u1, v1)) in (one, other):
        fast = max(abs(u1 - u0), abs(v1 - v0)) > MAX_SPEED * (t1 - t0)
        if not t0 <= t <= t1 or t1 - t0 > MAX_FRAME_GAP or fast:
            return None
        share = (t - t0) / (t1 - t0) if t1 > t0 else 1.0
        places.append((u0 + share * (u1 - u0), v0 + share * (v1 - v0)))
    return places[0], places[1]
