"""What the synthetic camera sees, against OpenCV's projection, exact areas and its own truth."""

import math

import cv2
import numpy as np
import pytest

from laptop.emulator.rendered_tracker import marker_specs
from laptop.emulator.scene.camera_placement import place_camera
from laptop.emulator.scene.marker_pictures import LoneMarker, marker_light
from laptop.emulator.scene.optics import (
    BadLens,
    Box,
    Pinhole,
    coverage,
    coverages,
    light_of,
    rectangle,
    to_linear,
    to_srgb,
)
from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import CAMERAS, CONSTANTS, MARKERS, BadScene, read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.emulator.scene.tabletop import _bricks
from laptop.emulator.scene.workcell import cameras, workcell
from laptop.see.markers.board import BOARDS
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
SPATIAL = read_arm(find_arm("spatial"))
PLAIN = "clutter=0,shadow=0,k1=0,tilt=0,rim=1.5,"
SIZE = (640, 480)


def scene(text=""):
    return Scene(ARM, read_scene(text))


@pytest.fixture(scope="module")
def plain():
    return scene(PLAIN)


@pytest.fixture(scope="module")
def furnished():
    return scene("seed=3")


def centroid(light, place, radius):
    """Centre of what is not the background, weighted by how much it is the marker (own oracle)."""
    u, v = (round(c) for c in place)
    r = math.ceil(radius)
    part = light[v - r : v + r + 1, u - r : u + r + 1].astype(float)
    ring = np.concatenate([part[0], part[-1], part[:, 0], part[:, -1]])
    ground, marker = np.median(ring, axis=0), part[r, r]
    alpha = (part - ground) @ (marker - ground) / ((marker - ground) @ (marker - ground))
    y, x = np.mgrid[v - r : v + r + 1, u - r : u + r + 1]
    return np.array([(alpha * x).sum(), (alpha * y).sum()]) / alpha.sum()


def radius_px(view, q, name):
    """How far the marker's rim is from its centre at most, px."""
    centre = view.centres(q)[name]
    wide = view.constants["marker_radius"] * np.array(
        [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]
    )
    return np.linalg.norm(view.project(centre + wide) - view.project(centre[None]), axis=1).max()


# Projection


@pytest.mark.parametrize(
    ("angles", "k1", "k2"),
    [
        ((0, 0, 0), 0, 0),
        ((25, 0, 0), -0.2, 0.05),
        ((55, 130, 40), 0.1, 0),
        ((80, -60, -170), -0.1, 0),
    ],
)
def test_points_project_as_opencv_has_it(angles, k1, k2):
    camera = Pinhole.aimed((3, 2, 0), 60, tuple(map(math.radians, angles)), 600, SIZE, k1, k2)
    points = np.random.default_rng(1).uniform(-12, 12, (200, 3)) + (3, 2, 0)
    matrix = np.array([[600, 0, 319.5], [0, 600, 239.5], [0, 0, 1.0]])
    turn, _ = cv2.Rodrigues(camera.rotation)
    shift = -camera.rotation @ camera.position
    expected, _ = cv2.projectPoints(points, turn, shift, matrix, np.array([k1, k2, 0, 0.0]))
    np.testing.assert_allclose(camera.project(points), expected.reshape(-1, 2), atol=1e-9)


def test_from_straight_above_x_points_right_and_y_up_and_what_is_higher_is_farther_out():
    camera = Pinhole.aimed((0, 0, 0), 50, (0, 0, 0), 500, SIZE)
    places = camera.project(np.array([(0, 0, 0), (1, 2, 0), (1, 2, 10)]))
    np.testing.assert_allclose(places, [(319.5, 239.5), (329.5, 219.5), (332.0, 214.5)])


def test_a_tilted_camera_stands_where_azimuth_says():
    camera = Pinhole.aimed((1, 2, 0), 10, (math.radians(90), math.radians(90), 0), 500, SIZE)
    np.testing.assert_allclose(camera.position, (11, 2, 0), atol=1e-12)
    camera = Pinhole.aimed((0, 0, 0), 10, (math.radians(30), 0, 0), 500, SIZE)
    np.testing.assert_allclose(camera.position, (0, -5, 10 * math.cos(math.radians(30))))


def test_a_rolled_camera_turns_the_picture_the_other_way():
    camera = Pinhole.aimed((0, 0, 0), 50, (0, 0, math.radians(90)), 500, SIZE)
    np.testing.assert_allclose(camera.project(np.array([(1, 0, 0)])), [(319.5, 229.5)], atol=1e-9)


@pytest.mark.short("-0.3")
@pytest.mark.parametrize("k1", [-0.3, 0.0, 0.2])
def test_every_ray_projects_to_its_pixel(k1):
    camera = Pinhole.aimed((3, 2, 0), 60, (0.5, 1, 2), 600, SIZE, k1)
    rays = camera.rays()
    seen = np.dstack([rays, np.ones(SIZE[::-1])]).reshape(-1, 3) * 40
    places = camera.project(seen @ camera.rotation + camera.position).reshape(480, 640, 2)
    v, u = np.mgrid[:480, :640]
    np.testing.assert_allclose(places, np.dstack([u, v]), atol=1e-3)


