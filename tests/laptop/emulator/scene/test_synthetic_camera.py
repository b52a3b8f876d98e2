"""Sensor and timing of the synthetic camera, against plain arithmetic on whole pictures."""

import math
import time
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from clocks import FakeClock
from marker_views import marker_frame
from rig import Rig

from laptop.emulator import pace
from laptop.emulator.live import NO_RUN, Pose, PoseWriter
from laptop.emulator.pace import PacedClock
from laptop.emulator.scene.optics import light_of, to_linear, to_srgb
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.sensor import through_jpeg
from laptop.emulator.scene.synthetic_camera import SyntheticCamera, film, open_live
from shared.arm_description import find_arm, read_arm
from shared.state import LIVE_FOLDER

ARM = read_arm(find_arm("planar"))
CLEAN = "noise=0,jpeg=0,clutter=0,"


class WaitingClock(FakeClock):
    """Time passes when somebody waits, or when it is pushed; not for ever."""

    def sleep(self, seconds):
        assert seconds > 0
        super().sleep(seconds)
        assert self.t < 1e4, "it waits for ever"


def posed(*q):
    """An arm that rests."""
    return ScriptedPoses(ARM, lambda t: q)


STILL = posed(0.6, 1.0)
SWINGING = ScriptedPoses(ARM, lambda t: (0.6 + t, 1.0))
"""Its shoulder turns at 1 rad/s."""


def camera(text="", poses=STILL, **options):
    clock = WaitingClock(0.0)
    scene = Scene(ARM, read_scene(text))
    options.setdefault("start", 0.0)
    made = SyntheticCamera(scene, poses, clock.now, clock.sleep, **options)
    made.clock = clock
    return made


def light_moments(image, place, radius):
    """Centroid and variance (u and v together) of what is not background, in linear light."""
    u, v = (round(c) for c in place)
    r = math.ceil(radius)
    part = to_linear(image[v - r : v + r + 1, u - r : u + r + 1])
    ring = np.concatenate([part[0], part[-1], part[:, 0], part[:, -1]])
    ground, marker = np.median(ring, axis=0), part[r, r]
    alpha = (part - ground) @ (marker - ground) / ((marker - ground) @ (marker - ground))
    y, x = np.mgrid[v - r : v + r + 1, u - r : u + r + 1]
    centre = np.array([(alpha * x).sum(), (alpha * y).sum()]) / alpha.sum()
    squared = (x - centre[0]) ** 2 + (y - centre[1]) ** 2
    return centre, (alpha * squared).sum() / alpha.sum()


def light_centroid(image, place, radius):
    return light_moments(image, place, radius)[0]


# The sensor


def test_a_frame_is_the_scenes_light_blurred_exposed_and_encoded():
    made = camera(CLEAN + "gain=0.8,warm=0.2,gradient=0.3,blur=1.1")
    image = made.capture(3).image
    light = made.scene.image((0.6, 1.0))
    light = cv2.GaussianBlur(light, (0, 0), 1.1, borderType=cv2.BORDER_REPLICATE)
    light = light * np.linspace(1, 0.7, 640)[None, :, None] * 0.8 * np.array([0.8, 1.0, 1.2])
    assert np.abs(image - to_srgb(light)).max() < 0.75
    assert image.dtype == np.uint8
    assert image.shape == (480, 640, 3)


def test_what_was_developed_before_leaves_no_trace():
    """The ground is kept from frame to frame; ink, motion and lamps change it bit by bit."""
    ink = [(10 - 0.1 * k, 0.2 * k, 9.9 - 0.1 * k, 0.2 * (k + 1)) for k in range(60)]

    class Drawing(ScriptedPoses):
        def __call__(self, t):
            return Pose(ARM, (0.6 + t, 1.0 - t), ink[: int(40 * t)])

    drawing = Drawing(ARM, None)
    text = "jpeg=0,clutter=3,flicker=0.3,occlusion=8,"
    used, fresh = camera(text, drawing), camera(text, drawing)
    for index in (0, 5, 200, 30, 31, 40):
        image = used.capture(index).image
    np.testing.assert_array_equal(image, fresh.capture(40).image)


