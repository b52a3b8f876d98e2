"""Markers in rendered pictures, of which the truth is known to a thousandth of a pixel."""

import itertools
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from arms import PLANAR as ARM
from marker_views import marker_frame

from laptop.emulator.scene.optics import Box, coverage, light_of, to_srgb
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.sensor import through_jpeg
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.markers.kinds import COLOR_KINDS, KINDS
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import Marker, read_spec
from laptop.see.markers.tracker import FINDERS, Tracker
from shared.messages import LEAST_CONFIDENCE

WIDTH, HEIGHT = 144, 108
U, V = 70.3, 54.6
NAME = "effector"


def picture(kind="disc", u=U, v=V, radius=12, colour="red", **options):
    return marker_frame(
        kind, u, v, radius, colour, **{"size": (WIDTH, HEIGHT), "jpeg": 90, **options}
    )


def empty(**options):
    return picture(u=-500, **options)


def learned(kind="disc", radius=12, colour="red", **options):
    return learn(NAME, picture(kind, U, V, radius, colour, **options), (U, V), kind)


def follow(marker, pictures, fps=30):
    """Sightings of one marker, and why there is none, frame by frame."""
    tracker = Tracker([marker])
    seen, why = [], []
    for k, image in enumerate(pictures):
        seen.append(tracker.find(image, k / fps)[marker.name])
        why.append(tracker.why[marker.name])
    return seen, why


def off(sighting, u=U, v=V):
    return math.hypot(sighting.u - u, sighting.v - v)


def rms(seen, places):
    """Per axis, px; all must have been seen."""
    errors = [(s.u - u, s.v - v) for s, (u, v) in zip(seen, places)]
    return math.sqrt(np.mean(np.square(errors)))


def claims(seen):
    return [s.confidence for s in seen if s and s.confidence >= LEAST_CONFIDENCE]


def around(count, reach=24):
    """Places on an ellipse, never on the pixel grid."""
    return [
        (U + reach * math.cos(0.31 * k), V + 0.7 * reach * math.sin(0.31 * k)) for k in range(count)
    ]


def followed(marker, count=16, reach=24, **looks):
    """What `follow` tells of a marker in places around the middle, and the places."""
    places = around(count, reach)
    pictures = [picture(u=u, v=v, seed=k, **looks) for k, (u, v) in enumerate(places)]
    return (*follow(marker, pictures), places)


def test_there_is_a_finder_for_every_kind():
    assert set(FINDERS) == set(KINDS)


# How well


@pytest.mark.short(every=3, rest="claims")
@pytest.mark.parametrize(
    ("radius", "options", "limit"),
    [
        (12, {}, 0.03),
        (6, {}, 0.05),
        (20, {}, 0.03),
        (12, {"noise": 8.0, "jpeg": 70}, 0.06),
        (12, {"background": "black"}, 0.03),
        (12, {"background": "white"}, 0.03),
        (12, {"background": "#a98358"}, 0.03),
        (12, {"colour": "green"}, 0.05),
        (12, {"colour": "blue"}, 0.03),
        (12, {"motion": (8, 3)}, 0.04),
    ],
    ids=str,
)
def test_a_flat_disc_is_placed_to_a_few_hundredths_of_a_pixel(radius, options, limit):
    looks = {"radius": radius, **options}
    seen, why, places = followed(learned(**looks), **looks)
    assert set(why) == {""}
    assert rms(seen, places) <= limit
    assert min(s.confidence for s in seen) >= 0.9
    assert all(s.radius == pytest.approx(radius, rel=0.15) for s in seen)


