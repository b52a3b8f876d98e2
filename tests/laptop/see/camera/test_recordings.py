"""Videos and pictures as cameras: in order, at any pace, and with what cannot be read."""

import os

import cv2
import numpy as np
import pytest
from captures import EndlessCapture
from clocks import FakeClock
from hostile_files import jpeg_of, png_of
from marker_views import marker_frame
from numbered_frames import FPS, everything, number_of, picture, write_film
from waiting import PATIENCE

from laptop.see.camera import recordings
from laptop.see.camera.cameras import open_camera
from laptop.see.camera.frames import NoCamera
from laptop.see.markers.markers import read_spec
from laptop.see.markers.tracker import Tracker
from laptop.system.decoders import quiet_decoders


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


def lose(path, which, index=True):
    """Overwrite some frames in a row, with their headers; or take the index away, too."""
    data = bytearray(path.read_bytes())
    places = chunks(bytes(data))
    begin, end = places[which[0]][0] - 8, places[which[-1]][1]
    data[begin:end] = bytes(end - begin)
    if not index:
        del data[data.rindex(b"idx1") :]
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


@pytest.mark.parametrize("live", [False, True])
def test_frames_that_are_lost_leave_a_gap_in_numbers_and_times(video, live):
    """A decoder passes over them without a word."""
    path, clock = video(), FakeClock(50.0)
    lose(path, range(3, 6))
    with open_camera(str(path), live=live, now=clock.now, sleep=clock.sleep) as source:
        frames = everything(source)
    there = [0, 1, 2, 6, 7, 8, 9]
    assert [number_of(frame.image) for frame in frames] == there
    assert [frame.index for frame in frames] == there
    began = 50.0 if live else 0.0
    assert [frame.t - began for frame in frames] == pytest.approx([k / FPS for k in there])
    assert source.notes == ["3 of 10 frames could not be read"]


def test_where_the_file_does_not_tell_which_are_lost_it_is_said(video):
    path = video()
    lose(path, range(3, 6), index=False)
    with open_camera(str(path)) as source:
        frames = everything(source)
    assert [number_of(frame.image) for frame in frames] == [0, 1, 2, 6, 7, 8, 9]
    (note,) = source.notes
    assert note.startswith("3 of 10 frames could not be read; the file does not tell which")
    assert note.endswith("may be too small, by up to 3 frames or 0.15 s")


def test_frames_that_are_lost_at_the_end_are_counted(video):
    path = video()
    lose(path, range(7, 10))
    with open_camera(str(path)) as source:
        assert [frame.index for frame in everything(source)] == list(range(7))
        assert source.notes == ["3 of 10 frames could not be read"]


def test_an_index_that_is_wrong_itself_is_not_gone_by(video):
    path = video()
    data = bytearray(path.read_bytes())
    for entry in range(4):  # the offsets of the first entries but one
        at = data.rindex(b"idx1") + 8 + 16 * (1 + 2 * entry) + 8
        data[at : at + 4] = b"\0\0\0\0"
    data[at + 32 : at + 36] = b"\0\0\0\0"
    path.write_bytes(bytes(data))
    with open_camera(str(path)) as source:
        assert [frame.index for frame in everything(source)] == list(range(10))
        assert source.notes == []


def test_half_an_mp4_is_called_cut_off(tmp_path):
    path = write_film(tmp_path / "film.mp4", map(picture, range(10)), "mp4v")
    whole = path.read_bytes()
    with open_camera(str(path)) as source:
        assert len(everything(source)) == 10
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(NoCamera, match=r"film.mp4 is cut off \(it ends after \d+ of at least \d+"):
        open_camera(str(path))
    path.write_bytes(whole[: whole.index(b"moov") - 4])
    with pytest.raises(NoCamera, match="film.mp4 is cut off: its table of frames"):
        open_camera(str(path))


def test_a_text_that_is_called_a_film_is_called_a_text(tmp_path):
    path = tmp_path / "film.mp4"
    path.write_text("no film\n" * 1000)
    with pytest.raises(NoCamera, match="film.mp4 cannot be read as a video: it is a text"):
        open_camera(str(path))


class Undecodable:
    """A film that opens, and of which OpenCV knows the codec, but has no decoder."""

    def __init__(self, codec):
        self.codec = codec

    def isOpened(self):  # noqa: N802
        return True

    def grab(self):
        return False

    def get(self, key):
        return float(cv2.VideoWriter.fourcc(*self.codec)) if key == cv2.CAP_PROP_FOURCC else 60.0

    def release(self):
        pass


