"""The arm: how it follows, what it refuses, how it ends; judged by the true link angles."""

import math

import pytest
from rig import REPORT_LINES, degrees, described, far, switched_on, zero_of

from robot.ev3.motors import MotorNotFound
from robot.motion.control_loop import OutOfBounds, Stalled, TooSlow
from robot.motion.kinematics import Unreachable, forward
from robot.motion.online_trajectory import Moving
from robot.motion.paths import polyline
from robot.motion.trajectory import JointMove, Trajectory, plan
from robot.motion.zero import NotHomed, StateNotSaved

ARMS = pytest.mark.parametrize("name", ["planar", "geared"])


class CountingClock:
    """A program's clock; remembers how many accesses were made between two sleeps, and when."""

    def __init__(self, rig):
        self._rig = rig
        self.now = rig.clock.now
        self.start()

    def start(self):
        self._last = self._rig.brick.sysfs.accesses
        self.ticks = []

    def sleep(self, seconds):
        accesses = self._rig.brick.sysfs.accesses
        self.ticks.append((self.now(), accesses - self._last))
        self._last = accesses
        self._rig.clock.sleep(seconds)


@pytest.mark.short("line0-planar", "line1-geared")
@ARMS
@pytest.mark.parametrize("line", REPORT_LINES)
def test_at_most_six_accesses_and_fifty_ticks_a_second(tmp_path, name, line):
    with switched_on(tmp_path, name) as rig:
        clock = CountingClock(rig)
        robot = rig.robot(clock=clock)
        motions = plan(rig.arm, polyline(line), rig.arm.speed)
        robot.pre_approach(motions[0])
        clock.start()
        robot.follow(motions)
    assert max(accesses for _, accesses in clock.ticks[1:]) <= 6
    assert clock.ticks[0][1] <= 8, "with what the dead man is to do"
    when = [t for t, _ in clock.ticks]
    periods = [b - a for a, b in zip(when, when[1:])]
    assert sum(periods) / len(periods) == pytest.approx(0.02, abs=1e-4)
    assert len(periods) > 50


# Where it is


@pytest.mark.short(every=3)
@ARMS
@pytest.mark.parametrize("q", [(30, 40), (-60, 100), (100, -120), (0, 0)])
def test_it_goes_there_and_knows_where_it_is(tmp_path, name, q):
    with switched_on(tmp_path, name) as rig:
        robot = rig.robot()
        robot.go_to(degrees(*q))
        count = 1.0 / rig.arm.joints[0].gear
        assert far(rig.q, degrees(*q)) < 1.0 + count, "half the play is allowed for"
        assert far(robot.angles(), rig.q) < 1.0 + count
        x, y = robot.position()
        assert math.hypot(x - rig.tip[0], y - rig.tip[1]) < math.radians(2) * 20.8
        robot.park()


@ARMS
def test_after_a_move_the_side_of_the_play_is_known_and_allowed_for(tmp_path, name):
    arm = described(name, 6)
    with switched_on(tmp_path, arm) as rig:
        robot = rig.robot()
        for q, sides in (((40, -40), (1, -1)), ((20, -20), (-1, 1))):
            robot.go_to(degrees(*q))
            assert robot.backlash_sides == sides
            assert far(robot.angles(), rig.q) < 2.4, "not the 3 deg that half the play is"


@ARMS
def test_a_joint_move_is_followed_all_the_way(tmp_path, name):
    with switched_on(tmp_path, described(name, 0)) as rig:
        robot = rig.robot()
        begin = rig.world.now()
        move = JointMove(degrees(0, 0), degrees(50, 80), degrees(40, 50))
        robot.follow([move])
        late = 0.05  # s: sampling, accesses and the engaging before the start
        for sample in rig.brick.record:
            t = sample.t - begin
            if 0.1 < t < move.duration:
                error = min(far(sample.q, move.at(t - d * 0.01)[0]) for d in range(int(late * 100)))
                assert error < 3.0
        assert far(rig.q, move.end) < 1.2


def test_the_limits_are_kept_where_the_play_is_taken_up(tmp_path):
    """Starting at a limit there is no room to come from behind."""
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        for corner in ((170, 150), (-90, -150), (170, -150)):
            start = degrees(*corner)
            end = degrees(*(0.8 * angle for angle in corner))
            robot.pre_approach(JointMove(start, end, degrees(90, 90)))
            robot.follow([JointMove(start, end, degrees(90, 90))])
    for k, joint in enumerate(rig.arm.joints):
        angles = [sample.q[k] for sample in rig.brick.record]
        assert min(angles) > joint.lower - math.radians(2)
        assert max(angles) < joint.upper + math.radians(2)