def test_a_word_is_as_precise_as_a_pick():
    seen, _, places = followed(read_spec(NAME, "red"))
    assert rms(seen, places) <= 0.03
    assert len(claims(seen)) == 16


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_an_edge_in_the_background_pulls_by_less_than_a_pixel(kind):
    ground = np.full((HEIGHT, WIDTH, 3), 230, np.uint8)
    ground[:, WIDTH // 2 :] = 40
    looks = {"kind": kind, "background": ground}
    seen, _, places = followed(learned(**looks), **looks)
    assert rms(seen, places) <= 0.5
    assert len(claims(seen)) == 16


@pytest.mark.parametrize("radius", [12, 20])
@pytest.mark.parametrize("colour", ["red", "green"])
def test_a_shaded_ball_with_a_highlight_is_placed_to_half_a_pixel(radius, colour):
    looks = {"kind": "ball", "radius": radius, "colour": colour}
    seen, why, places = followed(learned(**looks), **looks)
    assert set(why) == {""}
    assert rms(seen, places) <= 0.4
    assert len(claims(seen)) == 16


def test_an_aruco_marker_is_placed_to_a_tenth_of_a_pixel():
    looks = {"kind": "aruco", "radius": 20, "number": 7, "background": "white"}
    seen, why, places = followed(read_spec(NAME, "aruco:7"), 12, **looks)
    assert set(why) == {""}
    assert rms(seen, places) <= 0.12
    assert len(claims(seen)) == 12


def test_an_aruco_marker_of_another_number_is_not_it():
    pictures = [picture("aruco", radius=20, number=8)] * 2
    why = "no ArUco marker 7, only 8"
    assert follow(read_spec(NAME, "aruco:7"), pictures) == ([None] * 2, [why] * 2)


def test_a_disc_seen_aslant_is_an_ellipse_and_its_centre_is_found():
    ground = picture(noise=0, jpeg=0, radius=16)
    for squeeze in (0.5, 0.7):
        turned = cv2.getRotationMatrix2D((U, V), 30, 1.0) @ np.array(
            [[1, 0, 0], [0, squeeze, V * (1 - squeeze)], [0, 0, 1]]
        )
        image = cv2.warpAffine(ground, turned, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE)
        seen, _ = follow(read_spec(NAME, "red"), [image] * 3)
        assert max(map(off, seen)) < 0.2
        assert len(claims(seen)) == 3


@pytest.mark.short(every=3)
@pytest.mark.parametrize("colour", ["#c8141e", "#c8143c", "#c83214", "#d01010"])
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_red_just_works_on_either_side_of_hue_zero(kind, colour):
    for marker in (learned(kind, colour=colour), read_spec(NAME, f"{kind}:red")):
        seen, _ = follow(marker, [picture(kind, colour=colour, seed=k) for k in range(3)])
        assert len(claims(seen)) == 3
        assert max(map(off, seen)) < (0.2 if kind == "disc" else 1)


def test_a_fast_marker_is_followed():
    places = [(26 + 13 * k, 30 + 5 * k) for k in range(8)]
    pictures = [picture(u=u, v=v, motion=(6, 2), seed=k) for k, (u, v) in enumerate(places)]
    seen, _ = follow(learned(), pictures)
    assert rms(seen, places) < 0.1
    assert len(claims(seen)) == 8


def test_a_twin_that_follows_is_not_taken_for_it():
    """It comes to where the marker was a frame ago: the marker is expected farther on."""
    size = (288, 72)
    places = [(24.2 + 26 * k, 36.4) for k in range(10)]
    pictures = [picture(u=u, v=v, radius=9, size=size, seed=k) for k, (u, v) in enumerate(places)]
    for k in range(5, 10):
        twin = picture(u=places[k - 1][0], v=36.4, radius=9, size=size, noise=0, jpeg=0, blur=0)
        pictures[k] = picture(u=places[k][0], v=36.4, radius=9, background=twin, seed=k)
    seen, _ = follow(learned(radius=9), pictures)
    assert all(off(s, *place) < 1 for s, place in zip(seen, places))


# Several


def test_several_markers_of_several_kinds_are_found_in_one_frame():
    size = (288, 216)
    places = {"red": (60, 50), "green": (200, 60), "blue": (70, 160), "code": (210, 150)}
    image = np.full((216, 288, 3), 128, np.uint8)
    for name, (u, v) in places.items():
        kind = "aruco" if name == "code" else "ball" if name == "green" else "disc"
        radius = 20 if name == "code" else 13
        colour = "red" if name == "code" else name
        image = marker_frame(kind, u, v, radius, colour, image, size, noise=1.0, number=4)
    image = through_jpeg(image, 90)
    markers = [
        read_spec("red", "red"),
        read_spec("green", "ball:green"),
        read_spec("blue", "disc:blue"),
        read_spec("code", "aruco:4"),
        read_spec("none", "yellow"),
    ]
    tracker = Tracker(markers)
    for k in range(3):
        found = tracker.find(image, k / 30)
        assert list(found) == [marker.name for marker in markers]
        assert found.pop("none") is None
        assert all(off(found[name], *place) < 0.6 for name, place in places.items())
        assert len(claims(found.values())) == 4
        why = dict(tracker.why)
        assert why.pop("none") == "nothing of this colour"
        assert set(why.values()) == {""}


def test_a_tracker_of_nothing_finds_nothing():
    assert Tracker([]).find(picture(), 0.0) == {}


def filmed(text, count, step=1, still=False):
    """Frames of the arm at work, where its markers are, and how much of them can be seen."""
    poses = ScriptedPoses(
        ARM, lambda t: (0.7 + (not still) * 0.3 * math.sin(2 * t), 1.0 + 0.2 * math.sin(1.5 * t))
    )
    camera = SyntheticCamera(Scene(ARM, read_scene(text)), poses, lambda: 0.0, start=0.0)
    for index in range(0, count * step, step):
        frame = camera.capture(index)
        q = poses(frame.t).q
        yield frame, camera.truth(index), camera.scene.visible(q, frame.t)


@pytest.mark.short("disc")
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_effector_and_goal_are_followed_among_bricks_of_all_colours(kind):
    tracker = Tracker([read_spec("effector", f"{kind}:red"), read_spec("goal", f"{kind}:green")])
    for frame, truth, visible in filmed(f"marker={kind},clutter=12", 15):
        found = tracker.find(frame.image, frame.t)
        for name, place in truth.items():
            assert visible[name] > 0.9
            assert off(found[name], *place) < (0.5 if kind == "disc" else 1.5)
            assert found[name].confidence >= LEAST_CONFIDENCE


def beside_the_goal(scene, low, high):
    """Postures whose tip is seen `low` to `high` px beside the goal, in all directions."""
    for q in itertools.product(np.arange(-1.5, 0.8, 0.1), np.arange(-2.2, 2.2, 0.1)):
        truth = scene.truth(q)
        if low < math.dist(truth["effector"], truth["goal"]) < high:
            yield q, truth["effector"]


@pytest.mark.long
@pytest.mark.parametrize("azimuth", [-90, 150])
def test_beside_the_goal_s_marker_a_slanting_one_is_found_whatever_else_is_around(azimuth):
    scene = Scene(ARM, read_scene(f"tilt=50,azimuth={azimuth},clutter=0,fps_wander=0"))
    marker = read_spec("effector", "disc:red")
    for k, (q, truth) in enumerate(beside_the_goal(scene, 14, 22)):
        assert scene.visible(q)["effector"] > 0.99
        poses = ScriptedPoses(ARM, lambda t, q=q: q)
        image = SyntheticCamera(scene, poses, start=0.0).capture(k).image
        seen, why = follow(marker, [image] * 2)  # searched for, then expected there
        assert why == ["", ""], q
        assert max(off(s, *truth) for s in seen) < 0.5
        assert min(s.confidence for s in seen) >= LEAST_CONFIDENCE
    assert k >= 10


def test_what_is_beside_a_disc_does_not_pull():
    ground = np.full((HEIGHT, WIDTH, 3), 235, np.uint8)
    u, v = round(U), round(V)
    ground[: v - 15] = 60, 150, 20
    ground[v - 5 : v + 10, : u - 15] = 0, 190, 230
    ground[v + 15 :, u - 3 : u + 4] = 60, 55, 50
    ground[v + 15 : v + 19, u + 5 : u + 8] = 30, 20, 200
    seen, why, places = followed(read_spec(NAME, "red"), 24, reach=1, background=ground)
    assert set(why) == {""}
    assert rms(seen, places) <= 0.06
    assert len(claims(seen)) == 24


@pytest.mark.long
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_what_a_hand_hides_is_not_claimed(kind):
    first, markers, tracker, hidden = None, [], None, 0
    for frame, truth, visible in filmed(f"marker={kind},occlusion=2,fps=8", 33, still=True):
        if first is None:
            first = frame
            markers = [learn(name, frame.image, place, kind) for name, place in truth.items()]
            tracker = Tracker(markers)
        found = tracker.find(frame.image, frame.t)
        for name, place in truth.items():
            seen = found[name]
            if visible[name] < 0.02:
                hidden += 1
                assert seen is None or seen.confidence < LEAST_CONFIDENCE
            elif seen and seen.confidence >= LEAST_CONFIDENCE:
                assert off(seen, *place) < 2 * seen.radius
            if visible[name] == 1:
                assert off(seen, *place) < (0.5 if kind == "disc" else 1.5)
            assert (tracker.why[name] == "") == (seen is not None)
    assert hidden >= 6


# Lost


@pytest.mark.parametrize("kind", ["disc", "ball", "aruco"])
def test_what_is_gone_is_none_at_once_with_a_reason_and_never_the_last_place(kind):
    marker = read_spec(NAME, "aruco:0") if kind == "aruco" else learned(kind)
    radius = 20 if kind == "aruco" else 12
    there = [picture(kind, radius=radius, seed=k) for k in range(3)]
    seen, why = follow(marker, [*there, *(empty(seed=k) for k in range(8))])
    assert all(seen[:3])
    assert why[:3] == ["", "", ""]
    assert seen[3:] == [None] * 8
    assert all(why[3:])


@pytest.mark.short(every=4)
@pytest.mark.parametrize("gone", [0, 1, 6])
@pytest.mark.parametrize("kind", ["disc", "ball", "aruco"])
def test_what_comes_back_elsewhere_is_found_at_once_and_claimed_when_it_stays(kind, gone):
    """An ArUco marker says itself which one it is; of a colour, there may be another."""
    marker = read_spec(NAME, "aruco:0") if kind == "aruco" else learned(kind)
    radius = 20 if kind == "aruco" else 12
    pictures = [picture(kind, 40, 40, radius, background="white")] * 3
    pictures += [empty(background="white")] * gone
    seen, why = follow(
        marker, [*pictures, *[picture(kind, 110.4, 70.2, radius, background="white")] * 8]
    )
    assert [s is None for s in seen] == [False] * 3 + [True] * gone + [False] * 8
    assert max(off(s, 110.4, 70.2) for s in seen[-8:]) < 0.6
    sure = [s.confidence >= LEAST_CONFIDENCE for s in seen[-8:]]
    if kind == "aruco":
        assert all(sure)
    else:
        assert sure[:4] == [False] * 4
        assert max(s.confidence for s in seen[-8:-4]) <= 0.45
        assert sure[6:] == [True] * 2
    assert why[-1] == ""


def beside(place, other, kind, seed, hidden=False):
    """A picture of a marker, unless a grey hand hides it, and of another one of its colour."""
    ground = picture(kind, *other, size=(288, 144), noise=0, jpeg=0, blur=0)
    image = picture(kind, *place, background=ground, seed=seed)
    if hidden:
        u, v = map(round, place)
        cv2.rectangle(image, (u - 20, v - 20), (u + 20, v + 20), (110, 140, 190), -1)
    return image


@pytest.mark.short(every=2)
@pytest.mark.parametrize("speed", [0, 3])
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_another_one_of_its_colour_is_not_taken_for_it_while_it_is_hidden(kind, speed):
    """However long it is hidden, and wherever it comes from under the hand."""
    marker = learned(kind)
    other = (180, 70)
    pictures = []
    for k in range(56):
        place = (60.3 + speed * min(k, 8), 70.4)
        away = (-500, 70) if k < 5 else other  # it comes later
        pictures.append(beside(place, away, kind, k, hidden=8 <= k < 50))
    seen, why = follow(marker, pictures)
    assert claims(seen[8:50]) == []
    assert all(off(s, *other) < 1 for s in seen[12:50])
    assert why[30] == "only another one of its colour"
    assert len(claims(seen[:8])) == 8
    assert len(claims(seen[50:])) == 6
    assert all(off(s, 60.3 + 8 * speed, 70.4) < 0.6 for s in (*seen[:1], *seen[50:]) if speed == 0)
    assert all(off(s, 60.3 + 8 * speed, 70.4) < 0.6 for s in seen[50:])


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_where_the_camera_was_moved_all_of_it_is_elsewhere_and_it_is_found_again(kind):
    marker = learned(kind)
    pictures = [beside((60.3, 70.4), (200 if k else -500, 60), kind, k) for k in range(5)]
    pictures += [beside((150.3, 100.4), (290, 90), kind, k) for k in range(5, 16)]
    seen, _ = follow(marker, pictures)
    assert len(claims(seen[:5])) == 5
    assert claims(seen[5:9]) == []
    assert all(off(s, 150.3, 100.4) < 0.6 for s in seen[12:])
    assert len(claims(seen[12:])) == 4


def test_the_last_other_one_is_taken_after_all_if_nothing_else_is_there_for_long():
    pictures = [beside((60.3, 70.4), (u, 70), "disc", 0) for u in (-500, 180, 180)]
    pictures += [beside((-500, 70), (180, 70), "disc", 1)] * 30
    seen, _ = follow(learned(), pictures, fps=2)
    assert claims(seen[3:20]) == []
    assert len(claims(seen[-5:])) == 5


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_a_marker_never_seen_whole_in_the_light_it_has_is_said_to_be_in_the_dark(kind):
    seen, why = follow(learned(kind), [picture(kind)] * 2 + [picture(kind, gain=0.0001)] * 3)
    assert seen[2:] == [None] * 3
    assert why[2:] == ["too dark"] * 3


@pytest.mark.short(every=4)
@pytest.mark.parametrize("shade", [0, 128, 255])
@pytest.mark.parametrize("spec", ["red", "ball:blue", "aruco:0"])
def test_in_black_white_and_grey_frames_nothing_is_seen(spec, shade):
    image = np.full((HEIGHT, WIDTH, 3), shade, np.uint8)
    seen, why = follow(read_spec(NAME, spec), [image] * 4)
    assert seen == [None] * 4
    assert all(why)


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_a_marker_that_leaves_the_picture_is_followed_to_the_edge_and_then_gone(kind):
    marker = learned(kind)
    places = [(U, V - 6 * k) for k in range(16)]
    seen, _ = follow(marker, [picture(kind, *place, seed=k) for k, place in enumerate(places)])
    for sighting, (u, v) in zip(seen, places):
        if v > 12:
            assert off(sighting, u, v) < 0.6
            assert sighting.confidence >= LEAST_CONFIDENCE
        elif v > 4:  # cut
            assert off(sighting, u, v) < 1.5
        elif sighting and sighting.confidence >= LEAST_CONFIDENCE:
            assert off(sighting, u, v) < 12
        if v < -12:
            assert sighting is None


@pytest.mark.parametrize(("u", "v"), [(4, 50), (140, 50), (70, 3), (70, 105), (7, 7)])
def test_a_ball_cut_by_the_picture_s_edge_is_found_where_it_is(u, v):
    seen, _ = follow(learned("ball", 16), [picture("ball", u, v, 16, seed=k) for k in range(3)])
    assert all(off(s, u, v) < 2 for s in seen if s)
    assert any(seen)


@pytest.mark.short(every=3)
@pytest.mark.parametrize("kind", COLOR_KINDS)
@pytest.mark.parametrize("cover", ["#808080", "#c98f6b"], ids=["grey", "skin"])
@pytest.mark.parametrize("down", [False, True])
def test_what_an_edge_that_comes_across_hides_in_part_is_placed_or_doubted(kind, cover, down):
    marker = learned(kind, 14)
    tone = to_srgb(light_of(cover)).astype(np.uint8)
    pictures = []
    for k in range(15):
        image = picture(kind, radius=14, seed=k)
        if down:
            image[: round(V - 16 + 2.5 * k)] = tone
        else:
            image[:, : round(U - 16 + 2.5 * k)] = tone
        pictures.append(image)
    seen, _ = follow(marker, pictures)
    assert all(off(s) < 1.5 for s in seen if s and s.confidence >= LEAST_CONFIDENCE)
    assert len(claims(seen[:4])) == 4
    assert seen[-2:] == [None, None]


# What is not it


def painted(rings, colour="red", background="#808080", seed=0, below=()):
    """Polygons, in pixels, through the same sensor, upon others of other colours."""
    light = np.broadcast_to(light_of(background), (HEIGHT, WIDTH, 3)).astype(float)
    for tone, shapes in (*below, (colour, rings)):
        cover = coverage(shapes, Box(0, 0, WIDTH, HEIGHT))[..., None]
        light = light + cover * (light_of(tone) - light)
    light = cv2.GaussianBlur(light, (0, 0), 0.7)
    values = to_srgb(light) + 3 * np.random.default_rng(seed).standard_normal(light.shape)
    return through_jpeg(np.clip(np.round(values), 0, 255).astype(np.uint8), 90)


def polygon(corners, radius, turn=0.0):
    angle = np.arange(corners) * 2 * math.pi / corners + turn
    return np.stack([U + radius * np.cos(angle), V + radius * np.sin(angle)], axis=1)


def aslant(a, b, turn, shape=None):
    """A shape, a circle if none, of half-axes a, b."""
    x, y = (polygon(64, 1) - (U, V) if shape is None else np.array(shape)).T * [[a], [b]]
    c, s = math.cos(turn), math.sin(turn)
    return np.stack([U + x * c - y * s, V + x * s + y * c], axis=1)


@pytest.mark.short(every=5, rest="claims")
@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2, 2.3])
@pytest.mark.parametrize(("a", "b"), [(8, 3), (10, 3), (16, 4), (22, 6)])
@pytest.mark.parametrize(
    ("colour", "background"), [("green", "#efeee9"), ("red", "#efeee9"), ("red", "#808080")]
)
def test_a_small_disc_seen_very_aslant_is_found(a, b, turn, colour, background):
    pictures = [painted([aslant(a, b, turn)], colour, background, seed=k) for k in range(3)]
    seen, why = follow(read_spec(NAME, colour), pictures)
    assert set(why) == {""}
    assert max(map(off, seen)) < 0.3
    assert len(claims(seen)) == 3


