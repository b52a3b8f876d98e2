"""Cameras: files, folders, streams and webcams, and what they say when there is nothing to see."""

import http.server
import itertools
import os
import queue
import random
import struct
import threading

import cv2
import numpy as np
import pytest
from waiting import PATIENCE

from laptop.vision import live_cameras, recordings
from laptop.vision import webcams as webcam_module
from laptop.vision.cameras import is_live, open_camera
from laptop.vision.frames import NoCamera, bgr, quiet_decoders
from laptop.vision.live_cameras import LiveCamera
from laptop.vision.stills import Stills
from laptop.vision.webcams import webcams

FPS = 20.0
STEP = 12  # of brightness from frame to frame


def picture(number, size=(64, 48)):
    """A picture that tells its number."""
    return np.full((size[1], size[0], 3), 10 + STEP * number, np.uint8)


def number_of(image):
    return round((float(image.mean()) - 10) / STEP)


@pytest.fixture
def video(tmp_path):
    def write(frames=10, fps=FPS, name="film.avi"):
        path = tmp_path / name
        out = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), fps, (64, 48))
        for number in range(frames):
            out.write(picture(number))
        out.release()
        return path

    return write


class Clock:
    """Time that passes when somebody sleeps."""

    def __init__(self, t=100.0):
        self.t = t

    def now(self):
        return self.t

    def sleep(self, seconds):
        self.t += seconds


def everything(source):
    """Every frame of a camera that ends."""
    frames = []
    while not source.ended:
        frame = source.read(PATIENCE)
        if frame is not None:
            frames.append(frame)
    return frames


def chunks(data):
    """Where each frame's JPEG is in an AVI: (begin, end)."""
    at = data.find(b"movi")
    found = []
    while True:
        at = data.find(b"00dc", at)
        if at < 0 or data.find(b"idx1") < at:
            return found
        length = int.from_bytes(data[at + 4 : at + 8], "little")
        found.append((at + 8, at + 8 + length))
        at += 8 + length


def spoil(path, which):
    data = bytearray(path.read_bytes())
    for number in which:
        begin, end = chunks(bytes(data))[number]
        data[begin:end] = bytes(end - begin)
    path.write_bytes(bytes(data))


# A video file, as fast as wanted


def test_a_video_gives_every_frame_in_order(video):
    with open_camera(str(video())) as source:
        frames = everything(source)
    assert [number_of(frame.image) for frame in frames] == list(range(10))
    assert [frame.index for frame in frames] == list(range(10))
    assert [frame.t for frame in frames] == pytest.approx([k / FPS for k in range(10)])
    assert frames[0].image.shape == (48, 64, 3)
    assert frames[0].image.dtype == np.uint8
    assert (source.count, source.fps, source.size, source.notes) == (10, FPS, (64, 48), [])


def test_another_pace_may_be_said(video):
    with open_camera(str(video()), fps=5) as source:
        assert [frame.t for frame in everything(source)] == pytest.approx(np.arange(10) / 5)


def test_frames_that_cannot_be_read_are_left_out_and_told(video):
    path = video()
    spoil(path, [4, 7])
    with open_camera(str(path)) as source:
        frames = everything(source)
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 5, 6, 8, 9]
    assert [number_of(frame.image) for frame in frames] == [0, 1, 2, 3, 5, 6, 8, 9]
    assert [frame.t for frame in frames] == pytest.approx(
        [frame.index / FPS for frame in frames], abs=1e-3
    )
    assert source.notes == ["2 of 10 frames could not be read"]


def test_a_video_that_breaks_off_says_how_much_is_missing(video):
    path = video()
    data = path.read_bytes()
    path.write_bytes(data[: chunks(data)[6][0] + 20])
    with open_camera(str(path)) as source:
        assert len(everything(source)) == 6
    assert source.notes == ["4 of 10 frames could not be read"]


class Endless:
    """A capture whose count is a lie, and whose time stands still."""

    grabbed = 0

    def isOpened(self):  # noqa: N802
        return True

    def grab(self):
        self.grabbed += 1
        return self.grabbed <= 3

    def retrieve(self):
        return True, picture(1)

    def get(self, key):
        return {cv2.CAP_PROP_FPS: 10.0, cv2.CAP_PROP_FRAME_COUNT: 1e8}.get(key, 0.0)

    def release(self):
        pass


def test_a_file_that_promises_too_much_ends_all_the_same():
    capture = Endless()
    source = recordings.Recording("lie", capture)
    assert len(everything(source)) == 3
    assert capture.grabbed < 2000
    assert source.notes == [f"{10**8 - 3} of {10**8} frames could not be read"]


