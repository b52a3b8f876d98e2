"""An arm in space between two cameras: what one of them loses, how late they are, where they stand.

What was reached, and that nothing moved on guesses, is read from the emulated plant.
"""

import math
import random
import signal
from collections import namedtuple

import pytest
from rig import degrees
from servo_rig import NOT_YET, Camera, SpaceCamera, Watched, circling

from robot.motion import kinematics
from robot.servoing.loop import TOO_SLOW_TO_STEER
from robot.servoing.rows import Rows
from shared.arm_description import find_arm, read_arm

ABOVE, SIDE = SpaceCamera(math.radians(10)), SpaceCamera(math.radians(90))
START, GOAL = degrees(-30, 60, -80), (11.0, 8.0, 8.0)
IN_SPACE = {"arm": "spatial", "start": START, "goal": GOAL, "cameras": {"A": ABOVE, "B": SIDE}}
MIDST = 3.0
"""In the midst of a long move, s."""

FAR = 9.0
"""Farther from the goal than this nothing has been reached, mm."""


@pytest.fixture
def space(watched):
    """A spatial arm between two cameras, see servo_rig.Watched."""

    def build(cameras=None, **options):
        options = {**IN_SPACE, **options}
        return watched(**options if cameras is None else {**options, "cameras": cameras})

    return build


def miss(w):
    """True distance of the tip from the goal, mm."""
    return 10 * math.dist(w.tip, w.goal)


def judge(w, shown, verdict, says=""):
    """Whether verdict, message, status and truth agree; the arm stands."""
    assert "Traceback" not in shown.out + shown.err
    assert shown.log[-1]["verdict"] == verdict, shown.log[-1]
    assert (shown.status == 0) == (verdict == "converged")
    assert says in shown.err
    if verdict == "converged":
        assert w.error() < 7
        assert miss(w) < FAR
    assert w.stands(shown.t + 0.5)
    return True


def notes(shown):
    return [line["text"] for line in shown.log if line["kind"] == "note"]


@pytest.mark.parametrize("cpu", [1, 2])
def test_a_brick_that_is_too_slow_to_be_steered_looks_then_moves(space, cpu):
    # (With some set-ups what two cameras say takes a brick of half the speed as long to receive as
    # the motors' dead-man waits, and it says `too slow`.)
    w = space(plant=f"cpu={cpu}", seed=4)
    shown = w.run("--mode", "stream")
    assert judge(w, shown, "converged")
    assert [note for note in notes(shown) if "too slow" in note] == [TOO_SLOW_TO_STEER] * (cpu - 1)


@pytest.mark.short("chain-stereo")
@pytest.mark.parametrize(
    ("method", "rows"),
    [("chain", "stereo"), ("chain", "xyz"), ("kalman", "xyz")],
)
def test_the_goal_is_reached_in_space(space, method, rows):
    # A row of B may by bad luck tell less than it seems to: `xyz` has no other, and may miss then.
    for seed in range(3, 7 if rows == "xyz" else 4):
        w = space(seed=seed)
        shown = w.run("--method", method, "--rows", rows)
        if w.error() < 7:
            break
    assert judge(w, shown, "converged")
    last = [line for line in shown.log if line["kind"] == "step"][-1]
    assert len(last["J"][0]) == 3
    expected = {"stereo": ["A.u", "A.v", "B.u", "B.v"], "xyz": ["A.u", "A.v", "B.v"]}[rows]
    assert last["rows"] == expected
    assert len(last["s"]) == len(last["goal"]) == len(last["J"]) == len(expected)


@pytest.mark.long
def test_the_third_row_can_be_asked_for(space):
    for seed in range(1, 5):  # see above
        w = space({"A": ABOVE, "B": SpaceCamera(math.radians(50))}, seed=seed)
        shown = w.run("--rows", "xyz", "--third", "v", "--budget", "30")
        if miss(w) < 9:
            break
    assert judge(w, shown, "converged")
    rows = {tuple(line["rows"]) for line in shown.log if line["kind"] == "step"}
    assert ("A.u", "A.v", "B.v") in rows


