"""A disc that moves during the exposure, against the mean of many sharp pictures."""

import math

import cv2
import numpy as np
import pytest

from laptop.see.markers.learning import learn
from laptop.see.markers.smear import Smear, fit_smear, smear_misfit, smear_of_moments, smear_share
from laptop.see.markers.tracker import Tracker

WIDTH, HEIGHT = 200, 160
SUBFRAMES = 40
RED, GREY = (30, 20, 200), (150, 150, 150)


def sharp(u, v, radius):
    """The share of a disc in each pixel, by its distance from the rim."""
    us, vs = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return np.clip(radius + 0.5 - np.hypot(us - u, vs - v), 0, 1)


def mean_share(u, v, radius, motion, times):
    """The mean of sharp discs at these times, -0.5 to 0.5, on a way whose middle is at 0."""
    return np.mean([sharp(u + motion[0] * t, v + motion[1] * t, radius) for t in times], axis=0)


def even(motion):
    return (np.arange(SUBFRAMES) + 0.5) / SUBFRAMES - 0.5


def photo(u, v, radius, motion=(0.0, 0.0), ground=None, seed=0, times=None, noise=3.0):
    """A picture in which light adds up, and only then becomes codes."""
    still = not any(motion)
    times = [0.0] if still else even(motion) if times is None else times
    share = mean_share(u, v, radius, motion, times)[..., None]
    behind = np.full((HEIGHT, WIDTH, 3), GREY) if ground is None else ground
    light = (behind / 255) ** 2.2 * (1 - share) + (np.array(RED) / 255) ** 2.2 * share
    codes = 255 * cv2.GaussianBlur(light, (0, 0), 0.7) ** (1 / 2.2)
    codes += noise * np.random.default_rng(seed).standard_normal(codes.shape)
    return np.clip(np.round(codes), 0, 255).astype(np.uint8)


def clutter(seed):
    """A ground full of bricks in colours other than the marker's."""
    rng = np.random.default_rng(seed)
    ground = np.full((HEIGHT, WIDTH, 3), GREY, np.uint8)
    colours = [(180, 80, 18), (60, 143, 15), (15, 197, 242), (235, 235, 235), (25, 25, 25)]
    for _ in range(15):
        u, v = rng.integers(WIDTH), rng.integers(HEIGHT)
        corner = int(u + rng.integers(5, 25)), int(v + rng.integers(5, 25))
        cv2.rectangle(ground, (int(u), int(v)), corner, colours[rng.integers(5)], -1)
    return ground


def followed(radius, ground=None):
    """A tracker that has seen the disc at rest in the middle, in two pictures."""
    image = photo(100, 80, radius, ground=ground)
    tracker = Tracker([learn("tip", image, (100, 80), "disc")])
    for k in range(2):
        tracker.find(photo(100, 80, radius, ground=ground, seed=k), k / 30)
    return tracker


def along(direction, length):
    return length * math.cos(math.radians(direction)), length * math.sin(math.radians(direction))


def errors(seen, truth, motion):
    """Distances of a sighting from the truth along the way and across it, px."""
    du, dv = seen.u - truth[0], seen.v - truth[1]
    length = math.hypot(*motion)
    return (
        abs(du * motion[0] + dv * motion[1]) / length,
        abs(dv * motion[0] - du * motion[1]) / length,
    )


# The model


@pytest.mark.parametrize("motion", [(12.0, 5.0), (-24.0, 18.0), (0.0, 40.0)])
def test_a_smear_is_the_mean_of_the_discs_on_its_way(motion):
    smear = Smear(100.3, 80.4, *motion, 10)
    mean = mean_share(100.3, 80.4, 10, motion, even(motion)).astype(np.float32)
    # Their rims are a pixel wide, the model's is as soft as a lens makes it.
    soft = cv2.GaussianBlur(mean, (0, 0), 0.74)
    assert np.abs(smear_share(smear, mean.shape) - soft).max() < 0.03
    assert smear_share(smear, mean.shape).sum() == pytest.approx(math.pi * 100, rel=0.01)


