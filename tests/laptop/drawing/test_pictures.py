"""Pictures become outlines and hatching, against shapes that are known."""

import io
import math
import struct
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

from laptop.drawing import pictures
from laptop.drawing.artwork import BadArtwork, stroke_length
from laptop.drawing.picture_files import read_grey
from laptop.drawing.pictures import Tracing, read_picture

OUTLINES = Tracing(shades=0)
HATCHING = Tracing(detail=0, shades=1, smoothing=0)


def packed(image, ending=".png"):
    """The file of a picture."""
    return cv2.imencode(ending, image)[1].tobytes()


def disc(side=400, radius=100):
    """A black disc on white."""
    image = np.full((side, side), 255, np.uint8)
    return cv2.circle(image, (side // 2, side // 2), radius, 0, -1, cv2.LINE_AA)


def test_the_outline_of_a_disc_is_its_circle():
    (ring,) = read_picture(packed(disc()), how=OUTLINES).strokes
    centre = np.array([5.0, 5.0]) + [0.0125, -0.0125]  # its middle is that of a pixel
    assert np.abs(np.hypot(*(ring - centre).T) - 2.5).max() < 0.04
    assert ring[0] == pytest.approx(ring[-1])
    assert stroke_length(ring) == pytest.approx(2 * math.pi * 2.5, rel=0.02)


def test_up_is_up_and_the_sheet_has_the_shape_of_the_picture():
    image = np.full((200, 400), 255, np.uint8)
    image[20:60, 40:120] = 0  # at the top, to the left
    artwork = read_picture(packed(image), how=Tracing(shades=0, width=20.0))
    assert artwork.size == pytest.approx((20, 10))
    least, greatest = artwork.bounds()
    assert (*least, *greatest) == pytest.approx((2, 7, 6, 9), abs=0.1)


def test_hatching_covers_what_is_dark_and_nothing_else():
    artwork = read_picture(packed(disc()), how=HATCHING)
    for stroke in artwork.strokes:
        middle, (x, y) = stroke.mean(axis=0) - 5, stroke[-1] - stroke[0]
        assert abs(math.degrees(math.atan2(y, x)) % 180 - 45) < 1
        # A chord of the circle: from one side to the other
        assert np.hypot(*(stroke - 5).T) == pytest.approx(2.5, abs=0.05)
        assert np.hypot(*middle) < 2.55
    spacing = 10 / 60
    assert artwork.length() * spacing == pytest.approx(math.pi * 2.5**2, rel=0.03)
    assert len(artwork.strokes) == pytest.approx(5 / spacing, abs=2)


def test_a_darker_tone_gets_more_directions():
    image = np.full((300, 300), 255, np.uint8)
    for column, tone in enumerate((170, 110, 40)):
        image[50:250, 20 + 90 * column : 100 + 90 * column] = tone
    artwork = read_picture(packed(image), how=Tracing(detail=0, shades=3, smoothing=0))
    directions = []
    for column in range(3):
        low, high = (20 + 90 * column) / 30, (100 + 90 * column) / 30
        inside = [s for s in artwork.strokes if low < s[:, 0].mean() < high]
        steps = np.array([s[1] - s[0] for s in inside])
        directions.append(len(set(np.round(np.degrees(np.arctan2(*steps.T[::-1])) % 180 / 45))))
    assert directions == [1, 2, 3]


def test_each_slider_does_what_it_says():
    noise = np.random.default_rng(3).normal(0, 12, (120, 120))
    data = packed(np.clip(disc(120, 30).astype(float) * 0.7 + 40 + noise, 0, 255).astype(np.uint8))

    def count(**how):
        return len(read_picture(data, how=Tracing(**how)).strokes)

    assert count(shades=0, smoothing=0, detail=90) > count(shades=0, smoothing=0, detail=40)
    assert count(shades=0, smoothing=0, detail=90) > count(shades=0, smoothing=80, detail=90)
    assert count(detail=0, shades=4) > count(detail=0, shades=1)


@pytest.mark.parametrize(
    "image",
    [
        (disc(100, 25).astype(np.uint16) * 257),
        cv2.cvtColor(disc(100, 25), cv2.COLOR_GRAY2BGR),
        disc(100, 25),
    ],
)
def test_every_kind_of_png_is_read_alike(image):
    assert np.abs(read_grey(packed(image), "a").astype(int) - disc(100, 25)).max() <= 1


def test_a_large_jpeg_is_made_smaller_and_stays_what_it_is():
    small, large = disc(400, 100), disc(4000, 1000)
    one = read_picture(packed(small, ".jpg"), how=OUTLINES)
    other = read_picture(packed(large, ".jpg"), how=OUTLINES)
    assert read_grey(packed(large, ".jpg"), "a").shape == (640, 640)
    assert other.length() == pytest.approx(one.length(), rel=0.02)


def test_a_camera_held_upright_gives_an_upright_picture():
    """EXIF's orientation 6: to be turned by a quarter, clockwise."""
    image = np.full((60, 100), 255, np.uint8)
    image[:, :20] = 0  # at the left, which becomes the top
    data = packed(image, ".jpg")
    exif = (
        b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x01\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06"
        b"\x00\x00\x00\x00\x00\x00"
    )
    data = data[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + data[2:]
    grey = read_grey(data, "a")
    assert grey.shape == (100, 60)
    assert grey[5].mean() < 50 < 200 < grey[50].mean()


def test_of_too_many_lines_the_longest_are_drawn(monkeypatch):
    noise = np.where(np.random.default_rng(5).random((30, 30)) < 0.5, 255, 0).astype(np.uint8)
    image = cv2.resize(noise, (90, 90), interpolation=cv2.INTER_NEAREST)
    how = Tracing(detail=100, shades=4, smoothing=0)
    whole = read_picture(packed(image), how=how)
    monkeypatch.setattr(pictures, "MAX_STROKES", 200)
    artwork = read_picture(packed(image), how=how)
    longest = sorted(map(stroke_length, whole.strokes))[-200:]
    assert sorted(map(stroke_length, artwork.strokes)) == pytest.approx(longest)
    left = len(whole.strokes) - 200
    assert artwork.left_out == (f"The {left} shortest lines are not drawn: 200 are the most.",)
    monkeypatch.setattr(pictures, "MAX_STROKES", 10)  # fewer than there are outlines
    left = len(whole.strokes) - 10
    (told,) = read_picture(packed(image), how=how).left_out
    assert told == f"The {left} shortest lines are not drawn: 10 are the most."


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({"detail": 101}, "detail = 101: it must be from 0 to 100"),
        ({"detail": float("nan")}, "detail = nan: it must be"),
        ({"shades": 5}, "shades = 5: it must be a whole number from 0 to 4"),
        ({"smoothing": -1}, "smoothing = -1: it must be from 0 to 100"),
        ({"width": 0}, "width = 0: it must be from 0.1 to 1000"),
        ({"detail": 0, "shades": 0}, "detail = 0 and shades = 0: nothing would be drawn"),
    ],
)
def test_options_that_say_nothing_are_refused(how, told):
    with pytest.raises(BadArtwork, match=f"^{told}"):
        read_picture(packed(disc()), how=Tracing(**how))


def with_chunk(png, kind, body):
    """A PNG with one more chunk behind its head."""
    chunk = struct.pack(">I", len(body)) + kind + body
    return png[:33] + chunk + struct.pack(">I", zlib.crc32(kind + body)) + png[33:]


def test_what_a_picture_would_print_is_kept_off_the_terminal(capfd):
    profile = b"\x1b]0;mine\x07\nforged line\0\0" + zlib.compress(b"short")
    read_grey(with_chunk(packed(disc()), b"iCCP", profile), "it.png")
    cut = packed(disc(), ".jpg")
    read_grey(cut[:900] + cut[-2:], "it.jpg")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_deep_and_transparent_pictures_are_grey_in_every_row(dtype):
    most = np.iinfo(dtype).max
    image = np.zeros((600, 40, 4), dtype)
    image[..., 3] = (np.linspace(0, most, 600).astype(dtype))[:, None]  # black, ever less seen
    grey = read_grey(packed(image), "it.png")
    assert grey.shape == (600, 40)
    assert grey[:, 0] == pytest.approx(np.linspace(255, 0, 600), abs=2)


def with_exif(data, orientation, order):
    """A PNG that says how it is to be turned."""
    head = b"II*\0" if order == "<" else b"MM\0*"
    entries = ((256, 3, 1, 9), (274, 3, 1, orientation))
    exif = head + struct.pack(f"{order}IH", 8, len(entries))
    exif += b"".join(struct.pack(f"{order}HHIHxx", *entry) for entry in entries) + bytes(4)
    return with_chunk(data, b"eXIf", exif)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_png_is_turned_as_it_says(orientation, order):
    """Against Pillow, which knows EXIF."""
    image = np.full((40, 60), 255, np.uint8)
    image[3:9, 5:30], image[3:30, 5:9] = 0, 90
    data = with_exif(packed(image), orientation, order)
    wanted = np.array(ImageOps.exif_transpose(Image.open(io.BytesIO(data))))
    assert read_grey(data, "a").tolist() == wanted.tolist()


@pytest.mark.parametrize("exif", [b"", b"II*\0", b"II*\0\xff\xff\xff\xff", b"nonsense" * 9])
def test_a_png_whose_exif_is_spoilt_is_as_it_is(exif):
    image = disc(60, 20)
    data = with_chunk(packed(image), b"eXIf", exif)
    assert read_grey(data, "a").tolist() == image.tolist()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_white_on_nothing_is_seen(dtype):
    most = np.iinfo(dtype).max
    image = np.full((100, 100, 4), most, dtype)
    image[..., 3] = (255 - disc(100, 25).astype(int)) * (most // 255)
    assert np.abs(read_grey(packed(image), "a").astype(int) - disc(100, 25)).max() <= 1


def test_white_on_a_little_that_is_dark_stays_white():
    image = np.zeros((100, 100, 4), np.uint8)
    image[20:80, 20:80] = (255, 255, 255, 255)
    image[40:60, 40:60] = (0, 0, 0, 255)
    grey = read_grey(packed(image), "a")
    assert (grey[50, 50], grey[30, 30], grey[0, 0]) == (0, 255, 255)
