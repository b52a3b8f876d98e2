"""A tracker with its page in processes of their own, and somebody before a browser, for tests."""

import base64
import http.client
import json
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.parse
from contextlib import ExitStack, contextmanager

import pytest
from announced import wait_for_event
from places import ROOT
from waiting import PATIENCE, until

from laptop.emulator.live import PoseReader
from laptop.emulator.pace import PacedClock
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from shared.arm_description import find_arm, read_arm
from tests.claims import page as bench
from tests.claims.page_rig import on_page, page_processes, start_button

LATE = "look, then do it again"
"""What the page says of an order that it refuses because it came late."""
ORDERED = f"""
new MutationObserver((changes) => {{
  const isNewlySaid = ({{ target, addedNodes }}) =>
    addedNodes.length && target.closest?.(".q-notifications") &&
    [target.closest(".q-notification"), ...addedNodes].some((node) =>
      node?.textContent.includes({LATE!r}));
  if (changes.some(isNewlySaid) && window.ordered) window.ordered.late = true;
}}).observe(document, {{ childList: true, subtree: true }});
"""
"""Notes in a page that the last order came late, though that is shown for a while only."""
WINDOW = {"width": 1100, "height": 760}
SYNTHETIC = "--camera", "synthetic", "--scene", "fps=10,jpeg=0,exposure=0.004"
"""Quicker to paint: others wait for the same two cores."""


class Tracker:
    """`track --camera synthetic` with its page, until it is closed."""

    def __init__(self, folder, *words):
        self.state = folder / "state"
        environment = {
            **os.environ,
            "BRICKSERVO_STATE": str(self.state),
            "PYTHONPATH": str(ROOT),
            "PYTHONUNBUFFERED": "1",
            "BROWSER": "true",  # it opens nothing
        }
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "laptop",
                "track",
                *words,
                "--listen-port",
                "127.0.0.1:0",
            ]
            + ["--page-port", "0", "--json"],
            cwd=folder,  # where it keeps the runs of which a report is opened
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines = []
        self.reader = threading.Thread(target=lambda: self.lines.extend(self.process.stderr))
        self.reader.start()
        self.addresses = [wait_for_event(self.process.stdout, "page")["url"]]
        self.listener = threading.Thread(target=self._listen)
        self.listener.start()
        parts = urllib.parse.urlsplit(self.addresses[0])
        self.host, self.port = parts.netloc, parts.port
        self.gate = f"127.0.0.1:{self.port + 1}"  # unless that port is taken
        self.used = 0
        self._cookie = ""

    def _listen(self):
        for line in self.process.stdout:
            told = json.loads(line)
            if told["event"] == "page":
                self.addresses.append(told["url"])

    def new_address(self):
        """An address that nobody has used; whoever takes it uses it."""
        until(lambda: len(self.addresses) > self.used, "a new address")
        self.used += 1
        return self.addresses[self.used - 1]

    def new_token(self):
        (token,) = urllib.parse.parse_qs(urllib.parse.urlsplit(self.new_address()).query)["token"]
        return token

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.close()

    def page_processes(self):
        """PIDs of its pages."""
        return page_processes(self.process.pid)

    def check(self):
        """Fail at once where it has ended, and not after waiting for what cannot come."""
        status = self.process.poll()
        assert status is None, f"the tracker has ended with {status}:\n" + "".join(self.lines[-20:])

    @property
    def cookie(self):
        if not self._cookie:
            _, headers, _ = self.get(f"/?token={self.new_token()}", Cookie=None)
            self._cookie = headers["set-cookie"].partition(";")[0]
        return self._cookie

    def get(self, path="/", method="GET", **headers):
        """Status, headers and body of an answer; Host and Cookie are the right ones if not said."""
        headers = {"Host": self.host, **headers}
        if "Cookie" not in headers:
            headers["Cookie"] = self.cookie
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        connection.putrequest(method, path, skip_host=True)
        for name, value in headers.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), body.decode("utf-8", "replace")

    def upgrade(self, **headers):
        """A socket that has asked for the page's WebSocket, and the first line of the answer."""
        headers = {
            "Host": self.host,
            "Cookie": self.cookie,
            "Origin": f"http://{self.host}",
            "Upgrade": "websocket",
            "Connection": "Upgrade",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
            **headers,
        }
        sock = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)
        lines = [f"{name}: {value}" for name, value in headers.items() if value is not None]
        path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
        sock.sendall("\r\n".join([f"GET {path} HTTP/1.1", *lines, "", ""]).encode())
        answer = b""
        while b"\r\n\r\n" not in answer:
            data = sock.recv(4096)
            if not data:
                break
            answer += data
        return sock, answer.split(b"\r\n")[0].decode()

    def close(self, number=signal.SIGINT):
        self.process.send_signal(number)  # to none that has ended
        try:
            self.process.wait(PATIENCE)
        finally:
            if self.process.poll() != 0:
                print(*self.lines, sep="", end="")  # shown where a test fails
        self.reader.join(PATIENCE)
        self.listener.join(PATIENCE)
        self.process.stdout.close()
        self.process.stderr.close()


