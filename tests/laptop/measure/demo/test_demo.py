"""The demo: its goals, its programs, and that none of them outlives it, whatever happens.

The programs are stand-ins here, that leave in no time what the real ones leave.
"""

import functools
import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
from arms import ARMS
from click.testing import CliRunner
from lab_runs import left
from numbered_frames import write_film
from rich.console import Console
from run_json import run_in
from servo_log import log_text
from waiting import PATIENCE

from laptop.cli.main import laptop
from laptop.emulator import bundled_scripts, temporary_folders
from laptop.emulator.device.motion_record import MotionRecord
from laptop.emulator.scene import camera_rig, servo_truth
from laptop.emulator.scene.camera_rig import CameraRig, solve
from laptop.emulator.scene.scene import Scene
from laptop.emulator.scene.scene_constants import read_scene
from laptop.measure.demo import demo_run, goals, processes, results, truth
from laptop.measure.demo.demo_run import DemoOptions
from laptop.measure.demo.processes import DemoFailed
from laptop.record.run_folder import NoRunFolder
from laptop.record.servo.servo_log import Log
from laptop.see.serve import process_signals

ARM = ARMS["planar"]
TILTED = "tilt=30,azimuth=30,roll=5"

# What `python -m laptop` would do, as far as the demo sees it. FAULT says what goes wrong.
STAND_IN = '''
import json, os, signal, sys, time

words, fault = sys.argv[1:], os.environ.get("FAULT", "")
command, script = words[0], words[-1]
value = lambda key: words[words.index(key) + 1]
DEAF = os.path.join(os.environ["PIDS"], "..", "deaf")
signal.signal(signal.SIGINT, signal.default_int_handler)
with open(os.path.join(os.environ["PIDS"], str(os.getpid())), "w") as file:
    file.write(" ".join([*words, "on", os.environ.get("BRICKSERVO_ARM", "")]))


def wait_for_ever(deaf=False):
    print("waiting", flush=True)
    if deaf:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        open(DEAF, "w").close()
    while True:
        time.sleep(60)


def tell(**event):
    assert "--json" in words
    print(json.dumps(event), flush=True)


def first(what):
    """Whether this is to go wrong once, and goes wrong now."""
    mark = os.path.join(os.environ["PIDS"], "..", "went wrong")
    if fault != what or os.path.exists(mark):
        return False
    open(mark, "w").close()
    return True


def leave(folder, end, paths=(), status=0):
    """The arm goes to the joint angles `end`, rad."""
    os.makedirs(folder, exist_ok=True)
    with open(folder + "/trace.csv", "w") as file:
        file.write("t,%s,pen\\n" % ",".join("q%d" % k for k in range(1, len(end) + 1)))
        for k in range(41):
            q = ["%.6f" % (a * min(1, k / 20)) for a in end]
            file.write("%.4f,%s,%d\\n" % (0.1 * k, ",".join(q), 10 <= k < 15))
    table = {"name": "paths", "caption": "", "columns": [{"name": "greatest", "unit": "mm"}]}
    ending = {"status": status, "reason": "", "more": {"start_s": 2.5}}
    run = {"kind": "drawing", "what": "", "ending": ending, "set_up": {"cpu": 1.0}}
    with open(folder + "/run.part", "w") as file:
        json.dump({**run, "tables": [{**table, "rows": [[off] for off in paths]}]}, file)
    os.replace(folder + "/run.part", folder + "/run.json")


if command == "track":
    if fault == "no tracker" or first("no tracker at first"):
        sys.exit("laptop: cannot listen; choose another port")
    tell(event="serving", host="127.0.0.1", port=7712, code="ABCD-EFGH")
    if "--page" in words:
        import http.server, threading
        page = http.server.HTTPServer(("127.0.0.1", 0), http.server.BaseHTTPRequestHandler)
        threading.Thread(target=page.serve_forever, daemon=True).start()
        tell(event="page", url="http://127.0.0.1:%d/?token=t" % page.server_port)
    if fault == "tracker dies":
        sys.exit("laptop: the camera is gone")
    if fault == "tracker is killed":
        import subprocess
        page = "import sys, time; time.sleep(100); open(sys.argv[1], 'w')"
        late = os.path.join(os.environ["PIDS"], "..", "late")
        keeps = subprocess.Popen([sys.executable, "-S", "-c", page, late])
        print("page has number %d" % keeps.pid, flush=True)
        print("page: http://127.0.0.1:7780/?token=t", file=sys.stderr, flush=True)
        os.kill(os.getpid(), 9)
    try:
        wait_for_ever()
    except KeyboardInterrupt:
        sys.exit(130)
ends = json.loads(os.environ["ENDS"])
if words[-2].endswith("driver.py"):
    if first("no driver at first"):
        sys.exit("laptop: no room")
    if fault == "too busy":
        print("simulate: driver.py: this computer is too busy to go on", file=sys.stderr)
        leave(value("--out"), ends["driver"], status=75)
        sys.exit(75)
    lines = [1.0] * 3
    if fault == "a line is missing":
        lines[2] = None
    if fault == "driver fails":
        print("driver.py: joint shoulder is blocked", file=sys.stderr)
    leave(value("--out"), ends["driver"], lines, int(fault == "driver fails"))
    sys.exit(0)
rival = "report" in words
goal = " ".join(word[7:] for word in words if word.startswith("--goal="))
if fault == "servo fails" and goal != "marker":
    print("servo.py: the motor at port A is not plugged in", file=sys.stderr)
    print("out/picture.png, trace.csv, run.json")
    leave(value("--out"), ends["driver"], status=1)
    sys.exit(1)
if fault in ("servo hangs", "deaf servo", "tracker dies", "tracker is killed"):
    wait_for_ever(fault == "deaf servo")
if fault == "rival fails" and rival:
    sys.exit("laptop: no room")
if fault == "rival hangs" and rival:
    wait_for_ever(True)
while fault == "rival hangs" and not os.path.exists(DEAF):
    time.sleep(0.01)  # or it might be told to end before it is deaf
missed = fault == "not reached" and goal != "marker"
with open(value("--log"), "w") as file:
    file.write(os.environ["LOG"].replace('"chain"', '"report"' if rival else '"chain"'))
print("converged", flush=True)
leave(value("--out"), ends["driver"] if missed else ends[goal])
'''


