"""An arm that gravity pulls: how it is driven, held, homed and parked; judged by the true links."""

import math
import signal

import pytest
from one_run import one_run
from rig import Shell, degrees, described, far, switched_on, zero_of

from robot.motion.control_loop import Stalled
from robot.motion.gravity import Gravity
from robot.motion.kinematics import Unreachable, forward, joint_positions

REST = (-15, -30)
LINE = ("line", "14,0,6", "14,0,9")


def lowest(rig, since=0.0):
    """The least height of elbow and tip since then, cm."""
    return min(
        p[2]
        for sample in rig.brick.record
        if sample.t >= since
        for p in joint_positions(rig.arm, sample.q)[1:]
    )


def held(rig):
    return {rig.brick.motors[port].mode for port in "ABC"} == {"hold"}


# Driving it


@pytest.mark.short("go_to-lowered", "reach-over the top", "go_to-hanging")
@pytest.mark.parametrize(
    ("direction", "sides"),
    [
        (((0, 60, -40), (0, 20, -80)), (0, 1, 1)),  # down again: it lies as it lay
        (((30, 60, -60), (10, 125, -110)), (-1, -1, 1)),  # over the top it falls backwards
        (((0, 20, -115), (0, 20, -105), (0, 20, -112)), (0, 1, -1)),  # a forearm that hangs
    ],
    ids=["lowered", "over the top", "hanging"],
)
@pytest.mark.parametrize("move", ["go_to", "reach"])
def test_gravity_says_where_the_play_lies(tmp_path, move, direction, sides):
    with switched_on(tmp_path, described("spatial", 4)) as rig:
        robot = rig.robot()
        for q in direction:
            getattr(robot, move)(degrees(*q))
            assert far(rig.q, degrees(*q)) < 0.8, "half the play is 2 deg"
            assert far(robot.angles(), rig.q) < 0.5
        assert robot.backlash_sides[1:] == sides[1:]
        assert robot.backlash_sides[0] in (sides[0], 0)


def test_a_driver_that_does_not_count_on_it_is_off_by_the_play(tmp_path):
    with switched_on(tmp_path, described("spatial", 4)) as rig:
        robot = rig.robot(gravity=rig.its(Gravity)(rig.arm, preloads=False))
        robot.go_to(degrees(0, 60, -40))
        robot.go_to(degrees(0, 20, -40))
        assert robot.backlash_sides[1] == -1
        assert far(rig.q[1:2], degrees(20)) > 3


def test_a_followed_arm_does_not_sag_when_it_is_taken_over(tmp_path):
    """Stretched out level, from held to driven; on a weak battery, of which nobody knows."""
    q = degrees(0, 0, 0)
    sagged = {}
    for known in (True, False):
        arm = described("spatial", 0)
        with switched_on(tmp_path / str(known), arm, "voltage=6.5", start=q) as rig:
            rig.world.sleep(1)
            robot = rig.robot(gravity=rig.its(Gravity)(arm, known=known))
            before, begin = rig.q[1], rig.world.now()
            robot.chase(lambda t, _: q if t - begin < 1 else None)  # noqa: B023
            late = [s.q[1] for s in rig.brick.record if begin < s.t < begin + 1]
            sagged[known] = math.degrees(before - min(late))
    assert sagged[True] < 0.05
    assert sagged[False] > 0.15


def test_what_is_taken_as_it_stands_lies_as_gravity_presses_it(tmp_path):
    start = degrees(0, 47, -58)  # of the motors; the links hang 2 deg lower
    with switched_on(tmp_path, described("spatial", 4), start=start, homed=False) as rig:
        rig.world.sleep(1)
        robot = rig.robot(awake=False)
        robot.home(here=True)
        assert far(rig.q[1:], degrees(45, -60)) < 0.3
        assert far(robot.angles()[1:], rig.q[1:]) < 0.5


