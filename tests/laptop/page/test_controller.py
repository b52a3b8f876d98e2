"""Viewers, state, history and the emulated brick that comes along."""

import pytest
from page_scene import PATH, PageScene

from laptop.page import camera_feed, page_viewers, snapshots
from laptop.page.silence import PageReport, Presence, Sign
from laptop.page.steering import BROWSER_TIMEOUT
from shared.messages import EFFECTOR, GOAL, Stop


def test_somebody_looks_who_has_asked_lately(scene):
    assert not scene.controller.has_viewers
    scene.controller.state()
    assert scene.controller.has_viewers
    scene.t += page_viewers.VIEWER_TIMEOUT
    assert not scene.controller.has_viewers


@pytest.mark.parametrize("comes", ["expect_viewer", "opened"])
def test_who_is_expected_may_take_any_time(scene, comes):
    getattr(scene.controller, comes)()
    scene.controller.state()  # which the page asks for while the browser still has nothing
    scene.t += 0.9 * page_viewers.PAGE_OPEN_TIMEOUT
    assert scene.controller.has_viewers
    scene.controller.arrived()
    scene.controller.state()
    scene.t += page_viewers.VIEWER_TIMEOUT
    assert not scene.controller.has_viewers
    scene.controller.expect_viewer()
    scene.t += page_viewers.PAGE_OPEN_TIMEOUT
    assert not scene.controller.has_viewers, "nobody came"


def test_the_state_tells_of_cameras_link_and_markers(scene):
    for _ in range(40):
        scene.show()
    scene.watchers[0].dropped = 3
    state = scene.controller.state()
    (camera,) = state.cameras
    assert camera.rate == pytest.approx(1 / camera_feed.HEARTBEAT_PERIOD)
    assert camera.age == pytest.approx(0.02)
    assert (camera.dropped, camera.trouble) == (3, "")
    assert state.brick == "10.0.0.2"
    assert set(state.markers) == {EFFECTOR, GOAL}
    scene.t += 5
    assert "no frame for 5 s" in scene.controller.state().cameras[0].trouble


def test_the_history_is_the_last_minute(scene):
    scene.server.tell("", 1, e={"A.u": 3.0}, condition=2.5, moves=4)
    for _ in range(1300):
        scene.t += camera_feed.HEARTBEAT_PERIOD
        scene.controller.heartbeat()
    history = scene.controller.history()
    assert history[-1].t - history[0].t == pytest.approx(snapshots.HISTORY_DURATION, abs=0.3)
    assert (history[-1].error, history[-1].e, history[-1].condition) == (12.5, {"A.u": 3.0}, 2.5)
    assert len(scene.controller.history(history[-4].t)) == 3


def test_an_emulated_brick_that_cannot_come_is_told_of(tmp_path):
    def bring():
        raise OSError(28, "No space left on device", "lines.txt")

    scene = PageScene(tmp_path, bring=bring)
    scene.server.there = False
    scene.controller.opened()
    assert not scene.controller.state().own
    assert "no emulated brick: No space left" in scene.controller.state().note


def test_an_own_brick_comes_when_somebody_looks_and_no_other_is_there(tmp_path):
    brought, why = [], ""

    def bring():
        brought.append(1)
        return lambda: why

    scene = PageScene(tmp_path, bring=bring)
    scene.controller.opened()
    assert brought == [], "there is one"
    scene.server.there = False
    scene.controller.opened()
    scene.controller.opened()
    scene.controller.heartbeat()
    assert brought == [1]
    assert scene.controller.state().own
    scene.server.there = True
    scene.show()
    scene.controller.runs.follow("A", PATH)
    scene.controller.runs.start()
    scene.server.there = False
    why = "it fell"
    scene.controller.heartbeat()
    assert not scene.controller.state().own
    assert scene.controller.state().note.startswith("the path ends here, ")
    assert scene.controller.state().note.endswith("it fell; load the page anew for another one")
    why = ""
    scene.controller.opened()
    assert brought == [1, 1]
    assert scene.controller.state().own


