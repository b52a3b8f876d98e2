"""Finder of ArUco markers, by OpenCV's detector: first in the window, then in the frame.

The detector says which ones there are and about where; all of a marker's cells say where exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import cv2
import numpy as np

from laptop.see.markers.finders.code_alignment import align, project
from laptop.see.markers.finders.confidence import ramp
from laptop.see.markers.finders.other_codes import OURS, only, other_codes
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracks import Sighting, Track

MIN_WINDOW = 16
"""Least side of a window in which a marker can be read, px."""
OTHERS_EVERY = 32
"""Number of frames without the marker from one search for other codes to the next."""


def find_aruco(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
    """Find an ArUco marker in one frame; see `tracker.MarkerFinder`."""
    height, width = image.shape[:2]
    windows = [(0, 0, width, height)]
    place = track.predict(t)
    if place is not None:
        u, v, radius = place
        half = 2.2 * radius + 20
        box = (
            max(0, int(u - half)),
            max(0, int(v - half)),
            min(width, int(u + half)),
            min(height, int(v + half)),
        )
        if box[2] - box[0] > MIN_WINDOW and box[3] - box[1] > MIN_WINDOW:
            windows.insert(0, box)
    for left, top, right, bottom in windows:
        grey = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_BGR2GRAY)
        corners, ids, _ = detector().detectMarkers(grey)
        for quad, id_ in zip(corners, [] if ids is None else ids.flatten(), strict=True):
            if id_ == marker.id:
                new = _sighting_of(grey, quad[0].astype(float), int(id_), (left, top))
                return track.update(Track(new, seen=new), t)
    others = [] if ids is None else ids.flatten()
    seen = {int(id_): quad[0] for id_, quad in zip(others, corners, strict=True)}
    return track.miss(None, _why_none(grey, marker, seen, track))


def _why_none(
    grey: np.ndarray, marker: Marker, seen: Mapping[int, np.ndarray], track: Track
) -> str:
    """Return why a marker is not seen, by the other markers in the picture, searched at intervals.

    Args:
        grey: the whole frame, uint8.
        marker: what is looked for.
        seen: corners of others of its kind, by number.
        track: what was known before.
    """
    if not seen and track.why and track.misses % OTHERS_EVERY:
        return track.why
    found = {OURS: dict(seen)} if seen else other_codes(grey)
    assert marker.id is not None
    found.get(OURS, {}).pop(marker.id, None)  # too blurred to be placed, if it was read there
    return f"no ArUco marker {marker.id}{only(found)}"


@lru_cache(maxsize=2)
def detector(dictionary: int = cv2.aruco.DICT_4X4_50) -> cv2.aruco.ArucoDetector:
    """Return OpenCV's detector for a dictionary number, tolerant of slight blur."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    # Read the bits where blur leaves them: finer, and off their edges.  (Of 60 frames with a side
    # of 32 px it missed 5 by default, and misses none.)
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary), parameters)


def _sighting_of(
    grey: np.ndarray, corners: np.ndarray, number: int, origin: tuple[int, int]
) -> Sighting:
    """Place a marker where the middle of its square is, under any perspective.

    Args:
        grey: the window, uint8.
        corners: in turn, px in the window, shape (4, 2).
        number: the marker's id.
        origin: of the window in the frame, px.
    """
    homography, _ = align(grey, corners, number, cv2.aruco.DICT_4X4_50)
    u, v = project(homography, np.zeros((1, 2)))[0] + origin
    side = math.sqrt(abs(cv2.contourArea(corners.astype(np.float32))))
    return Sighting(float(u), float(v), ramp(side, 10, 24), side / math.sqrt(2))
