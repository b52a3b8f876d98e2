"""Learning a colour from where a person points."""

import colorsys
import json
import math
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from marker_views import marker_frame

from laptop.emulator.scene.optics import COLOURS, light_of, to_srgb
from laptop.emulator.scene.sensor import through_jpeg
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import (
    BadMarker,
    Color,
    Marker,
    hsv_mask,
    hsv_of,
    hue_distance,
    is_grey,
    read_markers,
    write_markers,
)
from laptop.see.markers.tracker import Tracker
from shared.messages import LEAST_CONFIDENCE
from tests.claims.rays import RayCase

VIVID = [word for word in COLOURS if word not in ("white", "grey", "black")]
U, V = 64.3, 60.2


def picture(kind="disc", radius=14, colour="red", u=U, v=V, **options):
    return marker_frame(kind, u, v, radius, colour, **{"jpeg": 90, **options})


def paint_of(colour):
    """Hue, saturation, value of the paint under white light."""
    return hsv_of(to_srgb(light_of(colour)).tolist())


def refusal(*args):
    with pytest.raises(BadMarker) as caught:
        learn("effector", *args)
    text = str(caught.value)
    assert text.startswith("effector: ")
    assert "\n" not in text
    return text


# What is learned


@pytest.mark.parametrize("colour", VIVID)
def test_a_picked_disc_has_its_colour_its_size_and_its_kind(colour):
    image = picture(colour=colour)
    marker = learn("effector", image, (64, 60))
    hue, saturation, value = paint_of(colour)
    assert (marker.name, marker.kind, marker.id) == ("effector", "disc", None)
    assert abs(hue_distance(marker.color.hue, hue)) < 5
    assert marker.color.saturation == pytest.approx(saturation, abs=0.06)
    assert marker.color.value == pytest.approx(value, abs=0.06)
    assert marker.radius == pytest.approx(14, abs=1)
    assert marker.color.tolerance >= 30
    red, green, blue = marker.color.scene
    assert (blue, green, red) == pytest.approx(image.mean(axis=(0, 1)), abs=3)


@pytest.mark.short(every=3)
@pytest.mark.parametrize("colour", VIVID)
@pytest.mark.parametrize("radius", [12, 25])
def test_a_shaded_marker_is_a_ball(colour, radius):
    marker = learn("goal", picture("ball", radius, colour), (64, 60))
    assert marker.kind == "ball"
    assert abs(hue_distance(marker.color.hue, paint_of(colour)[0])) < 6
    assert marker.radius == pytest.approx(radius, abs=0.1 * radius + 0.7)


@pytest.mark.parametrize("options", [{"gain": 0.3}, {"noise": 6.0}, {"blur": 2.0}, {"radius": 8}])
def test_an_even_marker_is_a_disc_although_the_picture_is_poor(options):
    assert learn("goal", picture(**options), (64, 60)).kind == "disc"


def test_the_kind_that_is_said_counts():
    assert learn("goal", picture("ball"), (64, 60), "disc").kind == "disc"
    assert learn("goal", picture("disc"), (64, 60), "ball").kind == "ball"


def test_what_was_learned_can_be_kept(tmp_path):
    for colour, gain in (("red", 1.0), ("#c8141e", 0.1), ("pink", 1.0)):
        marker = learn("goal", picture(colour=colour, gain=gain), (64, 60))
        write_markers(tmp_path / "markers.ini", {"goal": marker})
        stored = read_markers(tmp_path / "markers.ini")["goal"]
        assert stored.kind == marker.kind
        assert stored.radius == pytest.approx(marker.radius, rel=1e-3)
        assert stored.color.scene == marker.color.scene
        for key in ("hue", "saturation", "value", "tolerance"):
            assert getattr(stored.color, key) == pytest.approx(getattr(marker.color, key), rel=1e-3)


def test_the_gate_that_was_learned_holds_the_marker_and_nothing_else():
    image = picture("ball", 20, "green")
    marker = learn("goal", image, (64, 60))
    mask = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), marker.color) > 0
    y, x = np.mgrid[:128, :128]
    away = np.hypot(x - U, y - V)
    assert mask[away < 12].mean() > 0.8  # a highlight has no colour
    assert not mask[away > 23].any()