def test_time_goes_on_where_the_container_knows_none():
    times = [frame.t for frame in everything(recordings.Recording("lie", Endless()))]
    assert times == pytest.approx([0, 0.1, 0.2])


# Played live


def test_played_live_each_frame_has_the_time_at_which_it_was_due(video):
    clock = Clock()
    with open_camera(str(video()), live=True, now=clock.now, sleep=clock.sleep) as source:
        frames = []
        while not source.ended:
            frame = source.read(PATIENCE)
            if frame is not None:
                assert 0 <= clock.t - frame.t < 1e-6
                frames.append(frame)
    assert [frame.index for frame in frames] == list(range(10))
    assert [frame.t for frame in frames] == pytest.approx([100 + k / FPS for k in range(10)])


def test_played_live_the_newest_wins(video):
    clock = Clock()
    with open_camera(str(video()), live=True, now=clock.now, sleep=clock.sleep) as source:
        assert source.read(PATIENCE).index == 0
        clock.t += 0.21  # frames 1 to 4 are due
        late = source.read(PATIENCE)
        assert (late.index, number_of(late.image)) == (4, 4)
        assert late.t == pytest.approx(100 + 4 / FPS)
        assert source.read(PATIENCE).index == 5
        clock.t += 60
        assert number_of(source.read(PATIENCE).image) == 9, "the last one is shown, however late"


def test_late_frames_are_passed_over_without_making_pictures_of_them(video):
    class Counting:
        def __init__(self, *words):
            self.capture, self.grabs, self.retrieves = cv2.VideoCapture(*words), 0, 0

        def grab(self):
            self.grabs += 1
            return self.capture.grab()

        def retrieve(self):
            self.retrieves += 1
            return self.capture.retrieve()

        def __getattr__(self, name):
            return getattr(self.capture, name)

    made = []

    def make(*words):
        made.append(Counting(*words))
        return made[0]

    clock = Clock()
    with open_camera(str(video()), True, now=clock.now, sleep=clock.sleep, make=make) as source:
        source.read(PATIENCE)
        clock.t += 0.4
        source.read(PATIENCE)
    assert (made[0].grabs, made[0].retrieves) == (9, 2)


def test_a_frame_that_is_not_due_within_the_timeout_is_not_waited_for(video):
    clock = Clock()
    with open_camera(str(video()), True, now=clock.now, sleep=clock.sleep) as source:
        source.read(PATIENCE)
        assert source.read(0.02) is None
        assert clock.t == pytest.approx(100.02)
        assert source.read(0.04).index == 1


# Pictures in a folder


def test_a_folder_gives_its_pictures_in_the_order_of_their_names(tmp_path):
    for number in (0, 2, 10, 1):
        cv2.imwrite(str(tmp_path / f"shot{number}.png"), picture(number))
    (tmp_path / "notes.txt").write_text("no picture")
    with open_camera(str(tmp_path)) as source:
        frames = everything(source)
    assert [number_of(frame.image) for frame in frames] == [0, 1, 2, 10]
    assert [frame.t for frame in frames] == pytest.approx(np.arange(4) / 30)
    assert (source.count, source.size) == (4, (64, 48))
    with open_camera(str(tmp_path), fps=2) as source:
        assert [frame.t for frame in everything(source)] == [0, 0.5, 1, 1.5]


def test_any_kind_of_picture_becomes_blue_green_red(tmp_path):
    blue = picture(0)
    blue[:] = (200, 100, 50)
    alpha = np.dstack([blue, np.full((48, 64), 7, np.uint8)])
    cv2.imwrite(str(tmp_path / "1.png"), alpha)
    cv2.imwrite(str(tmp_path / "2.png"), np.full((30, 20), 90, np.uint8))
    cv2.imwrite(str(tmp_path / "3.png"), np.full((48, 64, 3), 90 << 8, np.uint16))
    cv2.imwrite(str(tmp_path / "4.JPG"), np.full((48, 64, 3), 90, np.uint8))
    with open_camera(str(tmp_path)) as source:
        images = [frame.image for frame in everything(source)]
    assert [image.shape for image in images] == [(48, 64, 3), (30, 20, 3), (48, 64, 3), (48, 64, 3)]
    assert {image.dtype for image in images} == {np.dtype(np.uint8)}
    assert images[0][5, 5].tolist() == [200, 100, 50]
    assert all(image[5, 5].tolist() == [90, 90, 90] for image in images[1:])


