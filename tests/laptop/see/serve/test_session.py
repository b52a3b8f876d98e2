"""Pipelines of cameras that are made up: what is published, what is shown, and how it ends."""

import io
import os
import signal
import statistics
import threading
import time

import pytest
from csv_rows import rows_in
from fake_cameras import FakeCamera, FakeServer, FakeTracker, frame
from rich.console import Console
from waiting import PATIENCE

from laptop.see.markers.view import BoardPlace
from laptop.see.serve import session, status_display, status_text
from laptop.see.serve.detection_stats import DetectionStats
from laptop.see.serve.observation_csv import ObservationCsv, PairedPlace, TrackingInterrupted
from laptop.see.serve.pipeline import CameraPipeline, MarkerPlacers, PipelineOutputs
from laptop.see.serve.server_state import ServerState
from laptop.see.serve.session import TrackingSession
from laptop.see.serve.status_display import StatusDisplay
from laptop.see.serve.status_text import pipeline_status
from shared.messages import Status


def test_every_frame_is_published_with_its_own_time_and_number():
    server = FakeServer()
    camera = FakeCamera(frame(4, 10.5, 90), None, frame(7, 10.6, 0))
    pipeline = CameraPipeline(
        "B", camera, FakeTracker(), (5, 6), PipelineOutputs(server), now=lambda: 10.7
    )
    assert [pipeline.step(0.1) for _ in range(3)] == [True, True, True]
    assert [tuple(observation) for observation in server.sent] == [
        (4, "B", 10.5, {"effector": (90, 10.5, 0.9), "goal": (5, 6, 1.0)}),
        (7, "B", 10.6, {"effector": None, "goal": (5, 6, 1.0)}),
    ]
    assert (pipeline.frames, pipeline.dropped) == (2, 2)
    assert "effector lost: too dark, goal 5,6 (fixed), age 150 ms, 2 dropped" in pipeline_status(
        pipeline
    )
    assert not pipeline.step(0.1)
    assert pipeline_status(pipeline) == "ended, 2 frames"


def test_the_rate_is_that_of_the_last_second():
    time = [0.0]
    camera = FakeCamera(*(frame(k, k / 50, 9) for k in range(100)))
    pipeline = CameraPipeline("A", camera, FakeTracker(), now=lambda: time[0])
    rates = []
    for _ in range(100):
        pipeline.step(0)
        time[0] += 0.02 if pipeline.frames <= 50 else 0.1
        rates.append(pipeline.rate())
    assert rates[49] == pytest.approx(50, rel=0.05)
    assert rates[99] == pytest.approx(10, rel=0.05)


def test_a_tally_knows_the_median_and_the_most_usual_trouble():
    stats = DetectionStats()
    confidences = [0.2, 0.9, 0.5, 0.7, 1.0]
    for confidence in confidences:
        stats.add(confidence, "")
    for why in ("too dark", "several candidates", "too dark"):
        stats.add(None, why)
    assert (stats.seen, stats.frames) == (5, 8)
    assert stats.confidence == statistics.median(confidences)
    assert stats.lost.most_common(1) == [("too dark", 2)]


def test_a_camera_that_is_given_up_ends_it_in_one_line(tmp_path):
    camera = FakeCamera(frame(0, 0.0, 9))
    camera.why = "camera 0 stopped giving pictures and did not come back"
    out = ObservationCsv(tmp_path / "out.csv", False)
    run = TrackingSession(
        [CameraPipeline("A", camera, FakeTracker(), outputs=PipelineOutputs(csv=out))],
        out,
        None,
        silent(),
    )
    with pytest.raises(TrackingInterrupted, match="did not come back"):
        run.run()
    out.close()
    assert len(rows_in(tmp_path / "out.csv")) == 1


def silent():
    return Console(file=io.StringIO())


def pipelines_of(*cameras, **options):
    """Pipelines of cameras A, B, ..."""
    named = zip("AB", cameras, strict=True)
    return [CameraPipeline(name, camera, FakeTracker(), **options) for name, camera in named]


def test_live_cameras_do_not_wait_for_each_other():
    both = threading.Barrier(2, timeout=PATIENCE)

    def meet(timeout):
        both.wait()
        camera_a.after = camera_b.after = None

    camera_a, camera_b = FakeCamera(after=meet), FakeCamera(after=meet)
    pipelines = pipelines_of(camera_a, camera_b)
    assert TrackingSession(pipelines, None, None, silent()).run() == 0


