"""visual_servoing.py as people start it: its words, its log, what it tells the laptop, its limits.

It runs as a program on the emulated brick; where the arm truly was tells whether it is right. What
happens when something goes wrong is in test_servo_faults.
"""

import json
import math
import re
import signal

import pytest
from servo_rig import PROGRAM, Camera, Watched, circling

from laptop.see.serve.server_state import ServerState
from robot.motion import kinematics
from robot.servoing.loop import CHASE_TIMEOUT
from shared.messages import Start, Stop

PIXEL = 230.0, 185.0


UNDISTURBED = {}


@pytest.fixture(params=["look", "stream"])
def undisturbed(request, tmp_path_factory, monkeypatch, capsys):
    """A run that nothing disturbs, and what it showed; one of each mode for all tests."""
    mode = request.param
    if mode not in UNDISTURBED:
        w = Watched(tmp_path_factory.mktemp(mode), monkeypatch, capsys)
        UNDISTURBED[mode] = mode, w, w.run("--mode", mode)
        w.tracker.close()
    return UNDISTURBED[mode]


def converged(w, shown, goal=None):
    """Whether it says so, and it is true."""
    assert (shown.status, shown.err) == (0, "")
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error(goal) < 7, "claimed, but not true"
    return True


# The command line


REFUSED = [
    ("a goal that is none", ("--goal", "there"), 2, "'there' is no goal"),
    ("one number", ("--goal", "400"), 2, "'400' is no goal"),
    ("no number", ("--goal", "nan,3"), 2, "'nan,3' is no goal"),
    ("far away", ("--goal", "400,1e9"), 2, "is no goal"),
    ("tolerance 0", ("--tolerance", "0"), 2, "from 0.5 to 200 px"),
    ("tolerance NaN", ("--tolerance", "nan"), 2, "from 0.5 to 200 px"),
    ("budget in words", ("--budget", "long"), 2, "'long' must be a number from 1 to 3600 s"),
    ("a method", ("--method", "magic"), 2, "'magic'"),
    ("a mode", ("--mode", "fast"), 2, "'fast'"),
    ("report and stream", ("--method", "report", "--mode", "stream"), 2, "take the mode look"),
    ("follow and look", ("--follow", "--mode", "look"), 2, "in the mode stream only"),
    (
        "follow a pixel",
        ("--follow", "--mode", "stream", "--goal", "3,4"),
        2,
        "only a goal marker can be followed",
    ),
    ("a code", ("--code", "1"), 1, "code"),
    ("a place", ("a b",), 1, "'a b' is no host"),
    ("an arm", ("--arm", "triangular"), 1, "triangular"),
    ("an arm file", ("--arm", PROGRAM), 1, "visual_servoing.py"),
    ("no folder for the log", ("--log", "/nowhere/log"), 1, "cannot write /nowhere/log"),
    ("a folder as log", ("--log", "/"), 1, "cannot write /: Is a directory; give another"),
]


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("args", "status", "says"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED]
)
def test_what_cannot_be_is_refused_in_one_line_and_nothing_moves(watched, args, status, says):
    w = watched()
    shown = w.run(*args, aftermath=0.1)
    assert shown.status == status
    assert shown.err.count("\n") == 1
    assert shown.err.startswith("visual_servoing.py: ")
    assert says in shown.err
    assert shown.log == []
    assert not w.moved()


# What it does


def test_it_reaches_the_goal_marker_and_holds_there(undisturbed):
    _, w, shown = undisturbed
    assert converged(w, shown)
    assert w.stands(shown.t)
    assert all(w.brick.motors[port].mode == "hold" for port in "AB")
    assert w.on_file()["parked"] is not None


def test_a_pixel_needs_no_goal_marker(watched):
    w = watched(goal=None)
    shown = w.run("--goal", "{:g},{:g}".format(*PIXEL))
    assert converged(w, shown, PIXEL)
    assert shown.log[0]["goal"] == {"A": list(PIXEL)}
    assert {tuple(line["goal"]) for line in shown.log if line["kind"] == "seen"} == {PIXEL}