@pytest.mark.parametrize("hue", [344, 352, 358, 0, 3, 8])
def test_red_is_learned_on_either_side_of_hue_zero(hue):
    code = "#" + "".join(f"{round(255 * c):02x}" for c in colorsys.hsv_to_rgb(hue / 360, 0.8, 0.8))
    marker = learn("effector", picture(colour=code), (64, 60))
    assert abs(hue_distance(marker.color.hue, paint_of(code)[0])) < 5
    assert 0 <= marker.color.hue < 360
    assert marker.radius == pytest.approx(14, abs=1)


# Where people point


PLACES = (64, 60), (64.4, 59.6), (72, 60), (58, 68), (64, 50)
BOXES = (54, 50, 74, 70), (74, 70, 54, 50), (60, 58, 68, 62), (50, 46, 79, 75)


@pytest.mark.parametrize("pick", [*PLACES, *BOXES])
def test_any_place_on_the_marker_will_do_and_a_rectangle_from_any_corner_a_bit_too_large(pick):
    marker = learn("effector", picture(colour="blue"), pick)
    assert abs(hue_distance(marker.color.hue, paint_of("blue")[0])) < 5
    assert marker.radius == pytest.approx(14, abs=1)


def test_a_highlight_under_the_finger_does_not_spoil_the_colour():
    image = picture("ball", 22, "green")
    bright = np.argmax(image.min(axis=2))
    v, u = divmod(int(bright), 128)
    assert hsv_of(image[v, u].tolist())[1] < 0.55  # it is nearly white there
    marker = learn("goal", image, (u, v))
    assert marker.kind == "ball"
    assert abs(hue_distance(marker.color.hue, paint_of("green")[0])) < 6
    assert marker.color.saturation > 0.7
    assert marker.radius == pytest.approx(22, abs=2)


@pytest.mark.parametrize("pick", [(64, 60), (64, 55), (64, 66)])
def test_a_white_stripe_across_the_marker_leaves_its_colour_and_its_room(pick):
    image = picture(radius=18)
    image[57:64] = (230, 230, 230)
    marker = learn("effector", image, pick)
    assert abs(hue_distance(marker.color.hue, paint_of("red")[0])) < 6
    assert marker.color.saturation > 0.7
    assert marker.color.tolerance >= 25
    assert marker.radius == pytest.approx(18, abs=2)


@pytest.mark.parametrize(
    ("u", "v"), [(3, 60), (124, 60), (60, 2), (60, 125), (6, 6), (121, 122), (-4, 60)]
)
def test_a_marker_cut_by_the_picture_s_edge_can_be_picked(u, v):
    pick = min(max(u, 0), 127), min(max(v, 0), 127)
    marker = learn("effector", picture(u=u, v=v), pick)
    assert abs(hue_distance(marker.color.hue, paint_of("red")[0])) < 5
    assert marker.radius == pytest.approx(14, abs=2)


@pytest.mark.parametrize("pick", [(0, 0), (127, 0), (0, 127), (127, 127), (127.9, 127.9)])
def test_the_very_corner_of_the_picture_can_be_picked(pick):
    u, v = (min(max(part, 9), 118) for part in pick)
    marker = learn("effector", picture(u=u, v=v, radius=30), pick)
    assert abs(hue_distance(marker.color.hue, paint_of("red")[0])) < 5


OUTSIDE = (-1, 5), (5, -0.1), (128, 5), (5, 100), (1e9, 5), (math.nan, 5), (5, math.inf)
PARTLY_OUTSIDE = (5, 5, 128, 20), (5, -3, 20, 20), (5, 5, math.nan, 20)


@pytest.mark.parametrize("pick", [*OUTSIDE, *PARTLY_OUTSIDE])
def test_a_place_outside_the_picture_is_refused_with_the_picture_s_size(pick):
    image = marker_frame("disc", U, V, 14, size=(128, 100))
    text = refusal(image, pick)
    assert ",".join(f"{part:g}" for part in pick) in text
    assert "outside" in text
    assert "u from 0 to 127" in text
    assert "v from 0 to 99" in text


@pytest.mark.parametrize("ground", ["white", "grey", "black"])
@pytest.mark.parametrize("pick", [(20, 20), (0, 127), (5, 5, 30, 20)])
def test_where_there_is_no_colour_none_is_learned(ground, pick):
    text = refusal(picture(background=ground), pick)
    assert ",".join(f"{part:g}" for part in pick) in text
    assert "no colour" in text
    assert "saturation 0.0" in text or "saturation 0.1" in text


