"""Whatever goes wrong while it servoes: the arm stands within 0.5 s, the verdict is right, and
where it can go on it does.

Each case runs visual_servoing.py as a program on the emulated brick; what stood and what was
reached is read from the emulated plant and the camera's own formula.
"""

import math
import os
import signal
from collections import namedtuple

import pytest
from servo_rig import Camera, Watched

from robot.servoing.sightings import SIGHT_TIMEOUT
from shared.messages import Stop

UNDISTURBED = {}


@pytest.fixture
def midst(tmp_path_factory, monkeypatch, capsys):
    """`midst(mode)`: in the midst of the longest move or chase of a run, s.

    By the words of the command line: others take another time, and the arm then goes another way.
    `share`: of that move, for another time; `of_run`: since the servo began, not the program.
    """

    def found(mode, *args, share=0.5, of_run=False):
        key = (mode, *args)
        if key not in UNDISTURBED:
            with monkeypatch.context() as patch:
                w = Watched(tmp_path_factory.mktemp(mode), patch, capsys)
                began = w.run("--mode", mode, *args).began
                w.tracker.close()
            fast, begun = [], None
            for m in w.moments:
                if m.speed < 0.6:
                    begun = None
                else:
                    begun = begun or m.t
                    fast.append((m.t - begun, m.t))
            UNDISTURBED[key] = began, *max(fast)
        began, lasted, end = UNDISTURBED[key]
        return end - (1 - share) * lasted - (began if of_run else 0.0)

    return found


FULL = 20000
"""Lines of garbage per second."""


def judge(w, shown, verdict, says=""):
    """Whether log, output and exit status agree on the verdict, an error in one line."""
    assert "Traceback" not in shown.out + shown.err
    assert shown.log[-1]["kind"] == "verdict"
    assert shown.log[-1]["verdict"] == verdict
    assert (shown.status == 0) == (verdict == "converged")
    if verdict == "converged":
        assert shown.out.splitlines()[-1].startswith("converged: ")
        assert shown.err == ""
        assert w.error() < 7, "claimed, but not true"
    else:
        assert shown.err.count("\n") == 1
        assert verdict in shown.err
        assert says in shown.err
    assert w.stands(shown.t + 0.5)
    return True


# What passes: how long it lasts (s), what happens, what ends it


def hide(w):
    w.hidden.add("effector")


def show(w):
    w.hidden.clear()


Passing = namedtuple("Passing", "seconds begin end")
PASSING = {
    "marker hidden for a blink": Passing(0.3, hide, show),
    "marker hidden": Passing(2.0, hide, show),
    "link cut": Passing(0.0, lambda w: w.tracker.cut(), None),
    "half-open for 5 s": Passing(5.0, lambda w: w.tracker.silence(5.0), None),
    "a flood of garbage": Passing(
        2.0, lambda w: w.tracker.flood(FULL), lambda w: w.tracker.flood(0)
    ),
    "tracker restarted": Passing(1.5, lambda w: w.tracker.restart(1.5), None),
    "tracker away for 12 s": Passing(12.0, lambda w: w.tracker.restart(12.0), None),
}


STREAMED = ("marker hidden", "link cut", "half-open for 5 s")


@pytest.mark.short(
    "link cut-look", "marker hidden-stream", "tracker restarted-look", "half-open for 5 s-stream"
)
@pytest.mark.parametrize(
    ("name", "mode"),
    [(name, "look") for name in sorted(PASSING)] + [(name, "stream") for name in STREAMED],
)
def test_what_passes_holds_the_arm_and_it_goes_on(watched, midst, name, mode):
    it = PASSING[name]
    w = watched()

    def strike():
        it.begin(w)
        if it.end:
            w.world.at(w.struck + it.seconds, lambda: it.end(w))

    w.in_motion(midst(mode) - 0.1, strike)
    shown = w.run("--mode", mode)
    assert judge(w, shown, "converged")
    if it.seconds > 0.5:
        # 0.3 s and a frame until it holds, and what braking takes.
        assert w.stands(w.struck + 0.6, w.struck + it.seconds)
        notes = [line["text"] for line in shown.log if line["kind"] == "note"]
        assert any("lost: held" in text for text in notes)
        assert any("again" in text for text in notes)


