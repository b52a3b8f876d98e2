"""What a page may see and do, without any page."""

import asyncio
import io
import multiprocessing
import re
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest
from waiting import PATIENCE

from laptop.page import (
    camera_feed,
    channel,
    feeds,
    report,
    report_figures,
    run_control,
    run_records,
    snapshots,
)
from laptop.page import desk as desks
from laptop.page.channel import Door, answer
from laptop.page.desk import Desk
from laptop.page.pointer import Pointer
from laptop.page.run_traces import traces_of
from laptop.reporting.line_plot import DPI
from laptop.tracking.server import State as LinkState
from laptop.tracking.watching import Watcher
from laptop.vision.cameras import open_camera
from laptop.vision.frames import Frame
from laptop.vision.learning import exclude, include, learn
from laptop.vision.markers import BadMarker, gate, read_markers, read_spec, write_markers
from laptop.vision.tracker import Tracker
from shared.messages import EFFECTOR, GOAL, Start, Status, Stop

WIDTH, HEIGHT = 320, 240
RED, GREEN, BLUE = (30, 30, 200), (60, 150, 30), (190, 70, 20)


class FakeCamera:
    name, fps, notes, ended = "fake", 30.0, (), False

    def __init__(self):
        self.frames = []

    def read(self, timeout):
        return self.frames.pop(0) if self.frames else None


class FakeServer:
    """A brick that does what the test says."""

    def __init__(self):
        self.sent = []
        self.there = True
        self.status = Status(0.0, (0.1, 0.2), None, "ready")

    def send(self, message):
        self.sent.append(message)
        return self.there

    def publish(self, observation):
        pass

    def commands(self):
        return ["robot/visual_servoing.py --code ABCD-EFGH"]

    def state(self):
        return LinkState(client="10.0.0.2" if self.there else None, status=self.status)

    def tell(self, verdict, run, **more):
        self.status = Status(0.0, (0.1, 0.2), 12.5, verdict, run=run, **more)


class Scene:
    """Cameras that show what a test wants, and the desk they belong to."""

    def __init__(self, folder, cameras=1, goal=None, **options):
        self.t = 100.0
        self.server = FakeServer()
        self.file = folder / "markers.ini"
        self.trackers = [
            Tracker([read_spec(EFFECTOR, "disc:red"), read_spec(GOAL, "disc:green")])
            for _ in range(cameras)
        ]
        self.watchers = [
            Watcher(name, FakeCamera(), tracker, goal, self.server, now=lambda: self.t)
            for name, tracker in zip("AB", self.trackers, strict=False)
        ]
        sources = ["fake"] * cameras
        self.desk = Desk(
            self.watchers,
            self.trackers,
            sources,
            self.server,
            self.file,
            now=lambda: self.t,
            **options,
        )
        self.index = -1

    def show(self, tip=(100, 120), goal=(220, 60), ink=RED, light=1.0):
        """One more frame, 0.05 s later; the desk looks at it."""
        self.t += camera_feed.BEAT
        self.index += 1
        image = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
        for where, color in ((tip, ink), (goal, GREEN)):
            if where:
                cv2.circle(image, where, 14, color, -1, cv2.LINE_AA)
        image = (image * light).astype(np.uint8)
        for watcher in self.watchers:
            watcher.camera.frames.append(Frame(self.index, self.t - 0.02, image))
            watcher.step(0)
        self.desk.beat()
        return self.desk.view("A")


@pytest.fixture
def scene(tmp_path):
    return Scene(tmp_path)


def mark(shown, name=EFFECTOR):
    return next(mark for mark in shown.marks if mark.name == name)


# Views


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
    assert scene.desk.view("A") is None
    shown = scene.show()
    assert scene.desk.view("A", shown.index) is None
    scene.show()
    assert scene.desk.view("A", shown.index).index == shown.index + 1


def test_who_waits_gets_the_next_one_and_not_one_that_has_waited(scene):
    scene.show()
    waits = threading.Event()
    wait = scene.watchers[0].wait

    def watched(timeout):
        with scene.watchers[0]._looked:  # nobody looks at a frame before it is waited for
            waits.set()
            wait(timeout)

    scene.watchers[0].wait = watched
    with ThreadPoolExecutor(1) as pool:
        coming = pool.submit(scene.desk.view, "A", -1, (), PATIENCE)
        assert waits.wait(PATIENCE)
        scene.show()
        assert coming.result(PATIENCE).index == 1
        assert scene.desk.view("A", 0, (), 0.001).index == 1, "none comes: the newest"
        assert scene.desk.view("A", 1, (), 0.001) is None


def test_its_age_is_told_when_it_is_handed_over(scene):
    scene.show()
    scene.t += 0.5
    assert scene.desk.view("A").age == pytest.approx(0.52)


def test_where_the_marker_is_expected_is_looked_first(scene):
    assert mark(scene.show(tip=(100, 120))).window is None, "the whole picture"
    left, top, right, bottom = mark(scene.show(tip=(104, 120))).window
    assert (left + right) / 2 == pytest.approx(100, abs=0.5)
    assert (top + bottom) / 2 == pytest.approx(120, abs=0.5)
    assert bottom - top == pytest.approx(right - left)
    assert right - left > 2 * 14


