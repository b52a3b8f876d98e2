"""The page fits its window, and can be used by all, in every state that it gets into.

In a real browser of several sizes, before the tracker on rendered frames and an emulated brick.
"""

import signal

import pytest
from page_layout import LEAST, barriers, complaints, turn_folds
from page_tracker import SYNTHETIC, Surfer, Tracker

DRIVE = ".stop", ".picture", "[role=tab]", ".verdict", ".error", ".go", ".report"
DRAW = ".stop", ".picture", "[role=tab]", ".facts-line", ".draws"
JOB = *DRAW, ".job-word"
OF_TWO = 0.3, 0.3, 0.25, 0.28
"""Shares of the windows that the pictures of two cameras have."""


@pytest.fixture(scope="module")
def tracker(tmp_path_factory):
    words = *SYNTHETIC, "--no-page-hold"
    with Tracker(tmp_path_factory.mktemp("layout"), *words) as tracker:
        yield tracker


@pytest.fixture(scope="module")
def open_page(browser, tracker):
    surfer = Surfer(browser, tracker)
    surfer.verdict("Ready")
    yield surfer
    surfer.close()


@pytest.fixture
def surfer(open_page):
    open_page.steer()
    yield open_page
    open_page.page.keyboard.press("Escape")


def holds(surfer, *wanted, shares=LEAST):
    wrong = complaints(surfer.page, wanted, shares) + barriers(surfer.page)
    assert "\n".join(wrong) == ""


def test_at_first(surfer):
    holds(surfer, *DRIVE)


def test_while_the_arm_is_on_its_way(surfer):
    surfer.aim(*surfer.scene.truth((0.9, 0.5))["effector"])
    surfer.start()
    surfer.verdict("On its way")
    holds(surfer, *DRIVE)


def test_with_all_that_folds_open(surfer):
    turn_folds(surfer.page, is_open=True)
    surfer.page.locator(".more").evaluate("more => more.scrollTo(0, 0)")
    holds(surfer, *DRIVE)
    surfer.page.reload()
    surfer.page.locator(".fold [role=button][aria-expanded=true]").first.wait_for()
    turn_folds(surfer.page, is_open=False)


def test_while_and_after_it_draws(surfer):
    page = surfer.page
    surfer.tool("Draw")
    holds(surfer, *DRAW)
    surfer.order(page.get_by_role("button", name="Look around").click)
    surfer.wait(page.locator(".job-word", has_text="look around: done"))
    page.get_by_label("or type a text").fill("hi")
    surfer.order(page.get_by_role("button", name="Write", exact=True).click)
    surfer.wait(page.locator(".draws:enabled", has_text="Start"))
    surfer.order(page.locator(".draws", has_text="Start").click)
    surfer.wait(page.locator(".job-word", has_text="Drawing: "))
    surfer.order(page.locator(".draws", has_text="Pause").click)
    surfer.wait(page.locator(".job-word", has_text="Paused"))
    wrong = complaints(page, (*JOB, ".q-linear-progress", "[aria-label^='speed']", ".pen"))
    wrong += barriers(page)
    surfer.order(page.locator(".draws", has_text="Resume").click)
    page.locator(".compared").wait_for(state="attached")
    assert "\n".join(wrong) == ""
    holds(surfer, *JOB, ".deviation")
    surfer.tool("Drive")


def test_when_it_is_cut_off(surfer, tracker):
    tracker.process.send_signal(signal.SIGSTOP)
    try:
        surfer.page.locator("body.stop-dead").wait_for()
        wrong = complaints(surfer.page, (".stop", ".alarm", ".picture"))
    finally:
        tracker.process.send_signal(signal.SIGCONT)
    surfer.page.locator("body:not(.cut-off)").wait_for()
    assert "\n".join(wrong) == ""


def test_with_a_marker_that_is_lost(browser, tmp_path):
    with Tracker(tmp_path, *SYNTHETIC, "--effector", "disc:purple") as tracker:
        surfer = Surfer(browser, tracker, seen=".picture img")
        surfer.verdict("Ready")
        surfer.page.locator(".lost > div").wait_for()
        holds(surfer, *DRIVE, ".lost")
        surfer.close()


def test_with_two_cameras(browser, tmp_path):
    with Tracker(tmp_path, "--camera", "synthetic", *SYNTHETIC) as tracker:
        surfer = Surfer(browser, tracker)
        surfer.verdict("Ready")
        turn_folds(surfer.page, is_open=False)
        holds(surfer, *DRIVE[:-1], shares=OF_TWO)
        surfer.tool("Draw")
        holds(surfer, *DRAW, shares=OF_TWO)
        surfer.close()
