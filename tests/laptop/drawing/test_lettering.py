"""Text in letters of single strokes: its measures, its accents, and what the fonts lack."""

import math

import numpy as np
import pytest

from laptop.drawing.artwork import CORNER_TURN, SMOOTH_TURN, BadArtwork, turns
from laptop.drawing.lettering import FONTS, Lettering, write_text


def box(text, **how):
    """Least and greatest x, y of a text."""
    return write_text(text, Lettering(**how)).bounds()


def shape(text, **how):
    """All that is written, to the thousandth of a capital."""
    return sorted(
        tuple(map(tuple, stroke.round(3))) for stroke in write_text(text, Lettering(**how)).strokes
    )


@pytest.mark.parametrize("font", ["plain", "roman", "times"])
@pytest.mark.parametrize("size", [0.5, 2.0])
def test_capitals_have_the_height_that_is_asked_for(font, size):
    least, greatest = box("H", font=font, size=size)
    assert (least[1], greatest[1]) == pytest.approx((0, size))


def test_a_word_is_as_long_as_its_letters_and_spacing_stretches_it():
    ways = {
        spacing: box("Ill", spacing=spacing)[1][0] - box("I", spacing=spacing)[1][0]
        for spacing in (1.0, 1.5)
    }
    assert ways[1.5] == pytest.approx(1.5 * ways[1.0])


def test_slanted_letters_lean_by_that_angle():
    (upright,) = write_text("I").strokes
    (leaning,) = write_text("I", Lettering(slant=math.radians(15))).strokes
    assert np.ptp(upright[:, 0]) == pytest.approx(0)
    assert np.ptp(leaning[:, 0]) / np.ptp(leaning[:, 1]) == pytest.approx(
        math.tan(math.radians(15))
    )


def test_lines_stand_below_each_other_and_meet_at_the_side_that_is_asked_for():
    for align, share in (("left", 0.0), ("centre", 0.5), ("right", 1.0)):
        artwork = write_text("HHHH\nH", Lettering(align=align, leading=2.0, size=1.5))
        upper = [stroke for stroke in artwork.strokes if stroke[:, 1].max() > 2.5]
        lower = [stroke for stroke in artwork.strokes if stroke[:, 1].max() < 2.0]
        assert min(stroke[:, 1].min() for stroke in upper) == pytest.approx(3.0)
        assert min(stroke[:, 1].min() for stroke in lower) == pytest.approx(0.0)
        long, short = (np.concatenate(line)[:, 0] for line in (upper, lower))
        rest = np.ptp(long) - np.ptp(short)
        assert short.min() - long.min() == pytest.approx(share * rest)


@pytest.mark.parametrize("font", FONTS)
@pytest.mark.parametrize(("letter", "base"), [("ä", "a"), ("Ö", "O"), ("ü", "u"), ("é", "e")])
def test_an_accent_stands_above_its_letter_and_in_its_middle(font, letter, base):
    plain = write_text(base, Lettering(font=font)).strokes
    marked = write_text(letter, Lettering(font=font)).strokes
    assert len(marked) == len(plain) + (1 if letter == "é" else 2)
    for one, other in zip(plain, marked, strict=False):
        assert one == pytest.approx(other)
    accent, body = np.concatenate(marked[len(plain) :]), np.concatenate(plain)
    assert accent[:, 1].min() > body[:, 1].max()
    middle = (body[:, 0].min() + body[:, 0].max()) / 2
    assert (accent[:, 0].min() + accent[:, 0].max()) / 2 == pytest.approx(middle, abs=0.05)


def test_an_accent_takes_the_place_of_the_dot_of_an_i():
    assert len(write_text("í").strokes) == len(write_text("i").strokes) == 2
    assert len(write_text("ï").strokes) == 3
    assert len(write_text("į").strokes) == 3  # what hangs below leaves the dot


@pytest.mark.parametrize(
    ("text", "alike"),
    [
        ("Stra\u00dfe", "Strasse"),
        ("\u201eja\u201c \u2013 nein\u2026", '"ja" - nein...'),
        ("a\u0308", "\u00e4"),  # composed or not
        ("\u03c3\u03c2", "\u03c3\u03c3"),
        ("\u00b5", "\u03bc"),
    ],
)
def test_what_looks_alike_is_written_alike(text, alike):
    one, other = write_text(text), write_text(alike)
    assert one.left_out == ()
    for stroke, same in zip(one.strokes, other.strokes, strict=True):
        assert stroke == pytest.approx(same)


@pytest.mark.parametrize("space", "\u00a0\u2003\u202f\u3000")
def test_every_space_is_as_wide_as_a_plain_one(space):
    assert shape(f"a{space}b") == shape("a b")


@pytest.mark.parametrize("nothing", "\u00ad\u034f\u200b\u200d\u202e\u2060\u3164\ufe0f\ufeff")
def test_what_has_neither_ink_nor_width_is_nothing(nothing):
    assert shape(f"a{nothing}b") == shape("ab")
    assert write_text(f"a{nothing}b").left_out == ()


