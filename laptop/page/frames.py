"""Frames for the page: the newest ones and stills, with all that is drawn over them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

from laptop.page.camera_feed import CameraFeed, FrameGone, marks, mask
from laptop.page.goal_hints import GoalHints
from laptop.page.run_control import RunControl
from laptop.page.snapshots import HISTORY_DURATION, FrameSnapshot
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.view import AnnotatedFrame
from shared.arm_description import ArmError


class Frames:
    """Frames of all cameras; from any thread.

    Args:
        cameras: feeds by camera name.
        runs: has the goals and the path.
        hints: tells where a goal must be in the other pictures.
        now: clock of the frames, s.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraFeed],
        runs: RunControl,
        hints: GoalHints,
        now: Callable[[], float],
    ) -> None:
        self._cameras, self._runs, self._hints, self._now = cameras, runs, hints, now

    def view(
        self, camera: str, newer_than: int = -1, masks: Sequence[str] = (), within: float = 0.0
    ) -> FrameSnapshot | None:
        """Return the newest frame of a camera; None if there is none after `newer_than`.

        Args:
            camera: its name.
            newer_than: index of a frame.
            masks: names of markers whose pixels are to be shown, too.
            within: time to wait for a new one, s; this thread answers nothing else meanwhile.
        """
        feed = self._cameras[camera]
        if within > 0:
            feed.watcher.wait(within)
        view = feed.watcher.view
        if view is None or view.frame.index <= newer_than:
            return None
        if not feed.given or feed.given[-1] is not view:
            feed.given.append(view)
        return self._snapshot(feed, view, masks)

    def still(self, camera: str, index: int, masks: Sequence[str] = ()) -> FrameSnapshot | str:
        """Return a frame that was given out, or any of a recording, with today's markers found.

        It is looked at by itself: what was known from the frames before it is not used.  To read it
        may take a while, in which this thread answers nothing else.

        Args:
            camera: its name.
            index: of the frame.
            masks: names of markers whose pixels are to be shown, too.

        Returns:
            the frame; or in one line why it cannot be had.
        """
        feed = self._cameras[camera]
        try:
            frame = feed.frame(index)
        except ArmError as error:
            return str(error)
        tracker = Tracker(feed.tracker.markers)
        found = tracker.find(frame.image, frame.t)
        fixed = feed.watcher.view.fixed if feed.watcher.view else {}
        view = AnnotatedFrame(frame, found, tracker.why, fixed, tracker.windows)
        return self._snapshot(feed, view, masks)

    def pin(self, camera: str, index: int) -> str:
        """Pin a frame in the cache, for picking in it."""
        feed = self._cameras[camera]
        try:
            feed.pinned.append(feed.find(index))
        except FrameGone as gone:
            return str(gone)
        return ""

    def _snapshot(
        self, feed: CameraFeed, view: AnnotatedFrame, masks: Sequence[str]
    ) -> FrameSnapshot:
        camera, frame = feed.watcher.name, view.frame
        height, width = frame.image.shape[:2]
        trail_from = frame.t - HISTORY_DURATION
        age = self._now() - frame.t
        return FrameSnapshot(
            camera,
            frame.index,
            frame.t,
            age,
            time.monotonic() - age,
            width,
            height,
            feed.jpeg(view),
            tuple(marks(view)),
            self._runs.aims.get(camera),
            self._runs.ahead(camera),
            tuple(where for t, where in list(feed.trail) if trail_from <= t <= frame.t),
            {
                marker.name: mask(frame.image, marker)
                for marker in feed.tracker.markers
                if marker.name in masks and marker.color
            },
            self._hints.of(camera, dict(self._runs.aims), (width, height)),
        )