@pytest.mark.parametrize("name", ["effector", "goal"])
def test_a_disc_straight_on_is_measured_where_truth_says(name):
    text = CLEAN + "tilt=0,k1=0,rim=1.5,gradient=0,shadow=0,exposure=0"
    made = camera(text, SWINGING)
    for k in range(3):
        frame, place = made.capture(k), made.truth(k)[name]
        found = light_centroid(frame.image, place, 19)
        assert found == pytest.approx(place, abs=0.005)


def test_noise_has_its_sigma_and_no_bias():
    quiet, noisy = camera(CLEAN), camera("noise=3,jpeg=0,clutter=0,")
    clean = quiet.capture(0).image.astype(float)
    inside = (clean > 20) & (clean < 235)
    off = np.stack([noisy.capture(k).image - clean for k in range(4)])[:, inside]
    # The clean picture and the noisy one are rounded.
    assert off.std() == pytest.approx(math.sqrt(9 + 2 / 12), rel=0.02)
    assert abs(off.mean()) < 0.02
    assert abs(np.corrcoef(off[0], off[1])[0, 1]) < 0.05


def test_gain_scales_the_light():
    images = [camera(f"{CLEAN}gain={gain}").capture(0).image for gain in (0.8, 0.4)]
    ratio = to_linear(images[1]) / to_linear(images[0])
    assert np.median(ratio) == pytest.approx(0.5, abs=0.005)


def test_more_light_than_it_can_say_is_white():
    image = camera(CLEAN + "gain=3").capture(0).image
    assert (image[200:230, 340:360] == 255).all()


def test_warm_light_makes_red_of_grey():
    made = camera(CLEAN + "warm=0.4,gain=0.5")
    u, v = np.round(made.scene.project(np.array([(5.0, -8.0, 0)]))[0]).astype(int)
    paper = to_linear(made.capture(0).image[v, u])
    white = light_of("#efeee9")
    np.testing.assert_allclose(paper / paper[1], white / white[1] * (0.6, 1, 1.4), rtol=0.02)


