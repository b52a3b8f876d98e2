"""The page, in a real browser, before the tracker on rendered frames and an emulated brick."""

import csv
import io
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from announced import wait_for_event
from numbered_frames import lengthen, write_film
from page_tracker import (
    CHOSEN,
    COLOUR_FOLD,
    SYNTHETIC,
    WINDOW,
    Hand,
    Surfer,
    Tracker,
    open_fold,
    press_tool,
    tool_button,
)
from places import ROOT
from waiting import PATIENCE, until

from laptop.cli.track import start_brick as own_brick
from laptop.page import process as page_process
from laptop.page.cards.camera_view import IMAGE_TIMEOUT
from laptop.page.http_routes import MAX_UPLOADS
from laptop.record.run import read_run
from laptop.see.markers.markers import read_markers


@pytest.fixture(scope="module")
def tracker(tmp_path_factory):
    # On a busy computer a page may be unheard for 2 s, for which runs are held: not meant here.
    words = *SYNTHETIC, "--no-page-hold"
    with Tracker(tmp_path_factory.mktemp("page"), *words) as tracker:
        yield tracker


# The gate


@pytest.mark.long
def test_the_printed_address_lets_one_in_and_is_left_at_once(tracker):
    token = tracker.new_token()
    status, headers, _ = tracker.get(f"/?token={token}", Cookie=None)
    assert (status, headers["location"]) == (303, "/")
    cookie, *attributes = headers["set-cookie"].split("; ")
    assert cookie.startswith(f"brickservo-{tracker.port}=")
    assert attributes == ["Path=/", "HttpOnly", "SameSite=Strict"]
    assert token not in headers["set-cookie"], "who reads the cookie along lets nobody else in"
    assert tracker.get(Cookie=cookie)[0] == 200
    status, headers, body = tracker.get()
    assert (status, "BrickServo" in body) == (200, True)
    assert headers["x-frame-options"] == "DENY"
    assert "default-src 'self'" in headers["content-security-policy"]


OTHER = {
    "no token": {"Cookie": None},
    "a wrong token": {"Cookie": "brickservo-{port}=guess"},
    "another page's cookie": {"Cookie": "brickservo-1={session}"},
    "a token for a cookie": {"Cookie": "brickservo-{port}={token}"},
    "another browser's number": {"Cookie": "brickservo-{port}=9{session}"},
    "a foreign Origin": {"Origin": "http://evil.example"},
    "an Origin of another port": {"Origin": "http://127.0.0.1:1"},
    "an Origin of nowhere": {"Origin": "null"},
    "a foreign Host": {"Host": "evil.example:{port}"},
    "a Host without the port": {"Host": "127.0.0.1"},
    "no Host": {"Host": None},
}


def filled(tracker, headers):
    session = tracker.cookie.partition("=")[2]
    token = tracker.addresses[-1].partition("=")[2]
    return {
        name: value and value.format(port=tracker.port, token=token, session=session)
        for name, value in headers.items()
    }


@pytest.mark.parametrize("headers", OTHER.values(), ids=OTHER)
def test_over_http_nobody_else_is_let_in(tracker, headers):
    for path in ("/", "/view/A/1.jpg", "/history.csv", "/report", "/_nicegui_ws/socket.io/"):
        status, answered, body = tracker.get(path, **filled(tracker, headers))
        assert status in (400, 403), path
        assert "set-cookie" not in answered
        assert tracker.addresses[-1].partition("=")[2] not in body + str(answered)


@pytest.mark.parametrize("headers", OTHER.values(), ids=OTHER)
def test_over_the_websocket_nobody_else_is_let_in(tracker, headers):
    sock, answer = tracker.upgrade(**filled(tracker, headers))
    sock.close()
    assert re.match(r"HTTP/1.1 40[03]", answer), answer


def test_cookies_of_other_programs_lock_nobody_out(tracker):
    others = 'x={"a":1}; =nameless; path=/; ' + tracker.cookie
    assert tracker.get(Cookie=others)[0] == 200
    assert tracker.get(Cookie=others[:-1])[0] == 403


def test_over_the_websocket_only_browsers_are_let_in_and_ours_are(tracker):
    sock, answer = tracker.upgrade(Origin=None)
    sock.close()
    assert " 403 " in answer
    sock, answer = tracker.upgrade()
    sock.close()
    assert " 101 " in answer