@pytest.mark.parametrize(
    "image",
    [
        np.full((4, 6), 90, np.uint8),
        np.full((4, 6, 1), 90, np.uint8),
        np.full((4, 6, 4), 90, np.uint8),
        np.full((4, 6), 90 << 8, np.uint16),
    ],
    ids=lambda image: str(image.shape),
)
def test_what_a_driver_hands_over_becomes_blue_green_red(image):
    made = bgr(image)
    assert (made.shape, made.dtype) == ((4, 6, 3), np.uint8)
    assert made[0, 0].tolist() == [90, 90, 90]


def test_a_broken_picture_among_others_is_told_and_says_nothing_itself(tmp_path, capfd):
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture(number))
    data = (tmp_path / "1.png").read_bytes()
    (tmp_path / "1.png").write_bytes(data[:-30])
    with quiet_decoders(), open_camera(str(tmp_path)) as source:
        frames = everything(source)
    assert [frame.index for frame in frames] == [0, 2]
    assert source.notes == ["1 of 3 frames could not be read"]
    assert capfd.readouterr().err == ""


def test_while_decoders_are_quiet_python_is_not(tmp_path):
    """In a process of its own: pytest has put something else in the place of stderr."""
    import subprocess
    import sys

    code = (
        "import os, sys\n"
        "from laptop.vision.frames import quiet_decoders\n"
        "with quiet_decoders():\n"
        "    os.write(2, b'libjpeg\\n')\n"
        "    print('ours', file=sys.stderr)\n"
        "os.write(2, b'after\\n')\n"
        "print('too', file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr == "ours\nafter\ntoo\n"


def test_a_single_picture_is_a_camera_too(tmp_path):
    cv2.imwrite(str(tmp_path / "one.jpg"), picture(3))
    with open_camera(str(tmp_path / "one.jpg")) as source:
        assert [number_of(frame.image) for frame in everything(source)] == [3]


# Single frames of a recording

LONG = 150


def film(path):
    """A video that is no row of whole pictures; each has its number in bars, black or white."""
    out = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), FPS, (64, 48))
    for number in range(LONG):
        bars = [255 * (number >> bit & 1) for bit in range(8)]
        out.write(np.repeat(np.uint8(bars), 8)[None, :, None].repeat(48, 0).repeat(3, 2))
    out.release()
    return path


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


# What gives no pictures


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda path: None, ["no camera, file or folder", "webcam's number", "synthetic"]),
        (lambda path: path.mkdir(), ["has no pictures", "png and jpg"]),
        (lambda path: path.write_bytes(b""), ["is empty"]),
        (lambda path: path.write_bytes(b"hello" * 999), ["cannot be read as a video", "mp4"]),
    ],
    ids=["nothing there", "an empty folder", "an empty file", "no video"],
)
def test_what_is_no_camera_is_said_in_one_line(tmp_path, capfd, make, says):
    path = tmp_path / "source"
    make(path)
    with pytest.raises(NoCamera) as caught:
        open_camera(str(path))
    assert all(word in str(caught.value) for word in [str(path), *says]), caught.value
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_a_broken_picture_alone(tmp_path):
    (tmp_path / "a.png").write_bytes(b"no picture")
    for source in (tmp_path, tmp_path / "a.png"):
        with pytest.raises(NoCamera, match="read"):
            open_camera(str(source))


@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_a_stream_that_nobody_sends(scheme, capfd):
    with pytest.raises(NoCamera, match=r"127.0.0.1:1/video cannot be opened"):
        open_camera(f"{scheme}://127.0.0.1:1/video")
    assert capfd.readouterr().err == ""


def test_a_file_on_a_server_is_no_live_stream():
    source = open_camera("http://somewhere/film.mp4", make=lambda *words: Endless())
    assert isinstance(source, recordings.Recording)


@pytest.mark.parametrize(
    ("source", "live"),
    [("0", True), ("/dev/video1", True), ("http://a/b", True), ("film.mp4", False), ("1a", False)],
)
def test_what_goes_on_whether_or_not_anybody_looks(source, live):
    assert is_live(source) == live


def test_only_a_webcam_is_asked_for_a_size(video):
    with pytest.raises(NoCamera, match="320x240"):
        open_camera(str(video()), size=(320, 240))


# Which webcams there are


