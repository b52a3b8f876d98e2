"""How many frames a film has, where its file does not say so, and films that are cut off."""

import io
import struct

import cv2
import pytest
from clocks import FakeClock
from numbered_frames import FPS, everything, lengthen, number_of, picture, write_video
from rich.console import Console
from waiting import PATIENCE

from laptop.see.camera.cameras import open_camera
from laptop.see.camera.containers import how_cut_off, is_bare, states_count
from laptop.see.camera.recordings import FileFacts, Recording
from laptop.see.markers.tracker import Tracker
from laptop.see.serve.pipeline import CameraPipeline
from laptop.see.serve.status_display import StatusDisplay

CODECS = {"avi": "MJPG", "mkv": "MJPG", "mp4": "mp4v", "mov": "mp4v", "ts": "mp4v"}


@pytest.fixture
def film(tmp_path):
    """Writes ten numbered frames into a container."""

    def write(ending):
        path = tmp_path / f"film.{ending}"
        code = cv2.VideoWriter.fourcc(*CODECS[ending])
        out = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, FPS, (64, 48))
        for number in range(10):
            out.write(picture(number))
        out.release()
        return path

    return write


def trim(path, share):
    """Let an mp4 show only the first part of its frames, as a phone does that trims a film."""
    data = bytearray(path.read_bytes())
    at = data.rindex(b"elst") + 12
    (lasts,) = struct.unpack(">I", data[at : at + 4])
    data[at : at + 4] = struct.pack(">I", int(share * lasts))
    path.write_bytes(bytes(data))
    return path


@pytest.mark.parametrize(("ending", "reported"), [("avi", True), ("mp4", True), ("mov", True),
                                              ("mkv", False), ("ts", False)])  # fmt: skip
def test_some_containers_tell_how_many_frames_they_have(film, ending, reported):
    path = film(ending)
    assert states_count(path) == reported
    assert how_cut_off(path) == ""
    with open_camera(str(path)) as source:
        assert source.guessed == (not reported)
        assert len(everything(source)) == 10
        assert (source.count, source.guessed, source.notes) == (10, False, [])


@pytest.mark.parametrize("live", [False, True])
def test_a_film_that_lasts_longer_than_its_frames_has_lost_none(film, live):
    """As with sound that goes on: 10 of 30 frames "could not be read"."""
    clock = FakeClock(50.0)
    path = lengthen(film("mkv"), 3)
    with open_camera(str(path), live=live, now=clock.now, sleep=clock.sleep) as source:
        assert source.count == 30
        assert [number_of(frame.image) for frame in everything(source)] == list(range(10))
        assert (source.count, source.unread, source.notes) == (10, 0, [])
    if live:
        assert clock.t < 50 + 11 / FPS, "it is over with its last frame"


def test_a_film_that_is_longer_than_guessed_goes_on(film):
    with open_camera(str(lengthen(film("mkv"), 0.3))) as source:
        assert source.count == 3
        for frame in range(10):
            assert source.read(PATIENCE).index == frame
            assert source.count >= frame + 1
        assert everything(source) == []
        assert (source.count, source.notes) == (10, [])


def test_what_a_trimmed_mp4_does_not_show_is_not_unread(film):
    path = trim(film("mp4"), 0.6)
    assert not states_count(path)
    with open_camera(str(path)) as source:
        assert source.count == 10
        assert [number_of(frame.image) for frame in everything(source)] == list(range(6))
        assert (source.count, source.notes) == (6, [])


def test_pictures_without_a_container_have_a_pace_that_is_a_guess(tmp_path):
    path = tmp_path / "film.mjpeg"
    path.write_bytes(
        b"".join(cv2.imencode(".jpg", picture(number))[1].tobytes() for number in range(10))
    )
    with open_camera(str(path)) as source:
        assert source.notes == ["it tells no pace: 25 a second is a guess; give it as --fps"]
        assert [number_of(frame.image) for frame in everything(source)] == list(range(10))
        assert len(source.notes) == 1
    with open_camera(str(path), fps=10) as source:
        assert source.notes == []
        assert everything(source)[-1].t == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("begin", "bare"),
    [
        (b"\0\0\0\1\x67", True),
        (b"\0\0\1\x67\x64", True),
        (b"\0\0\1\xba\x44", False),
        (b"\0\0\0\x1cftyp", False),
        (b"", False),
    ],
)
def test_what_has_no_container_is_known_by_its_beginning(tmp_path, begin, bare):
    path = tmp_path / "film"
    path.write_bytes(begin)
    assert is_bare(path) == bare