@pytest.mark.long
def test_a_third_row_that_tells_nothing_new_is_not_believed(space):
    """Seen from the side, u says what u from above says."""
    # Not in most lucks, that is: where perspective makes the row look as if it told something.
    for seed in range(1, 7):
        w = space(seed=seed)
        shown = w.run("--rows", "xyz", "--third", "u", "--budget", "60")
        if shown.log[-1]["verdict"] == "singular":
            break
    assert judge(w, shown, "singular", "seen by A and B")


@pytest.mark.long
def test_in_space_a_pixel_of_each_camera_is_a_goal(space):
    w = space(goal=GOAL)
    w.hidden.add("goal")
    pixels = {name: camera.pixel(GOAL) for name, camera in w.cameras.items()}
    args = [
        w for name, p in pixels.items() for w in ("--goal", "{}:{:.1f},{:.1f}".format(name, *p))
    ]
    shown = w.run(*args)
    assert judge(w, shown, "converged")


@pytest.mark.short(every=2)
@pytest.mark.parametrize(
    ("goals", "says"),
    [
        (["400,200"], "one pixel does not say where 3 joints are to go"),
        (["A:400,200", "400,210"], "--goal twice for one camera"),
        (["A:400,200", "marker"], "or for a marker and a pixel"),
        (
            ["A:400,200", "C:1,2"],
            "no camera C, of which a pixel is the goal; those that send are A and B",
        ),
    ],
)
def test_a_goal_that_is_none_is_refused_and_nothing_moves(space, goals, says):
    w = space()
    shown = w.run(*(word for goal in goals for word in ("--goal", goal)))
    assert shown.status != 0
    assert says in shown.err
    assert shown.err.count("\n") == 1
    assert not w.moved()


@pytest.mark.long
def test_a_signal_on_the_way_down_stops_it(space, tmp_path_factory, monkeypatch, capsys):
    with monkeypatch.context() as patch:
        undisturbed = Watched(tmp_path_factory.mktemp("undisturbed"), patch, capsys, **IN_SPACE)
        shown = undisturbed.run("--low")
        undisturbed.tracker.close()
    t = shown.t - 1.0
    w = space()
    shown = w.run("--low", signals=[(t, signal.SIGTERM)])
    assert shown.log[-1]["verdict"] == "converged"
    assert any(m.speed > 0.1 for m in w.moments if t - 0.1 < m.t < t)
    assert shown.status == 128 + signal.SIGTERM
    assert w.stands(t + 0.5)


@pytest.mark.long
@pytest.mark.parametrize("low", [False, True])
def test_it_stays_at_the_goal_unless_told_to_go_low(space, low):
    w = space()
    shown = w.run(*["--low"] * low)
    assert shown.status == 0
    rest = [joint.park_angle for joint in w.arm.joints]
    off = max(abs(a - b) for a, b in zip(w.q[1:], rest[1:], strict=True))
    assert (off < math.radians(2)) == low
    assert (miss(w) < FAR) == (not low)
    assert w.stands(shown.t)


@pytest.mark.long
def test_a_goal_beyond_a_limit_is_had_from_the_other_side(space):
    """Over the base's axis, bent backwards, the shoulder would have to go beyond its limit."""
    arm = read_arm(find_arm("spatial"))
    goal = kinematics.forward(arm, degrees(-84, 102, -66))
    for seed in range(1, 5):
        w = space(goal=goal, start=degrees(80, 100, -59), seed=seed)
        shown = w.run()
        assert judge(w, shown, "converged")
        assert w.q[0] < 0


# One camera loses the marker