def test_a_printed_address_lets_one_browser_in_and_then_a_new_one_is_printed(tracker):
    used = tracker.new_token()
    assert tracker.get(f"/?token={used}", Cookie=None)[0] == 303
    status, headers, body = tracker.get(f"/?token={used}", Cookie=None)
    assert (status, "set-cookie" in headers) == (403, False)
    assert "lets one browser in" in body
    # Who is in already may come by any address that was printed, and uses up none.
    status, headers, _ = tracker.get(f"/?token={used}")
    assert (status, headers["location"], "set-cookie" in headers) == (303, "/", False)
    assert tracker.get(f"/?token={tracker.new_token()}", Cookie=None)[0] == 303


@pytest.mark.parametrize("token", ["", "guess", "%00", "%C3%A4"])
def test_a_wrong_token_in_the_address_is_told_what_to_do(tracker, token):
    status, headers, body = tracker.get(f"/?token={token}", Cookie=None)
    assert status == 403
    assert "set-cookie" not in headers
    assert "Open the address that the tracker prints" in body


def test_there_is_no_report_of_a_run_that_is_not_known(tracker):
    status, _, body = tracker.get("/report/99")
    assert (status, body) == (404, "There is no report of such a run.")
    assert tracker.get("/report/9.9")[0] == 422


def test_nothing_can_be_posted(tracker):
    assert tracker.get("/", "POST")[0] == tracker.get("/report", "POST")[0] == 403
    assert tracker.get("/_nicegui_ws/socket.io/?EIO=4&transport=polling", "POST")[0] == 403


@pytest.mark.parametrize("headers", OTHER.values(), ids=OTHER)
def test_a_drawing_is_taken_from_the_page_alone(tracker, headers):
    page = {"Origin": f"http://{tracker.host}"}
    path = "/drawing?name=a.svg"
    assert tracker.get(path, "POST", **{**page, **filled(tracker, headers)})[0] in (400, 403)
    assert tracker.get(path, "POST")[0] == 403, "who does not say from where"
    assert tracker.get(path, "PUT", **page)[0] == tracker.get(path, "DELETE", **page)[0] == 403


def test_a_drawing_that_is_too_large_is_refused_unread(tracker):
    page = {"Origin": f"http://{tracker.host}", "Content-Length": "9000000"}
    status, _, why = tracker.get("/drawing?name=a.svg", "POST", **page)
    assert (status, why) == (413, "a.svg: more than 8 MB; make it smaller")
    sock = socket.create_connection(("127.0.0.1", tracker.port), timeout=PATIENCE)
    head = f"POST /drawing HTTP/1.1\r\nHost: {tracker.host}\r\nCookie: {tracker.cookie}\r\n"
    head += f"Origin: http://{tracker.host}\r\nTransfer-Encoding: chunked\r\n\r\n"
    sock.sendall(head.encode())
    chunk = b"100000\r\n" + b"a" * 0x100000 + b"\r\n"
    taken = pushed(sock, chunk, 100)
    sock.close()
    assert taken < 50, "MB were taken"
    assert tracker.get()[0] == 200


def test_only_some_files_may_be_on_their_way_at_once(tracker):
    """Each is held in memory until it is whole."""
    head = f"POST /drawing?name=a.svg HTTP/1.1\r\nHost: {tracker.host}\r\n"
    head += f"Cookie: {tracker.cookie}\r\nOrigin: http://{tracker.host}\r\n"
    head += "Content-Length: 7000000\r\n\r\n<svg"
    held = []
    try:
        for _ in range(MAX_UPLOADS):
            held.append(socket.create_connection(("127.0.0.1", tracker.port), timeout=PATIENCE))
            held[-1].sendall(head.encode())
        page = {"Origin": f"http://{tracker.host}"}
        until(lambda: tracker.get("/drawing?name=b.svg", "POST", **page)[0] == 503, "a busy answer")
        said = tracker.get("/drawing?name=b.svg", "POST", **page)[2]
        assert said == "b.svg: other files are coming; try again soon"
    finally:
        for sock in held:
            sock.close()
    until(lambda: tracker.get("/drawing?name=b.svg", "POST", **page)[0] == 200, "its turn")


def pushed(sock, data, times):
    """How many times it could be sent before the other side had enough."""
    for k in range(times):
        try:
            sock.sendall(data)
        except OSError:
            return k
    return times


