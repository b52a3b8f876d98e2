"""The building guide: true to the arm's numbers, true to scale, and made of the programs' words."""

import html
import math
import re
import webbrowser

import matplotlib.path
import numpy as np
import pytest
from click.testing import CliRunner
from page_tracker import a_browser

from laptop.brick.diagnosis import judge
from laptop.brick.finding import NO_BRICK
from laptop.cli.main import laptop
from laptop.course import build, drawing, lego, troubles
from laptop.course.handouts import HANDOUTS
from robot.motion import kinematics
from robot.motion.checked import Checked, NotChecked
from shared import verdicts
from shared.arm_description import find_arm, read_arm

ARMS = ("planar", "geared", "spatial")
PT_PER_MM = 72 / 25.4
PX_PER_MM = 96 / 25.4


def the_arm(name="planar"):
    return read_arm(find_arm(name))


def lines_of(svg):
    """Lengths of the straight lines of an SVG, mm on paper."""
    found = []
    for x0, y0, x1, y1 in re.findall(r'd="M ([\d.]+) ([\d.]+) \nL ([\d.]+) ([\d.]+) \n"', svg):
        length = ((float(x1) - float(x0)) ** 2 + (float(y1) - float(y0)) ** 2) ** 0.5
        found.append(length / PT_PER_MM)
    return found


def with_links(arm, *lengths):
    joints = tuple(
        joint._replace(link=length) for joint, length in zip(arm.joints, lengths, strict=True)
    )
    return arm._replace(joints=joints)


@pytest.mark.parametrize("name", ARMS)
def test_the_links_are_drawn_true_to_size(name):
    drawn = drawing.draw_links(the_arm(name))
    assert drawn.scale == 1
    width = float(re.search(r'<svg[^>]*? width="([\d.]+)pt"', drawn.svg)[1])
    assert width / PT_PER_MM == pytest.approx(drawn.width, abs=0.01)
    assert drawn.width <= drawing.WIDTH
    lines = lines_of(drawn.svg)
    for length in (100, 112, 96):  # the check, and beams of 15 and 13 holes
        assert any(abs(line - length) < 0.01 for line in lines), (length, lines)


def test_long_links_are_drawn_smaller_and_say_so():
    drawn = drawing.draw_links(with_links(the_arm(), 22.0, 16.0))
    assert drawn.scale == 2
    assert any(abs(line - 50) < 0.01 for line in lines_of(drawn.svg))  # 100 mm at the arm


@pytest.mark.long
@pytest.mark.parametrize("lengths", [(1, 1), (3, 40), (100, 100)])
def test_an_arm_of_any_size_is_drawn_on_a_page(lengths):
    arm = with_links(the_arm(), *lengths)
    for draw in (drawing.draw_links, drawing.draw_plan, drawing.draw_side, drawing.draw_camera):
        assert draw(arm).width <= drawing.WIDTH + 0.1


@pytest.mark.parametrize(
    ("length", "holes", "beam"), [(11.3, 15, 15), (9.5, 13, 13), (7.9, 11, 11), (8.5, 12, 13)]
)
def test_a_link_is_the_nearest_number_of_holes(length, holes, beam):
    link = lego.link_of(length)
    assert (link.holes, link.beam) == (holes, beam)
    assert abs(link.built - 10 * length) <= lego.PITCH / 2
    assert lego.link_of(20.0).beam is None


def test_wheels_make_the_gear_and_their_axes_are_whole_holes_apart():
    (best, *_) = lego.gear_pairs(5)
    assert (best.wheel, best.pinion, best.distance, best.sets(2)) == (40, 8, 24.0, ["45544"])
    assert [(pair.wheel, pair.pinion) for pair in lego.gear_pairs(3)] == [(24, 8), (36, 12)]
    assert all(pair.fits for pair in lego.gear_pairs(3))
    assert lego.gear_pairs(1) == []
    assert lego.gear_pairs(4.667) == []


