"""`python -m laptop track`: from the camera to the CSV, the link, the status and the last line."""

import contextlib
import functools
import io
import json
import math
import os
import signal
import socket
import statistics
import subprocess
import sys

import cv2
import numpy as np
import pytest
from announced import wait_for_event
from click.testing import CliRunner
from csv_rows import rows_in
from fake_cameras import FakeCamera, frame
from numbered_frames import write_film
from own_python import python
from places import FOOTAGE, ROOT
from refusals import in_one_line
from waiting import PATIENCE

from laptop.cli.main import laptop
from laptop.cli.track import track as track_command
from laptop.emulator.scene.optics import to_srgb
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.see.camera.frames import Frame
from laptop.see.markers.kinds import COLOR_KINDS
from laptop.see.markers.markers import Marker, read_markers, read_spec, write_markers
from laptop.see.markers.tracker import Sighting
from laptop.see.markers.view import AnnotatedFrame, draw
from laptop.see.serve import setup
from laptop.see.serve import track as tracking
from laptop.see.serve.marker_selection import MarkerSelection
from laptop.see.serve.observation_csv import ObservationCsv
from laptop.see.serve.options import InvalidTrackOption, TrackOptions, read_goals
from laptop.see.serve.server import TrackingServer
from laptop.see.table.marker_offset import MarkerFit
from laptop.see.table.touch_file import TouchedArm, write_touched
from robot.motion import kinematics
from shared.arm_description import find_arm, read_arm
from shared.messages import PORT

WIDTH, HEIGHT, RADIUS = 160, 120, 10
RED, BLUE, GREEN = (30, 30, 200), (190, 70, 20), (60, 150, 30)


def place(number):
    """Where the effector is in frame number ..., px."""
    return 30.0 + 5 * number, 60.0


def picture(number, effector=RED, goal=GREEN):
    """A disc that moves, and one that stands, on grey."""
    image = np.full((4 * HEIGHT, 4 * WIDTH, 3), 130, np.uint8)
    for centre, ink in ((place(number), effector), ((120.0, 25.0), goal)):
        if ink:
            where = tuple(round(4 * (part + 0.5) - 0.5) for part in centre)
            cv2.circle(image, where, 4 * RADIUS, ink, -1, cv2.LINE_AA)
    return cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    """Nobody's own state folder is touched."""
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def video(tmp_path):
    def write(frames=12, name="film.avi", **looks):
        return write_film(tmp_path / name, (picture(number, **looks) for number in range(frames)))

    return write


@pytest.fixture
def run(tmp_path):
    """Run `track WORDS` in this process, over old files; the result of click."""

    def invoke(*args, status=0, over=("--replace",)):
        result = CliRunner().invoke(laptop, ["track", *over, *map(str, args)])
        if result.exception and not isinstance(result.exception, SystemExit):
            raise result.exception
        assert result.exit_code == status, result.output
        return result

    return invoke


# A file, as fast as it goes


