"""Bodies in space: what hides what, against rays that are followed to the first body they meet."""

import math

import cv2
import numpy as np
import pytest

from laptop.emulator.scene.items import stadium
from laptop.emulator.scene.marker_items import ball_contour, marker_items
from laptop.emulator.scene.optics import LAMP, Pinhole, circle, light_of
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.skeleton import Skeleton, ball_stand
from laptop.emulator.scene.solids import ball, box, in_order, prism, solid
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("spatial"))
BARE = "clutter=0,shadow=0,k1=0,"


def met(body, eye, rays):
    """How far along each ray (n, 3) it enters a body, inf where it misses (own oracle)."""
    first = body.items[0]
    if first.ball:
        centre, radius = first.ball
        along = rays @ (centre - eye)
        square = along**2 - (centre - eye) @ (centre - eye) + radius**2
        return np.where(square > 0, along - np.sqrt(np.maximum(square, 0)), np.inf)
    # A prism: between two planes, and within those through the edges of its outline.
    low, high = np.split(first.rings[0], 2)
    across = (high[0] - low[0]) / np.linalg.norm(high[0] - low[0])
    planes = [(across, across @ high[0]), (-across, -across @ low[0])]
    for a, b in zip(low, np.roll(low, -1, axis=0)):
        outward = np.cross(b - a, across)
        outward *= np.sign(outward @ (a - low.mean(axis=0)))
        planes.append((outward, outward @ a))
    enters, leaves = np.zeros(len(rays)), np.full(len(rays), np.inf)
    for normal, limit in planes:
        slope, room = rays @ normal, limit - normal @ eye
        with np.errstate(divide="ignore"):
            crossed = room / slope
        leaves = np.where(slope > 0, np.minimum(leaves, crossed), leaves)
        enters = np.where(slope < 0, np.maximum(enters, crossed), enters)
        leaves = np.where((slope == 0) & (room < 0), -1.0, leaves)
    return np.where(enters < leaves, enters, np.inf)


def rays_through(camera, places):
    """Unit directions (n, 3) in the world of pixels (n, 2), without distortion."""
    rays = np.c_[(places - camera.centre) / camera.focal, np.ones(len(places))] @ camera.rotation
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def bodies(view, q):
    """All bodies in a scene, and which of them are the markers."""
    eye, centres = view.camera.position, view.centres(q)
    held = [*view.cell.skeleton.solids(q, eye), *ball_stand(centres["goal"], 1.1, eye)]
    balls = {
        name: ball(*marker_items(view.constants, name, centre, 0.0, view.camera))
        for name, centre in centres.items()
    }
    return [*held, *balls.values()], balls


def poses(seed, count):
    draw = np.random.default_rng(seed)
    while count:
        q = tuple(draw.uniform(joint.lower, joint.upper) for joint in ARM.joints)
        # Beside the foot, and not through the table.
        x, y, z = kinematics.forward(ARM, q)
        if z > 2 and math.hypot(x, y) > 5:
            count -= 1
            yield q


VIEWS = [("A", ""), ("B", ""), ("C", ""), ("B", "azimuth=130,tilt=75,roll=30"), ("A", "tilt=0")]


@pytest.mark.long
@pytest.mark.parametrize(("camera", "text"), VIEWS)
def test_what_is_painted_last_is_what_a_ray_meets_first(camera, text):
    view = Scene(ARM, read_scene(BARE + text, camera))
    u, v = np.meshgrid(np.arange(100, 540, 7), np.arange(20, 470, 7))
    places = np.stack([u.ravel(), v.ravel()], axis=1).astype(float)
    rays = rays_through(view.camera, places)
    wrong = total = 0
    for q in poses(4, 5):
        ordered = in_order(bodies(view, q)[0], view.camera)
        first = np.argmin([met(body, view.camera.position, rays) for body in ordered], axis=0)
        painted = np.full(len(places), -1)
        for k, body in enumerate(ordered):
            outline = view.painter.outlines(body.items[:1])[0][0].astype(np.float32)
            inside = [cv2.pointPolygonTest(outline, place, False) > 0 for place in places]
            painted[inside] = k
        shown = painted >= 0
        wrong += (first != painted)[shown].sum()
        total += shown.sum()
    assert total > 500
    # Two that touch, as a ball and what holds it, may be taken for one another at their border.
    assert wrong < 0.002 * total


