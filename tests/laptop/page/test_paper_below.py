"""The paper below a marker, by an unknown camera; the truth is the emulator's own camera."""

import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.page.paper_below import MIN_PLACES, PaperBelow, plane_camera
from laptop.page.table_mapping import TableView
from robot.motion import kinematics

HEIGHT = 2.5
"""Of the marker over the paper, cm."""
POSES = np.stack(np.meshgrid(np.linspace(-0.9, 0.9, 8), np.linspace(0.4, 1.9, 6)), -1).reshape(
    -1, 2
)
WISH = np.array([(13 + 3 * np.cos(a), 3 * np.sin(a)) for a in np.linspace(0, 6.2, 40)])


def seen_by(text, noise, seed=1):
    """The scene, places of its marker (n, 2), cm, and their pixels."""
    scene = Scene(ARM, read_scene(text))
    points = np.array([kinematics.forward(ARM, q) for q in POSES])
    pixels = np.array([scene.truth(q)["effector"] for q in POSES])
    return scene, points, pixels + np.random.default_rng(seed).normal(0, noise, pixels.shape)


def on_paper(scene):
    return scene.project(np.column_stack([WISH, np.zeros(len(WISH))]))


@pytest.mark.short(every=5)
@pytest.mark.parametrize("noise", [0.2, 2.0])
@pytest.mark.parametrize(
    "text",
    [
        "tilt=25",
        "tilt=45,azimuth=60,focal=1000",
        "tilt=60,azimuth=180",
        "tilt=30,azimuth=-30,focal=450,roll=90",
        "tilt=25,azimuth=30,width=1280,height=720,focal=1100,k1=0.05",
    ],
)
def test_an_askew_camera_shows_where_the_paper_is(text, noise):
    scene, points, pixels = seen_by(text, noise)
    below = PaperBelow()
    below.learn(points, pixels, scene.camera.size)
    matrix, unsure = below.paper(HEIGHT, points)
    off = np.hypot(*(TableView(matrix).to_picture(WISH) - on_paper(scene)).T)
    shift = on_paper(scene) - scene.project(np.column_stack([WISH, np.full(len(WISH), HEIGHT)]))
    assert np.hypot(*shift.T).mean() > 9, "px: what is mended"
    assert off.max() < 3.0, "px"
    assert 0.1 < unsure < 3.0, "mm"


@pytest.mark.parametrize("focal", [400, 650, 1000])
def test_a_camera_that_looks_straight_down_is_as_unsure_as_it_says(focal):
    scene, points, pixels = seen_by(f"tilt=0,focal={focal}", 0.3)
    below = PaperBelow()
    below.learn(points, pixels, scene.camera.size)
    matrix, unsure = below.paper(HEIGHT, points)
    off = TableView(matrix).to_picture(WISH) - on_paper(scene)
    off_mm = 10 * np.hypot(*off.T).mean() / TableView(matrix).px_per_cm(np.array([13.0, 0.0]))
    assert off_mm < 2.5 * unsure


def test_too_few_places_and_what_no_camera_sees_so_tell_nothing():
    scene, points, pixels = seen_by("", 0.0)
    below = PaperBelow()
    below.learn(points[: MIN_PLACES - 1], pixels[: MIN_PLACES - 1], scene.camera.size)
    assert below.paper(HEIGHT, points) is None
    bent = pixels + np.random.default_rng(2).normal(0, 30, pixels.shape)
    assert plane_camera(points, bent, scene.camera.size) is None
    mirrored = pixels * (-1, 1) + (scene.camera.size[0], 0)
    assert plane_camera(points, mirrored, scene.camera.size) is None, "it would be under the table"