Covered = namedtuple("Covered", "cameras which since until verdict says")
TWO, THREE = ("A", "B"), ("A", "B", "C")
COVERED = {
    "above for a blink": Covered(TWO, "A", MIDST, 0.2, "converged", ""),
    "above for 2 s": Covered(TWO, "A", MIDST, 2.0, "converged", ""),
    "side for 2 s": Covered(TWO, "B", MIDST, 2.0, "converged", ""),
    "above for ever": Covered(TWO, "A", MIDST, None, "marker lost", "what B sees is not enough"),
    "side for ever": Covered(TWO, "B", MIDST, None, "marker lost", "what A sees is not enough"),
    "above from the start": Covered(
        TWO, "A", 0.0, None, "marker lost", "what B sees is not enough"
    ),
    "side from the start": Covered(TWO, "B", 0.0, None, "marker lost", "what A sees is not enough"),
    "side for the first 4 s": Covered(TWO, "B", 0.0, 4.0, "converged", ""),
    "both for 2 s": Covered(TWO, "AB", MIDST, 2.0, "converged", ""),
    "one of three for ever": Covered(THREE, "B", MIDST, None, "converged", ""),
    "one of three from the start": Covered(THREE, "A", 0.0, None, "converged", ""),
    "one of three comes late": Covered(THREE, "C", 0.0, 5.0, "converged", ""),
}
PLACES = {"A": ABOVE, "B": SIDE, "C": SpaceCamera(math.radians(60), math.radians(70))}


STREAMED = "side for 2 s", "above for ever", "one of three for ever", "one of three comes late"


@pytest.mark.short("above for 2 s-look", "side for ever-look", "one of three for ever-stream")
@pytest.mark.parametrize(
    ("name", "mode"),
    [(name, "look") for name in sorted(COVERED)] + [(name, "stream") for name in STREAMED],
)
def test_a_covered_camera(space, name, mode):
    it = COVERED[name]
    cameras = {camera: PLACES[camera] for camera in it.cameras}
    w = space(cameras)

    def cover():
        w.struck = w.world.t
        w.hidden.update(it.which)
        if it.until:
            w.world.at(w.struck + it.until, w.hidden.clear)

    if it.since:
        w.in_motion(it.since, cover)
    else:
        cover()
    shown = w.run("--mode", mode)
    assert judge(w, shown, it.verdict, it.says)
    left = set(it.cameras) - set(it.which)
    if len(left) < 2:  # nothing moves on guesses
        if it.until is None:
            assert w.stands(w.struck + 0.6)
            assert shown.t < w.struck + 11.5
        elif it.until > 1:
            assert w.stands(w.struck + 0.6, w.struck + it.until)
            assert "marker lost: held" in notes(shown)
    elif it.since:
        on = " and ".join(sorted(left))
        assert f"camera B: marker lost; on with {on}" in notes(shown)
    if not it.since and len(left) < 2 and it.until is None:
        assert not w.moved()


@pytest.mark.short("B-look")
@pytest.mark.parametrize("mode", ["look", "stream"])
@pytest.mark.parametrize("frozen", ["A", "B"])
def test_one_frozen_camera_of_two_holds_an_arm_in_space(space, frozen, mode):
    w = space({camera: PLACES[camera] for camera in TWO})
    w.in_motion(MIDST, lambda: w.tracker.pictures.freeze(frozen))
    shown = w.run("--mode", mode)
    assert judge(w, shown, "picture frozen", f"the picture of camera {frozen} does not change")
    assert w.stands(w.struck + 0.7)


