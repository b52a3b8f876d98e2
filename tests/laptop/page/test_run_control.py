"""Goals and runs that are ordered from the page."""

import pytest
from page_scene import PATH, PageScene

from shared.messages import GOAL, Start, Status, Stop


def test_a_start_goes_to_the_point_that_was_clicked(scene):
    scene.show()
    assert scene.controller.runs.aim("A", 40.0, 50.0) == ""
    assert scene.show().aim == (40.0, 50.0)
    assert scene.controller.runs.start("kalman", "stream", "stereo", 3.0) == ""
    assert scene.server.sent == [
        Start("kalman", "stream", "stereo", 3.0, goals={"A": (40.0, 50.0)})
    ]


@pytest.mark.parametrize(("method", "mode"), [("chain", "stream"), ("report", "look")])
def test_where_no_mode_is_chosen_it_steers_if_the_method_can(scene, method, mode):
    scene.show()
    assert scene.controller.runs.start(method) == ""
    assert [start.mode for start in scene.server.sent] == [mode]


FOLLOW = ("chain", "stream", "stereo", 8.0, 300.0, True)


def test_a_goal_marker_that_moves_is_followed_until_it_is_said_otherwise(scene):
    scene.show()
    assert scene.controller.runs.start(*FOLLOW) == ""
    assert scene.server.sent == [Start(*FOLLOW)]
    scene.server.tell("", 1)
    scene.show()
    assert scene.controller.state().following
    assert scene.controller.runs.hold() == ""
    scene.server.tell("converged", 1)
    scene.show()
    assert not scene.controller.state().following
    scene.server.tell("", 2)  # the brick's own, of which nobody here knows the orders
    scene.show()
    assert not scene.controller.state().following


def test_only_a_goal_marker_can_be_followed(scene):
    scene.show()
    scene.controller.runs.aim("A", 40.0, 50.0)
    assert "only a goal marker can be followed" in scene.controller.runs.start(*FOLLOW)
    assert scene.server.sent == []
    scene.controller.runs.aim_at_marker()
    assert scene.controller.runs.start(*FOLLOW) == ""


def test_what_leaves_joints_undetermined_is_refused_here_already(scene):
    scene.show()
    scene.server.status = Status(0.0, (0.1, 0.2, 0.3), None, "ready")
    scene.controller.runs.aim("A", 40.0, 50.0)
    assert "where 3 joints are to go" in scene.controller.runs.start()
    assert scene.server.sent == []


def test_a_start_goes_to_the_marker_if_no_point_was_clicked(scene):
    scene.show()
    scene.controller.runs.aim("A", 40.0, 50.0)
    assert scene.controller.runs.aim_at_marker() == ""
    assert scene.controller.runs.start() == ""
    assert scene.server.sent == [Start()]
    assert scene.show().aim is None


def test_without_any_goal_nothing_starts(scene):
    scene.show()
    scene.controller.colours.rename(GOAL, "other")
    assert "no goal yet" in scene.controller.runs.start()
    assert scene.server.sent == []


def test_a_goal_outside_the_picture_is_refused(scene):
    assert "gives no picture" in scene.controller.runs.aim("A", 1.0, 1.0)
    scene.show()
    assert "outside the picture" in scene.controller.runs.aim("A", 400.0, 50.0)
    assert scene.show().aim is None


def test_two_cameras_want_a_goal_each(tmp_path):
    scene = PageScene(tmp_path, cameras=2)
    scene.show()
    scene.controller.runs.aim("A", 40.0, 50.0)
    assert "camera B" in scene.controller.runs.start()
    scene.controller.runs.aim("B", 140.0, 150.0)
    assert scene.controller.runs.start(rows="xyz") == ""
    assert scene.server.sent[0].goals == {"A": (40.0, 50.0), "B": (140.0, 150.0)}
    assert "several cameras" in scene.controller.runs.follow("A", [(1.0, 1.0), (99.0, 99.0)])


def test_a_click_after_a_run_is_a_new_goal_which_no_picture_shows_yet_but_its_own(tmp_path):
    scene = PageScene(tmp_path, cameras=2)
    scene.show()
    runs = scene.controller.runs
    for u in (40.0, 60.0):  # before a run a click mends the goal
        runs.aim("A", u, 50.0)
        runs.aim("B", 140.0, 150.0)
        assert set(runs.aims) == {"A", "B"}
    assert runs.start(rows="xyz") == ""
    scene.server.tell("", 1)
    scene.show()
    scene.server.tell("converged", 1)
    scene.show()
    runs.aim("A", 80.0, 90.0)
    assert runs.aims == {"A": (80.0, 90.0)}
    assert "camera B" in runs.start(rows="xyz")
    runs.aim("B", 20.0, 30.0)
    assert runs.start(rows="xyz") == ""
    assert scene.server.sent[-1].goals == {"A": (80.0, 90.0), "B": (20.0, 30.0)}


