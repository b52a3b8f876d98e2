"""The share of a disc in each pixel: what surrounds it, near and far, and a JPEG's chroma."""

import math

import cv2
import numpy as np
import pytest

from laptop.bench.track_precision import APPEARANCES, PrecisionCase
from laptop.bench.track_rims import FRAMES, MAX_PRECISE_RMS, RimCase, rimmed
from laptop.see.markers.ball_contour import rim_width
from laptop.see.markers.discriminant import outline_at
from laptop.see.markers.learning import learn
from laptop.see.markers.tracker import Tracker

SEED = 31


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    ("colour", "ground"),
    [("green", "black"), ("red", "#404040"), ("blue", "#a98358"), ("purple", "#3c5a3c")],
)
@pytest.mark.parametrize(("radius", "rim"), [(8, 1.7), (16, 1.5), (16, 2.2), (32, 1.3), (32, 1.7)])
def test_a_printed_disc_is_seen_surely_and_precisely_on_dark_ground(colour, ground, radius, rim):
    """Its rim ends where the surroundings that are learned do: confidence was 0.50, or none."""
    result = RimCase(radius, rim, SEED).follow(colour, ground)
    assert not result.error
    assert (result.score.measured, result.score.lost) == (FRAMES, 0)
    assert result.score.rms <= MAX_PRECISE_RMS


@pytest.mark.parametrize("ground", ["black", "#404040", "#3c5a3c"])
@pytest.mark.parametrize(
    ("radius", "rim"), [(radius, rim) for radius in (8, 16, 32) for rim in (1.3, 1.7, 2.2)][1:]
)
def test_another_ground_behind_a_rim_is_no_blur(radius, rim, ground):
    image, (u, v) = rimmed("red", ground, radius, rim, (0.3, -0.2), (SEED, 0))
    # Half a px and more of blur, and half of the colours' pixels: 1.35 sigma, and 2 px of chroma.
    assert rim_width(image, u, v, radius) <= 2.8 / radius


def test_a_disc_far_from_where_it_was_is_centred_before_it_is_measured():
    """With the black ground on one side within its reach, it was a tenth of a pixel off."""
    places = [(0, 0), (0, 0), (5, 0), (-5, 0), (5, 0)]
    clip = [
        rimmed("red", "black", 16, 1.5, (u + 0.3, v - 0.2), (SEED, k))
        for k, (u, v) in enumerate(places)
    ]
    image, (u, v) = clip[0]
    tracker = Tracker([learn("disc", image, (round(u), round(v)), "disc")])
    for k, (image, (u, v)) in enumerate(clip):
        found = tracker.find(image, k / 30)["disc"]
        assert math.hypot(found.u - u, found.v - v) < 0.08
        assert found.confidence >= 0.9


def test_the_outline_around_a_place_is_not_that_of_what_lies_around_it():
    share = np.zeros((81, 81), np.uint16)
    cv2.circle(share, (40, 40), 36, 65535, 6)
    cv2.circle(share, (40, 40), 10, 65535, -1)
    assert cv2.contourArea(outline_at(share, 40, 40)) == pytest.approx(math.pi * 100, rel=0.1)
    assert cv2.contourArea(outline_at(share, 73, 40)) > 2000
    assert outline_at(np.zeros_like(share), 40, 40) is None


@pytest.mark.short(every=2)
@pytest.mark.parametrize("look", ["disc r 6, JPEG 90", "disc r 12, noise 8, JPEG 60"])
def test_chroma_that_a_jpeg_halves_counts_less_than_luma(look):
    """With all channels alike they are 0.030 and 0.057 px off here."""
    case = PrecisionCase(next(one for one in APPEARANCES if one.name == look), SEED, 20)
    rms = {result.method: result.score.rms for result in case.run()}
    assert rms["ours"] < (0.026 if "r 6" in look else 0.045)
    assert rms["ours"] < rms["SimpleBlob"]