@pytest.mark.long
def test_a_pixel_is_preferred_to_a_goal_marker(watched):
    w = watched()
    assert converged(w, w.run("--mode", "stream", "--goal", "{:g},{:g}".format(*PIXEL)), PIXEL)


@pytest.mark.long
def test_the_goal_may_be_hidden_by_the_arm_from_some_time_on(watched):
    w = watched()
    w.world.at(1.5, lambda: w.hidden.add("goal"))
    assert converged(w, w.run())


@pytest.mark.short("stream")
@pytest.mark.parametrize("mode", ["look", "stream"])
def test_a_goal_that_is_moved_in_mid_run_is_reached_where_it_lies_then(watched, mode):
    w = watched()
    w.world.at(4.2, lambda: setattr(w, "goal", (10.0, 12.0)))
    assert converged(w, w.run("--mode", mode))


def test_geared_joints_reach_it_too(watched):
    w = watched(arm="geared", tracker={"latency": 0.12, "jitter": 0.005, "drops": 0.1})
    assert converged(w, w.run())


def test_a_goal_where_the_arm_is_already_takes_no_move(watched):
    w = watched(goal=(20.8, 0.1))
    shown = w.run()
    assert converged(w, shown)
    assert shown.log[-1]["moves"] == 0
    assert not w.moved()


@pytest.mark.long
def test_a_tighter_tolerance_is_kept(watched):
    w = watched(goal=(4.0, 13.0), noise=0.3, plant="backlash=0")
    assert converged(w, w.run("--tolerance", "3"))
    assert w.error() < 3.5


# What it keeps to


def test_no_joint_turns_faster_than_60_deg_per_s_for_long(undisturbed):
    """Where the play was crossed the link makes up for it: for a moment it is faster."""
    _, w, _ = undisturbed
    rows = [sample.q for sample in w.brick.record]  # one per 5 ms

    def fastest(seconds):
        n = int(200 * seconds)
        pairs = [pair for a, b in zip(rows, rows[n:]) for pair in zip(a, b)]
        return max(math.degrees(abs(b - a)) for a, b in pairs) / seconds

    assert fastest(0.5) < 63
    assert fastest(0.1) < 80


@pytest.mark.long
def test_no_joint_is_ever_past_its_limit(watched):
    w = watched(goal=(-17.0, -4.0))
    w.run("--budget", "30")
    for joint, angles in zip(w.arm.joints, zip(*(m.q for m in w.moments))):
        assert joint.lower <= min(angles)
        assert max(angles) <= joint.upper
    assert max(m.q[0] for m in w.moments) > w.arm.joints[0].upper - math.radians(20)


def test_before_two_cameras_nothing_starts_with_a_goal_in_one(watched):
    one = watched().cameras["A"]
    w = watched(cameras={"A": one, "B": type(one)(roll=-0.4)})
    goals = {name: camera.pixel((-6.0, 10.0)) for name, camera in w.cameras.items()}
    args = ["{}:{:.1f},{:.1f}".format(name, *pixel) for name, pixel in goals.items()]
    shown = w.run("--goal", args[0])
    assert shown.log[-1]["verdict"] == "refused"
    assert "camera B watches, too, and no goal is given in its picture" in shown.err
    assert not w.moved()
    w.tracker.close()
    w = watched(cameras=w.cameras)
    shown = w.run("--goal", args[0], "--goal", args[1])
    assert shown.log[-1]["verdict"] == "converged"
    assert math.dist(w.tip, (-6.0, 10.0)) < 1


def test_what_it_decides_on_was_seen_of_an_arm_that_stood(watched):
    """Pictures that were taken in motion come in for long after it."""
    w = watched(noise=0.0, tracker={"latency": 0.4})
    shown = w.run()
    assert converged(w, shown)
    for step in (line for line in shown.log if line["kind"] == "step"):
        truly = w.brick.record[round(200 * (shown.began + step["t"]))]
        assert math.dist(step["s"], w.cameras["A"].pixel((truly.x, truly.y))) < 1.0


