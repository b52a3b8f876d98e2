"""Finder of balls.

A ball is shaded, shines and is held in fingers: there the circle is taken that most of its outline
lies on.
"""

from __future__ import annotations

import numpy as np

from laptop.see.markers.finders.circle_measurement import color_window, measure_circle
from laptop.see.markers.finders.color_search import find_by_color
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracks import Place, Track


def find_ball(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
    """Find a ball in one frame; see `tracker.MarkerFinder`."""
    return find_by_color(image, t, marker, track, _measure)


def _measure(
    image: np.ndarray, t: float, place: Place, marker: Marker, track: Track
) -> Track | None:
    window = color_window(image, place, track)
    return None if window is None else measure_circle(window, marker, track)
