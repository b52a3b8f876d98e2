"""A page that is cut off, its process dead or frozen, the tracker frozen; and two who look.

In a real browser, before the tracker on rendered frames and an emulated brick.
"""

import math
import os
import re
import signal
import threading

import pytest
from page_tracker import COLOUR_FOLD, SYNTHETIC, Surfer, Tracker, open_fold
from waiting import PATIENCE, until

from tests.claims.page_rig import start_button
from tests.claims.silent_network import silent_network

FAR = (0.9, 0.5), (-0.7, -0.6)
"""Postures that are far from each other, rad."""

NOTE_CUT_OFF = """() => new MutationObserver(() => {
  if (document.body.classList.contains("cut-off")) sessionStorage.wasCutOff = "yes";
}).observe(document.body, { attributes: true })"""
"""Notes that the page was cut off, for the page that is loaded anew."""


@pytest.fixture(scope="module")
def tracker(tmp_path_factory):
    with Tracker(tmp_path_factory.mktemp("page"), *SYNTHETIC) as tracker:
        yield tracker


@pytest.fixture
def surfer(browser, tracker):
    surfer = Surfer(browser, tracker)
    yield surfer
    surfer.page.keyboard.press("Escape")
    surfer.close()


@pytest.fixture(scope="module")
def network():
    with silent_network() as network:
        yield network


@pytest.fixture
def far_surfer(browser, tracker, network):
    """Somebody to whom a network leads that can fall silent."""
    surfer = Surfer(browser, tracker, proxy={"server": network.url})
    yield surfer
    for event in (network.passes, *network.ports.values()):
        event.set()
    surfer.close()


def run_to_the_farther_goal(surfer):
    """Order a run, and wait until the true arm is on its way."""
    here = surfer.tip()
    tips = [surfer.scene.truth(posture)["effector"] for posture in FAR]
    surfer.aim(*max(tips, key=lambda tip: math.dist(tip, here)))
    surfer.start_and_move()


def stands(surfer):
    """Wait until the true arm has stood still for a second of the emulated world."""
    since, before = surfer.clock.now(), surfer.joints()
    while surfer.clock.now() - since < 1.0:
        surfer.page.wait_for_timeout(20)
        now = surfer.joints()
        if math.dist(now, before) > 0.005:
            since, before = surfer.clock.now(), now


def has_class(surfer, name, there=True):
    surfer.page.wait_for_function(
        f"document.body.classList.contains('{name}') === {str(there).lower()}"
    )


def reported(tracker, text):
    until(lambda: any(text in line for line in tracker.lines), text)


def test_the_death_of_the_page_s_process_holds_the_run_and_is_told_and_mended(surfer, tracker):
    run_to_the_farther_goal(surfer)
    (page,) = tracker.page_processes()
    os.kill(page, signal.SIGKILL)
    has_class(surfer, "cut-off")
    assert not surfer.page.locator(".verdict").is_visible()
    assert surfer.page.locator(".stop").inner_text().startswith("STOP")
    stands(surfer)
    reported(tracker, "page: its process was ended by SIGKILL; it starts anew")
    has_class(surfer, "cut-off", False)
    surfer.page.wait_for_selector("[data-marker=effector]", state="attached")
    assert tracker.page_processes() != [page]
    surfer.reads("You steer")


def test_a_page_s_process_that_is_frozen_lets_stop_through_and_is_replaced(surfer, tracker):
    run_to_the_farther_goal(surfer)
    surfer.page.evaluate(NOTE_CUT_OFF)
    (page,) = tracker.page_processes()
    os.kill(page, signal.SIGSTOP)
    surfer.page.locator(".stop").click()
    stands(surfer)
    surfer.page.wait_for_function("sessionStorage.wasCutOff")
    reported(tracker, "page: its process was stopped by a signal 1 s ago; it starts anew")
    surfer.reads("stopped from the page by browser")
    has_class(surfer, "cut-off", False)
    assert tracker.page_processes() != [page]


def is_held(surfer, silence, why):
    """Let a run be on in a silence; page and brick say that it was held, and why.

    A run that has arrived before, as on a busy computer, is not held: then it is done again.
    """
    unheard = "no page was heard for "
    note = surfer.page.locator(".note", has_text=why).filter(has_text=unheard)
    said = surfer.page.get_by_text(f"held: {unheard}").filter(has_text=why)
    arrived = surfer.page.locator(".verdict:visible", has_text="Arrived")
    while True:
        run_to_the_farther_goal(surfer)
        silence()
        has_class(surfer, "cut-off", False)
        surfer.until(lambda: note.count() or arrived.count(), f"{why}, or an arrival")
        if note.count():
            break
    surfer.wait(note.filter(has_text="held; Start goes on"))
    surfer.wait(said.and_(surfer.page.locator(":visible")))