@pytest.mark.long
@pytest.mark.parametrize(("camera", "text"), VIEWS)
def test_the_part_of_a_ball_that_is_visible_is_what_rays_say(camera, text):
    view = Scene(ARM, read_scene(f"{BARE}goal_x=10,goal_y=3,goal_z=8,{text}", camera))
    share = circle(1.0, 40)
    disc = np.concatenate([share * math.sqrt((k + 0.5) / 25) for k in range(25)])
    hidden = 0
    for q in poses(10, 16):
        every, balls = bodies(view, q)
        visible = view.visible(q)
        for name, centre in view.centres(q).items():
            outline = view.project(ball_contour(centre, 1.1, view.camera))
            middle, spread = outline.mean(axis=0), np.ptp(outline, axis=0) / 2
            rays = rays_through(view.camera, middle + disc * spread * 0.999)
            depths = [met(body, view.camera.position, rays) for body in every]
            own = next(k for k, body in enumerate(every) if body is balls[name])
            visible_share = (np.argmin(depths, axis=0) == own)[np.isfinite(depths[own])].mean()
            assert visible[name] == pytest.approx(visible_share, abs=0.04), (name, q)
            hidden += visible_share < 0.9
    assert hidden


def test_a_face_is_painted_where_the_camera_sees_it_and_lit_as_it_stands_to_the_lamp():
    part = box((-1, 1), (-2, 2), (0, 3), np.ones(3))
    above = solid(part, np.array([0, 0, 50.0]), np.eye(3), np.zeros(3))
    # One face is all there is of it.
    (only,) = above.items
    np.testing.assert_allclose(only.light, 1.0)
    aslant = solid(part, np.array([-50.0, -50, 50]), np.eye(3), np.zeros(3))
    first, *others = aslant.items
    assert first.kind == "hull"
    lights = [item.light[0] for item in aslant.items]
    shade = 0.42 + 0.58 * 0.38 / 0.875  # towards the lamp's side
    assert sorted(lights) == pytest.approx([0.42, shade, 1.0])
    spans = [tuple(np.round(np.ptp(item.rings[0], axis=0), 6)) for item in others]
    assert len(set(spans)) == 2
    assert set(spans) < {(2, 4, 0), (0, 4, 3), (2, 0, 3)}
    within = solid(part, np.array([0, 0, 1.0]), np.eye(3), np.zeros(3))
    assert len(within.items) == 1
    # Turned so that this side looks at the lamp.
    turned = np.array([LAMP, np.cross((0.0, 0, 1), LAMP), (0, 0, 1.0)])
    towards = solid(part, 50 * LAMP, turned, np.zeros(3))
    assert max(item.light[0] for item in towards.items) == pytest.approx(0.42 + 0.58 / LAMP[2])


def test_a_beam_is_as_long_and_wide_from_every_side():
    beam = prism(stadium(8, 0.6), (-0.4, 0.4), light_of("yellow"))
    np.testing.assert_allclose(np.ptp(beam.points, axis=0), (9.2, 0.8, 1.2))
    np.testing.assert_allclose(beam.centre, (4, 0, 0), atol=1e-12)
    np.testing.assert_allclose(beam.half, (4.6, 0.4, 0.6))
    # Two broad sides, and the two edges between its round ends.
    assert len(beam.faces) == 4


@pytest.mark.parametrize("q", [(0.3, 0.8, -1.0), (-1.2, 1.9, -2.0)])
def test_the_arm_is_where_its_joints_are(q):
    eye = np.array([50.0, -40, 60])
    links = Skeleton(ARM, light_of("yellow"), 1.1).solids(q, eye)
    points = np.concatenate([body.items[0].rings[0] for body in links])
    for joint in kinematics.joint_positions(ARM, q)[:-1]:
        assert np.linalg.norm(points - joint, axis=1).min() < 3
    # The axle reaches into the ball, and nothing beyond its centre.
    tip, elbow = (np.array(p) for p in kinematics.joint_positions(ARM, q)[:1:-1])
    ahead = (tip - elbow) / np.linalg.norm(tip - elbow)
    near = points[np.linalg.norm(points - tip, axis=1) < 1.5]
    assert ((near - tip) @ ahead).max() == pytest.approx(-0.9 * 1.1)


def test_a_ring_of_bodies_that_hide_one_another_is_painted_all_the_same():
    camera = Pinhole.aimed((0, 0, 0), 50, (0, 0, 0), 600, (640, 480))
    beams = []
    for k in range(3):
        angle = 2 * math.pi * k / 3
        ahead = np.array([math.cos(angle), math.sin(angle), 0.25])
        ahead /= np.linalg.norm(ahead)
        across = np.cross((0, 0, 1), ahead)
        axes = np.array([ahead, across, np.cross(ahead, across)])
        part = box((-6, 6), (-0.5, 0.5), (-0.2, 0.2), np.ones(3))
        at = 2.0 * np.array([-math.sin(angle), math.cos(angle), 0])
        beams.append(solid(part, camera.position, axes, at))
    assert len(in_order(beams, camera)) == 3