@functools.cache
def scene_of(arm, text):
    """The Scene of a text and a camera; to paint one takes longer than most tests."""
    return Scene(arm, read_scene(*text))


@pytest.fixture(scope="module", autouse=True)
def scenes_painted_once():
    """The demo's scenes: nothing changes them."""
    with pytest.MonkeyPatch.context() as patch:
        set_in_all(patch, "read_scene", lambda *text: text)
        set_in_all(patch, "Scene", scene_of)
        yield


def set_in_all(monkeypatch, name, value):
    """Whichever modules of the demo have it."""
    holders = [m for m in (demo_run, goals, processes, truth, camera_rig) if hasattr(m, name)]
    assert holders
    for module in holders:
        monkeypatch.setattr(module, name, value)


really_choose = functools.cache(goals.choose_goals)


@functools.cache
def ends_of(name):
    """Joint angles, rad, where the driver ends, and with the tip at each goal by what is told."""
    arm = ARMS[name]
    text, chosen = really_choose(arm, 0)
    views = CameraRig(arm, text)
    start = goals.postures_at(views, goals.DEMO_SETUPS[arm.chain].end_of_lines)[0]
    ends = {"driver": start, **{" ".join(goal.args): posture_at(views, goal) for goal in chosen}}
    return {told: list(map(float, q)) for told, q in ends.items()}


BENDS = {2: [(-1.5,), (1.5,)], 3: [(0.3, -1.5), (1.2, -0.8), (1.5, -1.8)]}
"""Of the joints after the first, rad."""