def test_a_jpeg_is_what_opencv_makes_of_it():
    plain, packed = camera("jpeg=0,clutter=3"), camera("jpeg=80,clutter=3")
    code = cv2.imencode(".jpg", plain.capture(5).image, [cv2.IMWRITE_JPEG_QUALITY, 80])[1]
    expected = cv2.imdecode(code, cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(packed.capture(5).image, expected)


def test_chroma_subsampling_is_as_asked_for():
    image = np.zeros((64, 64, 3), np.uint8)
    image[:, 31:] = (0, 0, 255)
    off = {c: np.abs(through_jpeg(image, 95, c).astype(int) - image).sum() for c in ("420", "444")}
    assert off["444"] < off["420"] / 3


def test_lamps_flicker_unless_the_exposure_spans_their_period():
    def brightness(text):
        made = camera(CLEAN + "width=160,height=120,focal=160,flicker=0.5,fps=47," + text)
        return np.array([to_linear(made.capture(k).image).mean() for k in range(12)])

    short, full = brightness("exposure=0.001"), brightness("exposure=0.01")
    assert np.ptp(short) / short.mean() > 0.6
    assert np.ptp(full) / full.mean() < 0.01
    assert short.mean() == pytest.approx(full.mean(), rel=0.15)


def test_the_same_seed_gives_the_same_bytes_whatever_came_before():
    one, other, third = camera("clutter=3"), camera("clutter=3"), camera("clutter=3,seed=1")
    frames = [one.capture(k).image for k in (0, 1, 2)]
    np.testing.assert_array_equal(other.capture(2).image, frames[2])
    assert (frames[1] != frames[2]).any()
    assert (third.capture(2).image != frames[2]).any()


# Motion


def test_a_moving_marker_is_drawn_out_around_where_it_is_in_the_middle_of_the_exposure():
    text = CLEAN + "tilt=0,k1=0,rim=1.5,gradient=0,shadow=0,exposure=0.03,fps=30,fps_wander=0"
    made = camera(text, SWINGING)
    place = made.truth(3)["effector"]
    first, last = (made.scene.truth(SWINGING(made.time_of(3) + s).q) for s in (-0.015, 0.015))
    distance = math.dist(first["effector"], last["effector"])
    assert distance > 5
    found, spread = light_moments(made.capture(3).image, place, 19)
    # On its circle the middle of an arc lies outside of its mean, by way^2 / 24 radii.
    assert found == pytest.approx(place, abs=0.05)
    resting = camera(text, posed(0.6 + made.time_of(3), 1.0))
    _, spread_at_rest = light_moments(resting.capture(3).image, place, 19)
    # The variance of an even motion.
    assert spread - spread_at_rest == pytest.approx(distance**2 / 12, rel=0.1)


def test_a_rolling_shutter_takes_the_marker_at_its_row():
    text = CLEAN + "tilt=0,k1=0,rim=1.5,gradient=0,shadow=0,exposure=0,"
    rolling, all_at_once = camera(text + "readout=0.03", SWINGING), camera(text, SWINGING)
    place, plain = rolling.truth(0)["effector"], all_at_once.truth(0)["effector"]
    # Near the top, so before the middle row, when the arm was not as far yet.
    t = rolling.time_of(0) + 0.03 * ((place[1] + 0.5) / 480 - 0.5)
    assert t < -0.005
    assert place == pytest.approx(rolling.scene.truth(SWINGING(t).q)["effector"], abs=0.02)
    assert math.dist(place, plain) > 1
    found = light_centroid(rolling.capture(0).image, place, 19)
    assert found == pytest.approx(place, abs=0.01)


# Timing


def test_frames_are_due_at_the_rate_which_wanders_slowly():
    made = camera("fps=50,fps_wander=0.1,clutter=0")
    times = np.array([made.time_of(k) for k in range(1500)])
    rates = 1 / np.diff(times)
    assert times[0] == 0
    assert rates.max() == pytest.approx(50 / 0.9, rel=0.01)
    assert rates.min() == pytest.approx(50 / 1.1, rel=0.01)
    assert np.abs(np.diff(rates)).max() < 0.1
    assert rates.argmax() in range(480, 520)
    # A whole number of its slow waves takes as long as without them.
    assert made.time_of(1000) == pytest.approx(20, abs=1e-6)


def test_no_frame_is_handed_over_before_its_delay_and_none_overtakes():
    made = camera("fps=60,delay=0.05,jitter=0.01,clutter=0")
    late = np.array([made.due(k) - made.time_of(k) for k in range(400)])
    assert late.min() >= 0.05
    assert late.mean() == pytest.approx(0.06, abs=0.004)
    assert late.std() > 0.004
    assert (np.diff([made.due(k) for k in range(400)]) >= 0).all()


def test_a_picture_cannot_leave_before_it_is_exposed_and_read_out():
    made = camera("fps=20,delay=0,jitter=0,exposure=0.04,readout=0.02,clutter=0")
    assert made.due(3) - made.time_of(3) == pytest.approx(0.03)


@pytest.mark.short("")
@pytest.mark.parametrize("text", ["", "fps=90,fps_wander=0.3,delay=0.4,jitter=0.03,exposure=0.005"])
def test_the_newest_frame_is_the_last_one_due(text):
    made = camera(text + ",clutter=0")
    dues = np.array([made.due(k) for k in range(900)])
    assert made.newest(dues[0] - 1e-6) == -1
    for t in np.linspace(dues[0], dues[600], 97):
        assert made.newest(t) == np.count_nonzero(dues <= t) - 1


def test_reading_in_time_gives_every_frame_when_it_is_due():
    made = camera("width=160,height=120,focal=160,clutter=0")
    for k in range(20):
        frame = made.read()
        assert frame.index == k
        assert frame.t == made.time_of(k)
        assert made.clock.t == pytest.approx(made.due(k))


def test_a_slow_reader_gets_the_newest_frame_and_no_frame_twice():
    made = camera("width=160,height=120,focal=160,clutter=0")
    indices = []
    for _ in range(5):
        frame = made.read()
        assert made.due(frame.index + 1) > made.clock.t
        indices.append(frame.index)
        made.clock.t += 0.5
    assert np.diff(indices).min() >= 13


def test_a_picture_that_takes_longer_than_a_frame_is_handed_over_all_the_same(monkeypatch):
    made = camera("width=160,height=120,focal=160,clutter=0")
    paint = SyntheticCamera.capture
    painted = []

    def slowly(self, index):
        assert len(painted) < 10, "it paints for ever"
        painted.append(index)
        made.clock.t += 2.5 / made.fps
        return paint(self, index)

    monkeypatch.setattr(SyntheticCamera, "capture", slowly)
    given = [made.read().index for _ in range(4)]
    assert given == painted
    assert np.diff(given).min() >= 1


def test_who_waits_too_short_gets_nothing_and_the_frame_later():
    made = camera("width=160,height=120,focal=160,clutter=0,delay=0.3")
    assert made.read(0.1) is None
    assert made.clock.t == pytest.approx(0.1)
    assert made.read(0.0) is None
    assert made.read(1.0).index == 0


def test_a_closed_camera_gives_nothing():
    made = camera("width=160,height=120,focal=160,clutter=0")
    with made:
        assert made.read() is not None
        assert not made.ended
    assert made.ended
    assert made.read() is None


def test_on_the_real_clock_frames_come_at_their_times():
    scene = Scene(ARM, read_scene("width=160,height=120,focal=160,clutter=0,fps=100"))
    with SyntheticCamera(scene, STILL) as made:
        for _ in range(5):
            frame = made.read()
            assert time.monotonic() >= made.due(frame.index)


# Where the poses come from


def test_an_emulated_arm_is_filmed_in_its_virtual_time(tmp_path):
    rig = Rig(tmp_path)
    filmed = film(rig.brick, CLEAN + "delay=0.05,jitter=0")
    assert filmed.frame_at(0.01) is None
    with rig.running():
        rig.driver().draw_line((10, 0), (5, 10))
    t = rig.world.now()
    frame = filmed.frame_at(t)
    assert t - 0.05 - 1 / 29 < frame.t <= t - 0.05
    past = filmed.truth(40)["effector"]
    sample = min(rig.brick.record, key=lambda s: abs(s.t - filmed.time_of(40)))
    assert past == pytest.approx(filmed.scene.truth(sample.q)["effector"], abs=2)
    # The ink of the line is in the picture, and was not before.
    places = np.round(filmed.scene.project(np.array([(9.0, 2.0, 0), (8.0, 4.0, 0)]))).astype(int)
    before = filmed.capture(0).image
    for u, v in places:
        after = filmed.capture(frame.index).image
        assert after[v - 3 : v + 4, u - 3 : u + 4].min() < 180
        assert before[v - 3 : v + 4, u - 3 : u + 4].min() > 190


def test_reading_a_filmed_arm_lets_its_world_go_on(tmp_path):
    rig = Rig(tmp_path)
    filmed = film(rig.brick, "width=160,height=120,focal=160,clutter=0")
    assert [filmed.read().index for _ in range(3)] == [0, 1, 2]
    assert rig.world.now() == pytest.approx(filmed.due(2))


def test_as_long_as_no_arm_runs_the_one_of_the_environment_is_shown(tmp_path, monkeypatch):
    for name, joints in (("spatial", 3), ("planar", 2)):
        monkeypatch.setenv("BRICKSERVO_ARM", name)
        with open_live("width=160,height=120,focal=160,clutter=0", str(tmp_path)) as made:
            assert len(made.scene.arm.joints) == joints


def test_without_a_run_the_arm_is_shown_at_home_and_that_is_said(tmp_path):
    with open_live("width=160,height=120,focal=160,clutter=0", str(tmp_path)) as made:
        assert made.notes[0] == NO_RUN
        home = tuple(joint.home for joint in ARM.joints)
        assert made.truth(0) == made.scene.truth(home)


def test_a_run_that_begins_later_is_shown_with_its_own_arm(tmp_path):
    with open_live("width=160,height=120,focal=160,clutter=0", str(tmp_path)) as made:
        made.capture(0)
        geared = read_arm(find_arm("geared"))
        rig = Rig(tmp_path, arm=geared, start=(0.5, 0.7))
        publisher = PoseWriter(rig.brick, "mine.py", str(tmp_path))
        rig.world.bodies.append(publisher.advance)
        rig.world.sleep(0.05)
        made.capture(1)
        assert made.scene.arm.name == "geared"
        assert made.truth(1) == made.scene.truth((0.5, 0.7))
        assert made.notes[0].startswith("shows mine.py")
        publisher.close()
        made.capture(2)
        assert "has ended" in made.notes[0]
        assert made.truth(2) == made.scene.truth((0.5, 0.7))


def test_two_cameras_see_one_arm_in_space_from_above_and_from_the_side(tmp_path):
    q = (0.5, 0.9, -1.1)
    spatial = read_arm(find_arm("spatial"))
    rig = Rig(tmp_path, arm=spatial, start=q)
    publisher = PoseWriter(rig.brick, "mine.py", str(tmp_path))
    rig.world.bodies.append(publisher.advance)
    rig.world.sleep(0.05)
    text = "width=320,height=240,focal=325,clutter=0,B.noise=0"
    with open_live(text, str(tmp_path)) as a, open_live(text, str(tmp_path), "B") as b:
        assert (a.name, b.name) == ("synthetic A", "synthetic B")
        for name, made in ("A", a), ("B", b):
            assert made.scene.arm.name == "spatial"
            assert made.constants["marker"] == "ball"
            own = Scene(spatial, read_scene(text, name))
            for marker, place in own.truth(rig.brick.plant.q).items():  # it sinks ever so slowly
                # (Frame 0 may be of a time before that of the newest pose.)
                assert made.truth(1000)[marker] == pytest.approx(place, abs=1e-3)
            assert made.capture(0).image.shape == (240, 320, 3)
        assert math.dist(a.truth(0)["effector"], b.truth(0)["effector"]) > 5
        assert (a.constants["noise"], b.constants["noise"]) == (2, 0)
    publisher.close()


def test_an_arm_in_space_that_begins_later_carries_a_ball(tmp_path):
    with open_live("width=160,height=120,focal=160,clutter=0", str(tmp_path)) as made:
        assert made.scene.constants["marker"] == "disc"
        rig = Rig(tmp_path, arm=read_arm(find_arm("spatial")))
        publisher = PoseWriter(rig.brick, "mine.py", str(tmp_path))
        rig.world.bodies.append(publisher.advance)
        rig.world.sleep(0.05)
        made.capture(1)
        assert made.scene.constants["marker"] == "ball"
        publisher.close()


def test_the_world_waits_for_every_picture_until_it_has_been_looked_at(tmp_path, monkeypatch):
    clock = WaitingClock(0.0)
    monkeypatch.setattr(pace, "wall", SimpleNamespace(monotonic=clock.now, sleep=clock.sleep))
    world = PacedClock(str(tmp_path))
    text = "width=160,height=120,focal=160,clutter=0,fps=10,jitter=0,fps_wander=0"
    with open_live(text, str(tmp_path)) as made:
        made.read(9.0)
        clock.sleep(60.0)
        begin = world.now()
        assert begin == pytest.approx(clock.now()), "who has not said so is not waited for"
        made.keep_pace()
        for _ in range(3):
            frame = made.read(9.0)
            due = made.due(frame.index)
            assert due <= world.now() <= due + 0.01
            clock.sleep(60.0)  # it is looked at
            assert world.now() == pytest.approx(due + 0.01)
            assert world.latest.startswith("synthetic A (process ")
        assert made.read(9.0).index == frame.index + 1, "none was left out"
    end = world.now()
    clock.sleep(60.0)
    assert world.now() == pytest.approx(end + 60.0), "it is closed"
    world.close()


def test_a_camera_tells_of_a_computer_that_is_busy(tmp_path, monkeypatch):
    clock = WaitingClock(0.0)
    monkeypatch.setattr(pace, "wall", SimpleNamespace(monotonic=clock.now, sleep=clock.sleep))
    with open_live("width=160,height=120,focal=160,clutter=0,fps=10", str(tmp_path)) as made:
        assert made.slowness == ""
        made.keep_pace()
        for _ in range(80):
            made.read(9.0)
            clock.sleep(0.2)
            made.slowness  # noqa: B018 (as whoever shows it does)
        assert made.slowness == "this computer is busy: running at 0.5 x"


@pytest.mark.long
def test_the_noise_of_two_cameras_is_not_the_same():
    plain = camera(CLEAN).capture(3).image.astype(int)
    noise = []
    for name in "AB":
        scene = Scene(ARM, read_scene("noise=3,jpeg=0,clutter=0", name))
        made = SyntheticCamera(scene, STILL, lambda: 0.0, start=0.0)
        noise.append(made.capture(3).image - plain)
        assert made.due(3) != camera().due(4)
    inside = (plain > 20) & (plain < 235)
    assert abs(np.corrcoef(*(n[inside] for n in noise))[0, 1]) < 0.05


def test_a_file_that_is_not_followed_is_named(tmp_path):
    (tmp_path / LIVE_FOLDER).mkdir()
    (tmp_path / LIVE_FOLDER / "1.txt").write_text("{}\n")
    with open_live("width=160,height=120,focal=160,clutter=0", str(tmp_path)) as made:
        assert "is not followed" in made.notes[1]
        assert made.notes[0] == NO_RUN


# One marker


@pytest.mark.parametrize(("jpeg", "noise", "most"), [(0, 0, 0.002), (0, 3, 0.05), (90, 3, 0.05)])
def test_a_lonely_disc_is_measured_where_it_was_put(jpeg, noise, most):
    draw = np.random.default_rng(5)
    for k in range(6):
        u, v = draw.uniform(60, 68, 2)
        image = marker_frame("disc", u, v, 12, noise=noise, jpeg=jpeg, seed=k)
        found = light_centroid(cv2.GaussianBlur(image, (0, 0), 0.1), (u, v), 15)
        assert found == pytest.approx((u, v), abs=most + (0.05 if noise else 0))


def test_a_lonely_marker_lies_on_the_given_background():
    ground = np.zeros((50, 90, 3), np.uint8)
    ground[:, 45:] = (10, 200, 90)
    image = marker_frame("disc", 45, 25, 8, "#0000ff", ground, noise=0)
    assert image.shape == ground.shape
    np.testing.assert_array_equal(image[:, :30], ground[:, :30])
    np.testing.assert_array_equal(image[25, 45], (255, 0, 0))


def test_a_lonely_ball_is_lit_and_has_a_highlight():
    image = marker_frame("ball", 64, 64, 20, "red", noise=0).astype(int)
    assert image[64, 50, 2] > image[64, 78, 2] + 20
    shine = image[44:84, 44:84].min(axis=2)
    v, u = np.unravel_index(shine.argmax(), shine.shape)
    assert shine.max() > 120
    assert (u + 44, v + 44) == pytest.approx((60, 61), abs=4)


@pytest.mark.parametrize("number", [0, 7])
def test_a_lonely_aruco_is_recognised_at_its_place(number):
    image = marker_frame("aruco", 63.4, 66.1, 22, number=number, noise=2, jpeg=90)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    assert ids.ravel().tolist() == [number]
    assert corners[0][0].mean(axis=0) == pytest.approx((63.4, 66.1), abs=0.6)
    # Upright: the first corner is the upper left one.
    assert corners[0][0][0] == pytest.approx((63.4 - 22, 66.1 - 22), abs=1.5)