@pytest.mark.parametrize("length", [12, 20, 30, 40])
@pytest.mark.parametrize("radius", [8, 14, 20])
def test_moments_and_a_fit_find_it_again(radius, length):
    motion = along(radius + length, length)
    share = mean_share(100.3, 80.4, radius, motion, even(motion)).astype(np.float32)
    start = smear_of_moments(cv2.moments(share))
    assert (start.u, start.v) == pytest.approx((100.3, 80.4), abs=0.02)
    assert start.length == pytest.approx(length, abs=0.5)
    rough = start._replace(u=start.u + 3, v=start.v - 2, radius=0.9 * radius)
    found = fit_smear(share, rough)
    assert (found.u, found.v) == pytest.approx((100.3, 80.4), abs=0.05)
    assert found.length == pytest.approx(length, abs=0.5)
    assert found.radius == pytest.approx(radius, abs=0.2)
    assert smear_misfit(share, found) < 0.05


def test_a_disc_aslant_at_rest_is_no_smear():
    us, vs = np.meshgrid(np.arange(101) - 50.0, np.arange(101) - 50.0)
    share = np.clip(12.5 - np.hypot(us, vs / 0.8), 0, 1).astype(np.float32)
    start = smear_of_moments(cv2.moments(share))
    assert start.length > 10
    assert fit_smear(share, start).length < 6


# In pictures


@pytest.mark.short(every=4)
@pytest.mark.parametrize("length", [15, 20, 30, 40])
@pytest.mark.parametrize(("radius", "direction"), [(8, 20), (12, 100), (12, 225), (20, 310)])
def test_a_smeared_disc_is_found_to_a_third_of_a_pixel_across_its_way(radius, direction, length):
    motion = along(direction, length)
    seen = followed(radius).find(photo(101.3, 79.6, radius, motion), 2 / 30)["tip"]
    off, across = errors(seen, (101.3, 79.6), motion)
    assert across < 0.15
    assert off < 0.6
    assert seen.confidence >= 0.8 or length < radius
    assert seen.radius == pytest.approx(radius, rel=0.08)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_smear_over_bricks_of_other_colours_is_found_too(seed):
    ground, motion = clutter(seed), along(80 * seed, 30)
    seen = followed(12, ground).find(photo(101.3, 79.6, 12, motion, ground), 2 / 30)["tip"]
    off, across = errors(seen, (101.3, 79.6), motion)
    assert across < 0.3
    assert off < 1
    assert 0.5 <= seen.confidence < 0.9


def test_it_is_followed_while_it_starts_to_move_and_stops():
    tracker, u = followed(10), 100.0
    for k, speed in enumerate((0, 12, 30, 30, 12, 0)):
        u += speed / 2
        seen = tracker.find(photo(u, 80, 10, (speed, 0.0), seed=k), (k + 2) / 30)["tip"]
        u += speed / 2
        truth = u - speed / 2
        assert seen.confidence >= 0.5
        assert abs(seen.v - 80) < 0.3
        assert abs(seen.u - truth) < 1


def test_an_uneven_way_moves_the_middle_and_is_not_called_certain():
    # From rest, evenly faster: half of the time the disc is in the first quarter of the way.
    motion, time = (30.0, 0.0), (np.arange(SUBFRAMES) + 0.5) / SUBFRAMES
    seen = followed(12).find(photo(100, 80, 12, motion, times=time**2 - 0.5), 2 / 30)["tip"]
    middle = 100 + 30 * (0.25 - 0.5)
    off, across = errors(seen, (middle, 80), motion)
    assert across < 0.3
    assert seen.confidence < 0.9 or off < 0.1 * 12 + 1


@pytest.mark.parametrize("side", [(40, 20), (36, 18), (50, 12)])
def test_a_brick_in_its_place_is_no_smear(side):
    tracker = followed(12)
    brick = np.full((HEIGHT, WIDTH, 3), GREY, np.uint8)
    corner = 100 - side[0] // 2, 80 - side[1] // 2
    cv2.rectangle(brick, corner, (corner[0] + side[0], corner[1] + side[1]), RED, -1)
    seen = tracker.find(photo(-99, -99, 1, ground=brick), 2 / 30)["tip"]
    assert seen is None or seen.confidence <= 0.7


@pytest.mark.parametrize("hidden", [0.4, 0.6, 0.9])
def test_a_disc_of_which_a_hand_hides_a_part_is_no_smear(hidden):
    tracker, image = followed(12), photo(100, 80, 12)
    image[:, round(100 + 12 - 24 * hidden) :] = (110, 150, 200)
    seen = tracker.find(image, 2 / 30)["tip"]
    assert seen is None or seen.confidence <= 0.7