def posture_at(views, goal):
    """A posture within the limits, rad, with the tip at a goal."""
    joints = views.arm.joints
    for start in itertools.product((-0.8, 0.2, 1.2, 2.0), BENDS[len(joints)]):
        q = solve(views.truth, (start[0], *start[1]), goal.pixels)
        if np.isfinite(q).all() and all(
            j.lower <= a <= j.upper for a, j in zip(q, joints, strict=True)
        ):
            return q
    raise AssertionError(goal)


@pytest.fixture
def play(tmp_path, monkeypatch):
    """Run the demo with the stand-ins and one of their faults; its exit status and its folder."""
    stand_in = tmp_path / "stand_in.py"
    stand_in.write_text(STAND_IN)
    pids = tmp_path / "pids"
    pids.mkdir()
    monkeypatch.setenv("PIDS", str(pids))
    set_in_all(monkeypatch, "LAPTOP", (sys.executable, "-S", "-E", str(stand_in)))
    set_in_all(monkeypatch, "choose_goals", really_choose)
    set_in_all(monkeypatch, "POLL_PERIOD", 0.005)
    monkeypatch.setattr("laptop.record.servo.servo_files.draw", lambda *words: [])

    play_results = []
    really_record = results.record_of
    monkeypatch.setattr(
        results,
        "record_of",
        lambda demo, *rest: play_results.append(demo) or really_record(demo, *rest),
    )

    def run(fault="", **orders):
        name = orders.get("arm", "planar")
        for key, value in {
            "FAULT": fault,
            "ENDS": json.dumps(ends_of(name)),
            "LOG": log_text(1.0, cameras="A" if name == "planar" else "AB"),
        }.items():
            monkeypatch.setenv(key, value)
        console = Console(file=(tmp_path / "out.txt").open("w"), width=100)
        with console.file:
            try:
                status, page = demo_run.run(DemoOptions(tmp_path / "runs", **orders), console)
            finally:
                run.said = (tmp_path / "out.txt").read_text()
        run.said = (tmp_path / "out.txt").read_text()
        return status, page.parent

    run.pids, run.results = pids, play_results
    yield run
    assert alive(pids) == []


def alive(pids):
    """Numbers of the stand-ins that still run."""

    def runs(pid):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        return True

    return [int(name) for name in os.listdir(pids) if runs(int(name))]


def complains(play, fault, words, **orders):
    """The demo fails in one line, and no program is left."""
    with pytest.raises(DemoFailed, match=words) as failure:
        play(fault, **orders)
    assert "\n" not in str(failure.value)
    assert os.listdir(play.pids)
    assert alive(play.pids) == []
    return True


# The course of it


@pytest.mark.long
def test_a_demo_that_works_leaves_its_report_and_no_process(play):
    status, folder = play()
    assert status == 0, play.said
    assert "all three goals truly reached" in play.said
    assert len(os.listdir(play.pids)) == 6
    for name in ("report.html", "run.json", "goal-1.jsonl", "goal-3/trace.csv", "three-lines.txt"):
        assert (folder / name).exists(), name
    told = run_in(folder)
    assert (told["well"], told["seeds"], told["cpu"]) == (True, {"demo": 0}, 1.0)
    goals = told["goals"]
    assert [row["goal"] for row in goals[:3]] == ["goal 1", "goal 2", "goal 3"]
    assert [row["method"] for row in goals] == ["chain"] * 3 + ["report"]
    assert max(row["truly off px"] for row in goals[:3]) <= 0.1
    for number in (1, 2, 3):
        lines = (folder / f"goal-{number}-true-path.csv").read_text().splitlines()
        assert lines[1].startswith("0.0,"), "on the log's clock"


@pytest.mark.long
def test_a_second_one_in_the_same_folder_works_and_other_runs_there_stay(play):
    _, folder = play()
    left(folder / "mine")
    (folder / "mine" / "goal-1.jsonl").write_text("mine")
    before = {path: path.read_bytes() for path in (folder / "mine").iterdir()}
    for name in os.listdir(play.pids):
        (play.pids / name).unlink()
    status, again = play()
    assert (status, again) == (0, folder), play.said
    assert {path: path.read_bytes() for path in (folder / "mine").iterdir()} == before
    files = run_in(folder)["files"]
    assert len(files) == len({*files})
    assert not [name for name in files if "mine" in name]