@pytest.mark.parametrize(
    "q", [(171, 0), (-91, 0), (0, 151), (0, -151), (math.nan, 0), (0, math.inf)]
)
@pytest.mark.parametrize("move", ["go_to", "step_to"])
def test_beyond_a_limit_nothing_moves(tmp_path, q, move):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        with pytest.raises(rig.its(Unreachable)) as error:
            getattr(robot, move)(degrees(*q))
        assert "\n" not in str(error.value)
        assert "limits" in str(error.value)
        robot.park()
    assert rig.writes == []
    assert rig.on_file()["parked"] == {"A": 0, "B": 0, "C": 0}


# Watching a motion


class HereAndNow(Exception):
    """What a program that watches may raise."""


@ARMS
def test_watching_tells_in_every_tick_where_the_links_are(tmp_path, name):
    with switched_on(tmp_path, name) as rig:
        clock = CountingClock(rig)
        robot = rig.robot(clock=clock)
        robot.go_to(degrees(40, 60))
        clock.start()
        seen = []
        robot.go_to(degrees(20, 80), on_tick=lambda t, q: seen.append((t, q, rig.q)))
    sleeps = [t for t, _ in clock.ticks]
    ticks = [
        sum(earlier < t <= later for t, _, _ in seen) for earlier, later in zip(sleeps, sleeps[1:])
    ]
    assert ticks == [1] * len(ticks), "once in each tick"
    assert max(accesses for _, accesses in clock.ticks[1:]) <= 6
    assert far(seen[0][1], degrees(40, 60)) < 1.0
    assert far(seen[-1][1], degrees(20, 80)) < 1.0
    off = [far(q, true) for _, q, true in seen]
    count = 1.0 / rig.arm.joints[0].gear
    assert sorted(off)[len(off) // 2] < 0.3 + 0.2 * count, "half the play would be 1 deg"
    # Where it turns round the link may lie anywhere in its play: how far, is luck of a millisecond.
    assert max(off) < max(math.degrees(joint.backlash) for joint in rig.arm.joints) + 0.5


@pytest.mark.parametrize("when", [0.12, 0.6], ids=["crossing the play", "on the way"])
def test_what_a_watcher_raises_ends_the_motion_with_every_motor_held(tmp_path, when):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.confirm_checked()  # which takes its time
        begin = rig.world.now()

        def watch(t, q):
            if t - begin > when:
                raise HereAndNow

        with pytest.raises(HereAndNow):
            robot.go_to(degrees(60, 60), on_tick=watch)
        assert rig.world.now() - begin < when + 0.05
        assert rig.brick.driven() == []
        assert {rig.brick.motors[port].mode for port in "AB"} == {"hold"}
        if when == 0.6:
            assert robot.backlash_sides == (0, 0), (
                "its links run on: where the play lies is not known"
            )
        else:
            assert all(0 < side < 1 for side in robot.backlash_sides)
        rig.world.sleep(0.5)
        assert far(robot.angles(), rig.q) < 2.0
        robot.go_to(degrees(60, 60))
        assert far(rig.q, degrees(60, 60)) < 2.0


def test_stopped_at_rest_the_side_of_the_play_is_known_still(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(40, -40))

        def watch(t, q):
            raise HereAndNow

        with pytest.raises(HereAndNow):
            robot.go_to(degrees(60, -60), on_tick=watch)
        assert robot.backlash_sides == (1, -1)


# Chasing


def in_radians(rig, aim):
    """What the program on the brick takes for an aim in degrees, or a Moving of degrees."""
    if isinstance(aim, Moving):
        return rig.its(Moving)(degrees(*aim.q), degrees(*aim.q_dot))
    return degrees(*aim)


def chased(rig, robot, aim, seconds):
    """Chase aim(t), deg, for so long; rows of (t, q as told, true q, accesses so far)."""
    begin = rig.world.now()
    rows = []

    def reported(t, q):
        rows.append((t - begin, q, rig.q, rig.brick.sysfs.accesses))
        return in_radians(rig, aim(t - begin)) if t - begin < seconds else None

    robot.chase(reported)
    return rows


def slow(name):
    return described(name, max_speed=math.radians(60))


@ARMS
@pytest.mark.parametrize("goal", [(50, 20), (38, 43), (38.6, 41.4)])
def test_an_aim_that_stands_is_reached_and_not_passed(tmp_path, name, goal):
    with switched_on(tmp_path, slow(name), start=degrees(40, 40)) as rig:
        robot = rig.robot()
        count = 1.0 / rig.arm.joints[0].gear
        rows = chased(rig, robot, lambda t: goal, 1.5)
        for k in (0, 1):
            sign = math.copysign(1, goal[k] - 40)
            passed = max(sign * (math.degrees(true[k]) - goal[k]) for _, _, true, _ in rows)
            assert passed < 0.3 + 0.6 * count
        there = next(t for t, _, true, _ in rows if far(true, degrees(*goal)) < 0.3 + 0.6 * count)
        assert there < 1.05
        assert far(rig.q, degrees(*goal)) < 0.3 + 0.6 * count
        # (Of 30 goals side by side, up to 0.7: a link may have come to rest within its play.)
        assert far(robot.angles(), rig.q) < 0.6 + 0.6 * count
        assert robot.backlash_sides == tuple(math.copysign(1, g - 40) for g in goal)
        late = [true for t, _, true, _ in rows if t > 1.25]
        assert far(late[0], late[-1]) < 0.05, "it does not hunt"
        late = [q for t, q, _, _ in rows if t > 1.25]
        assert max(far(q, late[0]) for q in late) < 1e-9, "nor is it told so"
        assert rig.brick.driven() == []


@ARMS
@pytest.mark.parametrize(
    ("plant", "period"),  # on the brick a tick of a chase takes more than there is time for
    [("cpu=0", 0.0201), ("cpu=1", 0.025)],
)
def test_a_moving_aim_is_followed_through_its_turns(tmp_path, name, plant, period):
    def aim(t):
        turn = 2 * math.pi / 6
        x, speed = 10 * math.sin(turn * t), 10 * turn * math.cos(turn * t)
        return Moving((x, 40 - 2 * x), (speed, -2 * speed))

    with switched_on(tmp_path, slow(name), plant, start=degrees(0, 40)) as rig:
        rows = chased(rig, rig.robot(), aim, 6.0)
    off = [far(true, degrees(*aim(t).q)) for t, _, true, _ in rows if 1 < t < 6]  # then it stops
    assert math.sqrt(sum(e * e for e in off) / len(off)) < 1.0
    known = [far(q, true) for t, q, true, _ in rows if t > 0.5]
    assert sorted(known)[len(known) // 2] < 0.4
    accesses = [after[3] - before[3] for before, after in zip(rows, rows[1:])]
    assert max(accesses) <= 6
    assert 0.0199 < sum(b[0] - a[0] for a, b in zip(rows, rows[1:])) / len(accesses) < period


def test_a_chase_goes_no_farther_than_the_limits(tmp_path):
    with switched_on(tmp_path, start=degrees(150, -130)) as rig:
        chased(rig, rig.robot(), lambda t: (300, -1e6), 1.5)
        assert far(rig.q, degrees(170, -150)) < 1.0
    assert max(sample.q[0] for sample in rig.brick.record) < math.radians(172)
    assert min(sample.q[1] for sample in rig.brick.record) > math.radians(-152)


def test_an_aim_that_is_no_number_is_refused_with_every_motor_held(tmp_path):
    with switched_on(tmp_path) as rig:
        with pytest.raises(rig.its(Unreachable), match="elbow"):
            chased(rig, rig.robot(), lambda t: (20, math.nan if t > 0.3 else 20), 1.0)
        assert rig.brick.driven() == []


def test_told_that_there_is_no_aim_it_comes_to_rest_where_it_is(tmp_path):
    with switched_on(tmp_path, slow("planar")) as rig:
        robot = rig.robot()
        chased(rig, robot, lambda t: (90, 90), 1.0)
        here = rig.q
        assert rig.world.now() < 1.8
        assert rig.brick.driven() == []
        assert {rig.brick.motors[port].mode for port in "AB"} == {"hold"}
        assert all(30 < math.degrees(angle) < 70 for angle in here)
        assert far(robot.angles(), here) < 2.5, "its links may have run on through the play"
        rig.world.sleep(1.0)
        assert far(rig.q, here) < 0.5
        robot.park()
        assert rig.on_file()["parked"] is not None


def test_what_an_aim_raises_ends_the_chase_with_every_motor_held(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        began = rig.world.now()

        def aim(t):
            if t > 0.5:
                raise HereAndNow
            return 50, 50

        with pytest.raises(HereAndNow):
            chased(rig, robot, aim, 1.0)
        assert rig.brick.driven() == []
        assert rig.world.now() - began < 0.6


@pytest.mark.short(every=3)
@ARMS
@pytest.mark.parametrize("fault", ["jam", "kill_encoder", "unplug"])
@pytest.mark.parametrize("at", [0.5, 2.0], ids=["on the way", "at rest"])
def test_a_chase_notices_a_motor_that_does_not_do_as_told(tmp_path, name, fault, at):
    with switched_on(tmp_path, slow(name)) as rig:
        robot = rig.robot()
        rig.world.at(at, lambda: getattr(rig.brick, fault)("B"))
        with pytest.raises(rig.its(MotorNotFound if fault == "unplug" else Stalled), match="elbow"):
            chased(rig, robot, lambda t: (40, 40) if t < 2.0 else (60, 10), 9.0)
        assert rig.world.now() < at + 1.0
        assert rig.brick.driven() == []


@ARMS
def test_a_chase_notices_a_blocked_joint_that_has_hardly_anything_to_go(tmp_path, name):
    with switched_on(tmp_path, slow(name)) as rig:
        robot = rig.robot()
        rig.world.at(0.9, lambda: rig.brick.jam("B"))
        with pytest.raises(rig.its(Stalled), match="elbow"):
            chased(rig, robot, lambda t: (20, 20) if t < 1.0 else (20, 22.5), 9.0)
        assert rig.world.now() < 3.0


def test_a_program_that_freezes_in_a_chase_leaves_no_joint_driven(tmp_path):
    """The motors' own dead-man acts while the aim thinks for ever; then the tick was too slow."""
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        stopped = []

        def aim(t):
            if t > 0.5:
                rig.world.sleep(0.25)
                stopped.append(rig.brick.driven())
            return 90, 90

        with pytest.raises(rig.its(TooSlow), match="tick"):
            chased(rig, robot, aim, 2.0)
    assert stopped == [[]]


def test_an_aim_that_is_slow_now_and_then_does_no_harm(tmp_path):
    with switched_on(tmp_path, slow("planar")) as rig:

        def aim(t):
            if math.floor(t * 50) % 5 == 0:
                rig.world.sleep(0.045)
            return 40, 60

        chased(rig, rig.robot(), aim, 2.0)
        assert far(rig.q, degrees(40, 60)) < 2.0  # on one side of the play or the other


# Reaching


@ARMS
def test_reaching_takes_each_joint_there_by_itself(tmp_path, name):
    with switched_on(tmp_path, slow(name)) as rig:
        robot = rig.robot()
        began, seen = rig.world.now(), []
        robot.reach(degrees(10, 60), on_tick=lambda t, q: seen.append((t, rig.q)))
        assert far(rig.q, degrees(10, 60)) < 0.2 + 0.6 / rig.arm.joints[0].gear
        assert rig.world.now() - began < 2.1
        assert rig.brick.driven() == []
        half = next(q for _, q in seen if q[1] > math.radians(30))
        assert math.degrees(half[0]) > 8, "the shoulder does not wait for the elbow"


@ARMS
def test_reaching_goes_however_little_and_is_soon_done(tmp_path, name):
    with switched_on(tmp_path, slow(name), start=degrees(40, 40)) as rig:
        robot = rig.robot()
        for q in ((42, 42), (41.2, 42)):  # whose counts' edges are farther off than they settle
            robot.reach(degrees(*q))
        assert robot.backlash_sides[0] == -1, "the play was crossed for less than a count"
        begin = rig.world.now()
        robot.reach(robot.angles())
        assert rig.world.now() - begin < 0.15


def leading(rig, q, end, dt):
    """A Trajectory of the shoulder from one angle to another, degrees, in a time, s."""
    (a, b), elbow = degrees(q, end), math.radians(100)
    cubics = [[a, 0.0, 3 * (b - a), 2 * (a - b)], [elbow, 0.0, 0.0, 0.0]]
    return rig.its(Trajectory)([0.0, dt], [(1 / dt, 0.0, cubics, None)], (b, elbow))


@pytest.mark.parametrize(
    ("begin", "end", "dt", "what"),
    [
        (-70, -120, 2.0, r"at -90\.\d deg and -37 deg/s"),
        (-60, -130, 0.7, r"at -8\d\.\d deg and -1\d\d deg/s"),
        (0, 80, 0.4, r"at \d+\.\d deg and 2\d\d deg/s"),
    ],
)
def test_a_set_point_that_no_joint_may_have_ends_the_motion(tmp_path, begin, end, dt, what):
    with switched_on(tmp_path, "planar") as rig:
        robot = rig.robot()
        motion = leading(rig, begin, end, dt)
        robot.go_to(motion.start)
        truth = []
        with pytest.raises(rig.its(OutOfBounds), match=what + ", and its bounds are -92.0 to"):
            robot.follow([motion], on_tick=lambda t, links: truth.append(math.degrees(rig.q[0])))
        assert min(truth) > -90 - 3
        assert rig.brick.driven() == []
        rig.world.sleep(1.0)
        assert -90 - 3 < math.degrees(rig.q[0]) < 60


@pytest.mark.parametrize("q", [(171, 0), (0, math.nan)])
def test_reaching_beyond_a_limit_nothing_moves(tmp_path, q):
    with switched_on(tmp_path) as rig, pytest.raises(rig.its(Unreachable), match="limits"):
        rig.robot().reach(degrees(*q))
    assert rig.writes == []


# The zero from one program to the next


@ARMS
def test_parked_it_is_on_record_and_the_next_program_goes_on(tmp_path, name):
    q = degrees(35, 60)
    with switched_on(tmp_path, name, start=degrees(-20, 30)) as rig:
        first = rig.robot()
        first.go_to(q)
        assert rig.on_file()["parked"] is None, "while it moves, where it is is not on record"
        first.park()
        counts = {port: motor.position for port, motor in rig.brick.motors.items()}
        assert rig.on_file()["parked"] == counts
        assert rig.on_file()["zero"] == pytest.approx(zero_of(rig.arm, degrees(-20, 30)))
        rig.world.sleep(5)
        second = rig.robot()
        assert far(second.angles(), rig.q) < 2.1
        second.go_to(degrees(0, 90))
        assert far(rig.q, degrees(0, 90)) < 2.1
        second.park()
        assert rig.on_file()["parked"] is not None


def test_looking_does_not_touch_the_motors(tmp_path):
    with switched_on(tmp_path) as rig:
        before = rig.on_file()
        robot = rig.robot()
        robot.position()
        robot.park()
        assert rig.writes == []
        assert rig.on_file() == before


@pytest.mark.parametrize("port", ["A", "B", "C"])
def test_encoders_that_contradict_the_file_are_not_believed(tmp_path, port):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.park()
        # The Back button: every encoder starts from 0 again; one is enough.
        motor = rig.brick.motors[port]
        motor.write("stop_action", "coast")
        motor.write("command", "stop")  # one that is held would turn back
        motor.write("position", str(motor.position + 9))
        with pytest.raises(rig.its(NotHomed), match="motor " + port):
            rig.robot()


def test_after_the_back_button_it_must_be_homed(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.park()
        rig.brick.reset_motors()
        with pytest.raises(rig.its(NotHomed)):
            rig.robot()


def test_if_the_record_cannot_be_kept_nothing_moves(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        (tmp_path / "planar.json.new").mkdir()
        with pytest.raises(rig.its(StateNotSaved)):
            robot.go_to(degrees(20, 30))
        assert [what for _, _, what, text in rig.writes if text.startswith("run")] == []
        rig.world.sleep(1)
        assert far(rig.q, (0, 0)) < 0.1


# How it ends


def test_after_a_path_it_is_held(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        assert {rig.brick.motors[port].mode for port in "AB"} == {"hold"}
        before = rig.q
        rig.world.sleep(3)
        assert far(before, rig.q) < 0.5


def test_parked_the_drivers_constants_are_those_of_a_fresh_motor(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.move_pen(math.radians(60))
        robot.park()
        for motor in rig.brick.motors.values():
            assert (motor.read("speed_pid/Kp"), motor.read("speed_pid/Ki")) == ("1000", "60")


@pytest.mark.parametrize("port", ["A", "B", "C"])
def test_stopping_stops_all_that_still_answer_and_then_says_who_does_not(tmp_path, port):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.move_pen(math.radians(30))
        for motor in robot.joints + [robot.pen]:
            motor.engage(0.14)
            motor.drive(1.0)
        assert rig.brick.driven() == ["A", "B", "C"]
        rig.brick.unplug(port)
        with pytest.raises(rig.its(MotorNotFound), match="port " + port):
            robot.stop()
        assert rig.brick.driven() == []
        others = [motor.mode for at, motor in rig.brick.motors.items() if at != port]
        assert others == ["hold", "hold"]


def test_a_blocked_joint_is_noticed_by_the_arm_itself(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        rig.brick.jam("B")
        begin = rig.world.now()
        with pytest.raises(rig.its(Stalled), match="elbow"):
            robot.go_to(degrees(0, 90))
        assert rig.world.now() - begin < 1.0


def test_a_brick_that_is_too_slow_is_noticed(tmp_path):
    with switched_on(tmp_path, plant="access=0.05") as rig:
        robot = rig.robot()
        with pytest.raises(rig.its(TooSlow), match="tick"):
            robot.go_to(degrees(0, 90))


# Other arms


def test_an_arm_without_a_pen(tmp_path):
    arm = described("planar")._replace(pen=None)
    with switched_on(tmp_path, arm) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.park()
        assert sorted(rig.on_file()["parked"]) == ["A", "B"]
        assert far(rig.q, degrees(20, 30)) < 2.1


def test_the_pen_goes_down_and_up(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        for angle in (60, 0):
            robot.move_pen(math.radians(angle))
            assert math.degrees(rig.brick.plant.drives["C"].angle) == pytest.approx(angle, abs=8)
            assert rig.brick.plant.pen_down == (angle == 60)
            assert rig.brick.motors["C"].mode == "hold"


# The report's step


@ARMS
def test_a_step_commands_both_joints_and_waits_for_both(tmp_path, name):
    with switched_on(tmp_path, name) as rig:
        robot = rig.robot()
        robot.go_to(degrees(30, 60))
        del rig.writes[:]
        q = degrees(33, 64)
        robot.step_to(q)
        end = rig.world.now()
        commands = [(t, port) for t, port, what, text in rig.writes if text == "run-to-abs-pos"]
        assert [port for _, port in commands] == ["A", "B"]
        assert commands[1][0] - commands[0][0] < 0.02, "together"
        zero = rig.on_file()["zero"]
        for joint, angle in zip(rig.arm.joints, q):
            turned = rig.brick.motors[joint.port].position - zero[joint.port]
            assert turned == pytest.approx(
                math.degrees(angle) * joint.gear * joint.direction, abs=1.6
            )
        assert end - commands[1][0] > 4 / 100.0 + 0.05, "the way takes 40 ms, settling 60 more"
        set_points = {text for _, _, what, text in rig.writes if what == "speed_sp"}
        assert set_points == {str(int(100 * rig.arm.joints[0].gear))}


def test_a_step_that_does_not_get_there_is_given_up(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(30, 60))
        rig.brick.jam("A")
        begin = rig.world.now()
        with pytest.raises(rig.its(Stalled), match="shoulder"):
            robot.step_to(degrees(35, 60))
        assert rig.world.now() - begin < 1.0
        robot.stop()
        assert rig.brick.driven() == []


def test_the_tip_is_the_kinematics_of_the_angles(tmp_path):
    with switched_on(tmp_path, start=degrees(30, 60)) as rig:
        robot = rig.robot()
        assert robot.position() == forward(rig.arm, robot.angles())
        assert robot.position() == pytest.approx(rig.tip, abs=0.4)


def test_only_where_a_path_ends_it_is_waited_for_the_last_half_count(tmp_path):
    corners = [degrees(0, 0), degrees(10, 20), degrees(20, 10), degrees(25, 15)]
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        loop, within = robot.motors.loop, []
        run = loop.run

        def noted(motors, plan, tolerances, **options):
            within.append(tolerances.counts)
            return run(motors, plan, tolerances, **options)

        loop.run = noted
        move = rig.its(JointMove)
        robot.follow([move(a, b, degrees(90, 90)) for a, b in zip(corners, corners[1:])])
    assert within == [1.0, 1.0, 0.4]