def test_the_trail_ends_where_the_tip_is_in_this_picture(scene):
    places = [(60 + 10 * k, 120) for k in range(6)]
    shown = [scene.show(tip=place) for place in places][-1]
    assert np.array(shown.trail) == pytest.approx(np.array(places, float), abs=0.3)


@pytest.mark.parametrize(
    ("looks", "why", "advice"),
    [
        ({"tip": None}, "nothing of this colour", "bring it into the picture"),
        ({"ink": BLUE}, "nothing of this colour", "pick it anew"),
        ({"light": 0.02}, "too dark", "more light"),
        ({"goal": None}, "", ""),
    ],
)
def test_a_lost_marker_has_its_reason_and_what_to_do(scene, looks, why, advice):
    seen = mark(scene.show(**looks))
    assert seen.why == why
    assert advice in seen.advice
    assert (seen.u is None) == bool(why)


def test_a_mask_shows_the_pixels_of_the_colour_in_this_very_picture(scene):
    scene.show(tip=(80, 120))
    shown = scene.desk.view("A", masks=(EFFECTOR,))
    (png,) = shown.masks.values()
    layer = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    v, u = np.nonzero(layer[..., 3])
    assert (u.mean(), v.mean()) == pytest.approx((80, 120), abs=0.5)
    assert len(u) == pytest.approx(np.pi * 14**2, rel=0.1)


def test_a_picture_is_encoded_once_however_many_look(scene, monkeypatch):
    scene.show()
    monkeypatch.setattr(camera_feed.cv2, "imencode", None)
    assert [scene.desk.view("A").index for _ in range(5)] == [0] * 5


# Colours


def test_a_colour_is_picked_in_the_picture_that_was_shown(scene):
    shown = scene.show(ink=BLUE)
    assert mark(shown).why
    for _ in range(5):
        scene.show(tip=(250, 200), ink=BLUE)  # it has moved on when the click comes in
    assert scene.desk.pick(EFFECTOR, "A", shown.index, (100, 120)) == ""
    seen = mark(scene.show(tip=(120, 150), ink=BLUE))
    assert (seen.u, seen.v) == pytest.approx((120, 150), abs=0.5)
    assert read_markers(scene.file)[EFFECTOR].color.hue == pytest.approx(223, abs=12)


def test_a_rectangle_does_as_well_as_a_click_and_may_name_a_new_marker(scene):
    shown = scene.show()
    assert scene.desk.pick("third", "A", shown.index, (210, 50, 230, 70)) == ""
    assert mark(scene.show(), "third").u == pytest.approx(220, abs=0.5)
    assert set(read_markers(scene.file)) == {"third"}, "nothing else was learned"


def test_a_pick_leaves_what_the_file_knows_of_the_other_markers(scene):
    """A synthetic scene has colours of its own; those that were learned of a webcam stay."""
    learned = read_spec(GOAL, "disc:blue")
    write_markers(scene.file, {GOAL: learned})
    shown = scene.show()
    assert scene.desk.pick(EFFECTOR, "A", shown.index, (100, 120)) == ""
    kept = read_markers(scene.file)
    assert set(kept) == {EFFECTOR, GOAL}
    assert kept[GOAL] == learned


def test_undo_takes_back_what_was_picked_on_the_disk_too(scene):
    shown = scene.show()
    before = scene.desk.state().markers
    scene.desk.pick(EFFECTOR, "A", shown.index, (220, 60))
    assert scene.desk.state().markers != before
    assert scene.desk.state().undoable == 1
    assert scene.desk.undo() == ""
    assert scene.desk.state().markers == before
    assert abs(read_markers(scene.file)[EFFECTOR].color.hue) < 1
    assert scene.desk.undo() == "there is nothing to undo"


def test_where_there_is_nothing_to_pick_the_old_colour_stays(scene):
    shown = scene.show()
    before = scene.desk.state().markers
    assert "no colour at 20,20" in scene.desk.pick(EFFECTOR, "A", shown.index, (20, 20))
    assert "outside the picture" in scene.desk.pick(EFFECTOR, "A", shown.index, (20, 900))
    assert "name it" in scene.desk.pick("a b", "A", shown.index, (100, 120))
    assert scene.desk.state().markers == before
    assert not scene.file.exists()


def test_an_old_picture_is_gone_unless_it_is_pinned(scene):
    first, second = scene.show(), scene.show()
    assert scene.desk.pin("A", second.index) == ""
    for _ in range(camera_feed.KEPT):
        scene.show()
    assert "too old" in scene.desk.pick(EFFECTOR, "A", first.index, (100, 120))
    assert "too old" in scene.desk.pin("A", first.index)
    assert scene.desk.pick(EFFECTOR, "A", second.index, (100, 120)) == ""


def test_a_marker_can_be_renamed(scene):
    scene.show()
    assert scene.desk.rename(GOAL, "target") == ""
    assert mark(scene.show(), "target").u == pytest.approx(220, abs=0.5)
    assert set(scene.desk.state().markers) == {EFFECTOR, "target"}
    assert "none of this name" in scene.desk.rename(GOAL, "other")


