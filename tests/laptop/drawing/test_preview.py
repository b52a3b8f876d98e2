"""Previews: read back, since a picture that merely exists shows nothing."""

import os
import xml.etree.ElementTree as ElementTree

import cv2
import numpy as np
import pytest
from arms import PLANAR as ARM

from laptop.drawing import preparing, preview, preview_plot
from laptop.drawing.artwork import Artwork
from laptop.drawing.options import DrawingOptions
from laptop.record.figures.sheet import TALL_HEIGHT, new_figure
from laptop.system.files import CannotWrite


def plan(name="a <b> & c", **options):
    lines = tuple(np.array([(0.0, k), (6.0, k)]) for k in range(4))
    return preparing.prepare(Artwork(name, lines, ("",) * 4), ARM, DrawingOptions(**options))


@pytest.fixture(scope="module")
def clipped():
    return plan(at=(12, -14), size=(9, None), clip=True, paper="a6")


def sheet_of(drawing):
    """Of a preview: its axes, and what lies there by its name in the legend."""
    with new_figure(TALL_HEIGHT) as figure:
        preview_plot.draw_preview(figure, drawing, preview.lines_of(drawing))
        axes = figure.axes[0]
        return axes, dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))


def strokes_of(axes):
    (strokes,) = axes.collections
    return strokes.get_segments()


def test_the_sheet_shows_strokes_ways_reach_and_what_is_missing(clipped):
    axes, shown = sheet_of(clipped)
    assert len(strokes_of(axes)) == len(clipped.strokes)
    assert list(shown) == [
        *("within reach", "paper", "the arm, at home", "pen up", "out of reach", "start")
    ]
    assert shown["out of reach"].get_color() == "#e00000"
    gaps = {name: np.isnan(shown[name].get_xdata()).sum() for name in ("out of reach", "pen up")}
    assert gaps == {"out of reach": len(clipped.missed), "pen up": len(clipped.strokes) - 1}
    assert gaps["out of reach"] > 0


def test_the_svg_is_one_with_words_in_it(clipped, tmp_path):
    preview.write_preview(clipped, tmp_path / "p.svg")
    root = ElementTree.parse(tmp_path / "p.svg").getroot()
    words = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {"a <b> & c", "pen up"} <= {*words}
    assert any("cannot be reached" in word and "left out" in word for word in words)


def test_the_picture_is_upright_for_who_sits_behind_the_arm():
    axes, _ = sheet_of(plan(at=(12, 2), size=(4, None)))
    strokes = strokes_of(axes)
    assert all(s[0, 1] == pytest.approx(s[-1, 1]) for s in strokes)  # they lie level
    assert np.mean([s.mean(axis=0) for s in strokes], axis=0) == pytest.approx([-2, 12])
    assert axes.xaxis.get_major_formatter()(-2, 0) == "2"  # its y is to the left


def test_the_reach_shown_is_the_arms():
    outlines = preview_plot.reach_outlines(plan())
    rim, hole = sorted(outlines, key=lambda outline: -np.abs(outline).max())
    assert np.hypot(*rim.T).max() == pytest.approx(20.8, abs=0.15)
    assert np.hypot(*hole.T).max() == pytest.approx(5.7, abs=0.3)


def test_colours_follow_time():
    drawing = plan()
    (strokes,) = sheet_of(drawing)[0].collections
    assert strokes.get_array().tolist() == list(drawing.estimate.starts)
    assert strokes.get_clim() == (0, drawing.estimate.seconds)


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