@pytest.mark.short(every=5)
@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2, 2.3])
@pytest.mark.parametrize(("a", "b"), [(16, 4), (15, 5), (22, 6)])
def test_a_disc_aslant_is_told_from_its_white_rim_and_from_what_is_beyond(a, b, turn):
    below = [("white", [aslant(1.4 * a, 1.4 * b, turn)])]
    pictures = [
        painted([aslant(a, b, turn)], "red", "#a98358", seed=k, below=below) for k in range(3)
    ]
    seen, _ = follow(read_spec(NAME, "red"), pictures)
    assert max(map(off, seen)) < 0.3
    assert len(claims(seen)) == 3


@pytest.mark.parametrize("down", [6, 8, 10])
def test_something_larger_beside_a_disc_aslant_is_not_measured_in_its_place(down):
    table = [
        ("#a98358", [np.array([(0, V + down), (WIDTH, V + down), (WIDTH, HEIGHT), (0, HEIGHT)])])
    ]
    pictures = [
        painted([aslant(10, 3, 0)], "green", "#efeee9", seed=k, below=table) for k in range(3)
    ]
    seen, _ = follow(read_spec(NAME, "green"), pictures)
    assert max(map(off, seen)) < 0.3
    assert min(s.confidence for s in seen) > 0.8