# What stays: the verdict, what the line says, and within how many s from then on it ends

Staying = namedtuple("Staying", "act verdict says ends stands")
Staying.__new__.__defaults__ = (0.5,)
STAYING = {
    "marker gone": Staying(hide, "marker lost", "the effector has not been seen", 11),
    "half-open for ever": Staying(
        lambda w: w.tracker.silence(), "link lost", "nothing heard for 2.", 21, 0.6
    ),
    "shoulder stalled": Staying(lambda w: w.brick.jam("A"), "stalled", "the shoulder (port A)", 1),
    "elbow stalled": Staying(lambda w: w.brick.jam("B"), "stalled", "the elbow (port B)", 1),
    "shoulder unplugged": Staying(
        lambda w: w.brick.unplug("A"), "stalled", "the shoulder motor at port A no longer", 1
    ),
    "elbow unplugged": Staying(
        lambda w: w.brick.unplug("B"), "stalled", "the elbow motor at port B no longer", 1
    ),
    # An access takes 50 ms: stopping all motors some ten of them, a control tick seven; and the
    # first of these tells nothing, whatever is left of it.
    "slow brick": Staying(
        lambda w: setattr(w.brick.sysfs, "access_cost", 0.05),
        "too slow",
        "a control tick took",
        1.3,  # by where in a tick, which takes 0.33 s then, it is struck
        1.0,
    ),
    "the laptop says stop": Staying(
        lambda w: w.tracker.server.send(Stop("that is enough")), "stopped", "that is enough", 0.5
    ),
}


STREAMED = ("marker gone", "elbow stalled", "shoulder unplugged")


@pytest.mark.short(
    "marker gone-look",
    "half-open for ever-look",
    "elbow stalled-stream",
    "shoulder unplugged-look",
    "slow brick-look",
    "the laptop says stop-look",
)
@pytest.mark.parametrize(
    ("name", "mode"),
    [(name, "look") for name in sorted(STAYING)] + [(name, "stream") for name in STREAMED],
)
def test_what_stays_ends_the_run_with_the_right_verdict(watched, midst, name, mode):
    it = STAYING[name]
    w = watched()
    joint = {"shoulder stalled": 0, "elbow stalled": 1}.get(name)
    w.in_motion(midst(mode) - 0.25 if joint is None else 2.0, lambda: it.act(w), joint)
    shown = w.run("--mode", mode)
    assert judge(w, shown, it.verdict, it.says)
    assert shown.status == 1
    # A chase may go on with the other joint, as long as it has no need of the one that is stuck.
    later = 0.5 if mode == "stream" and joint is not None else 0.0
    assert w.stands(w.struck + it.stands + later)
    assert shown.t < w.struck + it.ends + 0.5


@pytest.mark.short("SIGTERM-stream")
@pytest.mark.parametrize(
    ("name", "mode"),
    [("SIGTERM", "look"), ("SIGTERM", "stream"), ("SIGHUP", "look")],
)
def test_a_signal_stops_it_at_once_and_is_on_record(watched, midst, name, mode):
    number, t = getattr(signal, name), midst(mode)
    w = watched()
    shown = w.run("--mode", mode, signals=[(t, number)])
    assert judge(w, shown, "stopped", f"stopped by {name}")
    assert shown.status == 128 + number
    assert any(m.speed > 0.5 for m in w.moments if t - 0.1 < m.t < t)
    assert w.stands(t + 0.2)
    assert w.on_file()["parked"] is not None
    assert w.statuses[-1].verdict == "stopped"


@pytest.mark.short("freeze_at-stream", "kill_at-look")
@pytest.mark.parametrize(
    ("how", "mode"), [("freeze_at", "look"), ("freeze_at", "stream"), ("kill_at", "look")]
)
def test_a_frozen_or_killed_program_leaves_no_joint_driven_and_a_log(watched, midst, how, mode):
    w, t = watched(), midst(mode)
    shown = w.run("--mode", mode, **{how: t})
    assert shown.status == {"freeze_at": 124, "kill_at": 137}[how]
    assert any(m.speed > 0.5 for m in w.moments if t - 0.1 < m.t < t)
    assert w.stands(t + 0.5)
    assert not any(m.driven for m in w.moments if m.t > t + 0.3)
    assert [line["kind"] for line in shown.log].count("step") >= 1