def test_the_parts_of_the_planar_arm_are_in_either_set():
    rows = {need.name: need for need in build.needs(the_arm())}
    assert (rows["large motor"].wanted, rows["medium motor"].wanted) == (2, 1)
    assert {need.sets for need in rows.values()} == {"45544 and 31313"}
    assert rows["angle beam 3 x 5"].wanted == 4  # one for each stop of the plan
    without = the_arm()._replace(
        pen=None,
        joints=tuple(j._replace(stop_lower=None, stop_upper=None) for j in the_arm().joints),
    )
    names = {need.name: need.wanted for need in build.needs(without)}
    assert names["angle beam 3 x 5"] == 0
    assert not {"medium motor", "straight beam, 3 holes"} & set(names)
    geared = {need.name: need for need in build.needs(the_arm("geared"))}
    assert geared["gear wheel, 40 teeth"].sets == "45544"
    assert {need.name: need.sets for need in build.needs(the_arm("spatial"))}["large motor"] == (
        "neither"
    )


def test_the_workspace_holds_what_the_tip_gets_to():
    arm = the_arm()
    x0, y0, x1, y1 = drawing.workspace(arm)
    assert x1 == pytest.approx(10 * kinematics.reach(arm)[1], abs=1)
    for q in ((0, 0), (1, 2), (-1.5, -1), (2.9, 0.3)):
        x, y = kinematics.forward(arm, q)
        assert x0 - 1 <= 10 * x <= x1 + 1
        assert y0 - 1 <= 10 * y <= y1 + 1


@pytest.mark.short("planar")
@pytest.mark.parametrize("name", ARMS)
def test_the_guide_holds_the_arms_numbers_and_needs_nothing_else(name):
    page = build.render_guide(the_arm(name), name)
    assert re.findall(r"(?:src|href)=\"(?!data:)", page) == []
    text = html.unescape(re.sub(r"<[^>]+>", " ", re.sub(r"</?span[^>]*>", "", page)))
    assert "Nobody here has built this arm yet." in text
    for joint in the_arm(name).joints:
        for stop in (joint.stop_lower, joint.stop_upper):
            assert f"{stop * 57.29578:.0f}°" in text
    for trouble in troubles.troubles(the_arm(name)):
        assert trouble.sentence in text
    for command in ("brick find", "brick install", "brick doctor", "driver.py", "brick forget"):
        assert command in text


def test_the_sentences_are_those_of_the_programs(tmp_path):
    said = [trouble.sentence for trouble in troubles.troubles(the_arm())]
    facts = {**troubles.HEALTHY, "motors": {}, "battery": 6.2}
    lines = [re.sub(" +", " ", str(line)) for line in judge(facts, the_arm(), troubles.NOW)]
    told = [line for line in lines if not line.endswith(": fine")]
    assert [line.partition(":")[0] for line in told] == [
        "battery 6.20 V", "port A no motor", "port B no motor", "port C no motor",
    ]  # fmt: skip
    assert {told[0], told[2]} <= set(said)
    assert NO_BRICK in said
    with pytest.raises(NotChecked) as unchecked:
        Checked(the_arm(), str(tmp_path)).confirm(dict)
    assert str(unchecked.value) in said
    assert any(re.match(r"no large motor at port B for the elbow; found outA", s) for s in said)
    assert any(s.startswith("my.ini: [shoulder] backlash = two: must be a number") for s in said)
    assert any("25 cm from the shoulder, out of reach" in s for s in said)
    assert verdicts.VERDICT_TEXTS[verdicts.MARKER_LOST] in said
    assert all(said)
    assert len(said) == len(set(said))


@pytest.mark.parametrize("name", ARMS)
def test_a_brick_with_which_all_is_fine_has_no_trouble(name):
    arm = the_arm(name)
    motors = {joint.port: {"kind": joint.motor, "position": 0} for joint in (*arm.joints, arm.pen)}
    found = judge({**troubles.HEALTHY, "motors": motors}, arm, troubles.NOW)
    assert [str(line) for line in found if line.advice] == []
    assert len(found) > 9