def test_a_camera_that_hangs_keeps_no_frame_of_another_back():
    """A hangs in its very first `read` until B has given all it has."""
    over = threading.Event()
    hung = []

    def hang(timeout):
        hung.append(over.wait(PATIENCE))
        camera_a.after = None

    def end(timeout):
        camera_b.after = None
        over.set()

    server = FakeServer()
    camera_a = FakeCamera(after=hang)
    camera_b = FakeCamera(*(frame(k, 5 + k / 30, 9) for k in range(20)), after=end)
    pipelines = pipelines_of(camera_a, camera_b, outputs=PipelineOutputs(server), now=lambda: 6.0)
    assert TrackingSession(pipelines, None, None, silent()).run() == 0
    assert hung == [True]
    assert [(seen.camera, seen.t) for seen in server.sent] == [("B", 5 + k / 30) for k in range(20)]


def test_when_a_camera_is_given_up_the_other_goes_on_and_the_end_is_a_failure(monkeypatch):
    monkeypatch.setattr(session, "STATUS_PERIOD", 0.001)
    out = io.StringIO()
    deadline = time.monotonic() + PATIENCE

    def until_told(timeout):
        if "goes on" in out.getvalue() or time.monotonic() > deadline:
            camera_b.frames.append(frame(0, 0.0, 9))
            camera_b.after = None

    camera_a, camera_b = FakeCamera(frame(0, 0.0, 9)), FakeCamera(after=until_told)
    camera_a.why = "camera 0 did not come back"
    pipelines = pipelines_of(camera_a, camera_b)
    run = TrackingSession(pipelines, None, None, Console(file=out))
    with pytest.raises(TrackingInterrupted, match="^camera 0 did not come back$"):
        run.run()
    reported = [line for line in out.getvalue().splitlines() if line.startswith("camera")]
    assert reported == ["camera A: camera 0 did not come back, 1 frames; B goes on"]
    assert pipelines[1].frames == 1, "it came after A had been given up"
    assert run.display.lines() == ["A: camera 0 did not come back, 1 frames", "B: ended, 1 frames"]


def test_what_a_silent_camera_saw_last_is_not_shown_as_if_it_saw_it_now():
    time = [50.0]
    camera = FakeCamera(frame(0, 50.0, 90), frame(1, 54.0, 90), after=lambda timeout: None)
    pipeline = CameraPipeline("A", camera, FakeTracker(), now=lambda: time[0])
    pipeline.step(0)
    assert "effector 90.0" in pipeline_status(pipeline)
    time[0] += 3
    assert pipeline_status(pipeline) == "0 fps, no frame for 3 s"
    camera.fps = 0.5
    assert "effector 90.0" in pipeline_status(pipeline), "a slow one is not silent"
    camera.why = "trying again"
    assert pipeline_status(pipeline) == "0 fps, trying again"
    camera.fps, camera.why = 30.0, ""
    time[0] += 1
    pipeline.step(0)
    assert "effector 90.0" in pipeline_status(pipeline)


@pytest.mark.parametrize("by", ["closing the page", "Ctrl-C"])
def test_what_has_ended_stays_as_long_as_somebody_looks(monkeypatch, by):
    monkeypatch.setattr(session, "STATUS_PERIOD", 0.001)
    looked = []

    def has_viewers():
        looked.append(pipeline.ended)
        if by == "Ctrl-C" and len(looked) == 5:
            os.kill(os.getpid(), signal.SIGINT)
        return by == "Ctrl-C" or len(looked) < 5

    out = io.StringIO()
    pipeline = CameraPipeline("A", FakeCamera(frame(0, 0.0, 9)), FakeTracker(), live=False)
    run = TrackingSession([pipeline], None, None, Console(file=out), has_viewers)
    assert run.run() == 0, "nothing was cut short"
    assert run.ended_by == ""
    assert looked[:5] == [True] * 5
    assert out.getvalue().count("close it, or Ctrl-C") == 1


