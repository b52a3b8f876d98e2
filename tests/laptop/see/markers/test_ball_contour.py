"""The contour of a ball: its place, and what is said of how far off it may be."""

import math

import cv2
import numpy as np
import pytest
from marker_views import marker_frame

from laptop.see.markers.ball_contour import fit_ball_contour, rim_width, scaled_misfit
from laptop.see.markers.learning import learn

U, V = 150.4, 110.3
SIZE = (300, 220)
EDGES = (-0.5, -0.5, SIZE[0] - 0.5, SIZE[1] - 0.5)
SKIN = (107, 143, 201)


def picture(radius, kind="ball", **options):
    options = {"size": SIZE, "jpeg": 90, "background": "#d0d0c8", **options}
    return marker_frame(kind, U, V, radius, **options)


def fitted(image, radius, du=0.0, dr=1.0):
    """The contour, sought from a place and with a size that are off."""
    color = learn("ball", picture(radius), (U, V), "ball").color
    return fit_ball_contour(image, U + du * radius, V, dr * radius, EDGES, color)


def off(contour):
    return math.hypot(contour.u - U, contour.v - V)


@pytest.mark.short(every=4)
@pytest.mark.parametrize("radius", [8, 16, 40, 70])
@pytest.mark.parametrize(("du", "dr"), [(0.0, 1.0), (0.12, 0.9), (-0.1, 1.1)])
def test_a_shaded_ball_is_placed_by_its_limb(radius, du, dr):
    contour = fitted(picture(radius), radius, du, dr)
    assert off(contour) < 0.01 * radius + 0.15
    assert contour.radius == pytest.approx(radius, rel=0.08)
    assert scaled_misfit(contour) < 0.03
    assert contour.contrast > 0.7


def hidden(radius, share):
    image = picture(radius)
    cv2.rectangle(image, (0, 0), (round(U - radius + 2 * radius * share), SIZE[1]), SKIN, -1)
    return image


def test_the_less_of_it_is_seen_the_less_it_is_trusted():
    misfits = [scaled_misfit(fitted(hidden(30, share), 30)) for share in (0.0, 0.2, 0.4, 0.6)]
    assert misfits == sorted(misfits)
    assert misfits[-1] > 3 * misfits[0]


def test_an_edge_that_hides_a_half_does_not_pull():
    assert off(fitted(hidden(30, 0.45), 30)) < 1


def test_the_more_blurred_it_is_the_less_it_is_trusted():
    contours = [fitted(picture(30, blur=blur), 30) for blur in (0.7, 4, 8)]
    misfits = [scaled_misfit(contour) for contour in contours]
    assert misfits == sorted(misfits)
    assert misfits[-1] > 3 * misfits[0]


@pytest.mark.short(every=4)
@pytest.mark.parametrize("direction", [0.0, 0.5, 1.0, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("radius", [20, 30])
def test_a_ball_that_moves_while_the_shutter_is_open_is_doubted(radius, direction):
    """Its rim is wide along its way only; one that is out of focus is as blurred all around."""
    way = 0.6 * radius
    motion = way * math.cos(direction), way * math.sin(direction)
    smeared = fitted(picture(radius, motion=motion), radius)
    assert scaled_misfit(smeared) > 0.066  # confidence below 0.9
    assert scaled_misfit(fitted(picture(radius, blur=2.5), radius)) < 0.02


def test_where_nothing_changes_there_is_no_limb():
    assert fitted(np.full((SIZE[1], SIZE[0], 3), 128, np.uint8), 30) is None


def test_a_square_does_not_fit():
    image = np.full((SIZE[1], SIZE[0], 3), 200, np.uint8)
    cv2.rectangle(image, (round(U) - 26, round(V) - 26), (round(U) + 26, round(V) + 26), 40, -1)
    assert scaled_misfit(fitted(image, 30)) > 4 * scaled_misfit(fitted(picture(30), 30))


def test_a_limb_beyond_the_picture_s_edge_counts_for_nothing():
    image = picture(30)[:, : round(U + 15)]
    color = learn("ball", picture(30), (U, V), "ball").color
    edges = (-0.5, -0.5, image.shape[1] - 0.5, SIZE[1] - 0.5)
    contour = fit_ball_contour(np.ascontiguousarray(image), U - 2, V, 29, edges, color)
    assert off(contour) < 0.5


@pytest.mark.parametrize("kind", ["disc", "ball"])
def test_a_rim_is_as_wide_as_the_blur_makes_it(kind):
    widths = [rim_width(picture(24, kind, blur=blur), U, V, 24) for blur in (0.7, 4, 8, 16)]
    assert widths == sorted(widths)
    assert widths[0] < 0.2
    # A Gaussian edge goes from three quarters to a quarter within 1.35 sigma.
    assert widths[1] == pytest.approx(1.35 * 4 / 24, abs=0.08)
    assert widths[-1] > 0.5