@pytest.mark.parametrize(
    ("codec", "why"),
    [
        ("AV01", "is a film in AV1, which this OpenCV cannot decode; convert it, for example: ffm"),
        ("hev1", "is a film of the codec hev1 of which no frame can be decoded: it is damaged, or"),
    ],
)
def test_a_film_that_cannot_be_decoded_is_refused_with_what_to_do(tmp_path, codec, why):
    """It opened, had 60 frames of which none could be read, and ended with status 0."""
    path = tmp_path / "film.mp4"
    path.write_bytes(b"not looked at here")
    with pytest.raises(NoCamera) as refused:
        open_camera(str(path), make=lambda *args: Undecodable(codec))
    assert why in str(refused.value)


def test_a_film_all_of_which_is_spoilt_is_refused(video):
    path = video(5)
    spoil(path, range(5))
    with pytest.raises(NoCamera, match="of the codec MJPG of which no frame can be decoded"):
        open_camera(str(path))


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
    (note,) = source.notes
    assert note.startswith("4 of 10 frames could not be read: the file is cut off (it ends after ")


def test_a_file_that_promises_too_much_ends_all_the_same():
    capture = EndlessCapture()
    source = recordings.Recording("lie", capture)
    assert len(everything(source)) == 3
    assert capture.grabbed < 2000
    assert source.notes == [f"{10**8 - 3} of {10**8} frames could not be read"]


def test_time_goes_on_where_the_container_knows_none():
    times = [frame.t for frame in everything(recordings.Recording("lie", EndlessCapture()))]
    assert times == pytest.approx([0, 0.1, 0.2])


# Where its colours are


def discs(path, size):
    """A film of a red disc near the lower edge, and where that is; OpenCV's own writer takes any
    size."""
    made = cv2.VideoWriter.fourcc(*"MJPG")
    out = cv2.VideoWriter(str(path), cv2.CAP_OPENCV_MJPEG, made, FPS, size)
    out.set(cv2.VIDEOWRITER_PROP_QUALITY, 98)
    places = [(70.3 + 1.7 * k, 0.8 * size[1] + 0.6 * k) for k in range(8)]
    for k, (u, v) in enumerate(places):
        out.write(marker_frame("disc", u, v, 12, size=size, noise=1, seed=k))
    out.release()
    return places


@pytest.mark.parametrize(("size", "off"), [((160, 120), 0), ((160, 121), -0.3), ((161, 120), 0)])
def test_of_an_odd_height_it_is_said_that_colours_are_too_high(tmp_path, size, off):
    places = discs(tmp_path / "film.avi", size)
    tracker = Tracker([read_spec("effector", "red")])
    with open_camera(str(tmp_path / "film.avi")) as source:
        notes = source.notes
        seen = [tracker.find(frame.image, frame.t)["effector"] for frame in everything(source)]
        assert source.notes == notes
    assert np.mean([s.v - v for s, (_, v) in zip(seen, places, strict=True)]) == pytest.approx(
        off, abs=0.1
    )
    if not off:
        assert notes == []
    else:
        (note,) = notes
        assert note.startswith("its height of 121 px is odd: colours lie up to half a pixel too hi")
        assert note.endswith("ffmpeg -i FILE -vf crop=160:120:0:0 NEW.mp4")


def test_a_film_with_colours_of_full_height_may_have_an_odd_one(tmp_path):
    path = tmp_path / "film.mkv"
    out = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"FFV1"), FPS, (64, 48))
    out.write(picture(1))
    out.release()

    class Higher:
        def __init__(self, *args):
            self.capture = cv2.VideoCapture(*args)

        def get(self, key):
            return self.capture.get(key) + (key == cv2.CAP_PROP_FRAME_HEIGHT)

        def __getattr__(self, name):
            return getattr(self.capture, name)

    with open_camera(str(path), make=Higher) as source:
        assert source.size == (64, 49)
        assert source.notes == []


# Played live


def test_played_live_each_frame_has_the_time_at_which_it_was_due(video):
    clock = FakeClock()
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
    clock = FakeClock()
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
        def __init__(self, *args):
            self.capture, self.grabs, self.retrieves = cv2.VideoCapture(*args), 0, 0

        def grab(self):
            self.grabs += 1
            return self.capture.grab()

        def retrieve(self):
            self.retrieves += 1
            return self.capture.retrieve()

        def __getattr__(self, name):
            return getattr(self.capture, name)

    made = []

    def make(*args):
        made.append(Counting(*args))
        return made[-1]

    clock = FakeClock()
    with open_camera(str(video()), True, now=clock.now, sleep=clock.sleep, make=make) as source:
        source.read(PATIENCE)
        clock.t += 0.4
        source.read(PATIENCE)
    assert (made[-1].grabs, made[-1].retrieves) == (9, 2)


