"""Circles in masks whose truth was drawn."""

import math

import cv2
import numpy as np
import pytest

from laptop.see.markers.circles import ellipse_of, find_circle

WIDTH, HEIGHT = 160, 120
X, Y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
RADII = [8, 12, 20, 31]
DIRECTIONS = [0.0, 0.7, 2.0, 3.5, 5.0]


def disc(u=70.3, v=60.6, radius=20.0):
    """Pixels whose centre lies in the circle."""
    return np.where(np.hypot(X - u, Y - v) <= radius, 255, 0).astype(np.uint8)


def beyond(direction, by=0.0, u=70.3, v=60.6):
    """Distance from a line through (u, v), moved by `by`, across a direction."""
    return (X - u) * math.cos(direction) + (Y - v) * math.sin(direction) - by


def found(mask, near=None, expected=None):
    height, width = mask.shape
    edges = (-0.5, -0.5, width - 0.5, height - 0.5)
    return find_circle(mask.copy(), edges, near, expected)


def off(circle, u=70.3, v=60.6):
    return math.hypot(circle.u - u, circle.v - v)


# Whole


@pytest.mark.parametrize("radius", [5, *RADII, 45])
def test_a_whole_disc_is_found_to_a_fraction_of_a_pixel(radius):
    draw = np.random.default_rng(radius)
    errors = []
    for _ in range(12):
        u, v = draw.uniform(58, 70, 2)
        circle = found(disc(u, v, radius))
        errors.append((circle.u - u, circle.v - v))
        # Outlines run through pixel centres: half a pixel inside the rim.
        assert -1 < circle.radius - radius < 0.3
        assert circle.arc == 1
        assert circle.fill > 0.93
        assert circle.stray < 0.12
        assert circle.visible == 1
    assert np.sqrt(np.mean(np.square(errors))) < 0.1
    assert np.abs(np.mean(errors, axis=0)).max() < 0.1


def test_the_picture_s_corner_does_not_pull_at_what_is_found():
    here = found(disc())
    window = disc()[30:100, 35:110]
    there = find_circle(window.copy(), (-35.5, -30.5, WIDTH - 35.5, HEIGHT - 30.5))
    assert (there.u + 35, there.v + 30) == pytest.approx((here.u, here.v))
    assert there[2:] == pytest.approx(here[2:])


# Partly hidden


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("radius", [12, 20, 31])
def test_of_a_disc_half_of_which_is_hidden_the_whole_is_found(radius, direction):
    mask = disc(radius=radius)
    mask[beyond(direction) > 0] = 0
    circle = found(mask)
    assert off(circle) < 0.08 * radius
    assert circle.radius == pytest.approx(radius, abs=0.08 * radius + 0.5)
    assert 0.4 < circle.arc < 0.7
    assert 0.4 < circle.fill < 0.6
    assert circle.stray < 0.05
    assert circle.visible == 1


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("radius", [12, 20, 31])
def test_a_stripe_across_a_disc_does_not_make_two_of_it(radius, direction):
    for by in (0, 0.3 * radius):
        mask = disc(radius=radius)
        mask[np.abs(beyond(direction, by)) < 0.15 * radius] = 0
        circle = found(mask)
        assert off(circle) < 0.1 * radius
        assert circle.radius == pytest.approx(radius, abs=0.1 * radius + 0.5)
        assert circle.fill > 0.7


def test_a_highlight_inside_costs_nothing_but_fill():
    mask = disc()
    mask[disc(64, 54, 6) > 0] = 0
    circle = found(mask)
    assert off(circle) < 0.1
    assert circle.arc == 1
    assert circle.fill == pytest.approx(0.91, abs=0.03)


def test_a_highlight_on_the_rim_does_not_dent_the_circle():
    mask = disc()
    mask[disc(70, 43, 7) > 0] = 0
    circle = found(mask)
    assert off(circle) < 0.5
    assert circle.radius == pytest.approx(20, abs=1)


