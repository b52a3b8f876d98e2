"""The pursuit of an aim: what is fast, what is smooth, and what is not passed; pure."""

import math
import random

import pytest
from rig import described

from robot.motion.backlash import CROSSING_TIME
from robot.motion.joint_controller import LEAD
from robot.motion.online_trajectory import (
    PRELOAD_PERIOD,
    Moving,
    OnlineTrajectory,
    time_optimal_profile,
)

TICK = 0.02


def rested(plan, t):
    """Per joint, for how long its set-point has been standing at time `t`, s."""
    return [t - since for since in plan.rests_from]


DEG = math.radians(1)
FASTEST = 60 * DEG


def pursuit(name="planar", q=(0.0, 0.0), sides=(1, 1)):
    joints = described(name, max_speed=FASTEST).joints
    return OnlineTrajectory(joints, q, sides, 1.0), joints


def links(chase, joints, t):
    """The links' angles at `t`, deg."""
    return [
        (q - side * joint.backlash / 2) / DEG
        for q, side, joint in zip(chase.at(t)[0], chase.sides_at(t), joints)
    ]


def moving(q, *speeds):
    """The Moving of an aim, from deg and deg/s."""
    return Moving([a * DEG for a in q], [v * DEG for v in speeds])


def run(aim, seconds, name="planar", sides=(1, 1), speed=None):
    """Steered tick by tick towards aim(t), deg, with both joints; rows of (t, q deg, sides)."""
    chase, joints = pursuit(name, sides=sides)
    rows = []
    for k in range(int(seconds / TICK)):
        t = k * TICK
        q = [aim(t)] * 2
        chase.steer(t, moving(q, speed, speed) if speed else [a * DEG for a in q])
        rows.append((t, links(chase, joints, t)[0], chase.sides_at(t)[0]))
    return rows


@pytest.mark.parametrize("seed", range(50))
def test_a_way_is_within_its_limits_never_backwards_and_ends_with_the_aim(seed):
    rng = random.Random(seed)
    up, down = rng.uniform(1, 5), rng.uniform(0.3, 5)
    v, u = rng.uniform(0, 1), rng.choice([0.0, rng.uniform(0, 0.9)])
    e = rng.uniform(-2, 3)
    x, speed, t = 0.0, v, 0.0
    for duration, a in time_optimal_profile(e, v, u, 1.0, up, down):
        assert duration >= 0
        assert -down - 1e-9 <= a <= up + 1e-9
        x += speed * duration + a * duration * duration / 2
        speed += a * duration
        t += duration
        assert -1e-9 <= speed <= 1 + 1e-9
    assert speed == pytest.approx(u, abs=1e-9)
    too_near = not u and e < v * v / (2 * down)
    assert too_near or x == pytest.approx(e + u * t, abs=1e-9)


@pytest.mark.parametrize("size", [1, 3, 10, 30, 60, -1, -3, -10, -30, -60])
def test_a_step_is_taken_in_the_least_time_and_never_passed(size):
    begin = 20 * TICK
    rows = run(lambda t: size if t > begin - 1e-9 else 0.0, 4.0)
    assert max(q / size for _, q, _ in rows) <= 1 + 1e-9
    assert rows[-1][1] == pytest.approx(size, abs=1e-6)
    there = next(t for t, q, _ in rows if abs(q - size) < 1e-6) - begin
    # Slowing down takes 0.4 times the acceleration, and the play 0.14 s where it is crossed.
    up, down = 200.0, 80.0
    peak = min(60.0, math.sqrt(abs(size) / (0.5 / up + 0.5 / down)))
    least = peak / up + peak / down
    least += (abs(size) - peak * peak * (0.5 / up + 0.5 / down)) / peak
    crossing = CROSSING_TIME if size < 0 else 0.0
    assert LEAD + crossing + least - 1e-9 < there < LEAD + crossing + least + 2 * TICK


def test_an_aim_that_came_evenly_and_then_stands_is_not_passed():
    """As a search that comes near its end does."""
    rows = run(lambda t: min(1.2 * int(t / 0.04), 30.0), 3.0)
    assert max(q for _, q, _ in rows) <= 30 + 1e-9
    assert rows[-1][1] == pytest.approx(30)


@pytest.mark.parametrize("speed", [5, 20, -20, 40])
def test_an_aim_that_moves_evenly_is_followed_without_lag(speed):
    rows = run(lambda t: speed * t, 3.0, speed=speed)
    assert max(abs(q - speed * t) for t, q, _ in rows if t > 1.5) < 1e-6


def test_as_long_as_it_goes_with_an_aim_it_does_not_rest():
    chase, _ = pursuit()
    for k in range(100):
        chase.steer(k * TICK, moving([20 * k * TICK, 0.0], 20, 0))
        assert k < 5 or rested(chase, k * TICK)[0] < 0 < rested(chase, k * TICK)[1]
    assert rested(chase, k * TICK + 1)[0] < 0, "nor where a tick is late"