def test_for_a_camera_that_was_given_up_nobody_is_waited_for():
    camera = FakeCamera(frame(0, 0.0, 9))
    camera.why = "camera 0 did not come back"
    run = TrackingSession(
        [CameraPipeline("A", camera, FakeTracker())], None, None, silent(), lambda: True
    )
    with pytest.raises(TrackingInterrupted, match="did not come back"):
        run.run()


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_signal_ends_it_with_everything_on_the_disk(tmp_path, number, status):
    out = ObservationCsv(tmp_path / "out.csv", False)

    def strike(timeout):
        if camera.struck:
            return None
        camera.struck = True
        os.kill(os.getpid(), number)

    camera = FakeCamera(frame(0, 0.0, 9), frame(1, 0.1, 0), after=strike)
    camera.struck = False
    before = signal.getsignal(number)
    run = TrackingSession(
        [CameraPipeline("A", camera, FakeTracker(), outputs=PipelineOutputs(csv=out))],
        out,
        None,
        silent(),
    )
    assert run.run() == status
    assert run.ended_by == ("Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name)
    assert signal.getsignal(number) == before
    out.close()
    assert [row["u"] for row in rows_in(tmp_path / "out.csv")] == ["9.000", ""]


def test_what_was_tracked_is_on_the_disk_meanwhile(tmp_path, monkeypatch):
    monkeypatch.setattr(session, "STATUS_PERIOD", 0.001)
    out = ObservationCsv(tmp_path / "out.csv", False)
    read = threading.Event()

    deadline = time.monotonic() + PATIENCE

    def look(timeout):
        if rows_in(tmp_path / "out.csv"):
            read.set()
        if read.is_set() or time.monotonic() > deadline:
            camera.after = None

    camera = FakeCamera(frame(0, 0.0, 9), after=look)
    TrackingSession(
        [CameraPipeline("A", camera, FakeTracker(), outputs=PipelineOutputs(csv=out))],
        out,
        None,
        silent(),
    ).run()
    out.close()
    assert read.is_set()


def test_on_a_pipe_a_line_comes_now_and_then(monkeypatch):
    monkeypatch.setattr(session, "STATUS_PERIOD", 0.001)
    monkeypatch.setattr(status_display, "PIPE_STATUS_PERIOD", 0.0)
    out = io.StringIO()

    def until_seen(timeout):
        if out.getvalue().count("\n") > 2:
            camera.after = None

    camera = FakeCamera(frame(0, 0.0, 90), after=until_seen)
    monkeypatch.setattr(status_display.time, "monotonic", Ticking())
    pipeline = CameraPipeline("A", camera, FakeTracker(), now=lambda: 0.0)
    TrackingSession([pipeline], None, lambda: "no brick connected", Console(file=out)).run()
    line = out.getvalue().splitlines()[1]
    assert line.endswith("effector 90.0,0.0 (0.90), age 0 ms; no brick connected")


def test_on_a_pipe_every_camera_has_a_line_of_its_own(monkeypatch):
    monkeypatch.setattr(status_display, "PIPE_STATUS_PERIOD", 0.0)
    out = io.StringIO()
    cameras = FakeCamera(frame(0, 0.0, 90)), FakeCamera(frame(0, 0.0, 0))
    pipelines = pipelines_of(*cameras, now=lambda: 0.0)
    for pipeline in pipelines:
        pipeline.step(0)
    display = StatusDisplay(pipelines, lambda: "no brick connected", Console(file=out))
    display.print_when_due()
    assert out.getvalue().splitlines() == [
        "A: 0 fps, effector 90.0,0.0 (0.90), age 0 ms",
        "B: 0 fps, effector lost: too dark, age 0 ms",
        "no brick connected",
    ]


class Ticking:
    """A second passes whenever somebody looks at the clock."""

    t = 0.0

    def __call__(self):
        self.t += 1.0
        return self.t


def test_on_a_terminal_the_line_stays_in_its_place():
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=100, legacy_windows=False)
    pipeline = CameraPipeline("A", FakeCamera(frame(0, 0.0, 90)), FakeTracker(), live=False)
    TrackingSession([pipeline], None, None, console).run()
    assert "\x1b[2K" in out.getvalue(), "it is wiped and written anew"
    assert "tracking" in out.getvalue()


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (ServerState(), "no brick connected"),
        (ServerState(lost="10.0.0.2: bye"), "no brick connected (last: 10.0.0.2: bye)"),
        (ServerState(client="::ffff:10.0.0.2"), "brick 10.0.0.2"),
        (
            ServerState(
                client="10.0.0.2", round_trip=0.0032, status=Status(1.0, (0.1,), 12.34, "lost")
            ),
            "brick 10.0.0.2, round trip 3.2 ms, error 12.3 px, lost",
        ),
    ],
)
def test_the_link_in_a_few_words(state, text):
    assert status_text.link_status(state) == text


