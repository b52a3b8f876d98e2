"""The goal that is aimed at in one picture is shown in the other, once the tip has taught where."""

import pytest
from page_scene import PageScene

from laptop.page.cards.drive import goal_text
from laptop.page.overlay import overlay

PLACES = [(60 + 40 * (k % 5), 60 + 35 * (k // 5)) for k in range(20)]


@pytest.fixture
def scene(tmp_path):
    return PageScene(tmp_path, cameras=2)


def visit(scene, places):
    """Stand at each of these places for a moment; both cameras see the same."""
    for place in places:
        for _ in range(3):
            scene.show(tip=place, goal=None)


def test_a_click_in_one_picture_shows_the_goal_in_the_other(scene):
    visit(scene, PLACES)
    frames = scene.controller.frames
    assert frames.view("B").hint == (), "nothing is aimed at"
    scene.controller.runs.aim("A", 200.0, 100.0)
    ((u, v),) = frames.view("B").hint
    assert (u, v) == pytest.approx((200, 100), abs=2)
    assert frames.view("A").hint == ()
    shown = overlay(frames.view("B"))
    assert 'data-hint="1"' in shown
    assert "the goal, if it is in the tip" in shown


def test_before_the_tip_has_taught_it_nothing_is_shown(scene):
    visit(scene, PLACES[:5])
    scene.controller.runs.aim("A", 200.0, 100.0)
    assert scene.controller.frames.view("B").hint == ()
    assert "data-hint" not in overlay(scene.controller.frames.view("B"))


def test_a_tip_that_moves_fast_teaches_nothing(scene):
    for place in PLACES:
        scene.show(tip=place, goal=None)
    scene.controller.runs.aim("A", 200.0, 100.0)
    assert scene.controller.frames.view("B").hint == ()


def test_a_line_is_drawn_from_end_to_end(scene):
    scene.show()
    shown = overlay(scene.controller.frames.view("B")._replace(hint=((0.0, 20.0), (319.0, 90.0))))
    assert 'data-hint="2"' in shown
    assert '<line x1="0.0" y1="20.0" x2="319.0" y2="90.0"' in shown
    assert "the goal is on this line" in shown


@pytest.mark.parametrize(("u", "anchor"), [(60.0, "start"), (260.0, "end")])
@pytest.mark.parametrize("n", [1, 2])
def test_its_words_stay_in_the_picture(scene, u, anchor, n):
    scene.show()
    hint = ((u, 0.0), (u, 239.0))[:n]
    shown = overlay(scene.controller.frames.view("B")._replace(hint=hint))
    assert f'text-anchor="{anchor}"' in shown


def test_who_aims_in_one_picture_is_told_in_which_to_click_too(scene):
    scene.show()
    runs = scene.controller.runs
    runs.aim("A", 20.0, 30.0)
    assert goal_text(scene.controller.state()) == "pixel A 20, 30; click it in B, too"
    runs.aim("B", 40.0, 50.0)
    assert goal_text(scene.controller.state()) == "pixel A 20, 30 and B 40, 50"
