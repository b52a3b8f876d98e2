"""The ink is what the tip did with the pen down, and no more, though all is told late."""

import numpy as np
import pytest

from laptop.page.ink_track import MAX_POINTS, InkTrack


def watched(frames_late, tells_late):
    """A tip that goes right at 10 px a frame; the pen is down from 1 s to 2, and from 3 to 4."""
    ink = InkTrack()
    events = []
    for k in range(60):
        events.append((0.1 * k + frames_late, "add_tip", 0.1 * k, (10.0 * k, 5.0)))
    for k in range(30):
        t = 0.2 * k + 0.01
        events.append((t + tells_late, "set_pen", t, 1 <= t < 2 or 3 <= t < 4))
    for t, down in ((1.0, True), (2.0, False), (3.0, True), (4.0, False)):
        events.append((t + tells_late, "set_pen", t, down))
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
    ink.set_pen(0.0, True)
    for t in (0.1, 0.2, 1.5, 1.6):
        ink.add_tip(t, (100 * t, 0.0))
    ink.set_pen(2.0, True)
    assert [point.begins for point in ink.points] == [True, False, True, False]


def test_a_pen_that_is_lifted_shortly_begins_a_new_line():
    ink = InkTrack()
    for t, down in ((0.0, True), (0.45, False), (0.65, True), (1.2, True)):
        for k in range(10):
            ink.add_tip(t + 0.02 * k, (100 * (t + 0.02 * k), 0.0))
        ink.set_pen(t, down)
    begun = [point.u for point in ink.points if point.begins]
    assert len(begun) == 2
    assert begun[1] >= 65.0


def test_it_stays_small_and_says_when_it_was_thinned():
    ink = InkTrack()
    version = ink.version
    ink.set_pen(0.0, True)
    for k in range(3 * MAX_POINTS):
        ink.add_tip(0.01 * k, (2.0 * k, 0.0))
        ink.set_pen(0.01 * k + 0.005, True)
    assert len(ink.points) <= MAX_POINTS
    assert ink.version > version
    ink.begin()
    assert ink.points == []


def test_on_the_table_it_is_lines_in_cm():
    ink = watched(0.0, 0.0)
    one, other = ink.lines(lambda pixels, shifts: pixels / 10 - shifts)
    assert one[0] == pytest.approx((10.0, 0.5))
    assert other[-1] == pytest.approx((40.0, 0.5), abs=1.01)
    assert InkTrack().lines(lambda pixels, shifts: pixels) == ()


def shifted(known_until):
    """The ink of a marker beside the pen, whose place beside it is known by `known_until` (s)."""
    return InkTrack(lambda t: (t, -1.0) if t <= known_until[0] else None)


def test_ink_waits_until_it_is_known_how_the_marker_is_beside_the_pen():
    known = [0.35]
    ink = shifted(known)
    ink.set_pen(0.0, True)
    for k in range(1, 11):
        ink.add_tip(0.1 * k, (100.0 * k, 0.0))
    ink.set_pen(1.0, True)
    assert len(ink.points) == 3
    known[0] = 1.0
    ink.resolve(1.1)
    assert len(ink.points) == len(ink.shifts) == 10
    (line,) = ink.lines(lambda pixels, shifts: shifts)
    assert line == pytest.approx(np.column_stack([np.arange(1, 11) / 10, np.full(10, -1.0)]))


def test_where_that_is_never_known_there_is_a_gap_and_no_ink_in_a_wrong_place():
    ink = InkTrack(lambda t: None if 0.25 < t < 0.75 else (0.0, 0.0))
    ink.set_pen(0.0, True)
    for k in range(1, 11):
        ink.add_tip(0.1 * k, (100.0 * k, 0.0))
    ink.set_pen(1.0, True)
    assert [point.u for point in ink.points] == [100.0, 200.0]
    ink.resolve(5.0)
    assert [(p.u, p.begins) for p in ink.points][2:] == [
        (800.0, True), (900.0, False), (1000.0, False)
    ]  # fmt: skip


def test_a_thinned_ink_keeps_what_belongs_together():
    ink = InkTrack(lambda t: (t, 0.0))
    ink.set_pen(0.0, True)
    for k in range(MAX_POINTS + 10):
        ink.add_tip(0.01 * k, (2.0 * k, 0.0))
        ink.set_pen(0.01 * k + 0.005, True)
    assert [s[0] * 200 for s in ink.shifts] == pytest.approx([p.u for p in ink.points])