def test_renamed_it_has_no_old_name_in_the_file_and_an_undo_takes_it_back(scene):
    other = read_spec("target", "disc:blue")
    write_markers(scene.file, {"target": other, "mine": other})
    scene.show()
    assert scene.desk.rename(GOAL, "target") == ""
    assert set(read_markers(scene.file)) == {"target", "mine"}
    assert read_markers(scene.file)["target"].color.hue == 125, "it was the goal's"
    assert scene.desk.undo() == ""
    assert set(scene.desk.state().markers) == {EFFECTOR, GOAL}
    assert set(read_markers(scene.file)) == {GOAL, "target", "mine"}
    assert read_markers(scene.file)["target"] == other


def test_an_undone_marker_that_was_new_is_not_kept_either(scene):
    shown = scene.show()
    scene.desk.pick("third", "A", shown.index, (220, 60))
    assert "third" in read_markers(scene.file)
    scene.desk.undo()
    assert set(read_markers(scene.file)) == set()


def disc(ink):
    image = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
    cv2.circle(image, (160, 120), 30, ink, -1, cv2.LINE_AA)
    return image


ORANGE, DULL = (30, 110, 200), (70, 70, 110)


def test_a_colour_is_added_to_and_removed_from_a_marker(scene):
    red = learn(EFFECTOR, disc(RED), (160, 120))
    assert Tracker([red]).find(disc(DULL), 0.0)[EFFECTOR] is None
    wide = include(red, disc(DULL), (160, 120))
    assert gate(cv2.cvtColor(disc(DULL), cv2.COLOR_BGR2HSV), wide.color)[120, 160]
    orange = include(red, disc(ORANGE), (160, 120))
    for ink, inside in ((RED, True), (ORANGE, True), (BLUE, False)):
        mask = gate(cv2.cvtColor(disc(ink), cv2.COLOR_BGR2HSV), orange.color)
        assert bool(mask[120, 160]) == inside
    without = exclude(orange, disc(ORANGE), (160, 120))
    for ink, inside in ((RED, True), (ORANGE, False)):
        mask = gate(cv2.cvtColor(disc(ink), cv2.COLOR_BGR2HSV), without.color)
        assert bool(mask[120, 160]) == inside
    with pytest.raises(BadMarker, match="nothing to remove"):
        exclude(red, disc(BLUE), (160, 120))
    with pytest.raises(BadMarker, match="looks like the marker itself"):
        exclude(red, disc(RED), (160, 120))


def test_adding_and_removing_act_on_the_tracker(scene):
    shown = scene.show()
    assert "pick it first" in scene.desk.add("third", "A", shown.index, (220, 60))
    before = scene.desk.state().markers[EFFECTOR]
    assert scene.desk.add(EFFECTOR, "A", shown.index, (220, 60)) == ""
    assert scene.desk.state().markers[EFFECTOR] != before
    assert scene.desk.remove(EFFECTOR, "A", shown.index, (220, 60)) == ""
    assert mark(scene.show()).u == pytest.approx(100, abs=0.5)


# Frames that stand


FRAMES, PACE = 40, 20.0


@pytest.fixture
def film(tmp_path):
    """A blue disc that goes on by 5 px from frame to frame; the tracker has seen 7 of them."""
    path = str(tmp_path / "film.mp4")
    out = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"mp4v"), PACE, (WIDTH, HEIGHT))
    for index in range(FRAMES):
        image = np.full((HEIGHT, WIDTH, 3), 130, np.uint8)
        out.write(cv2.circle(image, (40 + 5 * index, 120), 14, BLUE, -1, cv2.LINE_AA))
    out.release()
    tracker = Tracker([read_spec(EFFECTOR, "disc:red")])
    with open_camera(path) as camera:
        watcher = Watcher("A", camera, tracker, live=False)
        for _ in range(7):
            watcher.step(0)
        yield Desk([watcher], [tracker], [path], None, tmp_path / "markers.ini"), watcher


