"""How often the control loop goes round: as often as the brick can; no verdict blames a motor."""

import gc
import math

import pytest
from rig import degrees, switched_on

from laptop.emulator.host.world import World
from robot.motion.axis import Tolerances
from robot.motion.control_loop import (
    IDLE_SHARE,
    SPARE_TIME,
    START_TIME,
    ControlLoop,
    Stalled,
    TooSlow,
)
from robot.motion.joint_controller import GAINS
from robot.motion.motor_model import MotorModel, StallDetector
from robot.motion.online_trajectory import STOP
from robot.motion.pace import AVERAGED_TICKS, MAX_PERIOD, MIN_PERIOD, LoopTiming


def paced(*computing):
    """A LoopTiming after dozens of ticks that took so long each (s), and what it has said."""
    lines = []
    pace = LoopTiming(lines.append)
    t = 0.0
    for seconds in computing:
        for _ in range(AVERAGED_TICKS):
            since = max(pace.period, seconds)
            t += since
            pace.update(t, since, seconds)
    return pace, lines


@pytest.mark.parametrize(("computing", "period"), [(0.005, 0.02), (0.02, 0.025), (0.036, 0.045)])
def test_the_period_is_what_ticks_take_and_a_quarter_more(computing, period):
    pace, lines = paced(computing)
    assert pace.period == pytest.approx(period)
    assert pace.rate == 1.0
    assert len(lines) == 1
    assert f"{1000 * computing:.0f} ms of this brick" in lines[0]


def test_a_later_command_is_fed_forward_earlier_and_by_a_softer_hand():
    fast, slow = (paced(computing)[0] for computing in (0.005, 0.03))
    assert slow.delay > fast.delay
    assert slow.lead > fast.lead


def test_where_no_period_will_do_the_plan_goes_slower_than_the_clock_and_not_by_a_jerk():
    pace, _ = paced(0.08, 0.08, 0.08)
    assert pace.period == MAX_PERIOD
    assert pace.rate == pytest.approx(MAX_PERIOD / 0.1)
    pace, _ = paced(0.005, 0.08)
    before = pace.rate
    pace.update(99.0, 0.08, 0.08)
    assert 0 < before - pace.rate <= 0.08 + 1e-9


def test_that_the_brick_becomes_slower_is_told_once_with_what_to_do():
    pace, lines = paced(0.01, 0.01, 0.04, 0.045, 0.01, 0.045)
    assert len(lines) == 2
    assert "has become slower" in lines[1]
    assert "end other programs on the brick" in lines[1]
    assert "cable" not in lines[1]


def test_ticks_that_take_longer_but_find_room_are_no_news():
    pace, lines = paced(0.01, 0.01, 0.03, 0.039)
    assert pace.rate == 1.0
    assert len(lines) == 1


def test_a_late_tick_is_late_for_a_while():
    pace = LoopTiming(lambda line: None)
    pace.update(1.0, 0.02, 0.01)
    assert not pace.was_late(1.0)
    pace.update(1.1, 0.09, 0.09)
    assert pace.was_late(1.2)
    assert pace.latest == 0.09
    assert not pace.was_late(1.5)
    assert pace.period == MIN_PERIOD


@pytest.mark.parametrize("plant", ["", "access=0.005", "cpu=0,access=0.012", "cpu=4"])
def test_a_blocked_joint_is_called_blocked_however_slow_the_brick(tmp_path, plant):
    with switched_on(tmp_path, plant=plant) as rig:
        robot = rig.robot()
        rig.world.at(rig.world.now() + 1.2, lambda: rig.brick.jam("B"))
        with pytest.raises(rig.its(Stalled), match="elbow"):
            robot.go_to(degrees(0, 90), speed=0.3)


def test_a_slow_brick_is_called_slow_and_no_word_is_said_of_cables(tmp_path):
    with switched_on(tmp_path, plant="access=0.03") as rig:
        robot = rig.robot()
        with pytest.raises(rig.its(TooSlow)) as error:
            robot.go_to(degrees(0, 90))
    assert "end other programs on the brick" in str(error.value)
    assert "cable" not in str(error.value)


