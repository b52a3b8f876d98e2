"""The circle that most of a coloured blob's outline lies on, and how surely it is the marker."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.markers.ball_contour import fit_ball_contour, scaled_misfit
from laptop.see.markers.circles import find_circle
from laptop.see.markers.finders.confidence import (
    MAX_USED_MISFIT,
    color_likeness,
    color_step,
    contour_confidence,
    isolation,
    other_size,
    ramp,
    size_doubt,
    size_likeness,
)
from laptop.see.markers.finders.illumination import adapt_color, relight
from laptop.see.markers.markers import Marker, hsv_mask, hsv_of
from laptop.see.markers.tracks import Place, Sighting, Track, half_window

MIN_WINDOW = 4
"""Least side of a window in which a circle can be measured, px."""


class ColorWindow(NamedTuple):
    """A window of the picture, and which of its pixels have the marker's colour.

    left, top  of it, px of the picture
    edges      left, top, right, bottom of the whole picture, px of the window
    relit      as it would be under the light of learning: BGR
    hsv        OpenCV's
    mask       255 where it has the colour
    expected   where the marker should be, px of the window; None: not known
    """

    left: int
    top: int
    edges: tuple[float, float, float, float]
    relit: np.ndarray
    hsv: np.ndarray
    mask: np.ndarray
    expected: tuple[float, float] | None


def color_window(image: np.ndarray, place: Place, track: Track) -> ColorWindow | None:
    """Mask the marker's colour in a window around a place; None if it is outside the picture."""
    u, v, radius = place
    half = half_window(radius)
    left, top = max(0, math.floor(u - half)), max(0, math.floor(v - half))
    window = image[top : max(0, math.ceil(v + half) + 1), left : max(0, math.ceil(u + half) + 1)]
    if min(window.shape[:2]) < MIN_WINDOW:
        return None
    assert track.color is not None
    height, width = image.shape[:2]
    relit = relight(window, track.gains)
    hsv = cv2.cvtColor(relit, cv2.COLOR_BGR2HSV)
    return ColorWindow(
        left,
        top,
        (-left - 0.5, -top - 0.5, width - left - 0.5, height - top - 0.5),
        relit,
        hsv,
        hsv_mask(hsv, track.color),
        (u - left, v - top) if track.seen else None,
    )


def measure_circle(
    window: ColorWindow, marker: Marker, track: Track, max_confidence: float = 1.0
) -> Track | None:
    """Measure the circle of which a window's mask shows most; None if there is none.

    Args:
        window: the window with its mask.
        marker: what is looked for.
        track: what is known of it from earlier frames.
        max_confidence: greatest confidence, even if all agrees.
    """
    learned, color = marker.color, track.color
    assert learned is not None
    assert color is not None
    radius = track.seen.radius if track.seen else None
    circle = find_circle(window.mask, window.edges, window.expected, radius)
    if circle is None:
        return None
    disc = np.zeros_like(window.mask)
    center = round(circle.u), round(circle.v)
    cv2.circle(disc, center, max(1, round(0.8 * circle.radius)), 255, -1)
    disc &= window.mask
    if not disc.any():
        return None
    shade = hsv_of(cv2.mean(window.relit, disc)[:3])
    # A named colour says nothing of size or shade, and skin is orange, too: then the rim must be
    # clear.
    strict = learned.scene is None
    score = (
        ramp(circle.arc, 0.4 if strict else 0.2, 0.75 if strict else 0.6)
        * ramp(circle.fill, 0.2, 0.6)
        * (1 - ramp(circle.stray, *((0.15, 0.8) if strict else (0.06, 0.3))))
        * ramp(circle.visible, 0.2, 0.8)
        * color_likeness(shade, color if track.seen else learned, learned)
        * isolation(window.hsv, circle, learned)
        * (ramp(circle.radius, 4, 9) if strict else 1)
    )
    contour = fit_ball_contour(window.relit, circle.u, circle.v, circle.radius, window.edges, color)
    known = track.known_radii(marker)
    score *= 1 - ramp(size_doubt(contour, marker.radius), 0.12, 0.3)
    if track.seen is None and not strict:  # what is where nothing was expected has to look like it
        score *= 1 - ramp(color_step(shade, color), 0.3, 0.8)
    size = size_likeness(circle.radius, radius, known)
    why = other_size(size, score, circle.radius, known)
    score = min(size * score, max_confidence, contour_confidence(contour, circle, bool(track.seen)))
    if contour is not None and scaled_misfit(contour) < MAX_USED_MISFIT:
        circle = circle._replace(u=contour.u, v=contour.v, radius=contour.radius)
    new = Sighting(circle.u + window.left, circle.v + window.top, score, circle.radius)
    # Where confidences are equal, the rounder one is the better.
    score *= 1 + 0.1 * circle.arc * circle.fill
    return Track(
        new, why=why, seen=new, score=score, color=adapt_color(shade, track.color, learned),
        gains=track.gains, discriminant=track.discriminant,
    )  # fmt: skip