def test_a_page_that_was_closed_is_told_from_one_that_is_silent(surfer, tracker):
    def silence():
        surfer.page.goto("about:blank")  # as for a tab that is closed, and there is one to look
        stands(surfer)
        surfer.page.goto(f"http://{tracker.host}/")

    is_held(surfer, silence, "as the page was closed in browser")


def test_a_page_s_process_that_is_stopped_is_told(surfer, tracker):
    def silence():
        (page,) = tracker.page_processes()
        os.kill(page, signal.SIGSTOP)
        has_class(surfer, "cut-off")
        stands(surfer)

    is_held(surfer, silence, "as its process was stopped by a signal")


def test_a_tracker_that_stood_still_is_told(surfer, tracker):
    def silence():
        tracker.process.send_signal(signal.SIGSTOP)
        try:
            has_class(surfer, "stop-dead")
            surfer.page.wait_for_function("performance.now() - pulse.beat > 3000")
        finally:
            tracker.process.send_signal(signal.SIGCONT)

    is_held(surfer, silence, "as the tracker stood still for")


def test_a_browser_that_hangs_is_told_once_it_is_back(surfer):
    def silence():
        surfer.page.evaluate(
            "() => { const began = performance.now(); while (performance.now() - began < 4000); }"
        )

    is_held(surfer, silence, "as ")
    # (This computer may truly be busy, too.)
    reported = re.compile("It is back: it stood still itself for [45] s|too busy")
    surfer.wait(surfer.page.locator(".note", has_text=reported))


HIDE = """() => {
  Object.defineProperty(document, "visibilityState", { value: "hidden", configurable: true });
  document.dispatchEvent(new Event("visibilitychange"));
}"""
FREEZE = """() => document.dispatchEvent(new Event("freeze"))"""


@pytest.mark.parametrize(
    ("event", "word", "why"),
    [
        ("", "", re.compile("its network is cut, or it hangs|this computer is too busy")),
        (HIDE, "hidden", "as the page is in the background of browser"),
        (FREEZE, "asleep", "put the page to sleep in the background"),
    ],
)
def test_a_network_that_is_cut_is_told_from_a_page_in_the_background(
    far_surfer, network, event, word, why
):
    def silence():
        if event:
            with far_surfer.page.expect_response(lambda answer: f"word={word}" in answer.url):
                far_surfer.page.evaluate(event)
        network.passes.clear()
        has_class(far_surfer, "cut-off")
        stands(far_surfer)
        network.passes.set()

    is_held(far_surfer, silence, why)
    if not event:
        reported = re.compile("It is back, and went on itself all the time|too busy")
        far_surfer.wait(far_surfer.page.locator(".note", has_text=reported))


def test_what_was_pressed_while_the_page_did_not_answer_is_not_done_later(
    far_surfer, network, tracker
):
    far_surfer.aim(*far_surfer.scene.truth(FAR[0])["effector"])
    where = far_surfer.joints()
    pressed = False
    while not pressed:  # before it shows; where that came first, as on a busy computer, once more
        network.ports[tracker.port].set()
        far_surfer.can_start()
        network.ports[tracker.port].clear()
        # It waits in the network until that passes it on.
        pressed = start_button(far_surfer.page).evaluate_all(
            "found => !isCutOff() && found.some(button => { button.click(); return true; })"
        )
    has_class(far_surfer, "cut-off")
    far_surfer.page.wait_for_timeout(1500)
    network.ports[tracker.port].set()
    far_surfer.reads("cut off when this was pressed")
    stands(far_surfer)
    assert math.dist(far_surfer.joints(), where) < 0.01


def test_what_was_pressed_as_the_connection_broke_is_told_and_not_done(surfer):
    surfer.aim(*surfer.scene.truth(FAR[0])["effector"])
    surfer.can_start()
    where = surfer.joints()
    start_button(surfer.page).first.evaluate(
        "button => { window.socket.io.engine.close(); button.click(); }"
    )
    surfer.reads("cut off when this was pressed")
    stands(surfer)
    assert math.dist(surfer.joints(), where) < 0.01


def test_a_tracker_that_stands_still_shows_that_no_stop_can_be_sent(surfer, tracker):
    tracker.process.send_signal(signal.SIGSTOP)
    try:
        has_class(surfer, "stop-dead")
        text = surfer.page.locator(".stop").inner_text()
        assert text == "STOP cannot be sent: press the brick's Back button"
    finally:
        tracker.process.send_signal(signal.SIGCONT)
    has_class(surfer, "cut-off", False)