class Uneven:
    """A capture whose frames are those of an even one up to some, and then every fifth."""

    def __init__(self, lost=()):
        self.times = [k / FPS for k in (*range(20), *range(20, 100, 5))]
        self.at = -1
        self.lost = list(lost)  # before which frames a step is in vain

    def grab(self):
        if self.at + 1 in self.lost:
            self.lost.remove(self.at + 1)
            return False
        self.at += 1
        return self.at < len(self.times)

    def retrieve(self):
        return True, picture(1)

    def get(self, key):
        return {
            cv2.CAP_PROP_FPS: FPS,
            cv2.CAP_PROP_FRAME_COUNT: 100.0,
            cv2.CAP_PROP_POS_MSEC: 1000 * self.times[min(self.at, len(self.times) - 1)],
        }.get(key, 0.0)

    def release(self):
        pass


def test_of_an_uneven_pace_it_is_said_what_is_odd():
    source = Recording("film", Uneven(), facts=FileFacts(guessed=True))
    assert source.notes == []
    assert len(everything(source)) == 36
    assert source.notes == [
        "36 frames in 4.8 s, where 20 a second would be 96: its pace changes, or some could not be "
        "read"
    ]
    assert (source.count, source.unread) == (36, 0)


def test_frames_that_are_lost_before_others_are_unread_however_many_there_are():
    source = Recording("film", Uneven([4, 4, 9]), fps=FPS, facts=FileFacts(guessed=True))
    assert len(everything(source)) == 36
    assert source.notes == ["3 of 39 frames could not be read"]


@pytest.mark.parametrize("ending", ["avi", "mkv"])
def test_a_film_that_is_cut_off_is_called_so(film, ending):
    path = film(ending)
    whole = path.read_bytes()
    frames = [k for k in range(len(whole)) if whole.startswith(b"\xff\xd8\xff", k)]
    path.write_bytes(whole[: frames[5]])
    cut = f"cut off (it ends after {frames[5]} of at least {len(whole)} bytes)"
    assert how_cut_off(path) == cut
    with open_camera(str(path)) as source:
        count = len(everything(source))
        assert 4 <= count <= 5
        if ending == "avi":
            reported = (
                f"{10 - count} of 10 frames could not be read: the file is {cut}; copy it again"
            )
        else:
            reported = (
                f"the file is {cut}: what comes after {count} frames could not be read; "
                "copy it again"
            )
        assert source.notes == [reported]


def test_an_mp4_with_its_table_in_front_may_be_cut_off(tmp_path):
    boxes = b"".join(
        struct.pack(">I4s", 8 + len(inside), name) + inside
        for name, inside in ((b"ftyp", b"isom"), (b"moov", bytes(20)), (b"mdat", bytes(100)))
    )
    path = tmp_path / "film.mp4"
    path.write_bytes(boxes[:-30])
    assert how_cut_off(path) == "cut off (it ends after 118 of at least 148 bytes)"
    path.write_bytes(boxes)
    assert how_cut_off(path) == ""


@pytest.mark.parametrize("ending", CODECS)
def test_whatever_is_left_of_a_file_is_looked_into_without_a_fault(film, ending):
    path = film(ending)
    whole = path.read_bytes()
    for k in range(0, len(whole), max(1, len(whole) // 200)):
        path.write_bytes(whole[:k])
        states_count(path)
        how_cut_off(path)
        data = bytearray(whole)
        data[k : k + 8] = b"\xff" * 8
        path.write_bytes(bytes(data[: len(whole)]))
        states_count(path)
        how_cut_off(path)


def bar_of(camera):
    """The progress that is shown after each frame: (what it is of, done, in all)."""
    pipeline = CameraPipeline("A", camera, Tracker([]), live=False)
    display = StatusDisplay([pipeline], None, Console(file=io.StringIO()))
    shown = []
    while not camera.ended:
        pipeline.step(PATIENCE)
        (task,) = display.bar().tasks
        shown.append((task.description, task.completed, task.total))
    return shown


@pytest.mark.parametrize("factor", [0.3, 1, 3])
def test_the_progress_ends_at_its_end_and_never_beyond(film, factor):
    shown = bar_of(open_camera(str(lengthen(film("mkv"), factor))))
    assert all(done <= total for _, done, total in shown)
    assert shown[0][0] == "tracking, in all about"
    assert shown[-1] == ("tracking", 10, 10)


def test_frames_that_cannot_be_read_are_part_of_the_progress(tmp_path):
    path = write_video(tmp_path)
    data = bytearray(path.read_bytes())
    at = data.index(b"00dc", data.index(b"00dc") + 4)
    length = int.from_bytes(data[at + 4 : at + 8], "little")
    data[at + 8 : at + 8 + length] = bytes(length)
    path.write_bytes(bytes(data))
    assert bar_of(open_camera(str(path)))[-1] == ("tracking", 10, 10)
