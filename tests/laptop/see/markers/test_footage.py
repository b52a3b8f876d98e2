"""On real clips with truth: what no rendered picture has, and no claim about nothing."""

import json
import math
import statistics

import cv2
import numpy as np
import pytest
from places import FOOTAGE

from laptop.see.markers.learning import learn
from laptop.see.markers.tracker import Tracker
from shared.messages import LEAST_CONFIDENCE

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        not (FOOTAGE / "truth.json").is_file(), reason="the footage is not here: ../shared/footage"
    ),
]

GREEN, PALE = "giusenso_test1.mp4", "trflorian_ball2.mp4"
PICKS = {GREEN: (0, (208, 178)), PALE: (160, (551, 199))}
EMPTY = [*range(26), *range(465, 486), *range(790, 821), *range(965, 1004)]
"""Frames of the second clip in which there is no ball."""
LIGHTS = {
    "as it is": (1.0, 1.0, 1.0),
    "exposure x 0.3": (0.3, 0.3, 0.3),
    "exposure x 1.8": (1.8, 1.8, 1.8),
    "warmer": (1.4, 1.0, 1 / 1.4),
    "cooler": (1 / 1.4, 1.0, 1.4),
}
"""Factors of red, green and blue."""


def in_light(image, light):
    red, green, blue = light
    levels = np.arange(256)[:, None] * (blue, green, red)
    return cv2.LUT(image, np.clip(np.round(levels), 0, 255).astype(np.uint8)[None])


def frames(clip, wanted):
    """The wanted frames of a clip, in order: (index, image)."""
    capture = cv2.VideoCapture(str(FOOTAGE / clip))
    for index in range(max(wanted) + 1):
        assert capture.grab(), f"{clip} ends at frame {index}"
        if index in wanted:
            yield index, capture.retrieve()[1]
    capture.release()


def circles(clip):
    """Per frame the true centre (px) and radius."""
    truth = json.loads((FOOTAGE / "truth.json").read_text())["annotations"][clip]
    return {circle["frame"]: (circle["x"], circle["y"], circle["r"]) for circle in truth}


def tracked(clip, wanted):
    """What trackers say, one per light, decoding each frame once: light -> frame -> sighting."""
    at, pick = PICKS[clip]
    ((_, image),) = frames(clip, {at})
    marker = learn("ball", image, pick)
    assert marker.kind == "ball"
    trackers = {light: Tracker([marker]) for light in LIGHTS}
    said = {light: {} for light in LIGHTS}
    for index, image in frames(clip, wanted):
        for light, tracker in trackers.items():
            found = tracker.find(in_light(image, LIGHTS[light]), index / 25)
            said[light][index] = found["ball"]
    return said


@pytest.fixture(scope="module")
def green():
    """The glossy ball: every distinct frame."""
    distinct = json.loads((FOOTAGE / "distinct_frames.json").read_text())[GREEN]
    return tracked(GREEN, {*distinct, *circles(GREEN)})


@pytest.fixture(scope="module")
def pale():
    """The ball in fingers: the way to each frame with truth, and into those without a ball."""
    near = {k + d for k in (*circles(PALE), 465, 790, 965) for d in range(-8, 2)}
    return tracked(PALE, {*range(0, 1004, 12), *near, *EMPTY})


@pytest.fixture(params=[GREEN, PALE])
def clip(request):
    return request.param, request.getfixturevalue("green" if request.param == GREEN else "pale")


def is_sure(sighting):
    return sighting is not None and sighting.confidence >= LEAST_CONFIDENCE


def distance(sighting, circle):
    return math.hypot(sighting.u - circle[0], sighting.v - circle[1])


@pytest.mark.claims
@pytest.mark.parametrize("light", LIGHTS)
def test_the_ball_is_found_to_4_px_and_never_claimed_elsewhere(clip, light):
    name, said = clip
    errors = []
    for index, circle in circles(name).items():
        sighting = said[light][index]
        error = distance(sighting, circle) if sighting else math.inf
        errors.append(error)
        if is_sure(sighting):
            assert error <= 2 * circle[2], f"frame {index}"
    assert statistics.median(errors) <= 4
    # A median says nothing of the rest.
    assert sum(error <= 10 for error in errors) >= 0.8 * len(errors)


@pytest.mark.claims
@pytest.mark.parametrize("light", LIGHTS)
def test_in_most_frames_with_truth_it_is_sure(clip, light):
    name, said = clip
    sure = [k for k in circles(name) if is_sure(said[light][k])]
    assert len(sure) >= 0.8 * len(circles(name))


@pytest.mark.parametrize("light", LIGHTS)
def test_no_ball_is_claimed_where_there_is_none(pale, light):
    wrong = [k for k in EMPTY if is_sure(pale[light][k])]
    assert wrong == []


@pytest.mark.claims
@pytest.mark.parametrize("light", LIGHTS)
def test_the_lock_is_kept_through_all_of_a_clip_in_which_the_ball_is_always_there(green, light):
    sure = [s for s in green[light].values() if is_sure(s)]
    assert len(sure) >= 0.95 * len(green[light])
    # The ball's size hardly changes.
    radii = [s.radius for s in sure]
    assert max(radii) < 1.35 * statistics.median(radii)
    assert min(radii) > 0.65 * statistics.median(radii)


@pytest.mark.claims
@pytest.mark.parametrize("light", [light for light in LIGHTS if light != "as it is"])
def test_another_light_moves_what_is_found_by_little(clip, light):
    _, said = clip
    pairs = zip(said["as it is"].values(), said[light].values())
    moved = [math.hypot(one.u - other.u, one.v - other.v) for one, other in pairs if one and other]
    assert len(moved) > 0.75 * sum(map(bool, said["as it is"].values()))
    assert statistics.median(moved) < 3
    assert statistics.quantiles(moved, n=20)[18] < 10  # 95 %
