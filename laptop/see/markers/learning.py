"""Learning a marker's colour from a picked pixel or rectangle.  Pure."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from laptop.see.markers.ball_contour import fit_ball_contour, rim_width, scaled_misfit
from laptop.see.markers.circles import Circle, ellipse_of, find_circle
from laptop.see.markers.finders.color_search import MIN_SCENE_BRIGHTNESS, SEVERAL
from laptop.see.markers.finders.confidence import MIN_REPORTED_CONFIDENCE, isolation
from laptop.see.markers.markers import (
    WIDER_SATURATION,
    BadMarker,
    Color,
    Marker,
    hsv_mask,
    hsv_of,
    is_grey,
    scene_of,
)
from laptop.see.markers.picked_colors import picked_box
from laptop.see.markers.tracker import Tracker
from shared.messages import LEAST_CONFIDENCE

_TOLERANCES = (40.0, 32.0, 24.0, 17.0, 12.0)
"""Tolerances of the hue that are tried, degrees: the widest that the surroundings allow, as light
changes."""
_REACH, _WIDE_REACH = 5, 15
"""Greatest distance of a marker's colour from a picked pixel, px; and around a highlight."""
_FLOORS = ((0.55, 0.4), (0.75, 0.4), (0.55, 0.65), (0.75, 0.65))
"""Floors of saturation and value that are tried: the lowest that the surroundings allow."""
_SURE_ROUNDNESS = 0.6
"""Roundness from which a region is surely a marker, so that no other floors are tried."""
_MAX_STRAY = 0.2
"""Share outside of the circle from which the ground may have the colour."""
_MIN_COLORED_SHARE = 0.9
"""Least share of a marker that has its colour, where nothing is across it."""
_MIN_ALIKE = 0.1
"""Share of the surroundings in a marker's own hue from which they must be separated from it."""
_MAX_GAP = 0.3
"""Greatest missing share of a contour where a stripe was taken for the ground."""
_MAX_UPRIGHT_SINE = 0.1
"""Greatest sine between the longer axis of a stretched picture's marker and the picture's edges."""
_MAX_STRETCH = 1.3
"""Greatest ratio of length to width of a ball."""
_MIN_VISIBLE = 0.9
"""Share of a marker inside the picture from which it must be found there again."""
_MAX_REFOUND_DISTANCE = 0.2
"""Greatest distance of a marker found again from where it was learned, in radii."""
_MAX_AREA_SHARE = 0.4
"""Greatest share of the picture that a marker may fill; what is larger is a table."""
_MAX_RIM_WIDTH, _MAX_MISFIT = 0.27, 0.062
"""Width of the rim, in radii, above which only the core tells the colour and the contour the size:
what is out of focus looks pale, and up to 1.6 times as large. Then the contour's misfit above which
they do not, either. (What is only shaded has a contour that fits.)"""
_CORE_RADIUS = 0.5
"""Radius of the core, in radii."""
_MIN_ROUNDNESS = 0.25
"""Least roundness of a marker of which fingers hide a half; a whole disc has 0.9."""


class _Region(NamedTuple):
    """A region of a picture that was taken for a marker.

    color      of it
    mask       uint8, shape (h, w), 255 inside
    circle     around it, px
    outline    the circle on which most of its outline lies, px
    stretch    how many times it is as long as wide
    turn       of its longer axis, rad, from that of u to that of v
    roundness  0 to 1
    """

    color: Color
    mask: np.ndarray
    circle: Circle
    outline: Circle
    stretch: float
    turn: float
    roundness: float


def learn(name: str, image: np.ndarray, pick: tuple[float, ...], kind: str | None = None) -> Marker:
    """Return the marker at a picked pixel (u, v), or filling a rectangle (u0, v0, u1, v1).

    What was learned is looked for in the very picture: only what is found there is a marker.

    Args:
        name: the marker's name.
        image: BGR, uint8, shape (h, w, 3).
        pick: a pixel (u, v) or a rectangle (u0, v0, u1, v1), px.
        kind: "disc" or "ball"; if None, a shaded marker is a ball, an even one a disc.

    Raises:
        BadMarker: nothing with a colour there, nothing that is found again, or outside the picture.
    """
    try:
        first = _learn(name, image, pick, kind, _REACH)
    except BadMarker:
        wide = _learn_widely(name, image, pick, kind)
        if wide is None:
            raise
        return wide[0]
    if first[1].roundness < _SURE_ROUNDNESS:
        wide = _learn_widely(name, image, pick, kind)
        if wide is not None and wide[1].roundness > _SURE_ROUNDNESS:
            return wide[0]
    return first[0]