# Neighbours


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_thread_to_a_neighbour_does_not_pull(direction):
    mask = disc() | disc(70.3 + 46 * math.cos(direction), 60.6 + 46 * math.sin(direction), 8)
    end = round(70.3 + 46 * math.cos(direction)), round(60.6 + 46 * math.sin(direction))
    cv2.line(mask, (70, 61), end, 255, 2)
    circle = found(mask)
    assert off(circle) < 0.15
    assert circle.radius == pytest.approx(20, abs=1)


@pytest.mark.parametrize("other", [False, True])
def test_of_two_that_hang_together_by_a_thread_the_nearer_is_found(other):
    mask = disc(45, 60, 20) | disc(115, 60, 20)
    mask[59:61, 45:115] = 255
    u = 115 if other else 45
    assert off(found(mask, (u + 3.0, 58.0), 20.0), u, 60) < 0.2


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_neighbour_that_touches_sticks_out_and_does_not_pull(direction):
    mask = disc() | disc(70.3 + 30 * math.cos(direction), 60.6 + 30 * math.sin(direction), 13)
    circle = found(mask)
    assert off(circle) < 0.6
    assert circle.radius == pytest.approx(20, abs=1.2)
    assert circle.stray > 0.2  # and it is told


def test_without_a_place_the_larger_of_two_is_found_with_one_the_nearer():
    mask = disc(40, 60, 20) | disc(110, 60, 12)
    assert off(found(mask), 40, 60) < 0.1
    assert off(found(mask, (108.0, 61.0), 12.0), 110, 60) < 0.1
    assert off(found(mask, (42.0, 61.0), 20.0), 40, 60) < 0.1


def test_what_is_far_away_is_taken_where_nothing_is_near():
    assert off(found(disc(), (150.0, 10.0), 20.0)) < 0.1


@pytest.mark.parametrize("expected", [8.0, 60.0])
def test_a_circle_of_quite_another_size_than_expected_is_none(expected):
    assert found(disc(), (70.0, 60.0), expected) is None


@pytest.mark.parametrize("expected", [15.0, 20.0, 28.0])
def test_a_circle_of_about_the_expected_size_is_found_as_it_is(expected):
    circle = found(disc(), (70.0, 60.0), expected)
    assert off(circle) < 0.1
    assert circle.radius == pytest.approx(20, abs=1)


# The picture's edge


@pytest.mark.parametrize(
    ("u", "v"), [(6, 60.2), (153, 60.2), (80, 0), (70, 112.5), (8, 8), (-8, 60)]
)
def test_a_disc_cut_by_the_picture_s_edge_is_found_where_it_is(u, v):
    mask = disc(u, v)
    seen = cv2.countNonZero(mask) / (math.pi * 20**2)
    circle = found(mask)
    assert off(circle, u, v) < 0.6
    assert circle.radius == pytest.approx(20, abs=1.2)
    assert circle.arc > 0.9  # all of the rim that could be seen
    assert circle.fill > 0.95
    assert circle.visible == pytest.approx(seen, abs=0.06)


# What is no disc


def quality(circle):
    return circle.arc * circle.fill / (1 + circle.stray)


@pytest.mark.parametrize("turn", [0.0, 0.4, math.pi / 4])
@pytest.mark.parametrize("radius", [12, 20, 31])
def test_a_square_is_not_as_good_as_a_disc(radius, turn):
    half = radius * math.sqrt(math.pi) / 2
    square = np.maximum(np.abs(beyond(turn)), np.abs(beyond(turn + math.pi / 2))) <= half
    circle = found(np.where(square, 255, 0).astype(np.uint8))
    assert quality(circle) < 0.85 * quality(found(disc(radius=radius)))


def test_a_bar_is_no_disc():
    bar = (np.abs(X - 75) < 40) & (np.abs(Y - 60) < 12)
    circle = found(np.where(bar, 255, 0).astype(np.uint8))
    assert circle is None or quality(circle) < 0.4


