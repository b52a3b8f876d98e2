"""Finder of a disc that is smeared over a stadium by its motion during the exposure."""

from __future__ import annotations

import math

import cv2
import numpy as np

from laptop.see.markers.discriminant import DiscriminantModel, crop_around, smeared_share
from laptop.see.markers.finders.confidence import ramp
from laptop.see.markers.smear import (
    Smear,
    fit_smear,
    smear_mask,
    smear_misfit,
    smear_of_moments,
    smear_share,
)
from laptop.see.markers.tracks import Place, Sighting, Track, half_window
from shared.messages import LEAST_CONFIDENCE

MAX_SMEARED_CONFIDENCE = 0.85
"""Greatest confidence in a smear: its middle is where the disc was in the middle of the exposure
only if it moved evenly."""
MIN_SMEAR, MAX_SMEAR = 0.8, 6.0
"""Lengths of the way, in radii, from which a disc is smeared, and up to which it is found."""
_MAX_EXTENSION = 20
"""Greatest reach of a disc's smear beyond its window, px: it may just have started to move."""
_MISFITS = (0.12, 0.2, 0.3)
"""Misfits of a smear: of a certain one, of a doubtful one, of none, ..."""
_TRUSTS = (MAX_SMEARED_CONFIDENCE, LEAST_CONFIDENCE, 0.0)
"""... and the confidences at these."""
_AROUND = (2, 8)
"""Distances from a smear between which its surroundings are sampled, px."""
_MIN_SHARE = 0.25
"""Least share of disc of a pixel in the search for a smear."""
_MASSES = (0.4, 2.5)
"""Least and greatest disc area in a blob that may be a smear, relative to the disc's."""


def measure_smear(image: np.ndarray, place: Place, track: Track) -> Track | None:
    """Measure the smear of a disc that was seen at rest before; None if none is there.

    Args:
        image: BGR, uint8, shape (h, w, 3).
        place: where the disc is expected.
        track: what was known of it before this frame.
    """
    model = track.discriminant
    if model is None or track.seen is None:
        return None
    u, v, radius = place
    crop = crop_around(image, u, v, math.ceil(half_window(radius)) + _MAX_EXTENSION)
    if crop is None:
        return None
    at = u - crop.left, v - crop.top
    found = _find(crop.image, at, radius, model)
    if found is None:
        return None
    smear, misfit = found
    shown = float(smear_share(smear, crop.image.shape[:2]).sum()) / (math.pi * smear.radius**2)
    score = float(np.interp(misfit, _MISFITS, _TRUSTS))
    score *= 1 - ramp(abs(math.log(smear.radius / radius)), 0.15, 0.3)
    score *= ramp(shown, 0.6, 0.9)
    if score < LEAST_CONFIDENCE:
        return None
    smear = smear.moved(crop.left, crop.top)
    new = Sighting(smear.u, smear.v, score, smear.radius)
    return Track(
        new, seen=new, score=score, color=track.color, gains=track.gains, discriminant=model,
        last_unoccluded=0.0, ellipse_quality=track.ellipse_quality,
    )  # fmt: skip


def _find(
    window: np.ndarray, at: tuple[float, float], radius: float, model: DiscriminantModel
) -> tuple[Smear, float] | None:
    """Return the smear nearest to a place in a window, and its misfit."""
    share = smeared_share(window, model, np.full(window.shape[:2], 255, np.uint8))
    smear = None if share is None else _rough(share, at, radius)
    if not _is_smeared(smear, radius):
        return None
    assert smear is not None
    margin = _AROUND[1] + 2
    reach = np.array([abs(smear.du), abs(smear.dv)]) / 2 + smear.radius + margin
    left, top = np.maximum(0, np.floor(np.array([smear.u, smear.v]) - reach)).astype(int).tolist()
    right, bottom = np.ceil(np.array([smear.u, smear.v]) + reach).astype(int).tolist()
    window = window[top : bottom + 1, left : right + 1]
    smear = smear.moved(-left, -top)
    for _ in range(2):
        # What is around it, and not what it was before, is what it has to be told from.
        outer, inner = (smear_mask(smear, window.shape, wide) for wide in reversed(_AROUND))
        share = smeared_share(window, model, outer & ~inner)
        found = None if share is None else fit_smear(share, smear)
        if share is None or found is None or not _is_smeared(found, radius):
            return None
        smear, misfit = found, smear_misfit(share, found)
    return smear.moved(left, top), misfit


def _is_smeared(smear: Smear | None, radius: float) -> bool:
    return smear is not None and MIN_SMEAR * radius < smear.length < MAX_SMEAR * radius


def _rough(share: np.ndarray, at: tuple[float, float], radius: float) -> Smear | None:
    """Return a smear's rough place: the nearest blob with about a whole disc's area."""
    blobs = (cv2.blur(share, (3, 3)) > _MIN_SHARE).astype(np.uint8)
    _, labels, _, centers = cv2.connectedComponentsWithStats(blobs)
    masses = np.bincount(labels.ravel().astype(np.intp), share.ravel()) / (
        math.pi * radius * radius
    )
    likely = np.flatnonzero((masses > _MASSES[0]) & (masses < _MASSES[1]))
    likely = likely[likely > 0]  # the first is what is no blob
    if not len(likely):
        return None
    away = np.hypot(*(centers[likely] - at).T) / radius
    best = likely[np.argmin(np.abs(np.log(masses[likely])) + 0.1 * away)]
    own = cv2.dilate((labels == best).astype(np.uint8), np.ones((3, 3), np.uint8))
    smear = smear_of_moments(cv2.moments(np.clip(share, 0, 1) * own))
    return smear._replace(radius=min(radius, smear.radius))
