"""One door: what a file is, its contents tell; the gallery is found by name."""

import re
import struct

import cv2
import numpy as np
import pytest

from laptop.drawing.artwork import CORNER_TURN, SMOOTH_TURN, BadArtwork, turns
from laptop.drawing.gallery_files import GALLERY, gallery
from laptop.drawing.lettering import Lettering
from laptop.drawing.pictures import Tracing
from laptop.drawing.sources import read_source

SVG = b'<svg xmlns="http://www.w3.org/2000/svg"><path stroke="red" d="M0 0h96"/></svg>'


def test_five_drawings_come_along_and_are_found_by_name():
    assert gallery() == ("house", "knot", "owl", "rose", "spirograph")
    for name in gallery():
        artwork = read_source(name)
        assert artwork.name == name
        assert read_source(f"{name}.svg").points() == artwork.points()


@pytest.mark.parametrize("name", gallery())
def test_a_drawing_of_the_gallery_is_whole_small_and_smooth(name):
    artwork = read_source(name)
    assert artwork.left_out == ()
    least, greatest = artwork.bounds()
    assert least.min() >= 0
    assert (greatest <= artwork.size).all()
    assert max(artwork.size) <= 12.001
    assert artwork.points() < 2000
    assert (GALLERY / f"{name}.svg").stat().st_size < 10_000
    for stroke in artwork.strokes:
        turn = np.degrees(turns(stroke))
        assert ((turn <= SMOOTH_TURN + 1e-6) | (turn > CORNER_TURN)).all()


def test_the_rose_has_the_length_and_the_petals_of_its_formula():
    """r = 4.7 cos(7/4 a), a from 0 to 8 pi."""
    (stroke,) = read_source("rose").strokes
    a = np.linspace(0, 8 * np.pi, 200_001)
    r = 4.7 * np.cos(7 / 4 * a)
    exact = np.column_stack([5 + r * np.sin(a), 5 + r * np.cos(a)])
    length = np.hypot(*np.diff(exact, axis=0).T).sum()
    assert np.hypot(*np.diff(stroke, axis=0).T).sum() == pytest.approx(length, rel=2e-3)
    radius = np.hypot(*(stroke - 5).T)
    peaks = (radius[1:-1] > radius[:-2]) & (radius[1:-1] >= radius[2:]) & (radius[1:-1] > 4.6)
    assert peaks.sum() == 13  # of 14; one is where it begins and ends


def test_a_file_of_that_name_comes_before_the_gallery(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rose").write_bytes(SVG)
    assert read_source("rose").points() == 2
    assert read_source("rose.svg").points() > 2
    with pytest.raises(BadArtwork, match="there is no such file"):
        read_source(tmp_path / "rose.svg")  # it is asked for in that folder


def test_contents_tell_whatever_the_name_says(tmp_path):
    image = np.full((60, 60), 255, np.uint8)
    cv2.circle(image, (30, 30), 15, 0, -1)
    for name, data, count in (
        ("drawing.txt", SVG, 1),
        ("picture.svg", cv2.imencode(".jpg", image)[1].tobytes(), None),
        ("words", b"\xef\xbb\xbfI I\r\n", 2),
    ):
        (tmp_path / name).write_bytes(data)
        artwork = read_source(tmp_path / name)
        assert artwork.name == name
        assert count in (None, len(artwork.strokes))
        assert read_source(data, name).points() == artwork.points()


def test_a_text_may_have_any_letters_and_spaces_but_nothing_that_steers():
    for text in ("Bonjour\u00a0!", "a\u200bb", "a\u2028b", "a\u202eb", "a\ue000", "a\vb"):
        assert read_source(text.encode(), "it.txt").strokes
    for text, code in (("a\x1b[31mb", "U+001B"), ("a\x00", "U+0000"), ("\x7fa", "U+007F")):
        with pytest.raises(
            BadArtwork, match=re.escape(f"it.txt: has a control character in it ({code}")
        ):
            read_source(text.encode(), "it.txt")
        with pytest.raises(BadArtwork, match=r"it: is no drawing that is known here"):
            read_source(text.encode(), "it")
    with pytest.raises(BadArtwork, match=r"it.txt: is no text in UTF-8"):
        read_source("\u00e4".encode("latin-1"), "it.txt")


def test_options_reach_what_they_are_for():
    assert read_source(b"I", lettering=Lettering(size=3.0)).bounds()[1][1] == pytest.approx(3)
    image = np.zeros((60, 60), np.uint8)
    image[:30] = 255
    data = cv2.imencode(".png", image)[1].tobytes()
    assert read_source(data, tracing=Tracing(width=7.0)).size == (7, 7)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("G21\nG0 X1\n", "G-code"),
        ("; made by x\r\n(a remark)\r\n\r\nN10 G90 G21 ; mm\r\n", "G-code"),
        ("%\nM3 S1000\n", "G-code"),
        ("IN;SP1;PU0,0;", "HPGL"),
        ("PU 10,20;PD;", "HPGL"),
        ("  0\nSECTION\n  2\nHEADER\n", "a DXF"),
        ("999\nby x\n0\r\nSECTION\r\n", "a DXF"),
    ],
)
def test_a_file_for_another_machine_is_named_and_not_lettered(text, what):
    for name in ("it.txt", "it.nc"):
        with pytest.raises(BadArtwork, match=f"^{name}: is {what}, which is for a machine of its"):
            read_source(text.encode(), name)


@pytest.mark.parametrize(
    "text", ["Good morning\n", "M25 motorway\n", "In; out", "0\nis none", "G is a letter", "pu 5"]
)
def test_a_text_that_begins_alike_is_written(text):
    assert read_source(text.encode(), "it.txt").strokes


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ("no/such.svg", "no/such.svg: there is no such file; give one, or a drawing that comes"),
        ("a\0b", r"a\?b: (cannot be read|there is no such file)"),
        (".", r"\.: is a folder, not a file"),
    ],
)
def test_a_path_that_leads_to_no_drawing_is_refused(path, told):
    with pytest.raises(BadArtwork, match=f"^{told}"):
        read_source(path)


@pytest.mark.parametrize(
    "data", [b"GIF89a", b"BM\0\0", b"II*\0", b"RIFF\0\0\0\0WEBP", b"PK\x03\x04", b"%!PS-Adobe"]
)
def test_other_files_that_people_try_are_named_with_what_to_do(data):
    with pytest.raises(BadArtwork, match="^drawing: is (a |Post).*, which is not read; save"):
        read_source(data)


@pytest.mark.parametrize(
    ("brands", "what"),
    [
        (b"heic\0\0\0\0mif1heic", "is a HEIC"),
        (b"mif1\0\0\0\0mif1heic", "is a HEIC"),
        (b"mif1\0\0\0\0mif1avif", "is an AVIF"),
        (b"avif\0\0\0\0avifmif1", "is an AVIF"),
        (b"isom\0\0\2\0isomiso2avc1mp41", "is a film"),
    ],
)
def test_pictures_of_phones_are_named(brands, what):
    data = struct.pack(">I", 8 + len(brands)) + b"ftyp" + brands + bytes(100)
    with pytest.raises(BadArtwork, match=f"IMG_1.jpg: {what}.*, which is not read; save"):
        read_source(data, "IMG_1.jpg")
