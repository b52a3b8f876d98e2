"""The light of a scene, compared with that of learning, and colours that follow it."""

from __future__ import annotations

import math

import cv2
import numpy as np

from laptop.see.markers.markers import Color, hue_distance, scene_of
from laptop.see.markers.tracks import Gains

MIN_LIGHT_CHANGE = 0.08
"""Natural logarithm of a gain below which the light counts as unchanged."""
COLOR_BLEND = 0.2
"""Share of the newest frame in an adapted colour."""


def light_gains(image: np.ndarray, color: Color) -> Gains | None:
    """Compare the light of a picture with that in which a colour was learned.

    The mean of the whole picture tells, which a fixed camera's background dominates (the grey-world
    assumption, kept to a comparison of a scene with itself).

    Returns:
        None if it is much the same, or if nothing is known of the light of learning.
    """
    if color.scene is None:
        return None
    gains = [
        min(4.0, max(0.25, (now + 1) / (then + 1)))
        for now, then in zip(scene_of(image), color.scene, strict=True)
    ]
    if all(abs(math.log(gain)) < MIN_LIGHT_CHANGE for gain in gains):
        return None
    return gains[0], gains[1], gains[2]


def relight(image: np.ndarray, gains: Gains | None) -> np.ndarray:
    """Return the picture under the light of learning."""
    if gains is None:
        return image
    red, green, blue = gains
    return cv2.transform(image, np.diag([1 / blue, 1 / green, 1 / red]))


def adapt_color(hsv: tuple[float, float, float], color: Color | None, learned: Color) -> Color:
    """Move a colour a step nearer to the one seen, but never far from the learned one.

    Args:
        hsv: mean of the marker in this frame: degrees, 0 to 1, 0 to 1.
        color: as it was in the frame before; None: as it was learned.
        learned: the one learned from the pick.
    """
    color = color or learned
    hue = color.hue + COLOR_BLEND * hue_distance(hsv[0], color.hue)
    away = hue_distance(hue, learned.hue)
    allowed = 0.75 * learned.tolerance
    return Color(
        (learned.hue + min(allowed, max(-allowed, away))) % 360,
        _blend(color.saturation, hsv[1], learned.saturation, 0.6, 1.4),
        _blend(color.value, hsv[2], learned.value, 0.2, 2.5),
        color.tolerance,
        color.saturation_floor,
        color.value_floor,
        color.scene,
    )


def _blend(old: float, new: float, learned: float, low: float, high: float) -> float:
    return min(high * learned, max(low * learned, old + COLOR_BLEND * (new - old)))