@pytest.mark.short(every=5)
@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2, 2.3])
@pytest.mark.parametrize(
    "shape",
    ["bar", "short bar", "stick", "thin", "pencil", "small pencil", "wedge", "half", "beam"],
)
def test_a_slender_thing_of_the_same_colour_is_not_claimed(shape, turn):
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    pencil = [(-1, -1), (0.6, -1), (1, 0), (0.6, 1), (-1, 1)]
    ring = {
        "bar": aslant(14, 4, turn, square),
        "short bar": aslant(10, 4, turn, square),
        "stick": aslant(24, 4, turn),
        "thin": aslant(6, 1.2, turn),
        "pencil": aslant(15, 4, turn, pencil),
        "small pencil": aslant(7, 3.5, turn, pencil),
        "wedge": aslant(14, 4, turn, [(-1, -1), (1, -0.5), (1, 0.5), (-1, 1)]),
        "half": aslant(16, 5, turn, np.minimum(polygon(64, 1) - (U, V), (0.3, 1))),
        "beam": aslant(60, 4, turn, square),
    }[shape]
    for background in ("#efeee9", "#808080"):
        pictures = [painted([ring], "red", background, seed=k) for k in range(2)]
        seen, _ = follow(read_spec(NAME, "red"), pictures)
        assert claims(seen) == []


