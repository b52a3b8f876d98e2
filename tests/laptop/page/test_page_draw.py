"""Drawings on the page, in a real browser, before the emulated brick that comes by itself.

The truth is the ink on the emulated table, and where the synthetic camera truly sees the tip.
"""

import base64
import math
import re
import time
from functools import partial

import cv2
import numpy as np
import pytest
from page_tracker import SYNTHETIC, Surfer, Tracker
from waiting import PATIENCE, until

pytestmark = pytest.mark.long

WINDOW = {"width": 1440, "height": 940}
STAR = """<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm"
viewBox="-10 -10 20 20"><path fill="none" stroke="black" d="M0,-9 L5.29,7.28 L-8.56,-2.78 H8.56
L-5.29,7.28 Z"/></svg>"""
TWO_COLOURS = """<svg xmlns="http://www.w3.org/2000/svg" width="6cm" height="6cm" viewBox="0 0 6 6"
fill="none"><path d="M0,0H6" stroke="red"/><path d="M0,0V6" stroke="blue"/></svg>"""
DROP = """([name, base64]) => {
  const data = new DataTransfer();
  const bytes = Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
  data.items.add(new File([bytes], name));
  for (const kind of ["dragenter", "dragover", "drop"]) {
    document.querySelector(".picture").dispatchEvent(
      new DragEvent(kind, { dataTransfer: data, bubbles: true, cancelable: true }));
  }
}"""


class Drawer(Surfer):
    """Somebody before a browser who draws."""

    def drop(self, name, content):
        self.steer()  # whoever was here before may count as steering still: then it is refused
        data = content if isinstance(content, bytes) else content.encode()
        self.page.evaluate(DROP, [name, base64.b64encode(data).decode()])

    def slider(self, name):
        return self.page.get_by_role("slider", name=re.compile(f"^{name}: "))

    def slide(self, name, key, value):
        """Move a slider by a key."""

        def act():
            self.slider(name).locator("[tabindex]").focus()  # what takes keys lies inside
            self.page.keyboard.press(key)

        self.order(act)
        self.until(lambda: self.slider(name).get_attribute("aria-valuenow") == value, name)

    def strokes(self, name):
        """How many strokes a drawing has, once it is planned."""
        self.facts(rf"^{re.escape(name)}: \d+ strokes?, \d+ cm, [\d minsh]+$")
        return int(self.page.locator(".facts-line").inner_text().split(": ")[1].split()[0])

    def word(self, text):
        self.wait(self.page.locator(".job-word", has_text=text))

    def facts(self, text):
        self.wait(self.page.locator(".facts-line", has_text=re.compile(text)))

    def press(self, name):
        button = self.page.get_by_role("button", name=name, exact=True)
        button.and_(self.page.locator(":enabled")).wait_for()
        self.order(button.click)

    def look_around(self):
        self.tool("Draw")
        if self.page.get_by_text("is not known").count():
            self.press("Look around")
            self.word("look around: done")
        self.page.get_by_text("is known by the tip's own moves").wait_for()

    def handle(self, name, number=0):
        found = self.page.locator(f"[data-handle={name}]").nth(number)
        # (There is none for a moment while the drawing is shown anew.)
        box = until(found.bounding_box, "a handle", lambda: self.page.wait_for_timeout(20))
        return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])

    def pull(self, start, end):
        """Drag from what `start` gives, a place of the page, to another; wait until it lies there.

        It is dragged again if nothing comes of it: the handle may just have been shown anew.
        """
        before = self.placing()

        def act():
            here = start()
            self.page.mouse.move(*here)
            self.page.mouse.down()
            self.page.mouse.move(*(here + end) / 2, steps=6)
            self.page.mouse.move(*end, steps=6)
            self.page.wait_for_timeout(150)
            self.page.mouse.up()

        self.insist(act, lambda: self.placing() != before, "the new place")

    def placing(self):
        """(x, y, size, turned) as the fields have them."""
        fields = self.page.locator(".place input")
        return [float(fields.nth(k).input_value()) for k in range(4)]

    def lay(self, *placing):
        """Type where it is to lie (x, y, size, turned), and wait until it does.

        It is typed again if nothing comes of it: what was asked before may have been answered
        between a hand's first touch of a field and the page's hearing of it.
        """

        def act():
            fields = self.page.locator(".place input")
            for key, value in enumerate(placing):
                fields.nth(key).fill(str(value))
            fields.nth(3).press("Enter")

        def lies():
            shown = self.placing()
            self.page.wait_for_timeout(300)  # an answer may come to it still
            return shown == self.placing() == list(placing)

        self.insist(act, lies, "the placing")

    def middle(self):
        """Where the middle of what lies over the picture is, px of the window."""
        return np.mean([self.handle("scale", k) for k in range(4)], axis=0)

    def ink(self):
        """All that was truly drawn so far: points (n, 2), cm."""
        self.follower.poll()
        pose = self.follower.at(self.clock.now())
        return np.array(pose.ink, float).reshape(-1, 4)

    def pixel(self, p):
        """Where ink at a place of the paper p, cm, is truly seen."""
        return tuple(self.scene.project(np.array([(*p, 0.0)]))[0])

    def shown(self, selector):
        """Points (n, 2) of the ways that are shown over the picture, px of it."""
        ways = self.page.locator(selector).evaluate_all(
            "them => them.map(w => w.getAttribute('d'))"
        )
        numbers = re.findall(r"(-?[\d.]+) (-?[\d.]+)", " ".join(ways))
        return np.array(numbers, float)


