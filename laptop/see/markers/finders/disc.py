"""Finder of flat discs.

A disc that is seen whole, an ellipse in perspective, is measured by a soft centroid: each pixel
counts with the share of disc in it.  One that is partly hidden is for a while measured as a circle.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from laptop.see.markers.circles import ellipse_of
from laptop.see.markers.discriminant import (
    FULL_SHARE,
    DiscriminantModel,
    crop_around,
    disc_share,
    fit_discriminant,
    half_crop,
    outline_at,
    outline_quality,
    reach_mask,
)
from laptop.see.markers.finders.circle_measurement import ColorWindow, color_window, measure_circle
from laptop.see.markers.finders.color_search import find_by_color
from laptop.see.markers.finders.confidence import (
    MAX_AMBIGUOUS_CONFIDENCE,
    color_likeness,
    other_size,
    ramp,
    size_likeness,
)
from laptop.see.markers.finders.illumination import adapt_color
from laptop.see.markers.finders.smeared_disc import measure_smear
from laptop.see.markers.markers import Marker, hsv_of
from laptop.see.markers.tracks import Place, Sighting, Track
from shared.messages import LEAST_CONFIDENCE

MAX_HIDDEN_TIME = 0.5
"""Longest time for which a disc may be partly hidden, s; then it may be something else."""
MAX_HIDDEN_CONFIDENCE = 0.7
"""Greatest confidence in a disc that is partly hidden."""
MIN_OUTLINE = 8
"""Least number of px of a disc's outline."""
MIN_AREA = 12
"""Least area of a disc, px."""
MAX_MODEL_AGE = 4
"""Number of frames after which the discriminant is fitted anew."""
MAX_BRIGHTNESS_CHANGE = 0.04
"""Relative change of a disc's brightness up to which its discriminant stays valid."""
MAX_DECENTRING = 0.6
"""Distance of a disc from the window's middle up to which all around it counts alike, px."""
MAX_PASSES = 4
"""Greatest number of passes that move the window to the disc."""
MIN_STRETCH = 1.2
"""Least ratio of the second moments of a disc that may be smeared."""
_RIM = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
"""Kernel of the pixels around a disc's edge into which some of its light falls."""


def find_disc(image: np.ndarray, t: float, marker: Marker, track: Track) -> Track:
    """Find a disc in one frame; see `tracker.MarkerFinder`."""
    return find_by_color(image, t, marker, track, _measure)


def _measure(
    image: np.ndarray, t: float, place: Place, marker: Marker, track: Track
) -> Track | None:
    if track.discriminant is not None and track.ellipse_quality == 1:
        unoccluded = _measure_unoccluded(image, place, marker, track)
        if unoccluded is not None:
            return unoccluded
    window = color_window(image, place, track)
    if window is None:
        return None
    unoccluded = _detect_unoccluded(image, window, marker, track)
    if unoccluded is not None and unoccluded.score == 1:
        return unoccluded
    smeared = measure_smear(image, place, track)
    if smeared is not None or unoccluded is not None:
        return smeared or unoccluded
    if track.seen is not None and t - track.last_unoccluded > MAX_HIDDEN_TIME:
        return None
    known = track.discriminant is not None  # if it was never seen whole, it is something else
    confidence = MAX_HIDDEN_CONFIDENCE if known else MAX_AMBIGUOUS_CONFIDENCE
    return measure_circle(window, marker, track, confidence)