def test_it_never_moves_on_observations_that_are_too_old(watched):
    w = watched(tracker={"latency": 1.3})
    shown = w.run()
    assert shown.log[-1]["verdict"] == "camera late"
    assert "the pictures of camera A come 1.3 s late, and at most 1 s is allowed" in shown.err
    assert "camera late: held" in [line["text"] for line in shown.log if line["kind"] == "note"]
    assert not w.moved()


@pytest.mark.short("2.0-look")
@pytest.mark.parametrize("mode", ["look", "stream"])
@pytest.mark.parametrize("fps", [1.0, 2.0, 3.0])
def test_a_camera_of_a_few_pictures_a_second_is_named_soon(watched, fps, mode):
    w = watched(tracker={"fps": fps})
    shown = w.run("--mode", mode)
    assert shown.log[-1]["verdict"] == "camera slow"
    assert f"camera A gives only {fps:.0f} pictures a second; 7 are needed" in shown.err
    assert shown.t - shown.began < 5
    assert not w.moved()


def test_pictures_that_get_lost_on_the_way_are_not_the_cameras_fault(watched):
    w = watched()
    see = w.tracker.see
    w.tracker.see = lambda name, index, t: see(name, index, t) if index % 15 == 0 else None
    shown = w.run()
    assert shown.log[-1]["verdict"] == "camera slow"
    assert "of the 30 pictures a second of camera A only 2 come here" in shown.err
    assert not w.moved()


def test_a_camera_of_five_pictures_a_second_leads_to_the_goal(watched):
    w = watched(tracker={"fps": 5.0})
    assert converged(w, w.run("--budget", "120"))


def test_sightings_of_little_confidence_are_not_believed(watched):
    w = watched()
    see = w.tracker.see
    w.tracker.see = lambda *at: {name: seen and (*seen[:2], 0.4) for name, seen in see(*at).items()}
    assert w.run().log[-1]["verdict"] == "marker lost"
    assert not w.moved()


