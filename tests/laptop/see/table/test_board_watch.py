import cv2
import numpy as np
import pytest
from arms import PLANAR as ARM
from board_views import pixels, stand, view

from laptop.emulator.scene.poses import ScriptedPoses
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.see.table import board_watch
from laptop.see.table.board_watch import (
    CHECK_PERIOD,
    MAX_PAUSE,
    MAX_SEARCHES,
    SEARCH_PERIOD,
    BoardWatch,
)

WHERE = stand(52, 25, 200, 3)
IMAGE = np.zeros((480, 640, 3), np.uint8)


@pytest.fixture
def shown(monkeypatch):
    """What each look finds in turn; the last one stays."""
    views = []
    looks = []

    def find(image):
        looks.append(image)
        return views.pop(0) if len(views) > 1 else views[0]

    monkeypatch.setattr(board_watch, "find_board", find)
    return views, looks


def watch(lines=None, **heights):
    return BoardWatch(None, heights, "A", (lines if lines is not None else []).append)


def look(watcher, times):
    for _ in range(times * SEARCH_PERIOD):
        watcher.update(IMAGE)


def test_before_the_board_is_seen_there_are_no_places(shown):
    views, looks = shown
    views.append(None)
    watcher = watch()
    look(watcher, 3)
    assert len(looks) == 3
    assert watcher.calibration is None
    assert watcher.place("effector", (320, 240)) is None


def test_from_then_on_pixels_are_places_at_the_markers_heights(shown):
    views, looks = shown
    views += [None, view(WHERE)]
    lines = []
    watcher = watch(lines, effector=2.5)
    look(watcher, 4)
    assert len(looks) == 2  # once it is seen nobody searches any more
    for name, height in (("effector", 2.5), ("goal", 0.0)):
        seen = pixels(WHERE, [[3.0, -4.0, height]])[0]
        assert watcher.place(name, tuple(seen)) == pytest.approx((3, -4), abs=0.03)
    assert lines[0].startswith("camera A: board a4: 26 of 26 markers in 1 view")
    assert watcher.place("effector", (1e6, 1e6)) is None


def test_a_board_that_the_arm_half_hides_is_waited_for_but_not_for_ever(shown):
    views, looks = shown
    views += [view(WHERE, keep=lambda x, y: x < 0 < y), view(WHERE, keep=lambda x, y: x < 0)]
    views.append(view(WHERE, keep=lambda x, y: x < 0 < y))
    watcher = watch()
    look(watcher, 1)
    assert watcher.calibration is None
    look(watcher, 1)  # half of them
    assert watcher.calibration.markers == (13,)
    views[:] = [view(WHERE, keep=lambda x, y: x < 0 < y)]
    watcher = watch()
    look(watcher, MAX_SEARCHES - 1)
    assert watcher.calibration is None
    look(watcher, 1)
    assert 4 <= watcher.calibration.markers[0] < 13


def test_what_cannot_be_calibrated_is_said_once_and_tried_again(shown):
    views, looks = shown
    views += [view(WHERE, side=9.0)] * 3 + [view(WHERE)]
    lines = []
    watcher = watch(lines)
    look(watcher, 3)
    (line,) = lines
    assert line.startswith("camera A: no place on the board yet: the board is too small")
    look(watcher, 1)
    assert watcher.calibration


# Whether it stays where it is: on pictures of the synthetic camera.


def photo(scene="", q=(0.3, 0.8)):
    """A picture of a board with an arm on it."""
    arm = Scene(ARM, read_scene(f"board=a4,{scene}" if scene else "board=a4"))
    camera = SyntheticCamera(arm, ScriptedPoses(ARM, lambda t: q), lambda: 0.0, start=0.0)
    return camera.capture(0).image


@pytest.fixture(scope="module")
def still():
    return photo()


class Watched:
    """A watch that knows where the board is, and how often it searched whole pictures."""

    def __init__(self, image, monkeypatch, stand=None):
        self.lines, self.searched = [], 0
        self.watcher = BoardWatch(None, {}, "A", self.lines.append, stand)
        search = board_watch.find_board

        def counted(image):
            self.searched += 1
            return search(image)

        monkeypatch.setattr(board_watch, "find_board", counted)
        self.watcher.update(image)
        assert self.watcher.calibration
        self.lines.clear()
        self.searched = 0

    def see(self, image, times=CHECK_PERIOD):
        for _ in range(times):
            self.watcher.update(image)

    @property
    def place(self):
        return self.watcher.place("goal", (400.0, 300.0))