def test_a_message_of_100_mb_is_cut_off_and_the_page_goes_on(tracker):
    sock, answer = tracker.upgrade()
    assert " 101 " in answer
    size = 100 * 1000 * 1000
    sock.sendall(b"\x81\xff" + struct.pack("!Q", size) + b"\0\0\0\0")
    taken = pushed(sock, b"4" * 1_000_000, size // 1_000_000)
    sock.close()
    assert taken < 50, "MB were taken"
    assert tracker.get()[0] == 200


def test_a_body_of_100_mb_is_cut_off_and_the_page_goes_on(tracker):
    sock = socket.create_connection(("127.0.0.1", tracker.port), timeout=PATIENCE)
    head = f"POST / HTTP/1.1\r\nHost: {tracker.host}\r\nCookie: {tracker.cookie}\r\n"
    sock.sendall(f"{head}Content-Length: 100000000\r\n\r\n".encode())
    taken = pushed(sock, b"4" * 1_000_000, 100)
    sock.close()
    assert taken < 50, "MB were taken"
    assert tracker.get()[0] == 200


@pytest.mark.parametrize(
    ("host", "names"),
    [
        ("127.0.0.1", ["localhost:7780", "127.0.0.1:7780"]),
        ("192.0.2.7", ["192.0.2.7:7780"]),
        ("::1", ["localhost:7780", "[::1]:7780"]),
    ],
)
def test_the_names_by_which_a_page_may_be_called(host, names):
    assert page_process.hosts(host, 7780) == names
    assert "evil.example:7780" not in page_process.hosts("0.0.0.0", 7780)
    assert "127.0.0.1:7780" in page_process.hosts("0.0.0.0", 7780)


@pytest.mark.long
def test_a_page_for_the_whole_network_warns(tmp_path):
    whole = subprocess.Popen(
        [sys.executable, "-m", "laptop", "track", *SYNTHETIC]
        + ["--listen-port", "0", "--page-port", "0.0.0.0:0", "--json"],
        cwd=ROOT,
        env={**os.environ, "BRICKSERVO_STATE": str(tmp_path), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_event(whole.stdout, "ready")
    whole.send_signal(signal.SIGINT)
    _, reported = whole.communicate(timeout=PATIENCE)
    assert "others in its network can reach it" in reported


@pytest.mark.long
def test_a_port_that_is_taken_is_refused_if_it_was_asked_for():
    with page_process.listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(page_process.NoPage, match=f"port {port} is in use.*--page-port"):
            page_process.listen("127.0.0.1", port)
    for nowhere in ("192.0.2.1", "a..b"):
        with pytest.raises(
            page_process.NoPage, match="--page-port HOST:P with HOST one of 127.0.0.1"
        ):
            page_process.listen(nowhere, 0)


# The browser


@pytest.fixture(scope="module")
def open_page(browser, tracker):
    surfer = Surfer(browser, tracker)
    yield surfer
    surfer.close()


@pytest.fixture
def surfer(open_page):
    """The one page of most tests, as it is at the beginning but for where the arm is."""
    open_page.page.set_viewport_size(WINDOW)
    open_page.page.bring_to_front()
    open_page.steer()
    open_page.tool("Aim")
    yield open_page
    open_page.page.keyboard.press("Escape")
    if open_page.button("Go on").count():
        open_page.button("Go on").click()
    assert open_page.errors == []


def test_two_clicks_bring_the_true_tip_to_the_goal(surfer):
    goal = surfer.scene.truth((0.5, 0.6))["effector"]
    surfer.aim(*goal)
    surfer.start()
    surfer.verdict("On its way")
    surfer.verdict("Arrived")
    assert math.dist(surfer.tip(), goal) < 8, "px, of 5 that are allowed as measured"
    assert float(surfer.page.locator(".error").inner_text().split()[0]) <= 5
    open_fold(surfer.page, "Numbers")
    surfer.reads("8.0 V")
    with surfer.context.expect_page() as tab:
        surfer.page.get_by_role("link", name="Report").click()
    tab.value.get_by_text("Arrived: the tip is at the goal").wait_for()
    assert tab.value.get_by_text("What the servo measured and did, step by step").count() == 1
    (stored,) = (surfer.tracker.state.parent / "runs").iterdir()
    assert read_run(stored).rows("goals")[0]["ended"] == "converged"
    drawn = "() => [...document.images].filter(image => image.naturalWidth).length"
    assert tab.value.evaluate(drawn) == 3
    with tab.value.expect_download() as saved:
        tab.value.get_by_role("link", name="Save this report").click()
    assert re.fullmatch(r"brickservo-[\d-]+-run-\d+\.html", saved.value.suggested_filename)
    assert Path(saved.value.path()).read_text().count("data:image/") == 3


def test_a_colour_is_picked_by_a_click_undone_and_kept_in_the_file(surfer):
    u, v = surfer.tip()
    surfer.tool("Pick")
    surfer.click(u, v)
    surfer.reads("tip's marker: kept")
    stored = read_markers(surfer.tracker.state / "markers.ini")["effector"]
    assert min(stored.color.hue, 360 - stored.color.hue) < 15
    assert stored.color.scene, "learned in this picture"
    surfer.order(surfer.button("Undo").click)
    file = surfer.tracker.state / "markers.ini"
    surfer.until(lambda: read_markers(file)["effector"].color.scene is None, "the old colour")


def test_a_page_that_is_loaded_anew_goes_on_with_the_same_tool(surfer):
    surfer.tool("Pick")
    surfer.page.reload()
    tool_button(surfer.page, "Pick", CHOSEN).wait_for()
    surfer.tool("Draw")
    surfer.page.reload()
    tool_button(surfer.page, "Draw", CHOSEN).wait_for()
    assert not tool_button(surfer.page, "Pick").is_visible()
    surfer.tool("Drive")


def test_what_cannot_be_picked_says_why(surfer):
    surfer.tool("Pick")
    surfer.click(5, 5)
    surfer.reads("is all around it")


def test_of_tools_that_are_pressed_faster_than_the_page_answers_the_last_is_taken(surfer):
    surfer.tool("Pick")
    surfer.page.evaluate("""() => {
        const named = name => [...document.querySelectorAll(".tools button")].find(
            button => button.innerText === name);
        named("Aim").click();
        named("Pick").click();
        named("Add").click();
        named("Aim").click();
        named("Pick").click();
    }""")
    surfer.click(5, 5)
    surfer.reads("is all around it")


def test_in_pictures_that_take_long_to_come_one_can_pick(browser, tracker):
    surfer = Surfer(browser, tracker, late=1.5)
    surfer.tool("Pick")
    surfer.click(5, 5)
    surfer.reads("is all around it")
    surfer.close()


def test_a_picture_that_is_no_longer_to_be_had_holds_up_none(surfer):
    gone = []

    def refuse(route):
        gone.append(route)
        route.fulfill(status=404)

    surfer.page.route("**/view/**", refuse)
    # Were each waited for, it would take longer than anybody waits.
    until(
        lambda: len(gone) * IMAGE_TIMEOUT > PATIENCE,
        "more",
        lambda: surfer.page.wait_for_timeout(20),
    )
    surfer.page.unroute("**/view/**")
    surfer.page.wait_for_function(
        "() => document.querySelector('.picture img').naturalWidth === 640"
    )


def test_the_overlay_is_where_the_true_tip_is(surfer):
    where = surfer.page.locator("[data-marker=effector]").get_attribute("transform")
    seen = [float(part) for part in re.findall(r"-?[\d.]+", where)]
    assert math.dist(seen, surfer.tip()) < 1.5


def until_still(read, surfer, what):
    """Wait until what is read has been the same for a second of the emulated world."""
    deadline = time.monotonic() + PATIENCE
    since, before = surfer.clock.now(), read()
    while surfer.clock.now() - since < 1.0:
        surfer.page.wait_for_timeout(20)
        now = read()
        if now != before:
            since, before = surfer.clock.now(), now
        assert time.monotonic() < deadline, f"{what} for ever"
    return before


@pytest.mark.parametrize("by", ["Escape", "STOP"])
def test_stop_in_mid_run_makes_it_stand_still(surfer, by):
    here = surfer.tip()
    far = max(
        (surfer.scene.truth(q)["effector"] for q in ((0.9, 0.5), (-0.7, -0.6))),
        key=lambda goal: math.dist(goal, here),
    )
    surfer.aim(*far)
    surfer.start_and_move()
    if by == "Escape":
        surfer.page.keyboard.press("Escape")
    else:
        surfer.page.locator(".stop").click()
    surfer.verdict("Stopped")
    until_still(lambda: [round(angle, 2) for angle in surfer.joints()], surfer, "it moves")
    assert math.dist(surfer.tip(), far) > 20


def test_a_start_while_a_run_is_on_is_refused(surfer):
    surfer.aim(*surfer.scene.truth((0.2, -0.9))["effector"])
    surfer.start()
    surfer.verdict("On its way")  # pressed before, it might be what starts the run
    surfer.order(lambda: surfer.page.keyboard.press("s"))
    surfer.reads("a run is on; hold or stop it first")


def test_what_was_pressed_while_cut_off_may_stop_but_not_start_the_arm(surfer):
    def press_while_cut_off(button):
        button.evaluate("button => { window.socket.io.engine.close(); button.click(); }")
        surfer.page.wait_for_function("window.socket.connected && !isCutOff()")

    surfer.aim(*surfer.scene.truth((-0.4, 0.9))["effector"])
    surfer.start()
    surfer.verdict("On its way")
    press_while_cut_off(surfer.page.locator(".stop"))
    surfer.verdict("Stopped")
    press_while_cut_off(surfer.button("Start"))
    surfer.page.wait_for_timeout(300)  # what had been sent on would have come before the pulse
    surfer.verdict("Stopped")
    assert surfer.page.get_by_text("On its way").count() == 0


@pytest.mark.long
def test_an_emulated_brick_that_has_ended_tells_where_one_can_read_why(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    began = time.monotonic()
    with own_brick("planar", "127.0.0.1:1") as why:
        while not why():
            assert time.monotonic() - began < PATIENCE
            time.sleep(0.05)
        lines = Path(why().rpartition(" ")[2]).read_text()
    assert "this brick is not paired yet" in lines


def boxes(page, selector):
    """(text, left, top, width, height) of all that is to be seen."""
    return page.evaluate(
        """selector => [...document.querySelectorAll(selector)]
            .filter(e => e.offsetParent && getComputedStyle(e).visibility !== "hidden")
            .map(e => {
                const { left, top, width, height } = e.getBoundingClientRect();
                return [e.innerText || e.ariaLabel || e.tagName, left, top, width, height];
            })""",
        selector,
    )


def test_a_start_moves_nothing_and_hides_nothing(surfer):
    surfer.aim(*surfer.scene.truth((0.6, -0.8))["effector"])
    pressed = ".side button, .side a, .side .q-checkbox, .picture, .side h2, .stop"
    before = [box[1:] for box in boxes(surfer.page, pressed)]
    surfer.start()
    surfer.verdict("On its way")
    surfer.page.get_by_text(re.compile(r", [1-9]\d* move")).wait_for()
    assert [box[1:] for box in boxes(surfer.page, pressed)] == before
    assert surfer.page.locator(".q-tooltip").count() == 0


def test_of_the_plots_those_are_shown_that_have_something_to_show(surfer):
    def titles():
        shown = surfer.page.locator(".plot:visible .term").all_inner_texts()
        return {text.strip() for text in shown}

    open_fold(surfer.page, "Plots")
    surfer.aim(*surfer.scene.truth((-0.5, 0.4))["effector"])
    surfer.start()
    of_runs = {"Distance from the goal, px", "Moves of this run, number"}
    others = {"Angles of the joints, °", "Age of the newest picture, ms", "Pictures, per second"}
    surfer.until(lambda: of_runs | others <= titles(), "the plots of a run")
    surfer.tool("Draw")
    surfer.until(lambda: titles() == others, "without those of runs")
    surfer.tool("Drive")
    surfer.page.locator(".fold [role=button]", has_text="Plots").click()


@pytest.mark.parametrize("by", ["focus", "hover"])
def test_what_the_field_calls_it_is_told_to_who_asks(surfer, by):
    words = surfer.page.locator(".main .term", has_text="from the goal")
    tip = surfer.page.locator(".q-tooltip", has_text="The error: ")
    surfer.until(lambda: (getattr(words, by)(), tip.count())[1], "the explanation")
    words.blur()
    surfer.page.mouse.move(5, 5)
    tip.wait_for(state="detached")


def test_what_the_field_calls_it_is_told_on_a_touch(browser, tracker):
    phone = {"has_touch": True, "is_mobile": True, "user_agent": "Mozilla/5.0 (Android 14) Mobile"}
    surfer = Surfer(browser, tracker, steers=False, **phone)
    tip = surfer.page.locator(".q-tooltip", has_text="The error: ")
    surfer.page.locator(".main .term", has_text="from the goal").tap()
    tip.wait_for()
    surfer.page.wait_for_timeout(500)
    assert tip.is_visible(), "it stays when the finger is gone"
    surfer.page.locator(".goal").tap()
    tip.wait_for(state="detached")
    surfer.close()


def test_on_a_phone_all_that_is_pressed_is_large_enough_for_a_thumb(surfer):
    surfer.page.set_viewport_size({"width": 390, "height": 844})
    surfer.tool("Pick")
    pressed = "button, a, .q-checkbox, .q-toggle, .q-item, .q-slider, .q-field"
    found = boxes(surfer.page, pressed)
    assert len(found) > 12
    assert [box for box in found if min(box[3:]) < 44] == []


def test_one_aims_by_the_keyboard_alone(surfer):
    surfer.page.locator(".picture").focus()
    for key in ("ArrowLeft", "ArrowLeft", "ArrowUp", "Shift+ArrowDown", "Enter"):
        surfer.page.keyboard.press(key)
    surfer.page.locator("[data-aim='304.0,233.0']").wait_for(state="attached")
    name = surfer.page.locator(".picture").get_attribute("aria-label")
    assert name == "picture of camera A: arrow keys move a cross, Enter clicks there"


def test_the_age_is_that_of_the_picture_on_the_screen(surfer):
    age = surfer.page.locator(".age")
    surfer.page.wait_for_function("/^\\d+ ms old$/.test(document.querySelector('.age').innerText)")
    held = []
    surfer.page.route("**/view/**", lambda route: held.append(route))  # none is shown from now on
    surfer.page.wait_for_function(
        "parseFloat(document.querySelector('.age').innerText) > 1.5 "
        "&& document.querySelector('.age').innerText.endsWith(' s old')"
    )
    assert "stale" in age.get_attribute("class")
    surfer.page.unroute("**/view/**")
    surfer.page.wait_for_function("document.querySelector('.age').innerText.endsWith(' ms old')")


def test_the_history_comes_as_csv(surfer):
    open_fold(surfer.page, "Plots")
    with surfer.page.expect_download() as download:
        surfer.button("CSV").click()
    table = list(csv.DictReader(io.StringIO(Path(download.value.path()).read_text())))
    assert {"t", "error_px", "q1_deg", "q2_deg", "condition", "age_ms_A", "fps_A"} <= set(table[0])
    assert len(table) > 5


def test_nothing_comes_from_anywhere_else(surfer):
    own = f"http://{surfer.tracker.host}/", f"http://{surfer.tracker.gate}/", "data:", "blob:"
    assert [url for url in surfer.addresses if not url.startswith(own)] == []


def test_pause_keeps_the_picture_and_one_can_pick_in_it(surfer):
    surfer.button("Pause").click()
    surfer.reads("paused")
    tip = surfer.page.locator("[data-marker=effector]")
    until_still(lambda: tip.get_attribute("data-frame"), surfer, "the picture changes")
    surfer.tool("Pick")
    surfer.click(*surfer.tip())
    surfer.reads("tip's marker: kept")
    surfer.button("Undo").click()


def test_the_overlay_waits_for_its_picture(surfer):
    surfer.page.route("**/view/**", lambda route: (time.sleep(0.1), route.continue_()))
    wrong = surfer.page.evaluate(
        """() => new Promise(done => {
            const [right, wrong] = [new Set(), new Set()];
            let loaded = '';
            document.addEventListener('load', e => { loaded = e.target.src || ''; }, true);
            const look = setInterval(() => {
                const frame = document.querySelector('[data-marker=effector]').dataset.frame;
                if (!loaded.includes('/view/')) return;
                (loaded.includes(`/${frame}.jpg`) ? right : wrong).add(`${loaded} ${frame}`);
                if (right.size > 8) { clearInterval(look); done([...wrong]); }
            }, 1);
        })"""
    )
    surfer.page.unroute("**/view/**")
    assert wrong == []


@pytest.fixture
def film(tmp_path):
    """A blue disc goes to the right, 4 px a frame."""
    grey, blue = np.full((480, 640, 3), 130, np.uint8), (190, 70, 20)
    places = ((80 + 4 * index, 240) for index in range(120))
    pictures = (cv2.circle(grey.copy(), place, 24, blue, -1, cv2.LINE_AA) for place in places)
    return str(write_film(tmp_path / "film.mp4", pictures, "mp4v", 60.0))


def test_what_is_asked_of_a_still_comes_though_it_was_asked_early_or_refused(
    browser, film, tmp_path
):
    held, refused, holding = [], [], True

    def hold(route):
        if holding:
            held.append(route)
        else:
            route.continue_()

    def refuse(route):
        refused.append(route.request.url)
        route.fulfill(status=404)

    with Tracker(tmp_path, "--camera", film, "--open") as tracker:
        page = browser.new_page()
        page.set_default_timeout(1000 * PATIENCE)
        until(lambda: any("all is tracked" in line for line in tracker.lines), "the end")
        page.route("**/view/**", hold)
        page.goto(
            tracker.new_address(), wait_until="domcontentloaded"
        )  # held pictures hold up a "load"
        until(lambda: held, "a picture", lambda: page.wait_for_timeout(20))
        open_fold(page, COLOUR_FOLD)
        page.get_by_role("checkbox", name="Colour's pixels").click()  # no picture is there
        holding = False
        for route in held:  # (unrouted, one that is just coming would be lost)
            route.continue_()
        page.locator(".over image").wait_for(state="attached")

        page.route("**/view/**", refuse, times=1)
        page.get_by_role("button", name="frame back").click()
        page.get_by_text("frame 118 of").wait_for()
        assert "/118.jpg" in refused[0]
        page.close()


def test_a_name_that_is_typed_at_once_is_taken(browser, film, tmp_path):
    with Tracker(tmp_path, "--camera", film, "--open") as tracker:
        page = browser.new_page()
        hand = Hand(page)
        page.goto(tracker.new_address())
        press_tool(page, "Pick")
        type_at_once = """() => new MutationObserver((changes, observer) => {
            const field = document.querySelector("[aria-label='effector is from now on']");
            if (!field) return;
            observer.disconnect();
            field.value = "ball";
            field.dispatchEvent(new Event("input"));
        }).observe(document.body, {childList: true, subtree: true})"""

        def rename():
            leave = page.get_by_role("button", name="Leave it")
            if leave.is_visible():  # the dialog of before
                leave.click()
                leave.wait_for(state="detached")
            page.evaluate(type_at_once)
            page.get_by_role("button", name="Rename", exact=True).click()
            page.get_by_role("button", name="Rename it").click()

        hand.order(rename)
        hand.wait(page.get_by_text("ball lost"))

        page.get_by_role("button", name="Rename", exact=True).click()
        page.get_by_label("ball is from now on").fill("disc")
        page.get_by_role("button", name="Leave it").click()
        page.get_by_role("button", name="Leave it").wait_for(state="detached")
        page.get_by_role("button", name="Rename", exact=True).click()
        assert page.get_by_label("ball is from now on").input_value() == "ball"
        page.close()


def test_a_recording_that_is_shorter_than_it_seems_is_scrubbed_to_its_end(browser, tmp_path):
    grey = np.full((480, 640, 3), 130, np.uint8)
    film = lengthen(write_film(tmp_path / "film.mkv", [grey] * 200), 3)
    # (Slowly: a busy computer opens the page before it ends, too.)
    with Tracker(tmp_path, "--camera", str(film), "--fps", "15", "--open") as tracker:
        page = browser.new_page()
        page.goto(tracker.new_address())
        page.locator("[role=slider][aria-valuemax='599']").wait_for(state="attached")
        page.locator(".scrub", has_text="of 0 to 199").wait_for()  # it stands where it has ended
        page.locator(".scrub [role=slider][aria-valuemax='199']").wait_for()
        page.close()


def test_a_recording_is_scrubbed_picked_in_renamed_in_and_waited_for(browser, film, tmp_path):
    with Tracker(tmp_path, "--camera", film, "--open") as tracker:
        page = browser.new_page()
        hand = Hand(page)
        page.goto(tracker.new_address())
        page.get_by_text("tip's marker lost: nothing of this colour").wait_for()
        slider = page.locator(".scrub .q-slider")
        slider.wait_for()  # it stands where it has ended
        open_fold(page, COLOUR_FOLD)
        mask = page.get_by_role("checkbox", name="Colour's pixels")
        for _ in range(3):
            mask.click()
            page.locator(".over image").wait_for(state="attached")
            page.wait_for_timeout(300)
            assert page.locator(".over image").count(), "nothing older is put over it"
            mask.click()
            page.locator(".over image").wait_for(state="detached")
        box = slider.bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        reported = page.locator(".scrub", has_text=re.compile(r"frame (?!119)\d+ of 0 to 119"))
        before = int(re.search(r"frame (\d+)", reported.inner_text())[1])
        page.get_by_role("button", name="frame on").click()
        page.get_by_text(f"frame {before + 1} of").wait_for()
        slider.press("ArrowRight")
        page.get_by_text(f"frame {before + 2} of").wait_for()
        slider.evaluate("document.activeElement.blur()")
        page.keyboard.press("ArrowRight")
        index = before + 3
        page.get_by_text(f"frame {index} of").wait_for()

        press_tool(page, "Pick")
        place = page.locator(".picture img").bounding_box()
        u, v = 80 + 4 * index, 240
        x, y = ((u + 0.5) * place["width"] / 640, (v + 0.5) * place["height"] / 480)
        hand.order(lambda: page.mouse.click(place["x"] + x, place["y"] + y))
        hand.wait(page.locator(f"[data-marker=effector][data-frame='{index}']"))
        where = page.locator("[data-marker=effector]").get_attribute("transform")
        assert math.dist([float(part) for part in re.findall(r"[\d.]+", where)], (u, v)) < 1
        page.get_by_text("tip's marker lost").wait_for(state="detached")

        page.get_by_role("button", name="Rename").click()
        page.get_by_label("effector is from now on").fill("ball")
        hand.order(page.get_by_role("button", name="Rename it").click)
        hand.wait(page.locator(f"[data-marker=ball][data-frame='{index}']"))
        stored = read_markers(tracker.state / "markers.ini")
        assert stored["ball"].color.hue == pytest.approx(223, abs=12)
        assert "effector" not in stored
        hand.order(page.get_by_role("button", name="Undo").click)
        hand.wait(page.locator("[data-marker=effector]"))

        page.get_by_text("· ended").wait_for()
        page.get_by_role("button", name="frame back").click()
        page.locator(f"[data-marker=effector][data-frame='{index - 1}']").wait_for(state="attached")
        page.close()
        assert tracker.process.wait(PATIENCE) == 0, "nobody looks any more"
        tracker.close()
        assert "close it, or Ctrl-C" in "".join(tracker.lines)


@pytest.mark.parametrize(("width", "height"), [(390, 844), (1024, 768), (1920, 1080)])
def test_on_a_phone_as_on_a_projector_nothing_sticks_out_and_stop_is_in_sight(
    surfer, width, height
):
    surfer.page.set_viewport_size({"width": width, "height": height})
    surfer.page.wait_for_function(f"document.documentElement.scrollWidth <= {width}")
    surfer.page.mouse.wheel(0, 5000)
    box = surfer.page.locator(".stop").bounding_box()
    assert 0 <= box["y"] < 120
    assert box["height"] >= 44


def test_a_page_that_was_closed_changes_nothing_and_another_goes_on(browser, tracker):
    Surfer(browser, tracker).close()
    assert tracker.process.poll() is None
    surfer = Surfer(browser, tracker)
    surfer.reads("emulated brick")
    surfer.close()


def test_a_page_that_is_not_looked_at_takes_nothing_from_those_that_are(surfer):
    for _ in range(20):
        assert surfer.tracker.get()[0] == 200
    # Of the camera's frames every tenth is shown to 21, and more to one, when the machine has time.
    surfer.page.wait_for_function(
        """() => {
            const frame = +document.querySelector('[data-marker=effector]').dataset.frame;
            const before = window.lastFrame ?? frame;
            window.lastFrame = frame;
            return frame > before && frame <= before + 5;
        }"""
    )


def processes(of=None):
    """PIDs that live, of everything or the children of one."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid=,stat="], capture_output=True, text=True)
    rows = [line.split() for line in listed.stdout.splitlines()]
    return {int(pid) for pid, parent, stat in rows if stat[0] != "Z" and of in (None, int(parent))}


def end_with_all_it_has_started(tracker, number):
    """End the tracker; the page and the brick must not live on."""
    others = processes(of=tracker.process.pid)
    assert len(others) >= 2, "the page and the brick"
    tracker.close(number)
    deadline = time.monotonic() + PATIENCE
    while others & processes():
        assert time.monotonic() < deadline, "they live on"
        time.sleep(0.05)
    assert "Traceback" not in "".join(tracker.lines)


def test_with_a_tracker_that_is_killed_page_and_brick_end(browser, tmp_path):
    with Tracker(tmp_path, *SYNTHETIC) as tracker:
        surfer = Surfer(browser, tracker)
        surfer.verdict("Ready")
        surfer.close()
        end_with_all_it_has_started(tracker, signal.SIGKILL)


def test_a_lost_marker_has_its_reason_a_pick_mends_it_and_ctrl_c_ends_it_all(browser, tmp_path):
    with Tracker(tmp_path, *SYNTHETIC, "--effector", "disc:purple") as tracker:
        surfer = Surfer(browser, tracker, seen=".picture img")
        surfer.reads("tip's marker lost: nothing of this colour. Bring it into")
        surfer.pick(*surfer.scene.truth((0.0, 0.0))["effector"])
        surfer.page.get_by_text("tip's marker lost").wait_for(state="detached")
        surfer.verdict("Ready")
        surfer.close()
        end_with_all_it_has_started(tracker, signal.SIGINT)