def _detect_unoccluded(
    image: np.ndarray, window: ColorWindow, marker: Marker, track: Track
) -> Track | None:
    """Find a whole disc in a mask, of which nothing but its colour is known; None if it is none."""
    blobs, _ = cv2.findContours(window.mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    blobs = [blob for blob in blobs if len(blob) >= MIN_OUTLINE]
    if not blobs:
        return None
    expected = window.expected
    if expected is None:
        blob = max(blobs, key=cv2.contourArea)
    else:
        blob = max(blobs, key=lambda b: cv2.pointPolygonTest(b, expected, True))
    rough = ellipse_of(blob)
    if rough is None:
        return None
    u, v, radius = rough.u + window.left, rough.v + window.top, rough.radius
    model = fit_discriminant(image, u, v, radius, rough.covariance)
    if model is None:
        return None
    # Of a thin one the mask, which has but whole pixels, shows no shape.
    quality, other = outline_quality(image, u, v, radius, model), rough.quality
    quality += 0.5 * ramp(rough.short, 1.5, 3) * (other - quality)
    if quality <= 0:
        return None
    # A mask shows little of a smear: the next frame fits anew, by what is measured in this one.
    model = model._replace(age=MAX_MODEL_AGE - 1)
    start = replace(track, discriminant=model, seen=None, ellipse_quality=quality)
    found = _measure_unoccluded(image, (u, v, radius), marker, start)
    if found is None or found.seen is None:
        return None
    before = track.seen.radius if track.seen else None
    known = track.known_radii(marker)
    size = size_likeness(found.seen.radius, before, known)
    why = other_size(size, found.score, found.seen.radius, known)
    score = found.score * size
    new = found.seen._replace(confidence=min(1.0, score))
    return replace(found, sighting=new, why=why, seen=new, score=score)


class _SoftCentroid(NamedTuple):
    """The shares of disc around a place, and their moments.

    u, v     centre of gravity, px of the picture
    window   BGR
    share    of disc in each pixel of the window
    moments  of the shares, as of cv2.moments
    """

    u: float
    v: float
    window: np.ndarray
    share: np.ndarray
    moments: Any


def _soft_centroid(
    image: np.ndarray, place: Place, model: DiscriminantModel, separate: bool
) -> _SoftCentroid | None:
    """Move to the centre of gravity of what is disc; None if hardly anything is.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        place: where to begin: u, v, radius, px.
        model: tells the share of disc from the colour.
        separate: of what has a share, only what is half disc counts, with its rim.
    """
    u, v, radius = place
    reach = reach_mask(max(2, round(radius)))
    half, wide_half = reach.shape[0] // 2, half_crop(radius)
    wide, at = None, (u, v)
    for _ in range(MAX_PASSES):
        if wide is None or max(abs(u - at[0]), abs(v - at[1])) > wide_half - half - 1:
            wide, at = crop_around(image, u, v, wide_half), (u, v)
            if wide is None:
                return None
            shares = disc_share(wide.image, model)
        crop = crop_around(shares, u - wide.left, v - wide.top, half)
        if crop is None:
            return None
        share = cv2.bitwise_and(crop.image, reach[crop.part])
        left, top = crop.left + wide.left, crop.top + wide.top
        if separate:
            outline = outline_at(share, place[0] - left, place[1] - top)
            if outline is None:
                return None
            own = np.zeros(share.shape, np.uint8)
            cv2.drawContours(own, [outline], -1, 255, -1)
            share = cv2.bitwise_and(share, share, mask=cv2.dilate(own, _RIM))
        m = cv2.moments(share)
        if m["m00"] < MIN_AREA * FULL_SHARE:
            return None
        before = u, v
        u, v = left + m["m10"] / m["m00"], top + m["m01"] / m["m00"]
        if math.hypot(u - before[0], v - before[1]) < MAX_DECENTRING:
            break
    height, width = share.shape
    window = image[top : top + height, left : left + width]
    return _SoftCentroid(u, v, window, share, m)


def _has_changed(model: DiscriminantModel, brightness: float) -> bool:
    """Return whether a disc is no longer as bright as when its discriminant was fitted."""
    before = model.brightness
    return before is not None and abs(brightness / before - 1) > MAX_BRIGHTNESS_CHANGE


# A disc in perspective is very nearly an ellipse, with half axes a >= b.  Weighted by the share of
# disc in each pixel, its moments are those of an even ellipse: the covariance has the eigenvalues
# a^2 / 4 and b^2 / 4, so that a = 2 sqrt(longest), and the area is
#     pi a b = 4 pi sqrt(det covariance).
# Of all even shapes of one area the ellipse has the least determinant: what is spread wider, with
# something missing or added, shows in the ratio of both (`solid`).  Third moments are zero where
# there is a centre of symmetry: what lacks a side shows in them (`lopsided`).  Their squares, each
# as often as it stands in the symmetric tensor, have a sum that does not turn with the picture.
# Shares instead of a mask, for a mask's edge moves by whole pixels; and a centroid instead of a
# fitted rim, for it averages over all of the disc.
def _ellipse_likeness(moments: Any) -> tuple[tuple[float, float, float], float, float]:
    """Return the likeness of shares of disc to those of a whole ellipse, and their moments.

    Args:
        moments: of the shares, as of cv2.moments.

    Returns:
        Their covariance (across, down, skew), px^2; its greater eigenvalue, px^2; and the likeness,
        0 to 1.
    """
    m = moments
    m00 = m["m00"]
    across, down, skew = m["mu20"] / m00, m["mu02"] / m00, m["mu11"] / m00
    area = m00 / FULL_SHARE
    solid = area / (4 * math.pi * math.sqrt(max(across * down - skew * skew, 1e-9)))
    middle = (across + down) / 2
    longest = middle + math.hypot((across - down) / 2, skew)
    # Whole ones of 6 px have up to 0.08, one without a fifth of its radius 0.14, half of it 0.37.
    thirds = m["mu30"] ** 2 + m["mu03"] ** 2 + 3 * (m["mu21"] ** 2 + m["mu12"] ** 2)
    lopsided = math.sqrt(thirds) / m00 / middle**1.5
    return (
        (across, down, skew),
        longest,
        ramp(solid, 0.75, 0.9) * (1 - ramp(lopsided, 0.15, 0.3)),
    )


def _measure_unoccluded(
    image: np.ndarray, place: Place, marker: Marker, track: Track, separate: bool = False
) -> Track | None:
    """Measure by the soft centroid; None if what is there is not a whole disc of this colour.

    Where colours of many kinds are around, no line tells the disc from all of them: some keep a
    share, which makes the shape look wrong.  Then it is measured again without them.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        place: where to begin: u, v, radius, px.
        marker: what is looked for.
        track: what is known of it from earlier frames.
        separate: whether to measure without the colours that keep a share.
    """
    model, learned = track.discriminant, marker.color
    assert model is not None
    assert learned is not None
    found = _soft_centroid(image, place, model, separate)
    if found is None:
        return None
    u, v, window, share, m = found
    covariance, longest, shape = _ellipse_likeness(m)
    if shape < 1 and not separate:
        stretched = longest > MIN_STRETCH * (covariance[0] + covariance[1] - longest)
        smeared = measure_smear(image, place, track) if stretched else None
        if smeared is not None:
            return smeared
        return _measure_unoccluded(image, place, marker, track, separate=True)
    inside = cv2.inRange(share, 50000, FULL_SHARE)
    blue, green, red, _ = cv2.mean(window, inside)
    gains = track.gains or (1.0, 1.0, 1.0)
    shade = hsv_of((blue / gains[2], green / gains[1], red / gains[0]))
    radius = 2 * math.sqrt(longest)
    score = track.ellipse_quality * shape * color_likeness(shade, track.color or learned, learned)
    if track.seen is not None:
        score *= 1 - ramp(abs(math.log(radius / place[2])), 0.2, 0.5)
    if score < LEAST_CONFIDENCE:
        return None
    brightness = blue + green + red
    if _has_changed(model, brightness):
        # The light has changed: what was fitted before it did is of no use.
        fresh = fit_discriminant(image, u, v, radius, covariance)
        if fresh is None:
            return None
        track = replace(track, discriminant=fresh)
        return _measure_unoccluded(image, (u, v, place[2]), marker, track)
    updated: DiscriminantModel | None = model._replace(brightness=brightness, age=model.age + 1)
    if model.age >= MAX_MODEL_AGE:
        fresh = fit_discriminant(image, u, v, radius, covariance)
        updated = fresh and fresh._replace(brightness=brightness)
    new = Sighting(u, v, score, radius)
    return Track(
        new, seen=new, score=score, color=adapt_color(shade, track.color, learned),
        gains=track.gains, discriminant=updated, last_unoccluded=0.0,
        ellipse_quality=track.ellipse_quality,
    )  # fmt: skip
