"""Single frames of a recording, against those that come in order."""

import random
import struct

import cv2
import numpy as np
import pytest
from numbered_frames import everything, picture, write_film

from laptop.see.camera.cameras import open_camera
from laptop.see.camera.frames import NoCamera
from laptop.see.camera.stills import Stills

LONG = 150


def film(path):
    """A video that is no row of whole pictures; each has its number in bars, black or white."""
    bars = [[255 * (number >> bit & 1) for bit in range(8)] for number in range(LONG)]
    rows = (np.repeat(np.uint8(bar), 8)[None, :, None] for bar in bars)
    return write_film(path, (row.repeat(48, 0).repeat(3, 2) for row in rows), "mp4v")


def bars_of(image):
    return sum(1 << bit for bit in range(8) if image[24, 8 * bit + 4].mean() > 127)


def uneven(path):
    """The same pictures, but some of them much longer in sight than others, as phones film."""
    film(path)
    data = bytearray(path.read_bytes())
    at = data.rfind(b"stts") - 4  # how long each picture lasts: of all the same, here
    size, _, _, entries, count, ticks = struct.unpack(">6I", data[at : at + 24])
    assert (size, entries, count) == (24, 1, LONG)
    pace = random.Random(1)
    table = b"".join(
        struct.pack(">2I", 1, ticks * pace.choice((1, 1, 1, 2, 5, 40))) for _ in range(LONG)
    )
    for box in (b"moov", b"trak", b"mdia", b"minf", b"stbl"):
        begin = data.rfind(box, 0, at) - 4
        length = int.from_bytes(data[begin : begin + 4], "big") + len(table) - 8
        data[begin : begin + 4] = length.to_bytes(4, "big")
    data[at : at + 24] = struct.pack(">I4s2I", len(table) + 16, b"stts", 0, LONG) + table
    data = data.replace(b"edts", b"free")  # says how long it all lasts
    path.write_bytes(bytes(data))
    return path


def damaged(path):
    film(path)
    data = bytearray(path.read_bytes())
    third = len(data) // 3
    data[third : third + 2000] = bytes(2000)
    path.write_bytes(bytes(data))


def folder(path):
    path.mkdir()
    for number in range(0, 10, 2):
        cv2.imwrite(str(path / f"{number}.png"), picture(number))
    (path / "6.png").write_bytes(b"no picture")


@pytest.mark.parametrize("make", [film, uneven, damaged, folder])
def test_a_frame_by_its_index_is_the_very_one_that_comes_in_order(tmp_path, make):
    path = tmp_path / "film.mp4"
    make(path)
    with open_camera(str(path)) as source:
        frames = {frame.index: frame.image for frame in everything(source)}
    numbers = [bars_of(image) for image in frames.values()]
    assert (numbers == list(range(LONG))) == (make in (film, uneven))
    assert bool(source.unread) == (make in (damaged, folder))
    stills = Stills(str(path))
    there = sorted(frames)
    anywhere = random.Random(2).sample(there, min(40, len(there)))
    for index in [*anywhere, *there[-9:], *reversed(there[-30:]), there[0], there[0]]:
        assert np.array_equal(stills.read(index), frames[index]), index
    missing = set(range(source.count)) - set(frames)
    assert all(stills.read(index) is None for index in [*missing, source.count])
    assert np.array_equal(stills.read(there[3]), frames[there[3]])


@pytest.mark.parametrize("make", [film, uneven])
def test_to_find_a_frame_takes_few_others(tmp_path, make):
    path = make(tmp_path / "film.mp4")
    grabbed = []

    class Counted:
        def __init__(self, *words):
            self.capture = cv2.VideoCapture(*words)

        def __getattr__(self, name):
            return getattr(self.capture, name)

        def grab(self):
            grabbed.append(1)
            return self.capture.grab()

    stills = Stills(str(path), Counted)
    anywhere = random.Random(3).sample(range(LONG), 40)
    grabbed.clear()
    assert [bars_of(stills.read(index)) for index in anywhere] == anywhere
    assert len(grabbed) < 40 * LONG / 10


def test_what_gives_no_pictures_gives_no_single_ones(tmp_path):
    with pytest.raises(NoCamera, match="no camera, file or folder"):
        Stills(str(tmp_path / "film.mp4"))