@pytest.mark.short(every=3)
@pytest.mark.parametrize("turn", [0.0, 0.25, 0.5, math.pi / 4, 1.2])
@pytest.mark.parametrize("side", [20, 24, 32, 42])
def test_a_square_of_the_same_colour_is_not_claimed_to_be_a_disc(side, turn):
    pictures = [painted([polygon(4, side / math.sqrt(2), turn)], seed=k) for k in range(3)]
    for marker in (learned(radius=side / 2), read_spec(NAME, "red")):
        seen, _ = follow(marker, pictures)
        assert claims(seen) == []


@pytest.mark.short(every=3)
@pytest.mark.parametrize("kind", COLOR_KINDS)
@pytest.mark.parametrize(
    "shape", ["triangle", "bar", "cross", "two discs that touch", "disc on a bar"]
)
def test_another_shape_of_the_same_colour_is_not_claimed(shape, kind):
    rings = {
        "triangle": [polygon(3, 19)],
        "bar": [np.array([(U - 32, V - 8), (U + 32, V - 8), (U + 32, V + 8), (U - 32, V + 8)])],
        "two discs that touch": [polygon(64, 12) - (11, 0), polygon(64, 12) + (11, 0)],
    }
    bar = rings["bar"][0]
    rings["cross"] = [bar, (bar - (U, V))[:, ::-1] + (U, V)]
    rings["disc on a bar"] = [bar, polygon(64, 11)]
    pictures = [painted(rings[shape], seed=k) for k in range(3)]
    seen, _ = follow(read_spec(NAME, f"{kind}:red"), pictures)
    assert claims(seen) == []


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_between_two_that_are_alike_it_is_not_sure_and_says_so(kind):
    other = picture(kind, 35, 50, noise=0, jpeg=0, blur=0)
    both = [picture(kind, 105, 60, background=other, seed=k) for k in range(4)]
    for marker in (learned(kind), read_spec(NAME, f"{kind}:red")):
        seen, why = follow(marker, both)
        assert claims(seen) == []
        assert why == ["several alike"] * 4
        # One of them goes: that settles it.
        alone = [picture(kind, 105, 60, seed=k) for k in range(2)]
        seen, why = follow(marker, both + alone)
        assert len(claims(seen[-2:])) == 2
        assert why[-2:] == ["", ""]


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_one_that_is_known_is_not_lost_because_another_one_comes(kind):
    alone = [picture(kind, 35, 50, seed=k) for k in range(3)]
    other = picture(kind, 105, 60, noise=0, jpeg=0, blur=0)
    both = [picture(kind, 35, 50, background=other, seed=k) for k in range(3)]
    seen, _ = follow(learned(kind), alone + both)
    assert all(off(s, 35, 50) < 0.6 for s in seen)
    assert len(claims(seen)) == 6