def off(points, lines):
    """How far each point (n, 2) is from the nearest of lines (n, 2)."""
    best = np.full(len(points), np.inf)
    for line in lines:
        for start, end in zip(line, line[1:], strict=False):
            way = end - start
            share = np.clip((points - start) @ way / max(way @ way, 1e-12), 0, 1)
            best = np.minimum(best, np.hypot(*(points - start - share[:, None] * way).T))
    return best


@pytest.fixture(scope="module")
def tracker(tmp_path_factory):
    with Tracker(tmp_path_factory.mktemp("draw"), *SYNTHETIC, "--no-page-hold") as tracker:
        yield tracker


@pytest.fixture(scope="module")
def open_page(browser, tracker):
    drawer = Drawer(browser, tracker)
    drawer.page.set_viewport_size(WINDOW)
    drawer.verdict("Ready")
    yield drawer
    drawer.close()


@pytest.fixture
def surfer(open_page):
    open_page.tracker.check()
    open_page.steer()
    yield open_page
    open_page.page.keyboard.press("Escape")
    assert open_page.errors == []


class Passed:
    """How near the true tip comes to places, px, by all poses since: however seldom one looks."""

    def __init__(self, surfer, places):
        surfer.joints()  # the brick is there
        self._surfer, self._places = surfer, places
        self._t = surfer.clock.now()
        self.nearest = [math.inf] * len(places)

    def look(self):
        self._surfer.follower.poll()
        now = self._surfer.clock.now()
        while self._t < now:
            tip = self._surfer.scene.truth(self._surfer.follower.at(self._t).q)["effector"]
            distances = [math.dist(tip, place) for place in self._places]
            self.nearest = list(map(min, self.nearest, distances))
            self._t += 0.01


def test_while_nothing_is_known_of_the_table_a_dragged_path_is_followed(surfer):
    surfer.tool("Drive")
    way = [surfer.scene.truth(q)["effector"] for q in ((0.3, 0.6), (0.45, 0.75), (0.65, 0.8))]
    surfer.drag(*way)
    surfer.reads("more")
    passed = Passed(surfer, way)
    surfer.start()
    surfer.verdict("Along the path")
    began = time.monotonic()
    words = ""
    while "Arrived" not in words:
        # None is shown while it is cut off, as on a busy computer.
        words = " ".join(surfer.page.locator(".verdict:visible").all_inner_texts())
        assert re.search("Along the path|On its way|Starting|Held|Arrived|^$", words), words
        passed.look()
        surfer.page.wait_for_timeout(20)
        assert time.monotonic() - began < PATIENCE
    assert max(passed.nearest) < 15
    assert math.dist(surfer.tip(), way[-1]) < 8