def _learn_widely(
    name: str, image: np.ndarray, pick: tuple[float, ...], kind: str | None
) -> tuple[Marker, _Region] | None:
    """Return the marker around a pixel on its highlight, searched more widely; or None."""
    if len(pick) == 4:
        return None
    try:
        marker, region = _learn(name, image, pick, kind, _WIDE_REACH)
    except BadMarker:
        return None
    circle = region.circle
    around = math.hypot(circle.u - pick[0], circle.v - pick[1]) < circle.radius
    return (marker, region) if around else None


def _learn(
    name: str, image: np.ndarray, pick: tuple[float, ...], kind: str | None, reach: int
) -> tuple[Marker, _Region]:
    """Return the marker and its place; its colour may be `reach` px from a picked pixel."""
    where = f"{name}: the marker at {','.join(f'{part:g}' for part in pick)}"
    box = picked_box(name, image, pick, reach)
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV)
    region = _region(name, image, hsv, pick, box)
    kind = kind or _kind(hsv, region.mask)
    if kind == "ball" and region.stretch > 1:
        region = _striped(region, image, where)
    width_of_rim = rim_width(image, *region.circle[:3])
    if width_of_rim > _MAX_RIM_WIDTH:
        region = _of_core(region, image, hsv, where, width_of_rim)
    around = _around(hsv, region.mask)
    color = _parted(region.color, hsv[region.mask > 0], around)
    color = replace(color, tolerance=min(color.tolerance, _room(around, color)))
    marker = Marker(name, kind, color, radius=region.circle.radius)
    if width_of_rim > _MAX_RIM_WIDTH or region.circle.visible < _MIN_VISIBLE:
        return marker, region  # it will be sharp and whole when it is looked for
    clear = region.roundness > _SURE_ROUNDNESS and region.outline.fill > _MIN_COLORED_SHARE
    least = LEAST_CONFIDENCE if clear else MIN_REPORTED_CONFIDENCE
    if (why := _why_lost(marker, image, region.circle, hsv, least)) is not None:
        if kind == "disc" and _kind(hsv, region.mask) == "ball":
            why = "it is shaded, as a ball is, and no flat disc; pick it as a ball"
        raise BadMarker(f"{where} would not be found again in this very picture: {why}")
    return marker, region


def _striped(region: _Region, image: np.ndarray, where: str) -> _Region:
    """Return an elongated region as a whole ball that a stripe partly hides."""
    contour = fit_ball_contour(image, *region.outline[:3], _edges(image), region.color)
    if contour is not None and scaled_misfit(contour) < _MAX_MISFIT and contour.gap < _MAX_GAP:
        circle = region.outline._replace(u=contour.u, v=contour.v, radius=contour.radius)
        return region._replace(circle=circle, stretch=1.0)
    if region.stretch < _MAX_STRETCH:
        return region
    problem = f"{where} is {region.stretch:.1f} times as"
    advice = "pick it in a frame where it is at rest and whole"
    scale = f"{region.stretch:.2f}"
    for what, size, along in (("high", f"{scale}*iw:ih", 1), ("wide", f"iw:{scale}*ih", 0)):
        if abs(abs(math.sin(region.turn)) - along) < _MAX_UPRIGHT_SINE:
            raise BadMarker(
                f"{problem} {what} as a ball is; {advice}, or, if all the picture is stretched, "
                f"scale it, for example: ffmpeg -i FILE -vf scale={size} NEW.mp4"
            )
    raise BadMarker(f"{problem} long as wide, and a ball is round; {advice}")


def _of_core(
    region: _Region, image: np.ndarray, hsv: np.ndarray, where: str, width_of_rim: float
) -> _Region:
    """Return a blurred marker, with the colour of its core and the size of its contour."""
    contour = fit_ball_contour(image, *region.circle[:3], _edges(image), region.color)
    if contour is None or scaled_misfit(contour) > _MAX_MISFIT:
        raise BadMarker(
            f"{where} is blurred, its rim {width_of_rim:.1f} radii wide "
            f"({_MAX_RIM_WIDTH:g} is well); pick it in a frame where it is at rest and in focus"
        )
    circle = region.circle._replace(radius=contour.radius)
    core = region.mask & _disc(region.mask, circle, _CORE_RADIUS)
    # A ring has none.
    color = _typical(hsv[core > 0], region.color) if core.any() else region.color
    return region._replace(color=color, circle=circle)