@pytest.mark.parametrize("plant", ["", "access=0.005", "access=0.008", "cpu=4"])
def test_a_slow_brick_costs_time_but_brings_the_arm_there(tmp_path, plant):
    with switched_on(tmp_path, plant=plant) as rig:
        rig.robot().go_to(degrees(40, 60))
        rig.world.sleep(0.3)
        assert rig.q == pytest.approx(degrees(40, 60), abs=math.radians(3))


def test_no_garbage_is_collected_in_a_motion(tmp_path):
    with switched_on(tmp_path) as rig:
        robot = rig.robot()
        seen = []
        robot.go_to(degrees(10, 10), on_tick=lambda t, q: seen.append(gc.isenabled()))
    assert len(seen) > 10
    assert not any(seen)
    assert gc.isenabled()


class Lagging:
    """A motor and controller whose joint turns so far behind its plan; at `stops` it stops."""

    name, port, resolution, angle, speed, full_error = "elbow", "B", 0.001, 0.0, 0.0, 1.0
    weight = 0.0
    stall = StallDetector(MotorModel(1.0, GAINS["large"]), 1.0, 0.0, math.inf, math.inf)

    def __init__(self, clock, behind, stops=math.inf):
        self._clock, self._behind, self._stops = clock, behind, stops

    def bounds(self):
        """What the encoder says of the angle, rad."""
        self.angle = min(self._clock.now(), self._stops) - self._behind
        return self.angle, self.angle

    def observe(self, t, low, high):
        """Nothing is to be learned."""

    def command(self, error, speed, acceleration):
        """As wanted."""
        return speed

    def __getattr__(self, name):
        return lambda *args: None


class Even:
    """A plan of 1 rad/s."""

    before, duration, rests_from = 0.0, 5.0, [5.0]

    def at(self, t):
        """Where the joint should be."""
        return [t], None

    def speeds(self, t):
        """As fast as that."""
        return [1.0]


@pytest.mark.parametrize(
    ("period", "behind", "stops", "blocked"),
    [
        (0.02, 2.9, math.inf, False),
        (0.02, 3.1, math.inf, True),
        (0.05, 7.4, math.inf, False),  # one that turns may lag by as much more as ticks are longer
        (0.05, 7.6, math.inf, True),
        (0.05, 0.0, 1.0, True),  # one that stands may not
    ],
)
def test_a_joint_that_turns_is_not_called_blocked_because_ticks_are_long(
    period, behind, stops, blocked
):
    world = World()
    joint = Lagging(world, math.radians(behind), stops)
    loop = ControlLoop(world, {joint: joint}, lambda: None, lambda line: None)
    loop.pace.period = period
    loop.pace.update = lambda *args: None
    ticks = []

    def watch(t, now, angles):
        ticks.append(math.degrees(t - angles[0]))
        return STOP if t > 3 else None

    if blocked:
        with pytest.raises(Stalled):
            loop.run([joint], Even(), tolerances=Tolerances(error=math.radians(3)), on_tick=watch)
        assert ticks[-1] < 3.3 * period / 0.02 if stops == math.inf else 7.6 + math.degrees(0.2)
    else:
        assert not loop.run(
            [joint], Even(), tolerances=Tolerances(error=math.radians(3)), on_tick=watch
        )


def test_a_joint_that_stands_under_full_feedback_is_given_up_after_half_a_second():
    """Also where it is so stiff that no count is missed, and may be off by as much as it likes."""
    world, ticks = World(), []
    joint = Lagging(world, 0.0, stops=1.0)
    joint.full_error = 0.1  # which is reached 0.1 s later
    loop = ControlLoop(world, {joint: joint}, lambda: None, lambda line: None)
    loop.pace.update = lambda *args: None
    with pytest.raises(Stalled):
        loop.run(
            [joint], Even(), tolerances=Tolerances(error=math.inf),
            on_tick=lambda t, now, angles: ticks.append(now),
        )  # fmt: skip
    assert ticks[-1] == pytest.approx(1.1 + 0.5, abs=0.05)