def test_any_frame_of_a_recording_can_be_looked_at_and_picked_in(film):
    desk, watcher = film
    assert desk.state().eyes[0].frames == FRAMES
    for index in (31, 3, 39, 12, 13, 6):
        shown = desk.still("A", index)
        assert shown.index == index
        assert mark(shown).why == "nothing of this colour"
        image = cv2.imdecode(np.frombuffer(shown.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert image[120, 40 + 5 * index, 0] > 150, "blue"
        assert desk.pick(EFFECTOR, "A", index, (40 + 5 * index, 120)) == ""
        shown = desk.still("A", index, (EFFECTOR,))
        assert (mark(shown).u, mark(shown).v) == pytest.approx((40 + 5 * index, 120), abs=0.5)
        layer = cv2.imdecode(np.frombuffer(shown.masks[EFFECTOR], np.uint8), cv2.IMREAD_UNCHANGED)
        assert np.nonzero(layer[..., 3])[1].mean() == pytest.approx(40 + 5 * index, abs=1)
        assert desk.undo() == ""
    assert watcher.step(0)
    assert watcher.view.frame.index == 7, "what is tracked goes on as if nobody had looked"


def test_the_trail_of_a_still_frame_ends_there(film):
    desk, watcher = film
    desk.pick(EFFECTOR, "A", 0, (40, 120))
    while watcher.step(0):
        desk.beat()
    assert desk.still("A", 20).trail[-1] == pytest.approx((140, 120), abs=0.5)
    assert desk.still("A", 39).trail[-1] == pytest.approx((235, 120), abs=0.5)
    assert desk.state().eyes[0].ended


@pytest.mark.parametrize("index", [-1, FRAMES, 10**9])
def test_a_recording_has_no_more_frames_than_it_has(film, index):
    assert film[0].still("A", index).endswith("has frames 0 to 39")
    assert "has frames 0 to 39" in film[0].pick(EFFECTOR, "A", index, (1, 1))


def test_a_file_that_is_gone_is_told(film):
    desk, _ = film
    Path(desk.state().eyes[0].source).unlink()
    assert "no camera, file or folder" in desk.still("A", 20)


def test_of_a_live_camera_a_picture_that_was_given_out_is_looked_at_anew(scene):
    shown = scene.show(ink=BLUE)
    assert scene.desk.state().eyes[0].frames == 0
    scene.desk.pin("A", shown.index)
    for _ in range(camera_feed.KEPT + 1):
        scene.show(tip=(200, 200))
    assert mark(scene.desk.still("A", shown.index)).why
    scene.desk.pick(EFFECTOR, "A", shown.index, (100, 120))
    still = scene.desk.still("A", shown.index)
    assert (still.index, mark(still).u) == (shown.index, pytest.approx(100, abs=0.5))
    assert still.jpeg == shown.jpeg
    assert "too old" in scene.desk.still("A", shown.index + 1)


def test_somebody_looks_who_has_asked_lately(scene):
    assert not scene.desk.watched
    scene.desk.state()
    assert scene.desk.watched
    scene.t += desks.AWAY
    assert not scene.desk.watched


@pytest.mark.parametrize("comes", ["expect", "opened"])
def test_who_is_expected_may_take_any_time(scene, comes):
    getattr(scene.desk, comes)()
    scene.t += 0.9 * desks.SOON
    assert scene.desk.watched
    scene.desk.state()
    scene.t += desks.AWAY
    assert not scene.desk.watched
    scene.desk.expect()
    scene.t += desks.SOON
    assert not scene.desk.watched, "nobody came"


# Aims and runs


def test_a_start_goes_to_the_point_that_was_clicked(scene):
    scene.show()
    assert scene.desk.aim("A", 40.0, 50.0) == ""
    assert scene.show().aim == (40.0, 50.0)
    assert scene.desk.start("kalman", "stream", "stereo", 3.0) == ""
    assert scene.server.sent == [
        Start("kalman", "stream", "stereo", 3.0, goals={"A": (40.0, 50.0)})
    ]


FOLLOW = ("chain", "stream", "stereo", 8.0, 300.0, True)


def test_a_goal_marker_that_moves_is_followed_until_it_is_said_otherwise(scene):
    scene.show()
    assert scene.desk.start(*FOLLOW) == ""
    assert scene.server.sent == [Start(*FOLLOW)]
    scene.server.tell("", 1)
    scene.show()
    assert scene.desk.state().following
    assert scene.desk.hold() == ""
    scene.server.tell("converged", 1)
    scene.show()
    assert not scene.desk.state().following
    scene.server.tell("", 2)  # the brick's own, of which nobody here knows the orders
    scene.show()
    assert not scene.desk.state().following


def test_only_a_goal_marker_can_be_followed(scene):
    scene.show()
    scene.desk.aim("A", 40.0, 50.0)
    assert "only a goal marker can be followed" in scene.desk.start(*FOLLOW)
    assert scene.server.sent == []
    scene.desk.aim_at_marker()
    assert scene.desk.start(*FOLLOW) == ""


def test_what_leaves_joints_undetermined_is_refused_here_already(scene):
    scene.show()
    scene.server.status = Status(0.0, (0.1, 0.2, 0.3), None, "ready")
    scene.desk.aim("A", 40.0, 50.0)
    assert "where 3 joints are to go" in scene.desk.start()
    assert scene.server.sent == []


def test_a_start_goes_to_the_marker_if_no_point_was_clicked(scene):
    scene.show()
    scene.desk.aim("A", 40.0, 50.0)
    assert scene.desk.aim_at_marker() == ""
    assert scene.desk.start() == ""
    assert scene.server.sent == [Start()]
    assert scene.show().aim is None


def test_without_any_goal_nothing_starts(scene):
    scene.show()
    scene.desk.rename(GOAL, "other")
    assert "no goal yet" in scene.desk.start()
    assert scene.server.sent == []


def test_a_goal_outside_the_picture_is_refused(scene):
    assert "gives no picture" in scene.desk.aim("A", 1.0, 1.0)
    scene.show()
    assert "outside the picture" in scene.desk.aim("A", 400.0, 50.0)
    assert scene.show().aim is None


def test_two_cameras_want_a_goal_each(tmp_path):
    scene = Scene(tmp_path, cameras=2)
    scene.show()
    scene.desk.aim("A", 40.0, 50.0)
    assert "camera B" in scene.desk.start()
    scene.desk.aim("B", 140.0, 150.0)
    assert scene.desk.start(rows="xyz") == ""
    assert scene.server.sent[0].goals == {"A": (40.0, 50.0), "B": (140.0, 150.0)}
    assert "several cameras" in scene.desk.follow("A", [(1.0, 1.0), (99.0, 99.0)])


@pytest.mark.parametrize("verdict", ["", "ready", "converged"])
def test_a_start_while_a_run_is_on_is_refused(scene, verdict):
    scene.show()
    scene.server.tell(verdict, 1)
    why = scene.desk.start()
    assert ("a run is on" in why) == (verdict == "")
    assert len(scene.server.sent) == (verdict != "")
    # From the order on, even before the brick has said a word about it.
    assert "a run is on" in scene.desk.start()
    assert "a run is on" in scene.desk.aim("A", 40.0, 50.0)
    assert "a run is on" in scene.desk.aim_at_marker()
    assert scene.desk.state().running


def test_a_brick_that_does_not_begin_is_told_of_and_may_be_asked_again(scene):
    scene.show()
    scene.desk.start()
    scene.t += run_control.ANSWER
    scene.show()
    assert "--wait" in scene.desk.state().note
    assert scene.desk.start() == ""


@pytest.mark.parametrize(
    ("orders", "why"),
    [
        (("guess",), "'guess' is no method; take one of report, broyden"),
        (("chain", "jump"), "'jump' is no mode"),
        (("chain", "look", "all"), "'all' is no rows"),
        (("chain", "look", "stereo", 0.1), "tolerance 0.1: from 0.5 to 200 px"),
        (("chain", "look", "stereo", 5.0, 0.0), "budget 0: from 1 to 3600 s"),
        (("report", "stream"), "looks, then moves"),
        (("chain", "look", "stereo", 5.0, 60.0, True), "in the mode stream only"),
    ],
)
def test_orders_that_make_no_sense_are_refused(scene, orders, why):
    scene.show()
    assert why in scene.desk.start(*orders)
    assert scene.server.sent == []


def test_without_a_brick_nothing_starts_and_the_command_is_told(scene):
    scene.show()
    scene.server.there = False
    assert "no brick is connected" in scene.desk.start()
    assert "no brick is connected" in scene.desk.stop()
    assert not scene.desk.state().running
    assert scene.desk.state().commands == tuple(scene.server.commands())


@pytest.mark.parametrize("order", ["hold", "stop"])
def test_hold_and_stop_end_the_run_at_once(scene, order):
    scene.show()
    scene.desk.start()
    assert getattr(scene.desk, order)() == ""
    assert isinstance(scene.server.sent[-1], Stop)


PATH = [(float(u), 100.0) for u in range(50, 151, 5)]


def test_a_path_is_followed_point_after_point(scene):
    scene.show()
    assert scene.desk.follow("A", PATH) == ""
    shown = scene.show()
    assert shown.aim == PATH[0]
    assert [u for u, _ in shown.ahead] == [75, 100, 125, 150]
    assert scene.desk.start("broyden", "look", "stereo", 4.0) == ""
    for run in range(1, 6):
        scene.server.tell("", run)
        scene.show()
        assert len(scene.server.sent) == run, "it waits for the verdict"
        scene.server.tell("converged", run)
        assert scene.desk.state().running == (run < 5), "even before it has gone on"
        scene.show()
        scene.show()
    assert [start.goals["A"][0] for start in scene.server.sent] == [50, 75, 100, 125, 150]
    assert {start.method for start in scene.server.sent} == {"broyden"}
    assert scene.desk.state().left == 0


@pytest.mark.parametrize("verdict", ["unreachable", "stopped", "marker lost"])
def test_a_path_ends_where_a_point_is_not_reached(scene, verdict):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.tell(verdict, 1)
    scene.show()
    scene.show()
    assert len(scene.server.sent) == 1
    assert "4 points before its end" in scene.desk.state().note


@pytest.mark.parametrize("order", ["hold", "stop"])
def test_a_stop_is_said_until_the_brick_has_heard_it(scene, order):
    """A link that breaks takes it along; behind it the run would go on by itself."""
    scene.show()
    scene.desk.aim("A", 100, 100)
    scene.desk.start()
    scene.server.tell("", run=1)
    scene.server.there = False
    assert "as soon as it is back" in getattr(scene.desk, order)()
    scene.desk.beat()
    scene.server.sent.clear()
    scene.server.there = True
    scene.desk.beat()
    scene.server.tell("", run=1)
    scene.desk.beat()
    assert [type(said) for said in scene.server.sent] == [Stop, Stop]
    scene.server.tell("stopped", run=1)
    scene.desk.beat()
    scene.server.tell("", run=2)  # of its own
    scene.desk.beat()
    assert len(scene.server.sent) == 2


def test_a_new_start_takes_a_stop_back(scene):
    scene.show()
    scene.desk.aim("A", 100, 100)
    scene.desk.stop()
    assert scene.desk.start() == ""
    scene.server.tell("", run=1)
    scene.desk.beat()
    assert [type(said) for said in scene.server.sent] == [Stop, Start]


def test_what_was_said_of_a_path_goes_with_a_new_goal(scene):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.tell("unreachable", run=1)
    scene.desk.beat()
    assert "4 points before its end" in scene.desk.state().note
    scene.desk.aim("A", 100, 100)
    assert scene.desk.state().note == ""


def test_a_run_whose_brick_is_gone_for_good_is_over(scene):
    scene.show()
    scene.desk.aim("A", 100, 100)
    scene.desk.start()
    scene.server.tell("", run=1)
    scene.show()
    scene.server.there = False
    scene.show()
    assert scene.desk.record().runs[-1].ended is None
    scene.t += desks.GONE
    scene.show()
    assert scene.desk.record().runs[-1].ended is not None


def test_a_fixed_goal_is_known(tmp_path):
    scene = Scene(tmp_path, goal=(50, 60))
    scene.show()
    assert scene.desk.state().fixed
    assert scene.desk.start() == ""


def test_an_emulated_brick_that_cannot_come_is_told_of(tmp_path):
    def bring():
        raise OSError(28, "No space left on device", "lines.txt")

    scene = Scene(tmp_path, bring=bring)
    scene.server.there = False
    scene.desk.opened()
    assert not scene.desk.state().own
    assert "no emulated brick: No space left" in scene.desk.state().note


def test_between_the_points_of_a_path_it_is_still_on_its_way(scene):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.tell("converged", run=1)
    assert scene.desk.state().running
    assert "a run is on" in scene.desk.start()
    scene.desk.beat()
    for run in range(2, 10):
        scene.server.tell("converged", run=run)
        scene.desk.beat()
    assert not scene.desk.state().running


def test_a_path_waits_where_the_link_is_lost(scene):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.there = False
    scene.desk.beat()
    scene.server.there = True
    scene.server.tell("ready", run=0)  # another brick
    state = scene.desk.state()
    assert not state.running
    assert "the path ends here" in state.note
    assert state.left == 4
    assert scene.desk.start() == ""


@pytest.mark.parametrize(("order", "left"), [("hold", 4), ("stop", 0)])
def test_after_hold_a_path_goes_on_and_after_stop_it_does_not(scene, order, left):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.tell("", 1)
    getattr(scene.desk, order)()
    scene.server.tell("converged", 1)  # it was there just before
    scene.show()
    assert len(scene.server.sent) == 2
    assert scene.desk.state().left == left


# State and history


def test_the_state_tells_of_cameras_link_and_markers(scene):
    for _ in range(40):
        scene.show()
    scene.watchers[0].dropped = 3
    state = scene.desk.state()
    (eye,) = state.eyes
    assert eye.rate == pytest.approx(1 / camera_feed.BEAT)
    assert eye.age == pytest.approx(0.02)
    assert (eye.dropped, eye.trouble) == (3, "")
    assert state.brick == "10.0.0.2"
    assert set(state.markers) == {EFFECTOR, GOAL}
    scene.t += 5
    assert "no frame for 5 s" in scene.desk.state().eyes[0].trouble


@pytest.mark.parametrize(
    ("volts", "says"),
    [
        (7.44, "<tr><td>battery</td><td>7.4 V</td>"),
        (6.2, '<tr class="warn"><td>battery</td><td>6.2 V: low, charge it'),
        (None, ""),
    ],
)
def test_the_battery_is_shown_if_the_brick_tells_with_a_warning_if_it_is_low(scene, volts, says):
    card = pytest.importorskip("laptop.page.cards.state")
    scene.server.tell("ready", 0, battery=volts)
    shown = card.facts_table(scene.desk.state())
    assert says in shown
    assert ("<td>battery<" in shown) == (volts is not None)
    scene.server.there = False
    assert "<td>battery<" not in card.facts_table(scene.desk.state()), "of a brick that has gone"


def test_the_history_is_the_last_minute(scene):
    scene.server.tell("", 1, e={"A.u": 3.0}, condition=2.5, moves=4)
    for _ in range(1300):
        scene.t += camera_feed.BEAT
        scene.desk.beat()
    history = scene.desk.history()
    assert history[-1].t - history[0].t == pytest.approx(snapshots.HISTORY, abs=0.3)
    assert (history[-1].error, history[-1].e, history[-1].condition) == (12.5, {"A.u": 3.0}, 2.5)
    assert len(scene.desk.history(history[-4].t)) == 3


def test_an_own_brick_comes_when_somebody_looks_and_no_other_is_there(tmp_path):
    brought, why = [], ""

    def bring():
        brought.append(1)
        return lambda: why

    scene = Scene(tmp_path, bring=bring)
    scene.desk.opened()
    assert brought == [], "there is one"
    scene.server.there = False
    scene.desk.opened()
    scene.desk.opened()
    scene.desk.beat()
    assert brought == [1]
    assert scene.desk.state().own
    scene.server.there = True
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    scene.server.there = False
    why = "it fell"
    scene.desk.beat()
    assert not scene.desk.state().own
    assert scene.desk.state().note.startswith("the path ends here, ")
    assert scene.desk.state().note.endswith("it fell; load the page anew for another one")
    why = ""
    scene.desk.opened()
    assert brought == [1, 1]
    assert scene.desk.state().own


# The pointer


def handled(*events):
    """What comes of pointer events, (kind, u, button, buttons) each."""
    pointer = Pointer()
    done = [pointer.take("pointer" + kind, (u, 9.0), *keys) for kind, u, *keys in events]
    return [[u for u, _ in points] for points in done if points]


LATE = [("move", 70.0, -1, 0)] * 3
DOWN, UP = ("down", 50.0, 0, 1), ("up", 51.0, 0, 0)


def test_a_pointer_clicks_or_drags():
    assert handled(DOWN, UP) == [[50]]
    assert handled(DOWN, ("move", 60.0, -1, 1), UP) == [[50, 60, 51]]
    assert handled(DOWN, ("move", 52.0, -1, 1), UP) == [[50]], "a hand is not that steady"


def test_moves_from_before_a_click_do_no_harm_if_they_come_late():
    assert handled(DOWN, *LATE, UP) == [[50]]
    assert handled(DOWN, *LATE[:2], ("move", 60.0, -1, 1), *LATE[:2], UP) == [[50, 60, 51]]


def test_what_is_let_go_of_outside_the_picture_or_taken_away_is_no_drag():
    assert handled(DOWN, *LATE, *LATE, UP) == []
    assert handled(DOWN, ("cancel", 60.0, -1, 0), UP) == []
    assert handled(("down", 50.0, 2, 2), ("up", 50.0, 2, 0)) == [], "the other button"


# The door


@pytest.fixture
def door(scene):
    ours, theirs = multiprocessing.Pipe()
    thread = threading.Thread(target=answer, args=(scene.desk, theirs))
    thread.start()
    yield Door(ours)
    ours.close()
    thread.join(PATIENCE)
    assert not thread.is_alive(), "it ends with the other side"


def test_what_goes_through_the_door_is_what_the_desk_says(scene, door):
    shown = scene.show()
    assert door.ask("view", "A") == shown._replace(age=door.ask("view", "A").age)
    assert door.ask("state") == scene.desk.state()
    assert door.ask("history") == scene.desk.history()
    assert door.ask("aim", "A", 5.0, 6.0) == ""
    assert scene.show().aim == (5.0, 6.0)


@pytest.mark.parametrize("question", ["_look_for", "beat", "__init__", "server", "watched"])
def test_through_the_door_there_is_nothing_but_the_desk(scene, door, question):
    with pytest.raises(channel.AskedWrongly, match="none of a desk's"):
        door.ask(question)


def test_a_wrong_question_does_no_harm(scene, door):
    with pytest.raises(channel.AskedWrongly, match="KeyError"):
        door.ask("view", "Z")
    assert door.ask("state") == scene.desk.state()


# Records, and the reports of them


@pytest.fixture(scope="module", autouse=True)
def small_pictures():
    """Drawn as ever, in a tenth of the pixels each way."""

    def png_of(figure):
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=DPI / 10)
        return file.getvalue()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_figures, "png_of", png_of)
        yield


