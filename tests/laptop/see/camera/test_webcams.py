"""Webcams: which there are, and how one is set up and locked."""

import os

import cv2
import pytest
from captures import FakeCapture
from numbered_frames import number_of, picture
from own_python import python
from waiting import PATIENCE

from laptop.see.camera import webcams as webcam_module
from laptop.see.camera.cameras import open_camera
from laptop.see.camera.frames import NoCamera
from laptop.see.camera.webcams import webcams

# Which there are


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


# How one is set up


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


# What OpenCV reads from the environment


@pytest.mark.parametrize(
    ("system", "own", "there"),
    [("nt", None, "0"), ("nt", "1", "1"), ("posix", None, None), ("posix", "1", "1")],
)
def test_on_windows_a_webcam_is_opened_without_trying_hardware_for_long(system, own, there):
    """It is set before OpenCV is there, which on Windows keeps the environment that it found."""
    name = "OPENCV_VIDEOIO_MSMF_ENABLE_HW_TRANSFORMS"
    code = (
        "import os, sys\n"
        f"os.name = {system!r}\n"
        "import laptop\n"
        f"print(os.environ.get({name!r}), os.environ['OPENCV_LOG_LEVEL'], 'cv2' in sys.modules)\n"
    )
    environment = {key: value for key, value in os.environ.items() if "OPENCV" not in key}
    if own is not None:
        environment[name] = own
    done = python("-c", code, env=environment)
    assert done.stdout.split() == [str(there), "SILENT", "False"], done.stderr