def test_what_is_too_dark_to_tell_is_refused():
    assert "no colour" in refusal(picture(gain=0.001, noise=1.0), (64, 60))


@pytest.mark.parametrize(
    ("size", "at"), [*(((side, side), 0) for side in (1, 2, 3, 5)), ((64, 80), 30)]
)
def test_of_a_picture_full_of_one_colour_nothing_is_learned_however_small_it_is(size, at):
    assert f"{at},{at}" in refusal(np.full((*size, 3), (20, 20, 200), np.uint8), (at, at))


@pytest.mark.parametrize("pick", [(64, 60), (20, 60), (10, 56, 120, 64)])
def test_a_long_bar_is_no_marker(pick):
    image = picture(background="white", radius=1)
    image[54:67, 5:124] = to_srgb(light_of("red"))
    assert "nothing round" in refusal(image, pick)


def test_of_coloured_noise_nothing_is_learned():
    image = np.random.default_rng(1).integers(0, 256, (64, 80, 3), dtype=np.uint8)
    refusal(image, (30, 30))


# The neighbours


def test_the_tolerance_is_less_beside_a_similar_colour():
    alone = learn("effector", picture(), (64, 60)).color
    image = picture(background=picture(u=94, v=60, colour="orange"))
    beside = learn("effector", image, (64, 60))
    orange = hue_distance(paint_of("orange")[0], beside.color.hue)
    assert beside.color.tolerance < min(alone.tolerance, orange - 5)
    assert beside.radius == pytest.approx(14, abs=1)
    mask = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), beside.color) > 0
    assert mask[53:68, 57:72].all()
    assert mask[50:70, 86:104].mean() < 0.02


@pytest.mark.parametrize(
    ("colour", "ground"), [("red", "orange"), ("orange", "red"), ("lime", "yellow")]
)
def test_a_marker_on_a_ground_of_similar_hue_is_told_apart_from_it(colour, ground):
    image = picture(colour=colour, background=ground, radius=18)
    color = learn("effector", image, (64, 60)).color
    assert abs(hue_distance(color.hue, paint_of(colour)[0])) < 6
    mask = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), color) > 0
    assert mask[52:68, 56:72].mean() > 0.98
    assert mask[:30].mean() < 0.02


def test_the_tolerance_is_less_where_a_similar_colour_is_near_but_apart():
    alone = learn("effector", picture(), (64, 60)).color
    image = picture(background=picture(u=100, v=60, radius=16, colour="orange"))
    color = learn("effector", image, (64, 60)).color
    orange = hue_distance(paint_of("orange")[0], color.hue)
    assert 8 <= color.tolerance < min(alone.tolerance, 0.7 * orange)
    mask = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), color) > 0
    assert mask[53:68, 57:72].all()
    assert mask[50:70, 90:110].mean() < 0.02


def test_a_far_away_thing_of_similar_colour_takes_no_room():
    image = picture(background=picture(u=20, v=20, radius=8, colour="orange"))
    assert learn("effector", image, (64, 60)).color.tolerance >= 30


def test_learning_is_pure():
    image = picture("ball", 20, "green")
    before = image.copy()
    first = learn("goal", image, (64, 60))
    assert isinstance(first.color, Color)
    assert learn("goal", image, (64, 60)) == first
    assert (image == before).all()


# What is blurred


@pytest.mark.parametrize("kind", ["disc", "ball"])
@pytest.mark.parametrize("radius", [10, 14, 20])
@pytest.mark.parametrize("colour", ["red", "green"])
def test_a_marker_out_of_focus_is_refused_with_what_to_do(kind, radius, colour):
    """It would be learned half as large again, and pale."""
    text = refusal(picture(kind, radius, colour, blur=0.9 * radius), (64, 60), kind)
    assert "is blurred" in text
    assert "pick it in a frame where it is at rest and in focus" in text


