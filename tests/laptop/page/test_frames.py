"""Frames that the page gets, live and of recordings."""

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_frames import lengthen, write_film
from page_scene import BLUE, HEIGHT, WIDTH, mark
from waiting import PATIENCE

from laptop.page import camera_feed
from laptop.page.camera_feed import CameraFeed, marks
from laptop.page.controller import PageController
from laptop.page.overlay import overlay
from laptop.see.camera.cameras import open_camera
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.see.markers.view import BoardPlace
from laptop.see.serve.pipeline import CameraPipeline
from shared.messages import EFFECTOR


def test_a_view_is_a_picture_with_what_was_found_in_this_very_picture(scene):
    for k in range(8):
        shown = scene.show(tip=(60 + 20 * k, 120))
        image = cv2.imdecode(np.frombuffer(shown.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert image.shape == (shown.height, shown.width, 3) == (HEIGHT, WIDTH, 3)
        seen = mark(shown)
        assert (seen.u, seen.v) == pytest.approx((60 + 20 * k, 120), abs=0.3)
        blue, green, red = image[round(seen.v), round(seen.u)]
        assert red > 150 > 80 > max(blue, green), "the tip is where the overlay says"
        assert shown.index == k


def test_nothing_comes_twice_and_what_is_older_is_never_shown(scene):
    assert scene.controller.frames.view("A") is None
    shown = scene.show()
    assert scene.controller.frames.view("A", shown.index) is None
    scene.show()
    assert scene.controller.frames.view("A", shown.index).index == shown.index + 1


def test_who_waits_gets_the_next_one_and_not_one_that_has_waited(scene):
    scene.show()
    waits = threading.Event()
    wait = scene.watchers[0].wait

    def watched(timeout):
        with scene.watchers[0]._view_changed:  # nobody looks at a frame before it is waited for
            waits.set()
            wait(timeout)

    scene.watchers[0].wait = watched
    with ThreadPoolExecutor(1) as pool:
        coming = pool.submit(scene.controller.frames.view, "A", -1, (), PATIENCE)
        assert waits.wait(PATIENCE)
        scene.show()
        assert coming.result(PATIENCE).index == 1
        assert scene.controller.frames.view("A", 0, (), 0.001).index == 1, "none comes: the newest"
        assert scene.controller.frames.view("A", 1, (), 0.001) is None


def test_its_age_is_told_when_it_is_handed_over(scene):
    scene.show()
    scene.t += 0.5
    assert scene.controller.frames.view("A").age == pytest.approx(0.52)


FRAMES = 40


@pytest.fixture
def film(tmp_path):
    """A blue disc that goes on by 5 px from frame to frame; the tracker has seen 7 of them."""
    grey = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
    places = ((40 + 5 * index, 120) for index in range(FRAMES))
    pictures = (cv2.circle(grey.copy(), place, 14, BLUE, -1, cv2.LINE_AA) for place in places)
    path = str(write_film(tmp_path / "film.mp4", pictures, "mp4v"))
    tracker = Tracker([read_spec(EFFECTOR, "disc:red")])
    with open_camera(path) as camera:
        watcher = CameraPipeline("A", camera, tracker, live=False)
        for _ in range(7):
            watcher.step(0)
        yield (
            PageController([CameraFeed(watcher, tracker, path)], None, tmp_path / "markers.ini"),
            watcher,
        )


def test_how_many_frames_there_are_is_right_at_the_end_at_the_latest(tmp_path):
    grey = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
    path = str(lengthen(write_film(tmp_path / "film.mkv", [grey] * 9), 2))
    tracker = Tracker([])
    with open_camera(path) as camera:
        watcher = CameraPipeline("A", camera, tracker, live=False)
        controller = PageController(
            [CameraFeed(watcher, tracker, path)], None, tmp_path / "markers.ini"
        )
        assert controller.state().cameras[0].frames == 18
        while not camera.ended:
            watcher.step(0)
        assert controller.state().cameras[0].frames == 9


def test_any_frame_of_a_recording_can_be_looked_at_and_picked_in(film):
    controller, watcher = film
    assert controller.state().cameras[0].frames == FRAMES
    for index in (31, 3, 39, 12, 13, 6):
        shown = controller.frames.still("A", index)
        assert shown.index == index
        assert mark(shown).why == "nothing of this colour"
        image = cv2.imdecode(np.frombuffer(shown.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert image[120, 40 + 5 * index, 0] > 150, "blue"
        assert controller.colours.pick(EFFECTOR, "A", index, (40 + 5 * index, 120)) == ""
        shown = controller.frames.still("A", index, (EFFECTOR,))
        assert (mark(shown).u, mark(shown).v) == pytest.approx((40 + 5 * index, 120), abs=0.5)
        layer = cv2.imdecode(np.frombuffer(shown.masks[EFFECTOR], np.uint8), cv2.IMREAD_UNCHANGED)
        assert np.nonzero(layer[..., 3])[1].mean() == pytest.approx(40 + 5 * index, abs=1)
        assert controller.colours.undo() == ""
    assert watcher.step(0)
    assert watcher.view.frame.index == 7, "what is tracked goes on as if nobody had looked"


def test_the_trail_of_a_still_frame_ends_there(film):
    controller, watcher = film
    controller.colours.pick(EFFECTOR, "A", 0, (40, 120))
    while watcher.step(0):
        controller.heartbeat()
    assert controller.frames.still("A", 20).trail[-1] == pytest.approx((140, 120), abs=0.5)
    assert controller.frames.still("A", 39).trail[-1] == pytest.approx((235, 120), abs=0.5)
    assert controller.state().cameras[0].ended


@pytest.mark.parametrize("index", [-1, FRAMES, 10**9])
def test_a_recording_has_no_more_frames_than_it_has(film, index):
    assert film[0].frames.still("A", index).endswith("has frames 0 to 39")
    assert "has frames 0 to 39" in film[0].colours.pick(EFFECTOR, "A", index, (1, 1))


def test_a_file_that_is_gone_is_told(film):
    controller, _ = film
    Path(controller.state().cameras[0].source).unlink()
    assert "no camera, file or folder" in controller.frames.still("A", 20)


def test_of_a_live_camera_a_picture_that_was_given_out_is_looked_at_anew(scene):
    shown = scene.show(ink=BLUE)
    assert scene.controller.state().cameras[0].frames == 0
    scene.controller.frames.pin("A", shown.index)
    for _ in range(camera_feed.RECENT_FRAMES + 1):
        scene.show(tip=(200, 200))
    assert mark(scene.controller.frames.still("A", shown.index)).why
    scene.controller.colours.pick(EFFECTOR, "A", shown.index, (100, 120))
    still = scene.controller.frames.still("A", shown.index)
    assert (still.index, mark(still).u) == (shown.index, pytest.approx(100, abs=0.5))
    assert still.jpeg == shown.jpeg
    assert "too old" in scene.controller.frames.still("A", shown.index + 1)


def test_places_on_the_board_stand_beside_the_markers(scene):
    scene.show()
    shown = scene.controller.frames.view("A")
    assert "cm" not in overlay(shown)
    placed = shown._replace(marks=(mark(shown)._replace(place=BoardPlace(11.807, -0.25)),))
    assert " at 11.81,-0.25 cm</text>" in overlay(placed)
    in_arm = placed._replace(
        marks=(mark(placed)._replace(place=BoardPlace(1, 2, arm=(3, -0.001))),)
    )
    assert " at 1.00,2.00 cm = arm 3.00,0.00 cm</text>" in overlay(in_arm)


def test_the_places_are_those_of_the_frame(scene):
    scene.show()
    view = scene.controller.frames._cameras["A"].watcher.view
    seen, fixed = marks(view._replace(places={EFFECTOR: BoardPlace(1.5, 2.5)})), marks(view)
    assert [m.place for m in seen if m.name == EFFECTOR] == [BoardPlace(1.5, 2.5)]
    assert {m.place for m in fixed} == {None}