def test_a_dropped_svg_is_moved_and_turned_drawn_paused_and_resumed(surfer):
    page = surfer.page
    surfer.drop("star.svg", STAR)
    surfer.facts(r"^star\.svg: 1 stroke, \d+ cm, \d+ s$")
    surfer.look_around()
    page.locator("[data-drawing=good]").first.wait_for(state="attached")
    before = surfer.placing()
    corners = [surfer.handle("scale", k) for k in range(4)]
    middle = np.mean(corners, axis=0)
    corner = partial(surfer.handle, "scale")
    surfer.pull(corner, corners[0] + 0.45 * (middle - corners[0]))
    x, y, size, _ = surfer.placing()
    assert size == pytest.approx(0.55 * before[2], rel=0.1)
    assert (x, y) == pytest.approx(before[:2], abs=0.11)
    surfer.pull(surfer.middle, np.array(surfer.at(600, 60)))
    page.locator("[data-drawing=missed]").first.wait_for(state="attached")
    page.get_by_text("cannot be reached (red)").wait_for()
    page.locator(".draws:disabled", has_text="Start").wait_for()
    surfer.press("Fit")
    surfer.facts(r"s$")
    surfer.lay(13.0, -3.0, 7.0, 0.0)
    surfer.facts(r", \d+ s$")
    there = np.array(surfer.at(*surfer.pixel((13.0, -3.0))))
    surfer.until(lambda: np.hypot(*(surfer.middle() - there)) < 6, "it, over the picture")
    turner = surfer.handle("turn")
    middle = surfer.middle()
    ahead = turner - middle
    quarter = middle + np.array([ahead[1], -ahead[0]])  # as it is seen
    surfer.pull(partial(surfer.handle, "turn"), quarter)
    x, y, size, turned = surfer.placing()
    assert (x, y, size) == pytest.approx((13.0, -3.0, 7.0), abs=0.11)
    assert turned == pytest.approx(90, abs=25), "the camera looks askew"
    surfer.facts(r", \d+ s$")
    already = len(surfer.ink())
    surfer.press("Start")
    surfer.word("Drawing")
    page.wait_for_function(
        "() => /stroke 1 of 1/.test(document.querySelector('.job-word').innerText) &&"
        r" /[3-7]\d %/.test(document.querySelector('.job-word').innerText)"
    )
    surfer.press("Pause")
    surfer.word("Paused, pen up")
    page.wait_for_timeout(1000)
    paused = len(surfer.ink())
    page.wait_for_timeout(2000)
    assert len(surfer.ink()) == paused > already, "nothing is drawn in the pause"
    surfer.press("Resume")
    surfer.word("star.svg: done")
    page.locator(".compared").wait_for()
    ink = surfer.ink()[already:, :2]
    assert len(surfer.ink()) > paused
    star = np.array([(0, 9), (5.29, -7.28), (-8.56, 2.78), (8.56, 2.78), (-5.29, -7.28), (0, 9)])
    sheet = star - (star.max(axis=0) + star.min(axis=0)) / 2
    sheet *= size / np.ptp(star, axis=0).max()
    angle = math.radians(turned)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    wish = np.column_stack([sheet[:, 1], -sheet[:, 0]]) @ turn.T + (x, y)
    assert 10 * off(ink, [wish]).max() < 4.0, "mm; the arm has 2 degrees of play"
    for corner in wish[:5]:
        assert np.hypot(*(ink - corner).T).min() < 0.4, "all of it is drawn"
    said = page.locator(".deviation").inner_text()
    rms, greatest = map(float, re.findall(r"([\d.]+) mm", said))
    assert 0.1 < rms <= greatest < 5.0
    # Wish and ink are shown where the ink on the paper is seen.
    drawn = np.array([surfer.pixel(p) for p in ink])
    for selector, most in ((".ink", 6.0), ("[data-drawing=good]", 6.0 + 4.0)):
        shown = surfer.shown(selector)
        assert len(shown) > 4
        apart = off(shown, [drawn])
        print(f"{selector}: median {np.median(apart):.1f} px, greatest {apart.max():.1f} px")
        assert np.median(apart) < 3.0, "px"
        assert apart.max() < most, "px; the arm has 2 degrees of play"
    page.get_by_text("The arm's marker is 25 mm above it, as the emulated arm is built").wait_for()