@pytest.mark.long
def test_a_chase_of_a_standing_goal_does_not_go_on_for_ever(watched):
    w = watched(goal=(4.0, 13.0))
    see = w.tracker.see

    def wandering(camera, index, t):
        """The tip is seen where it is not: every frame suggests another aim."""
        seen = see(camera, index, t)
        if t > 3:
            u, v, sure = seen["effector"]
            far = 60 * (-1) ** (index // 12)
            seen["effector"] = u + far, v - far, sure
        return seen

    w.tracker.see = wandering
    shown = w.run("--mode", "stream", "--budget", "14")
    steps = [line["t"] for line in shown.log if line["kind"] == "step"]
    # (To come to rest takes a coarse loop longer.)
    assert max(b - a for a, b in zip(steps, [*steps[1:], 14.0])) < CHASE_TIMEOUT + 2.5


# Following


@pytest.mark.long
def test_a_goal_that_moves_is_followed_until_the_budget_is_spent(watched):
    w = watched()
    goal = circling(w, 1.5)
    shown = w.run("--mode", "stream", "--follow", "--budget", "12.1", "--tolerance", "10")
    assert shown.status == 0
    assert shown.log[-1]["verdict"] == "converged"
    assert 12.1 < shown.t - shown.began < 12.45  # it is looked at messages every 0.15 s
    off = [
        math.dist(
            w.cameras["A"].pixel(kinematics.forward(w.arm, m.q)), w.cameras["A"].pixel(goal(m.t))
        )
        for m in w.moments[::10]
        if 8 < m.t < 12
    ]
    assert len(off) > 100
    assert sum(off) / len(off) < 10
    assert w.stands(shown.began + 12.45)


@pytest.mark.long
def test_who_follows_holds_when_the_goal_has_vanished(watched):
    w = watched()
    circling(w, 1.5)
    w.world.at(8.0, lambda: w.hidden.add("goal"))
    shown = w.run("--mode", "stream", "--follow", "--budget", "40", "--tolerance", "10")
    assert shown.log[-1]["verdict"] == "marker lost"
    assert "the goal" in shown.log[-1]["reason"]
    assert "marker lost: held" in [line["text"] for line in shown.log if line["kind"] == "note"]
    assert w.stands(9.2)


@pytest.mark.short("4")
@pytest.mark.parametrize("over", [1, 4])
def test_an_arm_that_begins_beyond_a_limit_comes_back(watched, over):
    w = watched(start=(0.3, math.radians(150 + over)))
    assert converged(w, w.run())


@pytest.mark.long
def test_a_camera_that_goes_blind_in_mid_measurement_does_not_hang_it(watched):
    w = watched(cameras={"A": Camera(), "B": Camera(roll=0.0)})
    see = w.tracker.see

    def blinded(camera, index, t):
        return (
            {"effector": None, "goal": None}
            if camera == "B" and t > 0.15
            else see(camera, index, t)
        )

    w.tracker.see = blinded
    assert converged(w, w.run())


@pytest.mark.long
def test_a_marker_in_too_few_pictures_is_blamed_when_the_budget_is_spent(watched):
    """The camera gives enough of them."""
    w = watched()
    see = w.tracker.see
    w.tracker.see = lambda name, index, t: dict(
        see(name, index, t), **({"effector": None} if index % 10 else {})
    )
    shown = w.run("--budget", "20")
    assert shown.log[-1]["verdict"] == "budget spent"
    few = r"20 s; (2\.9|3\.0) pictures a second with the marker in them, 7 are needed"
    assert re.search(few, shown.err)


@pytest.mark.long
def test_following_ends_when_the_laptop_says_so(watched):
    w = watched()
    circling(w, 1.5)
    w.world.at(9.0, lambda: w.tracker.server.send(Stop("enough")))
    shown = w.run("--mode", "stream", "--follow", "--tolerance", "10")
    assert shown.status == 0
    assert 9.0 < shown.t < 9.5


@pytest.mark.long
def test_a_goal_that_is_too_fast_is_not_called_reached(watched):
    w = watched()
    circling(w, 25.0)
    shown = w.run("--mode", "stream", "--follow", "--budget", "8")
    assert shown.status == 1
    assert "budget spent" in shown.err


@pytest.mark.long
def test_who_follows_does_not_end_at_a_goal_that_stands(watched):
    w = watched()
    shown = w.run("--mode", "stream", "--follow", "--budget", "14")
    assert converged(w, shown)
    assert shown.t > 14


# What it tells


KEYS = {
    "run": "arm budget clock goal joints kind method mode rows tolerance version",
    "seen": "camera goal kind q s t",
    "step": "J action computing condition error frames goal kind model q q_wanted rows s sigma t",
    "note": "kind t text",
    "verdict": "error frames kind measurements moves q reason t verdict",
}


def check_log(lines):
    """Raise unless every line is as described, in order of what happened."""
    kinds = [line["kind"] for line in lines]
    assert kinds[0] == "run"
    assert kinds.count("run") == kinds.count("verdict") == 1
    assert kinds[-1] == "verdict"
    for line in lines:
        assert sorted(line) == sorted(KEYS[line["kind"]].split())
    late = [line["t"] for line in lines if line["kind"] in ("step", "note", "verdict")]
    assert late == sorted(late)


def test_the_log_is_as_described(undisturbed):
    mode, w, shown = undisturbed
    check_log(shown.log)
    first, last = shown.log[0], shown.log[-1]
    assert (first["version"], first["method"], first["mode"]) == (1, "chain", mode)
    assert (first["arm"], first["joints"]) == ("planar", ["shoulder", "elbow"])
    assert (first["tolerance"], first["budget"], first["goal"]) == (5.0, 60.0, "marker")
    assert last["q"] == pytest.approx(w.q, abs=math.radians(3))
    assert last["error"] < 5
    steps = [line for line in shown.log if line["kind"] == "step"]
    assert last["measurements"] == len(steps)
    assert last["moves"] == len(steps) - 1
    assert last["frames"] == sum(step["frames"] for step in steps)
    # (What is at the goal at once may have to show by exploring motions that it is the tip.)
    at_goal = next(k for k, step in enumerate(steps) if step["error"] < 5)
    explored = [step["action"] for step in steps[:at_goal]].count("explore")
    assert explored == {"look": 2, "stream": 1}[mode]
    assert steps[-1]["action"] == "hold"
    for step in steps:
        assert step["error"] == pytest.approx(math.dist(step["s"], step["goal"]))
        assert (step["q_wanted"] is None) == (step is steps[-1])
    assert len(steps[-1]["J"]) == 2
    assert steps[-1]["condition"] > 1


def test_what_was_seen_is_logged_with_the_angles_at_its_time(undisturbed):
    """Within the play and the counts, and 10 ms of a joint at full speed."""
    _, w, shown = undisturbed
    seen = [line for line in shown.log if line["kind"] == "seen" and line["q"]]
    assert len(seen) > 30
    for line in seen:
        truly = w.brick.record[int(round(200 * (shown.began + line["t"])))].q
        assert line["q"] == pytest.approx(truly, abs=math.radians(4))
        assert math.dist(line["goal"], Camera().pixel(w.goal)) < 2.5


def test_the_log_is_whole_after_a_signal(watched):
    w = watched()
    shown = w.run(signals=[(2.0, signal.SIGTERM)])
    check_log(shown.log)
    assert shown.log[-1]["verdict"] == "stopped"
    assert shown.log[-1]["reason"] == "stopped by SIGTERM"


def test_every_move_and_the_end_is_told_in_a_line(undisturbed):
    mode, _, shown = undisturbed
    lines = shown.out.splitlines()
    moves = [line for line in lines if line.startswith("move ")]
    assert len(moves) == shown.log[-1]["moves"]
    for number, line in enumerate(moves, 1):
        assert line.startswith(f"move {number}: ")
        assert line.endswith(" deg")
    first = {"look": "+8.0 +0.0", "stream": "+8.0 +8.0"}[mode]
    assert f"explore, {first} deg" in moves[0]
    assert all("chain" in move or "explore" in move for move in moves)
    assert lines[-1].startswith("converged: ")
    assert f"after {len(moves)} move" in lines[-1]


def test_the_laptop_is_told_how_it_goes_and_how_it_ended(undisturbed):
    _, w, shown = undisturbed
    assert len(w.statuses) > 15
    assert [status.verdict for status in w.statuses[:-1]] == [""] * (len(w.statuses) - 1)
    last = w.statuses[-1]
    assert last.verdict == "converged"
    assert last.error == pytest.approx(shown.log[-1]["error"], abs=0.01)
    assert last.q == pytest.approx(w.q, abs=math.radians(3))
    assert w.tracker.server.state() == ServerState(lost=w.tracker.server.state().lost), (
        "nobody is served any more"
    )
    assert "the run has ended" in w.tracker.server.state().lost


def test_the_laptops_start_message_does_not_disturb(watched):
    w = watched()
    w.world.at(2.0, lambda: w.tracker.server.send(Start()))
    assert converged(w, w.run())


def test_a_log_of_a_killed_program_has_all_steps_but_the_last(watched, tmp_path):
    w = watched()
    shown = w.run(kill_at=4.4)
    assert shown.status == 137
    reported = shown.out.count("\nmove ")
    text = (tmp_path / "log.jsonl").read_text()
    assert [json.loads(line)["kind"] for line in text.splitlines()].count("step") == reported


@pytest.mark.parametrize(
    ("args", "mode"),
    [((), "stream"), (("--method", "report"), "look"), (("--mode", "look"), "look")],
)
def test_it_steers_while_it_moves_where_the_method_can(watched, args, mode):
    shown = watched().run(*args, "--budget", "2")
    assert shown.log[0]["mode"] == mode