def test_a_stop_that_cannot_be_sent_is_as_soon_as_it_can_and_nothing_else_is(surfer, tracker):
    run_to_the_farther_goal(surfer)
    tracker.process.send_signal(signal.SIGSTOP)
    try:
        has_class(surfer, "stop-dead")
        surfer.page.locator(".stop").click()
        surfer.page.keyboard.press("m")
    finally:
        tracker.process.send_signal(signal.SIGCONT)
    has_class(surfer, "cut-off", False)
    has_class(surfer, "stopping", False)
    surfer.verdict("Stopped")
    open_fold(surfer.page, COLOUR_FOLD)
    assert not surfer.page.get_by_role("checkbox", name="Colour's pixels").is_checked()


def test_a_network_that_falls_silent_shows_and_of_what_is_pressed_only_stop_is_done(
    far_surfer, network
):
    run_to_the_farther_goal(far_surfer)
    network.passes.clear()
    far_surfer.page.locator(".stop").click()
    far_surfer.page.keyboard.press("m")
    has_class(far_surfer, "stop-dead")
    assert not far_surfer.page.locator(".verdict").is_visible()
    text = far_surfer.page.locator(".stop").inner_text()
    assert text == "STOP cannot be sent: press the brick's Back button"
    network.passes.set()
    has_class(far_surfer, "cut-off", False)
    has_class(far_surfer, "stopping", False)
    far_surfer.verdict("Stopped")
    stands(far_surfer)


def test_stop_has_its_own_way_again_after_a_network_has_lost_every_connection(
    far_surfer, network, tracker
):
    far_surfer.page.evaluate("window.isTheSame = true")
    network.passes.clear()
    has_class(far_surfer, "stop-dead")
    network.passes = threading.Event()
    network.passes.set()
    has_class(far_surfer, "cut-off", False)
    network.ports[tracker.port].clear()
    has_class(far_surfer, "cut-off")
    has_class(far_surfer, "stop-dead", False)
    network.ports[tracker.port].set()
    has_class(far_surfer, "cut-off", False)
    assert far_surfer.page.evaluate("window.isTheSame"), "it was loaded anew"


def test_a_stop_that_does_not_get_through_says_so_though_the_gate_is_heard(
    far_surfer, network, tracker
):
    far_surfer.page.route("**/stop", lambda route: route.abort())
    network.ports[tracker.port].clear()
    has_class(far_surfer, "cut-off")
    has_class(far_surfer, "stop-dead", False)
    far_surfer.page.locator(".stop").click()
    has_class(far_surfer, "stop-dead")
    network.ports[tracker.port].set()
    has_class(far_surfer, "cut-off", False)
    has_class(far_surfer, "stopping", False)


def test_one_steers_and_who_watches_may_take_over_and_stop(browser, tracker, surfer):
    watcher = Surfer(browser, tracker, steers=False)
    surfer.steer()  # who was not heard for long, as on a busy computer, steers no longer
    watcher.wait(watcher.page.locator(".driver", has_text="browser"))
    surfer.steer()  # the same, for that wait
    reported = watcher.page.get_by_text("steers; press Take over first")

    def is_refused():
        if watcher.steers():  # the same, for that click
            surfer.steer()
            watcher.click(*goal)
        return reported.count()

    goal = watcher.scene.truth(FAR[0])["effector"]
    watcher.click(*goal)
    watcher.until(is_refused, "a refusal")
    assert watcher.button("Start").is_disabled()
    stopper = surfer.page.get_by_text("stopped from the page by browser")
    held = surfer.page.get_by_text("no page was heard")  # rightly so, on a busy computer
    while True:
        run_to_the_farther_goal(surfer)
        watcher.page.locator(".stop").click()
        surfer.verdict("Stopped")
        surfer.until(lambda: stopper.count() or held.count(), "the reason")
        if stopper.count():
            break
    watcher.steer()
    surfer.page.get_by_role("button", name="Take over").wait_for()
    watcher.close()


@pytest.mark.long
@pytest.mark.parametrize("loads", [40, pytest.param(200, marks=pytest.mark.claims)])
def test_many_loads_at_once_are_all_answered(tracker, loads):
    import http.client
    from concurrent.futures import ThreadPoolExecutor

    def load(_):
        connection = http.client.HTTPConnection("127.0.0.1", tracker.port, timeout=PATIENCE)
        connection.request("GET", "/", headers={"Host": tracker.host, "Cookie": tracker.cookie})
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        return answer.status, b"BrickServo" in text

    assert tracker.get()[0] == 200
    with ThreadPoolExecutor(loads) as pool:
        assert set(pool.map(load, range(loads))) == {(200, True)}


@pytest.mark.long
def test_what_is_not_there_is_404(tracker):
    for path in ("/nowhere", "/view", "/view/A/1.png", "/_nicegui/nowhere", "/stop", "/report/1/2"):
        assert tracker.get(path)[0] == 404, path