@pytest.fixture
def watched(still, monkeypatch):
    return Watched(still, monkeypatch)


def test_while_it_stands_where_it_was_a_few_markers_are_looked_at_and_nothing_is_said(
    watched, still
):
    watched.see(still, 10 * CHECK_PERIOD)
    watched.see(photo(q=(-0.3, 0.4)), 10 * CHECK_PERIOD)  # other markers are under the arm
    assert watched.searched == 0
    assert watched.lines == []
    assert watched.watcher.version == 1
    assert watched.place


def test_what_moved_gives_no_places_until_it_stands_again_and_is_calibrated_anew(watched, still):
    before = watched.place
    moved = photo("board_x=9.4,board_turn=2")
    watched.see(moved)
    assert watched.place is None
    (line,) = watched.lines
    assert line.startswith("camera A: camera or board has moved, by ")
    assert "mm; places in cm go on once it stands again" in line
    assert line == f"camera A: {watched.watcher.why}"
    assert watched.watcher.version == 1
    watched.see(moved, SEARCH_PERIOD)
    assert len(watched.lines) == 2
    assert watched.lines[1].startswith("camera A: calibrated anew, places in cm go on: board a4: 2")
    assert watched.watcher.version == 2
    assert watched.watcher.why == ""
    shift = np.subtract(watched.place, before)
    assert 0.3 < np.hypot(*shift) < 1.0, "cm: the board went by 0.4 and turned"
    watched.see(moved, 5 * CHECK_PERIOD)
    assert len(watched.lines) == 2


def test_while_it_still_moves_it_is_not_calibrated(watched, still):
    for k in range(6):
        off = np.array([[1.0, 0, 9 + 5 * k], [0, 1, 0]])
        moved = cv2.warpAffine(still, off, (640, 480))
        watched.see(moved, SEARCH_PERIOD if k else CHECK_PERIOD)
        assert watched.place is None
    assert watched.watcher.version == 1
    assert len(watched.lines) == 1


def test_a_camera_that_was_bumped_and_is_back_goes_on_as_before(watched, still):
    bumped = cv2.warpAffine(still, np.array([[1.0, 0, 9], [0, 1, -4]]), (640, 480))
    before = watched.place
    watched.see(bumped)
    assert watched.place is None
    watched.see(still, SEARCH_PERIOD)
    assert watched.place == before
    assert watched.watcher.version == 1
    assert watched.lines[1] == (
        "camera A: camera and board are back where they were; places in cm go on"
    )


def test_a_board_that_is_covered_has_not_moved_and_is_searched_ever_more_seldom(watched, still):
    covered = still.copy()
    covered[60:380, 290:560] = 90
    watched.see(covered, 40 * CHECK_PERIOD)
    assert watched.place
    assert watched.watcher.version == 1
    (line,) = watched.lines
    assert line == (
        "camera A: the board is covered, blurred, or outside of the picture: whether it has moved "
        "is not seen; places in cm are told as if it had not"
    )
    assert watched.searched <= 10  # of 40 checks
    watched.see(still, MAX_PAUSE * CHECK_PERIOD)
    searched = watched.searched
    watched.see(still, 5 * CHECK_PERIOD)
    assert watched.searched == searched
    assert len(watched.lines) == 1


def test_of_a_board_that_is_nearly_covered_what_is_seen_tells(watched, still):
    covered = still.copy()
    covered[120:380, 290:560] = 90  # but for its upper row
    watched.see(covered, 4 * CHECK_PERIOD)
    assert watched.lines == []
    assert watched.searched == 0
    moved = cv2.warpAffine(covered, np.array([[1.0, 0, 9], [0, 1, 0]]), (640, 480))
    watched.see(moved)
    assert watched.place is None


