"""Cameras that go on whether or not anybody looks: the newest frame, and coming back."""

import base64
import contextlib
import http.server
import itertools
import threading

import cv2
import pytest
from numbered_frames import number_of, picture
from waiting import PATIENCE

from laptop.see.camera import live_cameras
from laptop.see.camera.cameras import open_camera
from laptop.see.camera.frames import NoCamera
from laptop.see.camera.live_cameras import LiveCamera
from laptop.see.camera.stream_faults import why_no_stream

# A webcam


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
    reported = "time stamps from the driver" in source.notes
    assert reported == (stamp in (49.98, 50.0))


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


@contextlib.contextmanager
def serving(answer):
    """The port of a server that answers whoever asks by `answer`, which takes the handler."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):  # noqa: N802
            answer(self)

        def log_message(self, *words):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield server.server_port
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def stream():
    """Serves MJPEG; every connection gets as many frames as `lengths` says, and then none."""
    lengths = []

    def answer(handler):
        length = lengths.pop(0) if lengths else 0
        handler.send_response(200)
        handler.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        handler.end_headers()
        with contextlib.suppress(OSError):  # nobody looks any more
            for number in range(length):
                jpeg = cv2.imencode(".jpg", picture(number))[1].tobytes()
                handler.wfile.write(
                    b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n"
                    % (len(jpeg), jpeg)
                )

    with serving(answer) as port:
        yield f"http://127.0.0.1:{port}/video", lengths


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


@pytest.fixture
def answering():
    """Answers as it is told to: status and type; or hangs up."""
    answers, asked = [], []

    def answer(handler):
        asked.append(handler.headers.get("Authorization"))
        status, kind = answers[0]
        if status is None:
            return
        handler.send_response(status)
        if status == 401:
            handler.send_header("WWW-Authenticate", 'Basic realm="camera"')
        handler.send_header("Content-Type", kind)
        handler.end_headers()
        handler.wfile.write(b"<html><title>A camera</title></html>")

    with serving(answer) as port:
        yield port, answers, asked


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        ((404, "text/html"), "answers 404: it has nothing at this address"),
        ((401, "text/html"), "write http://NAME:PASSWORD@HOST"),
        ((403, "text/html"), "answers 403: it refuses this computer"),
        ((500, "text/html"), "answers 500: it fails; check the address"),
        ((200, "text/html"), "gives a page (text/html), and no video"),
        ((200, "application/json"), "gives application/json, which is no video"),
        ((None, ""), "cannot be opened within"),
    ],
)
def test_what_gives_no_stream_says_why(answering, answer, why):
    port, answers, _ = answering
    answers.append(answer)
    with pytest.raises(NoCamera) as refused:
        open_camera(f"http://127.0.0.1:{port}/video")
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_name_and_a_password_are_given(answering):
    port, answers, asked = answering
    answers.append((401, "text/html"))
    assert "refuses yours" in why_no_stream(f"http://me:s%20t@127.0.0.1:{port}/video")
    assert asked == ["Basic " + base64.b64encode(b"me:s t").decode()]


def test_an_address_that_is_none_of_http_is_not_asked():
    assert why_no_stream("rtsp://127.0.0.1/video") == ""
    assert why_no_stream("http:///video") == ""
