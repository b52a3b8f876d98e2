"""A marker found by its colour: followed in its window, or searched for in the whole frame.

The search runs on subsampled frames, through the closed gate of the colour.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import cv2
import numpy as np

from laptop.see.markers.finders.confidence import MAX_AMBIGUOUS_CONFIDENCE, MIN_REPORTED_CONFIDENCE
from laptop.see.markers.finders.illumination import light_gains, relight
from laptop.see.markers.markers import Marker, hsv_mask, is_grey, scene_of
from laptop.see.markers.tracks import (
    SPEED_MEMORY,
    Place,
    Sighting,
    Suspect,
    Track,
    half_window,
)
from shared.messages import LEAST_CONFIDENCE

Measure = Callable[[np.ndarray, float, Place, Marker, Track], "Track | None"]
"""Measures a marker at a place in an image (BGR) of time t (s), given its track; None: not there.

Where the track has been seen before, what is nearest is meant.
"""

MIN_FOLLOWED_SCORE = 0.4
"""Score in the window below which the marker is searched for in the whole frame."""
MIN_SCENE_BRIGHTNESS = 20.0
"""Mean of a picture's brightest channel, 0 to 255, below which it is too dark to see anything."""
ELSEWHERE = "not where it was; soon sure"
SEVERAL = "several alike"
OTHER = "only another one of its colour"
GREY = "no colours in the picture"
GREY_EVERY = 16
"""Number of frames without the marker from one check for colours to the next: a grey camera stays
grey."""
MAX_TIMES_LARGER = 10
"""Greatest size of a candidate relative to the marker: larger ones are a table."""
MAX_BLOBS_MEASURED = 12
"""Greatest number of blobs of one colour that are measured in a picture."""


def find_by_color(
    image: np.ndarray, t: float, marker: Marker, track: Track, measure: Measure
) -> Track:
    """Find a coloured marker in one frame.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        t: capture time, s.
        marker: what to look for.
        track: what was known of it before.
        measure: for its kind.
    """
    place = track.predict(t)
    if place is not None:
        measured = measure(image, t, place, marker, track)
        if measured is not None and measured.score >= MIN_FOLLOWED_SCORE:
            return _accepted(measured, image, t, track)
    return _search(image, t, marker, _with_others(track, marker), measure)


def _accepted(measured: Track, image: np.ndarray, t: float, track: Track) -> Track:
    """Return the track after a certain detection."""
    new = track.update(measured, t)
    if measured.score < LEAST_CONFIDENCE:
        return new
    speed = max(SPEED_MEMORY * track.speed, math.hypot(new.du, new.dv))
    return replace(
        new, last_sure=new.seen, last_sure_t=t, speed=speed, picture=image, others=(), suspect=None
    )


def _with_others(track: Track, marker: Marker) -> Track:
    """Return the track with the other places of its colour, as of its last detection."""
    last_sure, image = track.last_sure, track.picture
    if last_sure is None or image is None:
        return track
    color = marker.color
    assert color is not None
    others = []
    for gains in dict.fromkeys((None, track.gains)):
        small = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_NEAREST)
        hsv = cv2.cvtColor(relight(small, gains), cv2.COLOR_BGR2HSV)
        for shade in dict.fromkeys((color, track.color or color)):
            for u, v, radius in _blobs(hsv_mask(hsv, shade), 2, track.known_radii(marker)):
                if math.hypot(u - last_sure.u, v - last_sure.v) > last_sure.radius + 0.5 * radius:
                    others.append((u, v, radius))
    return replace(track, others=tuple(others), picture=None)


def _search(image: np.ndarray, t: float, marker: Marker, track: Track, measure: Measure) -> Track:
    candidates = _candidates(image, t, marker, track, measure)
    fitting = [
        candidate
        for candidate in candidates
        if candidate.seen and track.fits(candidate.seen, t) and not _is_other(candidate.seen, track)
    ]
    if fitting:
        best = max(fitting, key=lambda candidate: candidate.score)
        if _has_rival(best, fitting):
            return _ambiguous(best, track, SEVERAL)
        if best.score >= LEAST_CONFIDENCE:
            return _accepted(best, image, t, track)
    if candidates:
        best = max(candidates, key=lambda candidate: candidate.score)
        if best.score >= LEAST_CONFIDENCE:
            return _suspected(best, candidates, image, t, track)
        if best.score >= MIN_REPORTED_CONFIDENCE:  # reported, but not followed
            return replace(track.update(best, t), seen=None)
        sizes = (candidate.why for candidate in candidates if candidate.why)
        why = next(sizes, "nothing of this colour is a " + marker.kind)
    elif max(scene_of(image)) < MIN_SCENE_BRIGHTNESS:
        why = "too dark"
    elif track.why == GREY if track.misses % GREY_EVERY else is_grey(image):
        why = GREY
    else:
        why = "nothing of this colour"
    return replace(track.miss(marker.color, why), suspect=None)