@pytest.mark.parametrize("name", ["planar", "geared"])
def test_the_brick_lies_where_nothing_meets_it(name):
    arm = the_arm(name)
    x, y = drawing.brick_place(arm)
    for q1 in np.linspace(arm.joints[0].lower, arm.joints[0].upper, 90):
        for q2 in np.linspace(arm.joints[1].lower, arm.joints[1].upper, 90):
            for place in kinematics.joint_positions(arm, (float(q1), float(q2)))[1:]:
                u, v = (10 * value for value in place)
                inside = x < u < x + drawing.BRICK[0] and y < v < y + drawing.BRICK[1]
                assert not inside, (q1, q2)
    assert np.hypot(x + 36, y + 56) < 250  # and a cable gets there


@pytest.mark.parametrize("name", ARMS)
def test_the_outlines_hold_all_that_the_tip_gets_to(name):
    arm = the_arm(name)
    outlines = [matplotlib.path.Path(outline) for outline in drawing._outlines(arm)]
    draw = np.random.default_rng(3)
    for x, y in draw.uniform(-22, 22, (400, 2)):
        place = (x, y) if arm.chain == "planar" else (x, y, arm.joints[0].link)
        try:
            reached = bool(kinematics.branches(arm, place))
        except kinematics.Unreachable:
            reached = False
        assert reached == any(one.contains_point((10 * x, 10 * y)) for one in outlines), (x, y)


def test_a_wider_camera_stands_lower():
    heights = [drawing.camera_height(the_arm(), angle) for angle in build.VIEW_ANGLES]
    assert heights == sorted(heights, reverse=True)
    x0, _, x1, _ = drawing.workspace(the_arm())
    seen = 2 * heights[1] * math.tan(math.radians(30))  # by a camera of 60 degrees
    assert seen > 4 / 3 * (x1 - x0)  # the picture is 4 : 3


@pytest.mark.long
def test_the_command_writes_a_file_or_opens_the_page(tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["guide", "--out", "mine.html"])
    assert result.exit_code == 0, result.output
    assert (tmp_path / "mine.html").is_file()
    assert opened == []
    assert CliRunner().invoke(laptop, ["guide"]).exit_code == 0
    assert opened == [(tmp_path / "guide.html").as_uri()]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--arm", "none.ini"], "there is no such arm file"),
        (["--out", "nowhere/x.html"], "cannot write nowhere/x.html"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(laptop, ["guide", *words])
    assert result.exit_code == 1
    assert told in str(result.exception) + result.output
    assert list(tmp_path.iterdir()) == []


# Printed


CUT = """() => [...document.querySelectorAll('img, table, pre, h1, h2, p, li')].filter(
    part => part.getBoundingClientRect().right > document.body.getBoundingClientRect().right + 1
  ).map(part => part.outerHTML.slice(0, 80))"""


@pytest.mark.long
@pytest.mark.parametrize("name", ARMS)
def test_printed_by_a_browser_the_links_are_true_to_size(name, tmp_path):
    file = tmp_path / "guide.html"
    file.write_text(build.render_guide(the_arm(name), name), encoding="utf-8")
    with a_browser() as browser:
        page = browser.new_page()
        page.emulate_media(media="print")
        page.goto(file.as_uri())
        picture = page.locator("figure.true-size img").first
        assert picture.evaluate("image => image.complete && image.naturalWidth > 0")
        drawn = drawing.draw_links(the_arm(name))
        box = picture.bounding_box()
        assert box["width"] / PX_PER_MM == pytest.approx(drawn.width, rel=0.0005)
        assert page.evaluate(CUT) == []
        pdf = page.pdf(prefer_css_page_size=True)
    sizes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert 6 <= len(sizes) <= 9
    for width, height in set(sizes):
        assert float(width) == pytest.approx(210 * PT_PER_MM, abs=1)
        assert float(height) == pytest.approx(297 * PT_PER_MM, abs=1)


@pytest.mark.long
def test_each_handout_is_printed_on_two_pages_at_most(tmp_path):
    with a_browser() as browser:
        page = browser.new_page()
        for handout in HANDOUTS:
            file = tmp_path / f"{handout.name}.html"
            file.write_text(handout.page(), encoding="utf-8")
            page.emulate_media(media="print")
            page.goto(file.as_uri())
            assert page.evaluate(CUT) == []
            pages = page.pdf(prefer_css_page_size=True).count(b"/MediaBox")
            assert 1 <= pages <= 2, handout.name