def test_a_frame_that_is_not_due_within_the_timeout_is_not_waited_for(video):
    clock = FakeClock()
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


def test_a_broken_picture_among_others_is_told_and_says_nothing_itself(tmp_path, capfd):
    for number in range(3):
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture(number))
    data = (tmp_path / "1.png").read_bytes()
    (tmp_path / "1.png").write_bytes(data[:-30])
    with quiet_decoders(), open_camera(str(tmp_path)) as source:
        frames = everything(source)
    assert [frame.index for frame in frames] == [0, 2]
    assert source.notes == [
        "1 of 3 frames could not be read: 1.png (is a damaged picture, and cannot be read)"
    ]
    assert capfd.readouterr().err == ""


def test_a_single_picture_is_a_camera_too(tmp_path):
    cv2.imwrite(str(tmp_path / "one.jpg"), picture(3))
    with open_camera(str(tmp_path / "one.jpg")) as source:
        assert [number_of(frame.image) for frame in everything(source)] == [3]


def test_a_broken_picture_alone(tmp_path):
    (tmp_path / "a.png").write_bytes(b"no picture")
    for source in (tmp_path, tmp_path / "a.png"):
        with pytest.raises(NoCamera, match="is neither PNG nor JPEG"):
            open_camera(str(source))


def test_of_many_broken_pictures_three_are_named(tmp_path):
    cv2.imwrite(str(tmp_path / "0.png"), picture(0))
    for number in range(1, 6):
        (tmp_path / f"{number}.png").write_bytes(b"no picture" if number > 1 else b"")
    with open_camera(str(tmp_path)) as source:
        assert len(everything(source)) == 1
    assert source.notes == [
        "5 of 6 frames could not be read: 1.png (is empty), 2.png (is neither PNG nor JPEG), "
        "3.png (is neither PNG nor JPEG) and 2 more"
    ]


@pytest.mark.parametrize("data", [png_of(30000, 30000), jpeg_of(65500, 65500)], ids=["png", "jpeg"])
def test_a_picture_larger_than_any_cameras_is_not_decoded(tmp_path, data, monkeypatch):
    def decoded(*_):
        raise AssertionError("it is decoded")

    monkeypatch.setattr(cv2, "imdecode", decoded)
    path = tmp_path / "large.png"
    path.write_bytes(data)
    reported = (
        r"large.png claims (30000 x 30000|65500 x 65500) pixels; it may have up to 50 million"
    )
    with pytest.raises(NoCamera, match=reported):
        open_camera(str(path))
    with pytest.raises(NoCamera, match=r"of the 1 pictures .* can be read: large.png \(claims"):
        open_camera(str(tmp_path))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes, as Unix has them")
@pytest.mark.parametrize("name", ["a.png", "a.mp4"])
def test_a_pipe_is_told_and_not_waited_for(tmp_path, name):
    os.mkfifo(tmp_path / name)
    writer = os.open(tmp_path / name, os.O_RDWR)  # so nobody who opens it waits for ever
    os.write(writer, b"no picture")
    with pytest.raises(NoCamera, match=rf"{name} is a pipe, not a file; give"):
        open_camera(str(tmp_path / name))
    os.close(writer)


def test_a_pipe_among_pictures_is_passed_over(tmp_path):
    if not hasattr(os, "mkfifo"):
        pytest.skip("pipes, as Unix has them")
    cv2.imwrite(str(tmp_path / "b.png"), picture(4))
    os.mkfifo(tmp_path / "a.png")
    writer = os.open(tmp_path / "a.png", os.O_RDWR)
    os.write(writer, b"no picture")
    with open_camera(str(tmp_path)) as source:
        assert [number_of(frame.image) for frame in everything(source)] == [4]
    assert source.notes == ["1 of 2 frames could not be read: a.png (is a pipe, not a file)"]
    os.close(writer)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="devices, as Unix has them")
@pytest.mark.parametrize("link", [None, "a.avi", "a.png"])
def test_a_device_is_called_so(tmp_path, link):
    source = "/dev/zero"
    if link:
        source = str(tmp_path / link)
        os.symlink("/dev/null", source)
    with pytest.raises(NoCamera, match="is a device, not a file; give"):
        open_camera(source)
