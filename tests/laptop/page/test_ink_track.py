"""The ink is what the tip did with the pen down, and no more, though all is told late."""

import numpy as np
import pytest

from laptop.page.ink_track import MAX_POINTS, InkTrack
from laptop.page.table_mapping import TableView


def watched(frames_late, tells_late):
    """A tip that goes right at 10 px a frame; the pen is down from 1 s to 2, and from 3 to 4."""
    ink = InkTrack()
    events = []
    for k in range(60):
        events.append((0.1 * k + frames_late, "see", 0.1 * k, (10.0 * k, 5.0)))
    for k in range(30):
        t = 0.2 * k + 0.01
        events.append((t + tells_late, "tell", t, 1 <= t < 2 or 3 <= t < 4))
    for t, down in ((1.0, True), (2.0, False), (3.0, True), (4.0, False)):
        events.append((t + tells_late, "tell", t, down))
    for _, kind, t, what in sorted(events, key=lambda event: event[0]):
        getattr(ink, kind)(t, what)
    return ink


@pytest.mark.parametrize("frames_late", [0.0, 0.07, 0.3])
@pytest.mark.parametrize("tells_late", [0.0, 0.05, 0.4])
def test_only_what_was_seen_with_the_pen_down_is_ink(frames_late, tells_late):
    ink = watched(frames_late, tells_late)
    places = [point.u for point in ink.points]
    assert set(places) <= {*np.arange(100.0, 210, 10), *np.arange(300.0, 410, 10)}
    assert len(places) >= 18
    assert [point.u for point in ink.points if point.begins] == [100.0, 300.0]


def test_a_tip_that_was_not_seen_for_a_while_leaves_a_gap():
    ink = InkTrack()
    ink.tell(0.0, True)
    for t in (0.1, 0.2, 1.5, 1.6):
        ink.see(t, (100 * t, 0.0))
    ink.tell(2.0, True)
    assert [point.begins for point in ink.points] == [True, False, True, False]


def test_a_pen_that_is_lifted_shortly_begins_a_new_line():
    ink = InkTrack()
    for t, down in ((0.0, True), (0.45, False), (0.65, True), (1.2, True)):
        for k in range(10):
            ink.see(t + 0.02 * k, (100 * (t + 0.02 * k), 0.0))
        ink.tell(t, down)
    begun = [point.u for point in ink.points if point.begins]
    assert len(begun) == 2
    assert begun[1] >= 65.0


def test_it_stays_small_and_says_when_it_was_thinned():
    ink = InkTrack()
    version = ink.version
    ink.tell(0.0, True)
    for k in range(3 * MAX_POINTS):
        ink.see(0.01 * k, (2.0 * k, 0.0))
        ink.tell(0.01 * k + 0.005, True)
    assert len(ink.points) <= MAX_POINTS
    assert ink.version > version
    ink.begin()
    assert ink.points == []


def test_on_the_table_it_is_lines_in_cm():
    ink = watched(0.0, 0.0)
    scale = np.diag([10.0, 10.0, 1.0])
    one, other = ink.on_table(TableView(scale))
    assert one[0] == pytest.approx((10.0, 0.5))
    assert other[-1] == pytest.approx((40.0, 0.5), abs=1.01)
