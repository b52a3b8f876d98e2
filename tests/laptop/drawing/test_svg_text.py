"""Texts in fonts as outlines: where their letters stand, by what the font itself says of them."""

import numpy as np
import pytest
from fontTools.ttLib import TTFont
from matplotlib.font_manager import findfont

from laptop.drawing.svg import read_svg
from laptop.drawing.svg_text import NoFont, find_font

NAMES = (
    'xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80" '
    'overflow="visible"'
)
FONT = TTFont(findfont("DejaVu Sans"))
SCALE = 10 / FONT["head"].unitsPerEm
"""Of letters of 10 px."""


def drawn(text, attributes="", place='x="20" y="40"'):
    """The strokes of a text in letters of 10 px at 20, 40, mm, y downwards, and what is said."""
    fonts = 'font-family="sans-serif" font-size="10"'
    artwork = read_svg(
        f"<svg {NAMES}><text {place} {fonts} {attributes}>{text}</text></svg>".encode()
    )
    return [(stroke - [0, 8]) * [10, -10] for stroke in artwork.strokes], artwork.left_out


def box(text, attributes=""):
    """Least and greatest x, y."""
    points = np.concatenate(drawn(text, attributes)[0])
    return points.min(axis=0), points.max(axis=0)


def glyph(letter):
    """Box of a letter's outline, and how far it goes, by the font's own tables, px."""
    name = FONT.getBestCmap()[ord(letter)]
    outline = FONT["glyf"][name]
    corners = np.array([[outline.xMin, outline.yMin], [outline.xMax, outline.yMax]])
    return corners * SCALE, FONT["hmtx"][name][0] * SCALE


def test_a_letter_is_its_outline_on_the_line_of_its_text():
    (least, most), _ = glyph("H")
    low, high = box("H")
    assert low == pytest.approx([20 + least[0], 40 - most[1]], abs=0.01)
    assert high == pytest.approx([20 + most[0], 40 - least[1]], abs=0.01)
    assert len(drawn("B")[0]) == 3, "its outline and two holes"


def test_letters_follow_one_another_as_far_as_the_font_says_spaces_too():
    (least, _), _ = glyph("H")
    _, wide = glyph("n")
    space = FONT["hmtx"]["space"][0] * SCALE
    strokes, _ = drawn("n H")
    assert strokes[-1][:, 0].min() == pytest.approx(20 + wide + space + least[0], abs=0.01)
    assert box("  n  \n  H ")[1] == pytest.approx(box("n H")[1])


@pytest.mark.parametrize(("anchor", "share"), [("start", 0), ("middle", 0.5), ("end", 1)])
def test_a_text_stands_at_its_anchor(anchor, share):
    wide = sum(glyph(letter)[1] for letter in "nnn")
    moved = box("nnn", f'text-anchor="{anchor}"')[0] - box("nnn")[0]
    assert moved == pytest.approx([-share * wide, 0], abs=1e-3)


def test_parts_of_a_text_have_places_sizes_and_styles_of_their_own():
    strokes, _ = drawn(
        'H<tspan x="50" y="60" font-size="20">H</tspan><tspan dx="5" dy="-3">H</tspan>'
    )
    (least, most), wide = glyph("H")
    lefts = [stroke[:, 0].min() for stroke in strokes]
    assert lefts == pytest.approx(
        [20 + least[0], 50 + 2 * least[0], 50 + 2 * wide + 5 + least[0]], abs=0.01
    )
    assert strokes[1][:, 1].max() == pytest.approx(60, abs=0.01)
    assert strokes[2][:, 1].max() == pytest.approx(57, abs=0.01)
    assert len(drawn('H<tspan display="none">H</tspan>')[0]) == 1


def test_letters_may_each_have_a_place():
    lefts = [stroke[:, 0].min() for stroke in drawn("HHH", place='x="10 30 70"')[0]]
    assert np.diff(lefts) == pytest.approx([20, 40], abs=1e-3)


@pytest.mark.parametrize(
    ("families", "taken", "is_asked_for"),
    [
        ("sans-serif", "DejaVu Sans", True),
        ("'Nowhere Sans', monospace", "DejaVu Sans Mono", False),
        ('"DejaVu Serif", Nowhere', "DejaVu Serif", True),
    ],
)
def test_the_first_font_that_is_there_is_taken(families, taken, is_asked_for):
    found = find_font(families, "normal", "bold")
    assert found[1:] == (taken, is_asked_for)
    assert "Bold" in found.path


def test_a_font_that_is_not_there_is_told():
    with pytest.raises(NoFont):
        find_font("Nowhere, 'Nowhere Sans'", "normal", "normal")
    strokes, told = drawn("H", 'style="font-family: Nowhere, sans-serif"')
    assert len(strokes) == 1
    assert (
        'A font is not on this computer, and another stands for it ("Nowhere: DejaVu Sans").'
        in told
    )


def test_a_letter_that_a_font_lacks_is_told_and_the_others_drawn():
    strokes, told = drawn("H\u4e2dH")
    assert len(strokes) == 2
    assert any(said.startswith("A letter is not in its font, and not drawn") for said in told)
