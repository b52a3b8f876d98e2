"""The arm: how it follows, what it refuses, how it ends; judged by the true link angles."""

import math

import pytest
from rig import REPORT_LINES, degrees, described, switched_on, zero_of

from robot.arm import RobotArm
from robot.control_loop import Stalled, TooSlow
from robot.kinematics import Unreachable, forward
from robot.motors import MotorNotFound
from robot.trajectory import JointMove, plan, polyline
from robot.zero import NotHomed, StateNotSaved

ARMS = pytest.mark.parametrize("name", ["planar", "geared"])


def far(a, b):
    """Greatest difference of two poses, deg."""
    return max(abs(math.degrees(x - y)) for x, y in zip(a, b))


class CountingClock:
    """The world's clock; remembers how many accesses were made between two sleeps, and when."""

    def __init__(self, rig):
        self._rig = rig
        self.now = rig.world.now
        self.start()

    def start(self):
        self._last = self._rig.brick.sysfs.accesses
        self.ticks = []

    def sleep(self, seconds):
        accesses = self._rig.brick.sysfs.accesses
        self.ticks.append((self.now(), accesses - self._last))
        self._last = accesses
        self._rig.world.sleep(seconds)


@ARMS
@pytest.mark.parametrize("line", REPORT_LINES)
def test_at_most_six_accesses_and_fifty_ticks_a_second(tmp_path, name, line):
    with switched_on(tmp_path, name) as rig:
        clock = CountingClock(rig)
        robot = RobotArm(rig.arm, clock, rig.state)
        robot.wake()
        motions = plan(rig.arm, polyline(line), rig.arm.speed)
        robot.approach(motions[0])
        clock.start()
        robot.follow(motions)
    assert max(accesses for _, accesses in clock.ticks) <= 6
    when = [t for t, _ in clock.ticks]
    periods = [b - a for a, b in zip(when, when[1:])]
    assert sum(periods) / len(periods) == pytest.approx(0.02, abs=1e-4)
    assert len(periods) > 50


# Where it is


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
            assert robot.sides == sides
            assert far(robot.angles(), rig.q) < 2.2, "not the 3 deg that half the play is"


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
                error = min(far(sample.q, move.at(t - d * 0.01).q) for d in range(int(late * 100)))
                assert error < 3.0
        assert far(rig.q, move.end) < 1.2


def test_the_limits_are_kept_where_the_play_is_taken_up(tmp_path):
    """Starting at a limit there is no room to come from behind."""
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        for corner in ((170, 150), (-90, -150), (170, -150)):
            start = degrees(*corner)
            end = degrees(*(0.8 * angle for angle in corner))
            robot.approach(JointMove(start, end, degrees(90, 90)))
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
        with pytest.raises(Unreachable) as error:
            getattr(robot, move)(degrees(*q))
        assert "\n" not in str(error.value)
        assert "limits" in str(error.value)
        robot.park()
    assert rig.writes == []
    assert rig.on_file()["parked"] == {"A": 0, "B": 0, "C": 0}


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
        motor.write("position", str(motor.position + 9))
        with pytest.raises(NotHomed, match="motor " + port):
            rig.robot()


def test_after_the_back_button_it_must_be_homed(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        robot.go_to(degrees(20, 30))
        robot.park()
        rig.brick.reset_motors()
        with pytest.raises(NotHomed):
            rig.robot()


def test_if_the_record_cannot_be_kept_nothing_moves(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        (tmp_path / "planar.json.new").mkdir()
        with pytest.raises(StateNotSaved):
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
        with pytest.raises(MotorNotFound, match="port " + port):
            robot.stop()
        assert rig.brick.driven() == []
        others = [motor.mode for at, motor in rig.brick.motors.items() if at != port]
        assert others == ["hold", "hold"]


def test_a_blocked_joint_is_noticed_by_the_arm_itself(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        rig.brick.jam("B")
        begin = rig.world.now()
        with pytest.raises(Stalled, match="elbow"):
            robot.go_to(degrees(0, 90))
        assert rig.world.now() - begin < 1.0


def test_a_brick_that_is_too_slow_is_noticed(tmp_path):
    with switched_on(tmp_path, plant="access=0.05") as rig:
        robot = rig.robot()
        with pytest.raises(TooSlow, match="tick"):
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
        with pytest.raises(Stalled, match="shoulder"):
            robot.step_to(degrees(35, 60))
        assert rig.world.now() - begin < 1.0
        robot.stop()
        assert rig.brick.driven() == []


def test_the_tip_is_the_kinematics_of_the_angles(tmp_path):
    with switched_on(tmp_path, start=degrees(30, 60)) as rig:
        robot = rig.robot()
        assert robot.position() == forward(rig.arm, robot.angles())
        assert robot.position() == pytest.approx(rig.tip, abs=0.4)