def test_followed_evenly_into_a_limit_a_joint_stops_there_no_harder_than_it_may():
    chase, joints = pursuit(q=(120 * DEG, 0.0))
    q, v = [], []
    for k in range(150):
        t = k * TICK
        chase.steer(t, moving([120 + 30 * t, 0.0], 30, 0))
        q.append(links(chase, joints, t)[0])
        v.append(chase.speeds(t)[0] / DEG)
    assert max(q) <= 170 + 1e-6
    assert q[-1] == pytest.approx(170)
    assert min(b - a for a, b in zip(v, v[1:])) > -200 * TICK - 1e-6
    assert max(v) > 29


def test_a_tick_that_comes_very_late_does_not_carry_a_joint_past_its_limit():
    chase, joints = pursuit(q=(140 * DEG, 0.0))
    for k in range(41):
        chase.steer(k * TICK, moving([140 + 30 * k * TICK, 0.0], 30, 0))
    assert links(chase, joints, 0.8)[0] == pytest.approx(164, abs=0.1)
    assert links(chase, joints, 1.2)[0] == pytest.approx(170)


@pytest.mark.parametrize("least", [40, 1])
def test_what_the_control_law_was_told_ahead_stands(least):
    """Whatever the aim does: also where one crossing of the play follows another at once."""
    rng = random.Random(7)
    chase, _ = pursuit()
    reported = []
    for k in range(1000):
        t = k * TICK
        chase.steer(t, [rng.choice([-1, 1]) * rng.uniform(0, least) * DEG] * 2)
        for then, (q, _), speeds in reported:
            assert chase.at(then)[0] == pytest.approx(q, abs=1e-9)
            assert chase.speeds(then) == pytest.approx(speeds, abs=1e-9)
        reported = [
            (t + a, chase.at(t + a), chase.speeds(t + a)) for a in (TICK, 1.5 * TICK, LEAD - 1e-9)
        ]


def test_speed_acceleration_and_limits_are_kept_whatever_the_aim():
    rng = random.Random(3)
    chase, joints = pursuit()
    aim = [0.0, 0.0]
    before, hardest = None, [0.0, 0.0]
    for k in range(2000):
        t = k * TICK
        if rng.random() < 0.1:
            aim = [rng.uniform(-300, 300) * DEG for _ in joints]
        aim = [a + rng.uniform(-1, 1) * DEG for a in aim]
        chase.steer(t, aim)
        q = links(chase, joints, t)
        for angle, joint in zip(q, joints):
            assert joint.lower / DEG - 1e-6 <= angle <= joint.upper / DEG + 1e-6
        if before:
            v = [(a - b) / TICK for a, b in zip(q, before[0])]
            assert max(map(abs, v)) <= 60 + 1e-6
            if before[1]:
                rates = [abs(a - b) / TICK for a, b in zip(v, before[1])]
                most = (200, 100 * (1 + 11.3 / 9.5) ** 2)
                assert all(rate <= limit + 1e-3 for rate, limit in zip(rates, most))
                hardest = [max(a, b) for a, b in zip(hardest, rates)]
            before = (q, v)
        else:
            before = (q, None)
    assert hardest[0] > 150
    assert hardest[1] > 350, "the lighter joint is let go faster"


def test_turning_round_the_link_stands_while_the_play_is_crossed():
    rows = run(lambda t: 20 if t < 1.5 else -20, 4.0)
    crossing = [(q, side) for _, q, side in rows if -1 < side < 1]
    assert len(crossing) in (6, 7), "0.14 s"
    assert all(q == pytest.approx(20, abs=1e-6) for q, _ in crossing)
    assert rows[-1][2] == -1


def test_noise_in_the_aim_does_not_cross_the_play_to_and_fro():
    rng = random.Random(1)
    rows = run(lambda t: 10 + rng.gauss(0, 0.15), 20.0)
    assert {side for _, _, side in rows} == {1}
    late = [q for t, q, _ in rows if t > 5]
    assert max(late) - min(late) < 0.5, "and at rest it stays"


@pytest.mark.parametrize("off", [0.4, -0.6])
def test_a_joint_at_rest_stays_for_what_is_less_than_noise(off):
    assert run(lambda t: off, 1.0)[-1][1] == 0.0
    assert run(lambda t: 1.5 * off, 2.0)[-1][1] == pytest.approx(1.5 * off)


def test_with_play_unknown_half_of_it_is_crossed_to_either_side():
    for size in (5, -5):
        sides = [side for _, _, side in run(lambda t, size=size: size, 2.0, sides=(0, 0))]
        assert sides[0] == 0
        assert sides[-1] == math.copysign(1, size)


