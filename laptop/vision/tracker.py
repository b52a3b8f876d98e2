"""An image becomes marker positions with a confidence.  Pure: no camera, no socket, no window.

A marker that was seen is measured in a window where it is expected; one that was not is searched
for in the whole frame, subsampled, through the closed gate of its colour.  Only what was measured
in this very frame comes out.  Pixel centres lie at integer coordinates.

A disc is measured by a soft centroid: each pixel counts with the share of marker in it, by its
place on the line from the colours around to the marker's.  A ball is shaded, shines and is held in
fingers: there the circle is taken that most of its outline lies on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from laptop.vision.circles import Circle, ellipse_of, find_circle
from laptop.vision.markers import Color, Marker, gate, hsv_of, hue_distance, scene_of
from shared.messages import LEAST_CONFIDENCE

Window = tuple[float, float, float, float]
"""Left, top, right, bottom, px."""


class Sighting(NamedTuple):
    """Where a marker is: u, v (px, sub-pixel), confidence (0 to 1), radius (px)."""

    u: float
    v: float
    confidence: float
    radius: float


LEAST = 0.2
"""Confidence below which nothing is claimed at all."""
DOUBTED = 0.45
"""The greatest confidence in what may well be something else."""
COVERED = 0.5
"""How long a disc may be partly hidden, s, before what is seen of it may be something else."""
PATIENCE = 3
"""Frames without the marker before its size, speed and shade are forgotten."""


class Tracker:
    """Finds markers in one camera's frames, one after the other.

    Args:
        markers: what to look for.

    Attributes:
        markers: what is looked for; may be set at any time, also from another thread.
        why: per marker why it was not seen in the last frame; "" if it was.
        windows: per marker where it was looked for first: left, top, right, bottom (px); None is
            the whole frame.
    """

    def __init__(self, markers: Sequence[Marker]):
        self.markers = tuple(markers)
        self.why = {marker.name: "" for marker in markers}
        self.windows: dict[str, Window | None] = {}
        self._tracks: dict[Marker, Track] = {}  # by what it looks like: a new look, a new start

    def find(self, image: np.ndarray, t: float) -> dict[str, Sighting | None]:
        """The markers in one frame.

        Args:
            image: BGR, uint8, shape (h, w, 3).
            t: capture time, s.

        Returns:
            per marker a Sighting, or None if it is not seen.
        """
        markers = self.markers
        before, self._tracks = self._tracks, {}
        self.why, self.windows = {}, {}
        found = {}
        for marker in markers:
            known = before.get(marker)
            self.windows[marker.name] = None if known is None else _window(known, t)
            track = self._tracks[marker] = find(image, t, marker, known)
            self.why[marker.name] = track.why
            found[marker.name] = track.sighting
        return found


class Paint(NamedTuple):
    """How much of a pixel is disc: weights of b, g, r, 1 (as _LIGHT), 65535 for all of it.

    weights  shape (1, 4)
    glow     brightness of the disc when this was mixed; None: not known yet
    age      frames since
    """

    weights: np.ndarray
    glow: float | None = None
    age: int = 0


@dataclass(frozen=True)
class Track:
    """What is known of one marker after a frame.

    sighting  where it is in that frame; None: not seen
    why       not seen; ""
    seen      the last sighting, for the window and the size only; None when forgotten
    t         of that sighting, s
    du, dv    px/s, for the window only
    trust     of the sighting: its confidence, and where that is 1, how good the shape is
    misses    frames since
    color     its colour under the present light
    gains     red, green, blue: by what the light differs from the one it was learned in
    paint     how a disc's share in a pixel is computed; None until it was seen whole
    whole     when it was last seen whole, s
    even      how well its outline followed a disc's when it was found, 0 to 1
    """

    sighting: Sighting | None = None
    why: str = ""
    seen: Sighting | None = None
    t: float = 0.0
    du: float = 0.0
    dv: float = 0.0
    trust: float = 0.0
    misses: int = 0
    color: Color | None = None
    gains: tuple[float, float, float] | None = None
    paint: Paint | None = None
    whole: float = -math.inf
    even: float = 1.0


def find(image: np.ndarray, t: float, marker: Marker, before: Track | None = None) -> Track:
    """One marker in one frame, given what was known before."""
    if marker.kind == "aruco":
        return _find_aruco(image, t, marker, before or Track())
    track = before or Track(color=marker.color)
    if track.seen is not None:
        measured = _expected(image, t, marker, track)
        if measured is not None:
            return measured
    return _search(image, t, marker, track)


# Where it is expected


def _expected(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track | None:
    """Measure in the window; None if it does not look like the marker there."""
    seen = track.seen
    assert seen is not None
    u, v = _predicted(seen, track, t)
    measured = None
    if marker.kind == "disc" and track.paint is not None and track.even == 1:
        measured = _measure_disc(image, u, v, seen.radius, marker, track)
    if measured is None:
        measured = _measure(image, u, v, seen.radius, marker, track, expected=seen.radius)
    if measured is None or measured.trust < 0.4:
        return None
    if marker.kind == "disc" and math.isinf(measured.whole) and t - track.whole > COVERED:
        return None
    return _moved(measured, track, t)


def _window(track: Track, t: float) -> Window | None:
    """Where a marker is looked for first: left, top, right, bottom, px; None: everywhere."""
    if track.seen is None:
        return None
    u, v = _predicted(track.seen, track, t)
    half = _reach(track.seen.radius)
    return u - half, v - half, u + half, v + half


def _reach(radius: float) -> float:
    """Half a side of the window for a marker of this radius, px."""
    return 2.2 * radius + 6


def _predicted(seen: Sighting, track: Track, t: float) -> tuple[float, float]:
    """Where a marker that was `seen` should be now, px; a speed says little about a long time."""
    dt = min(t - track.t, 0.2)
    return seen.u + track.du * dt, seen.v + track.dv * dt


def _moved(measured: Track, track: Track, t: float) -> Track:
    """The new track, with a speed if the marker was seen in the frame before."""
    seen, new = track.seen, measured.seen
    assert new is not None
    dt = t - track.t
    measured = replace(
        measured, t=t, misses=0, whole=track.whole if math.isinf(measured.whole) else t
    )
    if seen is None or track.misses or dt <= 0:
        return measured
    # Half of the way to the newest speed: an alpha-beta filter whose position is the measurement.
    du = 0.5 * track.du + 0.5 * (new.u - seen.u) / dt
    dv = 0.5 * track.dv + 0.5 * (new.v - seen.v) / dt
    return replace(measured, du=du, dv=dv)


# In the whole frame


def _search(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
    color = marker.color
    assert color is not None
    lights = dict.fromkeys((None, _gains(image, color)))
    shades = dict.fromkeys((color, track.color or color))
    tries: list[Track] = []
    places: dict[object, list[tuple[float, float]]] = {}
    for step in (4, 2):  # a small one shows in the finer picture only
        if min(image.shape[:2]) < step:
            continue
        small = cv2.resize(image, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_NEAREST)
        for light in lights:
            hsv = cv2.cvtColor(_relit(small, light), cv2.COLOR_BGR2HSV)
            for shade in shades:
                looked = places.setdefault((light, shade), [])
                for u, v, radius in _blobs(gate(hsv, shade), step, marker.radius):
                    if any(math.hypot(u - x, v - y) < radius for x, y in looked):
                        continue
                    looked.append((u, v))
                    start = Track(color=shade, gains=light)
                    tried = _measure(image, u, v, radius, marker, start)
                    if tried is not None:
                        tries.append(tried)
        if any(tried.trust >= LEAST_CONFIDENCE for tried in tries):
            break
    if tries:
        best = max(tries, key=lambda tried: tried.trust)
        if _rivals(best, tries):
            return replace(
                track,
                sighting=best.sighting and best.sighting._replace(confidence=DOUBTED),
                seen=None,
                why="several alike",
            )
        if best.trust >= LEAST_CONFIDENCE:
            return _moved(best, track, t)
        if best.trust >= LEAST:  # said, but not held on to
            return replace(_moved(best, track, t), seen=None)
    misses = track.misses + 1
    kept = track if misses < PATIENCE else Track(color=color)
    if tries:
        why = "nothing of this colour is a " + marker.kind
    elif max(scene_of(image)) < 20:
        why = "too dark"
    else:
        why = "nothing of this colour"
    return replace(kept, sighting=None, misses=misses, why=why)


def _rivals(best: Track, tries: list[Track]) -> bool:
    """Whether another one, elsewhere, is as good."""
    first = best.seen
    assert first is not None
    return best.trust >= LEAST_CONFIDENCE and any(
        tried.trust > 0.9 * best.trust
        and math.hypot(tried.seen.u - first.u, tried.seen.v - first.v) > 2 * first.radius
        for tried in tries
        if tried.seen is not None
    )


def _blobs(mask: np.ndarray, step: int, radius: float | None) -> list[tuple[float, float, float]]:
    """Centre and radius (px of the frame) of blobs in a subsampled mask, likely ones first."""
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = []
    for blob in sorted(blobs, key=len, reverse=True)[:40]:
        if len(blob) < 4:
            break
        (u, v), reach = cv2.minEnclosingCircle(blob)
        found.append((u * step, v * step, (reach + 0.5) * step))
    if radius is not None:
        found = [(u, v, min(reach, 3 * radius)) for u, v, reach in found if reach > 0.3 * radius]
        found.sort(key=lambda blob: abs(math.log(blob[2] / radius)))
    return found[:12]


# The light


def _gains(image: np.ndarray, color: Color) -> tuple[float, float, float] | None:
    """Red, green, blue: by what the light differs from when the colour was learned.

    The mean of the whole picture tells, which a fixed camera's background dominates (the grey-world
    assumption, kept to a comparison of a scene with itself).  None if it is much the same.
    """
    if color.scene is None:
        return None
    gains = [
        min(4.0, max(0.25, (now + 1) / (then + 1)))
        for now, then in zip(scene_of(image), color.scene, strict=True)
    ]
    if all(abs(math.log(gain)) < 0.08 for gain in gains):
        return None
    return gains[0], gains[1], gains[2]


def _relit(image: np.ndarray, gains: tuple[float, float, float] | None) -> np.ndarray:
    """The picture as it would have been under the light of learning."""
    if gains is None:
        return image
    red, green, blue = gains
    return cv2.transform(image, np.diag([1 / blue, 1 / green, 1 / red]))


def _adapted(hsv: tuple[float, float, float], track: Track, learned: Color) -> Color:
    """The colour a step nearer to what was seen, never far from what was learned."""
    color = track.color or learned
    hue = color.hue + 0.2 * hue_distance(hsv[0], color.hue)
    away = hue_distance(hue, learned.hue)
    allowed = 0.75 * learned.tolerance
    return replace(
        color,
        hue=(learned.hue + min(allowed, max(-allowed, away))) % 360,
        saturation=_between(color.saturation, hsv[1], learned.saturation, 0.6, 1.4),
        value=_between(color.value, hsv[2], learned.value, 0.2, 2.5),
    )


def _between(old: float, new: float, learned: float, low: float, high: float) -> float:
    return min(high * learned, max(low * learned, old + 0.2 * (new - old)))


# Measuring


def _crop(image: np.ndarray, u: float, v: float, half: float) -> tuple[np.ndarray, int, int] | None:
    """The window around (u, v) as far as it lies in the picture, with its left and top; px."""
    left, top = max(0, math.floor(u - half)), max(0, math.floor(v - half))
    window = image[top : max(0, math.ceil(v + half) + 1), left : max(0, math.ceil(u + half) + 1)]
    return (window, left, top) if min(window.shape[:2]) >= 4 else None


def _measure(
    image: np.ndarray,
    u: float,
    v: float,
    radius: float,
    marker: Marker,
    track: Track,
    expected: float | None = None,
) -> Track | None:
    """Measure through the gate of the colour, in a window around (u, v).

    Args:
        u, v, radius: where to look, px.
        expected: radius before, px, if it was seen before; then what is nearest is meant.
    """
    cropped = _crop(image, u, v, _reach(radius))
    if cropped is None:
        return None
    window, left, top = cropped
    learned, color = marker.color, track.color
    assert learned is not None
    assert color is not None
    relit = _relit(window, track.gains)
    hsv = cv2.cvtColor(relit, cv2.COLOR_BGR2HSV)
    mask = gate(hsv, color)
    near = (u - left, v - top) if expected else None
    if marker.kind == "disc":
        whole = _whole_disc(image, mask, left, top, marker, track, near, expected)
        if whole is not None:
            return whole
    height, width = image.shape[:2]
    edges = (-left - 0.5, -top - 0.5, width - left - 0.5, height - top - 0.5)
    circle = find_circle(mask, edges, near, expected)
    if circle is None:
        return None
    disc = np.zeros_like(mask)
    center = round(circle.u), round(circle.v)
    cv2.circle(disc, center, max(1, round(0.8 * circle.radius)), 255, -1)
    disc &= mask
    if not disc.any():
        return None
    shade = hsv_of(cv2.mean(relit, disc)[:3])
    # A word says nothing of size or shade, and skin is orange, too: then the rim must be clear.
    strict = learned.scene is None
    trust = (
        _ramp(circle.arc, 0.4 if strict else 0.2, 0.75 if strict else 0.6)
        * _ramp(circle.fill, 0.2, 0.6)
        * (1 - _ramp(circle.stray, 0.15, 0.8))
        * _ramp(circle.seen, 0.2, 0.8)
        * _likeness(shade, color if expected else learned, learned)
        * _alone(hsv, circle, learned)
        * _size(circle.radius, expected, marker.radius)
        * (_ramp(circle.radius, 4, 9) if strict else 1)
    )
    if marker.kind == "disc":  # partly hidden now; if it was never seen whole, something else
        trust = min(trust, 0.7 if track.paint is not None else DOUBTED)
    new = Sighting(circle.u + left, circle.v + top, trust, circle.radius)
    # Where confidences are equal, the rounder one is the better.
    trust *= 1 + 0.1 * circle.arc * circle.fill
    color = _adapted(shade, track, learned)
    return Track(new, seen=new, trust=trust, color=color, gains=track.gains, paint=track.paint)


def _ramp(x: float, low: float, high: float) -> float:
    return min(1.0, max(0.0, (x - low) / (high - low)))


def _likeness(hsv: tuple[float, float, float], color: Color, learned: Color) -> float:
    """How well a mean colour agrees; its brightness only with a colour that was learned."""
    away = abs(hue_distance(hsv[0], learned.hue)) / learned.tolerance
    like = 1 - _ramp(away, 0.6, 1.2)
    if learned.scene is None:  # a word: what is not vivid is no marker
        return like * _ramp(hsv[1] / learned.saturation, 0.55, 0.8)
    return (
        like
        * _ramp(hsv[1] / learned.saturation, 0.45, 0.75)
        * _ramp(hsv[2] / color.value, 0.3, 0.6)
    )


def _alone(hsv: np.ndarray, circle: Circle, color: Color) -> float:
    """Small if what is around has the colour, too: then it is a part of something larger."""
    wider = replace(color, tolerance=1.3 * color.tolerance, saturation=0.8 * color.saturation)
    ring = np.zeros(hsv.shape[:2], np.uint8)
    center = round(circle.u), round(circle.v)
    width = max(2, round(0.25 * circle.radius))
    cv2.circle(ring, center, round(1.15 * circle.radius + width), 255, width)
    total = cv2.countNonZero(ring)
    same = cv2.countNonZero(ring & gate(hsv, wider))
    return 1 - _ramp(same / max(1, total), 0.3, 0.6)


def _size(radius: float, *before: float | None) -> float:
    """How well a radius agrees with those seen before, px."""
    fit = _ramp(radius, 2, 4)
    for expected in before:
        if expected:
            fit *= _ramp(min(radius / expected, expected / radius), 0.3, 0.45)
    return fit


# The soft centroid


def _whole_disc(
    image: np.ndarray,
    mask: np.ndarray,
    left: int,
    top: int,
    marker: Marker,
    track: Track,
    near: tuple[float, float] | None,
    expected: float | None,
) -> Track | None:
    """A disc that is seen whole, an ellipse in perspective; None if it is not one."""
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    blobs = [blob for blob in blobs if len(blob) >= 8]
    if not blobs:
        return None
    if near is None:
        blob = max(blobs, key=cv2.contourArea)
    else:
        blob = max(blobs, key=lambda b: cv2.pointPolygonTest(b, near, True))
    rough = ellipse_of(blob)
    if rough is None:
        return None
    u, v, radius = rough.u + left, rough.v + top, rough.radius
    paint = _mix(image, u, v, radius, rough.spread)
    if paint is None:
        return None
    # Of a thin one the gate, which has but whole pixels, shows no shape.
    even, other = _evenness(image, u, v, radius, paint), rough.even
    even += 0.5 * _ramp(rough.short, 1.5, 3) * (other - even)
    if even <= 0:
        return None
    start = replace(track, paint=paint, seen=None, even=even)
    found = _measure_disc(image, u, v, radius, marker, start)
    if found is None or found.seen is None:
        return None
    trust = found.trust * _size(found.seen.radius, expected, marker.radius)
    new = found.seen._replace(confidence=min(1.0, trust))
    return replace(found, sighting=new, seen=new, trust=trust)


# Where two colours share a pixel, light adds up, and codes are about its square root; but a JPEG
# averages codes.  A power between 1 and 2.2 errs least beside light and dark at once.
_LIGHT = np.round(65535 * (np.arange(256) / 255) ** 1.4).astype(np.uint16)
_EDGE = 0.1
"""Shares below count as nothing, above 1 - _EDGE as all: only the rim tells where a disc is."""
_RIM = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
"""How far beyond the middle of its edge some of a disc's light still falls."""
_GRAIN = 0.01
"""Noise of a pixel, at least, as a part of white."""