@pytest.mark.long
def test_a_planar_arm_goes_on_with_the_camera_that_is_left(watched):
    """Slower from the next motion on, and it says so."""
    cameras = {"A": watched().cameras["A"]}
    paces = {}
    for hidden in (False, True):
        w = watched(cameras={**cameras, "B": type(cameras["A"])(roll=-0.4)})
        if hidden:
            w.world.at(2.0, lambda w=w: w.hidden.add("B"))
        shown = w.run("--mode", "look")
        assert shown.log[-1]["verdict"] == "converged"
        assert w.error() < 7
        assert ("camera B: marker lost; on with A" in notes(shown)) == hidden
        speeds = sorted(m.speed for m in w.moments if m.t > 3.0 and m.speed > 0.2)
        paces[hidden] = speeds[9 * len(speeds) // 10]  # the greatest is a jerk of a moment
        w.tracker.close()
    assert paces[True] < 0.8 * paces[False]


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--third", "u"], "--third is the second camera's row with --rows xyz"),
        (["--arm", "planar", "--low"], "--low: planar does not say where it rests"),
    ],
)
def test_an_option_that_would_do_nothing_is_refused(space, args, says):
    w = space()
    shown = w.run(*args)
    assert shown.status == 2
    assert says in shown.err
    assert not w.moved()


def twice():
    """Two cameras before a planar arm."""
    return {"cameras": {"A": Camera(), "B": Camera(roll=-0.4)}}


@pytest.mark.long
def test_a_camera_that_is_not_gone_by_is_none_to_go_on_with(watched):
    """B comes while the goal is chased with A alone; when A is lost nothing is known of B.

    It explores in one motion, or joint by joint if the tip seems to be at the goal just then.
    """
    w = watched(plant=NOT_YET, **twice())  # at cpu=1 a control tick takes too long
    w.hidden.add("B")
    circling(w, 1.5)
    w.world.at(4.5, lambda: w.hidden.clear())
    w.world.at(5.0, lambda: w.hidden.add("A"))
    shown = w.run("--mode", "stream", "--follow", "--budget", "14", "--tolerance", "10")
    assert w.stands(5.45, 5.6)
    assert any("held" in text for text in notes(shown))
    assert shown.log[-1]["verdict"] == "converged"
    steps = [line for line in shown.log if line["kind"] == "step"]
    assert [step["action"] for step in steps if step["t"] > 5].count("explore") in (1, 2)


@pytest.mark.long
def test_the_camera_that_is_left_counts_in_full_however_noisy(watched):
    w = watched(plant=NOT_YET, **twice())  # at cpu=1 it takes 11 s
    rng = random.Random(3)
    see = w.tracker.see

    def noisy(camera, index, t):
        seen = see(camera, index, t)
        if camera == "B":
            for name, marker in seen.items():
                if marker:
                    seen[name] = (*(x + rng.gauss(0, 4) for x in marker[:2]), 1.0)
        return seen

    w.tracker.see = noisy
    w.in_motion(3.2, lambda: w.hidden.add("A"))
    shown = w.run("--mode", "stream")
    assert shown.log[-1]["verdict"] == "converged"
    off = [math.dist(kinematics.forward(w.arm, m.q), w.goal) for m in w.moments]
    least = [min(off[: k + 1]) for k in range(0, len(off), 50)]
    assert max(a - b for a, b in zip(off[::50], least, strict=True)) < 3.5
    assert shown.t < 9


@pytest.mark.long
def test_a_blinking_camera_does_not_keep_it_from_giving_up(watched):
    w = watched(goal=(28.0, 10.0), **twice())

    def blink():
        w.hidden ^= {"B"}
        w.world.at(w.world.t + 0.8, blink)

    w.world.at(2.0, blink)
    shown = w.run()
    assert shown.log[-1]["verdict"] in ("unreachable", "limit")
    assert shown.log[-1]["moves"] <= 30  # 28 without the blinking


@pytest.mark.long
def test_what_is_told_of_a_step_is_what_it_was_decided_by(space):
    """Also when a third camera has come, of which little is known yet."""
    w = space(PLACES)
    w.hidden.add("C")
    w.world.at(4.0, lambda: w.hidden.clear())
    shown = w.run()
    for step in (line for line in shown.log if line["kind"] == "step"):
        assert len(step["rows"]) == len(step["s"]) == len(step["goal"])
        assert step["J"] is None or len(step["J"]) in (4, 6)
        if step["action"] == "move":
            assert len(step["J"]) == len(step["rows"])