def test_a_video_becomes_a_row_per_frame_and_marker(run, video, tmp_path):
    shown = run("--camera", video(), "--no-serve", "--to", tmp_path / "out.csv")
    data = (tmp_path / "out.csv").read_bytes()
    assert data.startswith(b"frame,t,marker,u,v,confidence\n0,0.000000,effector,")
    table = rows_in(tmp_path / "out.csv")
    assert [row["frame"] for row in table] == [str(k // 2) for k in range(24)]
    assert [row["marker"] for row in table] == ["effector", "goal"] * 12
    for row in table:
        wanted = place(int(row["frame"])) if row["marker"] == "effector" else (120, 25)
        assert math.dist((float(row["u"]), float(row["v"])), wanted) < 0.3
        assert float(row["t"]) == pytest.approx(int(row["frame"]) / 20, abs=1e-6)
        assert 0.5 <= float(row["confidence"]) <= 1
        assert [len(row[key].partition(".")[2]) for key in ("t", "u", "v", "confidence")] == [
            6, 3, 3, 3,
        ]  # fmt: skip
    (line,) = [line for line in shown.stdout.splitlines() if "12 of 12" in line and "eff" in line]
    assert "100.0" in line
    assert shown.stderr == ""


def test_a_lost_marker_has_no_place_and_no_confidence(run, video, tmp_path):
    film = video(goal=None)
    shown = run("--camera", film, "--no-serve", "--to", tmp_path / "out.csv").stdout
    table = [row for row in rows_in(tmp_path / "out.csv") if row["marker"] == "goal"]
    assert len(table) == 12
    assert {(row["u"], row["v"], row["confidence"]) for row in table} == {("", "", "0.000")}
    assert "nothing of this colour" in shown
    assert "0 of 12" in shown


def test_two_cameras_are_told_apart(run, video, tmp_path):
    one, two = video(3, "one.avi"), video(5, "two.avi")
    out = tmp_path / "out.csv"
    args = ["--camera", one, "--camera", two, "--goal", "1,2", "--goal", "3,4", "--to", out]
    run(*args, "--no-serve", "--to", tmp_path / "view.png")
    table = rows_in(out)
    assert list(table[0])[-1] == "camera"
    in_turn = [(row["camera"], row["frame"]) for row in table if row["marker"] == "effector"]
    assert in_turn[:4] == [("A", "0"), ("B", "0"), ("A", "1"), ("B", "1")]
    assert [camera for camera, _ in in_turn].count("B") == 5
    goals = [[*row.values()] for row in table if row["marker"] == "goal"]
    reported = {camera: [row[3:] for row in goals if row[-1] == camera] for camera in "AB"}
    assert reported["A"] == [["1.000", "2.000", "1.000", "A"]] * 3
    assert reported["B"] == [["3.000", "4.000", "1.000", "B"]] * 5
    assert (tmp_path / "view-A.png").exists()
    assert (tmp_path / "view-B.png").exists()
    first = out.read_bytes()
    run(*args, "--no-serve")
    assert out.read_bytes() == first


def test_a_colour_learned_at_the_first_camera_is_looked_for_at_all(run, video, tmp_path):
    green, red = video(3, "green.avi", effector=GREEN, goal=None), video(3, "red.avi", goal=GREEN)
    args = ["--camera", green, "--camera", red, "--pick", "effector=30,60", "--effector", "disc"]
    run(*args, "--no-serve", "--to", tmp_path / "out.csv")
    table = {(row["camera"], row["frame"]): row for row in rows_in(tmp_path / "out.csv")}
    for number in range(3):
        for camera, wanted in (("A", place(number)), ("B", (120, 25))):
            row = table[camera, str(number)]
            assert math.dist((float(row["u"]), float(row["v"])), wanted) < 0.3


@pytest.mark.parametrize(
    ("texts", "cameras", "goals"),
    [
        ([], 2, None),
        (["disc:green"], 2, "disc:green"),
        (["400,200"], 1, [(400, 200)]),
        (["A:400,200"], 1, [(400, 200)]),
        (["400,200", "300,150"], 2, [(400, 200), (300, 150)]),
        (["B:300,150", "A:400,200"], 2, [(400, 200), (300, 150)]),
    ],
)
def test_the_goal_is_one_marker_or_a_point_for_each_camera(texts, cameras, goals):
    assert read_goals(texts, cameras) == goals


def test_every_camera_is_opened_under_its_letter_and_asked_what_it_can_do(monkeypatch):
    opened = []

    def opener(*order):
        opened.append(order)
        camera = FakeCamera(frame(0, 0.0, 1))
        camera.size = (640, 480)
        return camera

    def synthetic(*order):
        return opener(*order), {"effector": "disc:red"}

    monkeypatch.setattr(setup, "open_camera", opener)
    args = ["--no-serve", "--scene", "B.tilt=60", "--frame-size", "320x240", "--fps", "20"]
    for source in ("film.avi", "synthetic", "3", "synthetic"):
        args += ["--camera", source]
    with track_command.make_context("track", args) as context:
        assert context.params.pop("simulate")
        handed_in = ("page", "page_at", "page_hold", "announce", "replace", "files", "listen_at")
        for word in (*handed_in, "arm_file"):
            del context.params[word]
        asked = TrackOptions(csv=None, picture=None, host="", port=None, **context.params)
        assert tracking.track(asked, synthetic) == 0
    assert opened == [
        ("film.avi", True, 20.0, None),
        ("B", "B.tilt=60", 20.0),
        ("3", True, 20.0, (320, 240)),
        ("D", "B.tilt=60", 20.0),
    ]


def test_frames_that_cannot_be_read_are_told(run, video, tmp_path):
    film = video()
    data = bytearray(film.read_bytes())
    begin = data.find(b"00dc", data.find(b"00dc", data.find(b"movi")) + 4) + 8
    data[begin : data.find(b"00dc", begin)] = bytes(data.find(b"00dc", begin) - begin)
    film.write_bytes(data)
    shown = run("--camera", film, "--no-serve", "--to", tmp_path / "out.csv")
    assert "11 frames, 1 of 12 " in shown.stdout
    assert "1" not in {row["frame"] for row in rows_in(tmp_path / "out.csv")}


# Which markers


def test_a_picked_colour_is_learned_used_and_kept(run, video, tmp_path, state):
    film = video(effector=GREEN)
    u, v = place(6)
    args = ["--camera", film, "--no-serve", "--to", tmp_path / "out.csv"]
    run(*args, "--pick", f"effector={u},{v}@6", "--effector", "disc")
    table = rows_in(tmp_path / "out.csv")
    assert {row["marker"] for row in table} == {"effector"}, "nobody showed a goal"
    assert [row["frame"] for row in table] == [str(k) for k in range(12)], "from the start"
    assert math.dist((float(table[0]["u"]), float(table[0]["v"])), place(0)) < 0.3
    stored = read_markers(state / "markers.ini")["effector"]
    assert stored.kind == "disc"
    assert stored.color.hue == pytest.approx(135, abs=4)

    run(*args)  # what was learned is known the next time
    again = [row for row in rows_in(tmp_path / "out.csv") if row["marker"] == "effector"]
    assert [row["u"] for row in again] == [row["u"] for row in table]


def test_what_is_gone_in_the_frames_after_a_pick_is_refused(run, video, tmp_path, state):
    """It may be a passing thing, or found in that one frame by luck."""
    plain = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    once, late = (picture(number, effector=GREEN) for number in (0, 9))
    film = write_film(tmp_path / "film.avi", [plain, once, *[plain] * 7, late])
    (u, v), (last_u, last_v) = place(0), place(9)
    args = ["--camera", film, "--no-serve", "--effector", "disc", "--pick"]
    shown = run(*args, f"effector={u},{v}@1", status=1)
    assert "of frame 1 is not found in the 5 after it (nothing of this colour)" in shown.output
    assert len(shown.output.splitlines()) == 1
    assert not (state / "markers.ini").exists()
    run(*args, f"effector={last_u},{last_v}@9")  # after the last frame there is none


def test_a_goal_that_was_asked_for_is_tracked_beside_a_picked_effector(run, video, tmp_path):
    args = ["--camera", video(effector=GREEN), "--no-serve", "--to", tmp_path / "out.csv"]
    run(*args, "--pick", "effector=30,60", "--goal", "blue")
    assert {row["marker"] for row in rows_in(tmp_path / "out.csv")} == {"effector", "goal"}


def test_a_rectangle_may_be_picked_and_the_kind_said(run, video, state):
    run("--camera", video(), "--no-serve", "--pick", "effector=22,52,38,68@0", "--effector", "ball")
    assert read_markers(state / "markers.ini")["effector"].kind == "ball"


def test_what_is_learned_stays_beside_what_was_known(run, video, state):
    write_markers(state / "markers.ini", {"goal": read_spec("goal", "ball:pink")})
    run("--camera", video(), "--no-serve", "--pick", "effector=30,60")
    stored = read_markers(state / "markers.ini")
    assert set(stored) == {"goal", "effector"}
    assert str(stored["goal"]) == str(read_spec("goal", "ball:pink"))


def test_every_marker_of_a_file_that_is_named_is_tracked(run, video, tmp_path):
    file = tmp_path / "mine.ini"
    names = {"effector": "red", "goal": "blue", "third": "disc:yellow"}
    write_markers(file, {name: read_spec(name, spec) for name, spec in names.items()})
    run("--camera", video(), "--no-serve", "--markers", file, "--to", tmp_path / "out.csv")
    assert {row["marker"] for row in rows_in(tmp_path / "out.csv")} == set(names)


def test_a_kind_alone_changes_the_kind_of_a_known_marker(video, run, state):
    write_markers(state / "markers.ini", {"effector": read_spec("effector", "disc:red")})
    shown = run("--camera", video(), "--no-serve", "--effector", "ball").stdout
    assert "effector: ball, hue 0" in shown


def test_the_synthetic_cameras_markers_are_its_scenes_own():
    plain = MarkerSelection(
        {"effector": None, "goal": None}, [], {}, False, {"effector": "ball:pink"}
    )
    (marker,) = plain.markers(lambda pick: None)
    assert (marker.name, marker.kind) == ("effector", "ball"), "a scene without a goal has none"


def test_a_live_camera_is_picked_from_that_many_frames_after_its_start(monkeypatch):
    camera = FakeCamera(frame(0, 0.0, 1), None, frame(3, 0.3, 2), frame(6, 0.6, 3))
    assert setup._frame_of(camera, 4).index == 6
    with pytest.raises(InvalidTrackOption, match="frame 9 is beyond the end of fake"):
        setup._frame_of(camera, 9)
    monkeypatch.setattr(setup, "FIRST_FRAME_TIMEOUT", 0.0)
    with pytest.raises(InvalidTrackOption, match="fake gives no picture within 0 s"):
        setup._frame_of(FakeCamera(after=lambda timeout: None), 0)


# What is refused, before anything starts


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--camera", "nowhere.mp4"], ["nowhere.mp4", "webcam's number"]),
        (["--effector", "mauve"], ["mauve", "disc:COLOUR"]),
        (["--effector", "ball"], ["ball:green", "--pick effector=U,V"]),
        (["--goal", "160,10"], ["160,10", "outside", "159"]),
        (["--goal", "10,10", "--goal", "20,20"], ["10,10 20,20", "one point"]),
        (["--goal", "red", "--goal", "blue"], ["blue", "once"]),
        (["--goal", "B:10,10"], ["B:10,10", "one point"]),
        (["--camera", "5", "--camera", "/dev/video5"], ["camera 5 is given twice"]),
        (["--camera", "rtsp://a/b", "--camera", "rtsp://a/b"], ["rtsp://a/b is given twice"]),
        (
            ["--camera", "5", "--goal", "1,1", "--goal", "A:2,2"],
            ["one point for each of the 2 cameras", "--goal A:U,V --goal B:U,V"],
        ),
        (["--goal", "nan,1"], ["nan,1"]),
        (["--pick", "effector=160,10@0"], ["160,10", "outside", "159"]),
        (["--pick", "effector=10,10@12"], ["12", "film.avi", "0 to 11"]),
        (["--pick", "effector=10,10@x"], ["'x'", "whole number"]),
        (["--pick", "effector=10"], ["effector=10", "NAME=U,V@FRAME"]),
        (["--pick", "effector"], ["NAME=U,V@FRAME"]),
        (["--pick", "tip=30,60"], ["tip", "effector, goal"]),
        (["--pick", "effector=30,60", "--pick", "effector=30,60"], ["twice"]),
        (["--pick", "effector=30,60", "--effector", "red"], ["red", " or ".join(COLOR_KINDS)]),
        (["--pick", "effector=70,110"], ["no colour", "70,110"]),
        (["--markers", "nofile.ini"], ["nofile.ini", "--pick"]),
        (["--to", "no/folder/out.csv"], ["no/folder/out.csv", "no folder no/folder"]),
        (["--to", "view.gif"], ["view.gif", ".png or .jpg"]),
        (["--to", "no/folder/view.png"], ["no/folder"]),
        (["--to", "view.png@12"], ["12", "0 to 11"]),
        (["--scene", "seed=1"], ["seed=1", "synthetic"]),
        (
            ["--camera", "synthetic", "--scene", "seed=1,A.tilt=9"],
            ["no synthetic camera is A", "there is B"],
        ),
        (["--frame-size", "big"], ["big", "640x480"]),
        (["--frame-size", "640x480"], ["only a webcam"]),
        (["--listen-port", "70000"], ["70000", "65535"]),
        (["--fps", "0"], ["0"]),
        (["--camera", "x"] * 8, ["9 cameras", "8"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_what_cannot_be_done_is_refused_in_one_line(run, video, state, args, says, tmp_path):
    out = tmp_path / "out.csv"
    out.write_text("of an earlier run\n")
    csv_first = [] if "--to" in args else ["--to", out]
    film = [] if args[:2] == ["--camera", "nowhere.mp4"] else ["--camera", video()]
    given = ["--no-serve", "--replace", *csv_first, *film, *args]
    result = CliRunner().invoke(laptop, ["track", *map(str, given)], prog_name="laptop")
    assert result.exit_code in (1, 2)
    last = result.stderr.strip().splitlines()[-1]
    assert "Traceback" not in result.output
    assert all(word in last for word in says), last
    assert result.stdout == ""
    assert out.read_text() == "of an earlier run\n"
    assert not (state / "markers.ini").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[effector]\nhue = red\n", ["markers.ini", "effector", "hue", "red", "0 to 360"]),
        ("nonsense", ["markers.ini"]),
    ],
)
def test_a_markers_file_with_a_wrong_value(run, video, state, text, says):
    state.mkdir()
    (state / "markers.ini").write_text(text)
    shown = run("--camera", video(), "--no-serve", status=1)
    assert in_one_line(shown.stderr, *says)


def test_a_name_that_does_not_fit_a_message(run, video, tmp_path):
    file = tmp_path / "mine.ini"
    write_markers(file, {"my marker": Marker("my marker", "aruco", id=1)})
    shown = run("--camera", video(), "--no-serve", "--markers", file, status=1)
    assert in_one_line(shown.stderr, "my marker", "A-Z")


def test_where_markers_cannot_be_kept_the_old_sheet_stays(run, video, tmp_path):
    (tmp_path / "out.csv").write_text("old")
    (tmp_path / "file").touch()
    args = ["--camera", video(), "--no-serve", "--to", tmp_path / "out.csv"]
    args += ["--pick", "effector=30,60", "--markers", tmp_path / "file" / "markers.ini"]
    shown = run(*args, status=1)
    assert in_one_line(shown.stderr, "cannot write", "markers.ini")
    assert (tmp_path / "out.csv").read_text() == "old"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full to stand for a full disk")
def test_a_full_disk_at_the_start(run, video, tmp_path, monkeypatch):
    full = functools.partial(io.open, "/dev/full", "w")
    monkeypatch.setattr("pathlib.Path.open", lambda *_, **args: full())
    file = tmp_path / "out.csv"
    shown = run("--camera", video(), "--no-serve", "--to", file, status=1)
    assert in_one_line(shown.stderr, "out.csv", "No space left", "make room", "--to")


def test_a_file_that_is_there_is_not_written_over(run, video, tmp_path):
    for name, option in (("out.csv", "--to"), ("view.png", "--to")):
        (tmp_path / name).write_text("old")
        args = ["--camera", video(), "--no-serve", option, tmp_path / name]
        shown = run(*args, status=1, over=())
        assert in_one_line(shown.stderr, name, "is there already", "--replace")
        assert (tmp_path / name).read_text() == "old"
        run(*args)
        assert (tmp_path / name).read_bytes() != b"old"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full to stand for a full disk")
def test_a_disk_that_fills_up_on_the_way_ends_it_in_one_line(run, video, monkeypatch, tmp_path):
    real = ObservationCsv.__init__

    def filled(self, file, several, placed):
        real(self, tmp_path / "out.csv", several)
        full = os.open("/dev/full", os.O_WRONLY)
        os.dup2(full, self._out.fileno())
        os.close(full)

    monkeypatch.setattr(ObservationCsv, "__init__", filled)
    shown = run("--camera", video(), "--no-serve", "--to", tmp_path / "out.csv", status=1)
    assert in_one_line(shown.stderr, "cannot write", "out.csv", "No space left", "make room")


# The view


def test_the_picture_shows_what_was_found_and_what_was_not(run, video, tmp_path):
    film = video(goal=None)
    for name, args in (("last.png", ""), ("third.png", "@3")):
        run("--camera", film, "--no-serve", "--to", f"{tmp_path / name}{args}")
    last, third = (cv2.imread(str(tmp_path / name)) for name in ("last.png", "third.png"))
    assert last.shape == (8 * HEIGHT, 8 * WIDTH, 3)
    for image, number in ((last, 11), (third, 3)):
        u, v = (8 * (part + 0.5) - 0.5 for part in place(number))
        middle = image[round(v), round(u)]
        # (OpenCV draws discs up to half a pixel larger than they are asked to be.)
        rim = max(image[round(v), round(u + 8 * RADIUS) :][:10], key=lambda pixel: pixel[1])
        assert middle.tolist() == pytest.approx((40, 240, 255), abs=6), "a cross in the middle"
        assert rim.tolist() == pytest.approx((40, 240, 255), abs=60), "and a ring around it"
        reddish = (image[-60:, :400].astype(int) @ (-1, -1, 2)) > 150
        assert reddish.sum() > 300, "what is lost is said at the bottom"


def test_a_view_bears_markers_at_and_beyond_the_edge():
    frame = Frame(3, 0.0, picture(0))
    seen = {
        "effector": Sighting(-1e9, 5.0, 0.4, 9.0),
        "goal": Sighting(159.0, 119.0, 0.4, 9.0),
        "x": Sighting(0.0, 0.0, 1.0, math.nan),
    }
    assert draw(AnnotatedFrame(frame, seen, {"goal": ""}, {})).shape == (8 * HEIGHT, 8 * WIDTH, 3)
    wide = Frame(3, 0.0, np.zeros((720, 1280, 3), np.uint8))
    assert draw(AnnotatedFrame(wide, {}, {}, {"goal": (1.0, 2.0, 1.0)})).shape == (720, 1280, 3)


# What programs are told


def test_programs_are_told_in_json_lines_and_people_beside_them(run, video):
    args = [
        "--camera",
        video(2),
        "--camera",
        video(3, "two.avi"),
        "--json",
        "--page-port",
        "0",
    ]
    shown = run(*args, "--listen-port", "127.0.0.1:0")
    events = [json.loads(line) for line in shown.stdout.splitlines()]
    cameras, serving, page, ready, end = events
    assert [event.pop("event") for event in events] == EVENTS
    assert [(camera["name"], camera["size"], camera["fps"]) for camera in cameras["cameras"]] == [
        ("A", [WIDTH, HEIGHT], 20.0),
        ("B", [WIDTH, HEIGHT], 20.0),
    ]
    assert cameras["cameras"][1]["source"].endswith("two.avi")
    assert serving["host"] == "127.0.0.1"
    place = f"127.0.0.1:{serving['port']}"
    assert serving["addresses"] == [place]
    assert f"visual_servoing.py {place}\n" in shown.stderr
    assert f"pairing code, once: {serving['code']}\n" in shown.stderr
    assert f"page: {page['url']}" in shown.stderr
    assert "token=" in page["url"]
    assert ready == {}
    assert end == {"status": 0, "reason": "every camera has ended"}
    assert "2 of 2" in shown.stderr
    TrackingServer("127.0.0.1", serving["port"], "ABCDEFGHJKMN").close()


EVENTS = ["cameras", "serving", "page", "ready", "end"]


def test_without_link_and_page_nothing_is_told_of_them(run, video):
    shown = run("--camera", video(2), "--no-serve", "--json")
    assert [json.loads(line)["event"] for line in shown.stdout.splitlines()] == [
        "cameras",
        "ready",
        "end",
    ]


def test_an_ipv6_host_is_told_without_brackets(run, video):
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        pytest.skip("no IPv6 here")
    args = ["--camera", video(2), "--json", "--no-page", "--listen-port", "::1:0"]
    serving = wait_for_event(run(*args).stdout.splitlines(), "serving")
    assert serving["host"] == "::1"
    assert serving["addresses"] == [f"[::1]:{serving['port']}"]


def test_programs_are_told_why_it_does_not_begin(run, video, tmp_path):
    (tmp_path / "out.csv").write_text("old")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        args = ["--camera", video(2), "--listen-port", f"127.0.0.1:{port}", "--json"]
        shown = run(*args, "--to", tmp_path / "out.csv", status=1)
    (end,) = [json.loads(line) for line in shown.stdout.splitlines()]
    assert (end["event"], end["status"]) == ("end", 1)
    assert f"port {port} is in use" in end["reason"]
    assert in_one_line(shown.stderr, end["reason"], "--listen-port")
    assert (tmp_path / "out.csv").read_text() == "old"


@contextlib.contextmanager
def a_tracker(*args):
    """A process that tracks what a synthetic camera sees."""
    args = "--camera", "synthetic", "--scene", "width=320,height=240,clutter=0", *args
    tracker = subprocess.Popen(
        [sys.executable, "-m", "laptop", "track", *args, "--listen-port", "0"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield tracker
    finally:
        tracker.kill()


def test_programs_are_told_of_a_signal_that_ends_it():
    with a_tracker("--no-page", "--json") as tracker:
        wait_for_event(tracker.stdout, "ready")
        tracker.send_signal(signal.SIGTERM)
        rest, error = tracker.communicate(timeout=PATIENCE)
    assert tracker.returncode == 143
    assert json.loads(rest) == {"event": "end", "status": 143, "reason": "stopped by SIGTERM"}
    assert error.endswith("laptop: stopped by SIGTERM\n")


# Real processes


def test_the_ports_number_in_the_help_is_the_servers():
    shown = CliRunner().invoke(laptop, ["track", "--help"]).output
    assert f"[default: {PORT}, at" in " ".join(shown.split())


@pytest.mark.long
def test_serving_plays_the_video_in_its_own_time_and_tells_the_brick_what_to_type(video, tmp_path):
    args = (
        "--camera",
        video(),
        "--listen-port",
        "127.0.0.1:0",
        "--to",
        tmp_path / "out.csv",
    )
    done = python("-m", "laptop", "track", *args, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, "")
    assert "robot/visual_servoing.py" in done.stdout
    assert "pairing code, once: " in done.stdout
    table = [row for row in rows_in(tmp_path / "out.csv") if row["marker"] == "effector"]
    steps = [
        (float(b["t"]) - float(a["t"])) / (int(b["frame"]) - int(a["frame"]))
        for a, b in zip(table, table[1:], strict=False)
    ]
    assert steps == pytest.approx([1 / 20] * len(steps), abs=2e-6)
    assert float(table[0]["t"]) > 1, "on the clock, not in the file"


@pytest.mark.long
def test_ctrl_c_ends_a_process_with_130_and_one_line(tmp_path):
    out = tmp_path / "out.csv"
    with a_tracker("--to", str(out)) as tracker:
        for line in tracker.stdout:  # until it says that it tracks
            if "effector" in line and "age" in line:
                break
        for _ in range(100):  # whoever is impatient
            tracker.send_signal(signal.SIGINT)
        rest, error = tracker.communicate(timeout=PATIENCE)
    assert tracker.returncode == 130
    assert error == "laptop: stopped by Ctrl-C\n"
    assert "confidence" in rest
    table = rows_in(out)
    assert {row["marker"] for row in table} == {"effector", "goal"}
    assert {row["confidence"] for row in table} != {"0.000"}


# Real footage


@pytest.mark.claims
@pytest.mark.skipif(not FOOTAGE.is_dir(), reason="the footage is not here: ../shared/footage")
def test_on_real_footage_as_in_the_readme(run, tmp_path):
    truth = json.loads((FOOTAGE / "truth.json").read_text())["annotations"]["trflorian_ball2.mp4"]
    first = truth[0]
    pick = f"effector={first['x']},{first['y']}@{first['frame']}"
    film = FOOTAGE / "trflorian_ball2.mp4"
    run("--camera", film, "--pick", pick, "--no-serve", "--to", tmp_path / "out.csv")
    table = {int(row["frame"]): row for row in rows_in(tmp_path / "out.csv")}
    assert sorted(table) == list(range(1004))
    off = [
        math.dist((float(table[k["frame"]]["u"]), float(table[k["frame"]]["v"])), (k["x"], k["y"]))
        for k in truth
        if table[k["frame"]]["u"]
    ]
    assert len(off) > len(truth) / 2
    assert statistics.median(off) <= 4
    assert float(table[24]["t"]) == pytest.approx(24 / (24000 / 1001), abs=1e-6)


# The printed board


def test_with_a_board_markers_are_told_in_cm_on_it(run, tmp_path):
    """The disc rides 2.5 cm up, and the board's middle is at 9, 0: all of it from the scene."""
    arm = read_arm(find_arm("planar"))
    q = (0.9, -0.6)
    scene = Scene(arm, read_scene("board=a4,clutter=0,shadow=0"))
    image = np.round(to_srgb(scene.image(q))).astype(np.uint8)
    for k in range(2):
        cv2.imwrite(str(tmp_path / f"{k}.png"), image)
    args = ["--camera", tmp_path, "--no-serve", "--to", tmp_path / "out.csv"]
    shown = run(*args, "--board", "--bar", 100, "--marker-height", 25)
    assert "camera A: board a4: " in shown.output
    assert "bar is 100 mm" in shown.output
    tip = kinematics.forward(arm, q)
    table = rows_in(tmp_path / "out.csv")
    assert len(table) == 4
    for row in table:
        wanted = tip if row["marker"] == "effector" else (12, -9)
        place = float(row["x"]) + 9, float(row["y"])
        assert place == pytest.approx(wanted, abs=0.06), row
    bare = run(*args)
    assert "markers in 1 view" not in bare.output
    assert "x" not in rows_in(tmp_path / "out.csv")[0]


def test_after_touching_crosses_the_pens_place_is_told_on_the_board_and_by_the_arm(run, tmp_path):
    arm = read_arm(find_arm("planar"))
    q, offset = (0.3, 0.8), np.array([0.6, -0.4])
    scene = Scene(
        arm._replace(marker_offset=tuple(offset)),
        read_scene("board=a4,clutter=0,shadow=0,board_turn=20"),
    )
    cv2.imwrite(str(tmp_path / "0.png"), np.round(to_srgb(scene.image(q))).astype(np.uint8))
    c, s = math.cos(math.radians(20)), math.sin(math.radians(20))
    to_board = np.array([[c, s], [-s, c]])
    base = to_board @ (-9.0, 0.0)  # the board's middle is at 9, 0
    fit = MarkerFit(offset, 2.5, math.radians(-20), base, 1.0, np.eye(7), 0.2)
    write_touched(tmp_path / "t.json", TouchedArm("planar", "a4", None, fit))
    args = ["--camera", tmp_path, "--no-serve", "--board", "--to", tmp_path / "out.csv"]
    run(*args, "--touched", tmp_path / "t.json")
    for row in rows_in(tmp_path / "out.csv"):
        pen = kinematics.forward(arm, q) if row["marker"] == "effector" else (12, -9)
        assert (float(row["arm_x"]), float(row["arm_y"])) == pytest.approx(pen, abs=0.06), row
        on_board = to_board @ pen + base
        assert (float(row["x"]), float(row["y"])) == pytest.approx(on_board, abs=0.06), row


def test_a_camera_that_sees_no_board_tells_pixels_and_no_cm(run, video, tmp_path):
    shown = run("--camera", video(), "--no-serve", "--board", "--to", tmp_path / "out.csv")
    assert "cm" not in shown.output
    assert {(row["x"], row["y"]) for row in rows_in(tmp_path / "out.csv")} == {("", "")}


@pytest.mark.parametrize(
    ("args", "status", "reported"),
    [
        (["--bar", "97"], 2, "--bar is of the board"),
        (["--marker-height", "25"], 2, "leave --no-serve"),
        (["--touched", "t.json"], 2, "--touched is of"),
        (["--board", "--touched", "t.json"], 1, "cannot read t.json"),
        (["--board", "--bar", "9.7"], 1, "bar 9.7 mm"),
        (["--board", "--marker-height", "-3"], 2, "-3"),
    ],
)
def test_what_is_said_of_a_board_is_checked_before_anything_starts(
    run, video, tmp_path, args, status, reported
):
    out = tmp_path / "out.csv"
    shown = run("--camera", video(), "--no-serve", "--to", out, *args, status=status)
    assert reported in shown.output
    assert not out.exists()