def test_the_budget_ends_a_motion(tmp_path_factory, monkeypatch, capsys, midst):
    """In motion it is by then in one of few runs: another budget may lead it another way."""
    in_motion = False
    for share in (0.5, 0.35, 0.2):
        if in_motion:
            break
        w = Watched(tmp_path_factory.mktemp("budget"), monkeypatch, capsys)
        budget = round(midst("look", "--budget", "60.5", share=share, of_run=True), 2)
        shown = w.run("--mode", "look", "--budget", f"{budget:g}")
        w.tracker.close()
        assert judge(w, shown, "budget spent", f"{budget:g} s")
        assert budget < shown.log[-1]["t"] < budget + 0.5
        end = shown.began + budget
        assert w.stands(end + 0.5)
        in_motion = any(m.speed > 0.5 for m in w.moments if end - 0.1 < m.t < end)
    assert in_motion


@pytest.mark.short("too far")
@pytest.mark.parametrize(
    ("goal", "mode"),
    [
        pytest.param((28.0, 10.0), "look", id="too far"),
        pytest.param((1.5, 1.0), "look", id="too near"),
        pytest.param((-12.0, -12.0), "look", id="behind a limit"),  # up to 33 moves at cpu=1
    ],
)
def test_a_goal_out_of_reach_is_given_up_soon(watched, goal, mode):
    w = watched(goal=goal)
    shown = w.run("--mode", mode, "--budget", "60")
    verdict = shown.log[-1]["verdict"]
    assert verdict in ("unreachable", "limit")
    assert judge(w, shown, verdict, "short")
    assert shown.log[-1]["moves"] <= 40  # both postures are tried; by luck it is 11 to 33
    assert shown.status == 1


@pytest.mark.short("4.5-stream")
@pytest.mark.parametrize(
    ("t", "mode"),
    [
        (2.3, "look"),
        (None, "look"),
        (2.8, "stream"),
        (4.5, "stream"),
    ],
)
def test_after_a_bump_it_reaches_the_goal_as_then_seen(watched, midst, t, mode):
    w = watched()
    w.world.at(t or midst(mode), lambda: w.cameras.update(A=w.cameras["A"].bumped()))
    shown = w.run("--mode", mode)
    assert judge(w, shown, "converged")
    assert math.dist(w.tip, w.goal) < 1.0


# Before anything moves


def test_a_wrong_code_is_told_in_one_line_and_nothing_moves(watched):
    w = watched()
    shown = w.run(f"127.0.0.1:{w.tracker.port}", "--code", "ZZZZ-ZZZZ-ZZZZ")
    assert judge(w, shown, "link lost", "code")
    assert not w.moved()
    assert shown.t < 2


def test_no_tracker_at_all_is_given_up_and_nothing_moves(watched):
    w = watched()
    w.tracker.restart(99)
    shown = w.run()
    assert judge(w, shown, "link lost", "start the tracker")
    assert not w.moved()


def test_an_arm_that_is_not_homed_does_not_move(watched):
    w = watched(homed=False)
    shown = w.run()
    assert shown.status == 1
    assert shown.err.count("\n") == 1
    assert "driver.py home" in shown.err
    assert not w.moved()
    assert shown.log == []


@pytest.mark.short("goal")
@pytest.mark.parametrize("name", ["effector", "goal"])
def test_a_marker_that_is_never_seen_is_named_and_nothing_moves(watched, name):
    w = watched()
    w.hidden.add(name)
    shown = w.run()
    assert judge(w, shown, "marker lost", "effector and goal have not been seen together")
    assert not w.moved()


@pytest.mark.short(every=21)
@pytest.mark.parametrize("seed", range(84))
def test_a_marker_that_no_joint_moves_is_told_with_what_may_be_loose(watched, seed):
    w = watched()
    w.loosen(seed)
    shown = w.run()
    assert judge(w, shown, "singular", "not on the tip")
    assert "far beyond backlash in the arm's file; driver.py check tells" in shown.err