def test_a_file_that_is_no_demos_is_not_lost(play):
    folder = play.pids.parent / "runs"
    folder.mkdir()
    (folder / "report.html").write_text("mine")
    with pytest.raises(NoRunFolder, match=r"report.html is of no run, as there is no run.json"):
        play()
    assert [path.name for path in folder.iterdir()] == ["report.html"]


def words_of(play, command):
    """What the one program of this command was told."""
    told = [(play.pids / name).read_text() for name in os.listdir(play.pids)]
    (words,) = [words for words in told if words.startswith(command)]
    return words.partition(" on ")[0].split()


def test_its_page_can_be_watched_and_brings_no_brick_of_its_own(play):
    assert play(page=True, page_port=7790, page_host="127.0.0.1", open=True)[0] == 0, play.said
    assert re.search(r"^page: http://127\.0\.0\.1:\d+/\?token=t$", play.said, re.MULTILINE)
    track, *words = words_of(play, "track")
    told = laptop.commands[track].make_context(track, words).params
    assert (told["page"], told["simulate"], told["open"]) == (True, False, True)
    assert told["page_at"] == ("127.0.0.1", 7790)


def test_without_a_page_none_is_served(play):
    assert play()[0] == 0, play.said
    assert "page:" not in play.said
    assert "--no-page" in words_of(play, "track")


@pytest.mark.long
def test_an_arm_in_space_is_shown_by_two_cameras_and_judged_in_space(play):
    status, folder = play(arm="spatial")
    assert status == 0, play.said
    told = [(play.pids / name).read_text() for name in os.listdir(play.pids)]
    (track,) = [words for words in told if words.startswith("track")]
    assert track.count("--camera synthetic") == 2
    assert track.endswith(f"on {os.path.abspath(ARMS['spatial'].file)}")
    assert sum(len(re.findall(r"--goal=[AB]:\d", words)) == 2 for words in told) == 2
    (demo,) = play.results
    assert demo.cameras == "AB"
    assert max(run.truth.miss_mm for run in demo.runs) < 0.2
    assert all(5 < run.within_mm < 12 for run in demo.runs)
    scene = re.search("scene '(.*)'", demo.set_up["camera"])[1]
    views, ends = CameraRig(ARMS["spatial"], scene), ends_of("spatial")
    for told, run in zip(list(ends)[1:], demo.runs, strict=True):
        there = views.centre("effector", ends[told])
        assert run.truth.space.tips[-1] == pytest.approx(there, abs=0.01)
        assert run.truth.path[-1, 1:] == pytest.approx(views.truth(ends[told]), abs=0.02)
    begins = 0.5 * np.array(ends["driver"])  # there the pen goes down
    here = [*views.centre("effector", begins), *views.truth(begins)]
    assert demo.ink[0][0] == pytest.approx(here, abs=0.02)


@pytest.mark.short("planar")
@pytest.mark.parametrize("arm", ["planar", "spatial"])
def test_a_goal_that_is_only_claimed_fails_the_demo(play, arm):
    status, folder = play("not reached", arm=arm)
    assert status == 1
    assert "goal 2 was not reached, though the brick says so" in play.said
    assert (folder / "report.html").exists()


def test_a_line_that_is_missing_fails_the_demo(play):
    status, _ = play("a line is missing")
    assert status == 1
    assert "2 of 3 drawn" in play.said


def test_the_comparison_may_fail(play):
    status, folder = play("rival fails")
    assert status == 0
    assert "report's method failed: no room" in play.said
    assert [row["method"] for row in run_in(folder)["goals"]] == ["chain"] * 3
    assert "there is no run of the lab report's method" in run_in(folder)["notes"][-1]


