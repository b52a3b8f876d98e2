"""A camera by the tip's own moves, in the emulated cell of an arm in space; its truth is known."""

import math

import numpy as np
import pytest
from arms import SPATIAL as ARM
from board_views import pixels, stand, view

from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.markers.finders.board import find_board
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.joint_track import marker_place
from laptop.see.table.camera_fit import calibrate
from laptop.see.table.camera_model import triangulate
from laptop.see.table.moves_fit import BadMoves, fit_arm_pose, fit_moves

SIZE = (640, 480)


@pytest.fixture(scope="module")
def side():
    """What the camera at the side sees: a function from points (n, 3), cm."""
    return Scene(ARM, read_scene("marker_stray=0", "B")).project


def poses(count, seed=0):
    """Joint angles, with the tip above the table."""
    rng = np.random.default_rng(seed)
    low, high = ([getattr(j, side) for j in ARM.joints] for side in ("lower", "upper"))
    found = []
    while len(found) < count:
        q = rng.uniform(low, high)
        if 1.0 < marker_place(ARM, q)[2] < 18 and marker_place(ARM, q)[0] > 4:
            found.append(q)
    return np.array(found)


def seen(side, count, seed=0, noise=0.2, joints=0.003):
    """Places by joints that are a little off, and where the camera sees the true ones."""
    rng = np.random.default_rng(seed + 100)
    true = poses(count, seed)
    reported = true + joints * rng.standard_normal(true.shape)
    points = np.array([marker_place(ARM, q) for q in true])
    sights = side(points) + noise * rng.standard_normal((count, 2))
    return np.array([marker_place(ARM, q) for q in reported]), sights, points


def test_without_errors_the_camera_is_found(side):
    points, sights, _ = seen(side, 40, noise=0, joints=0)
    fit = fit_moves(points, sights, SIZE)
    assert fit.rms < 0.05
    asked = np.array([marker_place(ARM, q) for q in poses(100, 7)])
    assert np.abs(fit.camera.project(asked) - side(asked)).max() < 0.3


def test_with_joints_and_pixels_that_are_off_it_says_by_how_much(side):
    for seed in range(4):
        points, sights, _ = seen(side, 40, seed)
        fit = fit_moves(points, sights, SIZE)
        assert fit.places == 40
        assert 0.3 < fit.rms < 1.5, "px: 0.3 mm of tip are that here, and more than the pixels'"
        assert 0.2 < fit.rms_mm < 1.5
        asked = np.array([marker_place(ARM, q) for q in poses(100, 7)])
        off = np.linalg.norm(fit.camera.project(asked) - side(asked), axis=1)
        assert np.quantile(off, 0.95) < 1.5


def test_sights_of_something_else_do_no_harm(side):
    points, sights, _ = seen(side, 50)
    sights[::8] += (90, -40)
    fit = fit_moves(points, sights, SIZE)
    assert fit.places == 43
    assert fit.rms < 1.5


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (lambda p, s: (p[:11], s[:11]), "at 11 places so far; 12 are the least: let it move about"),
        (lambda p, s: (p[:1], s[:1]), "at 1 place so far"),
        (lambda p, s: (p[:0], s[:0]), "at 0 places"),
        (lambda p, s: (p * (1, 1, 0.02), s), "lie within .* mm of one plane .* up and down, too"),
        (lambda p, s: (p, 320 + (s - 320) / 50), "in a small part of the picture"),
        (lambda p, s: (p + np.nan, s), "is no number"),
        (lambda p, s: (p[::-1], s), "is it the arm of this file, with its zero found"),
    ],
)
def test_moves_that_tell_too_little_or_fit_nothing_are_refused(side, change, reported):
    points, sights, _ = seen(side, 40)
    with pytest.raises(BadMoves, match=reported):
        fit_moves(*change(points, sights), SIZE)


OVER = stand(62, 15, 200, 3)
TURN, BASE = 0.3, np.array([-9.0, 1.0, 0.2])


def on_board(points):
    c, s = np.cos(TURN), np.sin(TURN)
    return points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + BASE


@pytest.fixture(scope="module")
def over():
    """A camera over the board."""
    lying, tilted = view(OVER, np.random.default_rng(0), 0.02), view(stand(55, 35, 20), None)
    return calibrate([tilted, lying]).camera