@pytest.fixture
def no_pictures(monkeypatch):
    """For tests that look at the words of a report only."""
    monkeypatch.setattr(report_figures, "png_of", lambda figure: b"")


def run(scene, number, verdict="converged", steps=5, orders=True, e=True, camera="A"):
    """Let the brick do a run in which the tip comes from (60, 120) to (100, 120)."""
    for k in range(steps):
        u = 60 + 10 * min(k, 4)
        off = {f"{camera}.u": u - 102.0, f"{camera}.v": 2.0} if e else {}
        scene.server.tell("", number, moves=k, e=off, condition=2.0 + k)
        for _ in range(10):
            scene.show(tip=(u, 120))
    scene.server.tell(verdict, number, moves=steps, e=off, reason="because", condition=2.0)
    scene.show(tip=(100, 120))
    scene.show(tip=(100, 120))


def test_a_run_is_recorded_from_start_to_verdict(scene):
    scene.show()
    assert scene.desk.record() is None
    scene.desk.aim("A", 102.0, 118.0)
    scene.desk.start("kalman")
    began = scene.t
    run(scene, 1)
    for _ in range(20):
        scene.show(tip=(150, 120), ink=BLUE)  # what comes later is no part of it
    record = scene.desk.record()
    (only,) = record.runs
    assert only.orders == scene.server.sent[0]
    assert (only.verdict, only.reason) == ("converged", "because")
    assert (only.began, only.ended) == pytest.approx((began + 0.05, began + 2.55), abs=0.06)
    assert [round(u) for _, u, _ in only.tips["A"]][::10] == [60, 70, 80, 90, 100]
    assert {(u, v) for _, u, v in only.goals["A"]} == {(102.0, 118.0)}
    assert [sample.moves for sample in only.samples] == [0, 1, 2, 3, 4, 5]
    image = cv2.imdecode(np.frombuffer(record.images["A"], np.uint8), cv2.IMREAD_COLOR)
    assert image[120, 100, 2] > 150 > 80 > image[120, 100, 0], "the tip is where it was in the end"
    assert scene.desk.state().runs == ((1, record.when, "converged"),)