def test_a_real_brick_is_called_at_a_click_and_its_end_is_told(tmp_path):
    called, why = [], ""

    def start_on_brick():
        called.append(1)
        return lambda: why

    scene = PageScene(tmp_path, start_on_brick=start_on_brick)
    assert scene.controller.runs.call_brick() == "a brick is connected already"
    assert not scene.controller.state().can_call
    scene.server.there = False
    assert scene.controller.state().can_call
    assert scene.controller.runs.call_brick() == ""
    assert scene.controller.runs.call_brick() == "the brick is being called; wait"
    assert called == [1]
    assert not scene.controller.state().can_call
    why = "brick run has ended"
    scene.controller.heartbeat()
    scene.controller.heartbeat()
    assert scene.controller.state().note == "brick run has ended"
    assert scene.controller.state().can_call


def test_where_no_brick_is_called_or_can_be_it_is_said(tmp_path):
    def start_on_brick():
        raise OSError(28, "No space left on device", "brick.txt")

    scene = PageScene(tmp_path)
    scene.server.there = False
    assert "no brick is called from here" in scene.controller.runs.call_brick()
    assert not scene.controller.state().can_call
    scene = PageScene(tmp_path, start_on_brick=start_on_brick)
    scene.server.there = False
    assert "No space left on device: brick.txt" in scene.controller.runs.call_brick()
    assert scene.controller.state().can_call


def go(scene, seconds, sign=None, **report):
    """Let the time pass, heartbeat by heartbeat, in which no browser is heard.

    With a sign of browser 1 the page's process is.
    """
    for _ in range(round(seconds / camera_feed.HEARTBEAT_PERIOD)):
        if sign:
            scene.controller.steering.on_status({}, PageReport({1: sign}, **report))
        scene.show()


def drive(scene):
    """Let browser 1 order a run, which begins."""
    scene.show()
    scene.controller.steering.claim(1, "Chrome on Linux")
    scene.controller.steering.on_status({1: scene.t})
    assert scene.controller.runs.aim("A", 40.0, 50.0) == ""
    assert scene.controller.runs.start() == ""
    scene.server.tell("", 1)
    scene.show()
    scene.server.sent.clear()


UNHEARD = "no page was heard for 2 s, as "
BROWSER = "browser 1 (Chrome on Linux)"


def test_a_run_that_is_held_for_the_death_of_the_page_s_process_says_so(scene):
    drive(scene)
    go(scene, 0.2)
    scene.controller.lose_page("was ended by SIGKILL")
    assert scene.controller.state().note == "page: its process was ended by SIGKILL; it starts anew"
    go(scene, BROWSER_TIMEOUT)
    why = f"{UNHEARD}its process was ended by SIGKILL"
    assert scene.server.sent[0] == Stop(f"held: {why}. It starts anew by itself.")
    assert f"{why}: held; Start goes on. It starts" in scene.controller.state().note


def test_a_page_s_process_that_was_replaced_before_is_no_reason_for_what_comes_later(scene):
    drive(scene)
    scene.controller.lose_page("was ended by SIGKILL")
    go(scene, 1)
    scene.controller.steering.on_status({1: scene.t})
    go(scene, BROWSER_TIMEOUT + 0.1, Sign(Presence.CLOSED))
    assert scene.server.sent[0].reason.startswith(f"held: {UNHEARD}the page was closed in")


def test_a_page_s_process_that_a_signal_has_stopped_is_told(scene):
    drive(scene)
    scene.controller.watch.why_page_not_running = lambda: "was stopped by a signal"
    go(scene, BROWSER_TIMEOUT + 0.1)
    assert f"{UNHEARD}its process was stopped by a signal. It" in scene.server.sent[0].reason