CHOSEN = ":is([aria-pressed=true], [aria-selected=true])"
"""A tool, or a tab, that is."""


def open_fold(page, title):
    """Open what folds away, if it is closed."""
    head = page.locator(".fold [role=button]", has_text=title)
    if head.get_attribute("aria-expanded") != "true":
        head.click()
        head.and_(page.locator("[aria-expanded=true]")).wait_for()


COLOUR_FOLD = "Picture and colours"
"""What a click in an image may do stands in it."""


def press_tool(page, name):
    """Choose what a click in an image does, and wait until the page says so."""
    open_fold(page, COLOUR_FOLD)
    tool_button(page, name).click()
    tool_button(page, name, CHOSEN).wait_for()


def tool_button(page, name, which="*"):
    """The button of a tool or a tab, if it is such a one."""
    button, tab = (page.get_by_role(role, name=name, exact=True) for role in ("button", "tab"))
    return page.locator(".tools").locator(button.or_(tab)).and_(page.locator(which))


class Hand:
    """Somebody's hand at a page: what came late, and was refused, is done again."""

    def __init__(self, page):
        self.page = page
        self._order = None
        page.add_init_script(ORDERED)
        page.set_default_timeout(1000 * PATIENCE)

    def order(self, act):
        """Do what the page may refuse because it came late; then it is done again."""
        self._order = act
        self._give()

    def _give(self):
        self.page.evaluate("window.ordered = { late: false }")
        self._order()

    def repeat_if_lost(self):
        """Repeat an order that came late, or in a page that was loaded anew, as on a busy one."""
        if self._order and self.page.evaluate("!window.ordered || window.ordered.late"):
            self._give()

    def wait(self, found):
        """Wait for what a locator finds; repeat an order that was lost."""
        if self._order:
            self.until(found.count, "what was ordered")
        found.first.wait_for(state="attached")

    def until(self, condition, what):
        """Wait for what no locator finds; repeat an order that was lost."""
        from playwright.sync_api import Error  # not there without a browser

        def holds():
            try:
                self.repeat_if_lost()
                return condition()
            except Error as error:
                if "navigation" not in str(error):
                    raise
                return False  # it is being loaded anew

        until(holds, what, lambda: self.page.wait_for_timeout(30))
        self._order = None

    def insist(self, act, condition, what):
        """Do, until it holds, what a page that just moves under the hand may mistake for another.

        It is done again where nothing comes of it.
        """
        tried = time.monotonic()

        def holds():
            nonlocal tried
            if time.monotonic() > tried + 20:
                tried = time.monotonic()
                self.order(act)
            return condition()

        self.order(act)
        self.until(holds, what)