def test_a_run_that_goes_on_can_be_looked_at(scene):
    scene.show()
    scene.desk.start()
    scene.server.tell("", 1)
    scene.show(tip=(100, 120))
    first = scene.desk.record()
    assert (first.runs[0].verdict, first.runs[0].ended) == ("", None)
    points = len(first.runs[0].tips["A"])
    scene.show(tip=(120, 120))
    assert len(first.runs[0].tips["A"]) == points, "what was handed over changes no more"
    assert len(scene.desk.record().runs[0].tips["A"]) == points + 1


def test_a_run_that_the_brick_does_by_itself_is_recorded_without_orders(scene):
    scene.show()
    run(scene, 1)
    run(scene, 1, "marker lost")  # the program was started again, and counts anew
    first, second = (scene.desk.record(number) for number in (1, 2))
    assert first.runs[0].orders is second.runs[0].orders is None
    assert [run.verdict for run in (first.runs[0], second.runs[0])] == ["converged", "marker lost"]
    (traces,) = traces_of(first)
    assert traces.goals["A"] == pytest.approx((102, 118), abs=0.5), "as the brick's errors tell"


def test_what_was_there_before_is_no_run(scene):
    scene.server.tell("converged", 3)
    for _ in range(3):
        scene.show()
    assert scene.desk.record() is None


