"""A path that is dragged in a picture, as smooth lines with the corners that were meant.  Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from laptop.see.serve.pipeline import Point

ROUGHNESS = 4.0
"""Deviation of a hand and its pixels from the path that was meant, px."""
CORNER_ANGLE = math.radians(40)
"""Least turn of the path within twice ROUGHNESS that counts as a corner, rad."""
POINT_SPACING = 2.0
"""Distance between two points of a smooth line, px."""
CLOSING_DISTANCE = 12.0
"""Greatest distance between the ends of a path that is closed, px."""


def smooth_path(points: Sequence[Point]) -> np.ndarray:
    """Return the intended path (n, 2), px, of a drag along points (u, v), px."""
    dragged = np.array(points, float)
    steps = np.hypot(*np.diff(dragged, axis=0).T)
    dragged = dragged[np.append(True, steps > 1e-6)]
    if len(dragged) < 2:
        return dragged
    if len(dragged) > 3 and math.dist(dragged[0], dragged[-1]) < CLOSING_DISTANCE:
        dragged[-1] = dragged[0]
    rough = simplified(dragged, ROUGHNESS)
    corners = [0, *_corners(dragged, rough), len(dragged) - 1]
    parts = [
        _smooth(dragged[first : last + 1])
        for first, last in zip(corners, corners[1:], strict=False)
        if last > first
    ]
    return np.vstack([parts[0], *(part[1:] for part in parts[1:])])


def simplified(line: np.ndarray, by: float) -> np.ndarray:
    """Return a line (n, 2) without the points that are no farther than `by` off (Douglas-Peucker).

    A line that ends where it begins does so afterwards.
    """
    closed = len(line) > 3 and bool((line[0] == line[-1]).all())
    # (Of one that does OpenCV would leave out the end.)
    path = line[:-1] if closed else line
    vertices = cv2.approxPolyDP(path.astype(np.float32)[:, None], by, False)[:, 0].astype(float)
    return np.vstack([vertices, vertices[:1]]) if closed else vertices


def _corners(dragged: np.ndarray, rough: np.ndarray) -> list[int]:
    """Return the numbers of the dragged points that are corners, in order."""
    found, at = [], 0
    for before, here, after in zip(rough, rough[1:], rough[2:], strict=False):
        at += int(np.argmin(np.hypot(*(dragged[at:] - here).T)))
        one, other = here - before, after - here
        turn = abs(math.atan2(one[0] * other[1] - one[1] * other[0], float(one @ other)))
        # Of a bend the parts are short, and each turns by little.
        if turn > CORNER_ANGLE and min(np.hypot(*one), np.hypot(*other)) > 2 * ROUGHNESS:
            found.append(at)
    return found


def _smooth(line: np.ndarray) -> np.ndarray:
    """Return a line (n, 2) without a hand's trembling; its ends stay."""
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    count = max(2, round(lengths[-1] / POINT_SPACING) + 1)
    at = np.linspace(0.0, lengths[-1], count)
    even = np.column_stack([np.interp(at, lengths, line[:, axis]) for axis in (0, 1)])
    ahead = even[-1] - even[0]
    off = (even - even[0]) @ np.array([-ahead[1], ahead[0]]) / max(np.hypot(*ahead), 1e-9)
    if np.abs(off).max() < ROUGHNESS and np.hypot(*ahead) > 0.9 * lengths[-1]:
        return even[[0, -1]]
    half = max(1, min(round(2 * ROUGHNESS / POINT_SPACING), (count - 1) // 4))
    # Reflected about its ends, so that they stay.
    padded = np.vstack(
        [2 * even[0] - even[half:0:-1], even, 2 * even[-1] - even[-2 : -half - 2 : -1]]
    )
    weights = np.hanning(2 * half + 3)[1:-1]
    weights /= weights.sum()
    return np.column_stack([np.convolve(padded[:, axis], weights, "valid") for axis in (0, 1)])