@pytest.mark.short(every=5)
@pytest.mark.parametrize("colour", ["black", "orange", "purple", "white", "#1f0a0a", "#ffd0d0"])
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_something_larger_on_the_marker_s_side_of_grey_is_not_taken_for_it(kind, colour):
    """A linear discriminant is an open half-space: all that lies far out would be the marker."""
    ground = marker_frame("disc", 38, 54, 30, colour, size=(WIDTH, HEIGHT), noise=0, blur=0)
    pictures = [picture(kind, 110, 54, background=ground, seed=k) for k in range(2)]
    for marker in (learned(kind), read_spec(NAME, f"{kind}:red")):
        seen, why = follow(marker, [empty(background=ground, seed=k) for k in range(2)])
        assert claims(seen) == []
        seen, why = follow(marker, pictures)
        assert all(off(s, 110, 54) < 0.6 for s in seen)
        assert len(claims(seen)) == 2
        assert why == ["", ""]


@pytest.mark.parametrize("colour", ["black", "orange", "yellow", "blue", "#303830"])
def test_a_green_ball_is_told_from_larger_things_that_are_not_green(colour):
    ground = marker_frame("disc", 38, 54, 30, colour, size=(WIDTH, HEIGHT), noise=0, blur=0)
    image = picture("ball", 110, 54, colour="green", background=ground)
    marker = learn(NAME, image, (110, 54), "ball")
    seen, _ = follow(marker, [image] * 2 + [empty(background=ground)] * 3)
    assert all(off(s, 110, 54) < 0.6 for s in seen[:2])
    assert claims(seen[2:]) == []