def test_a_run_whose_end_was_not_heard_ends_where_the_next_begins(scene, no_pictures):
    scene.show()
    scene.server.tell("", 1, moves=5)
    scene.show()
    scene.server.tell("", 1, moves=0)
    scene.show()
    assert [run.verdict for run in scene.desk.state().runs] == ["", ""]
    assert scene.desk.record(1).runs[0].ended is not None
    assert "not heard" in report.render(scene.desk.record(1))


def test_orders_that_are_refused_are_a_record_too(scene, no_pictures):
    scene.show()
    scene.desk.start()
    scene.server.tell("refused", 1, reason="no zero")
    scene.show()
    record = scene.desk.record()
    assert (record.runs[0].verdict, record.runs[0].orders) == ("refused", Start())
    assert "No zero" in report.render(record)


def test_the_runs_along_a_path_are_one_record(scene, no_pictures):
    scene.show()
    scene.desk.follow("A", PATH)
    scene.desk.start()
    for number in range(1, 6):
        run(scene, number, steps=1)
    run(scene, 6)  # the brick's own
    record = scene.desk.record(1)
    assert [run.orders.goals["A"][0] for run in record.runs] == [50, 75, 100, 125, 150]
    assert len(scene.desk.record(2).runs) == 1
    text = report.render(record)
    assert text.count("<summary>") == 5
    assert "5 points of the path reached" in text


