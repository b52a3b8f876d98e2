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
        """Forget all: another job begins."""
        for track in self._tracks.values():
            track.begin()

    def see(self, tips: Mapping[str, tuple[float, Point]]) -> None:
        """Take in where cameras see the tip: when, s, and where, px, by camera."""
        for name, tip in tips.items():
            self._tracks[name].see(*tip)

    def tell(self, t: float, down: bool) -> None:
        """Take in whether the pen was down at t (s)."""
        for track in self._tracks.values():
            track.tell(t, down)

    def judge(self, now: float) -> None:
        """Judge what is waited for, at a time, s."""
        for track in self._tracks.values():
            track.judge(now)

    def show_elsewhere(self) -> None:
        """Have whoever has points begin anew: they lie elsewhere now."""
        for track in self._tracks.values():
            track.version += 1

    def points(self, camera: str, version: int, after: int) -> tuple[int, list[InkPoint]]:
        """Return the version of a camera's ink, and its points; of that `version` those `after`."""
        track = self._tracks[camera]
        first = after if version == track.version else 0
        points, shifts = track.points[first:], np.array(track.shifts[first:])
        view = self._paper.view(camera)
        if points and view:
            # What is seen is the marker, beside the pen and over it.
            seen = np.array([(point.u, point.v) for point in points])
            places = view.to_picture(self._paper.pen_places(camera, seen, shifts))
            points = [
                InkPoint(float(u), float(v), point.begins) if math.isfinite(u + v) else point
                for (u, v), point in zip(places, points, strict=True)
            ]
        return track.version, points

    def lines(self) -> Lines | None:
        """Return the ink on the paper, lines of points (n, 2), cm; None: no camera tells it."""
        for name, track in self._tracks.items():
            if self._paper.view(name) and len(track.points) > 1:
                lines = track.lines(partial(self._paper.pen_places, name))
                return tuple(line[np.isfinite(line).all(axis=1)] for line in lines)
        return None