def test_a_height_that_is_typed_moves_the_drawing_to_the_paper(surfer):
    page = surfer.page
    surfer.tool("Draw")
    surfer.press("rose")
    surfer.facts(r"^rose: .* s$")
    surfer.look_around()
    surfer.lay(13.0, 0.0, 6.0, 0.0)
    height = page.get_by_label("marker above the paper, mm")

    def lies_at(p):
        there = np.array(surfer.at(*p))
        surfer.until(lambda: np.hypot(*(surfer.middle() - there)) < 6, "it, over the picture")

    for typed, reported in (
        ("", "Measure from the paper up to the marker"),
        ("25", "as typed here"),
    ):

        def act(typed=typed):
            height.fill(typed)
            height.press("Enter")

        surfer.order(act)
        surfer.wait(page.get_by_text(reported))
        z = 0.0 if typed else 2.5  # without a height it lies where the marker moves
        lies_at(surfer.scene.project(np.array([(13.0, 0.0, z)]))[0])
    surfer.press("Remove")


def test_a_dragged_triangle_is_drawn_in_one_go(surfer):
    surfer.look_around()
    surfer.tool("Drive")
    corners = [surfer.pixel(p) for p in ((17.0, 1.0), (11.0, 7.0), (10.0, -3.0), (17.0, 1.0))]
    already = len(surfer.ink())
    surfer.drag(*corners)
    surfer.facts(r"^dragged path: 1 stroke, \d+ cm, \d+ s$")
    surfer.page.locator("[data-drawing=good]").first.wait_for(state="attached")
    surfer.page.wait_for_timeout(200)
    began = time.monotonic()
    surfer.press("Start")
    surfer.word("dragged path: done")
    assert time.monotonic() - began < PATIENCE
    ink = surfer.ink()[already:, :2]
    seen = np.array([surfer.pixel(p) for p in ink])
    dragged = np.array(corners)
    # px per cm where it is drawn, from the true camera.
    scale = math.dist(surfer.pixel((13.0, 0.0)), surfer.pixel((14.0, 0.0)))
    apart = 10 * off(seen, [dragged]) / scale
    print(f"triangle: greatest {apart.max():.1f} mm, RMS {np.sqrt((apart**2).mean()):.1f} mm")
    assert apart.max() < 5.0, "mm"
    for corner in dragged[:3]:
        assert np.hypot(*(seen - corner).T).min() / scale < 0.5, "cm: the corners, too"


def test_a_drawing_of_two_colours_is_drawn_by_two_pens(surfer):
    page = surfer.page
    surfer.drop("two.svg", TWO_COLOURS)
    surfer.facts(r"^two.svg: ")
    surfer.look_around()
    surfer.lay(13.0, 0.0, 5.0, 0.0)
    choice = page.get_by_role("combobox", name="drawn by")
    surfer.order(lambda: (choice.click(), page.get_by_role("option", name="colour").click()))
    surfer.wait(page.get_by_text("2 pens, in this order (strokes): "))
    first, second = re.findall(r"(red|blue) \(1\)", page.locator(".draw-notes").inner_text())
    surfer.facts(r"^two.svg: 2 strokes, \d+ cm, \d+ s$")
    already = len(surfer.ink())
    surfer.press("Start")
    surfer.wait(page.get_by_text(f"Put in the pen for {second!r}, then resume"))
    lines = {"red": ((15.5, 2.5), (15.5, -2.5)), "blue": ((15.5, 2.5), (10.5, 2.5))}
    of_first = surfer.ink()[already:, :2]
    assert 10 * off(of_first, np.array([lines[first]])).max() < 4.0, "mm"
    surfer.press("Resume")
    surfer.word("two.svg: done")
    of_second = surfer.ink()[already + len(of_first) :, :2]
    assert 10 * off(of_second, np.array([lines[second]])).max() < 4.0, "mm"
    choice.click()
    page.get_by_role("option", name="one pen").click()
    surfer.until(lambda: not page.get_by_text("2 pens").count(), "one pen again")
    surfer.press("Remove")


def test_areas_are_hatched_where_that_is_ticked(surfer):
    surfer.drop("area.svg", STAR.replace('fill="none"', 'fill="black"'))
    surfer.strokes("area.svg")
    outline = surfer.page.locator(".facts-line").inner_text()
    box = surfer.page.get_by_role("checkbox", name="Hatch areas")
    surfer.insist(box.click, lambda: box.get_attribute("aria-checked") == "true", "the tick")
    surfer.until(lambda: " s" in outline != surfer.page.locator(".facts-line").inner_text(), "it")
    surfer.strokes("area.svg")
    lengths = [
        int(re.search(r"(\d+) cm", text).group(1))
        for text in (outline, surfer.page.locator(".facts-line").inner_text())
    ]
    assert lengths[1] > 2 * lengths[0]
    surfer.press("rose")
    surfer.until(lambda: not box.is_visible(), "nothing of a rose to hatch")
    surfer.press("Remove")


