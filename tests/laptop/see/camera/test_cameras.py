"""Any camera by what people call it, and what is said when there is nothing to see."""

import cv2
import numpy as np
import pytest
from captures import EndlessCapture

from laptop.see.camera.cameras import is_live, open_camera
from laptop.see.camera.frames import NoCamera
from laptop.see.camera.recordings import Recording


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda path: None, ["no camera, file or folder", "webcam's number", "synthetic"]),
        (lambda path: path.mkdir(), ["has no pictures", "png and jpg"]),
        (lambda path: path.write_bytes(b""), ["is empty"]),
        (lambda path: path.write_bytes(b"hello" * 999), ["cannot be read as a video", "a text"]),
        (lambda path: path.write_bytes(bytes(range(256))), ["cannot be read as a video", "player"]),
    ],
    ids=["nothing there", "an empty folder", "an empty file", "a text", "no video"],
)
def test_what_is_no_camera_is_said_in_one_line(tmp_path, capfd, make, says):
    path = tmp_path / "source"
    make(path)
    with pytest.raises(NoCamera) as caught:
        open_camera(str(path))
    assert all(word in str(caught.value) for word in [str(path), *says]), caught.value
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""


def test_an_empty_name_is_not_the_folder_we_stand_in(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("a.png", np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(NoCamera, match="no camera, file or folder ''"):
        open_camera("")


@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_a_stream_that_nobody_sends(scheme, capfd):
    with pytest.raises(NoCamera, match=r"127.0.0.1:1/video cannot be opened"):
        open_camera(f"{scheme}://127.0.0.1:1/video")
    assert capfd.readouterr().err == ""


def test_a_file_on_a_server_is_no_live_stream():
    source = open_camera("http://somewhere/film.mp4", make=lambda *args: EndlessCapture())
    assert isinstance(source, Recording)


@pytest.mark.parametrize(
    ("source", "live"),
    [("0", True), ("/dev/video1", True), ("http://a/b", True), ("film.mp4", False), ("1a", False)],
)
def test_what_goes_on_whether_or_not_anybody_looks(source, live):
    assert is_live(source) == live


def test_only_a_webcam_is_asked_for_a_size(video):
    with pytest.raises(NoCamera, match="320x240"):
        open_camera(str(video()), size=(320, 240))