def test_in_noise_nothing_is_claimed():
    draw = np.random.default_rng(5)
    markers = [learned(), learned("ball"), read_spec("w", "green"), read_spec("a", "aruco:0")]
    markers[1] = replace(markers[1], name="ball")
    tracker = Tracker(markers)
    for k in range(6):
        image = draw.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
        if k % 2:
            image = cv2.GaussianBlur(image, (0, 0), 3) * 3
        assert claims(tracker.find(image, k / 30).values()) == []


# Changing light

LIGHTS = {
    "dimmed to 0.3": lambda k: {"gain": 1 - 0.7 * k / 14},
    "brightened to 1.8": lambda k: {"gain": 1 + 0.8 * k / 14},
    "warmer by 40 %": lambda k: {"warm": 0.4 * k / 14},
    "cooler by 40 %": lambda k: {"warm": -0.4 * k / 14},
    "flickering": lambda k: {"gain": 1 + 0.35 * math.sin(2.1 * k)},
    "down to 0.4 at once": lambda k: {"gain": 0.4 if k >= 6 else 1.0},
    "up to 1.8 at once": lambda k: {"gain": 1.8 if k >= 6 else 1.0},
}


@pytest.mark.short(every=4, rest="claims")
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize(("kind", "colour"), [("disc", "red"), ("disc", "blue"), ("ball", "green")])
def test_the_lock_is_kept_while_the_light_changes(kind, colour, light):
    places = around(15)
    pictures = [
        picture(kind, u, v, colour=colour, seed=k, **LIGHTS[light](k))
        for k, (u, v) in enumerate(places)
    ]
    marker = learn(NAME, pictures[0], places[0], kind)
    seen, why = follow(marker, pictures)
    assert set(why) == {""}
    assert len(claims(seen)) == 15
    assert max(off(s, *place) for s, place in zip(seen, places)) < 1.2
    assert rms(seen, places) < (0.12 if kind == "disc" else 0.4)


@pytest.mark.parametrize("change", [{"gain": 0.3}, {"gain": 1.8}, {"warm": 0.4}, {"warm": -0.4}])
@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_what_was_learned_in_one_light_is_found_in_another(kind, change):
    seen, _ = follow(learned(kind), [picture(kind, 40, 60, seed=k, **change) for k in range(2)])
    assert all(off(s, 40, 60) < 0.6 for s in seen)
    assert len(claims(seen)) == 2


def test_adaptation_never_walks_off_to_another_colour():
    """Through all hues in small steps: it has to let go, however slowly it goes."""
    marker = learned(colour="#c81414")
    pictures = []
    for k in range(40):
        r, g = (200, 20 + 5 * k) if k < 36 else (200 - 20 * (k - 36), 200)
        pictures.append(picture(colour=f"#{r:02x}{min(g, 200):02x}14", seed=k))
    seen, why = follow(marker, pictures)
    assert len(claims(seen[:4])) == 4
    assert claims(seen[-8:]) == []  # it is yellow now
    assert why[-1] != ""


# Any frame, any time


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "size",
    [(1, 1), (1, 4), (4, 1), (2, 2), (3, 3), (4, 4), (5, 5), (9, 9), (6, 200), (200, 6), (1, 999)],
)
def test_a_tiny_frame_is_no_trouble(size):
    draw = np.random.default_rng(2)
    frames = [np.full((*size, 3), shade, np.uint8) for shade in (0, 255)]
    frames += [np.full((*size, 3), (20, 20, 200), np.uint8)]
    frames += [draw.integers(0, 256, (*size, 3), dtype=np.uint8)]
    markers = [
        learned(),
        replace(learned("ball"), name="b"),
        read_spec("w", "ball:red"),
        read_spec("a", "aruco:0"),
    ]
    for before in ([], [picture(), picture()]):
        tracker = Tracker(markers)
        for k, image in enumerate([*before, *frames]):
            found = tracker.find(image, k / 30)
            if k >= len(before):
                assert claims(found.values()) == []


@pytest.mark.parametrize("kind", ["disc", "ball", "aruco"])
def test_a_frame_of_another_size_is_searched_afresh(kind):
    marker = read_spec(NAME, "aruco:0") if kind == "aruco" else learned(kind)
    radius = 20 if kind == "aruco" else 12
    frames = [
        (picture(kind, 250, 150, radius, size=(300, 200)), 250, 150),
        (picture(kind, 250, 150, radius, size=(300, 200)), 250, 150),
        (picture(kind, 50, 40, radius), 50, 40),
        (picture(kind, 40, 50, radius, size=(80, 100)), 40, 50),
        (picture(kind, 250, 40, radius, size=(300, 80)), 250, 40),
    ]
    seen, _ = follow(marker, [image for image, _, _ in frames])
    assert all(off(s, u, v) < 0.6 for s, (_, u, v) in zip(seen, frames))