def test_who_has_several_cameras_is_told_how_to_say_that_the_arm_is_in_space():
    one = status_text.brick_instructions(["visual_servoing.py"], "ABCD-EFGH-JKMN")
    two = status_text.brick_instructions(["visual_servoing.py"], "ABCD-EFGH-JKMN", cameras=2)
    assert one == two[:2]
    assert one[1].endswith(" asks for the pairing code, once: ABCD-EFGH-JKMN")
    assert "--arm spatial" in two[2]


class FakePlacer:
    """Knows the table from its second look on: 10 px are 1 cm."""

    def __init__(self):
        self.looks = 0

    def update(self, image):
        self.looks += 1

    def place(self, marker, pixel):
        return (pixel[0] / 10, pixel[1] / 10) if self.looks > 1 else None

    def board_place(self, marker, pixel):
        at = self.place(marker, pixel)
        return at and BoardPlace(*at, arm=(7.0, -1.0))


def test_places_on_the_table_stand_in_the_file_once_they_are_known(tmp_path):
    file = tmp_path / "out.csv"
    out = ObservationCsv(file, True, ["x", "y", "arm_x", "arm_y"])
    camera = FakeCamera(frame(0, 0.0, 1), frame(1, 0.1, 1))
    pipeline = CameraPipeline(
        "A",
        camera,
        FakeTracker(),
        (40.0, 20.0),
        PipelineOutputs(csv=out),
        False,
        placers=MarkerPlacers(FakePlacer()),
    )
    while pipeline.step(0.1):
        pass
    out.close()
    heading, *lines = file.read_text().splitlines()
    assert heading == "frame,t,marker,u,v,confidence,x,y,arm_x,arm_y,camera"
    goals = [line.split(",") for line in lines if ",goal," in line]
    assert [cells[3:] for cells in goals] == [
        ["40.000", "20.000", "1.000", "", "", "", "", "A"],
        ["40.000", "20.000", "1.000", "4.0000", "2.0000", "7.0000", "-1.0000", "A"],
    ]
    assert pipeline.view.places["goal"][:2] == (4.0, 2.0)


class FakePairs:
    """Two cameras that tell a place in space with the second picture."""

    def __init__(self):
        self.latest = {}

    def see(self, camera, frame, markers):
        if frame.index != 1:
            return []
        place = BoardPlace(1.0, 2.0, 3.0)
        self.latest = {"goal": PairedPlace(0, 0.0, "goal", 0.9, place, 0.05, "A+B")}
        return list(self.latest.values())

    def lines(self):
        return []


def test_what_two_cameras_tell_together_has_rows_of_its_own(tmp_path):
    file = tmp_path / "out.csv"
    out = ObservationCsv(file, True, ["x", "y", "z", "gap"])
    camera = FakeCamera(frame(0, 0.0, 1), frame(1, 0.1, 1), frame(2, 0.9, 1))
    pipeline = CameraPipeline(
        "A",
        camera,
        FakeTracker(),
        (40.0, 20.0),
        PipelineOutputs(csv=out),
        False,
        placers=MarkerPlacers(space=FakePairs()),
    )
    places = []
    while pipeline.step(0.1):
        places.append(pipeline.view.places.get("goal"))
    out.close()
    lines = file.read_text().splitlines()
    assert lines[0] == "frame,t,marker,u,v,confidence,x,y,z,gap,camera"
    assert "0,0.000000,goal,,,0.900,1.0000,2.0000,3.0000,0.0500,A+B" in lines
    assert len([line for line in lines if line.endswith("A+B")]) == 1
    assert places == [None, BoardPlace(1, 2, 3), None], "what is old is not shown any more"


def test_without_a_board_the_file_is_as_ever(tmp_path):
    file = tmp_path / "out.csv"
    out = ObservationCsv(file, False)
    out.add("A", frame(0, 0.0, 1), {"m": (1.0, 2.0, 0.5), "n": None}, {"m": BoardPlace(3.0, 4.0)})
    out.close()
    assert file.read_text().splitlines() == [
        "frame,t,marker,u,v,confidence",
        "0,0.000000,m,1.000,2.000,0.500",
        "0,0.000000,n,,,0.000",
    ]
