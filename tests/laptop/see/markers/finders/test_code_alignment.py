import cv2
import numpy as np
import pytest

from laptop.see.markers.finders import code_alignment
from laptop.see.markers.finders.aruco import detector
from laptop.see.markers.finders.code_alignment import align, project
from laptop.see.markers.markers import Marker
from laptop.see.markers.tracker import Tracker

DICTIONARY = cv2.aruco.DICT_4X4_50
SIZE = 120
FINE = 4
"""Rays a pixel and axis."""


def pose(side, tilt, rng):
    """A code's homography: `side` px wide, turned anyhow, tilted by `tilt` rad, near the middle."""
    focal, azimuth, roll = 500.0, *rng.uniform(0, 2 * np.pi, 2)
    across = tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0])
    turned = cv2.Rodrigues(across)[0] @ cv2.Rodrigues(np.array([0, 0, roll]))[0]
    middle = SIZE / 2 + rng.uniform(-2, 2, 2)
    lens = np.array([[focal, 0, middle[0]], [0, focal, middle[1]], [0, 0, 1]])
    return lens @ np.column_stack([turned[:, :2], (0, 0, 2 * focal / side)])


def photograph(code, homography, rng, blur=0.7, noise=3.0, shade=0.0, rim=1.0):
    """A picture of a code, ray by ray: no polygon, no warp of ours."""
    drawn = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(DICTIONARY), code, 6)
    at = (np.arange(SIZE * FINE) + 0.5) / FINE - 0.5
    rays = np.stack([*np.meshgrid(at, at), np.ones((len(at), len(at)))], axis=-1)
    x, y, w = np.moveaxis(rays @ np.linalg.inv(homography).T, -1, 0)
    x, y = x / w, y / w
    light = np.where(np.maximum(abs(x), abs(y)) < 1 + rim / 3, 0.85, 0.45)
    inside = np.maximum(abs(x), abs(y)) < 1
    column, row = (np.clip(((z + 1) * 3).astype(int), 0, 5) for z in (x, y))
    light[inside] = np.where(drawn[row, column] > 0, 0.85, 0.03)[inside]
    light = light.reshape(SIZE, FINE, SIZE, FINE).mean(axis=(1, 3))
    light = cv2.GaussianBlur(light, (0, 0), blur) * (1 + shade * np.linspace(-0.5, 0.5, SIZE))
    grey = 255 * (1.055 * light ** (1 / 2.4) - 0.055) + noise * rng.standard_normal(light.shape)
    encoded = cv2.imencode(".jpg", np.clip(np.round(grey), 0, 255), [cv2.IMWRITE_JPEG_QUALITY, 85])
    return cv2.imdecode(encoded[1], cv2.IMREAD_GRAYSCALE)


def found(grey, code):
    """Corners by the tracker's detector, with OpenCV's refinement; None if it is missed."""
    quads, numbers, _ = detector().detectMarkers(grey)
    at = [] if numbers is None else np.flatnonzero(numbers.ravel() == code)
    return quads[at[0]].reshape(4, 2).astype(float) if len(at) else None


def crossing(quad):
    """The place where a square's diagonals cross."""
    a, b, c, d = quad
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)[0]
    return a + share * (c - a)


def rms(errors):
    return np.sqrt(np.mean(np.square(errors)))


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("side", "tilt", "options", "limit"),
    [
        (32, 0.0, {}, 0.015),
        (36, 0.5, {}, 0.015),
        (48, 1.0, {}, 0.015),
        (44, 0.3, {"blur": 1.5}, 0.03),
        (40, 0.3, {"noise": 8.0}, 0.03),
        (40, 0.3, {"shade": 0.8}, 0.015),
        (36, 0.3, {"rim": 0.3}, 0.03),
        (90, 0.3, {}, 0.015),
    ],
)
def test_the_middle_is_placed_far_better_than_where_the_diagonals_cross(side, tilt, options, limit):
    rng = np.random.default_rng([side, 11])
    errors, crossings = [], []
    for code in range(5):
        truth = pose(side, tilt, rng)
        grey = photograph(code, truth, rng, **options)
        quad = found(grey, code)
        if quad is None:
            continue
        middle = truth[:2, 2] / truth[2, 2]
        homography, fits = align(grey, quad, code, DICTIONARY)
        assert fits
        errors.append(project(homography, np.zeros((1, 2)))[0] - middle)
        crossings.append(crossing(quad) - middle)
    assert len(errors) >= 4
    assert rms(errors) < limit
    assert rms(errors) < 0.5 * rms(crossings)


def test_all_corners_are_placed_and_in_the_detectors_order():
    rng = np.random.default_rng(5)
    truth = pose(48, 0.6, rng)
    grey = photograph(21, truth, rng)
    quad = found(grey, 21)
    homography, _ = align(grey, quad, 21, DICTIONARY)
    corners = project(homography, np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    assert np.abs(corners - quad).max() < 1.0
    turns = [np.roll(project(truth, code_alignment.SQUARE), k, axis=0) for k in range(4)]
    assert min(np.abs(corners - turn).max() for turn in turns) < 0.05


def test_where_the_pattern_is_not_that_of_the_code_the_detectors_corners_count():
    rng = np.random.default_rng(6)
    grey = photograph(3, pose(40, 0.2, rng), rng)
    quad = found(grey, 3)
    homography, fits = align(grey, quad, 17, DICTIONARY)
    assert not fits
    assert np.allclose(project(homography, code_alignment.SQUARE), quad, atol=1e-3)


@pytest.mark.parametrize("shade", [0, 255])
def test_corners_in_an_empty_picture_stay_where_they_are(shade):
    quad = np.array([(20, 20), (60, 22), (58, 61), (19, 57)], float)
    homography, fits = align(np.full((80, 80), shade, np.uint8), quad, 3, DICTIONARY)
    assert not fits
    assert np.allclose(project(homography, code_alignment.SQUARE), quad, atol=1e-3)


def test_corners_outside_of_the_picture_are_left_alone():
    quad = np.array([(200, 200), (240, 200), (240, 240), (200, 240)], float)
    _, fits = align(np.zeros((80, 80), np.uint8), quad, 3, DICTIONARY)
    assert not fits


def test_no_marker_is_lost_that_the_detector_finds():
    """Small and blurred ones too: where the pattern does not fit, the corners still count."""
    rng = np.random.default_rng(9)
    for side, blur in ((20, 0.7), (24, 1.0), (30, 1.8)):
        for code in range(4):
            grey = photograph(code, pose(side, 0.2, rng), rng, blur=blur)
            image = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
            seen = Tracker([Marker("m", "aruco", id=code)]).find(image, 0.0)["m"]
            quad = found(grey, code)
            assert seen or quad is None
            if quad is not None:
                assert np.hypot(*(crossing(quad) - (seen.u, seen.v))) < 1.5