@pytest.fixture
def system(tmp_path, monkeypatch):
    """A Linux with the nodes that the test makes."""
    monkeypatch.setattr(webcam_module, "LINUX", True)
    monkeypatch.setattr(webcam_module, "DEV", str(tmp_path / "dev"))
    monkeypatch.setattr(webcam_module, "SYSFS", str(tmp_path / "sys"))
    (tmp_path / "dev").mkdir()

    def plug(number, name, index=0):
        (tmp_path / "dev" / f"video{number}").write_text("")
        about = tmp_path / "sys" / f"video{number}"
        about.mkdir(parents=True)
        (about / "name").write_text(name + "\n")
        (about / "index").write_text(f"{index}\n")

    return plug


def refusing(*words):
    capture = FakeCapture()
    capture.opened = False
    return capture


def test_a_missing_webcam_is_told_with_those_that_exist(system):
    with pytest.raises(NoCamera, match="no camera 3: no webcam is plugged in"):
        open_camera("3", make=refusing)
    system(0, "HD Webcam")
    system(1, "HD Webcam", index=1)  # not pictures but their particulars
    system(10, "Studio Camera")
    system(2, "C920")
    assert webcams() == {0: "HD Webcam", 2: "C920", 10: "Studio Camera"}
    with pytest.raises(NoCamera, match=r"there are 0 \(HD Webcam\), 2 \(C920\), 10 \(Studio"):
        open_camera("3", make=refusing)
    with pytest.raises(NoCamera, match="camera 2 gives no pictures; end the program that uses it"):
        open_camera("/dev/video2", make=refusing)


def test_a_webcam_that_one_may_not_use(system, monkeypatch):
    system(0, "HD Webcam")
    monkeypatch.setattr(os, "access", lambda *words: False)
    with pytest.raises(NoCamera, match="you may not use .*usermod -aG video"):
        open_camera("0", make=refusing)


def test_elsewhere_the_webcams_are_found_by_trying(monkeypatch):
    monkeypatch.setattr(webcam_module, "LINUX", False)

    def make(index, *words):
        capture = FakeCapture()
        capture.opened = index in (0, 2)
        return capture

    with pytest.raises(NoCamera, match="no camera 3: there are 0, 2;"):
        open_camera("3", make=make)


# Webcams


class FakeCapture:
    """A webcam whose frames come when the test says so."""

    def __init__(self, *words, now=lambda: 0.0):
        self.words = words
        self.opened, self.released = True, threading.Event()
        self.setup = 100  # frames that come by themselves, until `begin`
        self.frames = queue.Queue()
        self.hungry, self.giving = threading.Event(), threading.Lock()
        self.settings = {
            cv2.CAP_PROP_FPS: 30.0,
            cv2.CAP_PROP_EXPOSURE: 157.0,
            cv2.CAP_PROP_GAIN: 20.0,
            cv2.CAP_PROP_WB_TEMPERATURE: 4600.0,
            cv2.CAP_PROP_FOCUS: -1.0,
        }
        self.refused = set()
        self.asked = []
        self.image = picture(5)
        self.stamp = 0.0
        self.begun = False

    def isOpened(self):  # noqa: N802
        return self.opened

    def set(self, key, value):
        self.asked.append((key, value))
        if key in self.refused or self.settings.get(key) == -1:
            return False
        self.settings[key] = value
        return True

    def get(self, key):
        if key == cv2.CAP_PROP_POS_MSEC:
            return 1000 * self.stamp
        return self.settings.get(key, 0.0)

    def grab(self):
        if not self.begun:
            return True
        with self.giving:  # or it would be hungry between two frames of one gift
            if self.frames.empty():
                self.hungry.set()
        item = self.frames.get(timeout=PATIENCE)
        self.hungry.clear()
        if item is None:
            return False
        self.image, self.stamp = item
        return True

    def retrieve(self):
        return self.image is not None, self.image

    def release(self):
        self.released.set()

    def give(self, *numbers, stamp=0.0):
        """Let frames come, and wait until they have all been taken."""
        self.hungry.wait(PATIENCE)
        with self.giving:
            self.hungry.clear()
            for number in numbers:
                self.frames.put((None if number is None else picture(number), stamp))
        assert self.hungry.wait(PATIENCE)


