"""An image becomes marker positions with a confidence.  Pure: no camera, no socket, no window.

A marker that was seen is measured in a window where it is expected; one that was not is searched
for in the whole frame.  Only what was measured in this very frame comes out.  Pixel centres lie at
integer coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Protocol

import numpy as np

from laptop.see.markers.kinds import MARKER_KINDS
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracks import Sighting, Track, Window


class MarkerFinder(Protocol):
    """Finder of one marker in one frame."""

    def __call__(self, image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
        """Find it.

        Args:
            image: BGR, uint8, shape (h, w, 3).
            t: capture time, s.
            marker: what to look for.
            track: what was known of it before this frame.

        Returns:
            what is known of it now.
        """


def _finder(place: str) -> MarkerFinder:
    """Return the function of module:function."""
    module, _, name = place.partition(":")
    function: MarkerFinder = getattr(import_module(module), name)
    return function


FINDERS = {kind.name: _finder(kind.finder) for kind in MARKER_KINDS}
"""Finders by the kind of marker."""


class Tracker:
    """Finder of markers in one camera's consecutive frames.

    Args:
        markers: what to look for.

    Attributes:
        markers: what is looked for; may be set at any time, also from another thread.
        why: per marker why it was not seen in the last frame; "" if it was.
        windows: per marker where it was looked for first: left, top, right, bottom (px); None is
            the whole frame.
    """

    def __init__(self, markers: Sequence[Marker]):
        self.markers = tuple(markers)
        self.why = {marker.name: "" for marker in markers}
        self.windows: dict[str, Window | None] = {}
        self._tracks: dict[Marker, Track] = {}  # by what it looks like: a new look, a new start

    def find(self, image: np.ndarray, t: float) -> dict[str, Sighting | None]:
        """Find the markers in one frame.

        Args:
            image: BGR, uint8, shape (h, w, 3).
            t: capture time, s.

        Returns:
            per marker a Sighting, or None if it is not seen.
        """
        markers = self.markers
        before, self._tracks = self._tracks, {}
        self.why, self.windows = {}, {}
        found = {}
        for marker in markers:
            known = before.get(marker) or Track(color=marker.color)
            self.windows[marker.name] = known.window(t)
            track = self._tracks[marker] = FINDERS[marker.kind](image, t, marker, known)
            self.why[marker.name] = track.why
            found[marker.name] = track.sighting
        return found