@pytest.mark.short("-dropped")
@pytest.mark.parametrize("dropped", [False, True], ids=["held", "dropped"])
@pytest.mark.parametrize("plant", ["", "voltage=6.5", "seed=5"])
def test_it_is_homed_against_its_weight(tmp_path, plant, dropped):
    start = degrees(20, 30, -20)
    with switched_on(tmp_path, "spatial", plant, start=start, homed=False) as rig:
        zero = zero_of(rig.arm, start)
        if dropped:
            rig.brick.reset_motors()
            rig.world.sleep(2)
            assert rig.q[1] < degrees(-10)[0]
        robot = rig.robot(awake=False)
        found = robot.home(say=lambda line: None, seek=True)
        for f, joint in zip(found, rig.arm.joints):
            assert abs(f.zero - zero[joint.port]) / joint.gear < 0.6
        robot.go_to(degrees(0, 45, -60))
        assert far(rig.q, degrees(0, 45, -60)) < 1.0


# Held


def test_stopped_in_mid_motion_it_is_held(tmp_path):
    class Enough(Exception):
        pass

    with switched_on(tmp_path, "spatial") as rig:
        robot = rig.robot()

        def watch(t, q):
            if t > 0.4:
                raise Enough

        with pytest.raises(Enough):
            robot.go_to(degrees(60, 0, 0), on_tick=watch)
        rig.world.sleep(0.3)
        assert held(rig)
        before = rig.q
        rig.world.sleep(10)
        assert far(rig.q, before) < 0.1


# Parked low


@pytest.mark.short("(50, 45, -60)", "(0, 5, -70)")
@pytest.mark.parametrize(
    "start", [(50, 45, -60), (-20, 110, -100), (0, 0, 0), (100, -20, 20), (0, 5, -70)], ids=str
)
def test_it_goes_low_slowly_and_off_the_table_and_its_base_stays(tmp_path, start):
    with switched_on(tmp_path, "spatial", start=degrees(*start)) as rig:
        robot = rig.robot()
        robot.go_to(degrees(*start))
        begin = rig.world.now()
        robot.park(low=True)
        assert held(rig)
        rig.world.sleep(5)
        assert far(rig.q[1:], degrees(*REST)) < 0.8
        assert far(rig.q[:1], degrees(start[0])) < 1.2
        assert lowest(rig, begin) > 0.5
        late = [sample for sample in rig.brick.record if sample.t > begin]
        for k, joint in enumerate(rig.arm.joints):
            steps = [abs(b.q[k] - a.q[k]) / (b.t - a.t) for a, b in zip(late[::20], late[20::20])]
            assert max(steps) < 0.5 * joint.max_speed
        assert rig.on_file()["parked"] is not None
        assert far(rig.robot().angles()[1:], rig.q[1:]) < 0.5


def test_a_way_that_would_touch_the_table_leads_over_the_home_pose(tmp_path):
    """Folded back under itself, straight to the rest the tip would dip."""
    start = (0, -5, -115)
    arm = described("spatial")
    straight = [
        forward(arm, [math.radians(a + (b - a) * k / 20.0) for a, b in zip(start, (0, *REST))])[2]
        for k in range(21)
    ]
    assert min(straight) < 0.9
    with switched_on(tmp_path, arm, start=degrees(*start)) as rig:
        robot = rig.robot()
        robot.go_to(degrees(*start))
        begin = rig.world.now()
        assert robot.go_low()
        assert far(rig.q[1:], degrees(*REST)) < 0.8
        assert lowest(rig, begin) > 0.8
        home = degrees(45, -60)
        assert min(far(s.q[1:], home) for s in rig.brick.record if s.t > begin) < 2


def test_where_no_way_is_free_it_is_held_where_it_is(tmp_path):
    arm = described("spatial")
    base, shoulder, elbow = arm.joints
    deep = arm._replace(joints=(base, shoulder, elbow._replace(park_angle=math.radians(-60))))
    with switched_on(tmp_path, deep) as rig:
        robot = rig.robot()
        robot.go_to(degrees(0, 50, -60))
        with pytest.raises(rig.its(Unreachable), match="table") as error:
            robot.go_low()
        assert "\n" not in str(error.value)
        robot.park(low=True)
        assert held(rig)
        assert far(rig.q, degrees(0, 50, -60)) < 1.0
        assert rig.on_file()["parked"] is not None


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_what_has_not_moved_or_has_no_resting_place_is_not_parked_low(tmp_path, name):
    with switched_on(tmp_path, name) as rig:
        robot = rig.robot()
        assert not robot.go_low()
        robot.park(low=True)
        assert rig.writes == []
    if name == "planar":
        with switched_on(tmp_path / "moved", name) as rig:
            robot = rig.robot()
            robot.go_to(degrees(40, 40))
            robot.park(low=True)
            assert far(rig.q, degrees(40, 40)) < 2


