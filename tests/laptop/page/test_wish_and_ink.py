"""Wish and ink lie over each other in the picture, where the ink truly is.

The arm looks around before the emulator's camera, with the play that joints have; then it draws a
circle.  Where ink on the paper is seen tells the camera itself, by which it is painted.
"""

import math
from contextlib import suppress

import numpy as np
import pytest
from arms import PLANAR, SPATIAL

from laptop.emulator.scene.optics import to_srgb
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.page import look_around
from laptop.page.board_mapping import BoardMapping
from laptop.page.table_mapping import TableMapping
from laptop.see.serve.joint_track import marker_place, marker_shift
from laptop.see.table.board_watch import BoardWatch
from robot.motion import kinematics

PLAY = math.radians(2.0)
HEIGHT = 2.5
"""Of the marker, cm."""
MOST = 3.0
"""px."""
CAMERAS = "tilt=25", "tilt=45,azimuth=60,seed=1", "tilt=35,azimuth=-120,seed=2"


def played(poses):
    """(what motors tell, where links are) along a way: links lag by half of the play."""
    side, last = np.zeros(len(poses[0])), poses[0]
    for q in poses:
        ahead = np.sign(np.subtract(q, last))
        side, last = np.where(ahead != 0, -ahead, side), q
        yield q, tuple(np.add(q, side * PLAY / 2))


def poses_along(arm, path, step):
    ends = zip(path, path[1:], strict=False)
    counts = [(a, b, max(1, int(math.dist(a, b) / step))) for a, b in ends]
    points = [np.add(a, np.subtract(b, a) * k / n) for a, b, n in counts for k in range(n)]
    poses = []
    for point in points:
        with suppress(kinematics.Unreachable):  # on the straight way between two that it reaches
            poses.append(kinematics.inverse(arm, tuple(point), "up"))
    return poses


def board_watch(scene, height):
    watch = BoardWatch(100.0, {} if height is None else {"effector": height}, "A", print)
    away = np.round(to_srgb(scene.image((-1.2, 2.2)))).astype(np.uint8)
    for _ in range(60):
        watch.update(away)
    assert watch.calibration
    return watch


@pytest.mark.short(every=6)
@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize(
    ("arm", "height", "has_board"),
    [(PLANAR, HEIGHT, False), (PLANAR, HEIGHT, True), (PLANAR, None, True), (SPATIAL, None, False)],
)
def test_wish_and_ink_are_shown_where_ink_on_the_paper_is_seen(arm, height, has_board, camera):
    dice = np.random.default_rng(5)
    scene = Scene(arm, read_scene(camera + ",board=a4" * has_board))
    is_flat = arm is PLANAR
    mappings = [TableMapping(kinematics.reach(arm)[1])]
    if has_board:
        mappings.insert(0, BoardMapping(board_watch(scene, height).place_at))
    for mapping in mappings:
        mapping.lay_paper(height)
    for path in look_around._sweep_paths(arm):
        reached, _ = look_around._planned(arm, path)
        for reported, true in played(poses_along(arm, reached, 0.7)):
            pixel = tuple(np.add(scene.truth(true)["effector"], dice.normal(0, 0.2, 2)))
            for mapping in mappings:
                mapping.add(marker_place(arm, reported), pixel, 20.0, scene.camera.size)
    view = mappings[0].view
    assert view.is_paper
    angles = np.linspace(0, 2 * math.pi, 60)
    wish = np.column_stack([12.5 + 3 * np.cos(angles), 3 * np.sin(angles)])
    off = view.to_picture(wish) - scene.project(np.column_stack([wish, np.zeros(len(wish))]))
    assert np.hypot(*off.T).max() < MOST, "px: the wish"

    goals = wish if is_flat else np.column_stack([wish, np.zeros(len(wish))])
    drawn = list(played(poses_along(arm, goals, 0.3)))
    pens = np.array([(*kinematics.forward(arm, true)[:2], 0.0) for _, true in drawn])
    seen = np.array([scene.truth(true)["effector"] for _, true in drawn])
    shifts = np.array([marker_shift(arm, reported) for reported, _ in drawn])
    places = mappings[-1].pen(seen, shifts)
    off = view.to_picture(places) - scene.project(pens)
    assert np.hypot(*off.T).max() < MOST + 0.5, "px: the ink, by the marker as it was seen"