# The disk


def test_a_full_disk_for_the_log_moves_nothing(watched):
    w = watched()
    shown = w.run("--log", "/dev/full")
    assert shown.status == 1
    assert shown.err.count("\n") == 1
    assert "cannot write /dev/full: No space left on device" in shown.err
    assert not w.moved()


def test_a_log_that_cannot_go_on_stops_the_arm_and_says_so(watched, tmp_path):
    w = watched()

    def fill():
        for name in os.listdir("/dev/fd"):
            with_file = os.path.join("/dev/fd", name)
            if os.path.islink(with_file) and os.readlink(with_file) == str(tmp_path / "log.jsonl"):
                full = os.open("/dev/full", os.O_WRONLY)
                os.dup2(full, int(name))
                os.close(full)

    w.in_motion(3.0, fill)
    shown = w.run()
    assert shown.status == 1
    assert shown.err.count("\n") == 1
    assert "stopped" in shown.err
    assert "log.jsonl: No space left on device" in shown.err
    assert w.statuses[-1].verdict == "stopped"
    assert w.stands(shown.t)


def test_where_the_zero_cannot_be_saved_nothing_moves(watched, tmp_path):
    w = watched()
    os.symlink("/dev/full", str(tmp_path / "planar.json.new"))
    shown = w.run()
    assert judge(w, shown, "stopped", "planar.json: No space left")
    assert not w.moved()


BOTH = "it is blocked, overloaded or its encoder is dead"
TURNS = "(port A) does not count, though camera A sees it turn by about"
STANDS = ", and camera A sees it stand: it is blocked or overloaded"


@pytest.mark.parametrize(
    ("fault", "is_seen", "says"),
    [
        ("kill_encoder", True, [TURNS]),
        ("kill_encoder", False, [BOTH]),
        ("jam", True, [BOTH, STANDS]),  # by how much it should have turned, which is little here
    ],
)
def test_the_camera_names_a_dead_encoder_and_no_other_joint_so(watched, fault, is_seen, says):
    w = watched(plant="cpu=0")  # the same on every Python

    def strike():
        getattr(w.brick, fault)("A")
        if not is_seen:
            hide(w)

    w.in_motion(4.0, strike, 0)
    shown = w.run("--mode", "look")
    assert judge(w, shown, "stalled")
    assert any(text in shown.err for text in says)
    if TURNS in says:
        reported = float(shown.err.split("by about ")[1].split(" deg")[0])
        struck = next(m for m in w.moments if m.t >= w.struck)
        assert reported == pytest.approx(math.degrees(abs(w.q[0] - struck.q[0])), rel=0.3)


@pytest.mark.parametrize("blind", ["A", "B"])
def test_while_one_of_two_cameras_sees_nothing_the_arm_goes_at_half_speed(watched, blind):
    """At full speed a link turns by 60 deg/s and more."""
    cameras = {"A": Camera(), "B": Camera(math.radians(-15), math.radians(60))}
    w = watched(plant="cpu=0", cameras=cameras)
    w.in_motion(1.0, lambda: w.hidden.add(blind))
    shown = w.run("--mode", "look")
    assert judge(w, shown, "converged")
    noticed = w.struck + SIGHT_TIMEOUT + 0.05
    steps = [shown.began + line["t"] for line in shown.log if line["kind"] == "step"]
    first = min(t for t in steps if t > noticed)
    since = [math.degrees(m.speed) for m in w.moments if m.t > first]
    turning = sorted(speed for speed in since if speed > 5)
    assert 25 < turning[len(turning) * 3 // 4] < 40, "30 deg/s; crossing the play is faster"


def test_a_cable_that_is_pulled_after_a_stall_does_not_hide_it(watched):
    w = watched()

    def pull_at_rest():
        if w.moments[-1].driven:
            w.world.at(w.world.t + 0.001, pull_at_rest)
        else:
            w.brick.unplug("A")

    def strike():
        w.brick.jam("A")
        w.world.at(w.world.t + 0.05, pull_at_rest)

    w.in_motion(5.0, strike, 0)
    assert judge(w, w.run("--mode", "look"), "stalled", BOTH)