@lru_cache(maxsize=64)
def _near(radius: int) -> np.ndarray:
    """In a window of 2 h + 1 px: where a marker may be."""
    half = _half(radius)
    v, u = np.mgrid[-half : half + 1, -half : half + 1]
    return np.where(np.hypot(u, v) < 1.25 * radius + 2.5, 65535, 0).astype(np.uint16)


def _half(radius: float) -> int:
    """Half of the window for a marker, px."""
    return math.ceil(1.6 * max(2, round(radius))) + 4


def _masks(half: int, spread: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """In a window of 2 h + 1 px: the core of a marker with these second moments, and its ring."""
    across, down, skew = spread
    turn = math.atan2(2 * skew, across - down) / 2
    middle, apart = (across + down) / 2, math.hypot((across - down) / 2, skew)
    long, short = 2 * math.sqrt(middle + apart), 2 * math.sqrt(max(middle - apart, 0.25))
    v, u = np.ogrid[-half : half + 1, -half : half + 1]
    along2 = (u * math.cos(turn) + v * math.sin(turn)) ** 2
    beside2 = (v * math.cos(turn) - u * math.sin(turn)) ** 2

    def within(times: float, more: float) -> np.ndarray:
        a, b = times * long + more, times * short + more
        return along2 / (a * a) + beside2 / (b * b) < 1

    return within(0.6, 0), within(1.35, 3.5) & ~within(1.12, 1.5)


def _around(
    image: np.ndarray, u: float, v: float, half: int
) -> tuple[np.ndarray, int, int, tuple[slice, slice]] | None:
    """The window of 2 h + 1 px around (u, v) as far as it lies in the picture.

    Returns:
        window, its left and top, and which part of a whole window's mask lies over it.
    """
    height, width = image.shape[:2]
    left, top = round(u) - half, round(v) - half
    columns = slice(max(0, -left), min(2 * half + 1, width - left))
    rows = slice(max(0, -top), min(2 * half + 1, height - top))
    # With the middle there, most of what counts is.
    if not (columns.start < half < columns.stop and rows.start < half < rows.stop):
        return None
    left, top = left + columns.start, top + rows.start
    window = image[top : top + rows.stop - rows.start, left : left + columns.stop - columns.start]
    return window, left, top, (rows, columns)


def _mix(
    image: np.ndarray, u: float, v: float, radius: float, spread: tuple[float, float, float]
) -> Paint | None:
    """Tell the marker's colour from those around it.

    Fisher's linear discriminant: what varies most around the marker (light and dark, mostly)
    counts least, so that an edge in the background does not pull.  None where the surroundings
    hardly differ from the marker.
    """
    half = _half(radius)
    there = _around(image, u, v, half)
    if there is None:
        return None
    window, _, _, part = there
    core, ring = _masks(half, spread)
    if not core[part].any() or not ring[part].any():
        return None
    light = cv2.LUT(window, _LIGHT)
    inside = light[core[part]].mean(axis=0) / 65535
    around = light[ring[part]].astype(np.float32) / 65535
    mean = around.mean(axis=0)
    around -= mean
    contrast = inside - mean
    scatter = around.T @ around / len(around) + np.eye(3) * _GRAIN**2
    weights = np.linalg.solve(scatter.astype(float), contrast)
    separation = float(weights @ contrast)
    if separation < 9:
        return None
    weights /= separation * (1 - 2 * _EDGE)
    return Paint(np.append(weights, -65535 * (weights @ mean + _EDGE / (1 - 2 * _EDGE)))[None])


def _evenness(image: np.ndarray, u: float, v: float, radius: float, paint: Paint) -> float:
    """How well the outline of what is half disc follows an ellipse.

    Brightness has a part in it, which a JPEG keeps finer than the colours that the gate sees.
    """
    there = _around(image, u, v, _half(radius))
    if there is None:
        return 0.0
    share = cv2.transform(cv2.LUT(there[0], _LIGHT), paint.weights)
    # Between pixels, too: of a small one, and of one aslant, whole pixels do not show the shape.
    finer = 4 if radius < 24 else 1
    at = (u - there[1] + 0.5) * finer - 0.5, (v - there[2] + 0.5) * finer - 0.5
    outline = _outline(cv2.resize(share, None, fx=finer, fy=finer), *at)
    ellipse = None if outline is None else ellipse_of(outline, finer)
    return ellipse.even if ellipse else 0.0


def _outline(share: np.ndarray, u: float, v: float) -> np.ndarray | None:
    """Of what is half disc and lies around (u, v), or nearest; None if nothing is."""
    half = cv2.inRange(share, 32768, 65535)
    outlines, _ = cv2.findContours(half, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return None
    return max(outlines, key=lambda outline: cv2.pointPolygonTest(outline, (u, v), True))


def _measure_disc(
    image: np.ndarray,
    u: float,
    v: float,
    radius: float,
    marker: Marker,
    track: Track,
    alone: bool = False,
) -> Track | None:
    """Soft centroid near (u, v); None if what is there is not a whole disc of this colour.

    Where colours of many kinds are around, no line tells the marker from all of them: some keep a
    share, which makes the shape look wrong.  Then it is measured again without them.

    Args:
        alone: of what has a share, only what is half disc counts, with its rim.
    """
    paint = track.paint
    assert paint is not None
    near = _near(max(2, round(radius)))
    start = u, v
    for _ in range(3):
        there = _around(image, u, v, near.shape[0] // 2)
        if there is None:
            return None
        window, left, top, part = there
        share = cv2.transform(cv2.LUT(window, _LIGHT), paint.weights)
        share = cv2.bitwise_and(share, near[part])
        if alone:
            outline = _outline(share, start[0] - left, start[1] - top)
            if outline is None:
                return None
            own = np.zeros(share.shape, np.uint8)
            cv2.drawContours(own, [outline], -1, 255, -1)
            share = cv2.bitwise_and(share, share, mask=cv2.dilate(own, _RIM))
        m = cv2.moments(share)
        if m["m00"] < 12 * 65535:
            return None
        before = u, v
        u, v = left + m["m10"] / m["m00"], top + m["m01"] / m["m00"]
        if math.hypot(u - before[0], v - before[1]) < 0.2 * radius:
            break
    m00 = m["m00"]
    across, down, skew = m["mu20"] / m00, m["mu02"] / m00, m["mu11"] / m00
    # A full ellipse has area = 4 pi sqrt(det of its second moments); anything else is spread wider.
    area = m00 / 65535
    solid = area / (4 * math.pi * math.sqrt(max(across * down - skew * skew, 1e-9)))
    middle = (across + down) / 2
    longest = middle + math.hypot((across - down) / 2, skew)
    # A whole ellipse has no third moments; one of which something hides a part has.  (Whole ones of
    # 6 px have up to 0.08, one that lacks a fifth of its radius 0.14, half of it 0.37.)
    thirds = m["mu30"] ** 2 + m["mu03"] ** 2 + 3 * (m["mu21"] ** 2 + m["mu12"] ** 2)
    lopsided = math.sqrt(thirds) / m00 / middle**1.5
    shape = _ramp(solid, 0.75, 0.9) * (1 - _ramp(lopsided, 0.15, 0.3))
    if shape < 1 and not alone:
        return _measure_disc(image, *start, radius, marker, track, alone=True)
    learned = marker.color
    assert learned is not None
    inside = cv2.inRange(share, 50000, 65535)
    blue, green, red, _ = cv2.mean(window, inside)
    light = track.gains or (1.0, 1.0, 1.0)
    shade = hsv_of((blue / light[2], green / light[1], red / light[0]))
    new_radius = 2 * math.sqrt(longest)
    trust = track.even * shape * _likeness(shade, track.color or learned, learned)
    if track.seen is not None:
        trust *= 1 - _ramp(abs(math.log(new_radius / radius)), 0.2, 0.5)
    if trust < LEAST_CONFIDENCE:
        return None
    new = Sighting(u, v, trust, new_radius)
    glow = blue + green + red
    if paint.glow is not None and abs(glow / paint.glow - 1) > 0.04:
        # The light has changed: what was mixed before it did is of no use.
        fresh = _mix(image, u, v, new_radius, (across, down, skew))
        if fresh is None:
            return None
        return _measure_disc(image, u, v, radius, marker, replace(track, paint=fresh))
    paint = paint._replace(glow=glow, age=paint.age + 1)
    if paint.age > 4:
        fresh = _mix(image, u, v, new_radius, (across, down, skew))
        paint = fresh and fresh._replace(glow=glow)
    return Track(
        new, seen=new, trust=trust, color=_adapted(shade, track, learned), gains=track.gains,
        paint=paint, whole=0.0, even=track.even,
    )  # fmt: skip


# ArUco


@lru_cache(maxsize=1)
def _detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    # Read the bits where blur leaves them: finer, and off their edges.  (Of 60 frames with a side
    # of 32 px it missed 5 by default, and misses none.)
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.3
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    return cv2.aruco.ArucoDetector(dictionary, parameters)


def _find_aruco(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
    height, width = image.shape[:2]
    windows = [(0, 0, width, height)]
    if track.seen is not None:
        u, v = _predicted(track.seen, track, t)
        half = 2.2 * track.seen.radius + 20
        box = (
            max(0, int(u - half)),
            max(0, int(v - half)),
            min(width, int(u + half)),
            min(height, int(v + half)),
        )
        if box[2] - box[0] > 16 and box[3] - box[1] > 16:
            windows.insert(0, box)
    for left, top, right, bottom in windows:
        grey = cv2.cvtColor(image[top:bottom, left:right], cv2.COLOR_BGR2GRAY)
        corners, ids, _ = _detector().detectMarkers(grey)
        for quad, id_ in zip(corners, [] if ids is None else ids.flatten(), strict=True):
            if id_ == marker.id:
                new = _of_corners(quad[0].astype(float) + (left, top))
                return _moved(Track(new, seen=new), track, t)
    misses = track.misses + 1
    kept = track if misses < PATIENCE else Track()
    return replace(kept, sighting=None, misses=misses, why=f"no ArUco marker {marker.id}")


def _of_corners(quad: np.ndarray) -> Sighting:
    """Where the diagonals cross, which is the centre under any perspective."""
    a, b, c, d = quad
    ac, bd = c - a, d - b
    cross = ac[0] * bd[1] - ac[1] * bd[0]
    along = ((b - a)[0] * bd[1] - (b - a)[1] * bd[0]) / cross
    u, v = a + along * ac
    side = math.sqrt(abs(cross) / 2)
    return Sighting(float(u), float(v), _ramp(side, 10, 24), side / math.sqrt(2))