def test_a_blurred_picture_tells_nothing_of_moves(watched, still):
    for sigma in (2.0, 3.0, 5.0):
        watched.see(cv2.GaussianBlur(still, (0, 0), sigma), 8 * CHECK_PERIOD)
        assert watched.place
    (line,) = watched.lines
    assert "whether it has moved is not seen" in line
    moved = cv2.warpAffine(still, np.array([[1.0, 0, 40], [0, 1, 0]]), (640, 480))
    watched.see(cv2.GaussianBlur(moved, (0, 0), 1.5), MAX_PAUSE * CHECK_PERIOD)
    assert "camera or board has moved, by 40.0 px" in watched.lines[1], "by more than any blur"


def test_another_board_in_its_place_is_calibrated_by(watched):
    other = photo("board=letter")
    watched.see(other)
    assert "another board lies there now (letter)" in watched.lines[0]
    watched.see(other, SEARCH_PERIOD)
    assert watched.watcher.calibration.board.paper == "letter"
    assert watched.place


class FakeStand:
    """The pen is 1 cm beside the marker, and the arm 10 cm beside the board."""

    def __init__(self):
        self.asked = []

    def pen(self, marker, q):
        self.asked.append(q)
        return (marker[0] - 1.0, marker[1]) if marker[1] < 5 else None

    def in_arm(self, place):
        return place[0] + 10.0, place[1]


def test_people_are_told_the_pens_place_where_it_is_known_how_the_arm_stands(shown):
    views, _ = shown
    views.append(view(WHERE))
    reported = [(1.0, (0.1, 0.2))]
    stand, lines = FakeStand(), []
    watcher = BoardWatch(None, {"effector": 2.5}, "A", lines.append, stand, lambda: reported[-1])
    assert watcher.board_place("effector", (320, 240)) is None
    look(watcher, 1)
    seen = tuple(pixels(WHERE, [[3.0, -4.0, 2.5]])[0])
    place = watcher.board_place("effector", seen)
    assert place[:2] == pytest.approx((2.0, -4.0), abs=0.03)
    assert place.arm == pytest.approx((12.0, -4.0), abs=0.03)
    assert stand.asked == [(0.1, 0.2)]
    assert watcher.place("effector", seen) == pytest.approx((3.0, -4.0), abs=0.03)
    lying = tuple(pixels(WHERE, [[3.0, -4.0, 0.0]])[0])
    goal = watcher.board_place("goal", lying)
    assert (goal[:2], goal.arm) == (
        pytest.approx((3.0, -4.0), abs=0.03),
        pytest.approx((13.0, -4.0), abs=0.03),
    )
    reported[-1] = None
    far = tuple(pixels(WHERE, [[3.0, 6.0, 2.5]])[0])
    assert watcher.board_place("effector", far) is None, "no pose puts the marker there"
    assert stand.asked[-1] is None


def test_of_several_cameras_none_tells_places_alone(shown):
    views, _ = shown
    views.append(view(WHERE))
    watcher = BoardWatch(None, {}, "A", [].append, alone=False)
    look(watcher, 1)
    assert watcher.place("goal", (320, 240))
    assert watcher.board_place("goal", (320, 240)) is None


def test_after_something_moved_the_arm_may_stand_elsewhere_on_the_board(still, monkeypatch):
    watched = Watched(still, monkeypatch, FakeStand())
    assert watched.watcher.board_place("effector", (400.0, 300.0)).arm
    moved = photo("board_x=9.4,board_turn=2")
    watched.see(moved, 2 * CHECK_PERIOD)
    assert watched.watcher.version == 2
    assert "the pen's place is not told any more" in watched.lines[2]
    assert watched.watcher.board_place("effector", (400.0, 300.0)) is None
    goal = watched.watcher.board_place("goal", (400.0, 300.0))
    assert goal is not None
    assert goal.arm is None


@pytest.mark.parametrize(
    ("blur", "by", "gone"), [(2.0, 4.0, False), (2.0, 9.0, True), (0.8, 4.0, True)]
)
def test_a_shift_within_the_blur_is_none(shown, monkeypatch, blur, by, gone):
    views, _ = shown
    views.append(view(WHERE))
    watcher = watch()
    look(watcher, 1)
    monkeypatch.setattr(board_watch, "find_again", lambda *_: None)
    seen = view(WHERE, blur=blur)
    seen.pixels[:, 0] += by
    views[:] = [seen]
    for _ in range(CHECK_PERIOD):
        watcher.update(IMAGE)
    assert (watcher.place("goal", (320, 240)) is None) == gone