def _suspected(
    best: Track, candidates: list[Track], image: np.ndarray, t: float, track: Track
) -> Track:
    """Return a detection out of reach as a suspect, until it has stayed for some frames."""
    unknown = [
        candidate
        for candidate in candidates
        if candidate.seen
        and candidate.score >= LEAST_CONFIDENCE
        and not _is_other(candidate.seen, track)
    ]
    known = not unknown
    best = best if known else max(unknown, key=lambda candidate: candidate.score)
    if _has_rival(best, candidates if known else unknown):
        return _ambiguous(best, track, SEVERAL)
    seen, before = best.seen, track.suspect
    assert seen is not None
    suspect = Suspect(seen.u, seen.v, seen.radius, t, t, 1)
    if before and math.hypot(seen.u - before.u, seen.v - before.v) < half_window(before.radius):
        suspect = suspect._replace(since=before.since, frames=before.frames + 1)
    if suspect.is_sure(known):
        return _accepted(best, image, t, track.forgotten(track.color))
    others = track.others
    if known:  # it may move
        others = (*(o for o in others if not _is_at(seen, o)), (seen.u, seen.v, seen.radius))
    why = OTHER if known else ELSEWHERE
    return replace(_ambiguous(best, track, why), suspect=suspect, others=others)


def _ambiguous(best: Track, track: Track, why: str) -> Track:
    """Return the track after a frame with a doubtful detection."""
    sighting = best.sighting
    assert sighting is not None
    confidence = min(sighting.confidence, MAX_AMBIGUOUS_CONFIDENCE)
    missed = track.miss(best.color, why)
    return replace(missed, sighting=sighting._replace(confidence=confidence))


def _is_other(seen: Sighting, track: Track) -> bool:
    """Return whether a place held the colour while the marker was seen elsewhere."""
    return any(_is_at(seen, other) for other in track.others)


def _is_at(seen: Sighting, place: Place) -> bool:
    u, v, radius = place
    return math.hypot(seen.u - u, seen.v - v) < 0.5 * (seen.radius + radius)


def _candidates(
    image: np.ndarray, t: float, marker: Marker, track: Track, measure: Measure
) -> list[Track]:
    """Measure whatever has the colour: as learned or as last seen, relit or not."""
    color = marker.color
    assert color is not None
    lights = dict.fromkeys((None, light_gains(image, color)))
    colors = dict.fromkeys((color, track.color or color))
    known = track.known_radii(marker)
    largest = MAX_TIMES_LARGER * max(known, default=math.inf)
    candidates: list[Track] = []
    places: dict[object, list[tuple[float, float]]] = {}
    for step in (4, 2):  # a small one shows in the finer picture only
        if min(image.shape[:2]) < step:
            continue
        small = cv2.resize(image, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_NEAREST)
        for gains in lights:
            hsv = cv2.cvtColor(relight(small, gains), cv2.COLOR_BGR2HSV)
            for shade in colors:
                measured = places.setdefault((gains, shade), [])
                for u, v, radius in _blobs(hsv_mask(hsv, shade), step, known):
                    if any(math.hypot(u - x, v - y) < radius for x, y in measured):
                        continue
                    measured.append((u, v))
                    radius = min(radius, largest)
                    start = Track(color=shade, gains=gains, last_sure=track.last_sure)
                    candidate = measure(image, t, (u, v, radius), marker, start)
                    if candidate is not None:
                        candidates.append(candidate)
        if any(candidate.score >= LEAST_CONFIDENCE for candidate in candidates):
            break
    return candidates


def _has_rival(best: Track, candidates: list[Track]) -> bool:
    """Return True if another candidate, elsewhere, scores as high."""
    first = best.seen
    assert first is not None

    def is_elsewhere(seen: Sighting) -> bool:
        return math.hypot(seen.u - first.u, seen.v - first.v) > 2 * first.radius

    return best.score >= LEAST_CONFIDENCE and any(
        candidate.score > 0.9 * best.score and is_elsewhere(candidate.seen)
        for candidate in candidates
        if candidate.seen is not None
    )


def _blobs(mask: np.ndarray, step: int, known: Sequence[float]) -> list[Place]:
    """Return circles around the blobs of a subsampled mask, the likeliest first.

    Args:
        mask: uint8, shape (h, w).
        step: px of the frame in one of the mask.
        known: radii that the marker may have, px.
    """
    blobs, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = []
    for blob in sorted(blobs, key=len, reverse=True)[:40]:
        if len(blob) < 4:
            break
        (u, v), reach = cv2.minEnclosingCircle(blob)
        found.append((u * step, v * step, (reach + 0.5) * step))
    if known:
        # A smaller one is looked at only to say so.
        found = [blob for blob in found if blob[2] > 0.3 * min(known)] or found[:1]
        found.sort(key=lambda blob: min(abs(math.log(blob[2] / radius)) for radius in known))
    return found[:MAX_BLOBS_MEASURED]
