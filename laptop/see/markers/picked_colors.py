"""Correction of a marker's colour: including or excluding picked pixels.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from laptop.see.markers.markers import BadMarker, Color, Marker, hsv_mask, hsv_of, hue_distance

_HUE_MARGIN = 6.0
"""Hue added on either side of a pixel's own, degrees."""
_MAX_FLOOR = 0.75
"""Greatest floor of saturation or value, relative to the marker's typical one."""


def include(marker: Marker, image: np.ndarray, pick: tuple[float, ...]) -> Marker:
    """Return the marker with the colour at a picked pixel, or in a rectangle, added to its own.

    Args:
        marker: what is corrected.
        image: BGR, uint8, shape (h, w, 3).
        pick: a pixel (u, v) or a rectangle (u0, v0, u1, v1), px.

    Raises:
        BadMarker: outside the picture, or the marker has no colour.
    """
    color = _color_of(marker)
    hue, saturation, value = _shade(marker.name, image, pick)
    away = hue_distance(hue, color.hue)
    low, high = min(-color.tolerance, away - _HUE_MARGIN), max(color.tolerance, away + _HUE_MARGIN)
    return replace(
        marker,
        color=replace(
            color,
            hue=(color.hue + (low + high) / 2) % 360,
            tolerance=min(90.0, (high - low) / 2),
            # So low that the gate's floors let it in.
            saturation_floor=_let_in(color.saturation_floor, saturation / color.saturation),
            value_floor=_let_in(color.value_floor, value / color.value),
        ),
    )


def exclude(marker: Marker, image: np.ndarray, pick: tuple[float, ...]) -> Marker:
    """Return the marker without the colour at a picked pixel, or in a rectangle.

    What differs most is made the border: hue, else saturation, else brightness.

    Args:
        marker: what is corrected.
        image: BGR, uint8, shape (h, w, 3).
        pick: a pixel (u, v) or a rectangle (u0, v0, u1, v1), px.

    Raises:
        BadMarker: that colour is none of its own, or too much like it.
    """
    color = _color_of(marker)
    shade = _shade(marker.name, image, pick)
    pixel = np.array([[[shade[0] / 2, 255 * shade[1], 255 * shade[2]]]]).astype(np.uint8)
    if not hsv_mask(pixel, color).any():
        raise BadMarker(f"{marker.name}: this is not of its colour; there is nothing to remove")
    away = hue_distance(shade[0], color.hue)
    if abs(away) > 0.4 * color.tolerance:
        side = math.copysign(1.0, away)
        tolerance = (abs(away) - _HUE_MARGIN / 2 + color.tolerance) / 2  # half of what is left
        middle = color.hue + side * (tolerance - color.tolerance)
        return replace(
            marker, color=replace(color, hue=middle % 360, tolerance=max(4.0, tolerance))
        )
    saturation, value = 1.1 * shade[1] / color.saturation, 1.1 * shade[2] / color.value
    if color.saturation_floor < saturation < _MAX_FLOOR:
        return replace(marker, color=replace(color, saturation_floor=saturation))
    if color.value_floor < value < _MAX_FLOOR:
        return replace(marker, color=replace(color, value_floor=value))
    raise BadMarker(
        f"{marker.name}: this looks like the marker itself; take it out of the picture, or give "
        "the marker another colour"
    )


def _let_in(floor: float, share: float) -> float:
    return max(0.05, min(floor, 0.85 * share))


def _color_of(marker: Marker) -> Color:
    if marker.color is None:
        raise BadMarker(f"{marker.name} is {marker}: it has no colour; pick it anew")
    return marker.color


def _shade(name: str, image: np.ndarray, pick: tuple[float, ...]) -> tuple[float, float, float]:
    u0, v0, u1, v1 = picked_box(name, image, pick, reach=2)
    return hsv_of(np.median(image[v0:v1, u0:u1].reshape(-1, 3), axis=0).tolist())


def picked_box(
    name: str, image: np.ndarray, pick: tuple[float, ...], reach: int
) -> tuple[int, int, int, int]:
    """Return a pick's pixels, u0, v0 to before u1, v1; a single one is widened.

    Raises:
        BadMarker: outside the picture.
    """
    height, width = image.shape[:2]
    us, vs = pick[::2], pick[1::2]
    if not all(0 <= u < width for u in us) or not all(0 <= v < height for v in vs):
        raise BadMarker(
            f"{name}: {','.join(f'{part:g}' for part in pick)} is outside the picture; "
            f"pick u from 0 to {width - 1} and v from 0 to {height - 1}"
        )
    reach = reach if len(pick) == 2 else 0
    return (
        max(0, round(min(us)) - reach),
        max(0, round(min(vs)) - reach),
        round(max(us)) + reach + 1,
        round(max(vs)) + reach + 1,
    )