def test_told_to_end_it_comes_to_rest_and_says_when():
    chase, joints = pursuit()
    for k in range(20):
        chase.steer(k * TICK, [40 * DEG, -40 * DEG])
    assert chase.duration == math.inf
    assert max(rested(chase, 0.4)) < 0
    chase.steer(0.4, None)
    end = chase.duration
    assert 0.4 < end < 1.0
    assert min(rested(chase, end + 0.1)) == pytest.approx(0.1)
    assert chase.speeds(end + 0.01) == [0.0, 0.0]
    assert links(chase, joints, end) == links(chase, joints, end + 1)


def test_told_to_end_at_a_limit_that_its_aim_went_beyond_it_says_when():
    chase, joints = pursuit()
    upper = joints[0].upper
    for k in range(100):
        chase.steer(k * TICK, moving([0.6 * k] * 2, 30, 30))
    assert chase.rests_from[0] == math.inf
    late = 100 * TICK + upper / (20 * DEG)
    chase.steer(late, None)
    assert chase.duration < late + 1.0
    assert links(chase, joints, chase.duration)[0] == pytest.approx(upper / DEG)


def test_the_last_aim_is_gone_to_however_near():
    chase, joints = pursuit()
    chase.steer(0.0, [0.2 * DEG, -0.2 * DEG], last=True)
    assert CROSSING_TIME < chase.duration < 0.4
    assert links(chase, joints, chase.duration) == pytest.approx([0.2, -0.2])


def test_one_joint_of_three_does_not_wait_for_another():
    joints = described("planar", max_speed=FASTEST).joints
    chase = OnlineTrajectory(joints + joints[:1], (0.0,) * 3, (1, 1, 1), 1.0)
    chase.steer(0.0, [5 * DEG, 50 * DEG, 0.0], last=True)
    since = rested(chase, chase.duration)
    assert since[1] == 0 < since[0] < since[2]


def pressed_run(aim, seconds, pressed):
    """As `run`, with the first joint's play pressed by gravity; rows of (t, q deg, side)."""
    joints = described("planar", max_speed=FASTEST).joints
    chase = OnlineTrajectory(joints, (0.0, 0.0), (1, 1), 1.0, lambda q: (pressed(q[0]), 0))
    rows = []
    for k in range(int(seconds / TICK)):
        t = k * TICK
        chase.steer(t, [aim(t) * DEG] * 2)
        rows.append((t, links(chase, joints, t)[0], chase.sides_at(t)[0]))
    return rows, chase


def test_a_joint_that_gravity_presses_turns_round_without_a_pause():
    there = {
        name: next(t for t, q, _ in rows if q < -9.99)
        for name, rows in (
            ("pressed", pressed_run(lambda t: -10, 2.0, lambda q: 1)[0]),
            ("usual", pressed_run(lambda t: -10, 2.0, lambda q: 0)[0]),
        )
    }
    assert there["usual"] - there["pressed"] == pytest.approx(CROSSING_TIME, abs=1.1 * TICK)
    rows, _ = pressed_run(lambda t: -10, 2.0, lambda q: 1)
    assert {side for _, _, side in rows} == {1}


def test_backwards_it_stirs_as_soon_as_forwards_where_gravity_presses():
    """0.6 deg back are less than a third of the play, but more than half a count."""
    rows, _ = pressed_run(lambda t: -0.6, 2.0, lambda q: 1)
    assert rows[-1][1] == pytest.approx(-0.6, abs=1e-6)
    rows, _ = pressed_run(lambda t: -0.6, 2.0, lambda q: 0)
    assert rows[-1][1] == 0


def test_where_gravity_takes_over_the_play_is_crossed_on_the_way():
    rows, _ = pressed_run(lambda t: 40, 3.0, lambda q: -1 if q > 20 * DEG else 0)
    sides = [side for _, _, side in rows]
    assert (sides[0], sides[-1]) == (1, -1)
    assert all(b <= a for a, b in zip(sides, sides[1:]))
    over = next(q for _, q, side in rows if side < 0)
    assert 20 < over < 28
    plain, _ = pressed_run(lambda t: 40, 3.0, lambda q: 0)
    assert [q for _, q, _ in rows] == pytest.approx([q for _, q, _ in plain]), "links do not wait"


def test_a_joint_at_rest_whose_play_is_pressed_elsewhere_is_not_over_before_it_is_crossed():
    turned = []
    _, chase = pressed_run(lambda t: 0, 1.0, lambda q: -1 if turned else 1)
    assert rested(chase, 1.0)[0] > 0.5
    turned.append(True)
    t = 1.0 + PRELOAD_PERIOD
    chase.steer(t, [0.0, 0.0])
    assert rested(chase, t)[0] == pytest.approx(-LEAD - CROSSING_TIME)
    assert chase.sides_at(t + LEAD + CROSSING_TIME)[0] == pytest.approx(-1)