class Surfer(Hand):
    """Somebody before a browser, to which pictures may come `late` (s); and the true arm."""

    def __init__(
        self, browser, tracker, late=0.0, steers=True, seen="[data-marker=effector]", **options
    ):
        tracker.check()
        self.tracker = tracker
        self.context = browser.new_context(viewport=WINDOW, **options)
        super().__init__(self.context.new_page())
        self.errors, self.addresses = [], []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.addresses.append(request.url))
        # Shown where a test fails: a page that was loaded again forgets what was pressed.
        self.page.on("console", lambda said: print(f"browser: {said.text}"))
        self.page.on("framenavigated", lambda frame: print(f"browser: at {frame.url}"))
        if late:
            self.page.route("**/view/**", lambda route: (time.sleep(late), route.continue_()))
        self.page.goto(tracker.new_address())
        self.page.wait_for_selector(seen, state="attached")
        self.scene = Scene(read_arm(find_arm("planar")), read_scene(""))
        self.clock = PacedClock(str(tracker.state))
        self.follower = PoseReader(str(tracker.state))
        if steers:
            self.steer()

    def steer(self):
        """Give the orders from now on, if it is not so already."""
        shown = self.page.locator(":visible")
        steers = self.page.get_by_text("You steer").and_(shown)
        take = self.page.get_by_role("button", name="Take over").and_(shown)
        steers.or_(take).first.wait_for()
        if not self.steers():
            # By a script: a click would wait for ever for a button that has just gone.
            self.order(lambda: take.evaluate_all("them => them.forEach(one => one.click())"))
            self.wait(steers)

    def steers(self):
        """Whether it gives the orders."""
        return self.page.get_by_text("You steer").and_(self.page.locator(":visible")).count() > 0

    def at(self, u, v):
        """Where a pixel of the picture is on the page."""
        self.page.evaluate("scrollTo(0, 0)")
        return on_page(self.page.locator(".picture img"), u, v)

    def click(self, u, v):
        self.order(lambda: self.page.mouse.click(*self.at(u, v)))

    def aim(self, u, v):
        """Click on a goal, until it is the one that is shown: an earlier one may be so still."""
        read = "them => them.map(one => one.dataset.aim.split(',').map(Number))"

        def is_there():
            shown = self.page.locator("[data-aim]").evaluate_all(read)
            return any(math.dist(goal, (u, v)) < 2 for goal in shown)

        self.insist(lambda: self.page.mouse.click(*self.at(u, v)), is_there, "the goal")

    def pick(self, u, v):
        """Pick the effector's colour in the picture."""

        def act():
            # (A page that was loaded anew has forgotten its tool.)
            for button in tool_button(self.page, "Pick", "[aria-pressed=false]").all():
                button.click()
            self.page.mouse.click(*self.at(u, v))

        self.tool("Pick")
        self.insist(act, self.page.locator("[data-marker=effector]").count, "the marker")

    def drag(self, *points):
        def draw():
            self.page.mouse.move(*self.at(*points[0]))
            self.page.mouse.down()
            for point in points[1:]:
                self.page.mouse.move(*self.at(*point), steps=8)
            self.page.mouse.up()

        self.order(draw)

    def button(self, name):
        return self.page.get_by_role("button", name=name)

    def tool(self, name):
        if name not in ("Drive", "Draw"):
            open_fold(self.page, COLOUR_FOLD)
        self.order(tool_button(self.page, name).click)
        self.wait(tool_button(self.page, name, CHOSEN))

    def can_start(self):
        """Wait until a run can be ordered."""
        self.wait(start_button(self.page))

    def start(self):
        self.can_start()
        self.order(self.button("Start").click)

    def start_and_move(self):
        """Order a run, and wait until the true arm is on its way, whatever is shown of that."""
        began = self.joints()  # later, it might be nearly there

        def moves():
            # Rightly held: on a busy computer no page was heard for 2 s.
            if self.page.get_by_text("held; Start goes on").count():
                start_button(self.page).evaluate_all("them => them.forEach(one => one.click())")
            return math.dist(self.joints(), began) > 0.1

        self.start()
        self.until(moves, "a motion")

    def verdict(self, text):
        """Wait for a verdict."""
        self.wait(self.page.locator(".verdict:visible", has_text=text))

    def reads(self, text):
        self.wait(self.page.get_by_text(text).first.and_(self.page.locator(":visible")))

    def joints(self):
        """The true ones, rad; if there is no brick yet, once it has come."""

        def pose():
            self.follower.poll()
            return self.follower.at(self.clock.now())

        return until(pose, "the brick", lambda: self.page.wait_for_timeout(20)).q

    def tip(self):
        """Where the true tip is, px."""
        return self.scene.truth(self.joints())["effector"]

    def close(self):
        # Shown where a test fails.
        print("it shows: " + " | ".join(self.page.locator("body").inner_text().split("\n")))
        self.context.close()
        self.follower.close()
        self.clock.close()
        assert self.errors == []


@contextmanager
def a_browser():
    """Provide a browser; skips the test where there is none, but for CI, which must have one."""
    with ExitStack() as stack:
        try:
            browser = stack.enter_context(bench.browser())
        except bench.NoBrowser as why:
            if os.environ.get("CI") == "true":
                pytest.fail(str(why))
            pytest.skip(str(why))
        yield browser
