"""Edits of the markers' colours."""

import cv2
import numpy as np
import pytest
from page_scene import BLUE, HEIGHT, RED, WIDTH, mark

from laptop.page import camera_feed
from laptop.see.markers.learning import learn
from laptop.see.markers.markers import BadMarker, hsv_mask, read_markers, read_spec, write_markers
from laptop.see.markers.picked_colors import exclude, include
from laptop.see.markers.tracker import Tracker
from shared.messages import EFFECTOR, GOAL


def test_a_colour_is_picked_in_the_picture_that_was_shown(scene):
    shown = scene.show(ink=BLUE)
    assert mark(shown).why
    for _ in range(5):
        scene.show(tip=(250, 200), ink=BLUE)  # it has moved on when the click comes in
    assert scene.controller.colours.pick(EFFECTOR, "A", shown.index, (100, 120)) == ""
    seen = mark(scene.show(tip=(120, 150), ink=BLUE))
    assert (seen.u, seen.v) == pytest.approx((120, 150), abs=0.5)
    assert read_markers(scene.file)[EFFECTOR].color.hue == pytest.approx(223, abs=12)


def test_a_rectangle_does_as_well_as_a_click_and_may_name_a_new_marker(scene):
    shown = scene.show()
    assert scene.controller.colours.pick("third", "A", shown.index, (210, 50, 230, 70)) == ""
    assert mark(scene.show(), "third").u == pytest.approx(220, abs=0.5)
    assert set(read_markers(scene.file)) == {"third"}, "nothing else was learned"


def test_a_pick_leaves_what_the_file_knows_of_the_other_markers(scene):
    """A synthetic scene has colours of its own; those that were learned of a webcam stay."""
    learned = read_spec(GOAL, "disc:blue")
    write_markers(scene.file, {GOAL: learned})
    shown = scene.show()
    assert scene.controller.colours.pick(EFFECTOR, "A", shown.index, (100, 120)) == ""
    stored = read_markers(scene.file)
    assert set(stored) == {EFFECTOR, GOAL}
    assert stored[GOAL] == learned


def test_undo_takes_back_what_was_picked_on_the_disk_too(scene):
    shown = scene.show()
    before = scene.controller.state().markers
    scene.controller.colours.pick(EFFECTOR, "A", shown.index, (220, 60))
    assert scene.controller.state().markers != before
    assert scene.controller.state().undoable == 1
    assert scene.controller.colours.undo() == ""
    assert scene.controller.state().markers == before
    assert abs(read_markers(scene.file)[EFFECTOR].color.hue) < 1
    assert scene.controller.colours.undo() == "there is nothing to undo"


def test_where_there_is_nothing_to_pick_the_old_colour_stays(scene):
    shown = scene.show()
    before = scene.controller.state().markers
    assert "no colour at 20,20" in scene.controller.colours.pick(
        EFFECTOR, "A", shown.index, (20, 20)
    )
    assert "outside the picture" in scene.controller.colours.pick(
        EFFECTOR, "A", shown.index, (20, 900)
    )
    assert "name it" in scene.controller.colours.pick("a b", "A", shown.index, (100, 120))
    assert scene.controller.state().markers == before
    assert not scene.file.exists()


def test_an_old_picture_is_gone_unless_it_is_pinned(scene):
    first, second = scene.show(), scene.show()
    assert scene.controller.frames.pin("A", second.index) == ""
    for _ in range(camera_feed.RECENT_FRAMES):
        scene.show()
    assert "too old" in scene.controller.colours.pick(EFFECTOR, "A", first.index, (100, 120))
    assert "too old" in scene.controller.frames.pin("A", first.index)
    assert scene.controller.colours.pick(EFFECTOR, "A", second.index, (100, 120)) == ""


def test_a_marker_can_be_renamed(scene):
    scene.show()
    assert scene.controller.colours.rename(GOAL, "target") == ""
    assert mark(scene.show(), "target").u == pytest.approx(220, abs=0.5)
    assert set(scene.controller.state().markers) == {EFFECTOR, "target"}
    assert "none of this name" in scene.controller.colours.rename(GOAL, "other")


def test_renamed_it_has_no_old_name_in_the_file_and_an_undo_takes_it_back(scene):
    other = read_spec("target", "disc:blue")
    write_markers(scene.file, {"target": other, "mine": other})
    scene.show()
    assert scene.controller.colours.rename(GOAL, "target") == ""
    assert set(read_markers(scene.file)) == {"target", "mine"}
    assert read_markers(scene.file)["target"].color.hue == 125, "it was the goal's"
    assert scene.controller.colours.undo() == ""
    assert set(scene.controller.state().markers) == {EFFECTOR, GOAL}
    assert set(read_markers(scene.file)) == {GOAL, "target", "mine"}
    assert read_markers(scene.file)["target"] == other


def test_an_undone_marker_that_was_new_is_not_kept_either(scene):
    shown = scene.show()
    scene.controller.colours.pick("third", "A", shown.index, (220, 60))
    assert "third" in read_markers(scene.file)
    scene.controller.colours.undo()
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
    assert hsv_mask(cv2.cvtColor(disc(DULL), cv2.COLOR_BGR2HSV), wide.color)[120, 160]
    orange = include(red, disc(ORANGE), (160, 120))
    for ink, inside in ((RED, True), (ORANGE, True), (BLUE, False)):
        mask = hsv_mask(cv2.cvtColor(disc(ink), cv2.COLOR_BGR2HSV), orange.color)
        assert bool(mask[120, 160]) == inside
    without = exclude(orange, disc(ORANGE), (160, 120))
    for ink, inside in ((RED, True), (ORANGE, False)):
        mask = hsv_mask(cv2.cvtColor(disc(ink), cv2.COLOR_BGR2HSV), without.color)
        assert bool(mask[120, 160]) == inside
    with pytest.raises(BadMarker, match="nothing to remove"):
        exclude(red, disc(BLUE), (160, 120))
    with pytest.raises(BadMarker, match="looks like the marker itself"):
        exclude(red, disc(RED), (160, 120))


def test_adding_and_removing_act_on_the_tracker(scene):
    shown = scene.show()
    assert "pick it first" in scene.controller.colours.add("third", "A", shown.index, (220, 60))
    before = scene.controller.state().markers[EFFECTOR]
    assert scene.controller.colours.add(EFFECTOR, "A", shown.index, (220, 60)) == ""
    assert scene.controller.state().markers[EFFECTOR] != before
    assert scene.controller.colours.remove(EFFECTOR, "A", shown.index, (220, 60)) == ""
    assert mark(scene.show()).u == pytest.approx(100, abs=0.5)