@pytest.mark.short(every=3)
@pytest.mark.parametrize(
    "times",
    [[0.0] * 5, [0, 1e-9, 2e-9, 3e-9, 4e-9], [0, 0.03, 50.0, 50.03, 1e6], [5, 4, 3, 2, -1e5]],
    ids=["standing", "crawling", "jumping", "backwards"],
)
@pytest.mark.parametrize("kind", ["disc", "ball", "aruco"])
def test_a_clock_that_stands_or_jumps_does_not_disturb(kind, times):
    marker = read_spec(NAME, "aruco:0") if kind == "aruco" else learned(kind)
    tracker = Tracker([marker])
    for k, t in enumerate(times):
        u = 45.0 + 4 * k
        seen = tracker.find(picture(kind, u, V, 20 if kind == "aruco" else 12), t)[NAME]
        assert off(seen, u, V) < 0.6
        assert seen.confidence >= LEAST_CONFIDENCE


def test_the_same_frames_give_the_same_and_trackers_do_not_share():
    places = around(8)
    ours = [picture(u=u, v=v, seed=k) for k, (u, v) in enumerate(places)]
    ours[4] = empty()
    theirs = [picture("ball", 130 - u, v, seed=k) for k, (u, v) in enumerate(places)]
    marker = learned()
    alone, why = follow(marker, ours)
    copies = [image.copy() for image in ours]
    one, other = Tracker([marker]), Tracker([marker])
    for k in range(8):
        other.find(theirs[k], k / 30)
        assert one.find(ours[k], k / 30) == {NAME: alone[k]}
        assert one.why[NAME] == why[k]
    assert all((image == copy).all() for image, copy in zip(ours, copies))


def test_a_frame_may_be_read_only_and_a_part_of_a_larger_one():
    large = picture(u=U + 20, v=V + 10, size=(WIDTH + 40, HEIGHT + 20))
    part = large[10 : 10 + HEIGHT, 20 : 20 + WIDTH]
    part.flags.writeable = False
    seen, _ = follow(learned(), [part] * 3)
    assert max(map(off, seen)) < 0.1


@pytest.mark.parametrize("kind", COLOR_KINDS)
def test_every_number_is_finite_and_every_confidence_from_nothing_to_one(kind):
    marker = learned(kind)
    pictures = [picture(kind, U, V, radius, seed=radius) for radius in range(1, 40, 3)]
    pictures += [picture(kind, U - 12 * k, V - 9 * k, 14) for k in range(8)]
    seen, why = follow(marker, pictures)
    assert any(seen)
    for sighting, reason in zip(seen, why):
        assert sighting or reason
        assert not sighting or not reason or sighting.confidence <= 0.45
        if sighting:
            assert all(math.isfinite(part) for part in sighting)
            assert 0 < sighting.confidence <= 1
            assert sighting.radius > 0


def test_a_marker_s_name_is_what_its_sighting_is_called():
    names = ["a", "effector_2", "goal-x"]
    tracker = Tracker([Marker(name, "aruco", id=k) for k, name in enumerate(names)])
    assert set(tracker.why) == set(names)
    found = tracker.find(picture("aruco", radius=20, number=1), 0.0)
    assert [name for name in names if found[name]] == ["effector_2"]


@pytest.mark.short(every=2)
@pytest.mark.parametrize("kind", COLOR_KINDS)
@pytest.mark.parametrize(("radius", "rate"), [(10, 1.1), (60, 1 / 1.1)])
def test_a_marker_that_comes_nearer_or_goes_away_is_followed(kind, radius, rate):
    """Up to eight times as large as it was picked: what counts is the size that it had before."""
    tracker = None
    for k in range(22):
        size = radius * rate**k
        image = marker_frame(kind, 200.3, 160.4, size, "green", size=(400, 320), jpeg=90, seed=k)
        tracker = tracker or Tracker([learn("tip", image, (200, 160), kind)])
        seen = tracker.find(image, k / 30)["tip"]
        assert seen.confidence >= 0.9
        assert math.hypot(seen.u - 200.3, seen.v - 160.4) < 0.01 * size + 0.1


@pytest.mark.parametrize("kind", COLOR_KINDS)
@pytest.mark.parametrize(("picked", "radius", "why"), [(10, 50, "larger"), (50, 10, "smaller")])
def test_what_has_another_size_than_was_picked_is_said(kind, picked, radius, why):
    def frame(size):
        return marker_frame(kind, 200, 160, size, "green", size=(400, 320), jpeg=90)

    tracker = Tracker([learn("tip", frame(picked), (200, 160), kind)])
    assert tracker.find(frame(radius), 0.0)["tip"] is None
    assert tracker.why["tip"] == f"only a much {why} one"
    assert tracker.find(frame(picked), 0.1)["tip"].confidence >= 0.9
    assert tracker.why["tip"] == ""