@pytest.fixture
def webcam(monkeypatch):
    """Opens a webcam on FakeCaptures; ends them all."""
    monkeypatch.setattr(webcam_module, "LINUX", True)
    monkeypatch.setattr(webcam_module, "SETTLING_FRAMES", 3)
    monkeypatch.setattr(webcam_module.Webcam, "stamps", True)
    opened, made = [], []

    def plug(prepare=lambda capture: None, now=lambda: 50.0, **options):
        def make(*words):
            capture = FakeCapture(*words)
            prepare(capture)
            made.append(capture)
            return capture

        real = webcam_module.Webcam.open

        def open_and_begin(self):
            capture = real(self)
            capture.begun = True
            return capture

        monkeypatch.setattr(webcam_module.Webcam, "open", open_and_begin)
        source = open_camera("2", make=make, now=now, **options)
        opened.append(source)
        return source, made

    yield plug
    for source in opened:
        for capture in made:
            capture.frames.put(None)
        source._closing.set()
        for capture in made:
            capture.frames.put(None)
        source.close()


def test_a_webcam_is_asked_in_the_right_order(webcam):
    source, (capture,) = webcam(size=(1280, 720), fps=60)
    assert capture.words == (2, cv2.CAP_V4L2)
    assert capture.asked[:5] == [
        (cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG")),
        (cv2.CAP_PROP_FRAME_WIDTH, 1280),
        (cv2.CAP_PROP_FRAME_HEIGHT, 720),
        (cv2.CAP_PROP_FPS, 60),
        (cv2.CAP_PROP_BUFFERSIZE, 1),
    ]
    modes = [value for key, value in capture.asked if key == cv2.CAP_PROP_AUTO_EXPOSURE]
    assert modes == [3, 1], "automatic while it settles, then by hand"
    assert (cv2.CAP_PROP_AUTO_WB, 0) in capture.asked
    assert source.notes == [
        "1280x720 at 60 fps MJPG",
        "exposure locked at 157",
        "gain locked at 20",
        "white balance locked at 4600",
    ]


def test_a_broken_picture_while_it_settles_does_no_harm(webcam):
    def broken(capture):
        def retrieve():
            if capture.begun:
                return True, capture.image
            raise cv2.error("a picture that came in pieces")

        capture.retrieve = retrieve

    source, (capture,) = webcam(broken)
    capture.give(3)
    assert number_of(source.read(PATIENCE).image) == 3


def test_what_a_webcam_will_not_do_is_said(webcam):
    def stubborn(capture):
        capture.refused = {cv2.CAP_PROP_AUTO_EXPOSURE, cv2.CAP_PROP_WB_TEMPERATURE, 3, 5}

    source, _ = webcam(stubborn)
    assert "(asked for 640x480 at 60 fps)" in source.notes[0]
    assert "exposure cannot be locked (answers 157)" in source.notes
    assert "white balance cannot be locked (answers 4600)" in source.notes
    assert source.fps == 30


def test_a_lock_that_makes_it_dark_is_said(webcam):
    def darkens(capture):
        plain = capture.set

        def darkening(key, value):
            if (key, value) == (cv2.CAP_PROP_AUTO_EXPOSURE, 1):
                capture.image = picture(0)
            return plain(key, value)

        capture.set = darkening

    source, _ = webcam(darkens)
    assert any("changed the brightness from 70 to 10" in note for note in source.notes)


def test_the_newest_frame_wins(webcam):
    source, (capture,) = webcam()
    capture.give(1, 2, 3)
    frame = source.read(PATIENCE)
    assert (frame.index, number_of(frame.image)) == (2, 3)
    assert source.read(0) is None, "no frame is given twice"
    capture.give(4)
    assert source.read(PATIENCE).index == 3


def test_a_frame_that_comes_while_somebody_waits_is_given_at_once(webcam):
    source, (capture,) = webcam()
    got = []
    reader = threading.Thread(target=lambda: got.append(source.read(PATIENCE)))
    reader.start()
    capture.give(7)
    reader.join(PATIENCE)
    assert number_of(got[0].image) == 7


@pytest.mark.parametrize(
    ("stamp", "t"),
    [(49.98, 49.98), (50.0, 50.0), (49.4, 50.0), (50.01, 50.0), (0.0, 50.0)],
    ids=["just now", "now", "too old", "from the future", "none"],
)
def test_the_drivers_time_stamp_is_believed_only_if_it_can_be_true(webcam, stamp, t):
    source, (capture,) = webcam()
    capture.give(1, stamp=stamp)
    assert source.read(PATIENCE).t == pytest.approx(t)
    told = "time stamps from the driver" in source.notes
    assert told == (stamp in (49.98, 50.0))


def test_a_picture_that_lay_in_the_driver_for_long_is_not_taken_for_a_new_one(webcam):
    source, (capture,) = webcam()
    capture.give(1, stamp=49.99)
    assert source.read(PATIENCE).t == pytest.approx(49.99)
    capture.give(2, stamp=48.0)  # the program stood still, or was suspended
    assert source.read(PATIENCE).t == pytest.approx(48.0)
    assert "time stamps from the driver" in source.notes


def test_a_webcam_that_came_back_without_time_stamps_is_noticed(webcam, monkeypatch):
    monkeypatch.setattr(live_cameras, "REOPEN_SCHEDULE", (0.0, 0.0, 60.0))
    source, made = webcam()
    made[0].give(1, stamp=49.99)
    assert source.read(PATIENCE).t == pytest.approx(49.99)
    made[0].frames.put(None)
    while len(made) < 2 or not made[1].begun:
        assert not source.ended
    made[1].give(2, stamp=0.0)
    assert source.read(PATIENCE).t == 50.0


def test_a_frame_that_cannot_be_read_is_passed_over_and_counted(webcam):
    source, (capture,) = webcam()
    capture.give(1, None, None)
    assert source.read(PATIENCE).index == 0
    capture.give(4)
    assert source.read(PATIENCE).index == 3
    assert "2 frames could not be read" in source.notes


def test_a_webcam_that_dies_is_opened_again(webcam, monkeypatch):
    monkeypatch.setattr(live_cameras, "REOPEN_SCHEDULE", (0.0, 0.0, 60.0))
    source, made = webcam()
    made[0].give(1)
    assert source.read(PATIENCE).index == 0
    made[0].frames.put(None)
    assert made[0].released.wait(PATIENCE)
    while len(made) < 2 or not made[1].begun:
        assert not source.ended
    made[1].give(8)
    frame = source.read(PATIENCE)
    assert (frame.index, number_of(frame.image)) == (1, 8)
    assert source.why == ""
    modes = [value for key, value in made[1].asked if key == cv2.CAP_PROP_AUTO_EXPOSURE]
    assert modes == [1], "locked as it was, for the colours were learned so"


def test_a_webcam_that_does_not_come_back_is_given_up(webcam, monkeypatch):
    monkeypatch.setattr(live_cameras, "REOPEN_SCHEDULE", (0.0, 0.0, 60.0))
    times = itertools.chain([50.0] * 10, itertools.count(50.0, 10.0))
    here = []

    def gone(capture):
        capture.opened = not here
        here.append(capture)

    source, made = webcam(gone, now=lambda: next(times))
    made[0].frames.put(None)
    assert source.read(PATIENCE) is None
    assert source.ended
    assert source.why == "camera 2 stopped giving pictures and did not come back"
    assert len(made) >= 3


def test_closing_does_not_wait_for_a_driver_that_hangs(webcam, monkeypatch):
    source, (capture,) = webcam()
    assert capture.hungry.wait(PATIENCE)
    monkeypatch.setattr(source._thread, "join", lambda timeout: None)
    source.close()
    assert source.ended
    assert source.read(PATIENCE) is None, "whoever reads is told at once"
    assert not capture.released.is_set(), "a capture that is being read is not released"
    capture.frames.put(None)
    assert capture.released.wait(PATIENCE)


# A network stream


@pytest.fixture
def stream():
    """Serves MJPEG; every connection gets as many frames as `lengths` says, the last for ever."""
    lengths = []
    going = threading.Event()
    going.set()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):  # noqa: N802
            length = lengths.pop(0) if lengths else 0
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
            self.end_headers()
            try:
                for number in range(length):
                    jpeg = cv2.imencode(".jpg", picture(number))[1].tobytes()
                    self.wfile.write(
                        b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n"
                        % (len(jpeg), jpeg)
                    )
            except OSError:
                return  # nobody looks any more

        def log_message(self, *words):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/video", lengths
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_stream_is_live_and_opened_again_when_it_ends(stream, monkeypatch, capfd):
    monkeypatch.setattr(live_cameras, "REOPEN_SCHEDULE", (0.0, 0.0, 20.0))
    url, lengths = stream
    lengths += [12, 12]
    source = open_camera(url)
    assert isinstance(source, LiveCamera)
    assert source.size == (64, 48)
    assert "when it arrived" in source.notes[0]
    newest = -1
    with source:
        while newest < 15:  # more than one connection gives
            frame = source.read(PATIENCE)
            assert frame is not None, source.why
            assert frame.index > newest
            newest = frame.index
    assert source.ended
    assert capfd.readouterr().err == ""


def test_an_empty_name_is_not_the_folder_we_stand_in(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("a.png", np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(NoCamera, match="no camera, file or folder ''"):
        open_camera("")
