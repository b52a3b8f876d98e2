import numpy as np
import pytest
from board_views import pixels, stand, view

from laptop.calibration import board_watch
from laptop.calibration.board_watch import LOOK_PERIOD, PATIENCE, BoardWatch

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
    for _ in range(times * LOOK_PERIOD):
        watcher.look(IMAGE)


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
    assert len(looks) == 2  # once it is seen nobody looks any more
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
    look(watcher, PATIENCE - 1)
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