def test_what_the_lens_would_fold_back_lands_outside():
    camera = Pinhole.aimed((0, 0, 0), 50, (0, 0, 0), 600, SIZE, -0.3)
    far = camera.project(np.array([(500.0, 0, 0), (0, -2000, 0)]))
    assert far[0, 0] > 4000
    assert far[1, 1] > 20000


def test_a_lens_that_folds_the_picture_is_refused():
    with pytest.raises(BadLens, match="less distortion or a longer focal length"):
        Pinhole.aimed((0, 0, 0), 50, (0, 0, 0), 300, SIZE, -0.4)


@pytest.mark.short(every=3)
@pytest.mark.parametrize("seed", range(6))
def test_the_whole_workspace_is_in_the_picture(seed):
    draw = np.random.default_rng(seed)
    text = (
        f"tilt={draw.uniform(0, 55)},azimuth={draw.uniform(-180, 180)},clutter=0,"
        f"roll={draw.uniform(-180, 180)},focal={draw.uniform(500, 900)},"
        f"k1={draw.uniform(-0.2, 0.1)}"
    )
    view = scene(text)
    poses = [tuple(draw.uniform(j.lower, j.upper) for j in ARM.joints) for _ in range(300)]
    places = np.array([view.truth(q)["effector"] for q in poses])
    assert places.min() > 5
    assert (places.max(axis=0) < (635, 475)).all()
    # And no smaller than need be.
    assert np.ptp(places, axis=0)[1] > 300 or np.ptp(places, axis=0)[0] > 450


def test_a_placed_camera_stays_where_it_is_put():
    view = scene("distance=40,aim_x=5,aim_y=6,tilt=80,azimuth=90,clutter=0")
    np.testing.assert_allclose(view.project(np.array([(5, 6, 0)])), [(319.5, 239.5)], atol=1e-6)
    assert view.camera.position[0] == pytest.approx(5 + 40 * math.sin(math.radians(80)))


# Areas


def test_a_polygon_covers_pixels_by_its_area():
    square = np.array([(0.25, -0.5), (2.0, -0.5), (2.0, 1.0), (0.25, 1.0)])
    got = coverage([square], Box(0, 0, 4, 3))
    np.testing.assert_allclose(
        got, [(0.25, 1, 0.5, 0), (0.125, 0.5, 0.25, 0), (0, 0, 0, 0)], atol=1e-7
    )
    triangle = np.array([(-0.5, -0.5), (1.5, -0.5), (-0.5, 1.5)])
    np.testing.assert_allclose(coverage([triangle], Box(0, 0, 2, 2)), [(1, 0.5), (0.5, 0)])


