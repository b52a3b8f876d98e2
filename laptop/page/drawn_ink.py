"""The ink of a job as all cameras see it, and where the pen was on the paper."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np

from laptop.page.drawing_snapshots import InkPoint, Lines
from laptop.page.ink_track import InkTrack
from laptop.page.paper_views import PaperViews
from laptop.see.serve.pipeline import Point


class DrawnInk:
    """The ink of one job.

    Args:
        cameras: their names.
        paper: where it is in their pictures.
    """

    def __init__(self, cameras: Iterable[str], paper: PaperViews) -> None:
        self._paper = paper
        self._tracks = {name: InkTrack(paper.marker_shift) for name in cameras}

    def begin(self) -> None:
        """Clear the ink: another job begins."""
        for track in self._tracks.values():
            track.begin()

    def add_tip(self, tips: Mapping[str, tuple[float, Point]]) -> None:
        """Add a sample of the tip by camera: time, s, and pixel."""
        for name, tip in tips.items():
            self._tracks[name].add_tip(*tip)

    def set_pen(self, t: float, down: bool) -> None:
        """Set whether the pen was down at t (s)."""
        for track in self._tracks.values():
            track.set_pen(t, down)

    def resolve(self, now: float) -> None:
        """Resolve the samples that wait for the pen's state or the marker's shift, at a time, s."""
        for track in self._tracks.values():
            track.resolve(now)

    def invalidate(self) -> None:
        """Invalidate the points that browsers have: the mapping has changed."""
        for track in self._tracks.values():
            track.version += 1

    def points(self, camera: str, version: int, after: int) -> tuple[int, list[InkPoint]]:
        """Return the version of a camera's ink, and its points; of that `version` those `after`."""
        track = self._tracks[camera]
        first = after if version == track.version else 0
        points, shifts = track.points[first:], np.array(track.shifts[first:])
        view = self._paper.view(camera)
        if points and view:
            # The cameras see the marker, which is beside the pen and above it.
            seen = np.array([(point.u, point.v) for point in points])
            places = view.to_picture(self._paper.pen_places(camera, seen, shifts))
            points = [
                InkPoint(float(u), float(v), point.begins) if math.isfinite(u + v) else point
                for (u, v), point in zip(places, points, strict=True)
            ]
        return track.version, points

    def lines(self) -> Lines | None:
        """Return the ink on the paper, lines of points (n, 2), cm; None: no mapping."""
        for name, track in self._tracks.items():
            if self._paper.view(name) and len(track.points) > 1:
                lines = track.lines(partial(self._paper.pen_places, name))
                return tuple(line[np.isfinite(line).all(axis=1)] for line in lines)
        return None