@pytest.mark.long
def test_the_comparison_is_not_waited_for_for_ever(play, monkeypatch):
    set_in_all(monkeypatch, "END_TIMEOUT", 0.3)
    set_in_all(monkeypatch, "REPORT_TIMEOUT", 0.0)
    status, _ = play("rival hangs")
    assert status == 0
    assert "report's method hangs" in play.said


@pytest.mark.short(every=4)
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("servo fails", "goal 2 failed: servo.py: the motor at port A is not"),
        ("driver fails", "three lines failed: driver.py: joint shoulder is"),
        ("no tracker", "tracker failed: cannot listen; choose another port"),
        ("tracker dies", "tracker failed: the camera is gone"),
    ],
)
def test_a_program_that_fails_ends_the_demo_with_what_it_said(play, fault, told):
    assert complains(play, fault, told)


def test_a_program_that_hangs_ends_the_demo(play, monkeypatch):
    set_in_all(monkeypatch, "SERVO_TIMEOUT", 0.2)
    assert complains(play, "servo hangs", r"goal 1 hangs: not done after 0.2 s; see .*goal-1\.txt")


@pytest.mark.long
def test_a_program_that_does_not_listen_is_killed(play, monkeypatch):
    set_in_all(monkeypatch, "END_TIMEOUT", 0.3)
    set_in_all(monkeypatch, "SERVO_TIMEOUT", 0.2)
    assert complains(play, "deaf servo", "goal 1 hangs")


@pytest.mark.parametrize("fault", ["no tracker at first", "no driver at first"])
def test_a_start_that_fails_is_tried_again_once(play, fault):
    assert play(fault)[0] == 0, play.said
    assert re.search(
        r"failed: (cannot listen|no room).*; trying once more$", play.said, re.MULTILINE
    )
    assert len(os.listdir(play.pids)) == 7


def test_a_computer_that_is_too_busy_has_a_sentence_and_a_status_of_its_own(play, monkeypatch):
    with pytest.raises(
        processes.TooBusy, match="three lines failed: .*this computer is too busy to go"
    ):
        play("too busy")

    def fails(*orders):
        raise processes.TooBusy("this computer is too busy")

    monkeypatch.setattr(demo_run, "run", fails)
    result = CliRunner().invoke(laptop, ["demo"])
    assert (result.exit_code, result.output) == (75, "Error: this computer is too busy\n")


def test_that_it_goes_slower_is_told_and_stands_at_the_end(play, monkeypatch):
    class Slow(demo_run.PaceMeter):
        mean = 0.61

        def sample(self):
            return 0.6

    set_in_all(monkeypatch, "PaceMeter", Slow)
    status, folder = play()
    assert status == 0, play.said
    assert "this computer is busy: running at 0.6 x\n" in play.said
    assert "the emulated brick with cpu=1, its clock at 0.61 x" in play.said
    page = (folder / "report.html").read_text()
    assert re.search(r"pace, to real time</td><td[^>]*>0.61<", page)


def test_a_page_is_told_when_it_answers():
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as page:
        address = f"http://127.0.0.1:{page.server_port}/?token=t"
        answering = threading.Thread(target=page.handle_request)
        answering.start()
        assert processes.answers(address)
        answering.join()
    assert not processes.answers(address)


def test_a_tracker_that_is_killed_is_called_killed(play):
    assert complains(play, "tracker is killed", r"tracker was killed \(SIGKILL\); see ")
    # What it had started still keeps its pipe open: nobody waited for that.
    (log,) = (play.pids.parent / "runs").glob("tracker.txt")
    os.kill(int(re.search(r"page has number (\d+)", log.read_text()).group(1)), signal.SIGKILL)
    assert not (play.pids.parent / "late").exists()


