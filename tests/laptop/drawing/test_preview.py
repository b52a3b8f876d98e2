"""Previews: read back, since a picture that merely exists shows nothing."""

import os
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
import pytest

from laptop.drawing import preparing, preview
from laptop.drawing.artwork import Artwork
from laptop.drawing.options import DrawingOptions
from laptop.system.files import CannotWrite
from shared.arm_description import find_arm, read_arm

ARM = read_arm(find_arm("planar"))
SVG = "{http://www.w3.org/2000/svg}"


def plan(name="a <b> & c", **options):
    lines = tuple(np.array([(0.0, k), (6.0, k)]) for k in range(4))
    return preparing.prepare(Artwork(name, lines, ("",) * 4), ARM, DrawingOptions(**options))


@pytest.fixture(scope="module")
def clipped():
    return plan(at=(12, -14), size=(9, None), clip=True, paper="a6")


def test_the_svg_shows_strokes_ways_reach_and_what_is_missing(clipped, tmp_path):
    preview.write_preview(clipped, tmp_path / "p.svg")
    root = ElementTree.parse(tmp_path / "p.svg").getroot()
    (group,) = root.iter(SVG + "g")
    assert len(list(group)) == len(clipped.strokes)
    red = [path for path in root.iter(SVG + "path") if path.get("stroke") == "#e00000"]
    assert red[0].get("d").count("M") == len(clipped.missed) > 0
    dashed = [p for p in root.iter(SVG + "path") if p.get("stroke-dasharray")]
    assert dashed[0].get("d").count("M") == len(clipped.strokes) - 1
    reach = next(root.iter(SVG + "path")).get("d")
    assert reach.count("M") == 2  # the rim, and the hole around the base
    words = [text.text for text in root.iter(SVG + "text")]
    assert "a <b> & c" in words
    assert any("cannot be reached" in word and "left out" in word for word in words)
    assert any("pen up" in word for word in words)


def test_the_picture_is_upright_for_who_sits_behind_the_arm():
    straight = preview.scene(plan(at=(12, 0), size=(4, None)))
    assert all(s[0, 1] == pytest.approx(s[-1, 1]) for s in straight.strokes)  # they lie level
    assert straight.joints[0].tolist() == [0, 0]
    assert all(s[:, 1].min() > 5 for s in straight.strokes)  # above the base
    assert preview.seen_from_behind(np.array([[3.0, 2.0]])).tolist() == [[-2, 3]]


def test_the_reach_shown_is_the_arms():
    rim, hole = sorted(
        preview.scene(plan()).reach, key=lambda outline: -np.abs(outline).max()
    )  # fmt: skip
    assert np.hypot(*rim.T).max() == pytest.approx(20.8, abs=0.15)
    assert np.hypot(*hole.T).max() == pytest.approx(5.7, abs=0.3)


def test_colours_follow_time():
    shown = preview.scene(plan())
    assert len(set(shown.colours)) == len(shown.strokes)
    assert preview.colours([0, 1, 0.5, 0])[0] == preview.colours([0])[0]
    assert all(len(colour) == 7 and colour[0] == "#" for colour in shown.scale)


def test_the_png_shows_ink_red_and_paper(clipped, tmp_path):
    preview.write_preview(clipped, tmp_path / "p.png")
    image = cv2.imread(str(tmp_path / "p.png"))
    assert image.shape == (1200, 1600, 3)
    blue, green, red = (image[..., k].astype(int) for k in range(3))
    assert ((red > 200) & (green < 40) & (blue < 40)).sum() > 50
    assert ((blue > 100) & (green < 30) & (red < 120)).sum() > 50  # the first stroke


def test_another_ending_is_refused(tmp_path):
    with pytest.raises(preview.BadPreview, match=r"\.svg or \.png"):
        preview.write_preview(plan(), tmp_path / "p.pdf")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["p.svg", "p.png"])
def test_what_is_no_regular_file_is_left_as_it_is(tmp_path, name):
    os.mkfifo(tmp_path / name)
    with pytest.raises(CannotWrite, match=f"{name}: is a pipe, not a file; choose another name"):
        preview.write_preview(plan(), tmp_path / name)
    assert (tmp_path / name).is_fifo()


def test_a_preview_that_is_broken_off_leaves_the_one_of_before(tmp_path, monkeypatch):
    def broken_off(path, target):
        raise KeyboardInterrupt

    (tmp_path / "p.svg").write_text("before")
    monkeypatch.setattr(os, "replace", broken_off)
    with pytest.raises(KeyboardInterrupt):
        preview.write_preview(plan(), tmp_path / "p.svg")
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("p.svg", "before")]


def test_a_link_to_a_preview_stays_a_link(tmp_path):
    (tmp_path / "there.svg").write_text("before")
    (tmp_path / "p.svg").symlink_to(tmp_path / "there.svg")
    preview.write_preview(plan(), tmp_path / "p.svg")
    assert (tmp_path / "p.svg").is_symlink()
    assert "<svg" in (tmp_path / "there.svg").read_text()
