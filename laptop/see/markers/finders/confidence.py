"""Confidence of what was measured: factors from 0 (surely not the marker) to 1."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from laptop.see.markers.ball_contour import BallContour, scaled_misfit
from laptop.see.markers.circles import Circle
from laptop.see.markers.markers import Color, hsv_mask, hue_distance
from shared.messages import LEAST_CONFIDENCE

MIN_REPORTED_CONFIDENCE = 0.2
"""Least confidence of a detection; below, the marker counts as not seen."""
MAX_AMBIGUOUS_CONFIDENCE = 0.45
"""Greatest confidence in what may well be something else."""


def ramp(x: float, low: float, high: float) -> float:
    """Return 0 up to `low`, 1 from `high` on, linear between."""
    return min(1.0, max(0.0, (x - low) / (high - low)))


def color_likeness(hsv: tuple[float, float, float], color: Color, learned: Color) -> float:
    """Return the agreement of a mean colour; brightness counts only for a learned colour.

    Args:
        hsv: of what is measured: degrees, 0 to 1, 0 to 1.
        color: of the marker under the present light.
        learned: as it was picked or named.
    """
    away = abs(hue_distance(hsv[0], learned.hue)) / learned.tolerance
    like = 1 - ramp(away, 0.6, 1.2)
    if learned.scene is None:  # a named colour: what is not vivid is no marker
        return like * ramp(hsv[1] / learned.saturation, 0.55, 0.8)
    return (
        like * ramp(hsv[1] / learned.saturation, 0.45, 0.75) * ramp(hsv[2] / color.value, 0.3, 0.6)
    )


def isolation(hsv: np.ndarray, circle: Circle, color: Color) -> float:
    """Return a factor, 1 to 0, by how much of the ring around a circle has the colour, too.

    Args:
        hsv: OpenCV's, uint8, shape (h, w, 3).
        circle: in px of `hsv`.
        color: the marker's.
    """
    width = max(2, round(0.25 * circle.radius))
    radius = round(1.15 * circle.radius + width)
    u, v, reach = round(circle.u), round(circle.v), radius + width
    left, top = max(0, u - reach), max(0, v - reach)
    window = hsv[top : max(0, v + reach), left : max(0, u + reach)]
    if not window.size:
        return 1.0
    ring = np.zeros(window.shape[:2], np.uint8)
    cv2.circle(ring, (u - left, v - top), radius, 255, width)
    total = cv2.countNonZero(ring)
    same = cv2.countNonZero(ring & hsv_mask(window, color.wider()))
    return 1 - ramp(same / max(1, total), 0.3, 0.6)


def size_likeness(radius: float, seen: float | None, known: Sequence[float]) -> float:
    """Return the agreement of a radius with earlier ones, px.

    Args:
        radius: the one measured, px.
        seen: in the frame before, px; None: it was not seen there.
        known: when it was picked, and when it was last surely seen, px; it may look like either.
    """
    fit = ramp(radius, 2, 4)
    if seen:
        fit *= ramp(_ratio(radius, seen), 0.45, 0.7)
    if known:
        fit *= max(ramp(_ratio(radius, size), 0.3, 0.45) for size in known)
    return fit


LARGER, SMALLER = "only a much larger one", "only a much smaller one"


def other_size(size: float, score: float, radius: float, known: Sequence[float]) -> str:
    """Return why something is not the marker, if only its size differs; else ""."""
    if size >= MIN_REPORTED_CONFIDENCE or score < LEAST_CONFIDENCE or not known:
        return ""
    return LARGER if radius > max(known) else SMALLER if radius < min(known) else ""


def _ratio(one: float, other: float) -> float:
    return min(one / other, other / one)


MAX_USED_MISFIT = 0.2
"""Greatest misfit, relative to a tenth of the radius and 1 px, of a contour that places a ball,
instead of the mask."""
_DISAGREEMENT_COST = 0.15
"""Increase of a contour's misfit per distance (radii) from the mask's circle: where something hides
or smears a part, each of them is drawn to another side."""
_MISFITS = (0.02, 0.066, 0.3, 0.6)
"""Contour misfits, so scaled, ..."""
_TRUSTS = (1.0, 0.9, 0.5, 0.2)
"""... and the confidences at these."""


def color_step(hsv: tuple[float, float, float], color: Color) -> float:
    """Return the colour distance in hue (1: the tolerance) and saturation (1: a factor e).

    Args:
        hsv: of what is measured: degrees, 0 to 1, 0 to 1.
        color: to compare it with.
    """
    away = abs(hue_distance(hsv[0], color.hue)) / color.tolerance
    return away + abs(math.log(max(hsv[1], 0.01) / color.saturation))


def size_doubt(contour: BallContour | None, picked: float | None) -> float:
    """Return a radius's log ratio to the picked one, weighted by the missing rim.

    A whole rim proves a size; of an arc, any circle can be made.  What was seen before says little
    here: where more and more is hidden or smeared, one arc follows another.
    """
    if contour is None or not picked:
        return 0.0
    return contour.gap * abs(math.log(contour.radius / picked))


def contour_confidence(contour: BallContour | None, circle: Circle, followed: bool) -> float:
    """Return the confidence in a circle from the contour around it.

    Args:
        contour: None if there is hardly any.
        circle: of the mask, in px of the contour.
        followed: it is where the marker was expected: a blurred one is no less the marker then.
    """
    least = LEAST_CONFIDENCE if followed else MIN_REPORTED_CONFIDENCE
    if contour is None:
        return max(least, MAX_AMBIGUOUS_CONFIDENCE)
    distance = math.hypot(contour.u - circle.u, contour.v - circle.v) / contour.radius
    misfit = scaled_misfit(contour) + _DISAGREEMENT_COST * distance
    trust = float(np.interp(misfit, _MISFITS, _TRUSTS))
    return max(least, min(trust, 0.4 + 0.6 * ramp(contour.contrast, 0, 0.4)))