def test_a_path_that_cannot_be_reached_is_red_before_anything_moves(surfer):
    surfer.look_around()
    surfer.tool("Drive")
    u, v = surfer.pixel((18.0, 0.0))
    surfer.drag((u, v), (u + 60, v), (u + 60, v + 20))
    surfer.page.get_by_text("cannot be reached (red)").wait_for()
    surfer.page.locator("[data-drawing=missed]").first.wait_for(state="attached")
    surfer.page.locator(".draws:disabled", has_text="Start").wait_for()
    surfer.press("Remove")
    surfer.page.wait_for_function("() => !document.querySelector('[data-drawing]')")


def test_a_picture_is_traced_as_the_sliders_say(surfer):
    page = surfer.page
    surfer.tool("Draw")
    assert not surfer.slider("shades").is_visible()
    grey = np.full((120, 160), 255, np.uint8)
    cv2.circle(grey, (45, 60), 16, 20, -1)
    cv2.circle(grey, (115, 60), 16, 130, -1)
    surfer.drop("discs.png", cv2.imencode(".png", grey)[1].tobytes())
    hatched = surfer.strokes("discs.png")
    assert hatched > 20
    reported = [
        surfer.slider(n).get_attribute("aria-valuenow") for n in ("detail", "shades", "smoo.*")
    ]
    assert reported == ["50", "3", "30"]
    surfer.slide("shades", "PageDown", "0")
    surfer.facts("discs.png: 2 strokes")
    assert surfer.strokes("discs.png") == 2, "an outline each"
    surfer.slide("detail", "PageDown", "0")
    surfer.wait(page.locator(".trouble", has_text="nothing would be drawn; raise one of them"))
    page.locator(".draws:disabled", has_text="Start").wait_for()
    surfer.slide("shades", "ArrowRight", "1")
    surfer.wait(page.locator(".draws:enabled", has_text="Start"))
    assert 5 < surfer.strokes("discs.png") < hatched
    choice = page.get_by_role("combobox", name="style")
    assert choice.input_value() == "photo"
    drawn = cv2.ellipse(np.full((300, 400), 255, np.uint8), ((200, 150), (300, 200), 0), 0, 4)
    surfer.drop("ellipse.png", cv2.imencode(".png", drawn)[1].tobytes())
    assert surfer.strokes("ellipse.png") == 1, "a line of ink along its middle"
    assert choice.input_value() == "as it looks"
    choose = page.get_by_role("option", name="photo").click
    surfer.order(lambda: (choice.click(), choose()))
    surfer.facts("ellipse.png: ([2-9]|[1-9][0-9])")
    surfer.order(lambda: (choice.click(), page.get_by_role("option", name="lines").click()))
    surfer.facts("ellipse.png: 1 stroke,")
    page.get_by_role("button", name="rose", exact=True).click()
    surfer.facts(r"^rose: ")
    surfer.until(lambda: not surfer.slider("shades").is_visible(), "no sliders for a rose")
    surfer.press("Remove")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("broken.svg", "<svg", "broken.svg"),
        ("empty.svg", "", "is empty"),
        ("page.svg", "<html><script>alert(1)</script></html>", "page.svg"),
        ("named.png", "no picture", "named.png"),
    ],
)
def test_a_file_that_is_no_drawing_says_why(surfer, name, text, words):
    surfer.drop(name, text)
    surfer.wait(surfer.page.locator(".trouble", has_text=words))
    assert surfer.page.get_by_role("tab", name="Draw").get_attribute("aria-selected") == "true"


def test_a_text_is_written_and_stopped(surfer):
    page = surfer.page
    surfer.tool("Draw")
    page.get_by_label("or type a text").fill("LEGO")
    surfer.press("Write")
    surfer.facts(r"^LEGO: \d+ strokes, \d+ cm, \d+ s$")
    surfer.press("Start")
    surfer.word("Drawing")
    page.keyboard.press("Escape")
    surfer.word("LEGO: aborted")
    page.get_by_text("Stopped from the page").wait_for()
    surfer.tool("Drive")
    assert page.locator(".go:enabled", has_text="Start").count() or surfer.can_start() is None