@pytest.mark.long
def test_the_report_needs_only_the_cameras_whose_rows_count(space):
    w = space(PLACES)
    w.world.at(6.0 + 8, lambda: w.hidden.add("C"))
    shown = w.run("--method", "report", "--rows", "xyz", "--budget", "200", "--tolerance", "8")
    assert shown.log[-1]["verdict"] == "converged"
    steps = [line for line in shown.log if line["kind"] == "step"]
    assert [step["action"] for step in steps[:4]] == ["explore"] * 3 + ["move"]
    assert [len(row) for row in steps[-1]["J"]] == [3, 3, 3]


# How late, and from where


@pytest.mark.short("B-stream")
@pytest.mark.parametrize(("late", "mode"), [("A", "stream"), ("B", "look"), ("B", "stream")])
def test_one_camera_is_100_ms_later_than_the_other(space, late, mode):
    w = space(tracker={"latency": {"A": 0.04, "B": 0.04, late: 0.14}})
    shown = w.run("--mode", mode)
    assert judge(w, shown, "converged")
    assert shown.log[-1]["moves"] <= 12


@pytest.mark.short("45-stereo")
@pytest.mark.parametrize(
    ("between", "rows"),
    [(30, "stereo"), (30, "xyz"), (45, "stereo"), (60, "xyz"), (75, "stereo"), (90, "xyz")],
)
def test_cameras_need_not_be_perpendicular(space, between, rows):
    tilt = math.radians(90 - between)
    w = space({"A": SpaceCamera(tilt), "B": SIDE})
    shown = w.run("--rows", rows)
    assert shown.log[-1]["verdict"] == "converged"
    assert w.error() < 7
    # Depth is told the worse the smaller the angle is.
    assert miss(w) < FAR / math.sin(math.radians(between))
    assert w.stands(shown.t + 0.5)


@pytest.mark.short("0-xyz")
@pytest.mark.parametrize("rows", ["stereo", "xyz"])
@pytest.mark.parametrize("between", [0, 2])
def test_two_cameras_that_see_the_same_are_no_two(space, between, rows):
    """Else it would end where both see the tip at the goal, and the tip be anywhere behind it.

    Two degrees apart, noise may say once that they are two.
    """
    for seed in (1, 2, 3) if between else (1,):
        w = space({"A": SpaceCamera(math.radians(90 - between)), "B": SIDE}, seed=seed)
        shown = w.run("--rows", rows)
        if shown.log[-1]["verdict"] == "singular":
            break
    assert judge(w, shown, "singular", "seen by A and B, the tip may be off")


# Which rows count


def test_the_third_row_is_the_one_that_tells_more():
    first = ((100.0, 0.0, 0.0), (0.0, 100.0, 0.0))
    for second, chosen in (
        (((90.0, 5.0, 10.0), (3.0, 4.0, 40.0)), "B.v"),
        (((20.0, 5.0, 60.0), (300.0, 40.0, 40.0)), "B.u"),
    ):
        rows = Rows("xyz", 3)
        assert rows.names("AB") == ["A.u", "A.v", "B.u", "B.v"]  # until it is known
        rows.choose({"A": first})
        assert rows.suffice("AB")
        rows.choose({"A": first, "B": second, "C": second})
        assert rows.names("ABC") == ["A.u", "A.v", chosen]
        assert rows.suffice("AB")
        assert not rows.suffice("A")
        assert not rows.suffice("BC")


def test_all_rows_count_in_stereo():
    rows = Rows("stereo", 3)
    rows.choose({"A": ((1, 0, 0), (0, 1, 0)), "B": ((0, 1, 0), (0, 0, 1))})
    assert rows.values({"B": (3, 4), "A": (1, 2)}) == [1, 2, 3, 4]
    assert not rows.suffice("A")
    assert rows.suffice("AB")