def test_greek_letters_are_each_other():
    letters = "αβγδεζηθικλμνξοπρστυφχψωΑΒΓΔΕΖΗΘΙΚΛΜΝΞΟΠΡΣΤΥΦΧΨΩ"
    shapes = {
        tuple(np.round(np.concatenate(write_text(letter).strokes), 6).ravel()) for letter in letters
    }
    assert len(shapes) == len(letters) == 48
    assert write_text(letters).left_out == ()


def test_letters_that_the_font_lacks_are_named_and_the_others_written():
    artwork = write_text("x = \u4e2d\u4e2d\u0001")
    assert artwork.left_out == ("The font lacks \u4e2d U+0001.",)
    assert len(artwork.strokes) == len(write_text("x = ").strokes)


def test_round_letters_are_smooth():
    for letter in "oOSeg":
        for stroke in write_text(letter).strokes:
            turn = np.degrees(turns(stroke))
            assert ((turn <= SMOOTH_TURN + 1e-6) | (turn > CORNER_TURN)).all()
    (ring,) = write_text("o").strokes
    assert np.degrees(turns(ring)).max() <= SMOOTH_TURN + 1e-6


def test_every_character_of_ascii_can_be_written_in_every_font():
    text = "".join(map(chr, range(33, 127)))
    for font in FONTS:
        artwork = write_text(text, Lettering(font=font))
        assert artwork.left_out == ()
        assert all(np.isfinite(stroke).all() and len(stroke) > 1 for stroke in artwork.strokes)


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({"size": 0}, "letters = 0 cm: it must be from 0.1 to 100 cm"),
        ({"size": float("nan")}, "letters = nan cm: it must be"),
        ({"slant": 1.0}, "slant = 57.2958 degrees: it must be from -45 to 45 degrees"),
        ({"spacing": -1}, "spacing = -1: it must be from 0.5 to 5"),
        ({"leading": 0.0}, "leading = 0: it must be from 1 to 10"),
        ({"font": "comic"}, "font = comic: it must be one of plain, roman"),
        ({"align": "top"}, "align = top: it must be one of left, centre, right"),
    ],
)
def test_what_cannot_be_written_so_is_refused(how, told):
    with pytest.raises(BadArtwork, match=f"^{told}"):
        write_text("a", Lettering(**how))


@pytest.mark.parametrize("text", ["", " \n ", "\u4e2d"])
def test_nothing_to_write_is_refused(text):
    with pytest.raises(BadArtwork, match="nothing in it can be written"):
        write_text(text)


@pytest.mark.parametrize("font", FONTS)
def test_letters_of_europe_are_written_in_every_font(font):
    text = (
        "\u00f8\u00d8\u0142\u0141\u0111\u0110\u00f0\u00d0\u00fe\u00de\u0127\u0167\u0131\u20ac\u00a3\u00a5\u00a2"
        "\u2192\u2190\u2191\u2193\u00bd\u00bc\u00be\u2153\u00b2\u00b3\u2082\u00d7\u00f7\u00b1\u2264\u2265\u2260\u221e\u221a\u00a7\u2665"
    )
    shapes = {character: shape(character, font=font) for character in text}
    for character in text:
        assert write_text(character, Lettering(font=font)).left_out == ()
    alike = {("\u0110", "\u00d0")}  # the letters of Croatia and of Iceland
    for a in text:
        for b in text:
            assert a >= b or (shapes[a] != shapes[b]) != ((a, b) in alike or (b, a) in alike)


def test_all_letters_of_russian_and_ukrainian_are_written_each_in_its_own_shape():
    small = "".join(map(chr, range(0x430, 0x450))) + "\u0451\u0456\u0457\u0454"
    letters = small + small.upper()
    assert write_text(letters).left_out == ()
    assert len({str(shape(letter)) for letter in letters}) == len(letters)
    for letter in small:
        (_, low), (_, high) = box(letter), box(letter.upper())
        assert low[1] < high[1] + 0.31, letter  # a small one is no higher


def test_a_bar_goes_through_the_letter_that_it_is_added_to():
    for letter, base in (("\u00f8", "o"), ("\u0142", "l"), ("\u0111", "d"), ("\u20ac", "C")):
        added = [stroke for stroke in shape(letter) if stroke not in shape(base)]
        plain = write_text(base).strokes
        crossings = 0
        for bar in added:
            a, b = np.array(bar[0]), np.array(bar[-1])
            for stroke in plain:
                ahead = (stroke - a) @ np.array([-(b - a)[1], (b - a)[0]])
                crossings += int((np.diff(np.sign(ahead)) != 0).sum())
        assert crossings >= 1, letter


def test_a_fraction_has_small_digits_one_above_the_other():
    least, greatest = box("\u00bd")
    assert greatest[1] > 1.0 > box("1")[1][1] * 0.99
    digits = [np.array(s) for s in write_text("\u00bd").strokes if np.ptp(s[:, 1]) < 0.7]
    assert min(s[:, 1].min() for s in digits) < 0.1
    assert max(s[:, 1].max() for s in digits) > 0.9
    assert shape("2\u00bd") != shape("21/2")


def test_letters_in_another_dress_are_written_as_plain_ones():
    assert shape("\uff21\U0001d401") == shape("AB")
    assert shape("\ufb03") == shape("ffi")
