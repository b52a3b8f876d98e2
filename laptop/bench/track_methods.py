"""The compared methods: the tracker itself, and the usual OpenCV recipes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from laptop.see.markers.markers import Color, Marker, hsv_mask
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.tracks import Sighting

Method = Callable[[np.ndarray, float], "Sighting | None"]
"""Method: a picture (BGR, uint8) and its time (s) -> where the marker is."""


def ours(marker: Marker) -> Method:
    """Return the tracker as it is, fed frame after frame."""
    tracker = Tracker([marker])
    return lambda image, t: tracker.find(image, t)[marker.name]


def mask_of(image: np.ndarray, color: Color) -> np.ndarray:
    """Return the whole picture in HSV, through the gate (two `inRange` for a red one)."""
    return hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), color)


def hsv_moments(image: np.ndarray, color: Color) -> Sighting | None:
    """Return the centre of gravity of all pixels in the gate."""
    m = cv2.moments(mask_of(image, color), True)
    return sighting_of_moments(m) if m["m00"] else None


def hsv_contours(image: np.ndarray, color: Color) -> Sighting | None:
    """Return the centre of gravity of the largest contour in the gate."""
    blob = _largest(mask_of(image, color))
    if blob is None:
        return None
    m = cv2.moments(blob)
    return sighting_of_moments(m) if m["m00"] else None


def sighting_of_moments(m: Any) -> Sighting:
    """Return centre and radius (px) of a blob with these image moments, OpenCV's."""
    area = m["m00"]
    return Sighting(m["m10"] / area, m["m01"] / area, 1.0, math.sqrt(area / math.pi))


def _largest(mask: np.ndarray) -> np.ndarray | None:
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return max(blobs, key=cv2.contourArea, default=None)


def blur_and_enclose(image: np.ndarray, color: Color) -> Sighting | None:
    """Blur, gate, erode, dilate, the circle around the largest contour: as tutorials have it."""
    mask = mask_of(cv2.GaussianBlur(image, (11, 11), 0), color)
    square = np.ones((3, 3), np.uint8)
    mask = cv2.dilate(cv2.erode(mask, square, iterations=2), square, iterations=2)
    blob = _largest(mask)
    if blob is None:
        return None
    (u, v), radius = cv2.minEnclosingCircle(blob)
    return Sighting(u, v, 1.0, radius)


def hough(image: np.ndarray, radius: float) -> Sighting | None:
    """Return the circle with most votes among those of about this radius (px)."""
    grey = cv2.GaussianBlur(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (5, 5), 0)
    low, high = math.floor(0.7 * radius), math.ceil(1.4 * radius)
    circles = cv2.HoughCircles(
        grey, cv2.HOUGH_GRADIENT, 1, 20, param1=100, param2=15, minRadius=low, maxRadius=high
    )
    if circles is None:
        return None
    u, v, r = circles.reshape(-1, 3)[0]
    return Sighting(float(u), float(v), 1.0, float(r))


def spots(radius: float) -> Method:
    """Return OpenCV's SimpleBlobDetector on grey: the spot nearest to this radius (px)."""
    wanted = cv2.SimpleBlobDetector.Params()
    wanted.filterByColor = wanted.filterByInertia = wanted.filterByConvexity = False
    wanted.minArea, wanted.maxArea = 0.4 * math.pi * radius**2, 2.5 * math.pi * radius**2
    wanted.minThreshold, wanted.maxThreshold, wanted.thresholdStep = 10, 250, 5
    detector = cv2.SimpleBlobDetector.create(wanted)

    def find(image: np.ndarray, t: float) -> Sighting | None:
        found = [
            Sighting(spot.pt[0], spot.pt[1], 1.0, spot.size / 2)
            for spot in detector.detect(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
        ]
        return min(found, key=lambda one: abs(math.log(one.radius / radius)), default=None)

    return find


OURS, MOMENTS, ENCLOSING, HOUGH = "ours", "HSV moments", "PyImageSearch", "HoughCircles"
SPOTS, DOT2 = "SimpleBlob", "vpDot2"
LARGEST, LIMIT = "HSV contour", "limit"


def methods(marker: Marker, radius: float) -> dict[str, Method]:
    """Return all methods for this marker; radius in px."""
    color = marker.color
    if color is None:
        return {OURS: ours(marker)}
    return {
        OURS: ours(marker),
        MOMENTS: lambda image, t: hsv_moments(image, color),
        SPOTS: spots(radius),
        ENCLOSING: lambda image, t: blur_and_enclose(image, color),
        HOUGH: lambda image, t: hough(image, radius),
    }