def _region(
    name: str,
    image: np.ndarray,
    hsv: np.ndarray,
    pick: tuple[float, ...],
    box: tuple[int, int, int, int],
) -> _Region:
    """Return the roundest region of one colour in a box, by the widest gate that separates it."""
    at = ",".join(f"{part:g}" for part in pick)
    height, width = image.shape[:2]
    u0, v0, u1, v1 = box
    patch = image[v0:v1, u0:u1].reshape(-1, 3)
    # A highlight or a stripe may lie under the finger: the colour is where there is most of it.
    # The fewer pixels tell it, the clearer it must be: noise on black looks coloured, too.
    chroma = patch.max(axis=1).astype(int) - patch.min(axis=1)
    for rank, least in ((50, 0.12), (80, 0.3)):
        vivid = patch[chroma >= np.percentile(chroma, rank)]
        seed = hsv_of(np.median(vivid, axis=0).tolist())
        if seed[1] >= least and seed[2] >= 0.04:
            break
    else:
        if is_grey(image):
            raise BadMarker(
                f"{name}: no colour at {at}, nor anywhere else in this picture; pick the marker "
                "in a frame that shows it, or, if the camera or film is grey, track aruco:ID"
            )
        raise BadMarker(
            f"{name}: no colour at {at} (saturation {seed[1]:.2f}, value {seed[2]:.2f}); "
            "pick the middle of a coloured marker, or beside its shine"
        )
    scene = scene_of(image)
    best: _Region | None = None
    leak = 0.0
    for saturation_floor, value_floor in _FLOORS:
        for tolerance in _TOLERANCES:
            color = Color(*seed, tolerance, saturation_floor, value_floor, scene)
            share, tried = _grown(hsv, color, box)
            leak = max(leak, share)
            if tried is None or math.pi * tried.circle.radius**2 > _MAX_AREA_SHARE * height * width:
                continue
            if best is None or tried.roundness > best.roundness + 0.05:
                best = tried
        if best is not None and (
            best.roundness > _SURE_ROUNDNESS or best.circle.stray < _MAX_STRAY
        ):
            break
    if best is not None and best.roundness >= _MIN_ROUNDNESS:
        return best
    if leak > _MAX_AREA_SHARE:
        raise BadMarker(
            f"{name}: the colour at {at} is all around it, too, on {100 * leak:.0f} % of the "
            f"picture (at most {100 * _MAX_AREA_SHARE:.0f}); put the marker on a ground of another "
            "colour, or take another marker"
        )
    roundness = best.roundness if best else 0.0
    raise BadMarker(
        f"{name}: nothing round of one colour at {at} (roundness {roundness:.2f}, at least "
        f"{_MIN_ROUNDNESS:g}); pick the middle of a disc or ball"
    )


def _grown(
    hsv: np.ndarray, color: Color, box: tuple[int, int, int, int]
) -> tuple[float, _Region | None]:
    """Return the region connected with a box by colour; the colour moves to its middle.

    Returns:
        the part of the picture that it fills, and what it is, if it may be a marker.
    """
    edges = _edges(hsv)
    for _ in range(2):
        mask = hsv_mask(hsv, color)
        blob = _blob(mask, box)
        if blob is None:
            return 0.0, None
        color = _typical(hsv[blob > 0], color)
    assert blob is not None
    share = np.count_nonzero(blob) / blob.size
    circle = find_circle(blob.copy(), edges)
    if circle is None:
        return share, None
    # What a stripe parts from it belongs to it.
    blob |= mask & _disc(mask, circle, 1.2)
    circle = find_circle(blob.copy(), edges, None, circle.radius) or circle
    roundness = circle.arc * circle.fill * circle.visible / (1 + circle.stray)
    outlines, _ = cv2.findContours(blob, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ellipse = ellipse_of(max(outlines, key=cv2.contourArea))
    if ellipse is None or ellipse.quality <= roundness:
        return share, _Region(color, blob, circle, circle, 1.0, 0.0, roundness)
    # A disc, seen from the side, or what a stripe leaves of a ball.
    aslant = circle._replace(u=ellipse.u, v=ellipse.v, radius=ellipse.radius)
    stretch = ellipse.radius / ellipse.short
    across, down, skew = ellipse.covariance
    turn = math.atan2(2 * skew, across - down) / 2
    return share, _Region(color, blob, aslant, circle, stretch, turn, ellipse.quality)


def _edges(image: np.ndarray) -> tuple[float, float, float, float]:
    """Return left, top, right, bottom of a picture, px."""
    height, width = image.shape[:2]
    return -0.5, -0.5, width - 0.5, height - 0.5


def _why_lost(
    marker: Marker, image: np.ndarray, circle: Circle, hsv: np.ndarray, least: float
) -> str | None:
    """Return why a marker is not found in its own picture, and the remedy; or None."""
    tracker = Tracker([marker])
    seen = tracker.find(image, 0.0)[marker.name]
    assert marker.color is not None
    if tracker.why[marker.name] == SEVERAL:
        return None  # it is found beside another one, which may be taken away
    if seen is not None and seen.confidence >= least:
        if math.hypot(seen.u - circle.u, seen.v - circle.v) < _MAX_REFOUND_DISTANCE * circle.radius:
            return None
        return (
            f"{seen.u:.0f},{seen.v:.0f} looks more like it; pick the middle of the marker, "
            "or take the other away"
        )
    if max(scene_of(image)) < MIN_SCENE_BRIGHTNESS:
        return "it is too dark; give it more light, or the camera more exposure"
    if isolation(hsv, circle, marker.color) < LEAST_CONFIDENCE:
        return (
            "what is around it has its colour, too; put it on a ground of another colour, "
            "or take another marker"
        )
    return "it is not whole, round and sharp enough; pick it in a frame that shows it better"


def _blob(mask: np.ndarray, box: tuple[int, int, int, int]) -> np.ndarray | None:
    """Return the component of a mask with most of the box, 255 inside; None if there is none."""
    u0, v0, u1, v1 = box
    _, labels = cv2.connectedComponents(mask)
    inside = labels[v0:v1, u0:u1]
    votes = np.bincount(inside[inside > 0].astype(np.intp), minlength=1)
    if not votes.any():
        return None
    return np.where(labels == int(np.argmax(votes)), 255, 0).astype(np.uint8)


def _disc(mask: np.ndarray, circle: Circle, wider: float) -> np.ndarray:
    """Return a mask of a circle, enlarged by a factor, in the shape of another mask."""
    disc = np.zeros_like(mask)
    cv2.circle(disc, (round(circle.u), round(circle.v)), round(wider * circle.radius), 255, -1)
    return disc


def _typical(pixels: np.ndarray, color: Color) -> Color:
    """Return the colour moved to the middle of its pixels, OpenCV's HSV, shape (n, 3)."""
    hues = (2.0 * pixels[:, 0] - color.hue + 180) % 360 - 180
    return replace(
        color,
        hue=(color.hue + float(np.median(hues))) % 360,
        saturation=float(np.median(pixels[:, 1])) / 255,
        value=float(np.median(pixels[:, 2])) / 255,
    )


def _around(hsv: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Return the pixels around a region but not on its rim: OpenCV's HSV, shape (n, 3)."""
    radius = math.sqrt(np.count_nonzero(region) / math.pi)
    around, near = (
        cv2.dilate(region, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * wide + 1,) * 2))
        for wide in (round(0.7 * radius) + 4, round(0.15 * radius) + 2)
    )
    return hsv[(around > 0) & (near == 0)]