def test_a_page_s_process_that_says_nothing_or_comes_late_is_told(scene):
    drive(scene)
    go(scene, BROWSER_TIMEOUT + 0.1)
    reported = "its process was too busy to answer for 2 s, or hangs. Close other programs"
    assert f"{UNHEARD}{reported}" in scene.server.sent[0].reason
    scene.server.tell("stopped", 1)
    drive(scene)
    go(scene, BROWSER_TIMEOUT + 0.1, Sign(Presence.SHOWN), late=1.8)
    assert f"{UNHEARD}{reported}" in scene.server.sent[0].reason


def test_a_tracker_that_stood_still_holds_the_run_and_says_so(scene):
    drive(scene)
    scene.t += 5
    scene.controller.steering.on_status({}, PageReport({1: Sign(Presence.SHOWN)}))
    scene.show()
    reported = "held: no page was heard for 5 s, as the tracker stood still for 5 s. "
    assert scene.server.sent[0].reason.startswith(reported)


def test_a_tracker_that_stood_still_before_is_no_reason_for_what_comes_later(scene):
    drive(scene)
    scene.t += 1.5
    scene.show()
    scene.controller.steering.on_status({1: scene.t})
    go(scene, BROWSER_TIMEOUT + 0.1, Sign(Presence.BROKEN))
    assert f"{UNHEARD}the connection to {BROWSER} broke. " in scene.server.sent[0].reason


def test_a_run_is_held_when_no_page_is_heard_any_more(scene):
    drive(scene)
    go(scene, BROWSER_TIMEOUT - 0.2)
    scene.controller.steering.on_status({1: scene.t - 0.1})
    go(scene, BROWSER_TIMEOUT - 0.2, Sign(Presence.SHOWN))
    assert scene.server.sent == []
    go(scene, 0.3, Sign(Presence.SHOWN))
    reported = f"{UNHEARD}nothing comes from {BROWSER}, though it is connected: "
    assert scene.server.sent[0].reason.startswith(f"held: {reported}")
    note = scene.controller.state().note
    assert f"{reported}its network is cut, or it hangs: held; Start goes on. " in note
    scene.server.tell("stopped", 1)
    scene.show()
    scene.server.sent.clear()
    go(scene, 5)
    assert scene.server.sent == []


@pytest.mark.parametrize(
    ("sign", "stood", "reported"),
    [
        (Presence.SHOWN, 0.3, "network was cut"),
        (Presence.SHOWN, 4.0, "still itself for 4 s"),
        (Presence.CLOSED, 4.0, "Keep it open"),
    ],
)
def test_what_was_open_is_settled_by_the_browser_that_is_back(scene, sign, stood, reported):
    drive(scene)
    scene.controller.steering.report_return(9.0)  # of before
    go(scene, BROWSER_TIMEOUT + 0.5, Sign(sign))
    assert "It is back" not in scene.controller.state().note
    scene.controller.steering.report_return(stood)
    scene.show()
    note = scene.controller.state().note
    assert reported in note
    assert ("It is back" in note) == (sign is Presence.SHOWN)


def test_a_run_that_nobody_ordered_here_goes_on_whoever_is_heard(scene):
    scene.controller.steering.claim(1, "")
    scene.server.tell("", 1)
    go(scene, 3 * BROWSER_TIMEOUT)
    assert scene.controller.state().running
    assert scene.server.sent == []


def test_a_run_goes_on_unheard_if_that_is_wanted(tmp_path):
    scene = PageScene(tmp_path, hold_on_timeout=False)
    drive(scene)
    go(scene, 3 * BROWSER_TIMEOUT)
    assert scene.server.sent == []


def test_the_state_tells_who_steers_and_a_stop_who_stopped(scene):
    assert (scene.controller.state().driver, scene.controller.state().driver_name) == (0, "")
    drive(scene)
    state = scene.controller.state()
    assert (state.driver, state.driver_name) == (1, "browser 1 (Chrome on Linux)")
    assert scene.controller.runs.stop("browser 2 (Safari on iPhone)") == ""
    (stop,) = scene.server.sent
    assert stop.reason.startswith("stopped ")
    assert stop.reason.endswith(" by browser 2 (Safari on iPhone)")
