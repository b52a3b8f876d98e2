"""Learning a marker's colour from a picked pixel or rectangle.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np

from laptop.vision.circles import Circle, ellipse_of, find_circle
from laptop.vision.limb import fit_limb, rim_width, scaled_misfit
from laptop.vision.markers import (
    SATURATION_FLOOR,
    VALUE_FLOOR,
    BadMarker,
    Color,
    Marker,
    hsv_mask,
    hsv_of,
    hue_distance,
    is_grey,
    scene_of,
)

_TOLERANCES = (40.0, 32.0, 24.0, 17.0, 12.0)
"""Tolerances of the hue, degrees: the widest that the surroundings allow, as light changes."""
_HUE_MARGIN = 6.0
"""Hue that is added on either side of a pixel's own, degrees."""
_MAX_AREA_SHARE = 0.4
"""Part of the picture that a marker may fill; what is larger is a table."""
_MAX_RIM_WIDTH, _MAX_MISFIT = 0.3, 0.062
"""Width of the rim, in radii, beyond which only the core tells the colour and the limb the size:
what is out of focus looks pale, and up to 1.6 times as large.  Misfit of the limb beyond which they
do not, either.  (What is only shaded has a limb that fits.)"""
_CORE = 0.5
"""Size of the core, in radii."""
_MIN_ROUNDNESS = 0.25
"""Roundness of what may be a marker, though fingers hide half of it; a whole disc has 0.9."""