# The command line


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    return lambda **options: Shell(tmp_path, monkeypatch, capsys, arm="spatial", **options)


UNDISTURBED = []


@pytest.fixture
def undisturbed(tmp_path_factory, monkeypatch, capsys):
    """A Shell in which LINE was drawn and nothing went wrong, and what it showed."""
    if not UNDISTURBED:
        with monkeypatch.context() as patch:
            sh = Shell(tmp_path_factory.mktemp("undisturbed"), patch, capsys, arm="spatial")
            UNDISTURBED.extend((sh, sh.run(*LINE)))
    return UNDISTURBED


def low(sh):
    return far(sh.q[1:], degrees(*REST)) < 1.0


@pytest.mark.short("a line")
@pytest.mark.parametrize(
    ("args", "goes"),
    [(LINE, True), ((*LINE, "--stay"), False), (("move", "14,0,10"), False)],
    ids=["a line", "told to stay", "a move"],
)
def test_after_a_drawing_it_goes_low_and_says_so(shell, args, goes):
    sh = shell()
    shown = sh.run(*args)
    assert shown.status == 0
    assert ("gone low" in shown.out) is goes
    assert low(sh) is goes
    assert held(sh)
    assert sh.run("line", "12,-3,8", "12,3,8").status == 0, "and the next program goes on"


def test_looking_does_not_make_it_go_low(shell):
    sh = shell()
    assert "gone low" not in sh.run("where").out
    assert sh.writes == []


@pytest.mark.short("the way down")
@pytest.mark.parametrize("part", ["the line", "the way down"])
def test_a_signal_holds_it_where_it_is(undisturbed, shell, part):
    before, it = undisturbed
    share = {"the line": before.when("ink", 0.5), "the way down": it.t - 1.0}[part]
    sh = shell()
    shown = sh.run(*LINE, signals=[(share, signal.SIGTERM), (share + 0.05, signal.SIGTERM)])
    assert shown.status == 143
    assert "gone low" not in shown.out
    assert not low(sh)
    assert held(sh)
    assert sh.motion(share + 0.4) < 1.5, "through its play at most"
    assert sh.on_file()["parked"] is not None


def test_after_a_fault_it_is_held_where_it_is(undisturbed, shell):
    t = undisturbed[0].when("ink", 0.5)
    sh = shell()
    sh.world.at(t, lambda: sh.brick.jam("C"))
    shown = sh.run(*LINE)
    assert shown.status == 1
    assert "the elbow (port C)" in shown.err
    assert "gone low" not in shown.out
    assert held(sh)
    assert sh.motion(shown.t + 0.3) < 0.2


@pytest.mark.short("0.5")
@pytest.mark.parametrize("share", [0.1, 0.5])
def test_a_frozen_program_holds_it(undisturbed, shell, share):
    t = undisturbed[0].when("ink", share)
    sh = shell()
    sh.run(*LINE, freeze_at=t)
    assert held(sh)
    assert sh.motion(t + 0.5) < 1.0


def test_a_stall_on_the_way_down_ends_in_one_line(tmp_path):
    with switched_on(tmp_path, "spatial") as rig:
        robot = rig.robot()
        robot.go_to(degrees(0, 60, -60))
        rig.world.at(rig.world.now() + 0.8, lambda: rig.brick.jam("B"))
        with pytest.raises(rig.its(Stalled)):
            robot.park(low=True)
        robot.park()
        assert held(rig)
        assert rig.on_file()["parked"] is None, "blocked or blind looks the same"


# The emulated brick under it


@pytest.mark.parametrize(("start", "drops"), [("lost", True), ("home", False)])
def test_a_lost_arm_has_dropped_and_a_parked_one_is_held(tmp_path, start, drops):
    script = tmp_path / "wait.py"
    script.write_text("import time\ntime.sleep(3)\n")
    arm = described("spatial")
    shown = one_run(arm, script, start=start)
    stop = math.degrees(arm.joints[1].stop_lower)
    assert (math.degrees(shown.record[-1].q[1]) == pytest.approx(stop)) is drops
    assert {shown.motors[port]["mode"] for port in "ABC"} == {"coast" if drops else "hold"}
