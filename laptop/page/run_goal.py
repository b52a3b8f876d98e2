"""Goal of the tip: a pixel of each camera, a path in one picture, or the goal's marker."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence

from laptop.page.camera_feed import CameraFeed
from laptop.page.colour_edits import ColourEdits
from laptop.see.serve.pipeline import Point
from shared.messages import GOAL

WAYPOINT_SPACING = 25.0
"""Distance between two waypoints of a path, px."""


class RunGoal:
    """The goal of runs.

    Args:
        cameras: feeds by camera name.
        colours: has the markers that are looked for.

    Attributes:
        aims: goal of each camera, (u, v) px; {}: the goal's marker is the goal.
    """

    def __init__(self, cameras: Mapping[str, CameraFeed], colours: ColourEdits) -> None:
        self._cameras, self._colours = cameras, colours
        self.aims: dict[str, Point] = {}
        self._waypoints: deque[Point] = deque()
        self._path_camera = ""  # in whose picture the path was drawn
        self._was_used = False  # a run has gone to the aims

    @property
    def left(self) -> int:
        """Number of waypoints still to come."""
        return len(self._waypoints)

    def ahead(self, camera: str) -> tuple[Point, ...]:
        """Return the waypoints still to come in a camera's picture, (u, v) px."""
        return tuple(self._waypoints) if camera == self._path_camera else ()

    @property
    def is_fixed(self) -> bool:
        """Return True if the command line has fixed the goal."""
        return all(
            bool(feed.watcher.view and feed.watcher.view.fixed) for feed in self._cameras.values()
        )

    def why_none(self) -> str:
        """Return why there is no goal, or ""."""
        if self.aims:
            missing = [name for name in self._cameras if name not in self.aims]
            if missing:
                return f"click the goal in the picture of camera {' and '.join(missing)}, too"
            return ""
        if not self.is_fixed and GOAL not in (marker.name for marker in self._colours.markers):
            return "there is no goal yet; click one in the picture, or pick a goal marker"
        return ""

    def why_not(self, camera: str, points: Sequence[Point]) -> str:
        """Return why pixels (u, v), px, of a camera cannot be goals, or ""."""
        view = self._cameras[camera].watcher.view
        if view is None:
            return f"camera {camera} gives no picture to aim in; look at its cable"
        height, width = view.frame.image.shape[:2]
        for u, v in points:
            if not (0 <= u <= width - 1 and 0 <= v <= height - 1):
                return (
                    f"goal {u:.0f},{v:.0f} is outside the picture; u from 0 to {width - 1}, "
                    f"v from 0 to {height - 1}"
                )
        return ""

    def aim(self, camera: str, points: Sequence[Point]) -> None:
        """Set the goal to pixels (u, v), px, of a camera, one after the other."""
        first, *others = points
        if self._was_used:  # a new goal: where others saw the last one, this one is not
            self.aims, self._was_used = {}, False
        self.aims[camera] = first
        self._waypoints = deque(others)
        self._path_camera = camera if others else ""

    def aim_at_marker(self) -> None:
        """Set the goal to the goal's marker."""
        self.aims = {}
        self.drop_path()

    def drop_path(self) -> None:
        """Give the waypoints up that are still to come."""
        self._waypoints, self._path_camera = deque(), ""

    def use(self) -> None:
        """Mark the goal as used: a run goes to it."""
        self._was_used = True

    def go_on(self) -> None:
        """Make the next waypoint the goal."""
        self.aims[self._path_camera] = self._waypoints.popleft()


def thinned(points: Sequence[Point]) -> list[Point]:
    """Return the waypoints of a path: no two closer than WAYPOINT_SPACING, but for the last."""
    waypoints = [points[0]]
    for point in points[1:]:
        if math.dist(waypoints[-1], point) >= WAYPOINT_SPACING:
            waypoints.append(point)
    if len(waypoints) > 1 and math.dist(waypoints[-1], points[-1]) < WAYPOINT_SPACING / 2:
        waypoints[-1] = points[-1]
    elif waypoints[-1] != points[-1]:
        waypoints.append(points[-1])
    return waypoints