def test_the_demo_sweeps_what_a_killed_one_has_left(play, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    left = temporary_folders.make("demo", str(tmp_path))
    os.close(temporary_folders._HELD.pop(left))  # as its death does
    play()
    assert [name for name in os.listdir(tmp_path) if "brickservo" in name] == []


@pytest.mark.parametrize(
    ("number", "raised"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)]
)
def test_ctrl_c_and_sigterm_end_every_program(play, capsys, number, raised):
    def interrupt():
        while len(os.listdir(play.pids)) < 4:  # tracker, driver, goal 1, the comparison
            time.sleep(0.01)
        os.kill(os.getpid(), number)

    thread = threading.Thread(target=interrupt)
    thread.start()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(raised) as end:
            play("servo hangs")
    finally:
        signal.signal(signal.SIGINT, before)
        thread.join()
    assert alive(play.pids) == []
    if raised is SystemExit:
        assert end.value.code == 143
        assert capsys.readouterr().err == "laptop: stopped by SIGTERM\n"


def test_ctrl_c_that_comes_just_before_disturbs_nothing(monkeypatch):
    really, pending = signal.signal, [KeyboardInterrupt, SystemExit]

    def notices(number, handler):
        if pending:
            raise pending.pop()
        return really(number, handler)

    before = {number: signal.getsignal(number) for number in process_signals.EXIT_STATUS}
    monkeypatch.setattr(process_signals.signal, "signal", notices)
    with process_signals.signals_ignored():
        assert {signal.getsignal(number) for number in before} == {signal.SIG_IGN}
    assert {number: signal.getsignal(number) for number in before} == before
    assert not pending