# Discs aslant


def within(a, b, turn, corners=False, u=70.3, v=60.6, finer=1):
    """The outline of an ellipse with half-axes a, b, or of the rectangle, in pixels of a grid."""
    x, y = np.meshgrid(*[(np.arange(size * finer) + 0.5) / finer - 0.5 for size in (WIDTH, HEIGHT)])
    x, y = x - u, y - v
    along, beside = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
    if corners:
        inside = (np.abs(along) < a) & (np.abs(beside) < b)
    else:
        inside = np.hypot(along / a, beside / b) < 1
    outlines, _ = cv2.findContours(
        np.where(inside, 255, 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    return max(outlines, key=cv2.contourArea)


@pytest.mark.short(every=4)
@pytest.mark.parametrize("turn", DIRECTIONS)
@pytest.mark.parametrize(("a", "b"), [(6, 3), (9, 3), (12, 3), (16, 4), (18, 6), (20, 20)])
def test_an_ellipse_is_even_however_coarse_the_pixels(a, b, turn):
    for finer, inward in ((1, 0.5), (4, 0.125)):
        ellipse = ellipse_of(within(a, b, turn, finer=finer), finer)
        assert ellipse.quality == 1
        assert off(ellipse) < inward
        assert ellipse.radius == pytest.approx(a - inward, abs=inward)
        across, down, skew = ellipse.covariance
        short = math.sqrt(across * down - skew**2) * 4 / ellipse.radius
        assert short == pytest.approx(b - inward, abs=inward)


@pytest.mark.short(every=3)
@pytest.mark.parametrize("turn", DIRECTIONS)
@pytest.mark.parametrize(("a", "b"), [(8, 4), (12, 4), (16, 4), (12, 6), (20, 6)])
def test_a_bar_is_not_even(a, b, turn):
    assert ellipse_of(within(a, b, turn, corners=True, finer=4), 4).quality == 0
    assert ellipse_of(within(a, b, turn, corners=True)).quality < 0.5


@pytest.mark.parametrize("turn", DIRECTIONS)
def test_what_is_too_slender_or_too_thin_is_no_disc(turn):
    for a, b in ((25, 4), (18, 3), (6, 1.5)):
        assert ellipse_of(within(a, b, turn)) is None


def test_noise_is_no_disc():
    draw = np.random.default_rng(0)
    for share in (0.02, 0.2, 0.5, 0.8):
        mask = np.where(draw.random((HEIGHT, WIDTH)) < share, 255, 0).astype(np.uint8)
        circle = found(mask)
        assert circle is None or quality(circle) < 0.75


@pytest.mark.parametrize(
    "size", [(1, 1), (1, 40), (40, 1), (2, 2), (2, 40), (4, 4), (6, 6), (120, 160)]
)
@pytest.mark.parametrize("full", [False, True])
def test_an_empty_or_a_full_mask_has_no_circle(size, full):
    mask = np.full(size, 255 * full, np.uint8)
    assert found(mask) is None
    assert found(mask, (0.0, 0.0), 5.0) is None


@pytest.mark.parametrize("pixels", [[(60, 70)], [(60, 70), (61, 71)], [(0, 0)], [(119, 159)]])
def test_single_pixels_are_no_circle(pixels):
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    for pixel in pixels:
        mask[pixel] = 255
    assert found(mask) is None


@pytest.mark.parametrize("side", [1, 2, 3, 4])
def test_a_speck_is_no_circle(side):
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[60 : 60 + side, 70 : 70 + side] = 255
    assert found(mask) is None


def test_a_few_pixels_beside_a_disc_do_not_pull():
    mask = disc()
    draw = np.random.default_rng(3)
    mask[draw.integers(0, HEIGHT, 60), draw.integers(0, WIDTH, 60)] = 255
    circle = found(mask)
    assert off(circle) < 0.2
    assert circle.radius == pytest.approx(20, abs=1)