def _parted(color: Color, own: np.ndarray, around: np.ndarray) -> Color:
    """Return the colour with floors that separate it from surroundings of the same hue.

    Args:
        color: the marker's.
        own: pixels of the marker, OpenCV's HSV, shape (n, 3).
        around: pixels around it, OpenCV's HSV, shape (n, 3).
    """
    alike = around[hsv_mask(around[None], color.wider())[0] > 0] if len(around) else around
    if len(alike) < _MIN_ALIKE * len(around) or not len(own):
        return color
    floors = []
    for channel, typical in ((1, color.saturation), (2, color.value)):
        theirs = float(np.percentile(alike[:, channel], 95)) / 255 / typical
        ours = float(np.percentile(own[:, channel], 25)) / 255 / typical
        floors.append((ours - theirs, min(ours, theirs / WIDER_SATURATION)))
    (by_saturation, saturation), (by_value, value) = floors
    if max(by_saturation, by_value) <= 0:
        return color
    if by_saturation >= by_value:
        return replace(color, saturation_floor=max(color.saturation_floor, saturation))
    return replace(color, value_floor=max(color.value_floor, value))


def _room(around: np.ndarray, color: Color) -> float:
    """Return half the distance in hue from the marker's colour to those around it, degrees.

    Args:
        around: pixels, OpenCV's HSV, shape (n, 3).
        color: the marker's.
    """
    if not len(around):
        return 180.0
    anything = hsv_mask(around[None], replace(color, tolerance=180.0))[0]
    hues = 2.0 * around[anything > 0][:, 0]
    if len(hues) < 20:
        return 180.0
    away = np.abs((hues - color.hue + 180) % 360 - 180)
    return max(8.0, 0.5 * float(np.percentile(away, 10)))


def _kind(hsv: np.ndarray, region: np.ndarray) -> str:
    """Return "ball" for what is shaded, else "disc"."""
    core = cv2.erode(region, np.ones((5, 5), np.uint8), borderValue=0)
    values = hsv[(core if core.any() else region) > 0][:, 2]
    dark, bright = np.percentile(values, (10, 90))
    # Rendered: discs of 5 to 31 px 1.02 to 1.15, balls of 12 to 31 px 1.27 to 1.5; filmed: 1.7 up.
    return "ball" if bright > 1.2 * max(dark, 1) else "disc"