@pytest.mark.parametrize("verdict", ["", "ready", "converged"])
def test_a_start_while_a_run_is_on_is_refused(scene, verdict):
    scene.show()
    scene.server.tell(verdict, 1)
    why = scene.controller.runs.start()
    assert ("a run is on" in why) == (verdict == "")
    assert len(scene.server.sent) == (verdict != "")
    # From the order on, even before the brick has said a word about it.
    assert "a run is on" in scene.controller.runs.start()
    assert "a run is on" in scene.controller.runs.aim("A", 40.0, 50.0)
    assert "a run is on" in scene.controller.runs.aim_at_marker()
    assert scene.controller.state().running


@pytest.mark.parametrize(
    ("orders", "why"),
    [
        (("guess",), "'guess' is no method; take one of report, "),
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
    assert why in scene.controller.runs.start(*orders)
    assert scene.server.sent == []


def test_without_a_brick_nothing_starts_and_the_command_is_told(scene):
    scene.show()
    scene.server.there = False
    assert "no brick is connected" in scene.controller.runs.start()
    assert "no brick is connected" in scene.controller.runs.stop()
    assert not scene.controller.state().running
    assert scene.controller.state().commands == tuple(scene.server.commands())


def test_a_path_is_followed_point_after_point(scene):
    scene.show()
    assert scene.controller.runs.follow("A", PATH) == ""
    shown = scene.show()
    assert shown.aim == PATH[0]
    assert [u for u, _ in shown.ahead] == [75, 100, 125, 150]
    assert scene.controller.runs.start("broyden", "look", "stereo", 4.0) == ""
    for run in range(1, 6):
        scene.server.tell("", run)
        scene.show()
        assert len(scene.server.sent) == run, "it waits for the verdict"
        scene.server.tell("converged", run)
        assert scene.controller.state().running == (run < 5), "even before it has gone on"
        scene.show()
        scene.show()
    assert [start.goals["A"][0] for start in scene.server.sent] == [50, 75, 100, 125, 150]
    assert {start.method for start in scene.server.sent} == {"broyden"}
    assert scene.controller.state().left == 0


@pytest.mark.parametrize("verdict", ["unreachable", "stopped", "marker lost"])
def test_a_path_ends_where_a_point_is_not_reached(scene, verdict):
    scene.show()
    scene.controller.runs.follow("A", PATH)
    scene.controller.runs.start()
    scene.server.tell(verdict, 1)
    scene.show()
    scene.show()
    assert len(scene.server.sent) == 1
    assert "4 points before its end" in scene.controller.state().note


@pytest.mark.parametrize("order", ["hold", "stop"])
def test_a_stop_is_said_until_the_brick_has_heard_it(scene, order):
    """A link that breaks takes it along; behind it the run would go on by itself."""
    scene.show()
    scene.controller.runs.aim("A", 100, 100)
    scene.controller.runs.start()
    scene.server.tell("", run=1)
    scene.server.there = False
    assert "as soon as it is back" in getattr(scene.controller.runs, order)()
    scene.controller.heartbeat()
    scene.server.sent.clear()
    scene.server.there = True
    scene.controller.heartbeat()
    scene.server.tell("", run=1)
    scene.controller.heartbeat()
    assert [type(said) for said in scene.server.sent] == [Stop, Stop]
    scene.server.tell("stopped", run=1)
    scene.controller.heartbeat()
    scene.server.tell("", run=2)  # of its own
    scene.controller.heartbeat()
    assert len(scene.server.sent) == 2


def test_a_fixed_goal_is_known(tmp_path):
    scene = PageScene(tmp_path, goal=(50, 60))
    scene.show()
    assert scene.controller.state().fixed
    assert scene.controller.runs.start() == ""


@pytest.mark.parametrize(("order", "left"), [("hold", 4), ("stop", 0)])
def test_after_hold_a_path_goes_on_and_after_stop_it_does_not(scene, order, left):
    scene.show()
    scene.controller.runs.follow("A", PATH)
    scene.controller.runs.start()
    scene.server.tell("", 1)
    getattr(scene.controller.runs, order)()
    scene.server.tell("converged", 1)  # it was there just before
    scene.show()
    assert len(scene.server.sent) == 2
    assert scene.controller.state().left == left