@pytest.mark.short("0", "1")
@pytest.mark.parametrize("seed", range(5))
def test_a_polygon_covers_as_a_fine_raster_says(seed):
    draw = np.random.default_rng(seed)
    corners = cv2.convexHull(draw.uniform(-4, 14, (7, 2)).astype(np.float32)).reshape(-1, 2)
    fine, n = np.zeros((8, 9)), 64
    for i, row in enumerate(np.linspace(-0.5, 7.5, 8 * n, endpoint=False) + 0.5 / n):
        for j, column in enumerate(np.linspace(-0.5, 8.5, 9 * n, endpoint=False) + 0.5 / n):
            if (i * 7 + j) % 29 == 0:  # a sample of them is enough
                inside = cv2.pointPolygonTest(corners, (float(column), float(row)), False) > 0
                fine[i // n, j // n] += inside * 29 / n**2
    got = coverage([corners.astype(float)], Box(0, 0, 9, 8))
    np.testing.assert_allclose(got, fine, atol=0.06)


def test_groups_do_not_run_into_one_another():
    rings = [[rectangle(-3, -3, 2.2, 9)], [rectangle(1, 1, 40, 2)], [rectangle(50, 50, 60, 60)]]
    boxes = [Box(0, 0, 5, 4), Box(2, 0, 7, 3), Box(0, 0, 3, 3)]
    together = coverages(list(zip(rings, boxes)))
    for got, own, box in zip(together, rings, boxes):
        np.testing.assert_allclose(got, coverage(own, box), atol=1e-6)
    assert together[2].max() == 0
    np.testing.assert_allclose(together[0][:, 3], 0, atol=1e-6)


def test_overlapping_polygons_cover_a_pixel_once():
    got = coverage([rectangle(-1, -1, 1, 1), rectangle(1, 1, -1, -1)[::-1]], Box(0, 0, 3, 3))
    assert got.max() == 1


def test_light_and_srgb_are_inverse_to_one_another():
    values = np.arange(256)
    np.testing.assert_allclose(to_srgb(to_linear(values)), values, atol=1e-9)
    assert to_linear([188])[0] == pytest.approx(0.5, abs=0.005)
    np.testing.assert_allclose(to_srgb(light_of("red")), (0x1E, 0x14, 0xC8))


# Markers and their truth


@pytest.mark.parametrize("name", ["effector", "goal"])
def test_a_disc_seen_straight_on_has_its_centroid_at_its_true_place(plain, name):
    draw = np.random.default_rng(7)
    for _ in range(12):
        q = draw.uniform(0.2, 1.4), draw.uniform(-1.2, 1.2)
        light = plain.image(q)
        place = plain.truth(q)[name]
        assert plain.visible(q)[name] == pytest.approx(1, abs=1e-3)
        off = centroid(light, place, radius_px(plain, q, name) + 3) - place
        assert np.abs(off).max() < 0.002


def test_the_truth_is_the_projected_tip_at_the_markers_height(plain):
    q = (0.4, 0.9)
    x, y = kinematics.forward(ARM, q)
    expected = plain.camera.project(np.array([(x, y, plain.constants["marker_height"])]))[0]
    assert plain.truth(q)["effector"] == pytest.approx(tuple(expected))


def outline_centroid(view, name):
    """Centroid of a disc's outline as OpenCV projects it, by the shoelace formula."""
    camera, angle = view.camera, np.linspace(0, 2 * math.pi, 720, endpoint=False)
    wide = view.constants["marker_radius"]
    circle = np.stack([wide * np.cos(angle), wide * np.sin(angle), 0 * angle], axis=1)
    matrix = np.array([[camera.focal, 0, 319.5], [0, camera.focal, 239.5], [0, 0, 1.0]])
    places, _ = cv2.projectPoints(
        circle + view.centres((0, 0))[name],
        cv2.Rodrigues(camera.rotation)[0],
        -camera.rotation @ camera.position,
        matrix,
        np.array([camera.k1, camera.k2, 0, 0]),
    )
    a = places.reshape(-1, 2)
    b = np.roll(a, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    return ((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum())


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("text", "least", "most"),
    [
        ("tilt=20", 0.03, 0.12),
        ("tilt=40", 0.1, 0.25),
        ("tilt=55,focal=500,rim=3", 0.15, 0.4),
        ("tilt=0,k1=-0.25,focal=600,goal_x=-15,goal_y=12", 0.02, 0.15),
        ("tilt=45,azimuth=70,roll=-30,k1=-0.2,k2=0.05", 0.03, 0.3),
    ],
)
def test_seen_at_an_angle_a_discs_centroid_is_off_by_what_perspective_says(text, least, most):
    # The nearer half of a disc takes more room, so its centroid is not where its centre is.
    view = scene(PLAIN + text)
    place = view.truth((0, 0))["goal"]
    found = centroid(view.image((1, 1)), place, radius_px(view, (0, 0), "goal") + 1.5)
    expected = outline_centroid(view, "goal")
    assert found == pytest.approx(expected, abs=0.004)
    assert least < math.dist(expected, place) < most


def test_a_ball_is_seen_around_its_centre_and_lit_from_the_left():
    view = scene("marker=ball,k1=0,tilt=35,clutter=0,shadow=0,gradient=0")
    light = view.image((1.0, 0.8))
    u, v = (round(c) for c in view.truth((1.0, 0.8))["goal"])
    r = round(radius_px(view, (1.0, 0.8), "goal"))
    green = light[v, u - r - 2 : u + r + 3, 2] < 0.5 * light[v, u - 3 * r, 2]
    assert abs(green[: r + 2].sum() - green[r + 3 :].sum()) <= 1
    assert light[v, u - r // 2, 1] > 1.15 * light[v, u + r // 2, 1]


def test_a_balls_centre_is_a_radius_above_what_it_lies_on():
    view = scene("marker=ball,clutter=0,marker_radius=1.3,goal_x=4,goal_y=5")
    centres = view.centres((0.0, 0.0))
    assert tuple(centres["goal"]) == (4, 5, 1.3)
    assert centres["effector"][2] == pytest.approx(2.5 + 1.3)


def test_an_aruco_marker_is_recognised_with_its_centre_at_its_true_place():
    view = scene("marker=aruco,clutter=0,marker_radius=1.6")
    q = (0.7, 0.9)
    image = np.round(to_srgb(view.image(q))).astype(np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    found = {int(number): places[0].mean(axis=0) for number, places in zip(ids.ravel(), corners)}
    truth = view.truth(q)
    assert view.visible(q) == pytest.approx({"effector": 1, "goal": 1}, abs=1e-3)
    assert sorted(found) == [0, 1]
    assert found[0] == pytest.approx(truth["effector"], abs=0.5)
    assert found[1] == pytest.approx(truth["goal"], abs=0.5)


def test_without_a_goal_there_is_none():
    view = scene("goal=none,clutter=0")
    assert list(view.truth((0, 0))) == ["effector"]
    assert list(view.visible((0, 0))) == ["effector"]


@pytest.mark.parametrize(("u", "v"), [(40.0, 35.0), (41.3, 33.8), (38.5, 36.25)])
def test_a_lonely_disc_is_where_it_is_put(u, v):
    ground = np.full((70, 80, 3), 0.3)
    weight = np.abs(marker_light(LoneMarker("disc", 12), (u, v), ground) - ground).sum(axis=2)
    y, x = np.mgrid[:70, :80]
    assert (weight * x).sum() / weight.sum() == pytest.approx(u, abs=1e-3)
    assert (weight * y).sum() / weight.sum() == pytest.approx(v, abs=1e-3)
    assert weight.sum() == pytest.approx(np.abs(light_of("red") - 0.3).sum() * math.pi * 144, 1e-3)


def test_a_moving_marker_is_drawn_out_around_its_middle():
    ground = np.zeros((60, 80, 3))
    light = marker_light(LoneMarker("disc", 8, np.ones(3)), (40.2, 30.0), ground, motion=(9, 0))[
        ..., 0
    ]
    y, x = np.mgrid[:60, :80]
    assert (light * x).sum() / light.sum() == pytest.approx(40.2, abs=1e-3)
    assert light.sum() == pytest.approx(math.pi * 64, rel=1e-3)
    spread = (light * (x - 40.2) ** 2).sum() / light.sum()
    # A disc's own variance r^2 / 4 and that of an even motion, d^2 / 12; pixels add 1 / 12.
    assert spread == pytest.approx(16 + 81 / 12 + 1 / 12, rel=0.01)


# What hides them


def test_markers_are_visible_unless_something_is_in_the_way(plain):
    assert plain.visible((0.4, 0.9)) == pytest.approx({"effector": 1, "goal": 1}, abs=1e-3)
    # The elbow over the goal.
    over = math.atan2(-9, 12)
    assert plain.visible((over, 0.0))["goal"] < 0.8
    assert plain.visible((over, 0.0))["effector"] == pytest.approx(1, abs=1e-3)


def test_beyond_the_edge_is_not_visible():
    view = scene("goal_x=-60,goal_y=0,clutter=0")
    assert view.visible((0, 0))["goal"] == 0


def test_a_hand_hides_the_goal_and_the_next_time_the_tip():
    view = scene("occlusion=4,clutter=0")
    q = (1.0, 0.5)
    assert view.visible(q, 1.0) == pytest.approx({"effector": 1, "goal": 1}, abs=1e-3)
    assert view.visible(q, 3.0)["goal"] == 0
    assert view.visible(q, 7.0)["effector"] == 0
    u, v = (round(c) for c in view.truth(q)["goal"])
    green = light_of("green")
    before, hidden = view.image(q, t=1.0)[v, u], view.image(q, t=3.0)[v, u]
    np.testing.assert_allclose(before, green, rtol=0.02)
    assert np.abs(hidden - green).max() > 0.2
    assert view.visible(q, 4.2) == view.visible(q, 1.0)


# The rest of the picture


def hues(light):
    """Hue (deg) where there is one."""
    hsv = cv2.cvtColor(np.float32(to_srgb(light) / 255), cv2.COLOR_BGR2HSV)
    return hsv[..., 0][(hsv[..., 1] > 0.5) & (hsv[..., 2] > 0.25)]


def test_clutter_comes_from_the_seed(furnished):
    again, other = scene("seed=3"), scene("seed=4")
    np.testing.assert_array_equal(furnished.ground, again.ground)
    assert (furnished.ground != other.ground).mean() > 0.2


def test_no_brick_has_a_markers_colour_unless_decoys_are_asked_for():
    text = "clutter=20,goal=none,effector=green,seed=3"
    view, decoyed = scene(text), scene(text + ",decoys=8")
    near = [((hues(v.ground) > 125) & (hues(v.ground) < 165)).sum() for v in (view, decoyed)]
    assert near[0] == 0
    assert near[1] > 100


def test_the_beams_are_grey_where_a_marker_is_yellow():
    yellow = []
    for word in ("blue", "yellow"):
        view = scene(f"clutter=0,effector={word},goal=none,marker_radius=0.1")
        yellow.append(((hues(view.image((0.5, 0.5))) // 20) == 2).sum())
    assert yellow[0] > 500
    assert yellow[1] < 50


def test_the_arm_casts_a_shadow_on_the_paper():
    q = (0.6, 1.0)
    view = scene("clutter=0,shadow=0.5")
    ratio = view.image(q)[..., 1] / view.ground[..., 1]
    # The lamp is up at (-0.38, 0.30, 0.875): the marker's shadow falls the other way.
    x, y, z = view.centres(q)["effector"]
    fallen = view.project(np.array([(x + z * 0.38 / 0.875, y - z * 0.30 / 0.875, 0)]))[0]
    beyond = fallen + (6, 6)
    assert ratio[tuple(np.round(beyond).astype(int)[::-1])] == pytest.approx(0.5, abs=0.02)
    assert 300 < (ratio < 0.6).sum() < 20000


INK = [(10 - 0.1 * k, 0.2 * k, 9.9 - 0.1 * k, 0.2 * (k + 1)) for k in range(50)]


def test_ink_is_dark_where_it_was_drawn_and_only_there():
    view = scene("clutter=0")
    bare = view.image((-0.8, -0.5))
    drawn = view.image((-0.8, -0.5), INK)
    u, v = np.round(view.project(np.array([(7.5, 5.0, 0)]))[0]).astype(int)
    assert drawn[v - 1 : v + 2, u - 1 : u + 2].min() < 0.5 * bare[v, u].min()
    # Its width times its length, in px.
    darker = (1 - drawn / bare).sum() / 3
    (u0, v0), (u1, v1) = view.project(np.array([(10.0, 0, 0), (5.0, 10.0, 0)]))
    assert darker == pytest.approx(math.hypot(u1 - u0, v1 - v0) * 1.5, rel=0.25)


def test_ink_laid_bit_by_bit_is_the_same_and_can_be_taken_back():
    once, bit_by_bit = scene("clutter=0"), scene("clutter=0")
    q = (0.6, 1.0)
    bare = once.image(q)
    expected = once.image(q, INK)
    for count in (7, 8, 30, 50):
        got = bit_by_bit.image(q, INK[:count])
    np.testing.assert_allclose(got, expected, atol=1e-6)
    np.testing.assert_array_equal(bit_by_bit.image(q, []), bare)
    np.testing.assert_allclose(bit_by_bit.image(q, INK[::-1]), expected, atol=1e-5)


def test_the_patch_holds_all_that_moves(furnished):
    image = furnished.image((0.6, 1.0))
    patch = furnished.patch([(0.6, 1.0)], [], 0.0)
    changed = np.argwhere((image != furnished.ground).any(axis=2))
    (top, left), (bottom, right) = changed.min(axis=0), changed.max(axis=0)
    assert patch.inner.left <= left
    assert patch.inner.top <= top
    assert patch.inner.right > right
    assert patch.inner.bottom > bottom


def test_several_poses_of_one_exposure_are_averaged(furnished):
    poses = [(0.6, 1.0), (0.63, 1.0), (0.66, 1.02)]
    patch = furnished.patch(poses, [], 0.0)
    expected = np.mean([patch.outer.cut(furnished.image(q)) for q in poses], axis=0)
    np.testing.assert_allclose(patch.pixels, expected, atol=1e-5)


# In space


def in_space(text="", camera="A"):
    return Scene(SPATIAL, read_scene(text, camera))


def poses_above_the_table(seed, count, arm=SPATIAL):
    draw = np.random.default_rng(seed)
    while count:
        q = tuple(draw.uniform(joint.lower, joint.upper) for joint in arm.joints)
        if kinematics.forward(arm, q)[2] > 1.5:
            count -= 1
            yield q


def test_in_space_the_tip_is_the_balls_centre_and_the_goal_stands_where_it_is_said():
    q = (0.3, 0.9, -1.2)
    base, up, bend = q
    out = 11.3 * math.cos(up) + 9.5 * math.cos(up + bend)
    height = 12 + 11.3 * math.sin(up) + 9.5 * math.sin(up + bend)
    expected = out * math.cos(base), out * math.sin(base), height
    constants = read_scene("goal_x=7,goal_y=-4,goal_z=6.5")
    np.testing.assert_allclose(workcell(SPATIAL, constants).tip_marker(q), expected)
    centres = Scene(SPATIAL, constants).centres(q)
    np.testing.assert_allclose(centres["effector"], expected)
    assert tuple(centres["goal"]) == (7, -4, 6.5)


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("tilt", "azimuth", "roll"), [(15, 0, 0), (90, 0, 0), (90, -50, 0), (60, 140, 35), (0, 20, -90)]
)
def test_truth_is_what_a_pinhole_at_the_place_sees(tilt, azimuth, roll):
    """Plain numpy: where the camera stands, what it looks along, and Brown's distortion."""
    text = f"tilt={tilt},azimuth={azimuth},roll={roll},aim_x=3,aim_y=-2,aim_z=14,distance=60,k1=-.1"
    t, a, r = np.radians([tilt, azimuth, roll])
    away = np.array([math.sin(a) * math.sin(t), -math.cos(a) * math.sin(t), math.cos(t)])
    right = np.array([math.cos(a), math.sin(a), 0])
    up = np.cross(away, right)
    right, up = math.cos(r) * right - math.sin(r) * up, math.cos(r) * up + math.sin(r) * right
    view = in_space(text + ",clutter=0,focal=600")
    for q in poses_above_the_table(3, 20):
        seen = np.array(kinematics.forward(SPATIAL, q)) - ((3, -2, 14) + 60 * away)
        x, y = seen @ right / -(seen @ away), -(seen @ up) / -(seen @ away)
        bent = 600 * (1 - 0.1 * (x * x + y * y))
        expected = 319.5 + bent * x, 239.5 + bent * y
        assert view.truth(q)["effector"] == pytest.approx(expected, abs=1e-6)


def test_a_looks_from_above_and_b_from_the_side():
    above, side = (place_camera(SPATIAL, read_scene("", name)) for name in "AB")
    x_y_z = np.array([(5, 0, 15), (15, 0, 15), (5, 10, 15), (5, 0, 25.0)])
    start, *ends = above.project(x_y_z)
    right, forth, high = (end - start for end in ends)
    assert right[0] > 60 > 3 * abs(right[1])
    assert -forth[1] > 60 > 3 * abs(forth[0])
    assert np.hypot(*high) < 50
    start, *ends = side.project(x_y_z)
    right, forth, high = (end - start for end in ends)
    assert right[0] > 60 > 3 * abs(right[1])
    assert -high[1] > 60 > 3 * abs(high[0])
    assert np.hypot(*forth) < 50


@pytest.mark.short("0", "1")
@pytest.mark.parametrize("seed", range(6))
def test_all_of_the_workspace_above_the_table_is_in_the_picture(seed):
    draw = np.random.default_rng(seed)
    text = (
        f"tilt={draw.uniform(0, 90)},azimuth={draw.uniform(-180, 180)},"
        f"roll={draw.uniform(-180, 180)},focal={draw.uniform(500, 900)},"
        f"k1={draw.uniform(-0.1, 0.1)}"
    )
    camera = place_camera(SPATIAL, read_scene(text))
    tips = np.array([kinematics.forward(SPATIAL, q) for q in poses_above_the_table(seed, 400)])
    places = camera.project(tips)
    assert places.min() > 8
    assert (places.max(axis=0) < (632, 472)).all()
    assert np.ptp(places, axis=0)[1] > 300 or np.ptp(places, axis=0)[0] > 450


@pytest.mark.parametrize("name", "ABC")
def test_a_camera_at_a_distance_has_the_workspace_in_the_middle(name):
    camera = place_camera(SPATIAL, read_scene("distance=90", name))
    places = camera.project(np.array([kinematics.forward(SPATIAL, q) for q in corners(SPATIAL)]))
    assert (places.min(axis=0) + places.max(axis=0)) / 2 == pytest.approx((319.5, 239.5), abs=12)


def corners(arm):
    """Poses all over the joints' ranges whose tip is above the table."""
    ranges = [np.linspace(joint.lower, joint.upper, 15) for joint in arm.joints]
    poses = np.stack(np.meshgrid(*ranges), axis=-1).reshape(-1, 3)
    return [q for q in poses if kinematics.forward(arm, q)[2] >= 0]


def test_a_camera_amid_the_workspace_still_looks_at_it():
    view = in_space("distance=25,clutter=0", "D")
    (u, v), _ = view.project(np.array([(0, 0, 14.0), (0, 0, 0)]))
    assert 0 < u < 640
    assert 0 < v < 480


@pytest.mark.long
@pytest.mark.parametrize("name", "ABC")
def test_the_tracker_finds_the_balls_where_they_truly_are(name):
    view = in_space("clutter=6", name)
    poses = list(poses_above_the_table(11, 24))
    camera = SyntheticCamera(view, ScriptedPoses(SPATIAL, lambda t: poses[round(30 * t)]), start=0)
    camera.constants["exposure"] = camera.constants["fps_wander"] = 0.0
    off = {"effector": [], "goal": []}
    for index, q in enumerate(poses):
        tracker = Tracker([read_spec(*look) for look in marker_specs(view.constants).items()])
        found = tracker.find(camera.capture(index).image, 0.0)
        for marker, part in view.visible(q).items():
            if part > 0.98:
                assert found[marker] is not None, (marker, q)
                seen = found[marker].u, found[marker].v
                off[marker].append(math.dist(seen, view.truth(q)[marker]))
            elif part < 0.02:
                assert found[marker] is None, (marker, q)
    # Shading and what is behind pull at a ball, as at one in the plane.
    for distances in off.values():
        assert len(distances) >= 8
        assert np.median(distances) < 0.45
        assert max(distances) < 1.5


def test_the_goal_behind_the_arm_is_hidden_and_before_it_is_not():
    # Half way along the forearm, nearer to the camera and farther away.
    q = (0.0, 0.7, -1.2)
    _, _, elbow, tip = np.array(kinematics.joint_positions(SPATIAL, q))
    x, _, z = (elbow + tip) / 2
    for y, least, most in ((-4, 0.99, 1.01), (4, 0.0, 0.6)):
        view = in_space(f"goal_x={x},goal_y={y},goal_z={z},aim_z={z},aim_x={x},distance=60", "B")
        assert least < view.visible(q)["goal"] < most
        u, v = (round(c) for c in view.truth(q)["goal"])
        green = hues(view.image(q)[v - 2 : v + 3, u - 2 : u + 3])
        assert ((green > 120) & (green < 170)).sum() == (25 if least else 0)


@pytest.mark.long
@pytest.mark.parametrize("camera", "AB")
def test_who_reaches_the_goal_is_seen_over_it_and_hidden_only_from_farther_away(camera):
    q = (0.3, 0.8, -0.9)
    tip = np.array(kinematics.forward(SPATIAL, q))
    direction = tip - in_space("", camera).camera.position
    direction = direction / np.linalg.norm(direction)
    for before, least, most in ((0.3, 0.9, 1.01), (2.1, 0.9, 1.01), (2.3, 0.0, 0.1)):
        x, y, z = tip - before * direction
        scene = in_space(f"goal_x={x},goal_y={y},goal_z={z}", camera)
        assert least <= scene.visible(q)["effector"] <= most


def test_seen_from_the_side_there_is_a_wall_behind_the_table():
    view = in_space("clutter=0,goal=none", "B")
    wall = view.ground[:200].reshape(-1, 3)
    np.testing.assert_allclose(wall, np.broadcast_to(light_of("#8d9299"), wall.shape), rtol=1e-5)
    far, near = np.round(view.project(np.array([(0, 60.0, 0), (0, 40.0, 0)]))).astype(int)
    np.testing.assert_allclose(view.ground[far[1], far[0]], light_of("#8d9299"), rtol=1e-5)
    blue, _, red = view.ground[near[1], near[0]]
    assert red > 2 * blue


def test_in_space_too_shadows_and_ink_are_on_the_table():
    view = in_space("clutter=0,goal=none,shadow=0.5")
    q = (0.6, 0.9, -0.9)
    x, y, z = kinematics.forward(SPATIAL, q)
    fallen = view.project(np.array([(x + z * 0.38 / 0.875, y - z * 0.30 / 0.875, 0)]))[0]
    u, v = np.round(fallen).astype(int)
    assert (view.image(q) / view.ground)[v, u] == pytest.approx(0.5, abs=0.1)
    drawn = view.image((-1.5, 1.0, -1.0), INK)
    u, v = np.round(view.project(np.array([(7.5, 5.0, 0)]))[0]).astype(int)
    assert drawn[v - 1 : v + 2, u - 1 : u + 2].min() < 0.5 * view.image((-1.5, 1, -1))[v, u].min()


@pytest.mark.short("B")
@pytest.mark.parametrize("name", "AB")
def test_in_space_a_hand_hides_the_goal_and_the_next_time_the_tip_from_every_camera(name):
    view = in_space("occlusion=4,clutter=0", name)
    q = (0.5, 0.8, -1.0)
    assert min(view.visible(q, 1.0).values()) > 0.9
    assert view.visible(q, 3.0)["goal"] < 0.01
    assert view.visible(q, 7.0)["effector"] < 0.01


def test_clutter_lies_beyond_what_an_arm_in_space_reaches():
    view = in_space("clutter=30,decoys=5")
    places = [place for _, place in _bricks(view.cell, np.random.default_rng(2))]
    assert len(places) == 35
    assert min(np.hypot(x, y) for x, y, _ in places) > 11.3 + 9.5 + 2


# Constants


def test_what_is_written_for_one_camera_is_its_alone():
    text = "B.tilt=80,focal=500,B.focal=450,A.noise=1"
    a, b, c = (read_scene(text, name) for name in "ABC")
    assert [v["focal"] for v in (a, b, c)] == [500, 450, 500]
    assert [v["tilt"] for v in (a, b, c)] == [None, 80, None]
    assert [v["noise"] for v in (a, b, c)] == [1, 2, 2]
    assert read_scene("B.focal=450,focal=500", "B")["focal"] == 450
    assert [v["camera"] for v in (a, b, c)] == ["A", "B", "C"]


def test_there_are_as_many_cameras_as_the_arm_needs_and_the_text_names():
    assert cameras(ARM) == "A"
    assert cameras(SPATIAL, "tilt=20") == "AB"
    assert cameras(SPATIAL, "C.tilt=45, B.tilt=80") == "ABC"
    assert cameras(ARM, "B.tilt=45") == "AB"
    with pytest.raises(BadScene, match=r"no constant 'C\.tlit'"):
        cameras(SPATIAL, "C.tlit=45")


@pytest.mark.parametrize(
    ("arm", "text", "reason"),
    [
        (SPATIAL, "marker=disc", ["marker = disc", "not seen from the side", "marker=ball"]),
        (SPATIAL, "marker=aruco", ["marker = aruco", "not seen from the side"]),
        (SPATIAL, "tilt=90,aim_z=-3,distance=60", ["camera A", "3.0 cm below the table", "aim_z"]),
        (ARM, "goal_z=4", ["goal_z = 4", "planar", "leave goal_z out"]),
        (ARM, "tilt=90", ["tilt = 90", "at most 85", "planar"]),
    ],
)
def test_what_an_arm_cannot_be_shown_with_is_refused_in_one_line(arm, text, reason):
    with pytest.raises(BadScene) as caught:
        place_camera(arm, read_scene(text))
    message = str(caught.value)
    assert "\n" not in message
    for word in reason:
        assert word in message


def test_the_constants_are_the_defaults_with_what_is_given():
    values = read_scene(" tilt=40 , marker=ball,seed=7,")
    assert (values["tilt"], values["marker"], values["seed"]) == (40.0, "ball", 7)
    assert values["fps"] == CONSTANTS["fps"].default
    assert sorted(values) == sorted([*CONSTANTS, "camera"])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("tlit=3", ["tlit", "known:", "tilt"]),
        ("tilt", ["tilt", "write tilt=VALUE"]),
        ("tilt=steep", ["tilt = steep", "0 to 90 deg"]),
        ("tilt=nan", ["tilt = nan", "0 to 90"]),
        ("tilt=91", ["tilt = 91", "0 to 90"]),
        ("jpeg=90.5", ["jpeg = 90.5", "whole number from 0 to 100"]),
        ("marker=cube", ["marker = cube", ", ".join(MARKERS)]),
        ("goal=invisible", ["goal = invisible", "green", "none"]),
        ("fps=100,exposure=0.02", ["exposure = 0.02", "1/fps", "0.0100 s"]),
        ("occlusion=1", ["occlusion = 1", "0 (never) or from 2"]),
        ("B.tilt=95", ["B.tilt = 95", "0 to 90"]),
        ("J.tilt=9", ["J.tilt", "no camera 'J'", "A, B, C"]),
        (".tilt=9", ["'.tilt'", "no camera ''"]),
        ("B.goal_x=9", ["B.goal_x", "all cameras see the same goal_x", "goal_x=VALUE"]),
        ("B.tlit=9", ["B.tlit", "no constant", "tilt"]),
        ("B.tilt", ["B.tilt", "write B.tilt=VALUE"]),
    ],
)
def test_a_wrong_constant_is_refused_in_one_line(text, reason):
    with pytest.raises(BadScene) as caught:
        read_scene(text)
    message = str(caught.value)
    assert "\n" not in message
    for word in reason:
        assert word in message


def test_every_default_is_allowed():
    for key, constant in CONSTANTS.items():
        if constant.default is not None:
            assert read_scene(f"{key}={constant.default}")[key] == constant.default


@pytest.mark.long
def test_no_two_cameras_on_an_arm_in_space_stand_at_one_place():
    places = [place_camera(SPATIAL, read_scene("", name)).position for name in CAMERAS]
    apart = [math.dist(a, b) for k, a in enumerate(places) for b in places[:k]]
    assert len(places) == 8
    assert min(apart) > 20


# ---- a marker beside the pen, and the board


def test_a_marker_sits_beside_the_pen_as_the_arms_file_says():
    offset = (0.6, -0.25)
    q, bare = (0.4, -0.9), Scene(ARM, read_scene(PLAIN))
    moved = Scene(ARM._replace(marker_offset=offset), read_scene(PLAIN))
    x, y, z = bare.centres(q)["effector"]
    link = np.array([math.cos(q[0] + q[1]), math.sin(q[0] + q[1])])
    left = np.array([-link[1], link[0]])
    there = np.array([x, y]) + offset[0] * link + offset[1] * left
    assert moved.centres(q)["effector"] == pytest.approx([*there, z])
    light = moved.image(q)
    radius = 1.1 * 650 / moved.camera.position[2]
    seen = centroid(light, moved.truth(q)["effector"], radius * 1.4)
    assert math.dist(seen, moved.truth(q)["effector"]) < 0.3


def test_in_space_it_is_along_the_last_link_and_upwards_of_it():
    q = (0.5, 0.7, -0.9)
    tip, elbow = (np.array(p) for p in kinematics.joint_positions(SPATIAL, q)[:1:-1][:2])
    along = (tip - elbow) / np.linalg.norm(tip - elbow)
    side = np.array([-math.sin(q[0]), math.cos(q[0]), 0])
    up = np.cross(along, side)
    moved = Scene(SPATIAL._replace(marker_offset=(0.5, 0.3)), read_scene())
    assert moved.centres(q)["effector"] == pytest.approx(tip + 0.5 * along + 0.3 * up)
    assert up[2] > 0


def test_a_stray_marker_is_so_far_off_where_the_seed_has_it():
    q = (0.4, -0.9)
    places = [scene(f"marker_stray=0.4,seed={k}").centres(q)["effector"][:2] for k in range(3)]
    tip = scene().centres(q)["effector"][:2]
    assert [math.dist(place, tip) for place in places] == pytest.approx([0.4] * 3)
    assert len({tuple(np.round(place, 6)) for place in places}) == 3


def test_the_board_lies_where_it_is_said_and_is_seen_there():
    place = scene("board=letter,board_x=9,board_y=-1,board_turn=20,board_scale=0.9,clutter=0")
    image = np.round(to_srgb(place.image((2.5, 1.0)))).astype(np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    quads, numbers, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)
    board = BOARDS["letter"]
    assert len(numbers) >= 15
    assert set(numbers.ravel()) <= set(board.numbers)
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    for quad, number in zip(quads, numbers.ravel()):
        x, y = 0.9 * board.centres[number - board.first]
        there = place.project(np.array([(9 + c * x - s * y, -1 + s * x + c * y, 0.0)]))[0]
        assert quad[0].mean(axis=0) == pytest.approx(there, abs=1.5)


def test_without_a_board_there_is_none():
    image = np.round(to_srgb(scene("clutter=0").image((2.5, 1.0)))).astype(np.uint8)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    assert cv2.aruco.ArucoDetector(dictionary).detectMarkers(image)[1] is None


@pytest.mark.parametrize("text", ["board=a3", "board_turn=200", "marker_stray=3", "A.board=a4"])
def test_a_board_or_offset_that_cannot_be_is_refused(text):
    with pytest.raises(BadScene):
        read_scene(text)