def test_who_interrupts_while_a_program_starts_leaves_none_behind(play, monkeypatch):
    really, started = subprocess.Popen, []

    def interrupted(*args, **options):
        started.append(really(*args, **options))
        os.kill(os.getpid(), signal.SIGINT)
        return started[-1]

    monkeypatch.setattr(processes.subprocess, "Popen", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            play()
    finally:
        signal.signal(signal.SIGINT, before)
    assert started
    assert all(process.poll() is not None for process in started)


# The goals


@pytest.mark.short("planar-0")
@pytest.mark.parametrize(("name", "seed"), [("planar", 0), ("geared", 7), ("spatial", 0)])
def test_goals_are_in_the_pictures_and_apart_and_can_be_reached(name, seed):
    arm = ARMS[name]
    text, chosen = really_choose(arm, seed)
    views = CameraRig(arm, text)
    assert chosen[0].args == ("marker",)
    assert chosen[0].pixels == views.truth([joint.home for joint in arm.joints], "goal")
    for number, goal in enumerate(chosen):
        places = list(zip(goal.pixels[::2], goal.pixels[1::2], strict=True))
        if number:
            names = [f"{camera}:" for camera in views] if len(views) > 1 else [""]
            pairs = zip(names, places, strict=True)
            assert goal.args == tuple(f"{camera}{u:.1f},{v:.1f}" for camera, (u, v) in pairs)
        assert all(40 < u < 600 and 40 < v < 440 for u, v in places)
        assert all(math.dist(goal.pixels, other.pixels) > 149 for other in chosen[:number])
        assert views.project(goal.place) == pytest.approx(goal.pixels, abs=0.1)
        assert math.dist(views.truth(posture_at(views, goal)), goal.pixels) < 0.1


@pytest.mark.long
@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_same_seed_gives_the_same_goals(name):
    assert goals.choose_goals(ARMS[name], 0) == really_choose(ARMS[name], 0)


@pytest.mark.long
def test_the_tip_is_seen_by_both_cameras_on_its_way():
    views = CameraRig(ARMS["spatial"], goals.scene_text("spatial", 0))
    left = goals.DEMO_SETUPS["spatial"].end_of_lines
    start = goals.postures_at(views, left)[0]
    assert views.centre("effector", start) == pytest.approx(left)
    assert goals.path_is_seen(views, start, (0.0, 0.6, -1.2))
    assert not goals.path_is_seen(views, start, (0.7, -0.3, -0.5))  # in sight, but near the table
    assert not goals.path_is_seen(views, start, (1.6, 1.9, -2.0))  # behind the upper arm
    assert not goals.path_is_seen(
        views, (1.6, -0.1, -0.3), (1.3, 0.0, -0.4)
    )  # hidden while it explores


@pytest.mark.long
def test_a_tip_behind_the_stand_of_a_goal_is_not_in_sight():
    text = goals.scene_text("spatial", 0)
    start, end = (
        goals.postures_at(CameraRig(ARMS["spatial"], text), (9.0, 4.0, 12.6))[0],
        (0, 0.6, -1.2),
    )
    eye = CameraRig(ARMS["spatial"], text)["B"].camera.position
    x, y, _ = (9.0, 4.0, 12.6) + 0.2 * (eye - (9.0, 4.0, 12.6))
    behind = CameraRig(ARMS["spatial"], f"{text},goal_x={x:.2f},goal_y={y:.2f},goal_z=25")
    assert goals.MIN_VISIBLE_BETWEEN < behind.visible(start) < goals.MIN_VISIBLE_AT_ENDS
    assert not goals.path_is_seen(behind, start, end)
    aside = CameraRig(ARMS["spatial"], f"{text},goal_x=-20")
    assert goals.path_is_seen(aside, start, end)


@pytest.mark.parametrize(
    ("name", "marker", "places"),
    [
        ("planar", "effector", [(12.0, -3.0, 2.5), (-5.0, 14.0, 2.5)]),
        ("planar", "goal", [(12.0, -3.0, 0.0)]),
        ("spatial", "goal", [(12.0, -3.0, 2.5), (-5.0, 9.0, 20.0)]),
    ],
)
def test_a_place_is_found_by_its_pixels(name, marker, places):
    views = CameraRig(ARMS[name], TILTED if name == "planar" else goals.scene_text(name, 0))
    for place in places:
        assert views.place_at(views.project(place), marker) == pytest.approx(place, abs=1e-6)


def test_a_pixel_is_worth_most_where_the_cameras_tell_least():
    views = CameraRig(ARMS["spatial"], goals.scene_text("spatial", 0))
    place = np.array([12.0, 0.0, 10.0])
    worth = servo_truth._space(views, [(0.0, (0.0, 0.6, -1.2))], place).mm_per_px
    ways = [views.project(place + d) - views.project(place) for d in 0.1 * np.eye(3)]
    assert all(1 / np.linalg.norm(way) <= worth + 1e-3 for way in ways)  # 1 mm each way
    assert 0.7 < worth < 1.4


# What the programs leave


@pytest.mark.long
def test_what_the_tracker_announces_is_understood(tmp_path):
    film = write_film(tmp_path / "film.avi", [np.full((120, 160, 3), 130, np.uint8)])
    group = processes.ProcessGroup(tmp_path, {"BRICKSERVO_STATE": str(tmp_path)})
    words = ["track", "--camera", str(film), "--json"]
    words += ["--listen-port", "127.0.0.1:0", "--page-port", "0"]
    tracker = group.start("tracker", words)
    try:
        place, code = processes.wait_for_link(tracker)
        assert processes.wait_for_page(tracker).startswith("http://127.0.0.1:")
        assert processes.wait_for_event(tracker, "end")["status"] == 0
        assert tracker.wait(PATIENCE) == 0
        assert any(f"pairing code, once: {code}" in line for line in tracker.lines)
        assert any(line.endswith(f"visual_servoing.py {place}") for line in tracker.lines)
        with pytest.raises(DemoFailed, match="tracker failed: .*"):
            processes.wait_for_event(tracker, "another end")
    finally:
        group.close()


@pytest.mark.parametrize("text", [None, "", "t,q1\n1,x\n"])
def test_a_trace_that_cannot_be_read_is_told_in_one_line(tmp_path, text):
    if text is not None:
        (tmp_path / "trace.csv").write_text(text)
    with pytest.raises(DemoFailed, match=r"trace\.csv cannot be read"):
        truth.read_trace(tmp_path / "trace.csv")


def test_where_the_tip_was_at_the_verdict_counts_and_not_where_it_is_parked():
    views = CameraRig(ARM, "seed=0")
    reached, parked = (0.3, 0.4), (0.0, 0.0)
    rows = [truth.TracePoint(0.1 * k, reached if k < 20 else parked, False) for k in range(40)]
    log = Log({}, [], [], [], {"t": 1.0})
    found = servo_truth.truth_of(views, rows, log, 0.5, views.truth(reached))
    assert found.miss_mm == pytest.approx(0, abs=1e-3)
    assert found.cameras == ("A",)
    late = servo_truth.truth_of(views, rows, Log({}, [], [], [], {"t": 3.0}), 0.5, found.goal)
    assert late.miss_mm > 50


@pytest.mark.short("planar")
@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_true_path_keeps_when_rests_end(name):
    views = CameraRig(ARMS[name], "seed=0")
    still = (0.0,) * (len(ARMS[name].joints) - 1)
    rows = [truth.TracePoint(0.1 * k, (0.01 * max(0, k - 10), *still), False) for k in range(16)]
    path = servo_truth.true_path(views, rows)
    assert [round(t, 1) for t, _ in path] == [0.0, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5]
    assert path[0][1] == path[1][1]
    assert path[-1][1] == (0.05, *still)


def test_the_true_path_of_an_emulated_arm_ends_where_its_record_ends():
    views = CameraRig(ARM, "seed=0")
    record = MotionRecord(lambda number: 0.1 * number)
    for k in range(16):
        record.append((0.01 * min(k, 5), 0.0), 0.0, 0.0, None, 0)
    path = servo_truth.true_path(views, record)
    assert [round(t, 1) for t, _ in path] == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 1.4, 1.5]
    assert path[-1][1] == (0.05, 0.0)