@pytest.mark.long
def test_only_the_last_runs_are_kept_and_long_ones_get_thinner(scene, monkeypatch):
    monkeypatch.setattr(run_records, "MAX_POINTS", 30)
    scene.show()
    for number in range(1, run_records.MAX_GROUPS + 3):
        run(scene, number)
    assert [run.number for run in scene.desk.state().runs] == list(
        range(3, run_records.MAX_GROUPS + 3)
    )
    assert scene.desk.record(1) is None
    assert all(scene.desk.record(run.number).images for run in scene.desk.state().runs)
    tips = scene.desk.record().runs[0].tips["A"]
    assert 15 <= len(tips) <= 30
    assert tips[-1][1] - tips[0][1] == pytest.approx(40, abs=0.5)


@pytest.mark.short("2")
@pytest.mark.parametrize("cameras", [1, 2])
def test_a_report_is_one_file_that_says_what_was_ordered_and_what_came_of_it(tmp_path, cameras):
    scene = Scene(tmp_path, cameras=cameras)
    scene.show()
    scene.desk.start("broyden", tolerance=7.0, budget=90.0)
    run(scene, 1, "budget spent", camera="AB"[cameras - 1])
    text = report.render(scene.desk.record())
    for words in (
        "Not there in time", "Because; 12.5 px off", "method broyden", "mode look",
        "tolerance 7 px", "budget 90 s", "the marker", "5 moves", 'class="bad"', "Save this",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("<img") == 3
    assert not re.search(r"(src|href)=.?(http|/)", text)


def test_what_the_brick_says_is_no_markup_of_the_report(scene, no_pictures):
    scene.show()
    scene.desk.start()
    scene.server.tell("refused", 1, reason="<script>alert(1)</script>")
    scene.show()
    assert "<script" not in report.render(scene.desk.record())


def test_the_error_in_a_report_is_what_the_tracker_saw(scene):
    scene.show()
    scene.desk.aim("A", 102.0, 118.0)
    scene.desk.start()
    run(scene, 1)
    (traces,) = traces_of(scene.desk.record())
    assert traces.errors[0] == pytest.approx(np.hypot(42, 2), abs=0.5)
    assert traces.final_error == pytest.approx(np.hypot(2, 2), abs=0.5)
    assert [sample.e["A.u"] for sample in traces.measured] == [-42, -32, -22, -12, -2]


def test_where_the_tip_was_not_seen_the_report_has_a_gap(scene):
    scene.show()
    scene.desk.aim("A", 102.0, 118.0)
    scene.desk.start()
    scene.server.tell("", 1, e={"A.u": 1.0, "A.v": 0.0})
    for tip in [(60, 120)] * 20 + [None] * 20 + [(100, 120)] * 20:
        scene.show(tip=tip)
    (traces,) = traces_of(scene.desk.record())
    assert np.isnan(traces.tips["A"]).any(axis=1).sum() == 1
    gap = traces.t[np.isnan(traces.errors)]
    assert (gap[0], gap[-1]) == pytest.approx((1.0, 2.0), abs=0.2)
    assert np.isfinite(traces.errors[[1, -2]]).all()


def test_a_report_is_drawn_once_and_beside_the_loop_that_serves_pages(scene, door, monkeypatch):
    scene.show()
    scene.desk.start()
    run(scene, 1)
    drawn = []

    def render(group):
        drawn.append(threading.current_thread().name)
        return "a report"

    monkeypatch.setattr(report, "render", render)
    far = feeds.FarDesk(door._pipe, door._pipe, {})

    async def ask():
        return await asyncio.gather(*(far.report(number) for number in (None, 1, 1, 2)))

    *found, missing = asyncio.run(ask())
    assert {text for _, text in found} == {"a report"}
    assert missing is None
    assert drawn == ["drawer_0"]