@pytest.mark.short(every=6)
@pytest.mark.parametrize("colour", ["red", "green", "orange"])
@pytest.mark.parametrize("kind", ["disc", "ball"])
@pytest.mark.parametrize(
    ("radius", "blurred"), [(8, {"blur": 4}), (14, {"blur": 4.7}), (24, {"blur": 8})], ids=str
)
def test_what_was_learned_of_a_blurred_marker_finds_it_sharp(kind, colour, radius, blurred):
    """From its core, for it is pale at its rim: else a ball was lost in all frames after it."""
    image = picture(kind, radius, colour, **blurred)
    marker = learn("effector", image, (64, 60), kind)
    tracker = Tracker([marker])
    seen = [
        tracker.find(picture(kind, radius, colour, u=64 + 3 * k, seed=k), k / 30)["effector"]
        for k in range(6)
    ]
    assert sum(bool(one) and one.confidence >= LEAST_CONFIDENCE for one in seen) >= 5


@pytest.mark.long
@pytest.mark.parametrize("seed", [5, 8, 9, 5003, 5005])
def test_a_ball_that_shines_in_its_middle_is_not_blurred(seed):
    """Its shine fades all the way to the rim, which is as sharp as any."""
    (image, (u, v, radius), _), *_ = RayCase(seed).pictures()
    marker = learn("goal", image, (round(u), round(v)), "ball")
    assert marker.radius == pytest.approx(radius, rel=0.1)


@pytest.mark.parametrize("kind", ["disc", "ball"])
@pytest.mark.parametrize("radius", [8, 14, 24])
def test_a_little_blur_and_a_little_motion_are_no_trouble(kind, radius):
    for options in ({"blur": 1.5}, {"motion": (0.4 * radius, 0)}, {"gain": 3.0}):
        marker = learn("effector", picture(kind, radius, **options), (64, 60), kind)
        assert marker.radius == pytest.approx(radius, rel=0.2)


@pytest.mark.parametrize("jpeg", [0, 75])
def test_a_picture_in_grey_is_said_to_be_one(jpeg):
    """No pick in it helps, wherever it is."""
    grey = cv2.cvtColor(picture("disc", 14, jpeg=0), cv2.COLOR_BGR2GRAY)
    image = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    if jpeg:
        image = through_jpeg(image, jpeg)
    text = refusal(image, (64, 60), "disc")
    assert "no colour at 64,60, nor anywhere else in this picture" in text
    assert "if the camera or film is grey, track aruco:ID" in text
    tracker = Tracker([Marker("tip", "disc", Color(0, 0.8, 0.8, 20))])
    assert tracker.find(image, 0.0)["tip"] is None
    assert tracker.why["tip"] == "no colours in the picture"


def test_where_a_camera_s_noise_has_colours_it_is_not_grey():
    noise = np.random.default_rng(3).normal(0, 2, (120, 160, 3))
    image = np.clip(np.round(128 + noise), 0, 255).astype(np.uint8)
    assert "pick the middle of a coloured marker" in refusal(image, (64, 60), "disc")
    assert not is_grey(np.zeros((120, 160, 3), np.uint8))


# A pick is tried at once


def found_again(marker, image):
    return Tracker([marker]).find(image, 0.0)[marker.name]


@pytest.mark.parametrize(
    ("colour", "ground"),
    [
        ("orange", "#5d4a40"),
        ("orange", "#b08a5c"),
        ("red", "#6a4038"),
        ("green", "#4a6a50"),
        ("blue", "#5a6c8c"),
        ("yellow", "#a8985c"),
    ],
)
@pytest.mark.parametrize("radius", [14, 30])
def test_a_ball_on_a_duller_ground_of_its_own_hue_is_found_in_that_very_picture(
    colour, ground, radius
):
    image = picture("ball", radius, colour, background=ground)
    marker = learn("effector", image, (64, 60))
    seen = found_again(marker, image)
    assert seen.confidence >= LEAST_CONFIDENCE
    assert math.hypot(seen.u - U, seen.v - V) < 0.5
    assert marker.radius == pytest.approx(radius, rel=0.15)
    dull = hsv_mask(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), marker.color)[:20] > 0
    assert dull.mean() < 0.02


@pytest.mark.parametrize("colour", ["#0c1438", "#10301a", "#3c0c10"])
def test_where_a_dark_ball_shines_the_whole_ball_is_picked(colour):
    image = picture("ball", 30, colour)
    v, u = np.unravel_index(np.argmax(cv2.GaussianBlur(image, (0, 0), 2)[..., 1]), image.shape[:2])
    assert hsv_of(image[v, u].tolist())[1] < 0.3
    marker = learn("goal", image, (int(u), int(v)))
    assert marker.radius == pytest.approx(30, rel=0.1)
    seen = found_again(marker, image)
    assert seen.confidence >= 0.9
    assert math.hypot(seen.u - U, seen.v - V) < 0.5