def learn(name: str, image: np.ndarray, pick: tuple[float, ...], kind: str | None = None) -> Marker:
    """The marker at a picked pixel (u, v), or the one that fills a rectangle (u0, v0, u1, v1).

    Args:
        image: BGR, uint8, shape (h, w, 3).
        kind: "disc" or "ball"; if None, a shaded marker is a ball, an even one a disc.

    Raises:
        BadMarker: nothing with a colour there, or outside the picture.
    """
    height, width = image.shape[:2]
    where = ",".join(f"{part:g}" for part in pick)
    u0, v0, u1, v1 = _box(name, image, pick, reach=5)
    patch = image[v0:v1, u0:u1].reshape(-1, 3)
    # A highlight or a stripe may lie under the finger: the colour is where there is most of it.
    # The fewer pixels tell it, the clearer it must be: noise on black looks coloured, too.
    chroma = patch.max(axis=1).astype(int) - patch.min(axis=1)
    for share, least in ((50, 0.12), (80, 0.3)):
        vivid = patch[chroma >= np.percentile(chroma, share)]
        seed = hsv_of(np.median(vivid, axis=0).tolist())
        if seed[1] >= least and seed[2] >= 0.04:
            break
    else:
        if is_grey(image):
            raise BadMarker(
                f"{name}: no colour at {where}, nor anywhere else in this picture; pick the marker "
                "in a frame that shows it, or, if the camera or film is grey, track aruco:ID"
            )
        raise BadMarker(
            f"{name}: no colour at {where} (saturation {seed[1]:.2f}, value {seed[2]:.2f}); "
            "pick the middle of a coloured marker"
        )
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    scene = scene_of(image)
    edges = -0.5, -0.5, width - 0.5, height - 0.5
    best, color, region, found = 0.0, Color(*seed, scene=scene), None, None
    for tolerance in _TOLERANCES:
        tried = Color(*seed, tolerance=tolerance, scene=scene)
        for _ in range(2):
            mask = hsv_mask(hsv, tried)
            blob = _blob(mask, (u0, v0, u1, v1))
            if blob is None:
                break
            tried = _typical(hsv[blob > 0], tried)
        if blob is None:
            continue
        circle = find_circle(blob.copy(), edges)
        if circle is None:
            continue
        # What a stripe parts from it belongs to it.
        blob |= mask & _disc(mask, circle, 1.2)
        circle = find_circle(blob.copy(), edges, None, circle.radius) or circle
        if math.pi * circle.radius**2 > _MAX_AREA_SHARE * width * height:
            continue
        roundness = circle.arc * circle.fill * circle.visible / (1 + circle.stray)
        outlines, _ = cv2.findContours(blob, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        ellipse = ellipse_of(max(outlines, key=cv2.contourArea))
        if ellipse and ellipse.quality > roundness:  # a disc, seen from the side
            roundness = ellipse.quality
            circle = circle._replace(u=ellipse.u, v=ellipse.v, radius=ellipse.radius)
        if roundness > best + 0.05:
            best, color, region, found = roundness, tried, blob, circle
    if region is None or found is None or best < _MIN_ROUNDNESS:
        raise BadMarker(
            f"{name}: nothing round of one colour at {where} (roundness {best:.2f}, at least "
            f"{_MIN_ROUNDNESS:g}); pick the middle of a disc or ball"
        )
    width_of_rim = rim_width(image, found.u, found.v, found.radius)
    if width_of_rim > _MAX_RIM_WIDTH:
        limb = fit_limb(image, found.u, found.v, found.radius, edges, color)
        if limb is None or scaled_misfit(limb) > _MAX_MISFIT:
            raise BadMarker(
                f"{name}: the marker at {where} is blurred, its rim {width_of_rim:.1f} radii wide "
                f"({_MAX_RIM_WIDTH:g} is well); pick it in a frame where it is at rest and in focus"
            )
        found = found._replace(radius=limb.radius)
        core = region & _disc(region, found, _CORE)
        if core.any():  # a ring has none
            color = _typical(hsv[core > 0], color)
    color = replace(color, tolerance=min(color.tolerance, _room(hsv, region, color)))
    return Marker(name, kind or _kind(hsv, region), color, radius=found.radius)


def include(marker: Marker, image: np.ndarray, pick: tuple[float, ...]) -> Marker:
    """The marker with the colour at a picked pixel, or in a rectangle, added to its own.

    Args:
        image, pick: as for `learn`.

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
            saturation=max(0.05, min(color.saturation, 0.85 * saturation / SATURATION_FLOOR)),
            value=max(0.02, min(color.value, 0.85 * value / VALUE_FLOOR)),
        ),
    )


def exclude(marker: Marker, image: np.ndarray, pick: tuple[float, ...]) -> Marker:
    """The marker without the colour at a picked pixel, or in a rectangle.

    What differs most is made the border: hue, else saturation, else brightness.

    Args:
        image, pick: as for `learn`.

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
        kept = (abs(away) - _HUE_MARGIN / 2 + color.tolerance) / 2  # half of what is left
        middle = color.hue + side * (kept - color.tolerance)
        return replace(marker, color=replace(color, hue=middle % 360, tolerance=max(4.0, kept)))
    saturation, value = 1.1 * shade[1] / SATURATION_FLOOR, 1.1 * shade[2] / VALUE_FLOOR
    if color.saturation < saturation < 1.3 * color.saturation and saturation <= 1:
        return replace(marker, color=replace(color, saturation=saturation))
    if color.value < value < 1.3 * color.value and value <= 1:
        return replace(marker, color=replace(color, value=value))
    raise BadMarker(
        f"{marker.name}: this looks like the marker itself; take it out of the picture, or give "
        "the marker another colour"
    )


def _color_of(marker: Marker) -> Color:
    if marker.color is None:
        raise BadMarker(f"{marker.name} is {marker}: it has no colour; pick it anew")
    return marker.color


def _shade(name: str, image: np.ndarray, pick: tuple[float, ...]) -> tuple[float, float, float]:
    u0, v0, u1, v1 = _box(name, image, pick, reach=2)
    return hsv_of(np.median(image[v0:v1, u0:u1].reshape(-1, 3), axis=0).tolist())


def _box(
    name: str, image: np.ndarray, pick: tuple[float, ...], reach: int
) -> tuple[int, int, int, int]:
    """The pixels that are meant, u0, v0 to before u1, v1; around a single one so many more."""
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


def _blob(mask: np.ndarray, box: tuple[int, int, int, int]) -> np.ndarray | None:
    """The connected part of a mask that has most of the box, 255 inside; None if there is none."""
    u0, v0, u1, v1 = box
    _, labels = cv2.connectedComponents(mask)
    inside = labels[v0:v1, u0:u1]
    votes = np.bincount(inside[inside > 0].astype(np.intp), minlength=1)
    if not votes.any():
        return None
    return np.where(labels == int(np.argmax(votes)), 255, 0).astype(np.uint8)


def _disc(mask: np.ndarray, circle: Circle, wider: float) -> np.ndarray:
    """A mask (of the shape of another) of a circle, made so many times wider."""
    disc = np.zeros_like(mask)
    cv2.circle(disc, (round(circle.u), round(circle.v)), round(wider * circle.radius), 255, -1)
    return disc


def _typical(pixels: np.ndarray, color: Color) -> Color:
    """The colour moved to the middle of its pixels; pixels is OpenCV's HSV, shape (n, 3)."""
    hues = (2.0 * pixels[:, 0] - color.hue + 180) % 360 - 180
    return replace(
        color,
        hue=(color.hue + float(np.median(hues))) % 360,
        saturation=float(np.median(pixels[:, 1])) / 255,
        value=float(np.median(pixels[:, 2])) / 255,
    )


def _room(hsv: np.ndarray, region: np.ndarray, color: Color) -> float:
    """Half the way, in hue, from the marker's colour to those around it, degrees."""
    around, near = (
        cv2.dilate(region, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * wide + 1,) * 2))
        for radius in [math.sqrt(np.count_nonzero(region) / math.pi)]
        for wide in (round(0.7 * radius) + 4, round(0.15 * radius) + 2)
    )
    anything = hsv_mask(hsv, replace(color, tolerance=180.0))
    hues = 2.0 * hsv[(around > 0) & (near == 0) & (anything > 0)][:, 0]
    if len(hues) < 20:
        return 180.0
    away = np.abs((hues - color.hue + 180) % 360 - 180)
    return max(8.0, 0.5 * float(np.percentile(away, 10)))


def _kind(hsv: np.ndarray, region: np.ndarray) -> str:
    """Tell a ball, which is shaded, from a disc."""
    core = cv2.erode(region, np.ones((5, 5), np.uint8), borderValue=0)
    values = hsv[(core if core.any() else region) > 0][:, 2]
    dark, bright = np.percentile(values, (10, 90))
    # Rendered: discs of 5 to 31 px 1.02 to 1.15, balls of 12 to 31 px 1.27 to 1.5; filmed: 1.7 up.
    return "ball" if bright > 1.2 * max(dark, 1) else "disc"