# The command


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--out", "/proc/nowhere"], "cannot write to /proc/nowhere"),
        (["--arm", "no-such-arm"], "no-such-arm"),
        (["--seed", "-1"], "-1 is not in the range"),
    ],
)
def test_bad_orders_are_refused_in_one_line(words, told):
    result = CliRunner().invoke(laptop, ["demo", *words])
    assert result.exit_code != 0
    (line,) = [line for line in result.output.splitlines() if line.startswith("Error")]
    assert told in line


SEES = """
import sys
sys.path.insert(0, {root!r})
from robot.clock import Clock
from robot.tracking_client import TrackingClient, find_tracker
clock = Clock()
client = TrackingClient(*find_tracker(), clock=clock)
seen = {{}}
while not seen:
    seen = client.poll(0.1)
u, v, _ = seen["A"].markers["effector"]
print("{{:.1f}} {{:.1f}} {{:.2f}} s ago".format(u, v, clock.now() - seen["A"].t))
client.close()
"""


def test_a_script_in_virtual_time_is_served_with_what_a_camera_would_see(tmp_path, monkeypatch):
    monkeypatch.setenv("SSH_CLIENT", "192.0.2.1 1 22")
    script = tmp_path / "sees.py"
    script.write_text(SEES.format(root=bundled_scripts.REPO_ROOT))
    words = ["simulate", "--scene", TILTED, "--start", "30,45", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(laptop, [*words, str(script)])
    assert result.exit_code == 0, result.output
    u, v, age = map(float, re.search(r"(\S+) (\S+) (\S+) s ago", result.output).groups())
    q = math.radians(30), math.radians(45)
    assert (u, v) == pytest.approx(scene_of(ARM, (TILTED,)).truth(q)["effector"], abs=0.3)
    assert 0.02 < age < 0.2


def test_a_scene_is_for_virtual_time(tmp_path):
    words = [
        "simulate",
        "--realtime",
        "--scene",
        "",
        "--out",
        str(tmp_path),
        bundled_scripts.DRIVER,
    ]
    result = CliRunner().invoke(laptop, words)
    assert result.exit_code == 1
    assert "a scene is for virtual time" in result.output