def test_beside_a_marker_its_shine_is_no_excuse():
    """What lies within the wider reach of a pick, but not around it, was not pointed at."""
    assert "no colour" in refusal(picture("disc", 12), (round(U) + 22, round(V)))


def why_not(image, kind=None, pick=(64, 60)):
    return refusal(image, pick, kind)


def test_what_would_not_be_found_again_is_refused_with_the_reason():
    assert "is all around it, too, on 100 % of the picture" in why_not(
        np.full((120, 128, 3), (40, 120, 220), np.uint8)
    )
    assert "it is too dark" in why_not(picture(colour="red", gain=0.02))


def test_a_stretched_ball_is_refused_with_how_to_scale_the_film():
    ball = picture("ball", 24, noise=0)
    tall = why_not(cv2.resize(ball, None, fx=1, fy=1.5), "ball", (64, 90))
    assert "1.5 times as high as a ball is" in tall
    assert float(re.search(r"scale=([0-9.]+)\*iw:ih ", tall)[1]) == pytest.approx(1.5, abs=0.1)
    wide = why_not(cv2.resize(ball, None, fx=1.5, fy=1), "ball", (96, 60))
    assert float(re.search(r"scale=iw:([0-9.]+)\*ih ", wide)[1]) == pytest.approx(1.5, abs=0.1)
    turned = cv2.getRotationMatrix2D((64, 90), 45, 1)
    aslant = cv2.warpAffine(cv2.resize(ball, None, fx=1, fy=1.5), turned, (128, 180),
                            borderMode=cv2.BORDER_REPLICATE)  # fmt: skip
    text = why_not(aslant, "ball", (64, 90))
    assert "1.5 times as long as wide" in text
    assert "ffmpeg" not in text


def test_a_stretched_disc_is_one_seen_from_the_side():
    wide = cv2.resize(picture("disc", 24), None, fx=1.5, fy=1)
    assert learn("effector", wide, (96, 60)).kind == "disc"


FILMS = Path(__file__).parents[4] / "shared" / "inputs" / "films"


@pytest.mark.skipif(not FILMS.is_dir(), reason=f"no pictures in {FILMS}")
@pytest.mark.parametrize(
    "file", [path.name for path in sorted(FILMS.glob("*.png"))] if FILMS.is_dir() else []
)
def test_pictures_that_failed_once(file):
    truth = json.loads((FILMS / "expected.json").read_text())[file]
    image = cv2.imread(str(FILMS / file))
    marker = learn("effector", image, tuple(truth["pick"]))
    seen = found_again(marker, image)
    assert seen.confidence >= 0.9
    ball = file.startswith("orange")
    assert marker.kind == ("ball" if ball else "disc")
    if ball:
        assert "as a ball is" in refusal(image, tuple(truth["pick"]), "disc")
    off = math.hypot(seen.u - truth["truth"][0], seen.v - truth["truth"][1])
    assert off < (0.5 if ball else 0.05)
    assert marker.radius == pytest.approx(truth["r"], rel=0.15)


def striped(radius, direction, offset, half_width=0.2):
    """A ball with a pale stripe across, all its radii and half of its width in parts of its own."""
    image = picture("ball", radius, "green", jpeg=0, noise=0)
    v, u = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    along = ((u - U) * math.cos(direction) + (v - V) * math.sin(direction)) / radius
    ball = np.hypot(u - U, v - V) < radius
    image[ball & (np.abs(along - offset) < half_width)] = (210, 222, 226)
    return through_jpeg(cv2.GaussianBlur(image, (0, 0), 0.6), 90)


@pytest.mark.parametrize("direction", [0.0, 0.7, 1.6, 2.5])
@pytest.mark.parametrize(("radius", "offset"), [(24, 0.0), (24, 0.35), (45, 0.2), (45, -0.4)])
def test_a_striped_ball_is_learned_and_found_with_its_stripe(radius, direction, offset):
    image = striped(radius, direction, offset)
    marker = learn("goal", image, (64, 60), "ball")
    assert marker.radius == pytest.approx(radius, rel=0.1)
    seen = found_again(marker, image)
    assert seen.confidence >= 0.9
    assert math.hypot(seen.u - U, seen.v - V) < 0.02 * radius