def test_a_camera_over_the_board_tells_how_the_arm_stands_on_it(side, over):
    points, _, true = seen(side, 40)
    sights = pixels(OVER, on_board(true))
    sights[::9] += 60
    fit = fit_arm_pose(over, points, sights)
    assert fit.turn == pytest.approx(TURN, abs=0.01)
    assert fit.base == pytest.approx(BASE, abs=0.15)
    assert fit.rms < 1.0
    with pytest.raises(BadMoves, match="at 5 places so far"):
        fit_arm_pose(over, points[:5], sights[:5])
    with pytest.raises(BadMoves, match="a small part of its reach"):
        fit_arm_pose(over, points[0] + 0.01 * points, sights[0] + 0 * sights)
    with pytest.raises(BadMoves, match="is it the arm of this file"):
        fit_arm_pose(over, points[::-1], sights)


def test_a_point_in_space_is_where_it_is_though_one_camera_sees_no_board(side, over):
    """Of several lucks together: median and 95 % of the distance from the truth, mm."""
    off, gaps = [], []
    for seed in range(6):
        points, sights, true = seen(side, 40, seed)
        above = pixels(OVER, on_board(true)) + np.random.default_rng(seed).normal(0, 0.1, (40, 2))
        arm = fit_arm_pose(over, points, above)
        beside = fit_moves(arm.on_board(points), sights, SIZE)
        asked = np.array([marker_place(ARM, q) for q in poses(50, 50 + seed)])
        places, gap = triangulate(over, beside.camera, pixels(OVER, on_board(asked)), side(asked))
        off += list(10 * np.linalg.norm(places - on_board(asked), axis=1))
        gaps += list(10 * gap)
    assert np.median(off) < 0.7
    assert np.quantile(off, 0.95) < 1.5
    assert 0.1 < np.median(gaps) / np.median(off) < 1.2, "the gap tells about how sure it is"


class RenderedCell:
    """Pictures of a camera on the emulated arm, and the real tracker on them."""

    def __init__(self, camera, scene, shown):
        scene = Scene(ARM, read_scene(scene, camera))
        self.k = 0
        poses = ScriptedPoses(ARM, lambda t: shown[self.k])
        self.camera = SyntheticCamera(scene, poses, lambda: 0.0, start=0.0)

    def image(self, k):
        self.k = k
        return self.camera.capture(k).image

    def ball(self, k):
        seen = Tracker([read_spec("effector", "ball:red")]).find(self.image(k), 0.0)["effector"]
        return (seen.u, seen.v) if seen and seen.confidence > 0.5 else (math.nan, math.nan)


@pytest.mark.claims
def test_in_rendered_pictures_a_ball_in_space_is_placed_to_some_millimetres():
    """Both by the board, and one by the tip's moves: the truth is the arm's."""
    learn, ask = 60, 40
    true = np.concatenate([poses(learn), poses(ask, 9)])
    reported = true[:learn] + 0.003 * np.random.default_rng(5).standard_normal((learn, 3))
    asked = np.array([marker_place(ARM, q) for q in true]) - (9.0, 0.0, 0.0)
    text = "board=a4,marker_stray=0,clutter=0"
    cells = [
        RenderedCell("A", text, true),
        RenderedCell("B", text + ",tilt=50", true),
        RenderedCell("B", text, true),
    ]
    above, askew, beside = (np.array([c.ball(k) for k in range(len(true))]) for c in cells)
    over, other = (
        max(
            (calibrate([find_board(cell.image(k))]) for k in range(6)),
            key=lambda calibration: calibration.markers,
        ).camera
        for cell in cells[:2]
    )
    points = np.array([marker_place(ARM, q) for q in reported])
    both = np.isfinite(above[:learn] + beside[:learn]).all(axis=1)
    arm = fit_arm_pose(over, points[both], above[:learn][both])
    by_moves = fit_moves(arm.on_board(points[both]), beside[:learn][both], SIZE)
    for camera, sights, name, most in (
        (other, askew, "both see the board", (2.0, 4.0)),
        (by_moves.camera, beside, "one by moves", (2.5, 5.0)),
    ):
        places, gaps = triangulate(over, camera, above[learn:], sights[learn:])
        off = 10 * np.linalg.norm(places - asked[learn:], axis=1)
        seen = np.isfinite(off)
        assert seen.sum() > ask / 4
        middle, late = np.quantile(off[seen], (0.5, 0.95))
        reported = f"{name}: {middle:.2f}, {late:.2f} mm, gap {10 * np.median(gaps[seen]):.2f} mm"
        assert middle < most[0], reported
        assert late < most[1], reported