def test_what_is_fed_forward_goes_at_the_plan_s_rate_from_the_first_tick_on():
    """Else an acceleration would be that of no time at all: the arm began with a blow."""
    world, ahead = World(), []
    joint = Lagging(world, 0.0)
    loop = ControlLoop(world, {joint: joint}, lambda: None, lambda line: None)
    for n in range(2 * AVERAGED_TICKS):
        loop.pace.update(0.07 * n, 0.07, 0.07)
    loop.pace.update = lambda *args: None

    def watch(t, now, angles):
        world.sleep(0.004)
        return STOP if t > 0.5 else None

    plan = Even()
    plan.speeds = lambda t: ahead.append(t) or [1.0]
    assert not loop.run([joint], plan, tolerances=Tolerances(error=9.0), on_tick=watch)
    rate = loop.pace.rate
    assert rate == pytest.approx(MAX_PERIOD / (0.07 * 1.25))
    steps = [after - before for before, after in zip(ahead, ahead[1:])]
    assert steps == pytest.approx([rate * 0.004] + [rate * MAX_PERIOD] * (len(steps) - 1))


@pytest.mark.parametrize("period", [0.02, 0.05])
def test_spare_time_is_what_is_left_of_a_tick_when_its_motors_are_driven(period):
    """None at the start; and the system keeps its share."""
    world, calls = World(), []
    joint = Lagging(world, 0.0)
    loop = ControlLoop(world, {joint: joint}, lambda: None, lambda line: None)
    loop.pace.period = period
    loop.pace.update = lambda *args: None

    def watch(t, now, angles):
        calls.append(("read", now))
        world.sleep(0.004)
        return STOP if t > 1 else None

    def spare(until):
        calls.append(("spare", world.now(), until))

    assert not loop.run([joint], Even(), on_tick=watch, spare=spare)
    for (_, read, *_), (name, *times), (_, next_one, *_) in zip(calls, calls[1:], calls[2:]):
        if name == "spare":
            assert times == pytest.approx([read + 0.004, read + period * (1 - IDLE_SHARE)])
            assert next_one == pytest.approx(read + period)
    assert min(entry[1] for entry in calls if entry[0] == "spare") > START_TIME


def test_who_needs_more_than_the_spare_time_makes_the_period_longer():
    noted = []
    for needs, since, beside in ((0.0, 0.02, SPARE_TIME), (0.03, 0.03, SPARE_TIME + 0.03)):
        world = World()
        joint = Lagging(world, 0.0)
        loop = ControlLoop(world, {joint: joint}, lambda: None, lambda line: None)
        loop.pace.add_spare = lambda seconds, noted=noted: noted.append(seconds)
        loop.pace.update = lambda t, since, computing: noted.append((since, computing))
        loop.run(
            [joint], Even(), on_tick=lambda t, now, angles: STOP if t > 1 else None,
            spare=lambda until, world=world, needs=needs: world.sleep(needs),
        )  # fmt: skip
        assert noted[-2] == pytest.approx(beside, abs=1e-9)
        assert noted[-1] == pytest.approx((since, 0.0), abs=1e-9)


def test_other_works_time_lengthens_the_period_and_no_delay():
    busy, alone = LoopTiming(lambda line: None), LoopTiming(lambda line: None)
    for k in range(AVERAGED_TICKS):
        busy.add_spare(0.016)
        for pace in (busy, alone):
            pace.update(0.04 * k, 0.04, 0.012)
    assert (busy.period, alone.period) == (pytest.approx(0.035), MIN_PERIOD)
    assert busy.delay - busy.period / 2 == pytest.approx(alone.delay - alone.period / 2)
